//! The grammar parts that all commands share: the comma after the letters, blanks, separators, and errors that say
//! what was expected and where.
//!
//! Each group of commands builds its own grammar from these; [`super::Command::parse`] picks the group.

use crate::command::{Command, CommandError, excerpt};
use crate::prelude::*;
use core::ops::RangeInclusive;
use core::str::FromStr;
use nom::branch::alt;
use nom::bytes::complete::take_while1;
use nom::character::complete::{char, digit1, space0, space1};
use nom::combinator::{cut, eof, map_opt, not};
use nom::error::{ContextError, ErrorKind, ParseError, context};
use nom::multi::separated_list1;
use nom::sequence::preceded;
use nom::{IResult, Parser};

/// Letters of a command, before its comma.
const LETTERS: usize = 2;
/// Expected after the last operand.
const END: &str = "the end of the message";

/// The expectation of a grammar, and the input from there on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct GrammarError<'a> {
    pub(super) rest: &'a str,
    pub(super) expected: &'static str,
}

impl<'a> ParseError<&'a str> for GrammarError<'a> {
    fn from_error_kind(rest: &'a str, _: ErrorKind) -> GrammarError<'a> {
        GrammarError { rest, expected: "" }
    }

    fn append(_: &'a str, _: ErrorKind, other: GrammarError<'a>) -> GrammarError<'a> {
        other
    }
}

impl<'a> ContextError<&'a str> for GrammarError<'a> {
    /// The innermost expectation wins, at the start of what it names.
    fn add_context(rest: &'a str, expected: &'static str, other: GrammarError<'a>) -> GrammarError<'a> {
        if other.expected.is_empty() {
            GrammarError { rest, expected }
        } else {
            other
        }
    }
}

/// Result of a grammar.
pub(super) type ParseResult<'a, T> = IResult<&'a str, T, GrammarError<'a>>;

/// Between operands: blanks, or a comma with or without them (Table 5.1 prints commas, the formats blanks).
pub(super) fn separator(input: &str) -> ParseResult<'_, ()> {
    let comma = (space0, char(','), space0).map(|_| ());
    context("a blank", alt((comma, space1.map(|_| ())))).parse(input)
}

/// Operands of one kind, one or more, up to the end. Trailing blanks do not begin a further one.
pub(super) fn list<'a, T>(
    item: impl Parser<&'a str, Output = T, Error = GrammarError<'a>>,
) -> impl Parser<&'a str, Output = Vec<T>, Error = GrammarError<'a>> {
    separated_list1(preceded(not((space0, eof)), separator), cut(item))
}

/// A run of the characters that numbers consist of.
pub(super) fn number_token(input: &str) -> ParseResult<'_, &str> {
    take_while1(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E')).parse(input)
}

/// A whole number without sign, of a range.
pub(super) fn whole<'a, N: FromStr + PartialOrd>(
    expected: &'static str,
    range: RangeInclusive<N>,
) -> impl Parser<&'a str, Output = N, Error = GrammarError<'a>> {
    let within = move |digits: &str| digits.parse().ok().filter(|number| range.contains(number));
    context(expected, map_opt(digit1, within))
}

/// A message whose letters are known and whose operands are not read yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operands<'a> {
    letters: &'static str,
    message: &'a [u8],
}

impl<'a> Operands<'a> {
    /// `message` begins with `letters`, in upper or lower case.
    pub(super) fn new(letters: &'static str, message: &'a [u8]) -> Operands<'a> {
        Operands { letters, message }
    }

    /// Bytes of the whole message.
    pub(super) fn len(self) -> usize {
        self.message.len()
    }

    /// `command` if there are no operands; trailing blanks do not count.
    pub(super) fn none(self, command: Command) -> Result<Command, CommandError> {
        let rest = self.message.get(LETTERS..).unwrap_or_default();
        let none = rest.trim_ascii_end().is_empty();
        none.then_some(command)
            .ok_or_else(|| self.malformed(END, LETTERS))
    }

    /// Everything after the comma.
    pub(super) fn raw(self) -> Result<&'a [u8], CommandError> {
        match self.message.get(LETTERS..) {
            Some([b',', rest @ ..]) => Ok(rest),
            _ => Err(self.malformed("a comma after the letters", LETTERS)),
        }
    }

    /// The text after the comma without the blanks in front of it: printable ASCII, not empty.
    pub(super) fn text(self, expected: &str) -> Result<&'a str, CommandError> {
        let raw = self.raw()?;
        let start = self.message.len() - raw.len();
        if let Some(at) = raw.iter().position(|byte| !(0x20..=0x7E).contains(byte)) {
            return Err(self.malformed("printable ASCII", start + at));
        }
        let text = core::str::from_utf8(raw)
            .unwrap_or_default()
            .trim_start_matches(' ');
        if text.is_empty() {
            Err(self.malformed(expected, self.message.len()))
        } else {
            Ok(text)
        }
    }

    /// Parses the operands with a grammar; trailing blanks are allowed.
    pub(super) fn parse<T>(
        self,
        expected: &'static str,
        grammar: impl Parser<&'a str, Output = T, Error = GrammarError<'a>>,
    ) -> Result<T, CommandError> {
        let text = self.text(expected)?;
        let end = context(END, (space0, eof));
        match context(expected, (grammar, end)).parse(text) {
            Ok((_, (value, _))) => Ok(value),
            Err(nom::Err::Error(unmet) | nom::Err::Failure(unmet)) => {
                Err(self.malformed(unmet.expected, self.message.len() - unmet.rest.len()))
            }
            Err(nom::Err::Incomplete(_)) => Err(self.malformed(expected, self.message.len())),
        }
    }

    /// One number of this range.
    pub(super) fn number(
        self,
        expected: &'static str,
        range: RangeInclusive<u8>,
    ) -> Result<u8, CommandError> {
        self.parse(expected, whole(expected, range))
    }

    /// The error that `expected` is missing at byte `at` of the message.
    pub(super) fn malformed(self, expected: &str, at: usize) -> CommandError {
        let found = match self.message.get(at..) {
            None | Some([]) => String::from(END),
            Some(rest) => format!("\"{}\"", excerpt(rest)),
        };
        CommandError::Malformed {
            letters: self.letters,
            expected: String::from(expected),
            found,
            at,
        }
    }
}
