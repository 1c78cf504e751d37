//! The error history file of EU (EU-01 to EU-07). Which errors are kept is the controller's business.

use super::fields::Field;
use super::{AlarmLevel, BodyError};
use crate::calendar::CalendarTime;
use alloc::vec::Vec;

/// Most entries of a file: the count has two digits (EU-01).
pub const MAX_ENTRIES: usize = 99;

/// An error that occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorEntry {
    /// Level, written as the main code.
    pub level: AlarmLevel,
    /// Code within the level, 1 to 999, written as the sub code.
    pub code: u16,
    /// When; of the year the last two digits are written.
    pub at: CalendarTime,
}

/// The content of the file: the newest first, 99 at most.
#[must_use]
pub fn encode_history(entries: &[ErrorEntry]) -> Vec<u8> {
    let _ = entries;
    Vec::new()
}

/// Reads a content; years are those of 2000 to 2099.
///
/// # Errors
/// A count that does not fit, an entry that is not `LLL-CCC YY-MM-DD HH:MM:SS`.
pub fn decode_history(content: &[u8]) -> Result<Vec<ErrorEntry>, BodyError> {
    Err(Field::whole("EU", content).error("entries"))
}
