//! WD: the host's watchdog, `WD,<time> <level>` (ste80722 S11).
//!
//! The controller runs the timer and raises the alarm.

use crate::command::operand::{Operands, separator, whole};
use crate::command::{Command, CommandError};
use crate::status::AlarmLevel;
use nom::combinator::map_opt;
use nom::error::context;

/// The level that stands for no alarm.
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
    use alloc::format;

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
    fn bad_operands_are_malformed_where_they_are_bad() {
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
