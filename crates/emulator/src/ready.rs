//! What `serve` prints once every port accepts connections: one line of JSON on stdout for programs, or a banner on
//! stderr for people.
//!
//! The keys of the JSON line are a public format: keys may be added, none may change. The ports themselves are
//! opened by [`ts3100_driver::driver`].

use crate::config::Settings;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::io::{self, Write as _};
use std::net::SocketAddr;
use ts3100_control::ControlSettings;
use ts3100_control::robots::RobotInfo;
use ts3100_controller::port::Port;
use ts3100_controller::{ControlRight, KeySwitch};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::self_check::connectable;
use ts3100_driver::serial::SerialEndpoint;

/// What the banner and the log say about `--control-open`.
pub const OPEN_WARNING: &str =
    "the control interface accepts every call (--control-open); whoever reaches it controls the robot";

/// Robots that the banner names before the last.
const BANNER_ROBOTS: usize = 8;

/// Prints a ready line to stdout.
///
/// # Errors
/// Stdout does not take it.
pub fn print_line(line: &Value) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    writeln!(stdout, "{line}")?;
    stdout.flush()
}

/// The ready line of a robot with these TCP ports, serial lines, control address and seed of the legal variation. A channel
/// that is no server, a port without a serial line, an interface that is off have no key. A serial line is a path, or an
/// address in the form of pyserial (`rfc2217://`, `socket://`).
pub fn line(
    ports: &BTreeMap<Port, u16>,
    serial: &BTreeMap<Port, SerialEndpoint>,
    control: Option<SocketAddr>,
    vary: Option<u64>,
) -> Value {
    let mut line = json!({ "event": "ready", "ports": by_name(ports, |number| json!(number)) });
    if !serial.is_empty() {
        line["serial"] = by_name(serial, |place| json!(place.to_string()));
    }
    with_process(line, control, vary)
}

/// A ready line with what belongs to the process.
fn with_process(mut line: Value, control: Option<SocketAddr>, vary: Option<u64>) -> Value {
    if let Some(control) = control {
        line["control"] = json!(url(control));
    }
    if let Some(vary) = vary {
        line["vary"] = json!(vary);
    }
    line
}

/// The ready line of several robots: as that of one, with the addresses of each by its name. Those may differ.
pub fn fleet_line(robots: &[RobotInfo], control: Option<SocketAddr>, vary: Option<u64>) -> Value {
    let robot = |robot: &RobotInfo| {
        let address = robot.ports.values().next().map(|address| json!(address.ip()));
        let ports = robot
            .ports
            .iter()
            .map(|(name, address)| (name.clone(), json!(address.port())));
        let mut value = json!({ "address": address, "ports": ports.collect::<Value>() });
        if !robot.serial.is_empty() {
            value["serial"] = json!(robot.serial);
        }
        (robot.name.clone(), value)
    };
    let line = json!({ "event": "ready", "robots": robots.iter().map(robot).collect::<Value>() });
    with_process(line, control, vary)
}

/// The banner of several robots.
pub struct FleetBanner<'a> {
    /// The robots.
    pub robots: &'a [RobotInfo],
    /// The address of the control interface, if there is one.
    pub control: Option<SocketAddr>,
    /// A call needs a token.
    pub has_token: bool,
}

impl FleetBanner<'_> {
    /// The robots and the control interface on one line.
    pub fn summary(&self) -> String {
        let control = self.control.map(|address| format!(", control {}", url(address)));
        format!("{} robots{}", self.robots.len(), control.unwrap_or_default())
    }
}

impl Display for FleetBanner<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let count = self.robots.len();
        writeln!(f, "{count} robots are ready.")?;
        // The first and the last tell how the addresses go on.
        let shown = self.robots.iter().take(BANNER_ROBOTS);
        let last = self.robots.last().filter(|_| count > BANNER_ROBOTS);
        for robot in shown {
            write_robot(f, robot)?;
        }
        if let Some(last) = last {
            if count > BANNER_ROBOTS + 1 {
                writeln!(f, "  ...")?;
            }
            write_robot(f, last)?;
        }
        let Some(first) = self.robots.first() else {
            return Ok(());
        };
        if let Some(control) = self.control {
            writeln!(f, "  control {}  all of them: /robots", url(control))?;
            writeln!(f, "Open {} in a browser.", dialled_url(control))?;
        }
        writeln!(f, "Try in a second terminal:")?;
        if let Some(ip0) = first.ports.get("ip0") {
            writeln!(f, "  ts3100 host {ip0} su")?;
        }
        if let Some(control) = self.control.filter(|_| !self.has_token) {
            writeln!(
                f,
                "  ts3100 ctl --url {} --robot {} state",
                dialled_url(control),
                first.name
            )?;
        }
        writeln!(f, "Press Ctrl-C to end it.")
    }
}

