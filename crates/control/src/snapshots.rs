//! `/snapshots`: named states of the whole controller; `/snapshot`: the present state in the file format of a
//! snapshot.
//!
//! Snapshots are taken and restored by the driver; the format is [`ts3100_driver::snapshot`].

use super::body::SnapshotText;
use super::resource::{Answer, Json, NoBody, Path, Problem, Serialize, View, call};
use super::robots::{Scope, Together};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use std::iter::repeat_with;
use ts3100_controller::{Controller, Time};
use ts3100_driver::driver::request::Request;
use ts3100_driver::snapshot::{self, NamedError, ParseError, SnapshotRequestError, SnapshotTask, States};
use ts3100_proto::words::plain_message;

/// The named snapshots.
#[derive(Debug, Clone, Default, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Snapshots))]
pub struct SnapshotList {
    /// In alphabetical order.
    snapshots: Vec<SnapshotInfo>,
}

/// A named snapshot.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Snapshot))]
pub struct SnapshotInfo {
    /// Name of the snapshot.
    name: String,
    /// The virtual time at which it was taken, in seconds.
    t: f64,
}

impl SnapshotList {
    fn new(view: &View<'_>) -> SnapshotList {
        let named = |(name, micros)| SnapshotInfo {
            name,
            t: Time::from_micros(micros).as_seconds(),
        };
        SnapshotList {
            snapshots: view.snapshots.list().into_iter().map(named).collect(),
        }
    }
}

call! {
    /// List the named snapshots
    ///
    /// Of several robots: those that every robot has.
    get_snapshots = get("/snapshots", responses((status = 200, body = SnapshotList)))
}
pub async fn get_snapshots(scope: Scope) -> Answer<SnapshotList> {
    let mut common: Option<SnapshotList> = None;
    for (_, handle) in scope.started()? {
        let of_robot = handle.query(SnapshotList::new).await?;
        let common = common.get_or_insert_with(|| of_robot.clone());
        let is_shared = |one: &SnapshotInfo| of_robot.snapshots.iter().any(|other| other.name == one.name);
        common.snapshots.retain(is_shared);
    }
    Ok(Json(common.unwrap_or_default()))
}

/// Does something about a snapshot of each robot, or of none if one refuses it. The answer is that of the last, or why one
/// does not have all of it.
async fn change(scope: Scope, mut tasks: impl Iterator<Item = SnapshotTask>) -> Answer<SnapshotList> {
    let robots = match &scope {
        Scope::One(handle) => {
            let task = tasks.next().ok_or_else(Problem::shutting_down)?;
            let changed = handle.change(Request::Snapshot, task, SnapshotList::new);
            return changed.await.map(Json);
        }
        Scope::All(_) => scope.started()?,
    };
    let mut together = Together::gather(robots).await?;
    let mut checked = Vec::new();
    for ((_, view), task) in together.views().zip(tasks) {
        view.snapshots.check(&task).map_err(SnapshotRequestError::from)?;
        checked.push(task);
    }
    // A task: a caller that goes away in the middle does not leave some robots behind.
    let changed = tokio::spawn(async move {
        together.act_on_snapshots(checked).await?;
        let last = together.views().last();
        Ok(last.map(|(_, view)| SnapshotList::new(&view)).unwrap_or_default())
    });
    let changed: Result<_, SnapshotRequestError> = changed.await.map_err(|_| Problem::shutting_down())?;
    Ok(Json(changed?))
}

call! {
    /// Save the current state under a name
    ///
    /// Replaces a snapshot with the same name. Of several robots: the state of each.
    put_snapshot = put("/snapshots/{name}",
        params(("name" = String, Path, description = "Name of the snapshot")),
        responses((status = 200, body = SnapshotList)))
}
pub async fn put_snapshot(scope: Scope, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    change(scope, repeat_with(|| SnapshotTask::Save(name.clone()))).await
}

