//! What `serve` prints once every port accepts connections: one line of JSON on stdout for programs, or a banner on
//! stderr for people.
//!
//! The keys of the JSON line are a public format: keys may be added, none may change. The ports themselves are
//! opened by [`ts3100_driver::driver`].

use crate::config::Settings;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::net::SocketAddr;
use ts3100_controller::port::Port;
use ts3100_driver::serial::SerialEndpoint;

/// The ready line on stdout. Keys may be added; none may change.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Ready {
    event: &'static str,
    ports: ReadyPorts,
    #[serde(skip_serializing_if = "ReadySerial::is_empty")]
    serial: ReadySerial,
    /// URL of the control interface; no key without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vary: Option<u64>,
}

/// The serial lines: a path, or an address in the form of pyserial (`rfc2217://`, `socket://`). A port without a line has
/// no key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct ReadySerial {
    #[serde(skip_serializing_if = "Option::is_none")]
    host: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    com1: Option<String>,
}

impl ReadySerial {
    fn is_empty(&self) -> bool {
        self.host.is_none() && self.com1.is_none()
    }
}

/// The port each server channel accepts on; a channel that is no server has no key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
struct ReadyPorts {
    #[serde(skip_serializing_if = "Option::is_none")]
    ip0: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ip1: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ip2: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ip3: Option<u16>,
}

impl Ready {
    /// A ready line with these TCP ports, serial lines and control address.
    #[must_use]
    pub fn new(
        ports: &BTreeMap<Port, u16>,
        serial: &BTreeMap<Port, SerialEndpoint>,
        control: Option<SocketAddr>,
    ) -> Ready {
        let place = |port| serial.get(&port).map(ToString::to_string);
        let of = |port| ports.get(&port).copied();
        let ports = ReadyPorts {
            ip0: of(Port::Ip0),
            ip1: of(Port::Ip1),
            ip2: of(Port::Ip2),
            ip3: of(Port::Ip3),
        };
        Ready {
            event: "ready",
            ports,
            serial: ReadySerial {
                host: place(Port::Host),
                com1: place(Port::Com1),
            },
            control: control.map(url),
            vary: None,
        }
    }

    /// Adds the seed of the legal variation.
    #[must_use]
    pub fn with_variation(self, vary: Option<u64>) -> Ready {
        Ready { vary, ..self }
    }

    /// The line as JSON, without a line feed.
    ///
    /// # Errors
    /// None that this value can cause; serde's signature.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}

/// The URL of the control interface.
#[must_use]
pub fn url(address: SocketAddr) -> String {
    format!("http://{address}")
}

/// The banner for people: ports, selected file, and commands to try.
#[must_use]
pub fn banner(
    settings: &Settings,
    ports: &BTreeMap<Port, u16>,
    serial: &BTreeMap<Port, SerialEndpoint>,
    control: Option<SocketAddr>,
    demo: bool,
) -> String {
    let mut text = String::from("ts3100 is ready.\n");
    for (port, number) in ports {
        let purpose = match port {
            Port::Ip0 => "commands of the host (simple protocol)",
            Port::Ip1 | Port::Ip2 => "PRINT and INPUT of the SCOL program",
            Port::Ip3 => "dedicated protocol; what arrives is discarded",
            Port::Host | Port::Com1 => "serial",
        };
        let address = SocketAddr::new(settings.listen, *number);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  {port}  {address:<22} {purpose}");
    }
    for (port, place) in serial {
        let place = place.to_string();
        let purpose = if port.protocol().is_some() {
            "commands of the host (simple protocol)"
        } else {
            "PRINT and INPUT of the SCOL program"
        };
        let _ = writeln!(text, "  {port:<4} {place:<22} {purpose}");
    }
    if let Some(control) = control {
        let control = url(control);
        let _ = writeln!(
            text,
            "  control {control}  state, lines, files, time: for people and programs"
        );
    }
    let file = settings.select.as_deref().unwrap_or("none");
    let _ = writeln!(
        text,
        "  selected file: {file}; arm: {}; time: {}",
        settings.controller.model.name, settings.time
    );
    if let Some(seed) = settings.controller.vary {
        let _ = writeln!(text, "  legal variation by seed {seed}; --vary {seed} repeats it");
    }
    if let Some(ip0) = ports.get(&Port::Ip0) {
        let host = format!("ts3100 host {}", SocketAddr::new(settings.listen, *ip0));
        let _ = writeln!(text, "Try in a second terminal:");
        let _ = writeln!(text, "  {host} su");
        if demo {
            let _ = writeln!(
                text,
                "  {host} so    then  sl DEMO  and  rn; the program talks on IP1"
            );
        }
    }
    text.push_str("Ctrl-C ends it.\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_the_documented_one() {
        let all: BTreeMap<Port, u16> = Port::ETHERNET.into_iter().zip(1000..).collect();
        assert_eq!(
            Ready::new(&all, &BTreeMap::new(), None).to_json().unwrap(),
            r#"{"event":"ready","ports":{"ip0":1000,"ip1":1001,"ip2":1002,"ip3":1003}}"#
        );
        assert_eq!(
            Ready::new(&BTreeMap::new(), &BTreeMap::new(), None)
                .with_variation(Some(7))
                .to_json()
                .unwrap(),
            r#"{"event":"ready","ports":{},"vary":7}"#
        );
        let one = BTreeMap::from([(Port::Ip0, 40_001)]);
        assert_eq!(
            Ready::new(&one, &BTreeMap::new(), Some("127.0.0.1:3100".parse().unwrap()))
                .to_json()
                .unwrap(),
            r#"{"event":"ready","ports":{"ip0":40001},"control":"http://127.0.0.1:3100"}"#
        );
        let serial = BTreeMap::from([
            (Port::Host, SerialEndpoint::Pty("/run/robot/host".into())),
            (
                Port::Com1,
                SerialEndpoint::Rfc2217("127.0.0.1:2217".parse().unwrap()),
            ),
        ]);
        assert_eq!(
            Ready::new(&one, &serial, None).to_json().unwrap(),
            r#"{"event":"ready","ports":{"ip0":40001},"serial":{"host":"/run/robot/host","com1":"rfc2217://127.0.0.1:2217"}}"#
        );
    }
}
