//! IW: forces I/O lines, `IW,<line> <0|1> ...`.
//!
//! The controller knows which numbers are lines (CMD-IW-04). HI and HO are in `line_value.rs`.

use crate::command::operand::{Operands, ParseResult, list, separator, whole};
use crate::command::{Command, CommandError};
use crate::prelude::*;
use nom::Parser;
use nom::character::complete::one_of;
use nom::error::context;

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
}
