//! IW: forces I/O lines, `IW,<line> <0|1> ...`. HI and HO: successive lines as one number, `HI,<first> <count>` and
//! `HO,<first> <count> <value>` (hosts 2).
//!
//! The controller knows which numbers are lines (CMD-IW-04).

use crate::command::operand::{Operands, ParseResult, list, separator, whole};
use crate::command::{Command, CommandError};
use crate::prelude::*;
use nom::Parser;
use nom::character::complete::one_of;
use nom::combinator::verify;
use nom::error::context;
use nom::sequence::terminated;

/// Lines an IW may force (CMD-IW-02).
pub const MAX_LINES: usize = 32;

/// One line that IW forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineWrite {
    /// Number of the line, as in the manual's line tables.
    pub line: u16,
    /// The forced state: `true` is ON.
    pub on: bool,
}

/// `line state`, repeated; blanks or commas between all of them (CMD-IW-03).
pub(super) fn iw(operands: Operands<'_>) -> Result<Command, CommandError> {
    let lines = operands.parse("a line number", list(pair))?;
    if lines.len() > MAX_LINES {
        return Err(operands.malformed(&format!("at most {MAX_LINES} lines"), 0));
    }
    Ok(Command::Iw(lines))
}

/// The operands in canonical form.
pub(super) fn encode(lines: &[LineWrite]) -> String {
    let pair = |one: &LineWrite| format!("{} {}", one.line, u8::from(one.on));
    lines.iter().map(pair).collect::<Vec<String>>().join(" ")
}

fn pair(input: &str) -> ParseResult<'_, LineWrite> {
    let line = whole("a line number", 0..=u16::MAX);
    let state = context("0 or 1", one_of("01"));
    (line, separator, state)
        .map(|(line, (), state)| LineWrite {
            line,
            on: state == '1',
        })
        .parse(input)
}

/// Lines that one HI may read and one HO may write (ste80722 S14, ste85409 L54).
pub const MAX_WORD_LINES: u8 = 32;

const FIRST: &str = "a line number, the last at most 65535";
const COUNT: &str = "a count of lines from 1 to 32";
const VALUE: &str = "a value that the lines can show";

/// `first count`.
pub(super) fn hi(operands: Operands<'_>) -> Result<Command, CommandError> {
    operands
        .parse(FIRST, successive)
        .map(|(first, count)| Command::Hi { first, count })
}

/// `first count value`.
pub(super) fn ho(operands: Operands<'_>) -> Result<Command, CommandError> {
    let value = |(first, count): (u16, u8)| {
        whole(VALUE, 0..=u32::MAX >> (u32::BITS - u32::from(count))).map(move |value| (first, count, value))
    };
    let grammar = terminated(successive, separator).flat_map(value);
    operands
        .parse(FIRST, grammar)
        .map(|(first, count, value)| Command::Ho { first, count, value })
}

/// A first line and a count, which stay within the numbers of lines.
fn successive(input: &str) -> ParseResult<'_, (u16, u8)> {
    let count = whole(COUNT, 1..=MAX_WORD_LINES);
    let numbers = (whole(FIRST, 0..=u16::MAX), separator, count).map(|(first, (), count)| (first, count));
    let last = |(first, count): &(u16, u8)| first.checked_add(u16::from(*count) - 1).is_some();
    context(FIRST, verify(numbers, last)).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(line: u16, on: bool) -> LineWrite {
        LineWrite { line, on }
    }

    fn many(pairs: usize) -> Vec<u8> {
        let list: Vec<String> = (1..=pairs).map(|line| format!("{line} 1")).collect();
        format!("IW,{}", list.join(" ")).into_bytes()
    }

    // clause: CMD-IW-01
    #[test]
    fn one_line() {
        assert_eq!(
            Command::parse(b"IW,5 1"),
            Ok(Command::Iw([line(5, true)].to_vec()))
        );
        assert_eq!(
            Command::parse(b"iw, 5 0"),
            Ok(Command::Iw([line(5, false)].to_vec()))
        );
    }

    // clause: CMD-IW-03
    #[test]
    fn several_lines_with_blanks_or_commas() {
        let expected = Command::Iw([line(1, true), line(2, true), line(3, false), line(1, false)].to_vec());
        for message in [
            "IW,1 1 2 1 3 0 1 0",
            "IW,1,1,2,1,3,0,1,0",
            "IW,1,1 2,1, 3 , 0  1 0",
        ] {
            assert_eq!(
                Command::parse(message.as_bytes()).as_ref(),
                Ok(&expected),
                "{message}"
            );
        }
    }

    // clause: CMD-IW-02
    #[test]
    fn thirty_two_lines_and_no_more() {
        assert!(
            matches!(Command::parse(&many(MAX_LINES)), Ok(Command::Iw(lines)) if lines.len() == MAX_LINES)
        );
        assert!(Command::parse(&many(MAX_LINES + 1)).is_err());
    }

    // clause: CMD-IW-05 FRM-18
    #[test]
    fn bad_pairs_are_malformed_where_they_are_bad() {
        for (message, position) in [
            ("IW,1 2", 5),
            ("IW,1", 4),
            ("IW,1 1 2", 8),
            ("IW,-1 1", 3),
            ("IW,70000 1", 3),
            ("IW,1 10", 6),
            ("IW,", 3),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed {
                    letters: "IW", at, ..
                }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }

    #[test]
    fn lines_of_the_vendors_client() {
        let read = Command::Hi { first: 1, count: 8 };
        let write = Command::Ho {
            first: 1,
            count: 8,
            value: 165,
        };
        for (message, command) in [("HI,1 8", read), ("HO,1 8 165", write)] {
            assert_eq!(Command::parse(message.as_bytes()).as_ref(), Ok(&command));
            assert_eq!(command.encode(), format!("{message}\r").into_bytes());
        }
    }

    #[test]
    fn a_value_fits_its_lines() {
        for count in 1..=MAX_WORD_LINES {
            let most = u32::MAX >> (32 - count);
            let read = |value: u32| Command::parse(format!("HO,101 {count} {value}").as_bytes());
            let fitting = Command::Ho {
                first: 101,
                count,
                value: most,
            };
            assert_eq!(read(most), Ok(fitting));
            assert!(count == 32 || read(most + 1).is_err(), "{count}");
        }
    }

    #[test]
    fn the_last_line_has_a_number() {
        assert!(Command::parse(b"HI,65504 32").is_ok());
        assert!(Command::parse(b"HI,65535 1").is_ok());
        for message in ["HI,65505 32", "HI,65535 2", "HO,65535 2 0"] {
            let error = Command::parse(message.as_bytes());
            assert!(
                matches!(error, Err(CommandError::Malformed { at: 3, .. })),
                "{message}"
            );
        }
    }

    #[test]
    fn bad_lines_and_values_are_malformed_where_they_are_bad() {
        for (message, position) in [
            ("HI", 2),
            ("HI,", 3),
            ("HI,1", 4),
            ("HI,1 0", 5),
            ("HI,1 33", 5),
            ("HO,1 33 0", 5),
            ("HO,1 0 0", 5),
            ("HO,1 32 4294967296", 8),
            ("HI,1 256", 5),
            ("HI,65536 1", 3),
            ("HI,-1 1", 3),
            ("HI,1 8 1", 6),
            ("HO,1 8", 6),
            ("HO,1 8 -1", 7),
            ("HO,1 8 A5", 7),
            ("HO,1 8 4294967296", 7),
            ("HO,1 8 256", 7),
            ("HO,1 8 165 1", 10),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed { at, .. }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }
}
