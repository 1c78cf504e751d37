//! UL DL ER CA: the files of the RAM drive. The end of a download is in `controller::commands`.

use super::CommandContext;
use crate::drive::{Drive, Staged};
use crate::outcome::Outcome;
use crate::prelude::*;
use crate::refusal::Refusal;
use crate::robot::Robot;
use ts3100_proto::file::FlReceiver;
use ts3100_proto::name::FileName;
use ts3100_proto::status::ca::encode_directory;

impl Robot {
    /// UL (CMD-UL-01 to CMD-UL-04).
    pub(super) fn op_upload(&mut self, name: &FileName) -> Outcome {
        match self.drive.get(name.as_str()) {
            Some(content) => Outcome::file(content.to_vec()),
            None => Outcome::Ng(missing(name)),
        }
    }

    /// DL: the texts of the file may come (CMD-DL-01, TRN-11).
    pub(super) fn op_download(&mut self, context: &CommandContext<'_>, name: FileName) -> Outcome {
        if context.receiving {
            return Outcome::Ng(Refusal::Downloading(name.as_str().to_string()));
        }
        let room = self.drive.free_bytes_for(&name);
        let room = context.room.map_or(room, |free| free.min(room));
        let receiver = FlReceiver::new(room, Drive::file_rule(&name));
        Outcome::Receive(name, receiver)
    }

    /// ER (CMD-ER-01 to CMD-ER-03).
    ///
    /// # Errors
    /// Why it stays.
    pub(crate) fn stage_erase(&self, name: &FileName) -> Result<Staged, Refusal> {
        if name.is_permanent() {
            return Err(Refusal::Permanent);
        }
        if self.executor.file() == name.as_str() {
            return Err(Refusal::Selected);
        }
        if !self.drive.contains(name.as_str()) {
            return Err(missing(name));
        }
        Ok(Drive::stage_erase(name))
    }

    /// CA (CMD-CA-01, DIR-01 to DIR-04).
    pub(super) fn op_directory(&mut self, context: &mut CommandContext<'_>) -> Outcome {
        let mut entries = self.drive.directory();
        let blanks = match &mut context.variation {
            // The vendor's library, whose commands the extensions are, reads one blank.
            Some(variation) if !self.context.config.options.extensions => variation.directory_blanks(),
            _ => " ".to_string(),
        };
        if let Some(variation) = &mut context.variation {
            variation.order(&mut entries);
        }
        Outcome::file(encode_directory(&entries, &blanks))
    }
}

fn missing(name: &FileName) -> Refusal {
    Refusal::NoFile(name.as_str().to_string())
}
