//! The error history of the controller as a hidden file in the backing directory: with `--drive` the end of the daemon is
//! a power cycle, and EU answers the same after it. A hidden file is not a file of the RAM drive.

use super::{Store, StoreError};
use crate::files::{self, cannot};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::io;
use std::path::Path;
use ts3100_controller::alarm::Alarm;
use ts3100_controller::limits::MAX_HISTORY;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::words::plain_message;

/// Name of the file in the backing directory.
pub(super) const FILE: &str = ".ts3100.history";
/// Version of the file format.
const VERSION: u32 = 1;
/// Read limit in bytes, more than the longest history needs.
const MAX_SIZE: u64 = 1024 * 1024;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    version: u32,
    history: VecDeque<Alarm>,
}

impl Store {
    /// The error history as it was saved last, newest first.
    pub fn history(&self) -> &VecDeque<Alarm> {
        &self.history
    }

    /// Saves the error history durably if it has changed since the last save.
    ///
    /// # Errors
    /// The operating system failed; the next call tries again.
    pub fn save_history(&mut self, history: VecDeque<Alarm>) -> Result<(), StoreError> {
        if self.history == history {
            return Ok(());
        }
        let version = VERSION;
        let document = Document { version, history };
        let path = self.directory.join(FILE);
        let content = serde_json::to_vec(&document).map_err(cannot("write", &path))?;
        self.replace(FILE, &content)?;
        self.history = document.history;
        Ok(())
    }

    /// Reads the saved history; a damaged file counts as missing and adds a warning.
    pub(super) fn read_history(&mut self) {
        let path = self.directory.join(FILE);
        match read(&path) {
            Ok(history) => self.history = history,
            Err(reason) => self.warnings.push(format!(
                "cannot read the error history {}: {reason}; EU starts empty",
                path.display()
            )),
        }
    }
}

/// Why a saved history cannot be used.
#[derive(Debug, thiserror::Error)]
enum HistoryError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error("{}", plain_message(&.0.to_string()))]
    Json(#[from] serde_json::Error),
    #[error("expected version {VERSION}, found {0}")]
    Version(u32),
    #[error("expected at most {MAX_HISTORY} alarms, found {0}")]
    Length(usize),
    #[error("expected a date, found {0:?}")]
    Date(CalendarTime),
}

fn read(path: &Path) -> Result<VecDeque<Alarm>, HistoryError> {
    let content = match files::read(path, MAX_SIZE) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(VecDeque::new()),
        content => content?,
    };
    let Document { version, history } = serde_json::from_slice(&content)?;
    if version != VERSION {
        return Err(HistoryError::Version(version));
    }
    if history.len() > MAX_HISTORY {
        return Err(HistoryError::Length(history.len()));
    }
    match history.iter().find(|alarm| !alarm.at.is_valid()) {
        Some(alarm) => Err(HistoryError::Date(alarm.at)),
        None => Ok(history),
    }
}
