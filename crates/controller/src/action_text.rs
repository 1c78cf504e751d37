//! The text form of actions: after `!` in a text transcript, in JSON lines, in scenarios and in the log of what a
//! scenario does.
//!
//! What `Display` writes, `FromStr` reads back as the same action. It checks words only, not whether there is such a line
//! or file.

use crate::action::{Action, IoKind};
use crate::faults::{Fault, FaultAction, FaultError};
use crate::input::{ControlRight, KeySwitch, PanelAction};
use alloc::boxed::Box;
use alloc::string::{FromUtf8Error, String, ToString};
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;
use core::time::Duration;
use thiserror::Error;
use ts3100_proto::command::Number;
use ts3100_proto::escape::{self, EscapeError, Escaped};
use ts3100_proto::words::Word;

/// Words that are no action.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ActionParseError {
    /// A word of an action.
    #[error("{expected} expected, {found:?} found")]
    Expected {
        /// What the action has there.
        expected: &'static str,
        /// What was there.
        found: String,
    },
    /// No action begins so.
    #[error("{0:?} is no action at the controller")]
    Unknown(String),
    /// Keys of the pendant that are no UTF-8.
    #[error("keys of the pendant expected: {0}")]
    Keys(FromUtf8Error),
    /// Bytes.
    #[error(transparent)]
    Bytes(#[from] EscapeError),
    /// A fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

type ParseResult<T> = Result<T, ActionParseError>;

fn expected(expected: &'static str, found: &str) -> ActionParseError {
    let found = found.to_string();
    ActionParseError::Expected { expected, found }
}

impl fmt::Display for PanelAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PanelAction::Key(key) => write!(f, "key {}", key.word()),
            PanelAction::ControlRight(right) => write!(f, "control-right {}", right.word()),
            PanelAction::EmergencyStop(on) => write!(f, "emergency-stop {}", on.word()),
            PanelAction::SafetySwitch(open) => write!(f, "safety-switch {}", open.word()),
            PanelAction::Servo(on) => write!(f, "servo {}", on.word()),
            PanelAction::Start => f.write_str("start"),
            PanelAction::Stop => f.write_str("stop"),
            PanelAction::FeedHold => f.write_str("feed-hold"),
            PanelAction::AlarmReset => f.write_str("alarm-reset"),
            PanelAction::MachineLock(on) => write!(f, "machine-lock {}", on.word()),
            PanelAction::InputLine { line, on } => write!(f, "input {line} {}", on.word()),
            PanelAction::Battery(low) => write!(f, "battery-low {}", low.word()),
            PanelAction::Keys(keys) => write!(f, "keys {}", Escaped::new(keys.as_bytes())),
            PanelAction::PowerCycle => f.write_str("power-cycle"),
        }
    }
}

impl FromStr for PanelAction {
    type Err = ActionParseError;

    fn from_str(words: &str) -> ParseResult<PanelAction> {
        let (name, rest) = split(words);
        let unknown = || ActionParseError::Unknown(words.to_string());
        Ok(match (name, rest) {
            ("key", rest) => PanelAction::Key(KeySwitch::from_word(rest).ok_or_else(unknown)?),
            ("control-right", rest) => {
                PanelAction::ControlRight(ControlRight::from_word(rest).ok_or_else(unknown)?)
            }
            ("emergency-stop", state) => PanelAction::EmergencyStop(switch(state)?),
            ("safety-switch", state) => PanelAction::SafetySwitch(switch(state)?),
            ("servo", state) => PanelAction::Servo(switch(state)?),
            ("start", "") => PanelAction::Start,
            ("stop", "") => PanelAction::Stop,
            ("feed-hold", "") => PanelAction::FeedHold,
            ("alarm-reset", "") => PanelAction::AlarmReset,
            ("machine-lock", state) => PanelAction::MachineLock(switch(state)?),
            ("input", rest) => {
                let (number, state) = split(rest);
                let line = number.parse();
                let line = line.map_err(|_| expected("a line number", number))?;
                let on = switch(state)?;
                PanelAction::InputLine { line, on }
            }
            ("battery-low", state) => PanelAction::Battery(switch(state)?),
            ("keys", keys) => {
                let keys = String::from_utf8(escape::parse(keys)?);
                PanelAction::Keys(keys.map_err(ActionParseError::Keys)?)
            }
            ("power-cycle", "") => PanelAction::PowerCycle,
            _ => return Err(unknown()),
        })
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = |restore: &bool| if *restore { "-restore" } else { "" };
        match self {
            Action::Panel(action) => action.fmt(f),
            Action::FeedHold(on) => write!(f, "feed-hold {}", on.word()),
            Action::PowerOff => f.write_str("power off"),
            Action::PowerOn => f.write_str("power on"),
            Action::RaiseAlarm { number, detail } => match detail.trim_end() {
                "" => write!(f, "raise {number}"),
                detail => write!(f, "raise {number} {detail}"),
            },
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => {
                let micros = length.as_micros();
                write!(f, "pulse {} {line} {} {micros}us", side.word(), on.word())
            }
            Action::SetOutput { line, on } => write!(f, "output {line} {}", on.word()),
            Action::Force { side, line, on } => write!(f, "force {} {line} {}", side.word(), on.word()),
            Action::Release { side, line } => write!(f, "release {} {line}", side.word()),
            Action::SetVariable {
                name,
                values,
                restore,
            } => {
                write!(f, "set{} {name}", suffix(restore))?;
                values.iter().try_for_each(|value| match value {
                    Number::Integer(whole) => write!(f, " {whole}"),
                    // With a decimal point or an exponent, so that it reads back as a real.
                    Number::Real(real) => write!(f, " {real:?}"),
                })
            }
            Action::Teach { name, restore } => write!(f, "teach{} {name}", suffix(restore)),
            Action::PutFile { name, content } => write!(f, "put {name} {}", Escaped::new(content)),
            Action::EraseFile { name } => write!(f, "erase {name}"),
            Action::Select { name } => write!(f, "select {name}"),
            Action::Fault(FaultAction::Arm(fault)) if fault.id == 0 => write!(f, "fault arm {fault}"),
            Action::Fault(FaultAction::Arm(fault)) => write!(f, "fault arm {} {fault}", fault.id),
            Action::Fault(FaultAction::Disarm(id)) => write!(f, "fault disarm {id}"),
            Action::Fault(FaultAction::Clear) => f.write_str("fault clear"),
        }
    }
}

