//! FL files that travel in one or several texts (FL-*, CMD-DL-03), and the rules for the content of a file on the
//! RAM drive (RAM-01, RAM-02, RAM-08).
//!
//! [`FlSender`] cuts a file into data sections, [`FlReceiver`] puts one together and checks it as it arrives. The RAM
//! drive itself and its capacity are the controller's. For framing see [`crate::text`], for the content of
//! parameter files [`crate::parameter`].

use crate::prelude::*;
use crate::text::{CR, EOF, LF, MAX_DATA};
use alloc::collections::VecDeque;

/// Characters a line of a user file may have, without its line end (RAM-01).
pub const MAX_LINE: usize = 252;
/// The first bytes of the first text of a file.
const PREFIX: &[u8] = b"FL,";

/// Which rules the content of a file must follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FileRule {
    /// A user file: printable ASCII, CR and LF; lines of at most [`MAX_LINE`] characters.
    User,
    /// A parameter file: anything but EOF; its reader is tolerant and a bad value keeps the one before.
    Parameter,
}

/// Why a file is rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// The first text does not begin with `FL,`.
    #[error("expected FL at the start of the file's first text")]
    NoPrefix,
    /// The file is larger than the free space.
    #[error("the file is longer than {limit} bytes")]
    TooLarge {
        /// Bytes that were free.
        limit: usize,
    },
    /// There are data after EOF.
    #[error("expected the end of the text after EOF, found more")]
    DataAfterEnd,
    /// A byte that the rule does not allow.
    #[error("line {line}, character {column}: expected printable ASCII, found the byte {found:02X}")]
    Character {
        /// Line, from 1.
        line: u32,
        /// Character in the line, from 1.
        column: usize,
        /// The byte at this position.
        found: u8,
    },
    /// A line has too many characters.
    #[error("line {line} is longer than {MAX_LINE} characters")]
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

/// The check of a file that arrives in blocks: the position so far.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
        let mut rest = bytes;
        while let Some(&byte) = rest.first() {
            // As many as there are at once: files are long, and checked when they come and when they are stored.
            let allowed = rest.iter().take_while(|&&byte| self.allows(byte)).count();
            let line = self.line;
            if allowed > 0 {
                self.column += allowed;
                if self.rule == FileRule::User && self.column > MAX_LINE {
                    return Err(FileError::LongLine { line });
                }
            } else if !matches!(byte, CR | LF) {
                let (column, found) = (self.column + 1, byte);
                return Err(FileError::Character { line, column, found });
            } else if byte == CR || !self.after_cr {
                self.line = line.saturating_add(1);
                self.column = 0;
            }
            self.after_cr = byte == CR;
            rest = rest.get(allowed.max(1)..).unwrap_or_default();
        }
        Ok(())
    }

    /// Whether a line may have this character.
    fn allows(&self, character: u8) -> bool {
        match self.rule {
            FileRule::User => (0x20..=0x7E).contains(&character),
            FileRule::Parameter => !matches!(character, EOF | CR | LF),
        }
    }
}

/// Splits a file into the data sections of its texts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlSender {
    #[serde(with = "crate::serde_latin1")]
    bytes: Vec<u8>,
    sent: usize,
    per_text: usize,
    /// Data bytes of the next texts, if they differ from `per_text`.
    lengths: VecDeque<usize>,
}

impl FlSender {
    /// A file (without EOF) in texts of at most 253 data bytes: `FL,` in the first, EOF as the last byte of
    /// the last (FL-02, FL-03, FL-05).
    pub fn new(content: impl AsRef<[u8]>) -> FlSender {
        FlSender {
            per_text: MAX_DATA,
            ..FlSender::single_text(content, &[EOF])
        }
    }

    /// A file in one text whatever its length, with `tail` after it: EOF, or nothing where its length is its end
    /// (ste80722 S23, S24).
    pub fn single_text(content: impl AsRef<[u8]>, tail: &[u8]) -> FlSender {
        let bytes = [PREFIX, content.as_ref(), tail].concat();
        FlSender {
            // More than MAX_DATA, so that `remaining_to_split` can tell the two constructors apart.
            per_text: bytes.len().max(MAX_DATA + 1),
            bytes,
            sent: 0,
            lengths: VecDeque::new(),
        }
    }

    /// The data section of the next text; `None` after the last one.
    pub fn next_text(&mut self) -> Option<&[u8]> {
        let rest = self.bytes.get(self.sent..).filter(|rest| !rest.is_empty())?;
        let length = self.lengths.pop_front().unwrap_or(self.per_text);
        let length = length.clamp(1, self.per_text.max(1));
        let text = rest.get(..length).unwrap_or(rest);
        self.sent += text.len();
        Some(text)
    }

    /// Data bytes left, if the file travels in texts of 253; `None` for a file in a single text.
    pub fn remaining_to_split(&self) -> Option<usize> {
        (self.per_text == MAX_DATA).then(|| self.bytes.len().saturating_sub(self.sent))
    }

    /// Sets how many data bytes each of the next texts carries, 1 to 253; later ones are full again. The manual
    /// does not say where files are split (FL-03).
    pub fn set_text_lengths(&mut self, lengths: impl IntoIterator<Item = usize>) {
        self.lengths = lengths.into_iter().collect();
    }

    /// Whether it can be sent to its end; to validate a deserialized one.
    pub fn is_valid(&self) -> bool {
        self.sent <= self.bytes.len() && self.per_text > 0
    }

    /// Whether `next_text` has returned the whole file.
    pub fn is_done(&self) -> bool {
        self.sent >= self.bytes.len()
    }
}

/// The result of adding one text to the file under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// The text was accepted and the file is not complete.
    More,
    /// The file is complete: its content without EOF.
    Complete(Vec<u8>),
    /// The file is rejected, and its received bytes are dropped.
    Refused(FileError),
}

/// Joins the data sections of texts to a file and checks it as it arrives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlReceiver {
    limit: usize,
    check: LineCheck,
    #[serde(with = "crate::serde_latin1")]
    content: Vec<u8>,
    begun: bool,
    ended: bool,
}

impl FlReceiver {
    /// Expects a file of at most `limit` bytes (without EOF) that follows `rule`.
    pub fn new(limit: usize, rule: FileRule) -> FlReceiver {
        FlReceiver {
            limit,
            check: LineCheck::new(rule),
            content: Vec::new(),
            begun: false,
            ended: false,
        }
    }

    /// Adds the data section of one text.
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

    /// Whether the content and the position in it are within their limits; to validate a deserialized one.
    pub fn is_valid(&self) -> bool {
        self.content.len() <= self.limit && self.check.column <= self.content.len()
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
