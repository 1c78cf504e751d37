//! The exchange of texts on a port: bytes are cut into texts, texts joined into commands, answers sent, silent hosts given
//! up after 10 s.
//!
//! Start at `received()`. What is remembered of a port is in `session` (with the diagram of an exchange),
//! `command` takes a command to the robot, `sending` sends. Bytes of COM1 and IP1 to IP3 go to the ring buffers of INPUT
//! (`io::channel`).

use crate::alarm::ethernet_disconnected;
use crate::endpoint::Endpoints;
use crate::endpoint::serial_line::direction::Direction;
use crate::endpoint::serial_line::{DepartedPeer, SerialLine};
use crate::endpoint::session::{Exchange, Letters};
use crate::findings::{Message, rules};
use crate::limits::HOST_DELAY;
use crate::output::Event;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::command::{Command, CommandError};
use ts3100_proto::file::Received;
use ts3100_proto::message::Joined;
use ts3100_proto::reply::Reply;
use ts3100_proto::text::{CR, Decoded, Framing, Text, TextError};

impl Endpoints {
    pub(crate) fn connected(&mut self, robot: &mut Robot, port: Port, peer: String) {
        let line = self.lines.get_mut(&port);
        if let Some(leaving) = line.and_then(|line| line.departed_peer.as_mut()) {
            leaving.next_peer = Some(peer);
            return;
        }
        self.forget_peer(port);
        if port.protocol().is_some() {
            let session = self.session(port);
            session.reset(robot.config.options.text, Some(peer));
            session.last_status = Some(robot.status_body());
        } else if let Some(channel) = robot.channels.get_mut(port) {
            channel.connect_peer(peer);
        }
    }

    /// The peer is gone: at once, or behind what it has put on a serial line.
    pub(crate) fn peer_left(&mut self, robot: &mut Robot, port: Port) {
        match self.lines.get_mut(&port) {
            Some(line) if line.inbound.queued() > 0 => {
                line.outbound = Direction::default();
                line.sending = None;
                line.departed_peer = Some(DepartedPeer {
                    bytes_left: line.inbound.queued(),
                    next_peer: None,
                });
            }
            _ => self.disconnected(robot, port),
        }
    }

    pub(crate) fn disconnected(&mut self, robot: &mut Robot, port: Port) {
        self.check_disconnect(robot, port);
        if let Some(line) = self.lines.get_mut(&port) {
            let inbound = core::mem::take(&mut line.inbound);
            *line = SerialLine {
                inbound,
                ..SerialLine::default()
            };
        }
        self.forget_peer(port);
        robot.arm.stop_jog_from(port, robot.now);
        if port.protocol().is_some() {
            self.session(port).reset(robot.config.options.text, None);
        } else if let Some(channel) = robot.channels.get_mut(port) {
            channel.disconnect_peer();
        }
        let levels = robot.parameters.ethernet().alarm_level;
        let level = port.ethernet_index().and_then(|index| levels[index]);
        if let Some(level) = level.filter(|_| robot.executor.program_runs()) {
            let detail = format!("{port}: the peer left");
            robot.raise(ethernet_disconnected(level), detail);
        }
    }

    /// Bytes have come through, the last of them at `at`. Whether the robot has run as far as it goes since.
    pub(crate) fn received(&mut self, robot: &mut Robot, port: Port, at: Time, bytes: &Bytes) -> bool {
        let changed;
        let came = if self.faults.are_quiet() {
            bytes
        } else if let Some(instead) = self.inbound(robot, port, bytes) {
            changed = instead;
            &changed
        } else {
            return false;
        };
        if port.protocol().is_some() {
            let session = self.session(port);
            session.heard_at = at;
            session.decoder.push(came);
            return self.read_texts(robot, port, true);
        } else if port == Port::Ip3 {
            let message = format!("{} bytes for {port} are discarded", bytes.len());
            robot.report(&rules::DATA_TO_IP3, port, bytes, message);
        } else {
            self.received_data(robot, port, came);
        }
        false
    }

    /// Data for INPUT: what does not fit now may fit when a waiting INPUT has taken its values (SER-03).
    fn received_data(&mut self, robot: &mut Robot, port: Port, bytes: &[u8]) {
        let mut rest = bytes;
        if bytes.is_empty() {
            return;
        }
        robot.check_data(port, bytes);
        while !rest.is_empty() {
            let Some(channel) = robot.channels.get_mut(port) else {
                return;
            };
            let taken = channel.push(rest);
            rest = rest.get(taken..).unwrap_or_default();
            let before = channel.len();
            self.settle(robot);
            let channel = robot.channels.get(port);
            let drained = channel.is_some_and(|channel| channel.len() < before);
            if !rest.is_empty() && !drained {
                let (lost, full) = (rest.len(), "is full (256 bytes); send after the program asks");
                let message = format!("{lost} bytes lost: the ring buffer of {port} {full}");
                robot.report(&rules::INPUT_OVERFLOW, port, rest, message);
                return;
            }
        }
    }

