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

/// The named snapshots.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Snapshots)]
pub struct SnapshotList {
    /// In alphabetical order.
    snapshots: Vec<SnapshotInfo>,
}

/// A named snapshot.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = Snapshot)]
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
            "Save the whole state of the controller, and restore it.",
        )
        .routes(routes!(get_snapshots))
        .routes(routes!(get_named, put_snapshot, delete_snapshot))
        .routes(routes!(restore_snapshot))
        .routes(routes!(get_snapshot, load_snapshot))
}

/// List the named snapshots
#[utoipa::path(get, path = "/snapshots", responses((status = 200, body = SnapshotList)))]
async fn get_snapshots(handle: Handle) -> Answer<SnapshotList> {
    handle.query(SnapshotList::new).await.map(Json)
}

/// Save the current state under a name
///
/// Replaces a snapshot with the same name.
#[utoipa::path(put, path = "/snapshots/{name}", params(("name" = String, Path, description = "Name of the snapshot")),
    responses((status = 200, body = SnapshotList)))]
async fn put_snapshot(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    let task = SnapshotTask::Save(name);
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

/// Restore a named snapshot
///
/// Hosts stay connected; the controller treats them as newly connected. Virtual time becomes that of the snapshot.
/// Pending waits end unreached.
#[utoipa::path(post, path = "/snapshots/{name}/restore", params(("name" = String, Path, description = "Name of the snapshot")),
    responses((status = 200, body = SnapshotList)))]
async fn restore_snapshot(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    let task = SnapshotTask::Restore(name);
    let change = handle.change(Request::Snapshot, task, SnapshotList::new);
    change.await.map(Json)
}

/// Delete a named snapshot
#[utoipa::path(delete, path = "/snapshots/{name}", params(("name" = String, Path, description = "Name of the snapshot")),
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

/// Get a named snapshot as a file
///
/// `serve --restore` accepts it.
#[utoipa::path(get, path = "/snapshots/{name}", operation_id = "get_named_snapshot", params(("name" = String, Path, description = "Name of the snapshot")),
    responses((status = 200, description = "The content of a snapshot file.", body = serde_json::Value)))]
async fn get_named(handle: Handle, Path(name): Path<String>) -> Result<impl IntoResponse, Problem> {
    let named = handle.query(move |view| view.snapshots.get(&name)).await?;
    Ok(snapshot_file(&named.map_err(SnapshotRequestError::from)?))
}

/// Get the current state as a snapshot file
///
/// `serve --restore` accepts it.
#[utoipa::path(get, path = "/snapshot", responses((status = 200, description = "The content of a snapshot file.", body = serde_json::Value)))]
async fn get_snapshot(handle: Handle) -> Result<impl IntoResponse, Problem> {
    Ok(snapshot_file(
        &handle.query(|view| view.controller.clone()).await?,
    ))
}

/// Restore a snapshot file
///
/// The body is the content of the file, at most 16 MiB. It is validated in full; a state that cannot occur is rejected.
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