call! {
    /// Restore a named snapshot
    ///
    /// Hosts stay connected; the controller treats them as newly connected. Virtual time becomes that of the snapshot.
    /// Pending waits end unreached. Of several robots: the state of each.
    restore_snapshot = post("/snapshots/{name}/restore",
        params(("name" = String, Path, description = "Name of the snapshot")),
        responses((status = 200, body = SnapshotList)))
}
pub async fn restore_snapshot(scope: Scope, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    change(scope, repeat_with(|| SnapshotTask::Restore(name.clone()))).await
}

call! {
    /// Delete a named snapshot
    delete_snapshot = delete("/snapshots/{name}",
        params(("name" = String, Path, description = "Name of the snapshot")),
        responses((status = 200, body = SnapshotList)))
}
pub async fn delete_snapshot(scope: Scope, Path(name): Path<String>, _: NoBody) -> Answer<SnapshotList> {
    change(scope, repeat_with(|| SnapshotTask::Remove(name.clone()))).await
}

/// States as a file has them: that of one robot, or of each by its name.
fn snapshot_file(scope: &Scope, states: &[(String, Controller)]) -> impl IntoResponse + use<> {
    let file = match (scope, states) {
        (Scope::One(_), [(_, controller)]) => States::One(controller),
        _ => States::Named(states),
    };
    (
        [(CONTENT_TYPE, "application/json")],
        snapshot::to_pretty_json(file),
    )
}

call! {
    /// Get a named snapshot as a file
    ///
    /// `serve --restore` accepts it.
    get_named = get("/snapshots/{name}",
        operation_id = "get_named_snapshot",
        params(("name" = String, Path, description = "Name of the snapshot")),
        responses((status = 200, description = "The content of a snapshot file.", body = serde_json::Value)))
}
pub async fn get_named(scope: Scope, Path(name): Path<String>) -> Result<impl IntoResponse, Problem> {
    let mut states = Vec::new();
    for (robot, handle) in scope.started()? {
        let wanted = name.clone();
        let named = handle
            .query(move |view| view.snapshots.get(&wanted).cloned())
            .await?;
        states.push((robot, named.map_err(SnapshotRequestError::from)?));
    }
    Ok(snapshot_file(&scope, &states))
}

call! {
    /// Get the current state as a snapshot file
    ///
    /// `serve --restore` accepts it. Of several robots: one file with the state of each.
    get_snapshot = get("/snapshot",
        responses((status = 200, description = "The content of a snapshot file.", body = serde_json::Value)))
}
pub async fn get_snapshot(scope: Scope) -> Result<impl IntoResponse, Problem> {
    // Also of one robot: while its loop pauses, nothing is being stored.
    let together = Together::gather(scope.started()?).await?;
    let views = together.views();
    let states: Vec<(String, Controller)> = views
        .map(|(name, view)| (name.to_owned(), view.controller.clone()))
        .collect();
    Ok(snapshot_file(&scope, &states))
}

call! {
    /// Restore a snapshot file
    ///
    /// The body is the content of the file, at most 16 MiB. It is validated in full; a state that cannot occur is rejected.
    load_snapshot = put("/snapshot", request_body = serde_json::Value, responses((status = 200, body = SnapshotList)))
}
pub async fn load_snapshot(scope: Scope, SnapshotText(text): SnapshotText) -> Answer<SnapshotList> {
    let states = match &scope {
        Scope::One(_) => snapshot::from_json(&text).map(|state| vec![state]),
        Scope::All(robots) => snapshot::named_from_json(&text, &robots.names()),
    };
    let states = states.map_err(SnapshotRequestError::Parse)?.into_iter();
    let tasks = states.map(|state| SnapshotTask::Replace(Box::new(state)));
    change(scope, tasks).await
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
                let found = plain_message(&error.to_string());
                let sentence = format!("request body: this is not a snapshot: {found}");
                Problem::expected_found(status, "body", "the file of a snapshot", found).told(sentence)
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
