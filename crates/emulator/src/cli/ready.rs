//! `ts3100 ready`: asks whether an emulator answers, or waits until it does.
//!
//! The address follows from the variables that configure `serve`, and from the state files of running emulators
//! ([`crate::instances`]), so that a start-up script or the health check of a container needs no address. `/health` is
//! asked with [`ts3100_control::client`]; without a control interface IP0 is connected to and closed again.

use super::ctl::target::{self, TargetError};
use super::exit::{NO_ANSWER, NOT_REACHED};
use super::output;
use crate::config::args::{FIRST_PORT, seconds};
use crate::config::{self, Environment, Ports, ServeArgs, Settings};
use crate::instances::{self, Instance};
use crate::log::print_error;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt;
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use ts3100_control::URL_VARIABLE;
use ts3100_control::client::Client;
use ts3100_controller::port::Port;
use ts3100_driver::driver::self_check::connectable;

/// Longest time one question takes.
const QUESTION_TIMEOUT: Duration = Duration::from_secs(2);
/// Pause between two questions.
const PAUSE: Duration = Duration::from_millis(50);

/// Check that an emulator is ready, or wait until it is.
///
/// Asks the control interface at --url, at TS3100_CONTROL_URL, or where TS3100_CONTROL or TS3100_PORT_OFFSET put it;
/// without these, the only emulator on this computer. If the control interface is off, it connects to IP0 instead.
///
/// Exit codes: 0 ready; 2 wrong usage; 3 no answer; 4 no answer within --wait.
#[derive(Debug, Args)]
pub(super) struct ReadyArgs {
    /// Wait up to this long, such as 10s or 500ms [default: ask once]
    #[arg(long, value_name = "TIME", value_parser = seconds("0s", "1440min"))]
    wait: Option<Duration>,
    /// URL of the control interface [env: TS3100_CONTROL_URL]
    #[arg(long, value_name = "URL")]
    url: Option<String>,
    /// Print one line of JSON: whether it is ready, where it was asked, and why it is not
    #[arg(long)]
    json: bool,
}

/// Place to ask.
enum Target {
    /// The control interface at this URL, with its token.
    Control(String, Option<String>),
    /// IP0, because there is no control interface.
    Ip0(SocketAddr),
    /// An emulator that is on free ports and has no state file yet.
    NotFound,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Target::Control(url, _) => write!(f, "the emulator at {url}"),
            Target::Ip0(address) => write!(f, "the emulator with IP0 at {address}"),
            Target::NotFound => f.write_str("the emulator"),
        }
    }
}

/// Asks until an emulator answers or the wait ends.
pub(super) fn run(args: &ReadyArgs) -> anyhow::Result<u8> {
    let environment = config::environment();
    let until = Instant::now() + args.wait.unwrap_or(QUESTION_TIMEOUT);
    loop {
        // An emulator that starts meanwhile says by its state file where it is.
        let target = Target::find(args, &environment, instances::running())?;
        let left = until.saturating_duration_since(Instant::now());
        let Err(reason) = target.ask(left.clamp(PAUSE, QUESTION_TIMEOUT)) else {
            let told = match args.json {
                true => format!("{}\n", json!({ "ready": true, "at": target.place() })),
                false => format!("{target} is ready\n"),
            };
            return output::print(told).map(|()| 0);
        };
        if args.wait.is_none() || Instant::now() >= until {
            if args.json {
                let reason = format!("{reason:#}");
                let told = json!({ "ready": false, "at": target.place(), "reason": reason });
                output::print(format!("{told}\n"))?;
            } else {
                print_error(format_args!("{target} is not ready: {reason:#}"));
            }
            return Ok(args.wait.map_or(NO_ANSWER, |_| NOT_REACHED));
        }
        std::thread::sleep(PAUSE);
    }
}

impl Target {
    /// The URL of the control interface, or the address of IP0.
    fn place(&self) -> Option<String> {
        match self {
            Target::Control(url, _) => Some(url.clone()),
            Target::Ip0(address) => Some(address.to_string()),
            Target::NotFound => None,
        }
    }

    fn find(args: &ReadyArgs, environment: &Environment, running: Vec<Instance>) -> anyhow::Result<Target> {
        let variable = environment.get(OsStr::new(URL_VARIABLE));
        let variable = variable.filter(|url| !url.is_empty());
        let variable = variable.map(|url| url.to_string_lossy().into_owned());
        let (serve, _) = config::read(ServeArgs::default(), environment)?;
        if let Some(url) = args.url.clone().or(variable) {
            return Target::control(url, serve.control_interface.control_token);
        }
        // A place that was chosen is the one that is meant, whatever else runs on this machine.
        if serve.control_interface.control.is_none()
            && serve.network.port_offset.is_none()
            && !running.is_empty()
        {
            return match target::find(running) {
                Ok(url) => Target::control(url, serve.control_interface.control_token),
                Err(TargetError::Uncontrolled(others)) => Ok(Target::ip0_of(&others)),
                Err(error @ (TargetError::Several(_) | TargetError::RobotPort { .. })) => Err(error.into()),
            };
        }
        Target::configured(&serve)
    }

