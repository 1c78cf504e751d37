//! `/files`: the RAM drive: list, get, put, delete, select.

use super::body::{Body, InPath, NoBody};
use super::channels::Bytes;
use super::event::hex;
use super::handle::Handle;
use super::panel::Program;
use super::problem::Problem;
use super::table::Table;
use crate::driver::request::View;
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use ts3100_controller::action::Action;
use utoipa::ToSchema;

/// The RAM drive.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct DriveDoc {
    /// Its files in alphabetical order.
    files: Vec<FileEntry>,
    /// The selected file; empty when none is.
    selected: String,
    /// How many bytes the user files may have together.
    capacity: usize,
}

/// A file of the RAM drive.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FileEntry {
    /// Its name.
    name: String,
    /// Its size in bytes.
    size: u32,
}

/// A file and its content: as text, or in hexadecimal digits when it is no UTF-8.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FileDoc {
    /// Its name.
    name: String,
    /// Its size in bytes.
    size: usize,
    /// Its content.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    /// Its content.
    #[serde(skip_serializing_if = "Option::is_none")]
    hex: Option<String>,
}

impl DriveDoc {
    /// As it is now.
    pub fn of(sight: &View<'_>) -> DriveDoc {
        let entries = sight.controller.drive().directory().into_iter();
        DriveDoc {
            files: entries
                .map(|entry| FileEntry {
                    name: entry.name,
                    size: entry.size,
                })
                .collect(),
            selected: sight.controller.selected().to_owned(),
            capacity: sight.controller.config().options.drive_capacity,
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group("files", "The RAM drive.")
        .call::<__path_get_files, _, _>(get_files)
        .call::<__path_get_file, _, _>(get_file)
        .call::<__path_put_file, _, _>(put_file)
        .call::<__path_delete_file, _, _>(delete_file)
        .call::<__path_select_file, _, _>(select_file)
}

async fn file(hub: &Handle, name: String) -> Result<Json<FileDoc>, Problem> {
    let wanted = name.to_ascii_uppercase();
    let look = move |sight: &View<'_>| {
        let content = sight.controller.drive().get(&wanted)?.to_vec();
        let size = content.len();
        let (text, hex) = match String::from_utf8(content) {
            Ok(text) => (Some(text), None),
            Err(error) => (None, Some(hex(error.as_bytes()))),
        };
        Some(FileDoc {
            name: wanted,
            size,
            text,
            hex,
        })
    };
    let found = hub.look(look).await?;
    found
        .map(Json)
        .ok_or_else(|| Problem::missing("name", "a file of the RAM drive", name))
}

/// The files of the RAM drive
#[utoipa::path(get, path = "/files", responses((status = 200, body = DriveDoc)))]
async fn get_files(State(hub): State<Handle>) -> Result<Json<DriveDoc>, Problem> {
    Ok(Json(hub.look(DriveDoc::of).await?))
}

/// One file
#[utoipa::path(get, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = FileDoc)))]
async fn get_file(State(hub): State<Handle>, InPath(name): InPath<String>) -> Result<Json<FileDoc>, Problem> {
    file(&hub, name).await
}

/// Put a file on the RAM drive
///
/// Whole or not at all, as a download does; a program that is selected is taken anew at its next start. Lines end as the
/// content has it.
#[utoipa::path(put, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    request_body = Bytes, responses((status = 200, body = FileDoc)))]
async fn put_file(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
    Body(body): Body<Bytes>,
) -> Result<Json<FileDoc>, Problem> {
    let action = Action::PutFile {
        name: name.clone(),
        content: body.read()?,
    };
    hub.action(action).await?;
    file(&hub, name).await
}

/// Erase a file
#[utoipa::path(delete, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = DriveDoc)))]
async fn delete_file(
    state: State<Handle>,
    InPath(name): InPath<String>,
    _: NoBody,
) -> Result<Json<DriveDoc>, Problem> {
    state.action(Action::EraseFile { name }).await?;
    get_files(state).await
}

/// Select a file as the command SL does
#[utoipa::path(post, path = "/files/{name}/select", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = Program)))]
async fn select_file(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
    _: NoBody,
) -> Result<Json<Program>, Problem> {
    hub.action(Action::Select { name }).await?;
    Ok(Json(hub.look(Program::of).await?))
}
