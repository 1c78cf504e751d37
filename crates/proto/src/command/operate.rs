//! RS: the five resets of the manual, and the reset of alarms that hosts send (hosts 2). EC: internal commands; the page of
//! the manual is lost, the forms are those of public clients (CMD-EC-01 to CMD-EC-04, hosts 2). WD: the host's watchdog,
//! `WD,<time> <level>` (ste80722 S11).
//!
//! The controller gives them their effect. `RS,ERR` has its own permission row, see [`crate::permission`].

use crate::codes::codes;
use crate::command::operand::{GrammarError, Operands, ParseResult, separator, whole};
use crate::command::{Command, CommandError};
use crate::prelude::*;
use crate::status::AlarmLevel;
use nom::Parser;
use nom::character::complete::{alpha1, space1};
use nom::combinator::map_opt;
use nom::error::context;
use nom::sequence::preceded;

codes! {
    /// Operands of RS, in the order of Table 5.1.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Reset {
        /// `PRG`: back to step 1, program data initialised (CMD-RS-03).
        Program = "PRG",
        /// `STP`: back to step 1, program data kept (CMD-RS-04).
        Step = "STP",
        /// `CYC`: to the label RCYCLE (CMD-RS-05).
        Cycle = "CYC",
        /// `SIG`: output signals (CMD-RS-07).
        Signal = "SIG",
        /// `SEL`: the selection of the execution file (CMD-RS-09).
        Select = "SEL",
    }
    /// The operand on the wire, for example `PRG`.
    fn as_str -> &'static str;
}

/// The operand of the reset of alarms, which is a command of its own: it has its own row in the permission tables.
pub(super) const RESET_OF_ALARMS: &str = "ERR";

/// One word: a reset of the manual, or that of alarms.
pub(super) fn rs(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands.parse("PRG, STP, CYC, SIG, SEL or ERR", word)
}

fn word(input: &str) -> ParseResult<'_, Command> {
    let known = |word: &str| {
        if word.eq_ignore_ascii_case(RESET_OF_ALARMS) {
            return Some(Command::RsErr);
        }
        let mut resets = Reset::ALL.into_iter();
        resets
            .find(|reset| reset.as_str().eq_ignore_ascii_case(word))
            .map(Command::Rs)
    };
    map_opt(alpha1, known).parse(input)
}

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
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
    impl Word;
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

/// The level 0: no alarm.
const NONE: u8 = 0;
/// Longest time, in ms (ste80722 S11).
pub const MAX_WATCHDOG_MS: u32 = 99_999;

/// The grammar `time level`. Hosts stop the watchdog with `WD,0 0`.
pub(super) fn wd(operands: Operands<'_>) -> Result<Command, CommandError> {
    const TIME: &str = "a time in milliseconds, at most 99999";
    const LEVEL: &str = "a level 0, 1, 2 or 8";
    let level = |number: u8| match number {
        NONE => Some(None),
        number => AlarmLevel::from_number(number)
            .filter(|level| *level != AlarmLevel::L4)
            .map(Some),
    };
    let level = context(LEVEL, map_opt(whole("", 0..=u8::MAX), level));
    let grammar = (whole(TIME, 0..=MAX_WATCHDOG_MS), separator, level);
    operands
        .parse(TIME, grammar)
        .map(|(timeout_ms, (), level)| Command::Wd { timeout_ms, level })
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-RS-01 FRM-07 FRM-08 FRM-13
    #[test]
    fn every_reset_in_any_case() {
        for reset in Reset::ALL {
            for form in ["RS,", "RS, ", "rs,"] {
                let message = format!("{form}{}", reset.as_str());
                assert_eq!(Command::parse(message.as_bytes()), Ok(Command::Rs(reset)));
                assert_eq!(
                    Command::parse(message.to_ascii_lowercase().as_bytes()),
                    Ok(Command::Rs(reset))
                );
            }
        }
    }

    #[test]
    fn the_reset_of_alarms_is_the_only_extension() {
        for message in ["RS,ERR", "rs, err ", "Rs,Err"] {
            assert_eq!(Command::parse(message.as_bytes()), Ok(Command::RsErr));
        }
        assert_eq!(Command::RsErr.encode(), b"RS,ERR\r");
        assert!(Command::RsErr.is_extension());
        assert_eq!(Command::RsErr.letters(), "RS");
        assert_eq!(Command::RsErr.permission_row(), "RS,ERR");
        for reset in Reset::ALL {
            let command = Command::Rs(reset);
            assert!(!command.is_extension());
            assert_eq!((command.letters(), command.permission_row()), ("RS", "RS"));
        }
    }

    // clause: CMD-RS-01 FRM-07 FRM-18
    #[test]
    fn other_operands_are_malformed() {
        for message in [
            "RS",
            "RS,",
            "RSPRG",
            "RS PRG",
            "RS,ABC",
            "RS,PRG STP",
            "RS,PRG,STP",
            "RS,PR",
            "RS,PRGX",
            "RS,ER",
            "RS,ERROR",
        ] {
            assert!(matches!(
                Command::parse(message.as_bytes()),
                Err(CommandError::Malformed { letters: "RS", .. })
            ));
        }
        let error = Command::parse(b"RS,ABC").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: expected PRG, STP, CYC, SIG, SEL or ERR, found \"ABC\" at byte 3".to_string())
        );
        let error = Command::parse(b"RSPRG").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("RS: expected a comma after the letters, found \"PRG\" at byte 2".to_string())
        );
    }

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

    #[test]
    fn watchdogs_of_the_vendors_client() {
        let start = Command::Wd {
            timeout_ms: 700,
            level: Some(AlarmLevel::L2),
        };
        let stop = Command::Wd {
            timeout_ms: 0,
            level: None,
        };
        for (message, command) in [("WD,700 2", start), ("WD,0 0", stop)] {
            assert_eq!(Command::parse(message.as_bytes()).as_ref(), Ok(&command));
            assert_eq!(command.encode(), format!("{message}\r").into_bytes());
        }
    }

    // clause: S11
    #[test]
    fn levels_0_1_2_8_and_no_other() {
        for number in 0..=u8::MAX {
            let read = Command::parse(format!("WD,99999 {number}").as_bytes());
            let timeout_ms = MAX_WATCHDOG_MS;
            match number {
                0 | 1 | 2 | 8 => {
                    let level = AlarmLevel::from_number(number);
                    assert_eq!(read, Ok(Command::Wd { timeout_ms, level }));
                }
                _ => assert!(matches!(read, Err(CommandError::Malformed { at: 9, .. }))),
            }
        }
    }

    #[test]
    fn bad_times_and_levels_are_malformed_where_they_are_bad() {
        for (message, position) in [
            ("WD", 2),
            ("WD,", 3),
            ("WD,700", 6),
            ("WD,700 ", 7),
            ("WD,700 3", 7),
            ("WD,700 X", 7),
            ("WD,700 2 1", 8),
            ("WD,-1 2", 3),
            ("WD,0.5 2", 4),
            ("WD,100000 2", 3),
            ("WD,700 4", 7),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed {
                    letters: "WD", at, ..
                }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }
}
