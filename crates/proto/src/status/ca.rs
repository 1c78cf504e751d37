//! The directory file of CA (DIR-01 to DIR-04). Which files there are, and in which order, is the RAM
//! drive's business.

use super::BodyError;
use super::fields::Field;
use alloc::string::String;
use alloc::vec::Vec;

/// One file of the RAM drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DirectoryEntry {
    /// File name, 1 to 12 characters, no blank.
    pub name: String,
    /// Size in bytes without EOF (DIR-03).
    pub size: u32,
    /// Attribute, left out if there is none; no blank.
    pub attribute: Option<String>,
}

/// The content of the file: `NAME SIZE` or `NAME SIZE ATTRIBUTE` and CR for each entry (DIR-02).
#[must_use]
pub fn encode_directory(entries: &[DirectoryEntry]) -> Vec<u8> {
    let _ = entries;
    Vec::new()
}

/// Reads a content.
///
/// # Errors
/// A record that is not a name, a number and at most one attribute, separated by one blank.
pub fn decode_directory(content: &[u8]) -> Result<Vec<DirectoryEntry>, BodyError> {
    Err(Field::whole("CA", content).error("records"))
}
