//! Why a snapshot cannot be restored, and the check that says so.

use crate::prelude::*;
use scol_mini::RestoreError;

/// Why a snapshot cannot be restored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SnapshotError {
    /// A value that no run leads to.
    #[error("snapshot, {place}: expected {expected}, found {found}")]
    Value {
        /// Where: the fields, joined by dots.
        place: String,
        expected: String,
        found: String,
    },
    /// A machine or a memory that does not fit its program.
    #[error("snapshot, {place}: {reason}")]
    Run { place: String, reason: RestoreError },
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

/// Fails unless `holds`, with the place, the expected and the found value.
pub(crate) fn check(holds: bool, place: &str, expected: &str, found: impl ToString) -> CheckResult {
    if holds {
        return Ok(());
    }
    Err(SnapshotError::value(place, expected, found))
}
