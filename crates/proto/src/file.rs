//! FL files over one or many texts (FL-*, CMD-DL-03), and what may stand in a file of the RAM drive
//! (RAM-01, RAM-02, RAM-08). Where files are kept, and how large they may be, is the controller's.

use crate::text::{CR, EOF, LF, MAX_DATA};
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use thiserror::Error;

/// Characters a line of a user file may have, without its line end (RAM-01).
pub const MAX_LINE: usize = 252;
/// What the first text of a file begins with.
const PREFIX: &[u8] = b"FL,";

/// What is asked of the content of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FileRule {
    /// A user file: printable ASCII, CR and LF; lines of at most [`MAX_LINE`] characters.
    User,
    /// A parameter file: anything but EOF; its reader is tolerant and a bad value keeps the one before.
    Parameter,
}

/// Why a file was not taken.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FileError {
    /// The first text does not begin with `FL,`.
    #[error("FL, expected at the start of the file's first text")]
    NoPrefix,
    /// The file is larger than there is room for.
    #[error("at most {limit} bytes expected, more found")]
    TooLarge {
        /// Bytes there was room for.
        limit: usize,
    },
    /// Something stands after EOF.
    #[error("the end of the text expected after EOF, more found")]
    DataAfterEnd,
    /// A character that a file must not hold.
    #[error("line {line}, character {column}: printable ASCII expected, {found:02X} found")]
    Character {
        /// Line, from 1.
        line: u32,
        /// Character in the line, from 1.
        column: usize,
        /// The byte.
        found: u8,
    },
    /// A line has too many characters.
    #[error("line {line}: at most {MAX_LINE} characters expected, more found")]
    LongLine {
        /// Line, from 1.
        line: u32,
    },
}

/// Checks a whole file (without EOF) against a rule.
///
/// # Errors
/// The first thing that breaks the rule, with its line.
pub fn check_file(content: &[u8], rule: FileRule) -> Result<(), FileError> {
    LineCheck::new(rule).push(content)
}

/// Checks a whole user file (without EOF).
///
/// # Errors
/// As [`check_file`].
pub fn check_user_file(content: &[u8]) -> Result<(), FileError> {
    check_file(content, FileRule::User)
}

/// Where the check of a file that comes in blocks stands.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
struct LineCheck {
    rule: FileRule,
    line: u32,
    column: usize,
    after_cr: bool,
}

impl LineCheck {
    fn new(rule: FileRule) -> LineCheck {
        LineCheck {
            rule,
            line: 1,
            column: 0,
            after_cr: false,
        }
    }

    fn push(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        for &byte in bytes {
            match byte {
                LF if self.after_cr => {}
                CR | LF => {
                    self.line = self.line.saturating_add(1);
                    self.column = 0;
                }
                _ => {
                    self.column += 1;
                    self.character(byte)?;
                }
            }
            self.after_cr = byte == CR;
        }
        Ok(())
    }

    fn character(&self, found: u8) -> Result<(), FileError> {
        let (line, column) = (self.line, self.column);
        let allowed = match self.rule {
            FileRule::User => (0x20..=0x7E).contains(&found),
            FileRule::Parameter => found != EOF,
        };
        if !allowed {
            return Err(FileError::Character { line, column, found });
        }
        if self.rule == FileRule::User && column > MAX_LINE {
            return Err(FileError::LongLine { line });
        }
        Ok(())
    }
}

/// Cuts a file into the data sections of its texts.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct FlSender {
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    bytes: Vec<u8>,
    sent: usize,
    per_text: usize,
    /// Data bytes of the next texts, where they are not `per_text`.
    lengths: VecDeque<usize>,
}

impl FlSender {
    /// A file (without EOF) in texts of at most 253 data bytes: `FL,` in the first, EOF as the last byte of
    /// the last (FL-02, FL-03, FL-05).
    #[must_use]
    pub fn new(content: Vec<u8>) -> FlSender {
        FlSender {
            per_text: MAX_DATA,
            ..FlSender::single_text(content, &[EOF])
        }
    }

