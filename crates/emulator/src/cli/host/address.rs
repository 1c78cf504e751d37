//! Connects `ts3100 host` to a controller. If there is no reply, the message names the port that may have been meant:
//! one of an emulator on this machine ([`crate::instances`]).

use crate::config::args::FIRST_PORT;
use crate::instances::{self, Instance};
use std::fmt::Display;
use std::net::IpAddr;
use std::time::Duration;
use ts3100_host::TcpTransport;

/// An address that cannot be dialled.
#[derive(Debug, thiserror::Error)]
#[error("cannot connect to `{address}`: {reason}")]
pub(super) struct AddressError {
    address: String,
    reason: String,
}

/// The controller gave no reply, or one that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct NoAnswer(String);

impl NoAnswer {
    pub(super) fn new(reason: impl Display) -> NoAnswer {
        NoAnswer(reason.to_string())
    }
}

/// Connects to the first address of a name that takes the connection.
pub(super) fn dial(address: &str, timeout: Duration) -> anyhow::Result<TcpTransport> {
    if let Some(reason) = missing_port(address) {
        let address = address.to_owned();
        return Err(AddressError { address, reason }.into());
    }
    TcpTransport::connect(address, timeout).map_err(|error| {
        let hint = robot_hint(address);
        NoAnswer::new(format_args!("cannot connect to {address}: {error}{hint}")).into()
    })
}

/// Suggestion for an address without a port.
fn missing_port(address: &str) -> Option<String> {
    let host = match (address.parse(), address.rsplit_once(':')) {
        (Ok(IpAddr::V6(address)), _) => format!("[{address}]"),
        (Err(_), Some((_, port))) if port.parse::<u16>().is_ok() => return None,
        (Err(_), Some((_, port))) if !port.is_empty() => {
            return Some(format!(
                "the port is a number from 1 to 65535, as in 127.0.0.1:{FIRST_PORT}"
            ));
        }
        _ => address.trim_end_matches(':').to_owned(),
    };
    Some(format!("add the port of IP0: {host}:{FIRST_PORT}"))
}

/// End of a message about an address without a reply: where commands go instead, if that is known.
pub(super) fn robot_hint(address: &str) -> String {
    hint(address, &instances::running())
}

fn hint(address: &str, running: &[Instance]) -> String {
    let ip0 = |instance: &Instance| instance.ports.get("IP0").map(ToString::to_string);
    for instance in running {
        if let (Some(port), Some(ip0)) = (instance.port_at(address), ip0(instance))
            && port != "IP0"
        {
            return format!(". This is {port} of the robot; commands go to IP0: {ip0}");
        }
    }
    let running: Vec<String> = running.iter().filter_map(ip0).collect();
    match running.as_slice() {
        [ip0] if ip0 != address => format!(". The emulator of this machine has IP0 at {ip0}"),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn an_address_without_a_port_is_completed_in_the_message() {
        for (address, expected) in [
            ("127.0.0.1", "127.0.0.1:1000"),
            ("robot", "robot:1000"),
            ("robot:", "robot:1000"),
            ("::1", "[::1]:1000"),
            ("robot:x", "number from 1 to 65535"),
        ] {
            let reason = missing_port(address).unwrap();
            assert!(reason.contains(expected), "{address}: {reason}");
        }
        for address in ["127.0.0.1:1000", "robot:1", "[::1]:1000"] {
            assert_eq!(missing_port(address), None, "{address}");
        }
    }

    #[test]
    fn the_port_that_was_meant_is_named() {
        let at = |port| format!("127.0.0.1:{port}").parse().unwrap();
        let instance = Instance {
            pid: 7,
            control: None,
            ports: BTreeMap::from([("IP0".to_owned(), at(11000)), ("IP1".to_owned(), at(11001))]),
        };
        let running = std::slice::from_ref(&instance);
        assert_eq!(
            hint("127.0.0.1:11001", running),
            ". This is IP1 of the robot; commands go to IP0: 127.0.0.1:11000"
        );
        assert_eq!(
            hint("127.0.0.1:1000", running),
            ". The emulator of this machine has IP0 at 127.0.0.1:11000"
        );
        assert_eq!(hint("127.0.0.1:11000", running), "");
        assert_eq!(hint("127.0.0.1:1000", &[]), "");
    }
}
