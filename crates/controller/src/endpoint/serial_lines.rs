//! The serial ports HOST and COM1 with the settings of \[U06\] (SER-01, SER-02): received bytes pass the line one character at
//! a time, garbled where the settings of both ends differ, lost where HOST is half-duplex (2.2.2).
//!
//! The line itself is `serial_line`. `exchange` gets the characters that passed. Ethernet does not pass here.

use crate::endpoint::Endpoints;
use crate::endpoint::serial_line::direction::{Arrival, receive_unpaced};
use crate::endpoint::serial_line::uart::{Character, CharacterError};
use crate::endpoint::serial_line::{DepartedPeer, HostEnd, SerialLine, describe};
use crate::findings::rules;
use crate::limits::{LINE_QUEUE, MAX_LINE_OUTPUT};
use crate::options::{BadCharacter, WhileSending};
use crate::output::Output;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::parameter::SerialSettings;

impl Endpoints {
    /// How many bytes a serial line takes now without losing any: an edge that reads no more than this from its
    /// host loses nothing. `None` for the Ethernet channels.
    pub fn line_room(&self, port: Port) -> Option<usize> {
        let line = self.lines.get(&port)?;
        Some(LINE_QUEUE.saturating_sub(line.inbound.queued()))
    }

    /// The line of a serial port, with the robot's settings of it.
    fn line(&mut self, robot: &Robot, port: Port) -> Option<(SerialSettings, &mut SerialLine)> {
        Some((robot.parameters.serial_line(port)?, self.lines.get_mut(&port)?))
    }

    /// What is known of the far end of a serial line.
    pub(crate) fn line_opened(&mut self, port: Port, host: HostEnd) {
        if let Some(line) = self.lines.get_mut(&port) {
            line.host = host;
        }
    }

    /// When the lines have something to hand over.
    pub(crate) fn line_deadline(&self, robot: &Robot) -> Option<Time> {
        let due = |(port, line): (&Port, &SerialLine)| line.deadline(robot.parameters.serial_line(*port)?);
        let busy = self.lines.iter().filter(|(_, line)| line.is_busy());
        busy.filter_map(due).min()
    }

    /// Whether the robot has to keep silent because a character of the host is under way.
    pub(crate) fn line_is_taken(&self, robot: &Robot, port: Port) -> bool {
        self.is_half_duplex(robot, port) && self.lines.get(&port).is_some_and(|line| line.inbound.is_busy())
    }

    fn is_half_duplex(&self, robot: &Robot, port: Port) -> bool {
        port == Port::Host && robot.config.options.while_sending == WhileSending::Lost
    }

    /// Bytes that a peer has put on a serial line.
    pub(crate) fn received_on_line(&mut self, robot: &mut Robot, port: Port, bytes: Bytes) {
        let now = robot.now;
        let Some((own, line)) = self.line(robot, port) else {
            return;
        };
        let Some(far) = line.host_settings(own) else {
            return self.received_from_device(robot, port, bytes);
        };
        self.compare_settings(robot, port, own);
        if robot.config.options.serial_pacing {
            return self.push_inbound(robot, port, &bytes, far);
        }
        let read = receive_unpaced(&bytes, far, own).into_iter();
        let arrivals = read.map(|character| Arrival::new(character, now, now));
        self.received_characters(robot, port, arrivals.collect());
    }

    fn push_inbound(&mut self, robot: &mut Robot, port: Port, bytes: &[u8], far: SerialSettings) {
        let now = robot.now;
        let room = self.line_room(port).unwrap_or(0);
        let (taken, rest) = bytes.split_at(room.min(bytes.len()));
        if let Some(line) = self.lines.get_mut(&port) {
            line.inbound.push(now, taken, far);
        }
        if !rest.is_empty() {
            let message = format!(
                "{} bytes lost: {LINE_QUEUE} are on the line already; ask for the room on it before sending",
                rest.len()
            );
            robot.report(&rules::LINE_OVERFLOW, port, &[], message);
        }
    }