    /// A file in one text whatever its length, with `tail` after it: EOF, or nothing where its length is its end
    /// (ste80722 S23, S24).
    #[must_use]
    pub fn single_text(content: Vec<u8>, tail: &[u8]) -> FlSender {
        let mut bytes = content;
        bytes.splice(0..0, PREFIX.iter().copied());
        bytes.extend_from_slice(tail);
        FlSender {
            // Longer than a text that is cut, so that `to_be_cut` tells the two apart.
            per_text: bytes.len().max(MAX_DATA + 1),
            bytes,
            sent: 0,
            lengths: VecDeque::new(),
        }
    }

    /// The data section of the next text; none when all has been given out.
    pub fn next_text(&mut self) -> Option<Vec<u8>> {
        let rest = self.bytes.get(self.sent..).filter(|rest| !rest.is_empty())?;
        let wanted = self.lengths.pop_front().unwrap_or(self.per_text);
        let wanted = wanted.clamp(1, self.per_text.max(1));
        let text = rest.get(..wanted).unwrap_or(rest).to_vec();
        self.sent += text.len();
        Some(text)
    }

    /// Data bytes not given out yet, if the file travels in texts of 253; `None` for one that is a single text.
    #[must_use]
    pub fn remaining_to_split(&self) -> Option<usize> {
        (self.per_text == MAX_DATA).then(|| self.bytes.len().saturating_sub(self.sent))
    }

    /// Has the next texts carry so many data bytes each, at least 1 and at most 253; those behind them are full
    /// again. Where files are cut is not said (FL-03).
    pub fn set_text_lengths(&mut self, lengths: impl IntoIterator<Item = usize>) {
        self.lengths = lengths.into_iter().collect();
    }

    /// Whether texts come of it to the end, for one that was read.
    #[cfg(feature = "serde")]
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.sent <= self.bytes.len() && self.per_text > 0
    }

    /// Whether all texts have been given out.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.sent >= self.bytes.len()
    }
}

/// What a text did to the file under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// The text was taken; more is to come.
    More,
    /// The file is complete: its content without EOF.
    Complete(Vec<u8>),
    /// The file is refused; what had come is dropped.
    Refused(FileError),
}

/// Puts a file together from the data sections of its texts.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct FlReceiver {
    limit: usize,
    check: LineCheck,
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    content: Vec<u8>,
    begun: bool,
    ended: bool,
}

impl FlReceiver {
    /// Awaits a file of at most `limit` bytes (without EOF) that keeps to `rule`.
    #[must_use]
    pub fn new(limit: usize, rule: FileRule) -> FlReceiver {
        FlReceiver {
            limit,
            check: LineCheck::new(rule),
            content: Vec::new(),
            begun: false,
            ended: false,
        }
    }

    /// Takes in the data section of one text.
    pub fn push(&mut self, data: &[u8]) -> Received {
        match self.take(data) {
            Ok(received) => received,
            Err(fault) => {
                self.content = Vec::new();
                self.ended = true;
                Received::Refused(fault)
            }
        }
    }

    /// Whether the content is within its limit and its place in it is one, for one that was read.
    #[cfg(feature = "serde")]
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.content.len() <= self.limit && self.check.column <= self.content.len()
    }

    /// Whether the first text has come.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.begun
    }

    fn take(&mut self, data: &[u8]) -> Result<Received, FileError> {
        if self.ended {
            return Err(FileError::DataAfterEnd);
        }
        let mut block = data;
        if !self.begun {
            let (prefix, rest) = data.split_at_checked(PREFIX.len()).ok_or(FileError::NoPrefix)?;
            if !prefix.eq_ignore_ascii_case(PREFIX) {
                return Err(FileError::NoPrefix);
            }
            self.begun = true;
            block = rest;
        }
        let mut pieces = block.splitn(2, |&byte| byte == EOF);
        let body = pieces.next().unwrap_or_default();
        if self.content.len() + body.len() > self.limit {
            return Err(FileError::TooLarge { limit: self.limit });
        }
        self.check.push(body)?;
        self.content.extend_from_slice(body);
        match pieces.next() {
            None => Ok(Received::More),
            Some([] | [CR]) => {
                self.ended = true;
                Ok(Received::Complete(core::mem::take(&mut self.content)))
            }
            Some(_) => Err(FileError::DataAfterEnd),
        }
    }
}

#[cfg(test)]
mod tests;
