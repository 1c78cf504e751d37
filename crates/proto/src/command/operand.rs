//! The grammar parts that all commands share: the comma after the letters, blanks, separators, and errors that say
//! what was expected and where.
//!
//! Each group of commands builds its own grammar from these; [`super::Command::parse`] picks the group.

use crate::command::{Command, CommandError, excerpt};
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::RangeInclusive;
use core::str::FromStr;

/// Letters of a command, before its comma.
const LETTERS: usize = 2;
/// What must follow the last operand.
const END: &str = "the end of the message";

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
        if rest.trim_ascii_end().is_empty() {
            Ok(command)
        } else {
            Err(self.malformed(END, LETTERS))
        }
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

    /// Reads the operands, of which the first is `expected`; trailing blanks are allowed.
    pub(super) fn parse<T>(
        self,
        expected: &str,
        grammar: impl FnOnce(&mut Cursor<'a>) -> Result<T, CommandError>,
    ) -> Result<T, CommandError> {
        let rest = self.text(expected)?;
        let operands = self;
        let mut cursor = Cursor { operands, rest };
        let value = grammar(&mut cursor)?;
        if cursor.is_at_end() {
            Ok(value)
        } else {
            Err(cursor.error(END))
        }
    }

    /// One number of this range.
    pub(super) fn number(self, expected: &str, range: RangeInclusive<u8>) -> Result<u8, CommandError> {
        self.parse(expected, |cursor| cursor.whole(expected, range))
    }

    /// The error that `expected` is missing at byte `at` of the message.
    pub(super) fn malformed(self, expected: &str, at: usize) -> CommandError {
        let found = match self.message.get(at..) {
            None | Some([]) => String::from(END),
            Some(rest) => alloc::format!("\"{}\"", excerpt(rest)),
        };
        CommandError::Malformed {
            letters: self.letters,
            expected: String::from(expected),
            found,
            at,
        }
    }
}

/// The operands that are not read yet. What does not fit is an error at its first character.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    operands: Operands<'a>,
    rest: &'a str,
}

impl<'a> Cursor<'a> {
    /// What is not read yet.
    pub(super) fn rest(&self) -> &'a str {
        self.rest
    }

    /// The error that `expected` is missing here.
    pub(super) fn error(&self, expected: &str) -> CommandError {
        let at = self.operands.len() - self.rest.len();
        self.operands.malformed(expected, at)
    }

    /// Whether only blanks are left.
    fn is_at_end(&self) -> bool {
        self.rest.trim_start_matches(' ').is_empty()
    }

    /// The next `length` bytes, as `read` takes them.
    pub(super) fn take<T>(
        &mut self,
        expected: &str,
        length: usize,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, CommandError> {
        let (word, rest) = self.rest.split_at_checked(length).unwrap_or((self.rest, ""));
        let value = read(word).ok_or_else(|| self.error(expected))?;
        self.rest = rest;
        Ok(value)
    }

    /// The run of characters that belong to a word, as `read` takes them; it refuses an empty one.
    pub(super) fn word<T>(
        &mut self,
        expected: &str,
        belongs: impl Fn(char) -> bool,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, CommandError> {
        let end = self.rest.find(|letter| !belongs(letter));
        self.take(expected, end.unwrap_or(self.rest.len()), read)
    }

    /// A run of the characters that numbers consist of.
    pub(super) fn number<T>(
        &mut self,
        expected: &str,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, CommandError> {
        self.word(
            expected,
            |letter| letter.is_ascii_digit() || "+-.eE".contains(letter),
            read,
        )
    }

    /// A run of digits, as `read` takes them.
    pub(super) fn digits<T>(
        &mut self,
        expected: &str,
        read: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, CommandError> {
        self.word(expected, |letter| letter.is_ascii_digit(), read)
    }

    /// A whole number without sign, of a range.
    pub(super) fn whole<N: FromStr + PartialOrd>(
        &mut self,
        expected: &str,
        range: RangeInclusive<N>,
    ) -> Result<N, CommandError> {
        let within = |digits: &str| digits.parse().ok().filter(|number| range.contains(number));
        self.digits(expected, within)
    }

    /// 0 or 1.
    pub(super) fn flag(&mut self, expected: &str) -> Result<bool, CommandError> {
        self.take(expected, 1, |digit| match digit {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        })
    }

    /// Between operands: blanks, or a comma with or without them (Table 5.1 prints commas, the formats blanks).
    pub(super) fn separator(&mut self) -> Result<&mut Cursor<'a>, CommandError> {
        let after = self.rest.trim_start_matches(' ');
        let after = after
            .strip_prefix(',')
            .map_or(after, |after| after.trim_start_matches(' '));
        if after.len() == self.rest.len() {
            return Err(self.error("a blank"));
        }
        self.rest = after;
        Ok(self)
    }

    /// Operands of one kind, one or more, up to the end. Trailing blanks do not begin a further one.
    pub(super) fn list<T>(
        &mut self,
        item: impl Fn(&mut Cursor<'a>) -> Result<T, CommandError>,
    ) -> Result<Vec<T>, CommandError> {
        let mut items = alloc::vec![item(self)?];
        while !self.is_at_end() && self.separator().is_ok() {
            items.push(item(self)?);
        }
        Ok(items)
    }
}
