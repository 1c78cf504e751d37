//! The version file of VR in both layouts (hosts VR, VR-01 to VR-03). Names, dates and checksums are the
//! caller's.

use super::BodyError;
use super::fields::Field;
use crate::calendar::CalendarTime;
use alloc::string::String;
use alloc::vec::Vec;

/// Characters of a system name; further ones are cut.
pub const NAME_LENGTH: usize = 10;

/// One part of the system software.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VersionRecord {
    /// System name, ASCII, ten characters at most.
    pub name: String,
    /// Date and time of creation; the second is not written.
    pub date: CalendarTime,
    /// Checksum, written as four hexadecimal digits.
    pub checksum: u16,
}

/// How a record is written (option `vr.layout`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VrLayout {
    /// One record: name filled to 11 columns, `YYYY-MM-DD HH:MM`, a blank, the checksum, CR.
    Blanks,
    /// Records of 30 bytes: name filled to 10 columns, `YYYY/MM/DD`, `HH:MM`, the checksum, CR.
    Packed,
}

/// The content of the file. [`VrLayout::Blanks`] holds the first record only: it is all that the hosts
/// that read this layout are known to accept.
#[must_use]
pub fn encode_versions(records: &[VersionRecord], layout: VrLayout) -> Vec<u8> {
    let _ = (records, layout);
    Vec::new()
}

/// Reads a content of either layout, record by record; the seconds are 0.
///
/// # Errors
/// A record of another length, or with a date, time or checksum that is none.
pub fn decode_versions(content: &[u8]) -> Result<Vec<VersionRecord>, BodyError> {
    Err(Field::whole("VR", content).error("records"))
}
