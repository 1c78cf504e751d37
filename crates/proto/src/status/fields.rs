//! Splits the content of a status file into records and fields, and keeps the byte position for error messages.
//!
//! Only mechanics: the modules next to it know what a field means.

use super::BodyError;
use crate::prelude::*;
use crate::text::CR;
use crate::words::number;
use core::ops::Range;

/// Longest piece of a foreign content that an error quotes, in bytes.
const MAX_QUOTE: usize = 32;

/// A part of the content, with its position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Field<'a> {
    file: &'static str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Field<'a> {
    /// The whole content of a file that `file` asks for.
    pub(crate) fn whole(file: &'static str, bytes: &'a [u8]) -> Field<'a> {
        Field { file, bytes, at: 0 }
    }

    /// The whole content of a file of one record; a CR at its end is allowed.
    pub(crate) fn record(file: &'static str, bytes: &'a [u8]) -> Field<'a> {
        Field::whole(file, bytes.strip_suffix(&[CR]).unwrap_or(bytes))
    }

    pub(crate) fn bytes(self) -> &'a [u8] {
        self.bytes
    }

    /// The bytes as ASCII 20-7E.
    pub(crate) fn text(self, expected: &'static str) -> Result<&'a str, BodyError> {
        let printable = self.bytes.iter().all(|byte| (0x20..0x7F).contains(byte));
        let text = core::str::from_utf8(self.bytes).ok().filter(|_| printable);
        text.ok_or_else(|| self.error(expected))
    }

    /// An error that quotes this part.
    pub(crate) fn error(self, expected: &'static str) -> BodyError {
        let quoted = self.bytes.get(..MAX_QUOTE).unwrap_or(self.bytes);
        let found = match quoted {
            [] => String::from("nothing"),
            some => format!("`{}`", some.escape_ascii()),
        };
        BodyError {
            file: self.file,
            expected,
            found,
            at: self.at,
        }
    }

    /// The parts between separators; one part more than there are separators.
    pub(crate) fn split(self, separator: u8) -> impl Iterator<Item = Field<'a>> {
        let mut at = self.at;
        self.bytes
            .split(move |byte| *byte == separator)
            .map(move |bytes| {
                let part = Field {
                    file: self.file,
                    bytes,
                    at,
                };
                at += bytes.len() + 1;
                part
            })
    }

    /// The records of a file in which CR ends each; a CR after the last may be missing.
    pub(crate) fn records(self) -> impl Iterator<Item = Field<'a>> {
        let inner = self.bytes.strip_suffix(&[CR]).unwrap_or(self.bytes);
        let count = if self.bytes.is_empty() { 0 } else { usize::MAX };
        Field { bytes: inner, ..self }.split(CR).take(count)
    }

    /// Where its bytes are in the content.
    pub(crate) fn range(self) -> Range<usize> {
        self.at..self.at + self.bytes.len()
    }

    /// The first `length` bytes and the rest; all and nothing if there are fewer.
    pub(crate) fn split_at(self, length: usize) -> (Field<'a>, Field<'a>) {
        let (head, tail) = self.bytes.split_at_checked(length).unwrap_or((self.bytes, &[]));
        let rest = Field {
            bytes: tail,
            at: self.at + head.len(),
            ..self
        };
        (Field { bytes: head, ..self }, rest)
    }

    /// The first `length` bytes and the rest, if there are so many.
    pub(crate) fn cut(self, length: usize) -> Option<(Field<'a>, Field<'a>)> {
        (length <= self.bytes.len()).then(|| self.split_at(length))
    }

    /// The parts of a record of fixed widths, one with each call, then the rest. In the pattern a run of one letter is
    /// a part, everything else separates parts: `YY-MM-DD hh:mm`.
    pub(crate) fn parts(
        self,
        mut pattern: &'static str,
        expected: &'static str,
    ) -> impl FnMut() -> Result<Field<'a>, BodyError> {
        let mut rest = self;
        move || {
            let Some(letter) = pattern.chars().next() else {
                return Ok(rest);
            };
            let after = pattern.trim_start_matches(letter);
            let width = pattern.len() - after.len();
            pattern = after.trim_start_matches(|char: char| !char.is_ascii_alphabetic());
            let separator = after.strip_suffix(pattern).unwrap_or_default();
            let (part, tail) = rest.cut(width).ok_or_else(|| rest.error(expected))?;
            rest = tail.after(separator, expected)?;
            Ok(part)
        }
    }

    /// The rest after a prefix, letters of either case.
    pub(crate) fn after(self, prefix: &str, expected: &'static str) -> Result<Field<'a>, BodyError> {
        match self.cut(prefix.len()) {
            Some((head, rest)) if head.bytes.eq_ignore_ascii_case(prefix.as_bytes()) => Ok(rest),
            _ => Err(self.error(expected)),
        }
    }

    /// A decimal number without sign.
    pub(crate) fn number<N: core::str::FromStr>(self, expected: &'static str) -> Result<N, BodyError> {
        let number = core::str::from_utf8(self.bytes).ok().and_then(number);
        number.ok_or_else(|| self.error(expected))
    }

    /// A decimal number without sign, `most` at most.
    pub(crate) fn at_most<N: core::str::FromStr + PartialOrd + Copy>(
        self,
        most: N,
        expected: &'static str,
    ) -> Result<N, BodyError> {
        let value = Some(self.number(expected)?).filter(|value| *value <= most);
        value.ok_or_else(|| self.error(expected))
    }

    /// A finite number with a decimal point; of other characters only `signs` are in it.
    pub(crate) fn decimal(self, signs: &[u8], expected: &'static str) -> Result<f64, BodyError> {
        let text = self.text(expected)?;
        let known = |byte: u8| byte.is_ascii_digit() || byte == b'.' || signs.contains(&byte);
        let plain = text.contains('.') && text.bytes().all(known);
        let value = text.parse().ok().filter(|value: &f64| plain && value.is_finite());
        value.ok_or_else(|| self.error(expected))
    }
}
