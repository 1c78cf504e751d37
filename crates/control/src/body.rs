//! Extractors for the path, the query and the JSON body of a call. Each reports errors as a [`Problem`] that names
//! the place. Bodies are limited in size and in time.
//!
//! The resource that receives a value checks what it means.

use super::listener::ConnectionInfo;
use super::problem::Problem;
use axum::RequestPartsExt as _;
use axum::body::{Bytes, to_bytes};
use axum::extract::{self, ConnectInfo, FromRequest, FromRequestParts, Request};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt::Display;
use std::time::Duration;
use tokio::time::timeout;
use ts3100_proto::words::{backquoted, one_of, plain_message};

/// Largest body in bytes. It fits the largest file of the RAM drive in hexadecimal digits.
pub const MAX_BODY: usize = 256 * 1024;
/// Largest snapshot in bytes. It fits a full RAM drive whose control codes are all escaped.
pub const MAX_SNAPSHOT: usize = 16 * 1024 * 1024;
/// Longest time in which a body must arrive.
const BODY_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest time in which a snapshot must arrive, which may be large.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_secs(10);
/// Longest duration in a call, in seconds; more than three years.
pub const MAX_SECONDS: f64 = 1e8;

/// A JSON object in the body of a request, or a document in that of a response.
pub struct Json<T>(pub T);

/// Extracts the text of a snapshot from the body.
pub struct SnapshotText(pub String);

/// Requires that the body is empty or `{}`.
pub struct NoBody;

/// Extracts the parameters of the path.
pub struct Path<T>(pub T);

/// Extracts the query of the URL.
pub struct Query<T>(pub T);

async fn read(request: Request, most: usize, limit: Duration) -> Result<Bytes, Problem> {
    let connection = request.extensions().get::<ConnectInfo<ConnectionInfo>>();
    let _owed = connection.map(|ConnectInfo(connection)| connection.begin_body());
    let read = timeout(limit, to_bytes(request.into_body(), most)).await;
    let read = read.map_err(|_| {
        let limit = limit.as_secs();
        let reason = format!("cannot read the request body: it did not arrive within {limit} s");
        Problem::new(StatusCode::REQUEST_TIMEOUT, reason).at("body")
    })?;
    read.map_err(|_| {
        let reason = format!("cannot read the request body: it is larger than {most} bytes, or was cut off");
        Problem::new(StatusCode::PAYLOAD_TOO_LARGE, reason).at("body")
    })
}

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Json<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Json<T>, Problem> {
        let bytes = read(request, MAX_BODY, BODY_TIMEOUT).await?;
        // Where every field may be left out, so may the object.
        if matches!(bytes.trim_ascii(), b"" | b"null")
            && let Ok(defaults) = serde_json::from_slice(b"{}")
        {
            return Ok(Json(defaults));
        }
        require_object(&bytes)?;
        serde_json::from_slice(&bytes)
            .map(Json)
            .map_err(|error| unreadable_body(&bytes, &error, rejection::<T>))
    }
}

/// serde would read a struct from an array, too; the OpenAPI document allows only objects.
fn require_object(body: &[u8]) -> Result<(), Problem> {
    if matches!(
        body.trim_ascii_start().first(),
        Some(b'[' | b'"' | b'0'..=b'9' | b'-' | b't' | b'f' | b'n')
    ) {
        let reason = "request body: expected a JSON object, found another value";
        return Err(Problem::new(StatusCode::UNPROCESSABLE_ENTITY, reason).at("body"));
    }
    Ok(())
}

/// Returns the reason why a body does not fit `T`.
fn rejection<T: DeserializeOwned>(body: &[u8]) -> Option<serde_json::Error> {
    serde_json::from_slice::<T>(body).err()
}

/// Tells why a body is not of its type. `rejection` gives the reason for another body.
fn unreadable_body(
    body: &[u8],
    error: &serde_json::Error,
    rejection: fn(&[u8]) -> Option<serde_json::Error>,
) -> Problem {
    let status = if error.is_data() {
        StatusCode::UNPROCESSABLE_ENTITY
    } else {
        StatusCode::BAD_REQUEST
    };
    // Of an object with one field of several, serde does not say which.
    let named = (body.trim_ascii() == b"{}")
        .then(|| rejection(br#"{"":null}"#))
        .flatten()
        .map(|error| error.to_string())
        .filter(|error| error.starts_with("unknown variant"));
    let reason = match named {
        Some(error) => {
            let fields: Vec<String> = backquoted(&error).map(|field| format!("`{field}`")).collect();
            format!("the object is empty; expected {}", one_of(&fields))
        }
        None => plain_message(&error.to_string()),
    };
    Problem::new(status, format!("request body: {reason}")).at("body")
}

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        json_response(serde_json::to_vec(&self.0))
    }
}

