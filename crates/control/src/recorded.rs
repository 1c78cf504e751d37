//! The interface of a recorded run: the calls that read, each at a moment of the run. `/moments/KEY/...` is the whole
//! interface at one moment; without that prefix a call is for the end of the run. Nothing can be changed.
//!
//! This module does not know how a moment is had; see [`Moments`].

use super::alarms::ActiveAlarm;
use super::arm::ArmPicture;
use super::body::Json;
use super::handle::Handle;
use super::problem::Problem;
use super::robots::{OfRobot, is_page, split_path};
use super::state::ControllerState;
use axum::extract::{Request, State};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;
use tokio::task::spawn_blocking;
use ts3100_controller::alarm::AlarmCode;
use ts3100_driver::driver::request::Still;

/// Beginning of all paths of one moment.
const PREFIX: &str = "/moments/";
/// Calls that compute an answer from their body.
const PURE: [&str; 2] = ["/check", "/decode"];

/// There is no such moment.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NoMoment(pub String);

/// A recorded run.
pub trait Moments: Send + Sync {
    /// A moment, or the end of the run. This may take as long as playing from the nearest copy does.
    ///
    /// # Errors
    /// See [`NoMoment`].
    fn find(&self, key: Option<&str>) -> Result<Handle, NoMoment>;
}

/// A value as a document that can be changed. It is written as everywhere and read again: a second way of writing every type
/// would be much code.
pub fn document(value: &impl Serialize) -> Value {
    // A document of words and numbers can always be written.
    let text = serde_json::to_vec(value).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}

/// The response with a document.
pub fn json_response(value: impl Serialize) -> Response {
    Json(value).into_response()
}

/// The document of `/state` for a moment, with the findings by rule until then.
pub fn state_document(still: &Still, findings: BTreeMap<String, u64>) -> Value {
    still.look(|view| document(&ControllerState::new(view, findings, false)))
}

/// An active alarm as in the document of `/state`, of which only the number is known.
pub fn alarm_document(number: &str) -> Option<Value> {
    let row = AlarmCode::from_number(number)?;
    Some(document(&ActiveAlarm::of_code(&row)))
}

/// The document of `/arm` for a moment.
pub fn arm_document(still: &Still) -> Value {
    still.look(|view| document(&ArmPicture::new(view)))
}

/// A call of a recorded run: its page shows it so.
#[derive(Clone, Copy)]
pub struct OfRecording;

/// Finds the moment of a call, before the call is looked up in the table.
pub async fn find(State(moments): State<Arc<dyn Moments>>, mut request: Request, next: Next) -> Response {
    let extensions = request.extensions_mut();
    extensions.insert(OfRobot);
    extensions.insert(OfRecording);
    let key = match split_path(PREFIX, request.uri()) {
        Some((key, rest)) => {
            *request.uri_mut() = rest;
            Some(key)
        }
        None => None,
    };
    let path = request.uri().path();
    if is_page(path) {
        return next.run(request).await;
    }
    let is_reading = matches!(*request.method(), Method::GET | Method::HEAD);
    if !is_reading && !PURE.contains(&path) {
        return Problem::recorded().into_response();
    }
    let found = spawn_blocking(move || moments.find(key.as_deref())).await;
    match found {
        Ok(Ok(handle)) => drop(request.extensions_mut().insert(handle)),
        Ok(Err(told)) => return Problem::new(StatusCode::NOT_FOUND, told).into_response(),
        Err(_) => return Problem::shutting_down().into_response(),
    }
    next.run(request).await
}
