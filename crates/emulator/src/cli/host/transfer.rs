//! DL and UL of `ts3100 host`: copies files between the PC and the RAM drive.
//!
//! The exchange of each text is [`ts3100_host`]'s; names and line ends are converted by [`ts3100_driver::pc_file`].

use super::super::ctl::call::bytes_json;
use super::super::output;
use super::session::Session;
use anyhow::Context as _;
use serde_json::json;
use std::path::Path;
use ts3100_driver::{files, pc_file};
use ts3100_host::Response;
use ts3100_proto::command::Command;
use ts3100_proto::file::FlSender;
use ts3100_proto::parameter::LineEnd;

/// Reads a file of the PC, with the line ends of the drive.
///
/// # Errors
/// It cannot be read, or no drive can have one so large.
pub(super) fn read(file: &Path) -> anyhow::Result<Vec<u8>> {
    pc_file::read_content(file, LineEnd::Lf).with_context(|| format!("cannot read {}", file.display()))
}

/// Sends a file; false if the controller refuses it.
pub(super) fn download(
    session: &mut Session,
    command: &Command,
    content: Vec<u8>,
    json: bool,
) -> anyhow::Result<bool> {
    let length = content.len();
    let mut sender = FlSender::new(&content);
    let texts = std::iter::from_fn(|| sender.next_text().map(drop)).count();
    let is_stored = session.request(command)? == Response::Ok && session.send_file(content)?;
    if is_stored {
        output::print(match json {
            true => format!("{}\n", json!({ "reply": "OK", "bytes": length, "texts": texts })),
            false => format!("OK, {length} bytes in {texts} texts\n"),
        })?;
    }
    Ok(is_stored)
}

/// Receives a file and keeps it as it came, or as JSON on stdout; false if the reply is NG.
pub(super) fn upload(
    session: &mut Session,
    command: &Command,
    target: Option<&Path>,
    json: bool,
) -> anyhow::Result<bool> {
    let Response::Content(content) = session.request(command)? else {
        return Ok(false);
    };
    match target {
        Some(path) => files::replace(path, &content).context("cannot write the result")?,
        None if json => output::print(format!("{}\n", bytes_json(content)))?,
        None => output::print(content)?,
    }
    Ok(true)
}