    /// Place at which `serve` would answer with this configuration.
    fn configured(serve: &ServeArgs) -> anyhow::Result<Target> {
        let ports = serve.network.tcp_ports();
        if let Some(control) = config::control_settings(serve)? {
            let place = SocketAddr::new(connectable(control.address.ip()), control.address.port());
            return match place.port() {
                0 => Ok(Target::NotFound),
                _ => Target::control(format!("http://{place}"), control.token),
            };
        }
        let Ports::Offset(offset) = ports else {
            return Ok(Target::NotFound);
        };
        let port = FIRST_PORT.checked_add(offset);
        let port = port.with_context(|| format!("cannot add --port-offset {offset} to port {FIRST_PORT}"))?;
        let listen = connectable(serve.network.listen.unwrap_or(Settings::LISTEN));
        Ok(Target::Ip0(SocketAddr::new(listen, port)))
    }

    fn control(url: String, token: Option<String>) -> anyhow::Result<Target> {
        // A URL or token that cannot be used is known before the wait.
        Client::new(&url, token.clone())?;
        Ok(Target::Control(url, token))
    }

    fn ip0_of(running: &[Instance]) -> Target {
        let address = running
            .iter()
            .find_map(|instance| instance.ports.get(Port::Ip0.name()));
        address.map_or(Target::NotFound, |address| Target::Ip0(*address))
    }

    /// One question, which takes at most this long.
    fn ask(&self, limit: Duration) -> anyhow::Result<()> {
        match self {
            Target::Control(url, token) => {
                let client = Client::new(url, token.clone())?.with_timeout(limit);
                let (status, body) = client.call("GET", "/health", None)?;
                let answer = serde_json::from_str::<Value>(&body).unwrap_or_default();
                match status {
                    200 if answer.get("status").is_some() => Ok(()),
                    // It answers; what it asks for is the token.
                    401 if answer.get("error").is_some() => Ok(()),
                    _ => bail!("that address answers HTTP {status} but is not a ts3100 control interface"),
                }
            }
            Target::Ip0(address) => {
                TcpStream::connect_timeout(address, limit)?;
                Ok(())
            }
            Target::NotFound => {
                bail!("this user runs no emulator on this machine; start one with `ts3100 serve`")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::ffi::OsString;

    fn target(variables: &[(&str, &str)], running: &[Instance]) -> String {
        let environment = variables
            .iter()
            .map(|(name, value)| (OsString::from(name), OsString::from(value)))
            .collect();
        let args = ReadyArgs {
            wait: None,
            url: None,
            json: false,
        };
        Target::find(&args, &environment, running.to_vec())
            .map_or_else(|error| format!("{error:#}"), |target| target.to_string())
    }

    fn instance(pid: u32, control: Option<&str>) -> Instance {
        let ip0 = "127.0.0.1:11000".parse().unwrap();
        Instance {
            pid,
            control: control.map(str::to_owned),
            ports: BTreeMap::from([("IP0".to_owned(), ip0)]),
        }
    }

    #[test]
    fn the_place_follows_from_the_variables_of_serve() {
        let others = [instance(7, Some("http://127.0.0.1:9"))];
        let place = |variables: &[(&str, &str)]| target(variables, &others);
        let at = |place: &str| format!("the emulator at http://{place}");
        let offset = ("TS3100_PORT_OFFSET", "10000");
        assert_eq!(place(&[offset]), at("127.0.0.1:13100"));
        let everywhere = ("TS3100_CONTROL", "0.0.0.0:3200");
        let open = ("TS3100_CONTROL_OPEN", "1");
        assert_eq!(place(&[everywhere, open]), at("127.0.0.1:3200"));
        let token = ("TS3100_CONTROL_TOKEN", "0123456789abcdef");
        assert_eq!(place(&[everywhere, token]), at("127.0.0.1:3200"));
        let url = ("TS3100_CONTROL_URL", "http://robot:1");
        assert_eq!(place(&[everywhere, open, url]), at("robot:1"));
        let off = ("TS3100_CONTROL", "off");
        assert_eq!(place(&[off]), "the emulator with IP0 at 127.0.0.1:1000");
        let elsewhere = [off, ("TS3100_PORT_OFFSET", "20"), ("TS3100_LISTEN", "0.0.0.0")];
        assert_eq!(place(&elsewhere), "the emulator with IP0 at 127.0.0.1:1020");
        assert!(place(&[("TS3100_PORT_OFFSET", "abc")]).contains("TS3100_PORT_OFFSET"));
    }

    #[test]
    fn without_variables_it_is_the_one_that_runs() {
        let first = instance(7, Some("http://127.0.0.1:9"));
        let off = instance(8, None);
        assert_eq!(target(&[], &[]), "the emulator at http://127.0.0.1:3100");
        assert_eq!(target(&[("TS3100_PORTS", "auto")], &[]), "the emulator");
        let auto = [("TS3100_PORTS", "auto")];
        assert_eq!(
            target(&auto, &[first.clone(), off.clone()]),
            "the emulator at http://127.0.0.1:9"
        );
        assert_eq!(target(&[], &[off]), "the emulator with IP0 at 127.0.0.1:11000");
        let second = instance(12, Some("http://127.0.0.1:10"));
        let several = target(&[], &[first, second]);
        assert!(
            several.contains("process 7") && several.contains("--url"),
            "{several}"
        );
    }
}
