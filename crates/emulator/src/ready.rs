//! What `serve` prints once every port accepts connections: one line of JSON on stdout for programs, or a banner on
//! stderr for people.
//!
//! The keys of the JSON line are a public format: keys may be added, none may change. The ports themselves are
//! opened by [`ts3100_driver::driver`].

use crate::config::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::net::SocketAddr;
use ts3100_controller::port::Port;
use ts3100_driver::serial::SerialEndpoint;

/// Prints the ready line to stdout, with these TCP ports, serial lines, control address and seed of the legal variation.
///
/// # Errors
/// Stdout does not take it.
pub fn print_line(
    ports: &BTreeMap<Port, u16>,
    serial: &BTreeMap<Port, SerialEndpoint>,
    control: Option<SocketAddr>,
    vary: Option<u64>,
) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    writeln!(stdout, "{}", line(ports, serial, control, vary))?;
    stdout.flush()
}

/// The line as JSON. A channel that is no server, a port without a serial line, an interface that is off have no key. A
/// serial line is a path, or an address in the form of pyserial (`rfc2217://`, `socket://`).
fn line(
    ports: &BTreeMap<Port, u16>,
    serial: &BTreeMap<Port, SerialEndpoint>,
    control: Option<SocketAddr>,
    vary: Option<u64>,
) -> Value {
    let mut line = json!({ "event": "ready", "ports": by_name(ports, |number| json!(number)) });
    if !serial.is_empty() {
        line["serial"] = by_name(serial, |place| json!(place.to_string()));
    }
    if let Some(control) = control {
        line["control"] = json!(url(control));
    }
    if let Some(vary) = vary {
        line["vary"] = json!(vary);
    }
    line
}

/// An object with a key for each port.
fn by_name<T>(ports: &BTreeMap<Port, T>, value: fn(&T) -> Value) -> Value {
    let fields = ports.iter();
    fields
        .map(|(port, of)| (port.name().to_ascii_lowercase(), value(of)))
        .collect()
}

/// The URL of the control interface.
fn url(address: SocketAddr) -> String {
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
        let _ = writeln!(
            text,
            "  legal variation with seed {seed}; repeat it with --vary {seed}"
        );
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
            line(&all, &BTreeMap::new(), None, None).to_string(),
            r#"{"event":"ready","ports":{"ip0":1000,"ip1":1001,"ip2":1002,"ip3":1003}}"#
        );
        assert_eq!(
            line(&BTreeMap::new(), &BTreeMap::new(), None, Some(7)).to_string(),
            r#"{"event":"ready","ports":{},"vary":7}"#
        );
        let one = BTreeMap::from([(Port::Ip0, 40_001)]);
        assert_eq!(
            line(
                &one,
                &BTreeMap::new(),
                Some("127.0.0.1:3100".parse().unwrap()),
                None
            )
            .to_string(),
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
            line(&one, &serial, None, None).to_string(),
            r#"{"event":"ready","ports":{"ip0":40001},"serial":{"host":"/run/robot/host","com1":"rfc2217://127.0.0.1:2217"}}"#
        );
    }
}
