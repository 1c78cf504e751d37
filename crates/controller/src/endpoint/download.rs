//! The end of a download (DL) and texts of a file that arrive when no download is open (FL-04).
//!
//! The exchange before that is in `exchange`; the RAM drive is `drive`.

use super::Endpoints;
use crate::findings::rules;
use crate::persistence::PendingChange;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use bytes::Bytes;
use ts3100_proto::command::Command;
use ts3100_proto::name::FileName;
use ts3100_proto::reply::Reply;

impl Endpoints {
    /// The last text of a download has come: stores the file and answers (CMD-DL-02, CMD-DL-06).
    pub(crate) fn end_download(
        &mut self,
        robot: &mut Robot,
        port: Port,
        name: FileName,
        content: Bytes,
        last: &[u8],
    ) {
        if robot.executor.is_running() {
            let reason = "the robot was started during the download";
            robot.report(&rules::REFUSED_BY_STATE, port, name.as_str().as_bytes(), reason);
            return self.refuse_block(robot, port, last, reason);
        }
        match robot.store(&name, &content) {
            Ok(()) => {
                robot.check_download(port, &name, &content, last);
                self.send_text(robot, port, &Reply::Ok.encode());
            }
            Err(_) if robot.persistence.is_pending() => robot.persistence.hold(PendingChange::Download {
                port,
                name,
                content,
                last: last.to_vec(),
            }),
            Err(error) => {
                robot.check_store(port, &error);
                self.refuse_block(robot, port, last, &error.to_string());
            }
        }
    }

    /// Part of a file has come while no download is open (FL-04).
    pub(crate) fn stray_file(&mut self, robot: &mut Robot, port: Port, data: &Bytes) {
        if let Ok(Command::Fl(_)) = Command::parse(data) {
            self.message(robot, port, data);
        } else {
            self.begin(port, "");
            let reason = "a text of a file that was refused before";
            robot.report(&rules::FILE_WITHOUT_DOWNLOAD, port, data, reason);
            self.refuse_text(robot, port, "FL", reason);
        }
        self.check_refused_file(port, data);
    }

    /// NG to a text of a download: the whole file is refused.
    pub(crate) fn refuse_block(&mut self, robot: &mut Robot, port: Port, data: &[u8], reason: &str) {
        self.refuse_text(robot, port, "FL", reason);
        self.check_refused_file(port, data);
    }
}
