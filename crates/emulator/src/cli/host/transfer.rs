//! DL and UL of `ts3100 host`: copies files between the PC and the RAM drive.
//!
//! The exchange of each text is [`super::session`]'s; names and line ends are converted by [`ts3100_driver::pc_file`].

use super::super::output;
use super::session::Session;
use anyhow::Context as _;
use std::path::Path;
use ts3100_driver::files;
use ts3100_driver::pc_file::{MAX_PC_FILE, drive_content};
use ts3100_proto::command::Command;
use ts3100_proto::file::FlSender;
use ts3100_proto::parameter::LineEnd;

/// Sends a file of the PC, with the line ends of the drive, text by text; false if one is answered by NG.
pub(super) fn download(session: &mut Session, command: &Command, file: &Path) -> anyhow::Result<bool> {
    let text = files::read(file, MAX_PC_FILE).with_context(|| format!("cannot read {}", file.display()))?;
    let content = drive_content(&text, LineEnd::Lf);
    let length = content.len();
    if !session.plain(command)? {
        return Ok(false);
    }
    let mut sender = FlSender::new(content);
    let mut texts = 0;
    while let Some(data) = sender.next_text() {
        session.pause();
        session.send(data)?;
        texts += 1;
        if !session.ok_or_ng()? {
            return Ok(false);
        }
    }
    output::print(format!("OK, {length} bytes in {texts} texts\n"))?;
    Ok(true)
}

/// Receives a file and keeps it as it came; false if the answer is NG.
pub(super) fn upload(
    session: &mut Session,
    command: &Command,
    target: Option<&Path>,
) -> anyhow::Result<bool> {
    let Some(content) = session.file(command)? else {
        return Ok(false);
    };
    match target {
        Some(path) => files::replace(path, &content).context("cannot write the result")?,
        None => output::print(content)?,
    }
    Ok(true)
}
