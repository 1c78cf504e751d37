//! Checks of the conversation on a port against the rules of `finding::rules`; `HostHistory` is what they remember of a
//! host between texts. Nothing here changes an answer.

use crate::context::Context;
use crate::context::checks::begins_file;
use crate::endpoint::Endpoints;
use crate::endpoint::session::Exchange;
use crate::finding::Message;
use crate::finding::rules::{self, MIN_POLL_INTERVAL};
use crate::port::Port;
use bytes::Bytes;
use ts3100_proto::command::{Answer, Command};
use ts3100_proto::text::{CR, EOF};

/// Refusals of the same command in a row that make a finding.
const REPEATED_REFUSALS: u32 = 3;

impl Endpoints {
    /// Whether a text belongs to a file although no download is open. Such a text ends without CR (FL-01), so it must
    /// not be reported as one that lacks it.
    pub(crate) fn is_stray_file(&mut self, port: Port, data: &[u8]) -> bool {
        let session = self.session(port);
        let message = data.strip_suffix(&[CR]).unwrap_or(data);
        !session.joiner.is_partial()
            && (begins_file(data) || session.history.file_refused && Command::parse(message).is_err())
    }

    /// Remembers that a text of a file was refused, unless it was the last.
    pub(crate) fn check_refused_file(&mut self, port: Port, data: &[u8]) {
        let ended = data.ends_with(&[EOF]) || data.ends_with(&[EOF, CR]);
        self.session(port).history.file_refused = !ended;
    }

    /// Checks a command against the present state and the previous commands.
    pub(crate) fn check_command(
        &mut self,
        context: &mut Context,
        port: Port,
        message: &Bytes,
        command: &Command,
    ) {
        if command.is_extension() {
            let answer = if context.config.serves(command) {
                "served"
            } else {
                "NG"
            };
            let row = command.permission_row();
            let text = format!("the manual does not list {row}; {answer} (option `extensions`)");
            context.report(&rules::EXTENSION_COMMAND, port, message, text);
        }
        if command.row().answer != Answer::Status {
            return;
        }
        let since = self.session(port).history.note_poll(message, context.now);
        if let Some(since) = since.filter(|since| *since < MIN_POLL_INTERVAL) {
            let command = command.letters();
            let again = Message::Again { command, since };
            context.report_shared(&rules::POLL_FAST, Some(port), message.clone(), again);
        }
    }

    /// Counts refusals of the same message in a row.
    pub(crate) fn check_repeat(&mut self, context: &mut Context, port: Port, message: &[u8], refused: bool) {
        let last_refused = &mut self.session(port).history.last_refused;
        let before = last_refused.take().filter(|(text, _)| text == message);
        if !refused {
            return;
        }
        let times = before.map_or(0, |(_, times)| times).saturating_add(1);
        *last_refused = Some((message.to_vec(), times));
        if times >= REPEATED_REFUSALS {
            let text = format!("the same command was refused {times} times in a row");
            context.report(&rules::REPEATED_REFUSAL, port, message, text);
        }
    }

    /// Checks in what state the host of HOST or IP0 disconnected.
    pub(crate) fn check_left_exchange(&mut self, context: &mut Context, port: Port) {
        let Some(session) = self.sessions.get(&port).filter(|session| session.peer.is_some()) else {
            return;
        };
        let what = match session.exchange() {
            Exchange::Sending { .. } => "before it acknowledged an FL text",
            Exchange::Receiving { .. } => "in the middle of a download; nothing is stored",
            Exchange::Idle if session.is_partial() => "in the middle of a text",
            Exchange::Idle => return,
        };
        let text = format!("the host closed the connection {what}");
        context.report(&rules::LEFT_IN_EXCHANGE, port, &[], text);
    }
}
