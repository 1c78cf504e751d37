//! Reads the names of real serial ports, and recognises network addresses that were meant for `--listen`.

use clap::builder::{PathBufValueParser, TypedValueParser};
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};

/// Reads the name of a serial port of this machine. A network address is refused: `--serial-host` is the serial port
/// HOST, not the address of a host.
pub(super) fn serial_device() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|device| {
        if is_network_name(&device) {
            Err("a network address is not a serial port; did you mean --listen?")
        } else {
            Ok(device)
        }
    })
}

/// An IP address with or without a port, or a name that can only be one of a network host. Serial ports of Unix are
/// paths; on Windows they may have any name (`CNCA0`), so only a dot or a colon tells.
fn is_network_name(device: &Path) -> bool {
    let Some(word) = device.to_str().filter(|word| !word.contains(['/', '\\'])) else {
        return false;
    };
    let is_address = word.parse::<IpAddr>().is_ok() || word.parse::<SocketAddr>().is_ok();
    let is_com = word
        .get(..3)
        .is_some_and(|start| start.eq_ignore_ascii_case("com"))
        && word[3..].bytes().all(|byte| byte.is_ascii_digit());
    let is_name = cfg!(unix) || word.contains(['.', ':']) || word == "localhost";
    is_address || (is_name && !is_com && !device.exists())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_address_is_no_serial_port() {
        for word in ["127.0.0.1", "::1", "0.0.0.0:2217", "localhost", "robot.example"] {
            assert!(is_network_name(Path::new(word)), "{word}");
        }
        for word in ["/dev/ttyUSB0", "COM3", "com12", r"\\.\COM12", "./robot"] {
            assert!(!is_network_name(Path::new(word)), "{word}");
        }
    }
}