    /// Serves the texts that are there; `first`: none of their segment was served before. Whether the robot has run as far as
    /// it goes since.
    pub(crate) fn read_texts(&mut self, robot: &mut Robot, port: Port, mut first: bool) -> bool {
        let mut settled = false;
        while !robot.persistence.is_pending()
            && let Some(decoded) = self.session(port).decoder.next()
        {
            if !core::mem::take(&mut first) {
                self.release_overdue_sp(robot, port);
            }
            match decoded {
                Decoded::Skipped { bytes } => {
                    robot.dropped(port, bytes, "outside a text");
                    let message = format!("{bytes} bytes that belong to no text are skipped");
                    robot.report(&rules::BYTES_OUTSIDE, port, &[], message);
                }
                Decoded::Text(text) => self.text(robot, port, text),
            }
            // What the text started runs before the next text of the same segment is looked at.
            self.settle(robot);
            settled = true;
        }
        settled
    }

    /// Ports on which the host was silent for too long return to waiting for a command (SER-06, SER-08).
    pub(crate) fn expire_sessions(&mut self, robot: &mut Robot) {
        for session in self.sessions.values_mut() {
            if session.deadline().is_none_or(|deadline| deadline > robot.now) {
                continue;
            }
            let download = matches!(session.exchange(), Exchange::Receiving { .. });
            let (rule, reason) = if session.is_partial() {
                let reason = "a text was begun and not finished within 10 s";
                (&rules::TEXT_UNFINISHED, reason)
            } else if download {
                let reason = "the host owed the rest of a file for 10 s; the exchange is given up";
                (&rules::DOWNLOAD_ABANDONED, reason)
            } else {
                let reason = "the host owed an answer for 10 s; the exchange is given up";
                (&rules::ANSWER_MISSING, reason)
            };
            let (port, bytes) = (session.port, session.give_up());
            session.history.file_refused = download;
            robot.dropped(port, bytes, reason);
            robot.report(rule, port, &[], reason);
        }
    }

    /// Serves a text: part of the file of an open download, or of a message.
    fn text(&mut self, robot: &mut Robot, port: Port, text: Text) {
        let Text { framing, data, error } = text;
        robot.outputs.event(Event::TextIn {
            port,
            framing,
            data: data.clone(),
        });
        self.session(port).framing = framing;
        robot.panel.feed_watchdog(robot.now);
        if framing == Framing::Bare {
            self.disable_unsolicited_sp(robot, port);
            let message = "a text without STX; it is answered without STX";
            robot.report(&rules::NO_STX, port, &data, message);
        }
        if self.is_early(robot, port, &data) && robot.config.options.strict_50ms {
            robot.dropped(port, data.len(), "strict_50ms");
        } else if let Some(error) = error {
            self.broken_text(robot, port, &data, &error);
        } else if self.is_block(robot, port, &data) {
            let block = &mut self.session(port).block;
            *block = block.saturating_add(1);
            if !self.admit(robot, port, &data) {
                return;
            }
            match self.session(port).receive(&data) {
                Some((_, Received::More)) => self.send_text(robot, port, &Reply::Ok.encode()),
                Some((name, Received::Complete(content))) => {
                    self.end_download(robot, port, name, content.into(), &data);
                }
                Some((_, Received::Refused(error))) => {
                    robot.check_file(port, &error, &data);
                    self.refuse_block(robot, port, &data, &error.to_string());
                }
                // A fault has ended the download.
                None => {}
            }
        } else if self.is_stray_file(port, &data) {
            self.stray_file(robot, port, &data);
        } else {
            self.join(robot, port, &data);
        }
    }

    /// Whether a text came within 50 ms of the robot's last one (TRN-04).
    fn is_early(&mut self, robot: &mut Robot, port: Port, data: &Bytes) -> bool {
        let session = self.session(port);
        // What has not left yet was not heard by anyone.
        let sent = session.sent_at.filter(|sent| *sent <= robot.now);
        let since = sent.map(|sent| robot.now.since(sent));
        let Some(since) = since.filter(|since| *since < HOST_DELAY) else {
            return false;
        };
        if !session.history.unsolicited_sp_sent {
            robot.check_reply_pace(port, since, data);
        }
        true
    }

    /// NG to a text that breaks the rules of framing.
    fn broken_text(&mut self, robot: &mut Robot, port: Port, data: &[u8], error: &TextError) {
        let of_file = matches!(self.session(port).exchange(), Exchange::Receiving { .. });
        self.begin(port, "");
        let reason = match error {
            TextError::OverLong { length } => {
                let message =
                    format!("the message has {length} bytes of data; at most 253 are allowed (5.2)");
                robot.report(&rules::TEXT_OVER_LONG, port, data, message);
                "over-long text".to_string()
            }
            TextError::BadSum { expected, found } => {
                let reason = format!("wrong checksum: expected {expected:02X}, found {found:02X}");
                robot.report(&rules::BAD_CHECKSUM, port, data, reason.as_str());
                reason
            }
            TextError::NoEtx { .. } => "there is no ETX where the length says".to_string(),
        };
        self.refuse_text(robot, port, "text", &reason);
        if of_file {
            self.check_refused_file(port, data);
        }
    }

