//! `/files`: the RAM drive: list, read, write, erase and select files.
//!
//! A file is written as by a download, all or nothing; the rules are in the controller's `drive` module.

use super::channels::ByteContent;
use super::panel::ProgramStatus;
use super::resource::{Answer, Handle, Json, NoBody, Path, Problem, Serialize, View, call};
use ts3100_controller::action::Action;
use ts3100_proto::escape::hex_digits;
use ts3100_proto::words::did_you_mean_or;

/// Most files that the message about a missing one lists.
const MAX_LISTED: usize = 12;

/// The RAM drive.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Drive))]
pub struct DriveStatus {
    /// Files in alphabetical order.
    files: Vec<FileEntry>,
    /// The selected file; empty when none is.
    selected: String,
    /// Capacity for user files in bytes.
    capacity: usize,
}

/// A file on the RAM drive.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct FileEntry {
    /// Name of the file.
    name: String,
    /// Size in bytes.
    size: u32,
}

/// A file with its content: as text, or as hexadecimal digits if it is not UTF-8.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = File))]
pub struct FileContent {
    /// Name of the file.
    name: String,
    /// Size in bytes.
    size: usize,
    /// Content of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    /// Content of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    hex: Option<String>,
}

impl DriveStatus {
    /// Reads the present state.
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

/// There is no file of this name. The message has the names that it may be mistaken for, or those that there are.
pub fn missing(place: &str, view: &View<'_>, name: &str) -> Problem {
    let files = view.controller.drive().directory();
    let names = || files.iter().map(|entry| entry.name.as_str());
    let listed: Vec<&str> = names().take(MAX_LISTED).collect();
    let more = if names().len() > MAX_LISTED { ", ..." } else { "" };
    let hint = did_you_mean_or(
        name,
        names(),
        format!("; the drive has {}{more}", listed.join(", ")),
    );
    let sentence = format!("cannot read {name}: it is not on the RAM drive{hint}");
    Problem::not_found(place, "a file of the RAM drive", name).told(sentence)
}

impl FileContent {
    /// Looks for the file of this name.
    fn find(name: String) -> impl FnOnce(&View<'_>) -> Result<FileContent, Problem> {
        move |view| {
            let drive_name = name.to_ascii_uppercase();
            let Some(content) = view.controller.drive().get(&drive_name) else {
                return Err(missing("name", view, &name));
            };
            let (text, hex) = match str::from_utf8(content) {
                Ok(text) => (Some(text.to_owned()), None),
                Err(_) => (None, Some(hex_digits(content))),
            };
            Ok(FileContent {
                name: drive_name,
                size: content.len(),
                text,
                hex,
            })
        }
    }
}

call! {
    /// Read a file
    get_file = get("/files/{name}",
        params(("name" = String, Path, description = "Name of the file")),
        responses((status = 200, body = FileContent)))
}
pub async fn get_file(handle: Handle, Path(name): Path<String>) -> Answer<FileContent> {
    handle.query(FileContent::find(name)).await?.map(Json)
}

call! {
    /// Write a file
    ///
    /// The whole file is written, or nothing. If it is the selected program, its next start uses the new content. Line
    /// endings are kept.
    put_file = put("/files/{name}",
        params(("name" = String, Path, description = "Name of the file")),
        request_body = ByteContent,
        responses((status = 200, body = FileContent)))
}
pub async fn put_file(
    handle: Handle,
    Path(name): Path<String>,
    Json(body): Json<ByteContent>,
) -> Answer<FileContent> {
    let action = Action::PutFile {
        name: name.clone(),
        content: body.decode()?,
    };
    handle.act(action, FileContent::find(name)).await?.map(Json)
}

call! {
    /// Erase a file
    delete_file = delete("/files/{name}",
        params(("name" = String, Path, description = "Name of the file")),
        responses((status = 200, body = DriveStatus)))
}
pub async fn delete_file(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<DriveStatus> {
    let action = Action::EraseFile { name };
    handle.act(action, DriveStatus::new).await.map(Json)
}

call! {
    /// Select a file
    ///
    /// As the command SL does.
    select_file = post("/files/{name}/select",
        params(("name" = String, Path, description = "Name of the file")),
        responses((status = 200, body = ProgramStatus)))
}
pub async fn select_file(handle: Handle, Path(name): Path<String>, _: NoBody) -> Answer<ProgramStatus> {
    let action = Action::Select { name };
    handle.act(action, ProgramStatus::new).await.map(Json)
}
