//! Why a snapshot cannot be restored, and the check that says so.

use crate::prelude::*;
use scol_mini::RestoreError;
use ts3100_proto::error_text;

/// Why a snapshot cannot be restored.
#[derive(Debug, Clone, PartialEq)]
pub enum SnapshotError {
    /// A value that no run leads to.
    Value {
        /// Where: the fields, joined by dots.
        place: String,
        /// What could stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A machine or a memory that does not fit its program.
    Run {
        /// Where.
        place: String,
        /// What is wrong with it.
        reason: RestoreError,
    },
}

error_text! {
    SnapshotError;
    Self::Value { place, expected, found } => "snapshot, {place}: expected {expected}, found {found}";
    Self::Run { place, reason } => "snapshot, {place}: {reason}";
}

impl SnapshotError {
    #[expect(clippy::needless_pass_by_value, reason = "numbers, words and errors alike")]
    pub(crate) fn value(place: &str, expected: &str, found: impl ToString) -> SnapshotError {
        SnapshotError::Value {
            place: place.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    pub(crate) fn program(place: &str, reason: RestoreError) -> SnapshotError {
        let place = place.to_string();
        SnapshotError::Run { place, reason }
    }
}

/// Whether something of a snapshot can occur.
pub(crate) type CheckResult = Result<(), SnapshotError>;

/// Fails unless `holds`, with the place, what could stand there, and what does.
pub(crate) fn check(holds: bool, place: &str, expected: &str, found: impl ToString) -> CheckResult {
    if holds {
        return Ok(());
    }
    Err(SnapshotError::value(place, expected, found))
}
