//! The serial ports HOST and COM1 with the settings of \[U06\] (SER-01, SER-02): received bytes pass the line one character at
//! a time, garbled where the settings of both ends differ, lost where HOST is half-duplex (2.2.2).
//!
//! The line itself is `serial_line`. `controller::texts` gets the characters that passed. Ethernet does not pass here.

use crate::context::Context;
use crate::endpoint::Endpoints;
use crate::finding::rules;
use crate::limits::{DEPARTED_LINE_TIME, LINE_QUEUE, MAX_LINE_OUTPUT};
use crate::options::{BadCharacter, WhileSending};
use crate::output::Output;
use crate::port::Port;
use crate::port_facts::PortFacts;
use crate::prelude::*;
use crate::serial_line::direction::{Arrival, Direction, receive_unpaced};
use crate::serial_line::uart::{Character, CharacterError};
use crate::serial_line::{DepartedPeer, HostEnd, SerialLine, describe};
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::parameter::SerialSettings;

/// Bytes off a line, and when the last of them had passed.
pub(crate) type LineBytes = (Bytes, Time);

impl Endpoints {
    /// How many bytes a serial line takes now without losing any: an edge that reads no more than this from its
    /// host loses nothing. `None` for the Ethernet channels.
    pub fn line_room(&self, port: Port) -> Option<usize> {
        let line = self.lines.get(&port)?;
        Some(LINE_QUEUE.saturating_sub(line.inbound.queued()))
    }

    /// The line of a serial port, with the robot's settings of it.
    fn line(&mut self, port: Port) -> Option<(SerialSettings, &mut SerialLine)> {
        Some((*self.settings.get(&port)?, self.lines.get_mut(&port)?))
    }

    /// Takes over the known settings of the far end of a serial line.
    pub(crate) fn line_opened(&mut self, port: Port, host: HostEnd) {
        if let Some(line) = self.lines.get_mut(&port) {
            line.host = host;
        }
    }

    /// When the lines have something to hand over.
    pub(crate) fn line_deadline(&self) -> Option<Time> {
        let due = |(port, line): (&Port, &SerialLine)| line.deadline(*self.settings.get(port)?);
        let busy = self.lines.iter().filter(|(_, line)| line.is_busy());
        busy.filter_map(due).min()
    }

    /// Whether the robot has to keep silent because a character of the host is under way.
    pub(crate) fn line_is_taken(&self, context: &Context, port: Port) -> bool {
        self.is_half_duplex(context, port) && self.lines.get(&port).is_some_and(|line| line.inbound.is_busy())
    }

    fn is_half_duplex(&self, context: &Context, port: Port) -> bool {
        // 2.2.2 calls HOST half-duplex; COM1 is full-duplex (SER-01).
        port == Port::Host && context.config.options.while_sending == WhileSending::Lost
    }

    /// Takes bytes that a peer has put on a serial line. Returns those that have passed at once.
    pub(crate) fn take_from_host(
        &mut self,
        context: &mut Context,
        port: Port,
        bytes: Bytes,
    ) -> Option<LineBytes> {
        let now = context.now;
        let (own, line) = self.line(port)?;
        let Some(far) = line.host_settings(own) else {
            // A real cable has taken its time and made its errors already: modelling them again would count both
            // twice.
            return Some(self.take_from_device(context, port, bytes));
        };
        self.compare_settings(context, port, own);
        if context.config.options.serial_pacing {
            self.push_inbound(context, port, &bytes, far);
            return None;
        }
        let read = receive_unpaced(&bytes, far, own).into_iter();
        let arrivals = read.map(|character| Arrival::new(character, now, now));
        self.receive(context, port, arrivals.collect())
    }

    fn push_inbound(&mut self, context: &mut Context, port: Port, bytes: &[u8], far: SerialSettings) {
        let now = context.now;
        let room = self.line_room(port).unwrap_or(0);
        let (taken, rest) = bytes.split_at(room.min(bytes.len()));
        if let Some(line) = self.lines.get_mut(&port) {
            line.inbound.push(now, taken, far);
        }
        if !rest.is_empty() {
            let message = format!(
                "{} bytes lost: {LINE_QUEUE} are on the line already; send them later",
                rest.len()
            );
            context.report(&rules::LINE_OVERFLOW, port, &[], message);
        }
    }

    /// Sends the characters that have passed by now to the hosts.
    pub(crate) fn send_from_lines(&mut self, context: &mut Context) {
        let now = context.now;
        for port in Port::SERIAL {
            if let Some((own, line)) = self.line(port)
                && line.outbound.is_busy()
            {
                // If the far end became a real cable meanwhile, the rest arrives undamaged.
                let far = line.host_settings(own).unwrap_or(own);
                let read = line.outbound.take(now, far);
                send_read(context, port, read.into_iter().map(|arrival| arrival.character));
            }
        }
    }

