//! The exchange of texts on a port: bytes are cut into texts, texts joined into commands, answers sent, silent hosts given
//! up after 10 s.
//!
//! Start at `received()` and `text()`. The state of a port is in `session` (with the diagram of an exchange), `command`
//! answers, `sending` sends. What a text asks of the robot is returned as a [`PortEvent`]. Bytes of COM1 and IP1 to IP3 go to the ring buffers of INPUT
//! (`io::channel`).

use crate::context::Context;
use crate::endpoint::Endpoints;
use crate::endpoint::session::{Exchange, Letters};
use crate::finding::{Message, rules};
use crate::output::Event;
use crate::panel::StopRequests;
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::Refusal;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::command::{Command, CommandError};
use ts3100_proto::file::Received;
use ts3100_proto::message::Joined;
use ts3100_proto::name::FileName;
use ts3100_proto::reply::Reply;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{CR, Decoded, Framing, HOST_DELAY, Terminator, Text, TextError};

/// A request of a text to the robot.
#[derive(Debug)]
pub(crate) enum PortEvent {
    /// A command came, which nothing on the way holds up.
    Command { message: Bytes, command: Command },
    /// A text of an open download came.
    Block(Bytes),
}

impl Endpoints {
    /// Begins the conversation with a host that has come to HOST or IP0. The SU request flag of SF is off: `status` counts as
    /// served (SF-21).
    pub(crate) fn begin_session(
        &mut self,
        context: &Context,
        port: Port,
        peer: String,
        status: StatusBody,
        requests: StopRequests,
    ) {
        let session = self.session(port);
        session.reset(context.config.options.text, Some(peer));
        session.last_status = Some(status);
        // The SM latches of IP0 begin at 0 with the connection: requests before it count as shown. HOST has no
        // connection; its latches begin at power-on (T1).
        if port == Port::Ip0 {
            session.seen_requests = requests;
        }
    }

    /// Drops the conversation of a peer that is gone (ETH-07).
    pub(crate) fn disconnected(&mut self, context: &Context, port: Port) {
        self.reset_line(port);
        self.forget_peer(port);
        if port.protocol().is_some() {
            self.session(port).reset(context.config.options.text, None);
        }
    }

    /// Takes bytes of a peer, the last of which came at `at`. Returns them as the filters let them pass, `None` on a stalled
    /// port. Those of HOST and IP0 also go into the decoder of the session.
    pub(crate) fn received(
        &mut self,
        context: &mut Context,
        port: Port,
        at: Time,
        bytes: &Bytes,
    ) -> Option<Bytes> {
        let came = match self.faults.are_quiet() {
            true => bytes.clone(),
            false => self.inbound(context, port, bytes)?,
        };
        if port.protocol().is_some() {
            let session = self.session(port);
            session.received_at = at;
            session.decoder.push(&came);
        }
        Some(came)
    }

    /// Ends the wait on a port whose host was silent for too long: the port waits for a command again (SER-06, SER-08).
    /// Returns the text instead if CR was its last byte (T6). `stands_still`: a file is being stored.
    pub(crate) fn expire(&mut self, context: &mut Context, port: Port, stands_still: bool) -> Option<Text> {
        let session = self.session(port);
        if session.deadline().is_none_or(|deadline| deadline > context.now) {
            return None;
        }
        // The deadline stays due, so the text is served right after the file is stored: two changes cannot wait at
        // one instant.
        if session.decoder.awaits_etx() && stands_still {
            return None;
        }
        if let Some(Decoded::Text(text)) = session.decoder.end_at_cr() {
            return Some(text);
        }
        let download = matches!(session.exchange(), Exchange::Receiving { .. });
        let (rule, reason) = if session.is_partial() {
            let reason = "the host began a text and did not finish it within 10 s";
            (&rules::TEXT_UNFINISHED, reason)
        } else if download {
            let reason = "the host did not send the rest of a file within 10 s; the robot ends the exchange";
            (&rules::DOWNLOAD_ABANDONED, reason)
        } else {
            let reason = "the host did not answer within 10 s; the robot ends the exchange";
            (&rules::ANSWER_MISSING, reason)
        };
        let bytes = session.give_up();
        // A host that sleeps through the 10 s may still send the rest of its file. Those texts get NG as a file, not
        // as unknown commands.
        session.history.file_refused = download;
        context.dropped(port, bytes, reason);
        context.report(rule, port, &[], reason);
        None
    }