fn write_robot(f: &mut Formatter<'_>, robot: &RobotInfo) -> fmt::Result {
    let ports = robot
        .ports
        .iter()
        .map(|(name, address)| format!("{} {address}", name.to_ascii_uppercase()));
    let serial = robot
        .serial
        .iter()
        .map(|(name, place)| format!("{} {place}", name.to_ascii_uppercase()));
    let places: Vec<String> = ports.chain(serial).collect();
    writeln!(f, "  {:<10} {}", robot.name, places.join("  "))
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

/// The URL of the control interface, for programs on this machine.
fn dialled_url(address: SocketAddr) -> String {
    url(SocketAddr::new(connectable(address.ip()), address.port()))
}

/// What the banner is about.
pub struct Banner<'a> {
    /// The configuration of the emulator.
    pub settings: &'a Settings,
    /// The TCP ports it listens on.
    pub ports: &'a BTreeMap<Port, u16>,
    /// The serial lines it serves.
    pub serial: &'a BTreeMap<Port, SerialEndpoint>,
    /// The address of the control interface, if there is one.
    pub control: Option<SocketAddr>,
    /// The example programs are on the RAM drive.
    pub has_examples: bool,
}

impl Display for Banner<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let settings = self.settings;
        writeln!(f, "ts3100 is ready.")?;
        self.write_ports(f)?;
        let file = settings.files.select.as_deref().unwrap_or("none");
        writeln!(
            f,
            "  selected file: {file}; arm: {}; time: {}",
            settings.controller.model.name, settings.time
        )?;
        if let Some(seed) = settings.controller.vary {
            writeln!(
                f,
                "  legal variation with seed {seed}; repeat it with --vary {seed}"
            )?;
        }
        if settings
            .control
            .as_ref()
            .is_some_and(ControlSettings::accepts_everybody)
        {
            writeln!(f, "  warning: {OPEN_WARNING}")?;
        }
        if let Some(control) = self.control {
            writeln!(f, "Open {} in a browser.", dialled_url(control))?;
        }
        self.write_commands(f)?;
        writeln!(f, "Press Ctrl-C to end it.")
    }
}

impl Banner<'_> {
    /// Every port and the control interface with its address, on one line.
    pub fn summary(&self) -> String {
        let ports = self.places().map(|(port, place)| format!("{port} {place}"));
        let control = self.control.map(|address| format!("control {}", url(address)));
        ports.chain(control).collect::<Vec<_>>().join(", ")
    }

    /// Every port with its address.
    fn places(&self) -> impl Iterator<Item = (Port, String)> {
        let listen = self.settings.listen;
        let ports = self.ports.iter();
        let ports = ports.map(move |(port, number)| (*port, SocketAddr::new(listen, *number).to_string()));
        ports.chain(self.serial.iter().map(|(port, place)| (*port, place.to_string())))
    }

    fn write_ports(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (port, place) in self.places() {
            let purpose = match port {
                Port::Ip0 | Port::Host => "commands of the host (simple protocol)",
                Port::Ip1 | Port::Ip2 | Port::Com1 => "PRINT and INPUT of the SCOL program",
                Port::Ip3 => "dedicated protocol; what arrives is discarded",
            };
            writeln!(f, "  {:<4} {place:<22} {purpose}", port.name())?;
        }
        if let Some(control) = self.control {
            let control = url(control);
            writeln!(
                f,
                "  control {control}  state, lines, files, time: for people and programs"
            )?;
        }
        Ok(())
    }

    /// Commands that do as they are when pasted one after the other.
    fn write_commands(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(ip0) = self.ports.get(&Port::Ip0) else {
            return Ok(());
        };
        let settings = self.settings;
        let host = SocketAddr::new(connectable(settings.listen), *ip0);
        writeln!(f, "Try in a second terminal:")?;
        writeln!(f, "  ts3100 host {host} su")?;
        let controller = &settings.controller;
        let host_may_start =
            controller.key == KeySwitch::Ext && controller.control_right == ControlRight::Ether;
        if !self.has_examples || !host_may_start || settings.time == TimeMode::Stepped {
            return Ok(());
        }
        if !settings.servo_on {
            writeln!(f, "  ts3100 host {host} so")?;
        }
        writeln!(f, "  ts3100 host {host} sl DEMO")?;
        writeln!(f, "  ts3100 host {host} rn --wait")?;
        // With a token the command would need it, and a secret does not belong on a screen.
        let has_token = |control: &ControlSettings| control.token.is_some();
        match self.control {
            Some(control) if !settings.control.as_ref().is_some_and(has_token) => {
                writeln!(f, "  ts3100 ctl --url {} pendant", dialled_url(control))
            }
            _ => Ok(()),
        }
    }
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
