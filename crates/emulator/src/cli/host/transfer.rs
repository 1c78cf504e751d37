//! DL and UL of `ts3100 host`: copies files between the PC and the RAM drive.
//!
//! The exchange of each text is [`super::session`]'s; names and line ends are converted by [`crate::loading`].

use super::Answer;
use super::session::{HostError, Session};
use crate::loading::LoadError;
use std::io::{self, Write};
use std::path::Path;
use ts3100_driver::files;
use ts3100_driver::pc_file::{MAX_PC_FILE, drive_content};
use ts3100_proto::command::Command;
use ts3100_proto::file::FlSender;
use ts3100_proto::parameter::LineEnd;

/// Sends a file of the PC, with the line ends of the drive, text by text.
pub(super) fn download(session: &mut Session, command: &Command, file: &Path) -> Result<Answer, HostError> {
    let text = files::read(file, MAX_PC_FILE).map_err(|reason| {
        HostError::Load(LoadError::Read {
            path: file.to_path_buf(),
            reason,
        })
    })?;
    let content = drive_content(&text, LineEnd::Lf);
    let length = content.len();
    if matches!(session.plain(command)?, Answer::Negative) {
        return Ok(Answer::Negative);
    }
    let mut sender = FlSender::new(content);
    let mut texts = 0;
    while let Some(data) = sender.next_text() {
        session.pause();
        session.send(&data)?;
        texts += 1;
        if matches!(session.ok_or_ng()?, Answer::Negative) {
            return Ok(Answer::Negative);
        }
    }
    println!("OK, {length} bytes in {texts} texts");
    Ok(Answer::Positive)
}

/// Receives a file and keeps it as it came.
pub(super) fn upload(
    session: &mut Session,
    command: &Command,
    output: Option<&Path>,
) -> Result<Answer, HostError> {
    let Some(content) = session.file(command)? else {
        return Ok(Answer::Negative);
    };
    match output {
        Some(path) => files::replace(path, &content).map_err(HostError::Output)?,
        None => io::stdout()
            .lock()
            .write_all(&content)
            .map_err(HostError::Output)?,
    }
    Ok(Answer::Positive)
}
