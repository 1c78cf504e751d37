//! Finds the control interface that `ts3100 ctl` calls: the one it is told, or that of the only emulator of this user
//! on this machine.
//!
//! State files name the emulators ([`crate::instances`]). They also tell a port of the robot from the interface, before
//! anything is sent to it.

use super::call::Call;
use crate::config::exported;
use crate::instances::{self, Instance};
use clap::Args;
use serde_json::Value;
use std::ffi::OsString;
use std::time::Duration;
use ts3100_control::URL_VARIABLE;
use ts3100_control::client::{Client, ClientError};

/// Address of the interface if no emulator has a state file.
const DEFAULT_URL: &str = "http://127.0.0.1:3100";

/// The environment variable of the token, which `serve` reads too.
pub(in crate::cli) const TOKEN_VARIABLE: &str = "TS3100_CONTROL_TOKEN";

/// Why there is nothing to call.
#[derive(Debug, thiserror::Error)]
pub enum TargetError {
    /// More than one emulator could be meant.
    #[error(
        "{} emulators run on this machine. Choose one with --url or {URL_VARIABLE}:{}",
        .0.len(),
        list(.0)
    )]
    Several(Vec<Instance>),
    /// The emulators of this machine have no interface.
    #[error("the emulator of this machine{} runs without a control interface (--control off)", list(.0))]
    Uncontrolled(Vec<Instance>),
    /// The URL leads to a port of the robot.
    #[error(
        "{port} of the robot answers at {url}, not the control interface{}",
        control_place(control.as_deref())
    )]
    RobotPort {
        /// As given.
        url: String,
        /// Name of the port.
        port: String,
        /// URL of the interface of the same emulator.
        control: Option<String>,
    },
}

/// Address of the interface of the same emulator.
fn control_place(control: Option<&str>) -> String {
    let place = control.map(|url| format!("; that is at {url}"));
    place.unwrap_or_else(|| ", which is off (--control off)".to_owned())
}

/// A line for each emulator.
fn list(instances: &[Instance]) -> String {
    let line = |instance: &Instance| {
        let url = instance.control.as_deref().unwrap_or_default();
        let ip0 = instance.ports.get("IP0");
        let ip0 = ip0.map(|address| format!(", IP0 at {address}"));
        format!("\n  {url}  process {}{}", instance.pid, ip0.unwrap_or_default())
    };
    instances.iter().map(line).collect()
}

/// The robot to call and the token.
#[derive(Debug, Args)]
pub struct TargetArgs {
    /// URL of the control interface [env: TS3100_CONTROL_URL] [default: the only emulator on this computer]
    #[arg(long, value_name = "URL", global = true)]
    url: Option<String>,
    /// Robot to call, if several run in one process [env: TS3100_ROBOT]
    #[arg(long, value_name = "NAME", global = true)]
    robot: Option<String>,
    /// Token of the control interface [env: TS3100_CONTROL_TOKEN]
    #[arg(long, value_name = "TOKEN", global = true)]
    token: Option<String>,
}

impl TargetArgs {
    /// The URL to call.
    ///
    /// # Errors
    /// See [`TargetError`].
    pub fn url(&self) -> Result<String, TargetError> {
        choose(given(self.url.as_ref(), URL_VARIABLE), instances::running())
    }

    /// The target of an editor; what it does not name is looked for as for `ctl`.
    pub fn of_parts(address: Option<String>, robot: Option<String>, token: Option<String>) -> TargetArgs {
        let url = address.map(|address| match address.contains("://") {
            true => address,
            // A port alone is one of this machine.
            false if address.parse::<u16>().is_ok() => format!("http://127.0.0.1:{address}"),
            false => format!("http://{address}"),
        });
        TargetArgs { url, robot, token }
    }

    /// The target of a command line that is not complete.
    pub fn of_words(words: &[OsString]) -> TargetArgs {
        let value = |flag: &str| {
            words.iter().enumerate().find_map(|(at, word)| {
                let rest = word.to_str()?.strip_prefix(flag)?;
                let value = match rest {
                    "" => words.get(at + 1)?.to_str()?,
                    rest => rest.strip_prefix('=')?,
                };
                Some(value.to_owned())
            })
        };
        TargetArgs {
            url: value("--url"),
            robot: value("--robot"),
            token: value("--token"),
        }
    }

    /// The answer of the robot to a question; none if it does not answer within this time or refuses.
    pub fn ask(&self, path: &str, limit: Duration) -> Option<Value> {
        let (path, body) = (path.to_owned(), None);
        let call = Call {
            method: "GET",
            path,
            body,
        };
        let call = call.of_robot(self.robot());
        let client = self.client(&self.url().ok()?, limit).ok()?;
        let (status, text) = client.call(call.method, &call.path, None).ok()?;
        let answer = serde_json::from_str(&text).ok();
        answer.filter(|_| status < 400)
    }

    /// The robot that is called, where there are several.
    pub fn robot(&self) -> Option<String> {
        given(self.robot.as_ref(), exported::ROBOT)
    }