    /// Joins a text to the message it is part of, and serves the message if it is complete.
    fn join(&mut self, robot: &mut Robot, port: Port, data: &Bytes) {
        let session = self.session(port);
        session.history.file_refused = false;
        match session.joiner.push(data) {
            Joined::Partial => {}
            Joined::Complete(message) => self.message(robot, port, &message),
            Joined::NoCr(message) if robot.config.options.require_cr => {
                robot.report(&rules::NO_CR, port, &message, "CR is missing before ETX (5.2.2)");
                let letters = String::from_utf8_lossy(message.get(..2).unwrap_or(&message)).into_owned();
                self.refuse_text(robot, port, &letters, "no CR before ETX");
            }
            Joined::NoCr(message) => {
                let text = "CR is missing before ETX (5.2.2); taken all the same";
                robot.report(&rules::NO_CR, port, &message, text);
                self.message(robot, port, &message);
            }
            Joined::TooLong => {
                let reason = "a message of more than 1024 bytes";
                robot.report(&rules::MESSAGE_TOO_LONG, port, data, reason);
                self.refuse_text(robot, port, "message", reason);
            }
        }
    }

    /// Whether a text is part of the file of an open download. The first text begins with `FL,`; of the others one that
    /// is a command and nothing else means that the host has given up.
    fn is_block(&mut self, robot: &mut Robot, port: Port, data: &[u8]) -> bool {
        let Exchange::Receiving { begun, .. } = *self.session(port).exchange() else {
            return false;
        };
        let command = match data.split_last() {
            Some((&CR, message)) => Some(Command::parse(message)),
            // Where the file has not begun yet, a command may lack its CR.
            _ if !begun && !robot.config.options.require_cr => {
                Some(Command::parse(data)).filter(Result::is_ok)
            }
            _ => None,
        };
        let is_block = match command {
            Some(Ok(Command::Fl(_))) | None => true,
            Some(Ok(Command::Ng)) => false,
            Some(Ok(command)) if !robot.config.serves(&command) => true,
            Some(Ok(_)) if begun && !robot.config.options.command_ends_download => true,
            Some(Ok(command)) => {
                let message = format!(
                    "{} came while a download was open; the download is given up",
                    command.letters()
                );
                robot.report(&rules::COMMAND_IN_EXCHANGE, port, data, message);
                false
            }
            Some(Err(_)) => begun || data.starts_with(b"FL,"),
        };
        if is_block && !begun {
            robot.check_file_begin(port, data);
        }
        is_block
    }

    pub(crate) fn message(&mut self, robot: &mut Robot, port: Port, message: &Bytes) {
        let command = Command::parse(message);
        if let Ok(command) = &command {
            robot.check_form(port, message, command);
        }
        let session = self.session(port);
        let open = session.set_exchange(Exchange::Idle);
        match (command, open) {
            (Ok(Command::Ok), Exchange::Sending { mut sender }) => {
                if let Some(text) = sender.next_text() {
                    session.block = session.block.saturating_add(1);
                    self.send_text(robot, port, text);
                    self.session(port).set_exchange(Exchange::Sending { sender });
                }
            }
            (Ok(Command::Ng), Exchange::Sending { .. } | Exchange::Receiving { .. }) => {}
            (Ok(Command::Ok | Command::Ng), _) => {
                let text = "OK or NG came, but nothing was asked";
                robot.report(&rules::UNEXPECTED_ANSWER, port, message, text);
            }
            (Ok(command), open) => {
                if matches!(open, Exchange::Sending { .. }) {
                    let command = command.letters();
                    let interrupts = Message::Interrupts { command };
                    let rule = &rules::COMMAND_IN_EXCHANGE;
                    robot.report_shared(rule, Some(port), message.clone(), interrupts);
                }
                self.check_command(robot, port, message, &command);
                self.begin(port, command.letters());
                if self.admit(robot, port, message) {
                    self.answer_command(robot, port, message, command);
                }
            }
            (Err(error), _) => {
                self.begin(port, "");
                let (rule, letters) = match &error {
                    CommandError::Unknown { letters } => (&rules::UNKNOWN_COMMAND, letters.clone()),
                    CommandError::Malformed { letters, .. } => {
                        (&rules::MALFORMED_COMMAND, (*letters).to_string())
                    }
                };
                robot.report(rule, port, message, error.to_string());
                self.check_repeat(robot, port, message, true);
                self.refuse_text(robot, port, &letters, &error.to_string());
            }
        }
    }

    /// What is answered from now on: a command, or with no letters a text that is none.
    pub(crate) fn begin(&mut self, port: Port, letters: Letters) {
        let session = self.session(port);
        (session.asked, session.block) = (letters, 0);
    }

    /// NG: whatever exchange was open is over.
    pub(crate) fn refuse_text(&mut self, robot: &mut Robot, port: Port, command: &str, reason: &str) {
        let session = self.session(port);
        session.set_exchange(Exchange::Idle);
        session.joiner.reset();
        robot.outputs.event(Event::Refused {
            port,
            command: command.to_string(),
            reason: reason.to_string(),
        });
        self.send_text(robot, port, &Reply::Ng.encode());
    }
}
