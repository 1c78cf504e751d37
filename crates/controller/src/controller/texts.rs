//! Incoming bytes up to their requests to the robot: texts are served one after the other, and the effects of each run
//! before the next of the same segment is read.

use crate::controller::Controller;
use crate::endpoint::exchange::PortEvent;
use crate::endpoint::serial_lines::LineBytes;
use crate::finding::rules;
use crate::port::Port;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::text::{CR, Decoded, Text};

impl Controller {
    /// Takes bytes of a peer, the last of which came at `at`. Returns whether the robot has run since as far as it goes at this
    /// instant.
    pub(super) fn received(&mut self, port: Port, at: Time, bytes: &Bytes) -> bool {
        let came = self.endpoints.received(&mut self.robot.context, port, at, bytes);
        self.perform_fired();
        let Some(came) = came else {
            return false;
        };
        if port.protocol().is_some() {
            let settled = self.read_texts(port, true);
            if !self.endpoints.session(port).is_partial() {
                self.robot.context.fault_effects.input_read(port);
            }
            return settled;
        }
        if port == Port::Ip3 {
            let message = format!("{} bytes for {port} are discarded", bytes.len());
            self.robot
                .context
                .report(&rules::DATA_TO_IP3, port, bytes, message);
        } else {
            self.received_data(port, &came);
        }
        false
    }

    /// Data for INPUT: bytes that do not fit now may fit when a waiting INPUT has taken its values (SER-03).
    fn received_data(&mut self, port: Port, bytes: &[u8]) {
        let mut rest = bytes;
        if bytes.is_empty() {
            return;
        }
        self.robot.check_data(port, bytes);
        if bytes.contains(&CR) {
            self.robot.context.fault_effects.next_record(port);
        }
        while !rest.is_empty() {
            let Some(channel) = self.robot.channels.get_mut(port) else {
                return;
            };
            let taken = channel.push(rest);
            rest = rest.get(taken..).unwrap_or_default();
            let before = channel.len();
            self.settle();
            let channel = self.robot.channels.get(port);
            let drained = channel.is_some_and(|channel| channel.len() < before);
            if !rest.is_empty() && !drained {
                let (lost, full) = (rest.len(), "is full (256 bytes); send after the program asks");
                let message = format!("{lost} bytes lost: the ring buffer of {port} {full}");
                self.robot
                    .context
                    .report(&rules::INPUT_OVERFLOW, port, rest, message);
                return;
            }
        }
    }

    /// Serves the complete texts; `first`: none of their segment was served before. Returns whether the robot has run since as
    /// far as it goes at this instant.
    pub(super) fn read_texts(&mut self, port: Port, mut first: bool) -> bool {
        let mut settled = false;
        while !self.robot.persistence.is_waiting()
            && let Some(decoded) = self.endpoints.session(port).next_text()
        {
            // Before the first text of a segment an SP may still wait for a pause; between two of them there is none.
            if !core::mem::take(&mut first) {
                self.endpoints.release_overdue_sp(&mut self.robot.context, port);
            }
            match decoded {
                Decoded::Skipped { bytes } => {
                    let context = &mut self.robot.context;
                    context.dropped(port, bytes, "outside a text");
                    let message = format!("{bytes} bytes that belong to no text are skipped");
                    context.report(&rules::BYTES_OUTSIDE, port, &[], message);
                }
                Decoded::Text(text) => self.serve(port, text),
            }
            // What the text started runs before the next text of the same segment is looked at.
            self.settle();
            settled = true;
        }
        if settled {
            // What was left over may have become a text that only a CR ends: it is due earlier than it was before.
            self.find_due();
        }
        settled
    }

    /// Ports on which the host was silent for too long.
    pub(super) fn expire_sessions(&mut self) {
        for port in [Port::Host, Port::Ip0] {
            let stands_still = self.robot.persistence.is_waiting();
            let text = self.endpoints.expire(&mut self.robot.context, port, stands_still);
            if let Some(text) = text {
                self.serve(port, text);
                self.settle();
            }
        }
    }

    /// Serves a text. A fault that fires at it acts on the machine first: its command meets the changed machine.
    fn serve(&mut self, port: Port, text: Text) {
        // Any text counts, a broken one too: WD asks whether the host is alive (S11).
        self.robot.panel.feed_watchdog(self.robot.context.now);
        let event = self.endpoints.text(&mut self.robot.context, port, text);
        self.perform_fired();
        match event {
            Some(PortEvent::Command { message, command }) => self.answer_command(port, message, command),
            Some(PortEvent::Block(data)) => {
                let file = self.endpoints.take_block(&mut self.robot.context, port, &data);
                if let Some((name, content)) = file {
                    self.end_download(port, &name, content, &data);
                }
            }
            None => {}
        }
    }

    /// Passes on the bytes that a serial line has brought.
    pub(super) fn received_from_line(&mut self, port: Port, received: Option<LineBytes>) {
        if let Some((bytes, at)) = received {
            self.received(port, at, &bytes);
        }
    }

    /// Receives the characters that have passed the serial lines by now from the hosts.
    pub(super) fn receive_from_lines(&mut self) {
        for port in Port::SERIAL {
            let (received, gone) = self.endpoints.take_passed(&mut self.robot.context, port);
            self.received_from_line(port, received);
            // A change that its last text has asked for comes first.
            if gone && !self.robot.persistence.is_waiting() {
                self.replace_peer(port);
            }
        }
    }
}
