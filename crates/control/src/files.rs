//! `/files`: the RAM drive: list, read, write, erase and select files.
//!
//! A file is written as by a download, all or nothing; the rules are in the controller's `drive` module.

use super::body::{JsonBody, NoBody, PathParam};
use super::channels::ByteContent;
use super::event::hex;
use super::handle::DriverHandle;
use super::panel::ProgramStatus;
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::Json;
use axum::extract::State;
use serde::Serialize;
use ts3100_controller::action::Action;
use ts3100_driver::driver::request::View;
use utoipa::ToSchema;
use utoipa_axum::routes;

/// The RAM drive.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = DriveDoc)]
pub struct DriveStatus {
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
#[schema(as = FileDoc)]
pub struct FileContent {
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

impl DriveStatus {
    /// As it is now.
    pub fn new(view: &View<'_>) -> DriveStatus {
        let entries = view.controller.drive().directory().into_iter();
        DriveStatus {
            files: entries
                .map(|entry| FileEntry {
                    name: entry.name,
                    size: entry.size,
                })
                .collect(),
            selected: view.controller.selected().to_owned(),
            capacity: view.controller.config().options.drive_capacity,
        }
    }
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group("files", "The RAM drive.")
        .routes(routes!(get_files))
        .routes(routes!(get_file))
        .routes(routes!(put_file))
        .routes(routes!(delete_file))
        .routes(routes!(select_file))
}

async fn file_content(handle: &DriverHandle, name: String) -> Result<Json<FileContent>, Problem> {
    let drive_name = name.to_ascii_uppercase();
    let look = move |view: &View<'_>| {
        let content = view.controller.drive().get(&drive_name)?.to_vec();
        let size = content.len();
        let (text, hex) = match String::from_utf8(content) {
            Ok(text) => (Some(text), None),
            Err(error) => (None, Some(hex(error.as_bytes()))),
        };
        Some(FileContent {
            name: drive_name,
            size,
            text,
            hex,
        })
    };
    let found = handle.query(look).await?;
    found
        .map(Json)
        .ok_or_else(|| Problem::not_found("name", "a file of the RAM drive", name))
}

/// The files of the RAM drive
#[utoipa::path(get, path = "/files", responses((status = 200, body = DriveStatus)))]
async fn get_files(State(handle): State<DriverHandle>) -> Result<Json<DriveStatus>, Problem> {
    Ok(Json(handle.query(DriveStatus::new).await?))
}

/// One file
#[utoipa::path(get, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = FileContent)))]
async fn get_file(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
) -> Result<Json<FileContent>, Problem> {
    file_content(&handle, name).await
}

/// Put a file on the RAM drive
///
/// Whole or not at all, as a download does; a program that is selected is taken anew at its next start. Lines end as the
/// content has it.
#[utoipa::path(put, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    request_body = ByteContent, responses((status = 200, body = FileContent)))]
async fn put_file(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
    JsonBody(body): JsonBody<ByteContent>,
) -> Result<Json<FileContent>, Problem> {
    let action = Action::PutFile {
        name: name.clone(),
        content: body.decode()?,
    };
    handle.action(action).await?;
    file_content(&handle, name).await
}

/// Erase a file
#[utoipa::path(delete, path = "/files/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = DriveStatus)))]
async fn delete_file(
    state: State<DriverHandle>,
    PathParam(name): PathParam<String>,
    _: NoBody,
) -> Result<Json<DriveStatus>, Problem> {
    state.action(Action::EraseFile { name }).await?;
    get_files(state).await
}

/// Select a file as the command SL does
#[utoipa::path(post, path = "/files/{name}/select", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = ProgramStatus)))]
async fn select_file(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
    _: NoBody,
) -> Result<Json<ProgramStatus>, Problem> {
    handle.action(Action::Select { name }).await?;
    Ok(Json(handle.query(ProgramStatus::new).await?))
}
