//! The status file of SU in both layouts (decision D5). When it is sent is the controller's business.

use super::fields::Field;
use super::{BodyError, ExecutionStatus, MasterMode};
use crate::command::RunMode;
use alloc::string::{String, ToString};
use alloc::vec::Vec;


/// What SU tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusBody {
    /// Controller mode.
    pub master_mode: MasterMode,
    /// Operation mode.
    pub run_mode: RunMode,
    /// Name of the selected file; empty if none is selected. Holds no blank and no CR.
    pub file: String,
    /// Speed override in percent, 1 to 100.
    pub override_percent: u8,
    /// Speed limit in percent; our reading of the reserved field. The six records do not tell it.
    pub speed_limit_percent: u8,
    /// Machine lock: programs run without motion of the axes (SU-09).
    pub machine_lock: bool,
    /// Execution status.
    pub execution: ExecutionStatus,
}

/// How the six items are written (option `su.layout`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SuLayout {
    /// One record, items separated by one blank, no blank within, no CR at the end (hosts 7.1).
    OneRecord,
    /// Six records with CR after each, words as the manual prints them, the fourth empty (SU-11).
    SixRecords,
}

/// What a file without a speed limit is taken to mean, in percent.
const FULL_SPEED: u8 = 100;

impl StatusBody {
    /// The content of the file.
    #[must_use]
    pub fn encode(&self, layout: SuLayout) -> Vec<u8> {
        let _ = layout;
        Vec::new()
    }

    /// Reads a content of either layout. A missing or empty speed limit reads 100 %.
    ///
    /// # Errors
    /// An item that is missing, without its label, or with a word or number that is not in the manual.
    pub fn decode(content: &[u8]) -> Result<StatusBody, BodyError> {
        let whole = Field::whole("SU", content);
        Err(whole.error("six items"))
    }
}
