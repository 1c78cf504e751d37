//! Message of `serve` once every port accepts connections: one line of JSON on stdout for programs, or a banner on
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
use std::path::Path;
use ts3100_control::ControlSettings;
use ts3100_control::robots::RobotInfo;
use ts3100_controller::port::Port;
use ts3100_controller::{ControlRight, KeySwitch};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::self_check::connectable;

/// Warning of the banner and the log about `--control-open`.
pub const OPEN_WARNING: &str =
    "the control interface accepts every call (--control-open); anyone who can reach it controls the robot";

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

/// A ready line with these TCP ports of one robot alone.
pub fn ports_line(ports: &BTreeMap<Port, u16>) -> Value {
    let ports = ports.iter().map(|(port, number)| (word(*port), json!(number)));
    json!({ "event": "ready", "ports": ports.collect::<Value>() })
}

fn word(port: Port) -> String {
    port.name().to_ascii_lowercase()
}

/// Message about the robots of a process once every port accepts connections, to programs and to people. A robot that
/// is alone and has no name is a list of one that is written without the list.
pub struct Ready<'a> {
    /// The robots.
    pub robots: &'a [RobotInfo],
    /// The only robot, unless it is one of a list.
    pub only: Option<Only<'a>>,
    /// The address of the control interface, if there is one.
    pub control: Option<SocketAddr>,
    /// A call of the control interface needs a token.
    pub has_token: bool,
    /// The seed of the legal variation.
    pub vary: Option<u64>,
    /// It runs in a container: what others reach it by is decided outside, so no page is named.
    pub in_container: bool,
}

/// Files that container engines put into every container.
const CONTAINER_MARKS: [&str; 2] = ["/.dockerenv", "/run/.containerenv"];

/// Whether this process is what a container runs: its first, or the child of an init (`docker run --init`). A shell in a
/// development container is not meant, where the editor forwards ports.
pub fn in_container() -> bool {
    let is_first = std::process::id() == 1;
    #[cfg(unix)]
    let is_child_of_first = std::os::unix::process::parent_id() == 1;
    #[cfg(not(unix))]
    let is_child_of_first = false;
    let has_mark = || CONTAINER_MARKS.iter().any(|mark| Path::new(mark).exists());
    is_first || (is_child_of_first && has_mark())
}

/// A robot that is alone.
pub struct Only<'a> {
    /// Its configuration.
    pub settings: &'a Settings,
    /// The example programs are on the RAM drive.
    pub has_examples: bool,
}

impl Ready<'_> {
    /// The ready line. A channel that does not listen, a port without a serial line and an interface that is off have
    /// no key. A serial line is a path, or an address in the form of pyserial (`rfc2217://`, `socket://`). Each robot
    /// of a list has its address besides; those may differ.
    pub fn line(&self) -> Value {
        let mut line = json!({ "event": "ready" });
        match (&self.only, self.robots) {
            (Some(_), [robot]) => add_ports(&mut line, robot),
            _ => {
                let robots = self.robots.iter().map(|robot| {
                    let address = robot.ports.values().next().map(|address| json!(address.ip()));
                    let mut value = json!({ "address": address });
                    add_ports(&mut value, robot);
                    (robot.name.clone(), value)
                });
                line["robots"] = robots.collect();
            }
        }
        if let Some(control) = self.control {
            line["control"] = json!(url(control));
        }
        if let Some(vary) = self.vary {
            line["vary"] = json!(vary);
        }
        line
    }

    /// The robots and the control interface on one line.
    pub fn summary(&self) -> String {
        let robots: Vec<String> = match (&self.only, self.robots) {
            (Some(only), [robot]) => {
                let places = only.places(robot);
                places.map(|(port, place)| format!("{port} {place}")).collect()
            }
            _ => vec![format!("{} robots", self.robots.len())],
        };
        let control = self.control.map(|address| format!("control {}", url(address)));
        robots.into_iter().chain(control).collect::<Vec<_>>().join(", ")
    }

    fn write_robots(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let count = self.robots.len();
        // The first and the last tell how the addresses go on.
        for robot in self.robots.iter().take(BANNER_ROBOTS) {
            write_robot(f, robot)?;
        }
        if let Some(last) = self.robots.last().filter(|_| count > BANNER_ROBOTS) {
            if count > BANNER_ROBOTS + 1 {
                writeln!(f, "  ...")?;
            }
            write_robot(f, last)?;
        }
        if let Some(control) = self.control {
            writeln!(f, "  control {}  all of them: /robots", url(control))?;
        }
        Ok(())
    }

    /// Commands that do as they are when pasted one after the other.
    fn write_commands(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Some(first) = self.robots.first() else {
            return Ok(());
        };
        // With a token the command would need it, and a secret does not belong on a screen.
        let url = self.control.filter(|_| !self.has_token).map(dialled_url);
        let ip0 = first.ports.get("ip0");
        let Some(only) = &self.only else {
            writeln!(f, "Try in a second terminal:")?;
            if let Some(ip0) = ip0 {
                writeln!(f, "  ts3100 host {ip0} su")?;
            }
            return match url {
                Some(url) => writeln!(f, "  ts3100 ctl --url {url} --robot {} state", first.name),
                None => Ok(()),
            };
        };
        let Some(ip0) = ip0 else {
            return Ok(());
        };
        writeln!(f, "Try in a second terminal:")?;
        writeln!(f, "  ts3100 host {ip0} su")?;
        if !only.can_start_examples() {
            return Ok(());
        }
        if !only.settings.servo_on {
            writeln!(f, "  ts3100 host {ip0} so")?;
        }
        writeln!(f, "  ts3100 host {ip0} sl DEMO")?;
        writeln!(f, "  ts3100 host {ip0} rn --wait")?;
        match url {
            Some(url) => writeln!(f, "  ts3100 ctl --url {url} pendant"),
            None => Ok(()),
        }
    }
}