impl FromStr for Action {
    type Err = ActionParseError;

    fn from_str(words: &str) -> ParseResult<Action> {
        let (name, rest) = split(words);
        Ok(match (name, rest) {
            ("feed-hold", "on" | "off") => Action::FeedHold(switch(rest)?),
            ("power", "off") => Action::PowerOff,
            ("power", "on") => Action::PowerOn,
            ("raise", rest) => {
                let (number, detail) = split(rest);
                let (number, detail) = (number.to_string(), detail.to_string());
                Action::RaiseAlarm { number, detail }
            }
            ("pulse" | "force" | "release", rest) => line_action(name, rest)?,
            ("output", rest) => {
                let (number, state) = rest
                    .split_once(' ')
                    .ok_or_else(|| expected("a line and on or off", rest))?;
                let (line, on) = (line(number)?, switch(state)?);
                Action::SetOutput { line, on }
            }
            ("set" | "set-restore", rest) => set_variable(rest, name == "set-restore")?,
            ("teach" | "teach-restore", rest) => Action::Teach {
                name: single_word(rest)?,
                restore: name == "teach-restore",
            },
            ("put", rest) => {
                let (name, content) = split(rest);
                let (name, content) = (single_word(name)?, escape::parse(content)?);
                Action::PutFile { name, content }
            }
            ("erase", rest) => Action::EraseFile {
                name: single_word(rest)?,
            },
            ("select", rest) => Action::Select {
                name: single_word(rest)?,
            },
            ("fault", rest) => Action::Fault(fault_action(rest)?),
            _ => Action::Panel(words.parse()?),
        })
    }
}

/// `pulse`, `force` and `release` of a line.
fn line_action(name: &str, rest: &str) -> ParseResult<Action> {
    let kind = |word: &str| IoKind::from_word(word).ok_or_else(|| expected("input or output", word));
    let words: Vec<&str> = rest.split(' ').collect();
    match (name, words.as_slice()) {
        ("pulse", [side, number, on, length]) => {
            let micros = length.strip_suffix("us").and_then(|micros| micros.parse().ok());
            let micros = micros.ok_or_else(|| expected("a length in us", length))?;
            Ok(Action::Pulse {
                side: kind(side)?,
                line: line(number)?,
                on: switch(on)?,
                length: Duration::from_micros(micros),
            })
        }
        ("force", [side, number, on]) => Ok(Action::Force {
            side: kind(side)?,
            line: line(number)?,
            on: switch(on)?,
        }),
        ("release", [side, number]) => Ok(Action::Release {
            side: kind(side)?,
            line: line(number)?,
        }),
        ("pulse", _) => Err(expected(
            "input or output, a line, on or off, and a length in us",
            rest,
        )),
        _ => Err(expected("input or output, a line, and for force on or off", rest)),
    }
}

fn set_variable(rest: &str, restore: bool) -> ParseResult<Action> {
    let mut words = rest.split(' ');
    let name = single_word(words.next().unwrap_or_default())?;
    let number = |word: &str| Number::parse(word).ok_or_else(|| expected("a number", word));
    let values = words.map(number).collect::<ParseResult<Vec<Number>>>()?;
    if values.is_empty() {
        return Err(expected("a name and numbers", rest));
    }
    Ok(Action::SetVariable {
        name,
        values,
        restore,
    })
}

