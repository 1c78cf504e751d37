//! Texts of a file that arrive when no download is open (FL-04), and texts of a download that are refused.
//!
//! The exchange before that is in `exchange`; the RAM drive is `drive`.

use super::Endpoints;
use crate::context::Context;
use crate::endpoint::exchange::PortEvent;
use crate::finding::rules;
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::Refusal;
use bytes::Bytes;
use ts3100_proto::command::Command;

impl Endpoints {
    /// Part of a file has come while no download is open (FL-04).
    pub(crate) fn stray_file(
        &mut self,
        context: &mut Context,
        port: Port,
        data: &Bytes,
    ) -> Option<PortEvent> {
        let mut event = None;
        // `FL,` alone is a command, so `ops` refuses it like any other. The texts that follow it are known by
        // `file_refused` only.
        if let Ok(Command::Fl(_)) = Command::parse(data) {
            event = self.message(context, port, data);
        } else {
            self.begin(context, port, "");
            let reason = Refusal::FileRefused;
            context.report(&rules::FILE_WITHOUT_DOWNLOAD, port, data, reason.to_string());
            self.refuse_text(context, port, "FL", &reason);
        }
        self.check_refused_file(port, data);
        event
    }

    /// NG to a text of a download: the whole file is refused.
    pub(crate) fn refuse_block(&mut self, context: &mut Context, port: Port, data: &[u8], reason: &Refusal) {
        self.refuse_text(context, port, "FL", reason);
        self.check_refused_file(port, data);
    }
}
