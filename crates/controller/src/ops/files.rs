//! UL DL ER CA: the files of the RAM drive.

use crate::Controller;
use crate::drive::Drive;
use crate::findings::rules;
use crate::output::Output;
use crate::persistence::PendingChange;
use crate::port::Port;
use crate::session::{Outcome, Session};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use ts3100_proto::command::Command;
use ts3100_proto::file::FlReceiver;
use ts3100_proto::name::FileName;
use ts3100_proto::reply::Reply;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::ca::encode_directory_with;

impl Controller {
    /// UL (CMD-UL-01 to CMD-UL-04).
    pub(super) fn op_upload(&mut self, name: &FileName) -> Outcome {
        match self.drive.get(name.as_str()) {
            Some(content) => Outcome::file(content.to_vec()),
            None => Outcome::Ng(missing(name)),
        }
    }

    /// DL: the texts of the file may come (CMD-DL-01, TRN-11).
    pub(super) fn op_download(&mut self, name: FileName) -> Outcome {
        if self
            .sessions
            .values()
            .any(|session: &Session| session.receives(&name))
        {
            return Outcome::Ng(format!(
                "file {} is being downloaded on another port",
                name.as_str()
            ));
        }
        let room = self.drive.free_bytes_for(&name);
        let room = self.faults.drive_free.map_or(room, |free| free.min(room));
        let receiver = FlReceiver::new(room, Drive::file_rule(&name));
        Outcome::Receive(name, receiver)
    }

    /// The last text of a download has come (CMD-DL-02, CMD-DL-06).
    fn finish_download(&mut self, port: Port, name: &FileName, content: &[u8]) -> Result<(), String> {
        if self.executor.status() == ExecutionStatus::Running {
            let reason = "the robot was started during the download";
            self.report(&rules::REFUSED_BY_STATE, port, name.as_str().as_bytes(), reason);
            return Err(reason.to_string());
        }
        self.store(name, content).map_err(|error| {
            self.check_store(port, &error);
            error.to_string()
        })
    }

    /// The answer to the last text of a download.
    pub(crate) fn end_download(&mut self, port: Port, name: FileName, content: Vec<u8>, last: &[u8]) {
        match self.finish_download(port, &name, &content) {
            Ok(()) => {
                self.check_download(port, &name, &content, last);
                self.send_text(port, &Reply::Ok.encode());
            }
            Err(_) if self.persistence.is_pending() => self.persistence.hold(PendingChange::Download {
                port,
                name,
                content,
                last: last.to_vec(),
            }),
            Err(reason) => self.refuse_block(port, last, &reason),
        }
    }

    /// Part of a file has come while no download is open (FL-04).
    pub(crate) fn stray_file(&mut self, port: Port, data: &[u8]) {
        if let Ok(Command::Fl(_)) = Command::parse(data) {
            self.message(port, data);
        } else {
            self.no_command(port);
            let reason = "a text of a file that was refused before";
            self.report(&rules::FILE_WITHOUT_DOWNLOAD, port, data, reason);
            self.refuse_text(port, "FL", reason);
        }
        self.check_refused_file(port, data);
    }

    /// NG to a text of a download: the whole file is refused.
    pub(crate) fn refuse_block(&mut self, port: Port, data: &[u8], reason: &str) {
        self.refuse_text(port, "FL", reason);
        self.check_refused_file(port, data);
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
        self.push_output(Output::Erased {
            name: name.as_str().to_string(),
        });
        Outcome::Ok
    }

    /// CA (CMD-CA-01, DIR-01 to DIR-04).
    pub(super) fn op_directory(&mut self) -> Outcome {
        let mut entries = self.drive.directory();
        let blanks = match &mut self.variation {
            // The vendor's library, whose commands the extensions are, reads one blank.
            Some(vary) if !self.config.options.extensions => vary.directory_blanks(),
            _ => " ".to_string(),
        };
        if let Some(vary) = &mut self.variation {
            vary.order(&mut entries);
        }
        Outcome::file(encode_directory_with(&entries, &blanks))
    }
}

fn missing(name: &FileName) -> String {
    format!("file {} is not on the RAM drive", name.as_str())
}
