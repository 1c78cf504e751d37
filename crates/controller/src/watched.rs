//! Something of the controller whose value is told with every statement: a variable, a line, or what the panel shows.
//!
//! `robot::watching` reads it before each statement, while statements are told.

use crate::action::IoKind;
use crate::io::signals::Signals;
use crate::prelude::*;
use core::fmt;
use core::str::FromStr;
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
            let exists = Signals::exists(number);
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
