//! Something of the controller whose value is told with every statement: a variable, a line, or what the panel shows.
//!
//! `robot::scheduler` reads it before each statement while statements are told ([`Controller::watch`]).

use crate::action::IoKind;
use crate::controller::Controller;
use crate::ops::variables::listed;
use crate::prelude::*;
use crate::robot::Robot;
use core::fmt;
use core::str::FromStr;
use scol_mini::Memory;
use ts3100_proto::name::{VariableName, split_subscripts};

/// Something that can be watched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Watched {
    /// A variable of the selected file: its name, of a variable of a program with it, and the subscripts of an element.
    Variable(String, Vec<i32>),
    /// A digital line.
    Line(IoKind, u16),
    /// Speed override in percent.
    Override,
    /// Master mode.
    Mode,
    /// Servo power.
    Servo,
}

/// A text that names nothing that can be watched.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected a variable such as `N`, `A(2)` or `PICK.N`, `din.3`, `dout.5`, `override`, `mode` or `servo`, found `{0}`"
)]
pub struct WatchedError(String);

impl FromStr for Watched {
    type Err = WatchedError;

    fn from_str(text: &str) -> Result<Watched, WatchedError> {
        let wrong = || WatchedError(text.chars().take(40).collect());
        let line = |kind, number: &str| {
            let number = number.parse().map_err(|_| wrong())?;
            let exists = crate::io::signals::Signals::exists(number);
            exists.then_some(Watched::Line(kind, number)).ok_or_else(wrong)
        };
        match text.split_once('.') {
            Some(("din", number)) => return line(IoKind::Input, number),
            Some(("dout", number)) => return line(IoKind::Output, number),
            _ => {}
        }
        match text {
            "override" => return Ok(Watched::Override),
            "mode" => return Ok(Watched::Mode),
            "servo" => return Ok(Watched::Servo),
            _ => {}
        }
        let (name, subscripts) = split_subscripts(text).map_err(|_| wrong())?;
        let names = name.split('.');
        if names.clone().count() > 2 || names.clone().any(|name| VariableName::parse(name).is_err()) {
            return Err(wrong());
        }
        Ok(Watched::Variable(name.to_ascii_uppercase(), subscripts))
    }
}

impl fmt::Display for Watched {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Watched::Variable(name, subscripts) if subscripts.is_empty() => f.write_str(name),
            Watched::Variable(name, subscripts) => {
                let listed: Vec<String> = subscripts.iter().map(i32::to_string).collect();
                write!(f, "{name}({})", listed.join(","))
            }
            Watched::Line(IoKind::Input, line) => write!(f, "din.{line}"),
            Watched::Line(IoKind::Output, line) => write!(f, "dout.{line}"),
            Watched::Override => f.write_str("override"),
            Watched::Mode => f.write_str("mode"),
            Watched::Servo => f.write_str("servo"),
        }
    }
}

impl Robot {
    /// The value in words; empty where there is none.
    pub(crate) fn read_watched(&self, watched: &Watched) -> String {
        let on = |on: bool| if on { "on" } else { "off" }.to_string();
        match watched {
            Watched::Variable(name, subscripts) => {
                let (memory, program) = (self.executor.memory(), self.executor.program());
                let read = if name.contains('.') {
                    Memory::local
                } else {
                    Memory::global
                };
                let Ok(value) = read(memory, program, name, subscripts) else {
                    return String::new();
                };
                let numbers: Vec<String> = listed(&value, self.arm.kind())
                    .iter()
                    .map(ToString::to_string)
                    .collect();
                numbers.join(",")
            }
            Watched::Line(IoKind::Input, line) => on(self.signals.input(*line)),
            Watched::Line(IoKind::Output, line) => on(self.signals.output(*line)),
            Watched::Override => self.panel.state().override_percent.to_string(),
            Watched::Mode => self.panel.state().master_mode().as_str().to_string(),
            Watched::Servo => on(self.panel.state().servo),
        }
    }
}

impl Controller {
    /// From now on every statement that is told ([`Controller::trace`]) is told with this value before it; `None`: without.
    pub fn watch(&mut self, watched: Option<Watched>) {
        self.robot.context.outputs.watch(watched);
    }

    /// The present value in words; empty where there is none, as of a variable that is not in the selected file.
    pub fn read_watched(&self, watched: &Watched) -> String {
        self.robot.read_watched(watched)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_watched_reads_back() {
        for text in [
            "N", "A(2)", "A(1,2)", "PICK.N", "din.3", "dout.16", "override", "mode", "servo",
        ] {
            assert_eq!(text.parse::<Watched>().unwrap().to_string(), text);
        }
        for text in ["", "din.0", "dout.999", "A(", "1", "A.B.C", "din.x"] {
            assert!(text.parse::<Watched>().is_err(), "{text}");
        }
    }
}