    /// Creates a client that calls this URL and waits this long for an answer.
    ///
    /// # Errors
    /// The URL or the token is not valid.
    pub fn client(&self, url: &str, limit: Duration) -> Result<Client, ClientError> {
        let token = given(self.token.as_ref(), TOKEN_VARIABLE);
        Ok(Client::new(url, token)?.with_timeout(limit))
    }
}

/// A flag, or else its variable.
fn given(flag: Option<&String>, variable: &str) -> Option<String> {
    // A value that is not UTF-8 fits no URL, name or token, and is refused as such.
    let from_variable = || {
        let value = std::env::var_os(variable).filter(|value| !value.is_empty());
        value.map(|value| value.to_string_lossy().into_owned())
    };
    flag.cloned().or_else(from_variable)
}

fn choose(told: Option<String>, running: Vec<Instance>) -> Result<String, TargetError> {
    let Some(url) = told else {
        return find(running);
    };
    let met = running
        .into_iter()
        .find_map(|instance| Some((instance.port_at(&url)?.to_owned(), instance.control)));
    match met {
        Some((port, control)) => Err(TargetError::RobotPort { url, port, control }),
        None => Ok(url),
    }
}

/// The URL of the only emulator that has a control interface, or the default.
///
/// # Errors
/// Several have one, or emulators run and none has one.
pub fn find(running: Vec<Instance>) -> Result<String, TargetError> {
    let (mut controlled, others): (Vec<Instance>, Vec<Instance>) = running
        .into_iter()
        .partition(|instance| instance.control.is_some());
    if controlled.len() > 1 {
        return Err(TargetError::Several(controlled));
    }
    match controlled.pop().and_then(|instance| instance.control) {
        Some(url) => Ok(url),
        None if others.is_empty() => Ok(DEFAULT_URL.to_owned()),
        None => Err(TargetError::Uncontrolled(others)),
    }
}

/// Advice on this error of a call; empty if the message says it all. `place` is where the URL is given.
pub fn advice(error: &ClientError, place: &str) -> String {
    match error {
        ClientError::Unreachable { .. } => format!(
            ". Start an emulator with `ts3100 serve`, or give the URL of its control interface with {place}"
        ),
        ClientError::Late { .. } | ClientError::Robot { .. } | ClientError::InvalidResponse { .. } => {
            ". The ready line and the banner of `ts3100 serve` name the URL of the control interface"
                .to_owned()
        }
        ClientError::Url(_) | ClientError::Token => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn instance(pid: u32, control: Option<&str>) -> Instance {
        let ip0 = format!("127.0.0.1:1{pid}").parse().unwrap();
        Instance {
            pid,
            control: control.map(str::to_owned),
            ports: BTreeMap::from([("IP0".to_owned(), ip0)]),
        }
    }

    #[test]
    fn the_only_emulator_is_found_and_several_are_listed() {
        let (first, second) = (
            instance(12, Some("http://127.0.0.1:3100")),
            instance(34, Some("http://a:2")),
        );
        let off = instance(56, None);
        let chosen = |running: &[&Instance]| {
            let running = running.iter().copied().cloned().collect();
            choose(None, running).map_err(|error| error.to_string())
        };
        assert_eq!(chosen(&[]), Ok(DEFAULT_URL.to_owned()));
        assert_eq!(chosen(&[&second, &off]), Ok("http://a:2".to_owned()));
        assert_eq!(
            chosen(&[&first, &second, &off]),
            Err(
                "2 emulators run on this machine. Choose one with --url or TS3100_CONTROL_URL:\
                 \n  http://127.0.0.1:3100  process 12, IP0 at 127.0.0.1:112\
                 \n  http://a:2  process 34, IP0 at 127.0.0.1:134"
                    .to_owned()
            )
        );
        let error = chosen(&[&off]).unwrap_err();
        assert!(
            error.contains("process 56") && error.contains("--control off"),
            "{error}"
        );
    }

    #[test]
    fn a_target_is_read_in_both_forms_of_a_flag() {
        let read = |words: &[&str]| {
            let words: Vec<OsString> = words.iter().map(OsString::from).collect();
            let TargetArgs { url, robot, token } = TargetArgs::of_words(&words);
            [url, robot, token].map(Option::unwrap_or_default)
        };
        let expected = ["http://a:1", "left", "t"];
        let apart = ["ctl", "--url", "http://a:1", "--robot", "left", "--token", "t"];
        assert_eq!(read(&apart), expected);
        assert_eq!(
            read(&["ctl", "--url=http://a:1", "--robot=left", "--token=t"]),
            expected
        );
        assert_eq!(read(&["ctl", "--urls=x", "--robot"]), ["", "", ""]);
    }

    #[test]
    fn a_port_of_the_robot_is_named() {
        let running = vec![instance(12, Some("http://127.0.0.1:3100"))];
        let told =
            |url: &str| choose(Some(url.to_owned()), running.clone()).map_err(|error| error.to_string());
        assert_eq!(
            told("http://127.0.0.1:3100"),
            Ok("http://127.0.0.1:3100".to_owned())
        );
        assert_eq!(
            told("http://127.0.0.1:112"),
            Err(
                "IP0 of the robot answers at http://127.0.0.1:112, not the control interface; \
                 that is at http://127.0.0.1:3100"
                    .to_owned()
            )
        );
    }
}
