//! `/snapshots`: named states of the whole controller; `/snapshot`: the present state in the file format of a
//! snapshot.
//!
//! Snapshots are taken and restored by the driver; the format is [`ts3100_driver::snapshot`].

use super::body::{Json, NoBody, Path, SnapshotText};
use super::event::seconds;
use super::handle::{Answer, Handle};
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use serde::Serialize;
use ts3100_controller::{Controller, Time};
use ts3100_driver::driver::request::{Request, View};
use ts3100_driver::snapshot::{self, NamedError, ParseError, SnapshotRequestError, SnapshotTask};
use utoipa::ToSchema;
use utoipa_axum::routes;

/// The snapshots under names.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Snapshots)]
pub struct SnapshotList {
    /// In alphabetical order.
    snapshots: Vec<SnapshotInfo>,
}

/// A snapshot under a name.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Named)]
pub struct SnapshotInfo {
    /// Its name.
    name: String,
    /// The virtual time at which it was taken, in seconds.
    t: f64,
}

impl SnapshotList {
    fn new(view: &View<'_>) -> SnapshotList {
        let named = |(name, micros)| SnapshotInfo {
            name,
            t: seconds(Time::from_micros(micros)),
        };
        SnapshotList {
            snapshots: view.snapshots.list().into_iter().map(named).collect(),
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "snapshots",
            "The whole controller at a moment, kept and put back.",
        )
        .routes(routes!(get_snapshots))
        .routes(routes!(get_named, put_snapshot, delete_snapshot))
        .routes(routes!(restore_snapshot))
        .routes(routes!(get_snapshot, load_snapshot))
}

/// The snapshots there are
#[utoipa::path(get, path = "/snapshots", responses((status = 200, body = SnapshotList)))]
async fn get_snapshots(handle: Handle) -> Answer<SnapshotList> {
    handle.query(SnapshotList::new).await.map(Json)
}

/// Keep the present state under a name, in place of one of the same name
#[utoipa::path(put, path = "/snapshots/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = SnapshotList)))]
async fn put_snapshot(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    let task = SnapshotTask::Save(name);
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

/// Go on from the state of that name
///
/// Hosts that are connected stay so and are new to the controller; virtual time is that of the snapshot. Waits that are
/// under way end unreached.
#[utoipa::path(post, path = "/snapshots/{name}/restore", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = SnapshotList)))]
async fn restore_snapshot(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    let task = SnapshotTask::Restore(name);
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

/// Forget the state of that name
#[utoipa::path(delete, path = "/snapshots/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = SnapshotList)))]
async fn delete_snapshot(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    let task = SnapshotTask::Remove(name);
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

/// A state as the file of a snapshot has it.
fn snapshot_file(controller: &Controller) -> impl IntoResponse + use<> {
    (
        [(CONTENT_TYPE, "application/json")],
        snapshot::to_pretty_json(controller),
    )
}

/// The state of that name as the file of a snapshot has it, which `serve --restore` takes
#[utoipa::path(get, path = "/snapshots/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = serde_json::Value)))]
async fn get_named(handle: Handle, Path(name): Path<String>) -> Result<impl IntoResponse, Problem> {
    let named = handle.query(move |view| view.snapshots.get(&name)).await?;
    Ok(snapshot_file(&named.map_err(SnapshotRequestError::from)?))
}

/// The present state as the file of a snapshot has it, which `serve --restore` takes
#[utoipa::path(get, path = "/snapshot", responses((status = 200, body = serde_json::Value)))]
async fn get_snapshot(handle: Handle) -> Result<impl IntoResponse, Problem> {
    Ok(snapshot_file(
        &handle.query(|view| view.controller.clone()).await?,
    ))
}

/// Go on from the state of this file of a snapshot, at most 16 MiB
///
/// As of `/snapshots/{name}/restore`. What no run leads to is refused.
#[utoipa::path(put, path = "/snapshot", request_body = serde_json::Value, responses((status = 200, body = SnapshotList)))]
async fn load_snapshot(handle: Handle, SnapshotText(text): SnapshotText) -> Answer<SnapshotList> {
    let controller = snapshot::from_json(&text).map_err(SnapshotRequestError::Parse)?;
    let task = SnapshotTask::Replace(Box::new(controller));
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

impl From<SnapshotRequestError> for Problem {
    fn from(error: SnapshotRequestError) -> Problem {
        match error {
            SnapshotRequestError::Named(NamedError::Unknown { expected, found }) => {
                Problem::not_found("name", &expected, found)
            }
            SnapshotRequestError::Named(NamedError::Name(found)) => {
                Problem::not_found("name", "1 to 64 letters, digits, `-`, `_` or `.`", found)
            }
            SnapshotRequestError::Busy => Problem::shutting_down(),
            SnapshotRequestError::Parse(ParseError::Json(error)) => {
                let status = if error.is_data() {
                    StatusCode::CONFLICT
                } else {
                    StatusCode::BAD_REQUEST
                };
                Problem::expected_found(status, "body", "the file of a snapshot", error.to_string())
            }
            unkept @ SnapshotRequestError::Drive(_) => {
                Problem::new(StatusCode::INSUFFICIENT_STORAGE, unkept.to_string())
            }
            refused @ (SnapshotRequestError::Named(_)
            | SnapshotRequestError::Parse(_)
            | SnapshotRequestError::File(_)
            | SnapshotRequestError::Channels(_)) => Problem::new(StatusCode::CONFLICT, refused.to_string()),
        }
    }
}