fn fault_action(rest: &str) -> ParseResult<FaultAction> {
    let (verb, rest) = split(rest);
    let number = |word: &str| {
        let number = word.parse::<u32>();
        number.map_err(|_| expected("the number of a fault", word))
    };
    Ok(match verb {
        "arm" => {
            let (id, spec) = match rest.split_once(' ') {
                Some((id, spec)) if id.bytes().all(|byte| byte.is_ascii_digit()) => (Some(number(id)?), spec),
                _ => (None, rest),
            };
            let mut fault: Fault = spec.parse()?;
            // A number may be among its keys too.
            fault.id = id.unwrap_or(fault.id);
            FaultAction::Arm(Box::new(fault))
        }
        "disarm" => FaultAction::Disarm(number(rest)?),
        "clear" if rest.is_empty() => FaultAction::Clear,
        _ => return Err(expected("arm, disarm or clear", verb)),
    })
}

/// The first word, and what follows it.
fn split(words: &str) -> (&str, &str) {
    words.split_once(' ').unwrap_or((words, ""))
}

fn single_word(word: &str) -> ParseResult<String> {
    if word.is_empty() || word.contains(' ') {
        return Err(expected("one name", word));
    }
    Ok(word.to_string())
}

fn line(word: &str) -> ParseResult<u16> {
    word.parse().map_err(|_| expected("the number of a line", word))
}

fn switch(word: &str) -> ParseResult<bool> {
    bool::from_word(word).ok_or_else(|| expected("on or off", word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::borrow::ToOwned;
    use alloc::vec;

    #[test]
    fn every_action_reads_back_as_it_was_written() {
        let (side, line, on) = (IoKind::Input, 101, true);
        let name = || "P1".to_owned();
        let values = vec![Number::Integer(-3), Number::Real(1.0), Number::Real(1e-9)];
        let actions = [
            Action::Panel(PanelAction::FeedHold),
            Action::Panel(PanelAction::InputLine { line, on }),
            Action::FeedHold(true),
            Action::PowerOff,
            Action::PowerOn,
            Action::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: String::new(),
            },
            Action::RaiseAlarm {
                number: "2-046".to_owned(),
                detail: "by hand: <x>".to_owned(),
            },
            Action::Pulse {
                side: IoKind::Output,
                line,
                on,
                length: Duration::from_micros(1_500),
            },
            Action::SetOutput { line, on: false },
            Action::Force { side, line, on },
            Action::Release { side, line },
            Action::SetVariable {
                name: "A(1,2)".to_owned(),
                values,
                restore: false,
            },
            Action::SetVariable {
                name: name(),
                values: vec![Number::Integer(0)],
                restore: true,
            },
            Action::Teach {
                name: name(),
                restore: true,
            },
            Action::Teach {
                name: name(),
                restore: false,
            },
            Action::PutFile {
                name: name(),
                content: b"PROGRAM A B\r\nEND\n\xff<".to_vec(),
            },
            Action::PutFile {
                name: name(),
                content: Vec::new(),
            },
            Action::EraseFile { name: name() },
            Action::Select { name: name() },
        ];
        for action in actions {
            let words = action.to_string();
            assert_eq!(words.parse(), Ok(action), "{words}");
            assert!(words.is_ascii() && !words.contains('\n'), "{words:?}");
        }
    }

    #[test]
    fn what_is_no_action_is_refused() {
        for words in [
            "",
            "power",
            "pulse input 1 on 5",
            "force input 1",
            "release input",
            "set N",
            "set N one",
            "output 1",
            "teach",
            "teach A B",
            "erase ",
            "fly",
        ] {
            assert!(words.parse::<Action>().is_err(), "{words}");
        }
    }

    #[test]
    fn every_panel_action_reads_back() {
        let switches = [
            PanelAction::EmergencyStop,
            PanelAction::SafetySwitch,
            PanelAction::Servo,
            PanelAction::MachineLock,
            PanelAction::Battery,
        ];
        let mut all: Vec<PanelAction> = switches
            .into_iter()
            .flat_map(|make| [make(true), make(false)])
            .collect();
        all.extend([KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext].map(PanelAction::Key));
        let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
        all.extend(rights.map(PanelAction::ControlRight));
        all.extend([
            PanelAction::Start,
            PanelAction::Stop,
            PanelAction::FeedHold,
            PanelAction::AlarmReset,
            PanelAction::PowerCycle,
            PanelAction::InputLine { line: 264, on: true },
            PanelAction::Keys("1,2<\r".to_owned()),
        ]);
        for panel in all {
            assert_eq!(panel.to_string().parse(), Ok(panel));
        }
    }

    #[test]
    fn what_is_no_panel_action_is_refused() {
        for words in [
            "",
            "dance",
            "servo",
            "servo maybe",
            "input x on",
            "input 1",
            "start now",
            "keys <FF>",
        ] {
            assert!(words.parse::<PanelAction>().is_err(), "{words}");
        }
    }
}