    /// Serves a text: part of the file of an open download, or of a message.
    pub(crate) fn text(&mut self, context: &mut Context, port: Port, text: Text) -> Option<PortEvent> {
        let Text {
            framing,
            data,
            terminator,
            error,
        } = text;
        context.outputs.event(Event::TextIn {
            port,
            framing,
            data: data.clone(),
            terminator,
        });
        // Before any answer: NG to a broken text is framed like that text, too.
        self.session(port).framing = framing;
        if framing == Framing::Bare {
            self.disable_unsolicited_sp(context, port);
            let message = "a text without STX; the answer has none either";
            context.report(&rules::NO_STX, port, &data, message);
        }
        // `no-etx` is a finding about commands, not about OK and NG (T27.2).
        if terminator == Terminator::Cr && !Reply::acknowledges(&data) {
            let message = "a text that ends with CR alone; it is served";
            context.report(&rules::NO_ETX, port, &data, message);
        }
        // `is_early()` first: it makes the finding, which does not depend on the option.
        if self.is_early(context, port, &data) && context.config.options.strict_50ms {
            context.dropped(port, data.len(), "strict_50ms");
        } else if let Some(error) = error {
            // Before `is_block()`: a text of a file that is too long ends its download with NG (CMD-DL-04) instead of
            // becoming data.
            self.broken_text(context, port, &data, &error);
        } else if self.is_block(context, port, &data) {
            let block = &mut self.session(port).block;
            // Counted before the filters look: fault filters number the texts of a file from 1, and 0 is the command.
            *block = block.saturating_add(1);
            return self.admit(context, port, &data).then_some(PortEvent::Block(data));
        } else if self.is_stray_file(port, &data) {
            return self.stray_file(context, port, &data);
        } else {
            return self.join(context, port, &data);
        }
        None
    }

    /// Takes a text of a download into its file. Returns the file when it is complete.
    pub(crate) fn take_block(
        &mut self,
        context: &mut Context,
        port: Port,
        data: &Bytes,
    ) -> Option<(FileName, Bytes)> {
        match self.session(port).receive(data) {
            Some((_, Received::More)) => self.acknowledge(context, port),
            // No OK yet: the last text is answered when the file is stored (CMD-DL-02).
            Some((name, Received::Complete(content))) => return Some((name, content.into())),
            Some((_, Received::Refused(error))) => {
                context.check_file(port, &error, data);
                self.refuse_block(context, port, data, &error.into());
            }
            // A fault has ended the download.
            None => {}
        }
        None
    }

    /// Whether a text came within 50 ms of the robot's last one (TRN-04).
    fn is_early(&mut self, context: &mut Context, port: Port, data: &Bytes) -> bool {
        let session = self.session(port);
        // A text that has not left yet has reached no host.
        let sent = session.sent_at.filter(|sent| *sent <= context.now);
        let since = sent.map(|sent| context.now.since(sent));
        let Some(since) = since.filter(|since| *since < HOST_DELAY) else {
            return false;
        };
        // No finding for a text right after an SP: the host could not know that the SP was coming.
        if !session.history.unsolicited_sp_sent {
            context.check_reply_pace(port, since, data);
        }
        true
    }

    /// NG to a text that breaks the rules of framing.
    fn broken_text(&mut self, context: &mut Context, port: Port, data: &[u8], error: &TextError) {
        // Read now: the refusal below ends the exchange.
        let of_file = matches!(self.session(port).exchange(), Exchange::Receiving { .. });
        self.begin(context, port, "");
        let reason = match error {
            TextError::OverLong { length } => {
                let message =
                    format!("the message has {length} bytes of data; at most 253 are allowed (5.2)");
                context.report(&rules::TEXT_OVER_LONG, port, data, message);
                Refusal::OverLong
            }
            TextError::BadSum { expected, found } => {
                let reason = Refusal::Checksum {
                    expected: *expected,
                    found: *found,
                };
                context.report(&rules::BAD_CHECKSUM, port, data, reason.to_string());
                reason
            }
            TextError::NoEtx { .. } => Refusal::NoEtx,
        };
        self.refuse_text(context, port, "text", &reason);
        if of_file {
            self.check_refused_file(port, data);
        }
    }

    /// Joins a text to the message it is part of, and serves the message if it is complete. A part alone gets no answer
    /// (TRN-08).
    fn join(&mut self, context: &mut Context, port: Port, data: &Bytes) -> Option<PortEvent> {
        let session = self.session(port);
        session.history.file_refused = false;
        match session.joiner.push(data) {
            Joined::Partial => {}
            Joined::Complete(message) => return self.message(context, port, &message),
            Joined::NoCr(message) if context.config.options.require_cr => {
                context.report(&rules::NO_CR, port, &message, "CR is missing before ETX (5.2.2)");
                let letters = String::from_utf8_lossy(message.get(..2).unwrap_or(&message)).into_owned();
                self.refuse_text(context, port, &letters, &Refusal::NoCr);
            }
            Joined::NoCr(message) => {
                let text = "CR is missing before ETX (5.2.2); accepted";
                context.report(&rules::NO_CR, port, &message, text);
                return self.message(context, port, &message);
            }
            Joined::TooLong => {
                let reason = Refusal::TooLong;
                context.report(&rules::MESSAGE_TOO_LONG, port, data, reason.to_string());
                self.refuse_text(context, port, "message", &reason);
            }
        }
        None
    }

