//! Why an action had no effect. The control interface makes a problem document of it, scenarios a line of their report.

use alloc::string::{String, ToString};
use thiserror::Error;

/// Why an action had no effect.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}: {found} ({expected} expected)")]
pub struct ActionError {
    /// Whether the thing is missing or only in the wrong state.
    pub kind: ActionErrorKind,
    /// What would have been taken.
    pub expected: String,
    /// What was there.
    pub found: String,
    /// Where: the line, the variable, the file, the switch.
    pub place: String,
}

/// What kind of refusal it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionErrorKind {
    /// There is no such line, variable, file, alarm.
    Missing,
    /// The state of the controller forbids it, or the value does not fit.
    Conflict,
    /// The change of a file cannot be kept outside of the controller.
    NotPersisted,
}

impl ActionError {
    pub(crate) fn missing(place: &str, expected: &str, found: impl Into<String>) -> ActionError {
        let (expected, found, place) = (expected.to_string(), found.into(), place.to_string());
        ActionError {
            kind: ActionErrorKind::Missing,
            expected,
            found,
            place,
        }
    }

    /// The state forbids it at `place`, or the value does not fit.
    #[must_use]
    pub fn conflict(place: &str, expected: &str, found: impl Into<String>) -> ActionError {
        ActionError {
            kind: ActionErrorKind::Conflict,
            ..ActionError::missing(place, expected, found)
        }
    }
}