    /// The characters that have passed by now from a host, and whether they were the last of one that has left.
    pub(crate) fn take_passed(&mut self, context: &mut Context, port: Port) -> (Option<LineBytes>, bool) {
        let now = context.now;
        let Some((own, line)) = self.line(port) else {
            return (None, false);
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
        (self.receive(context, port, arrivals), gone)
    }

    /// Resets a serial line whose host is gone. Bytes that the host has put on the line stay there.
    pub(super) fn reset_line(&mut self, port: Port) {
        if let Some(line) = self.lines.get_mut(&port) {
            let inbound = core::mem::take(&mut line.inbound);
            *line = SerialLine {
                inbound,
                ..SerialLine::default()
            };
        }
    }

    /// Has a peer that leaves stay until the last byte that it has put on a serial line has passed; false if there is none.
    pub(crate) fn leaves_later(&mut self, port: Port) -> bool {
        let Some(line) = self.lines.get_mut(&port).filter(|line| line.inbound.queued() > 0) else {
            return false;
        };
        // The rest of an answer is for the peer that is gone: the next one must not hear it.
        line.outbound = Direction::default();
        line.sending = None;
        line.departed_peer = Some(DepartedPeer {
            bytes_left: line.inbound.queued(),
            next_peer: None,
            next_sp: None,
        });
        true
    }

    /// Lets a peer that comes wait until the one before it has left; false if there is none. Its bytes are given up when
    /// they take too long.
    pub(crate) fn comes_later(&mut self, context: &mut Context, port: Port, peer: &str) -> bool {
        let Some(line) = self.lines.get_mut(&port) else {
            return false;
        };
        let Some(leaving) = &mut line.departed_peer else {
            return false;
        };
        leaving.next_peer = Some(peer.to_string());
        leaving.next_sp = None;
        if line.inbound.drained_to_at(0) > context.now + DEPARTED_LINE_TIME {
            let queued = line.inbound.queued();
            self.purge_line(context, port);
            let left = self.lines.get(&port).map_or(0, |line| line.inbound.queued());
            let reason = "its host has gone, and the next one is there";
            context.dropped(port, queued - left, reason);
        }
        true
    }

    /// The line whose host has just left, in its previous state.
    pub(crate) fn end_leaving(&mut self, port: Port) -> Option<SerialLine> {
        let line = self.lines.get_mut(&port)?;
        let before = line.clone();
        line.departed_peer = None;
        Some(before)
    }

    /// The line stays for the next host: it gets the bytes that a program has printed meanwhile.
    pub(crate) fn take_over_line(&mut self, port: Port, before: SerialLine) {
        if let Some(line) = self.lines.get_mut(&port) {
            *line = SerialLine {
                departed_peer: None,
                reported_mismatch: None,
                ..before
            };
        }
    }

    /// The bytes of the characters that have passed, with the moment of the last.
    fn receive(
        &mut self,
        context: &mut Context,
        port: Port,
        mut arrivals: Vec<Arrival>,
    ) -> Option<LineBytes> {
        if arrivals.is_empty() {
            return None;
        }
        let half_duplex = self.is_half_duplex(context, port);
        let keeps = context.config.options.bad_character == BadCharacter::Keep;
        let (mut received, mut received_at, mut bad, mut lost) = (Vec::new(), None, Vec::new(), 0);
        let bytes: Vec<u8> = arrivals.iter().map(|arrival| arrival.character.byte).collect();
        if let Some(place) = self.parity_error(context, port, &bytes)
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
                    received.push(arrival.character.byte);
                    // A lost or bad character does not restart the 10 s between characters (SER-06).
                    received_at = Some(arrival.end);
                }
            }
        }
        for reason in ["parity error", "framing error"] {
            let bytes = bad.iter().filter(|found| **found == reason).count();
            if bytes > 0 {
                context.dropped(port, bytes, reason);
            }
        }
        if lost > 0 {
            self.lost_while_sending(context, port, lost);
        }
        Some((received.into(), received_at?))
    }

    /// Bytes off a real line, whose port has found no error; a parity error on purpose drops a character all the same.
    fn take_from_device(&mut self, context: &mut Context, port: Port, mut bytes: Bytes) -> LineBytes {
        let keeps = context.config.options.bad_character == BadCharacter::Keep;
        if let Some(place) = self.parity_error(context, port, &bytes)
            && !keeps
        {
            let mut rest = bytes.to_vec();
            rest.remove(place);
            bytes = rest.into();
            let reason = CharacterError::Parity.description();
            context.dropped(port, 1, reason);
        }
        (bytes, context.now)
    }

    fn lost_while_sending(&mut self, context: &mut Context, port: Port, bytes: usize) {
        context.dropped(port, bytes, "the robot was sending");
        let message = format!(
            "{port} is half-duplex (2.2.2): what the host sends while the robot sends is lost; read the answer to its \
             ETX first"
        );
        context.report(&rules::HALF_DUPLEX, port, &[], message);
        if let Some(cause) = context.fault_effects.cause_of(&rules::HALF_DUPLEX, Some(port)) {
            context.fault_effects.input_lost(port, cause);
        }
    }

    /// Drops the bytes that the host's port has not put on the line yet.
    pub(crate) fn purge_line(&mut self, context: &mut Context, port: Port) {
        let now = context.now;
        if let Some(line) = self.lines.get_mut(&port) {
            line.inbound.purge(now);
            // What comes later is not the departed peer's.
            let queued = line.inbound.queued();
            if let Some(leaving) = &mut line.departed_peer {
                leaving.bytes_left = leaving.bytes_left.min(queued);
            }
        }
    }

    /// Characters came with a parity or framing error that the line itself brought. Returns those that reach the port.
    pub(crate) fn line_faults(
        &mut self,
        context: &mut Context,
        port: Port,
        bytes: Bytes,
    ) -> Option<LineBytes> {
        let own = self.settings.get(&port).copied()?;
        let message = format!(
            "characters arrive with parity or framing errors: set the host's port to {} as in [U06], and check the cable",
            describe(own)
        );
        context.report(&rules::LINE_GARBLED, port, &bytes, message);
        match context.config.options.bad_character {
            BadCharacter::Keep => Some((bytes, context.now)),
            BadCharacter::Drop => {
                context.dropped(port, bytes.len(), "parity or framing error");
                None
            }
        }
    }

    /// Puts bytes onto the serial line of a port. Returns when the last of them is out.
    pub(super) fn put_on_line(&mut self, context: &mut Context, port: Port, bytes: Bytes) -> Time {
        let now = context.now;
        let Some((own, line)) = self.line(port) else {
            return now;
        };
        let Some(far) = line.host_settings(own) else {
            context.outputs.push(Output::Send { port, bytes });
            return now;
        };
        if line.departed_peer.is_some() && port.protocol().is_some() {
            // The host that asked has gone, and the next one asked for nothing.
            return now;
        }
        self.compare_settings(context, port, own);
        if !context.config.options.serial_pacing {
            let read = receive_unpaced(&bytes, own, far);
            send_read(context, port, read);
            return now;
        }
        let Some(line) = self.lines.get_mut(&port) else {
            return now;
        };
        // PRINT has waited for room (`line_free_at`); an answer cannot wait. Only a host that asks on and on fills
        // the buffer.
        if line.outbound.queued() > 0 && line.outbound.queued() + bytes.len() > MAX_LINE_OUTPUT {
            let reason = "the robot has more to send than its buffer holds";
            context.dropped(port, bytes.len(), reason);
            return now;
        }
        let (begin, end) = line.outbound.push(now, &bytes, own);
        line.note_sending(begin, end);
        end
    }

    /// Says so once when bytes go over a line whose two ends do not agree.
    fn compare_settings(&mut self, context: &mut Context, port: Port, own: SerialSettings) {
        if let Some(line) = self.lines.get_mut(&port)
            && let HostEnd::Modelled(host) = line.host
            && line.reported_mismatch != Some(host)
            && let Some(message) = host.difference(port.name(), own)
        {
            line.reported_mismatch = Some(host);
            context.report(&rules::LINE_SETTINGS, port, &[], message);
        }
    }
}

impl PortFacts for Endpoints {
    fn line_free_at(&self, port: Port, bytes: usize) -> Option<Time> {
        let outbound = &self.lines.get(&port)?.outbound;
        let most = MAX_LINE_OUTPUT.saturating_sub(bytes);
        (outbound.queued() > most).then(|| outbound.drained_to_at(most))
    }
}

/// Sends the characters that the host's end has read.
fn send_read(context: &mut Context, port: Port, read: impl IntoIterator<Item = Character>) {
    let bytes: Bytes = read.into_iter().map(|character| character.byte).collect();
    if !bytes.is_empty() {
        context.outputs.push(Output::Send { port, bytes });
    }
}