fn json_response(document: serde_json::Result<Vec<u8>>) -> Response {
    match document {
        Ok(document) => ([(CONTENT_TYPE, "application/json")], document).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

impl<S: Send + Sync> FromRequest<S> for SnapshotText {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<SnapshotText, Problem> {
        let bytes = read(request, MAX_SNAPSHOT, SNAPSHOT_TIMEOUT).await?;
        let text = String::from_utf8(bytes.into());
        text.map(SnapshotText).map_err(|error| {
            let place = error.utf8_error().valid_up_to() + 1;
            let reason = format!("cannot read the request body: byte {place} is not UTF-8");
            Problem::new(StatusCode::BAD_REQUEST, reason).at("body")
        })
    }
}

impl<S: Send + Sync> FromRequest<S> for NoBody {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<NoBody, Problem> {
        let bytes = read(request, MAX_BODY, BODY_TIMEOUT).await?;
        let text = bytes.trim_ascii();
        let is_empty = |object: serde_json::Map<_, _>| object.is_empty();
        if text.is_empty() || serde_json::from_slice(text).is_ok_and(is_empty) {
            return Ok(NoBody);
        }
        let reason = format!("this call takes no request body; found {} bytes", bytes.len());
        Err(Problem::new(StatusCode::BAD_REQUEST, reason).at("body"))
    }
}

impl<S: Send + Sync, T: DeserializeOwned + Send + 'static> FromRequestParts<S> for Path<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Path<T>, Problem> {
        let found = parts.uri.path().to_owned();
        let path = parts.extract::<extract::Path<T>>().await;
        path.map(|extract::Path(value)| Path(value)).map_err(|error| {
            let text = error.body_text();
            let reason = plain_message(text.trim_start_matches("Invalid URL: "));
            let sentence = format!("path {found}: {reason}");
            let found = format!("{found}: {reason}");
            Problem::unreadable("path", "a path of the OpenAPI document", found).told(sentence)
        })
    }
}

impl<S: Send + Sync, T: DeserializeOwned + Send + 'static> FromRequestParts<S> for Query<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Query<T>, Problem> {
        let query = parts.extract::<extract::Query<T>>().await;
        query.map(|extract::Query(value)| Query(value)).map_err(|error| {
            let text = error.body_text();
            let reason = plain_message(text.trim_start_matches("Failed to deserialize query string: "));
            let sentence = format!("query: {reason}");
            Problem::unreadable("query", "a query of the OpenAPI document", reason).told(sentence)
        })
    }
}

/// A duration of virtual time in seconds: 0 to [`MAX_SECONDS`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct Seconds(#[serde(deserialize_with = "seconds")] pub Duration);

fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    seconds_up_to(deserializer, MAX_SECONDS)
}

/// Deserializes a duration of 0 to `most` seconds. It is compared as it was sent: a duration is rounded to the nanosecond.
///
/// # Errors
/// No number, or one out of range.
pub fn seconds_up_to<'de, D: Deserializer<'de>>(deserializer: D, most: f64) -> Result<Duration, D::Error> {
    let fits = |seconds| {
        Duration::try_from_secs_f64(seconds)
            .ok()
            .filter(|_| seconds <= most)
    };
    number_that(deserializer, format_args!("0 to {most} seconds"), fits)
}

/// Deserializes a number and converts it.
///
/// # Errors
/// No number, or one that cannot be converted: what is expected instead.
pub fn number_that<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    expected: impl Display,
    convert: impl FnOnce(f64) -> Option<T>,
) -> Result<T, D::Error> {
    let number = f64::deserialize(deserializer)?;
    convert(number).ok_or_else(|| D::Error::custom(format!("expected {expected}, found {number}")))
}

/// Converts a JSON number to a whole one. JSON does not distinguish 80 and 80.0.
pub fn whole_number(number: f64) -> Option<u32> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "it is whole and in range"
    )]
    let cast = |number: f64| number as u32;
    let fits = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
    fits.then(|| cast(number))
}

/// Deserializes a whole number.
///
/// # Errors
/// A number that is not whole or out of range.
pub fn whole<'de, D: Deserializer<'de>, T: TryFrom<u32>>(deserializer: D) -> Result<T, D::Error> {
    let fits = |number| T::try_from(whole_number(number)?).ok();
    number_that(deserializer, "a whole number", fits)
}

/// As [`whole`], where there may be none.
///
/// # Errors
/// As [`whole`].
pub fn optional_whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    #[derive(Deserialize)]
    struct Whole(#[serde(deserialize_with = "whole")] u32);
    let number = Option::<Whole>::deserialize(deserializer)?;
    Ok(number.map(|Whole(number)| number))
}

/// Deserializes an object only; serde would read a struct from an array, too.
///
/// # Errors
/// Not an object, or not the fields of `T`.
pub fn object_only<'de, D: Deserializer<'de>, T: DeserializeOwned>(deserializer: D) -> Result<T, D::Error> {
    let fields = serde_json::Map::<String, serde_json::Value>::deserialize(deserializer)?;
    T::deserialize(serde_json::Value::Object(fields)).map_err(D::Error::custom)
}

/// Parses hexadecimal digits, two for each byte; blanks are ignored.
///
/// # Errors
/// Another character, or an odd number of digits.
pub fn parse_hex(text: &str) -> Result<Vec<u8>, Problem> {
    let wrong = |found: String| Problem::invalid("hex", "an even number of hexadecimal digits", found);
    let mut digits = Vec::with_capacity(text.len());
    for (at, letter) in text.char_indices().filter(|(_, letter)| *letter != ' ') {
        let digit = letter.to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        digits.push(digit.ok_or_else(|| wrong(format!("{letter:?} at {at}")))?);
    }
    let (pairs, rest) = digits.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(wrong(format!("{} digits", digits.len())));
    }
    Ok(pairs.iter().map(|[high, low]| high << 4 | low).collect())
}
