//! The JSON body of every error response: the sentence, and what was expected, what was found, and where.
//!
//! Refusals of the controller are converted here. Responses with an effect are made by the resources.

use crate::printable::printable;
use axum::Json;
use axum::http::StatusCode;
use axum::http::header::WWW_AUTHENTICATE;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use std::fmt::Display;
use ts3100_controller::action::{ActionError, ActionErrorKind};

/// The reason for which a call had no effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct Problem {
    #[serde(skip)]
    status: StatusCode,
    /// Message in one sentence.
    error: String,
    /// Accepted values.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected: Option<String>,
    /// Value that was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    found: Option<String>,
    /// Place of the error: the header, the field of the body, the line, the variable.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    place: Option<String>,
}

impl Problem {
    /// A problem in one sentence.
    pub fn new(status: StatusCode, error: impl Display) -> Problem {
        Problem {
            status,
            error: printable(error),
            expected: None,
            found: None,
            place: None,
        }
    }

    /// Sets the part of the request that the problem is about.
    #[must_use]
    pub fn at(self, place: impl Display) -> Problem {
        let place = Some(printable(place));
        Problem { place, ..self }
    }

    /// Creates the problem of a value that does not belong at this place; the sentence is made of the parts.
    pub fn expected_found(
        status: StatusCode,
        place: impl Display,
        expected: impl Display,
        found: impl Display,
    ) -> Problem {
        let (place, expected, found) = (printable(place), printable(expected), printable(found));
        Problem {
            status,
            error: format!("{place}: expected {expected}, found {found}"),
            expected: Some(expected),
            found: Some(found),
            place: Some(place),
        }
    }

    /// A value of the body that the OpenAPI document does not allow.
    pub fn invalid(place: &str, expected: impl Display, found: impl Display) -> Problem {
        Problem::expected_found(StatusCode::UNPROCESSABLE_ENTITY, place, expected, found)
    }

    /// A part of the request that cannot be read.
    pub fn unreadable(place: &str, expected: &str, found: impl Display) -> Problem {
        Problem::expected_found(StatusCode::BAD_REQUEST, place, expected, found)
    }

    /// Sets the sentence, where that of the parts does not fit.
    #[must_use]
    pub fn told(self, error: impl Display) -> Problem {
        let error = printable(error);
        Problem { error, ..self }
    }

    /// There is no such thing.
    pub fn not_found(place: &str, expected: impl Display, found: impl Display) -> Problem {
        let problem = Problem::expected_found(StatusCode::NOT_FOUND, place, expected, found);
        let (expected, found) = (problem.expected.as_deref(), problem.found.as_deref());
        let error = format!(
            "unknown {place} `{}`: expected {}",
            found.unwrap_or_default(),
            expected.unwrap_or_default()
        );
        problem.told(error)
    }

    /// The call would change a moment of a recorded run.
    pub fn recorded() -> Problem {
        let told = "this is a recorded run: it can be read, and nothing of it can be changed";
        Problem::new(StatusCode::CONFLICT, told)
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
        Problem::new(status, &refusal).at(&refusal.place)
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = self.status;
        let challenge = (status == StatusCode::UNAUTHORIZED).then_some([(WWW_AUTHENTICATE, "Bearer")]);
        (status, challenge, Json(self)).into_response()
    }
}