    /// What has passed by now, in both directions.
    pub(crate) fn serve_lines(&mut self, robot: &mut Robot) {
        self.receive_from_lines(robot);
        let now = robot.now;
        for port in Port::SERIAL {
            if let Some((own, line)) = self.line(robot, port)
                && line.outbound.is_busy()
            {
                let far = line.host_settings(own).unwrap_or(own);
                let read = line.outbound.take(now, far);
                send_read(robot, port, read.into_iter().map(|arrival| arrival.character));
            }
        }
    }

    /// What has passed by now from the hosts.
    pub(crate) fn receive_from_lines(&mut self, robot: &mut Robot) {
        let now = robot.now;
        for port in Port::SERIAL {
            let Some((own, line)) = self.line(robot, port) else {
                continue;
            };
            let before = line.inbound.queued();
            let leaving = line.departed_peer.as_mut();
            let (arrivals, gone) = if let Some(DepartedPeer { bytes_left, .. }) = leaving {
                let arrivals = line.inbound.take_first(*bytes_left, now, own);
                *bytes_left -= before - line.inbound.queued();
                // Purged bytes never pass.
                (arrivals, *bytes_left == 0 || line.inbound.queued() == 0)
            } else {
                (line.inbound.take(now, own), false)
            };
            self.received_characters(robot, port, arrivals);
            // A change that its last text has asked for comes first.
            if gone && !robot.persistence.is_pending() {
                self.replace_peer(robot, port);
            }
        }
    }

    /// All that a former peer sent has passed: it is gone, and the next one is there.
    fn replace_peer(&mut self, robot: &mut Robot, port: Port) {
        let Some(line) = self.lines.get_mut(&port) else {
            return;
        };
        let before = line.clone();
        line.departed_peer = None;
        self.disconnected(robot, port);
        let Some(next) = before.departed_peer.and_then(|leaving| leaving.next_peer) else {
            return;
        };
        self.connected(robot, port, next);
        if let Some(line) = self.lines.get_mut(&port) {
            // What a program has printed meanwhile is the next one's.
            *line = SerialLine {
                departed_peer: None,
                reported_mismatch: None,
                ..before
            };
        }
        self.receive_from_lines(robot);
    }

    fn received_characters(&mut self, robot: &mut Robot, port: Port, mut arrivals: Vec<Arrival>) {
        if arrivals.is_empty() {
            return;
        }
        let half_duplex = self.is_half_duplex(robot, port);
        let keeps = robot.config.options.bad_character == BadCharacter::Keep;
        let (mut heard, mut heard_at, mut bad, mut lost) = (Vec::new(), None, Vec::new(), 0);
        let bytes: Vec<u8> = arrivals.iter().map(|arrival| arrival.character.byte).collect();
        if let Some(place) = self.parity_error(robot, port, &bytes)
            && let Some(arrival) = arrivals.get_mut(place)
        {
            arrival.character.fault = Some(CharacterError::Parity);
        }
        for arrival in arrivals {
            let overlaps = |line: &SerialLine| line.was_sending(arrival.begin, arrival.end);
            if half_duplex && self.lines.get(&port).is_some_and(overlaps) {
                lost += 1;
                continue;
            }
            match arrival.character.fault {
                Some(fault) if !keeps => bad.push(fault.description()),
                _ => {
                    heard.push(arrival.character.byte);
                    heard_at = Some(arrival.end);
                }
            }
        }
        for reason in ["parity error", "framing error"] {
            let bytes = bad.iter().filter(|found| **found == reason).count();
            if bytes > 0 {
                robot.dropped(port, bytes, reason);
            }
        }
        if lost > 0 {
            self.lost_while_sending(robot, port, lost);
        }
        if let Some(at) = heard_at {
            self.received(robot, port, at, &heard.into());
        }
    }

    /// Bytes off a real line, whose port has found no error; a parity error on purpose drops a character all the same.
    fn received_from_device(&mut self, robot: &mut Robot, port: Port, mut bytes: Bytes) {
        let keeps = robot.config.options.bad_character == BadCharacter::Keep;
        if let Some(place) = self.parity_error(robot, port, &bytes)
            && !keeps
        {
            let mut rest = bytes.to_vec();
            rest.remove(place);
            bytes = rest.into();
            let reason = CharacterError::Parity.description();
            robot.dropped(port, 1, reason);
        }
        self.received(robot, port, robot.now, &bytes);
    }