impl Display for Ready<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match (&self.only, self.robots) {
            (Some(only), [robot]) => {
                writeln!(f, "ts3100 is ready.")?;
                only.write(f, robot, self.control)?;
            }
            _ => {
                writeln!(f, "{} robots are ready.", self.robots.len())?;
                self.write_robots(f)?;
            }
        }
        if let Some(control) = self.control.filter(|_| !self.in_container) {
            writeln!(f, "Open {} in a browser.", dialled_url(control))?;
        }
        self.write_commands(f)?;
        writeln!(f, "Press Ctrl-C to end it.")
    }
}

impl Only<'_> {
    /// Every port with its address.
    fn places(&self, robot: &RobotInfo) -> impl Iterator<Item = (Port, String)> {
        let listen = self.settings.listen;
        let ports = Port::ETHERNET.into_iter().filter_map(move |port| {
            let number = robot.ports.get(&word(port))?.port();
            Some((port, SocketAddr::new(listen, number).to_string()))
        });
        let lines = Port::SERIAL.into_iter();
        ports.chain(lines.filter_map(|port| Some((port, robot.serial.get(&word(port))?.clone()))))
    }

    fn write(&self, f: &mut Formatter<'_>, robot: &RobotInfo, control: Option<SocketAddr>) -> fmt::Result {
        for (port, place) in self.places(robot) {
            let purpose = match port {
                Port::Ip0 | Port::Host => "commands of the host (simple protocol)",
                Port::Ip1 | Port::Ip2 | Port::Com1 => "PRINT and INPUT of the SCOL program",
                Port::Ip3 => "dedicated protocol; received bytes are discarded",
            };
            writeln!(f, "  {:<4} {place:<22} {purpose}", port.name())?;
        }
        if let Some(control) = control {
            let control = url(control);
            writeln!(f, "  control {control}  web page and HTTP API")?;
        }
        let settings = self.settings;
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
        Ok(())
    }

    /// Whether a host can select an example and run it to its end.
    fn can_start_examples(&self) -> bool {
        let controller = &self.settings.controller;
        self.has_examples
            && controller.key == KeySwitch::Ext
            && controller.control_right == ControlRight::Ether
            && self.settings.time != TimeMode::Stepped
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

/// Adds the ports and serial lines of a robot to what is said of it.
fn add_ports(value: &mut Value, robot: &RobotInfo) {
    let ports = robot.ports.iter();
    let numbers = ports.map(|(name, address)| (name.clone(), json!(address.port())));
    value["ports"] = numbers.collect();
    if !robot.serial.is_empty() {
        let lines = Port::SERIAL.map(word).into_iter();
        let places = lines.filter_map(|name| {
            let place = json!(robot.serial.get(&name)?);
            Some((name, place))
        });
        value["serial"] = places.collect();
    }
}

/// The URL of the control interface.
fn url(address: SocketAddr) -> String {
    format!("http://{address}")
}

/// The URL of the control interface, for programs on this machine.
fn dialled_url(address: SocketAddr) -> String {
    url(SocketAddr::new(connectable(address.ip()), address.port()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ServeArgs;

    fn robot(ports: &[(&str, u16)], serial: &[(&str, &str)]) -> RobotInfo {
        let address = |number: u16| SocketAddr::from(([127, 0, 0, 1], number));
        let ports = ports.iter();
        let serial = serial.iter();
        RobotInfo {
            name: "robot-1".to_owned(),
            ports: ports
                .map(|(name, number)| ((*name).to_owned(), address(*number)))
                .collect(),
            serial: serial
                .map(|(name, place)| ((*name).to_owned(), (*place).to_owned()))
                .collect(),
            started: true,
        }
    }

    /// The ready line of a robot that is alone.
    fn line(robot: RobotInfo, control: Option<&str>, vary: Option<u64>) -> String {
        let settings = Settings::from_args(&ServeArgs::default()).unwrap();
        let only = Only {
            settings: &settings,
            has_examples: false,
        };
        let ready = Ready {
            robots: &[robot],
            only: Some(only),
            control: control.map(|control| control.parse().unwrap()),
            has_token: false,
            vary,
            in_container: false,
        };
        ready.line().to_string()
    }

    #[test]
    fn the_line_is_the_documented_one() {
        let all = [("ip0", 1_000), ("ip1", 1_001), ("ip2", 1_002), ("ip3", 1_003)];
        let documented = r#"{"event":"ready","ports":{"ip0":1000,"ip1":1001,"ip2":1002,"ip3":1003}}"#;
        assert_eq!(line(robot(&all, &[]), None, None), documented);
        let ports = Port::ETHERNET.into_iter().zip(1000..).collect();
        assert_eq!(ports_line(&ports).to_string(), documented);
        assert_eq!(
            line(robot(&[], &[]), None, Some(7)),
            r#"{"event":"ready","ports":{},"vary":7}"#
        );
        let one = [("ip0", 40_001)];
        assert_eq!(
            line(robot(&one, &[]), Some("127.0.0.1:3100"), None),
            r#"{"event":"ready","ports":{"ip0":40001},"control":"http://127.0.0.1:3100"}"#
        );
        let serial = [("com1", "rfc2217://127.0.0.1:2217"), ("host", "/run/robot/host")];
        assert_eq!(
            line(robot(&one, &serial), None, None),
            r#"{"event":"ready","ports":{"ip0":40001},"serial":{"host":"/run/robot/host","com1":"rfc2217://127.0.0.1:2217"}}"#
        );
    }
}
