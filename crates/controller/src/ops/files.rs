//! UL DL ER CA: the files of the RAM drive. The end of a download is in `endpoint::download`.

use super::{CommandContext, Outcome};
use crate::drive::Drive;
use crate::output::Output;
use crate::prelude::*;
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
            return Outcome::Ng(format!(
                "file {} is being downloaded on another port",
                name.as_str()
            ));
        }
        let room = self.drive.free_bytes_for(&name);
        let room = context.room.map_or(room, |free| free.min(room));
        let receiver = FlReceiver::new(room, Drive::file_rule(&name));
        Outcome::Receive(name, receiver)
    }

    /// ER (CMD-ER-01 to CMD-ER-03).
    pub(crate) fn op_erase(&mut self, name: &FileName) -> Outcome {
        if name.is_parameter() {
            return Outcome::ng("a parameter file cannot be erased");
        }
        if self.executor.file() == name.as_str() {
            return Outcome::ng("the selected file cannot be erased; RS,SEL ends the selection");
        }
        if !self.drive.contains(name.as_str()) {
            return Outcome::Ng(missing(name));
        }
        if let Err(error) = self.persist(name.as_str(), None) {
            return Outcome::Ng(error.to_string());
        }
        self.drive.erase(name.as_str());
        self.outputs.push(Output::Erased {
            name: name.as_str().to_string(),
        });
        Outcome::Ok
    }

    /// CA (CMD-CA-01, DIR-01 to DIR-04).
    pub(super) fn op_directory(&mut self, context: &mut CommandContext<'_>) -> Outcome {
        let mut entries = self.drive.directory();
        let blanks = match &mut context.variation {
            // The vendor's library, whose commands the extensions are, reads one blank.
            Some(variation) if !self.config.options.extensions => variation.directory_blanks(),
            _ => " ".to_string(),
        };
        if let Some(variation) = &mut context.variation {
            variation.order(&mut entries);
        }
        Outcome::file(encode_directory(&entries, &blanks))
    }
}

fn missing(name: &FileName) -> String {
    format!("file {} is not on the RAM drive", name.as_str())
}
