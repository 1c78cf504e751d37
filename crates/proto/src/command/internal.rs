//! EC: internal commands.
//!
//! The page of the manual is lost; the forms are those of public clients (CMD-EC-01 to CMD-EC-04, hosts 2). The
//! controller gives them their effect.

use crate::codes::codes;
use crate::command::operand::{GrammarError, Operands, ParseResult, whole};
use crate::command::{Command, CommandError};
use crate::prelude::*;
use nom::Parser;
use nom::character::complete::{alpha1, space1};
use nom::combinator::map_opt;
use nom::error::context;
use nom::sequence::preceded;

/// Letters that an abbreviated operation mode must have at least.
const SHORTEST: usize = 2;
/// Full speed in percent.
const FULL: u8 = 100;

/// An internal command of EC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InternalCommand {
    /// `MODE`: the operation mode (CMD-EC-03).
    Mode(RunMode),
    /// `OVRD`: the speed override in percent, 1 to 100 (CMD-EC-02).
    Override(u8),
    /// `BREAK`: stop at once (CMD-EC-04).
    Break,
}

codes! {
    /// Operation mode (CMD-RN-06), in the order of the `RM` codes of SM.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
    pub enum RunMode {
        /// Starts again after the last statement.
        Continuous = "continuous",
        /// Runs once to the end.
        Cycle = "cycle",
        /// Runs one statement for each start.
        Step = "step",
        /// Runs through the next motion for each start.
        Segment = "segment",
    }
    /// The word in lower case, as the status file has it (SU-04).
    fn as_str -> &'static str;
}

impl RunMode {
    /// The mode with this word, which may be cut short as long as it is unambiguous (CMD-EC-03); case does
    /// not matter.
    pub fn from_word(word: &str) -> Option<RunMode> {
        let word = word.to_ascii_lowercase();
        let mut modes = RunMode::ALL
            .into_iter()
            .filter(|mode| mode.as_str().starts_with(&word));
        modes
            .next()
            .filter(|_| word.len() >= SHORTEST && modes.next().is_none())
    }
}

/// `MODE word`, `OVRD percent` or `BREAK`.
pub(super) fn ec(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands.parse("MODE, OVRD or BREAK", internal).map(Command::Ec)
}

/// The operands as the vendor's client library sends them.
pub(super) fn encode(internal: InternalCommand) -> String {
    match internal {
        InternalCommand::Mode(RunMode::Continuous) => String::from("MODE CONT"),
        InternalCommand::Mode(mode) => format!("MODE {}", mode.as_str().to_ascii_uppercase()),
        InternalCommand::Override(percent) => format!("OVRD {percent}"),
        InternalCommand::Break => String::from("BREAK"),
    }
}

fn internal(input: &str) -> ParseResult<'_, InternalCommand> {
    let (rest, word) = alpha1(input)?;
    match word.to_ascii_uppercase().as_str() {
        "MODE" => {
            let word = map_opt(alpha1, RunMode::from_word);
            let mode = context("STEP, CONTINUOUS, CYCLE or SEGMENT", word);
            preceded(blank, mode).map(InternalCommand::Mode).parse(rest)
        }
        "OVRD" => {
            let percent = whole("a percentage from 1 to 100", 1..=FULL);
            preceded(blank, percent)
                .map(InternalCommand::Override)
                .parse(rest)
        }
        "BREAK" => Ok((rest, InternalCommand::Break)),
        _ => Err(nom::Err::Error(GrammarError {
            rest: input,
            expected: "MODE, OVRD or BREAK",
        })),
    }
}

fn blank(input: &str) -> ParseResult<'_, ()> {
    context("a blank", space1).map(|_| ()).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-EC-01 CMD-EC-02
    #[test]
    fn internal_commands_of_the_vendors_client() {
        assert_eq!(
            Command::parse(b"EC,BREAK"),
            Ok(Command::Ec(InternalCommand::Break))
        );
        assert_eq!(
            Command::parse(b"EC,OVRD 50"),
            Ok(Command::Ec(InternalCommand::Override(50)))
        );
        assert_eq!(
            Command::parse(b"ec, ovrd  100"),
            Ok(Command::Ec(InternalCommand::Override(100)))
        );
        for mode in RunMode::ALL {
            let command = Command::Ec(InternalCommand::Mode(mode));
            let full = format!("EC,MODE {}", mode.as_str());
            assert_eq!(Command::parse(full.as_bytes()), Ok(command));
        }
    }

    // clause: CMD-EC-03
    #[test]
    fn operation_modes_may_be_cut_short_while_unambiguous() {
        for mode in RunMode::ALL {
            for length in SHORTEST..=mode.as_str().len() {
                assert_eq!(RunMode::from_word(&mode.as_str()[..length]), Some(mode));
            }
        }
        for word in ["", "C", "S", "CYCLES", "XYZ", "STEPS", "continuously", "\u{e9}"] {
            assert_eq!(RunMode::from_word(word), None, "{word}");
        }
    }

    // clause: CMD-EC-01 CMD-EC-02 CMD-EC-03 FRM-18
    #[test]
    fn anything_else_is_malformed_where_it_is() {
        for (message, position) in [
            ("EC,DIR", 3),
            ("EC,", 3),
            ("EC,OVRD 0", 8),
            ("EC,OVRD 101", 8),
            ("EC,OVRD 1000", 8),
            ("EC,OVRD=50", 7),
            ("EC,OVRD 5.5", 9),
            ("EC,OVRD", 7),
            ("EC,MODE XYZ", 8),
            ("EC,MODE", 7),
            ("EC,BREAK 1", 8),
            ("EC BREAK", 2),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed {
                    letters: "EC", at, ..
                }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }
}