    fn lost_while_sending(&mut self, robot: &mut Robot, port: Port, bytes: usize) {
        robot.dropped(port, bytes, "the robot was sending");
        let message = format!(
            "{port} is half-duplex (2.2.2): what the host sends while the robot sends is lost; read the answer to its \
             ETX first"
        );
        robot.report(&rules::HALF_DUPLEX, port, &[], message);
    }

    /// The host's port forgets what it has not put on the line.
    pub(crate) fn purge_line(&mut self, robot: &mut Robot, port: Port) {
        let now = robot.now;
        if let Some(line) = self.lines.get_mut(&port) {
            line.inbound.purge(now);
            // What comes later is not the departed peer's.
            let queued = line.inbound.queued();
            if let Some(leaving) = &mut line.departed_peer {
                leaving.bytes_left = leaving.bytes_left.min(queued);
            }
        }
    }

    /// Characters came with a parity or framing error that the line itself brought.
    pub(crate) fn line_faults(&mut self, robot: &mut Robot, port: Port, bytes: &Bytes) {
        let Some(own) = robot.parameters.serial_line(port) else {
            return;
        };
        let message = format!(
            "characters come with parity or framing errors: the host's port is not set to {}, as [U06] says, or the \
             cable is disturbed",
            describe(own)
        );
        robot.report(&rules::LINE_GARBLED, port, bytes, message);
        match robot.config.options.bad_character {
            BadCharacter::Keep => {
                self.received(robot, port, robot.now, bytes);
            }
            BadCharacter::Drop => robot.dropped(port, bytes.len(), "parity or framing error"),
        }
    }

    /// Puts bytes onto the serial line of a port. Returns when the last of them is out.
    pub(super) fn put_on_line(&mut self, robot: &mut Robot, port: Port, bytes: Bytes) -> Time {
        let now = robot.now;
        let Some((own, line)) = self.line(robot, port) else {
            return now;
        };
        let Some(far) = line.host_settings(own) else {
            robot.outputs.push(Output::Send { port, bytes });
            return now;
        };
        if line.departed_peer.is_some() && port.protocol().is_some() {
            // Whoever asked is not there any more, and the next one did not.
            return now;
        }
        self.compare_settings(robot, port, own);
        if !robot.config.options.serial_pacing {
            let read = receive_unpaced(&bytes, own, far);
            send_read(robot, port, read);
            return now;
        }
        let Some(line) = self.lines.get_mut(&port) else {
            return now;
        };
        if line.outbound.queued() > 0 && line.outbound.queued() + bytes.len() > MAX_LINE_OUTPUT {
            let reason = "the robot has more to send than its buffer holds";
            robot.dropped(port, bytes.len(), reason);
            return now;
        }
        let (begin, end) = line.outbound.push(now, &bytes, own);
        line.note_sending(begin, end);
        end
    }

    /// When the robot's buffer of a line will have room for this many bytes more; `None` if it has.
    pub(crate) fn line_free_at(&self, port: Port, bytes: usize) -> Option<Time> {
        let outbound = &self.lines.get(&port)?.outbound;
        let most = MAX_LINE_OUTPUT.saturating_sub(bytes);
        (outbound.queued() > most && outbound.queued() > 0).then(|| outbound.drained_to_at(most))
    }

    /// Says so once when bytes go over a line whose two ends do not agree.
    fn compare_settings(&mut self, robot: &mut Robot, port: Port, own: SerialSettings) {
        if let Some(line) = self.lines.get_mut(&port)
            && let HostEnd::Modelled(host) = line.host
            && line.reported_mismatch != Some(host)
            && let Some(message) = host.difference(port.name(), own)
        {
            line.reported_mismatch = Some(host);
            robot.report(&rules::LINE_SETTINGS, port, &[], message);
        }
    }
}

/// What the host's end has read of the robot's characters is sent.
fn send_read(robot: &mut Robot, port: Port, read: impl IntoIterator<Item = Character>) {
    let bytes: Bytes = read.into_iter().map(|character| character.byte).collect();
    if !bytes.is_empty() {
        robot.outputs.push(Output::Send { port, bytes });
    }
}
