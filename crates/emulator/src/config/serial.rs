//! Endpoints of the serial ports HOST and COM1. The flags of both ports are merged, and two ways to one port are
//! refused.
//!
//! Each way (pseudo terminal, device, RFC 2217, TCP) is implemented in [`ts3100_driver::serial`].

use super::ConfigError;
use super::args::{ListenAt, SerialArgs};
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use ts3100_controller::Port;
use ts3100_driver::serial::SerialEndpoint;

fn address(at: ListenAt, listen: IpAddr) -> SocketAddr {
    match at {
        ListenAt::Address(address) => address,
        ListenAt::Port(port) => SocketAddr::new(listen, port),
    }
}

/// The endpoint of each serial port for which a flag is given.
pub(super) fn serial_ends(
    args: &SerialArgs,
    listen: IpAddr,
) -> Result<BTreeMap<Port, SerialEndpoint>, ConfigError> {
    // The name is that in the flags (`--serial-host`), and of the link in the directory of `--serial-dir`.
    let ports = [
        (
            Port::Host,
            "host",
            &args.serial_host,
            args.serial_host_rfc2217,
            args.serial_host_tcp,
        ),
        (
            Port::Com1,
            "com1",
            &args.serial_com1,
            args.serial_com1_rfc2217,
            args.serial_com1_tcp,
        ),
    ];
    let mut ends = BTreeMap::new();
    for (port, link, device, rfc2217, tcp) in ports {
        let directory = args.serial_dir.as_ref();
        let pty = directory.map(|directory| SerialEndpoint::Pty(directory.join(link)));
        let device = device.clone().map(SerialEndpoint::Device);
        let rfc2217 = rfc2217.map(|at| SerialEndpoint::Rfc2217(address(at, listen)));
        let tcp = tcp.map(|at| SerialEndpoint::Tcp(address(at, listen)));
        let candidates = [
            ("--serial-dir".to_owned(), pty),
            (format!("--serial-{link}"), device),
            (format!("--serial-{link}-rfc2217"), rfc2217),
            (format!("--serial-{link}-tcp"), tcp),
        ];
        let mut candidates = candidates
            .into_iter()
            .filter_map(|(flag, end)| Some((flag, end?)));
        let Some((first, end)) = candidates.next() else {
            continue;
        };
        if let Some((second, _)) = candidates.next() {
            return Err(ConfigError::SerialTwice { port, first, second });
        }
        ends.insert(port, end);
    }
    Ok(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends_of(args: &SerialArgs) -> Result<BTreeMap<Port, SerialEndpoint>, String> {
        serial_ends(args, "127.0.0.1".parse().unwrap()).map_err(|error| error.to_string())
    }

    #[test]
    fn addresses_are_read_with_and_without_their_host() {
        let address = |word: &str| {
            word.parse::<ListenAt>()
                .map(|at| address(at, "10.0.0.1".parse().unwrap()))
        };
        for (word, expected) in [
            ("2217", "10.0.0.1:2217"),
            (":0", "10.0.0.1:0"),
            ("0.0.0.0:2217", "0.0.0.0:2217"),
            ("[::1]:5", "[::1]:5"),
        ] {
            assert_eq!(address(word).unwrap(), expected.parse().unwrap(), "{word}");
        }
        for word in ["", ":", "localhost", "70000", "1.2.3.4", "a:b"] {
            assert!(address(word).unwrap_err().to_string().contains(word), "{word}");
        }
    }

    #[test]
    fn each_port_has_one_way() {
        let directory = SerialArgs {
            serial_dir: Some("/run/robot".into()),
            ..SerialArgs::default()
        };
        let both = ends_of(&directory).unwrap();
        assert_eq!(both[&Port::Host], SerialEndpoint::Pty("/run/robot/host".into()));
        assert_eq!(both[&Port::Com1], SerialEndpoint::Pty("/run/robot/com1".into()));
        let mixed = SerialArgs {
            serial_host_rfc2217: Some(ListenAt::Port(0)),
            serial_com1: Some("/dev/ttyUSB0".into()),
            ..SerialArgs::default()
        };
        let mixed = ends_of(&mixed).unwrap();
        assert_eq!(
            mixed[&Port::Host],
            SerialEndpoint::Rfc2217("127.0.0.1:0".parse().unwrap())
        );
        assert_eq!(mixed[&Port::Com1], SerialEndpoint::Device("/dev/ttyUSB0".into()));
        assert!(ends_of(&SerialArgs::default()).unwrap().is_empty());
        let twice = SerialArgs {
            serial_com1_tcp: Some(ListenAt::Port(1)),
            ..directory
        };
        let error = ends_of(&twice).unwrap_err();
        assert!(
            error.contains("COM1") && error.contains("--serial-dir") && error.contains("--serial-com1-tcp"),
            "{error}"
        );
    }
}
