//! The JSON body of every error response: the sentence, and what was expected, what was found, and where.
//!
//! Refusals of the controller are converted here. Responses with an effect are made by the resources.

use crate::printable::printable;
use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use ts3100_controller::action::{ActionError, ActionErrorKind};
use utoipa::ToSchema;

/// Why a call had no effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Problem {
    #[serde(skip)]
    status: StatusCode,
    /// The whole of it in one sentence.
    error: String,
    /// What would have been taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected: Option<String>,
    /// What was there.
    #[serde(skip_serializing_if = "Option::is_none")]
    found: Option<String>,
    /// Where: the header, the field of the body, the line, the variable.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    place: Option<String>,
}

impl Problem {
    /// A problem in one sentence.
    pub fn new(status: StatusCode, error: impl Into<String>) -> Problem {
        Problem {
            status,
            error: printable(error.into()),
            expected: None,
            found: None,
            place: None,
        }
    }

    /// A problem with its parts; the sentence is made of them.
    pub fn expected_found(
        status: StatusCode,
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Problem {
        let (place, expected, found) = (
            printable(place.into()),
            printable(expected.into()),
            printable(found.into()),
        );
        Problem {
            status,
            error: format!("{place}: {expected} expected, {found} found"),
            expected: Some(expected),
            found: Some(found),
            place: Some(place),
        }
    }

    /// There is no such thing.
    pub fn not_found(place: &str, expected: &str, found: impl Into<String>) -> Problem {
        Problem::expected_found(StatusCode::NOT_FOUND, place, expected, found)
    }

    /// The emulator is ending.
    pub fn shutting_down() -> Problem {
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, "the emulator is ending")
    }
}

impl From<ActionError> for Problem {
    fn from(refusal: ActionError) -> Problem {
        let status = match refusal.kind {
            ActionErrorKind::Missing => StatusCode::NOT_FOUND,
            ActionErrorKind::Conflict => StatusCode::CONFLICT,
            ActionErrorKind::NotPersisted => StatusCode::INSUFFICIENT_STORAGE,
        };
        Problem {
            status,
            error: printable(&refusal),
            expected: Some(printable(refusal.expected)),
            found: Some(printable(refusal.found)),
            place: Some(printable(refusal.place)),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        (self.status, Json(self)).into_response()
    }
}