    /// Whether a text is part of the file of an open download. The first text begins with `FL,` (CMD-DL-03). A later text
    /// that is a whole command means that the host has given up, unless `dl.command_ends` is off.
    fn is_block(&mut self, context: &mut Context, port: Port, data: &[u8]) -> bool {
        let Exchange::Receiving { begun, .. } = *self.session(port).exchange() else {
            return false;
        };
        let command = match data.split_last() {
            Some((&CR, message)) => Some(Command::parse(message)),
            // Where the file has not begun yet, a command may lack its CR.
            _ if !begun && !context.config.options.require_cr => {
                Some(Command::parse(data)).filter(Result::is_ok)
            }
            _ => None,
        };
        let is_block = match command {
            // A first text without `FL,` is a block too: the receiver refuses it, and the download ends with NG.
            Some(Ok(Command::Fl(_))) | None => true,
            // The host cancels the download, without an answer (CMD-DL-05).
            Some(Ok(Command::Ng)) => false,
            // A program may call a subprogram `SM`; a dialect without SM has no command of that name.
            Some(Ok(command)) if !context.config.serves(&command) => true,
            Some(Ok(_)) if begun && !context.config.options.command_ends_download => true,
            Some(Ok(command)) => {
                let message = format!(
                    "{} came while a download was open; the robot drops the download",
                    command.letters()
                );
                context.report(&rules::COMMAND_IN_EXCHANGE, port, data, message);
                false
            }
            Some(Err(_)) => begun || data.starts_with(b"FL,"),
        };
        if is_block && !begun {
            context.check_file_begin(port, data);
        }
        is_block
    }

    pub(crate) fn message(
        &mut self,
        context: &mut Context,
        port: Port,
        message: &Bytes,
    ) -> Option<PortEvent> {
        let command = Command::parse(message);
        if let Ok(command) = &command {
            context.check_form(port, message, command);
        }
        let session = self.session(port);
        // Every message ends the open exchange (TRN-09). Only an OK with texts left opens it again, below.
        let open = session.take_exchange();
        match (command, open) {
            (Ok(Command::Ok), Exchange::Sending { mut sender }) => {
                context.fault_effects.acknowledged(port);
                if let Some(text) = sender.next_text() {
                    session.block = session.block.saturating_add(1);
                    self.send_text(context, port, text);
                    self.session(port).await_acknowledgement(sender);
                }
            }
            // The host breaks off: no answer (CMD-DL-05, broken-off.txt). Without an open exchange OK and NG mean
            // nothing (TRN-10).
            (Ok(Command::Ng), Exchange::Sending { .. } | Exchange::Receiving { .. }) => {}
            (Ok(Command::Ok | Command::Ng), _) => {
                let text = "OK or NG came, but nothing was asked";
                context.report(&rules::UNEXPECTED_ANSWER, port, message, text);
            }
            (Ok(command), open) => {
                if matches!(open, Exchange::Sending { .. }) {
                    let command = command.letters();
                    let interrupts = Message::Interrupts { command };
                    let rule = &rules::COMMAND_IN_EXCHANGE;
                    context.report_shared(rule, Some(port), message.clone(), interrupts);
                }
                self.check_command(context, port, message, &command);
                // Before `admit()`: a fault filters by the letters of the command that is answered.
                self.begin(context, port, command.letters());
                if self.admit(context, port, message) {
                    let message = message.clone();
                    return Some(PortEvent::Command { message, command });
                }
            }
            (Err(error), _) => {
                self.begin(context, port, "");
                let (rule, letters) = match &error {
                    CommandError::Unknown { letters } => (&rules::UNKNOWN_COMMAND, letters.clone()),
                    CommandError::Malformed { letters, .. } => {
                        (&rules::MALFORMED_COMMAND, (*letters).to_string())
                    }
                };
                context.report(rule, port, message, error.to_string());
                self.check_repeat(context, port, message, true);
                self.refuse_text(context, port, &letters, &error.into());
            }
        }
        None
    }

    /// Notes which command is being answered; empty letters mean an unparsable text.
    pub(crate) fn begin(&mut self, context: &mut Context, port: Port, letters: Letters) {
        let busy = self.send_queue.is_busy(port);
        context
            .fault_effects
            .next_command(port, letters, busy, context.now);
        let session = self.session(port);
        (session.asked, session.block) = (letters, 0);
    }

    /// Sends NG and ends the open exchange. The event with the reason comes first, so a log shows it before the NG.
    pub(crate) fn refuse_text(&mut self, context: &mut Context, port: Port, command: &str, reason: &Refusal) {
        let session = self.session(port);
        session.take_exchange();
        session.joiner.reset();
        context.outputs.event(Event::Refused {
            port,
            command: command.to_string(),
            reason: reason.to_string(),
        });
        self.send_text(context, port, &Reply::Ng.encode());
    }
}
