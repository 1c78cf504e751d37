//! Why an action had no effect. The control interface makes a problem document of it, scenarios a line of their report.

use crate::prelude::*;
use core::fmt::Display;

/// Whether an action had its effect.
pub(crate) type ActionResult = Result<(), ActionError>;

/// Why an action had no effect. An event says its sentence alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{sentence}")]
pub struct ActionError {
    /// Whether the thing is missing or only in the wrong state.
    #[serde(skip)]
    pub kind: ActionErrorKind,
    /// The action and the reason: `cannot turn the servo on: the emergency stop is pressed`.
    #[serde(rename = "reason")]
    pub sentence: String,
    /// Where: the line, the variable, the file, the switch.
    #[serde(skip)]
    pub place: String,
}

/// Classes of refusals.
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
    /// There is no such thing as `place` names.
    pub(crate) fn missing(place: impl Display, sentence: impl Display) -> ActionError {
        let (place, sentence) = (place.to_string(), sentence.to_string());
        let kind = ActionErrorKind::Missing;
        ActionError {
            kind,
            sentence,
            place,
        }
    }

    /// The state forbids it at `place`, or the value does not fit.
    pub fn conflict(place: impl Display, sentence: impl Display) -> ActionError {
        let kind = ActionErrorKind::Conflict;
        ActionError {
            kind,
            ..ActionError::missing(place, sentence)
        }
    }

    /// The same in the usual words: `cannot VERB: REASON`.
    pub(crate) fn cannot(place: impl Display, verb: impl Display, reason: impl Display) -> ActionError {
        ActionError::conflict(place, format!("cannot {verb}: {reason}"))
    }
}
