//! Transcripts as pcapng for Wireshark: the Ethernet channels as TCP in synthetic frames, so that Wireshark reassembles
//! texts as in a real capture; each serial port and the panel as an interface of its own.
//!
//! Blocks are written here, frames in `frame`. The dissector `packaging/wireshark/ts3100.lua` decodes the bytes.

mod frame;
#[cfg(test)]
mod tests;

use super::{EndReason, Header, LinkRecord, PeerId, Record, RecordKind, Side, Writer};
use frame::{ACK, FIN, Flow, MSS, PSH, RST, SYN};
use std::collections::BTreeMap;
use std::time::Duration;
use ts3100_controller::Port;

/// Frames of the Ethernet channels.
const LINKTYPE_ETHERNET: u16 = 1;
/// Bytes of a serial port, without any header (Wireshark: USER0).
const LINKTYPE_SERIAL: u16 = 147;
/// Words of an action at the controller (Wireshark: USER1).
const LINKTYPE_PANEL: u16 = 148;
/// The interfaces in the order of their blocks: link type, name, description.
const INTERFACES: [(u16, &str, &str); 4] = [
    (
        LINKTYPE_ETHERNET,
        "IP0-IP3",
        "Ethernet channels; addresses and frames are synthetic",
    ),
    (LINKTYPE_SERIAL, "HOST", "serial port HOST"),
    (LINKTYPE_SERIAL, "COM1", "serial port COM1"),
    (LINKTYPE_PANEL, "PANEL", "actions at the controller itself"),
];
const ETHERNET: u32 = 0;
const HOST: u32 = 1;
const COM1: u32 = 2;
const PANEL: u32 = 3;

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const BYTE_ORDER: u32 = 0x1A2B_3C4D;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;
const OPT_COMMENT: u16 = 1;
const SHB_USERAPPL: u16 = 4;
const IF_NAME: u16 = 2;
const IF_DESCRIPTION: u16 = 3;
const IF_TSRESOL: u16 = 9;
const EPB_FLAGS: u16 = 2;
const INBOUND: u32 = 1;
const OUTBOUND: u32 = 2;
/// Times are in microseconds.
const MICROSECONDS: u8 = 6;
/// Longest piece of a serial line in one packet.
const MAX_SERIAL: usize = 65_535;

/// When a side of a connection sends.
type Sent = (Duration, PeerId, Side);

/// Writes a capture block by block.
#[derive(Debug, Clone, Default)]
pub(super) struct CaptureWriter {
    /// Added to all times.
    base: Duration,
    flows: BTreeMap<PeerId, Flow>,
    /// Connections so far.
    connections: u16,
    /// Frames so far, for the identification of IP.
    frames: u16,
}

impl CaptureWriter {
    /// The time of the first moment of the transcript since 1970 is `base`; zero for virtual time.
    pub(super) fn new(base: Duration) -> CaptureWriter {
        CaptureWriter {
            base,
            ..CaptureWriter::default()
        }
    }
}

impl Writer for CaptureWriter {
    /// The blocks in front of the first packet.
    fn header(&mut self, header: &Header, out: &mut Vec<u8>) {
        let mut section = Vec::new();
        section.extend(BYTE_ORDER.to_le_bytes());
        section.extend(1_u16.to_le_bytes());
        section.extend(0_u16.to_le_bytes());
        // A section of a length nobody knows yet.
        section.extend(u64::MAX.to_le_bytes());
        option(&mut section, SHB_USERAPPL, header.origin.as_bytes());
        let mut comment = header.flags.join(" ");
        if let Some(name) = &header.select {
            comment = format!("{comment} select={name}");
        }
        if !comment.trim().is_empty() {
            option(&mut section, OPT_COMMENT, comment.trim().as_bytes());
        }
        end_of_options(&mut section);
        block(out, SECTION_HEADER, &section);
        for (link, name, description) in INTERFACES {
            let mut body = Vec::new();
            body.extend(link.to_le_bytes());
            body.extend([0; 2]);
            body.extend(0_u32.to_le_bytes());
            option(&mut body, IF_NAME, name.as_bytes());
            option(&mut body, IF_DESCRIPTION, description.as_bytes());
            option(&mut body, IF_TSRESOL, &[MICROSECONDS]);
            end_of_options(&mut body);
            block(out, INTERFACE_DESCRIPTION, &body);
        }
    }

    /// The packets of a record.
    fn record(&mut self, record: &Record, out: &mut Vec<u8>) {
        let at = self.base + Duration::from_micros(record.at.as_micros());
        let (words, by) = match &record.kind {
            RecordKind::Connected { line, peer } => return self.connect(at, *line, peer, out),
            RecordKind::FromHost { line, bytes } => return self.send(at, *line, Side::Host, bytes, out),
            RecordKind::FromRobot { line, bytes } => return self.send(at, *line, Side::Robot, bytes, out),
            RecordKind::Ended { line, by, how } => return self.end(at, *line, *by, *how, out),
            RecordKind::Action(action) => (action.to_string(), Side::Host),
            // A capture is for reading; the state itself is in the other forms.
            RecordKind::Link(LinkRecord::Restored { at: moment, .. }) => {
                (format!("restore {}us", moment.as_micros()), Side::Host)
            }
            RecordKind::Link(LinkRecord::Begin { at: moment, .. }) => {
                (format!("begin {}us", moment.as_micros()), Side::Host)
            }
            RecordKind::Link(link) => (link.to_string(), Side::Host),
            RecordKind::Remark(words) => (format!("# {words}"), Side::Robot),
        };
        packet(out, PANEL, at, words.as_bytes(), by, "");
        if let Some(begins) = record.kind.new_time() {
            // Packets stay in the order of their times.
            self.base = at.saturating_sub(Duration::from_micros(begins.as_micros()));
        }
    }
}

impl CaptureWriter {
    /// The three steps of a connection.
    fn connect(&mut self, at: Duration, line: PeerId, peer: &str, out: &mut Vec<u8>) {
        if line.port.ethernet_index().is_none() {
            return;
        }
        self.flows.insert(line, Flow::new(line.port, self.connections));
        self.connections = self.connections.wrapping_add(1);
        let comment = match peer {
            "" => line.to_string(),
            peer => format!("{line}: {peer}"),
        };
        self.frame((at, line, Side::Host), SYN, &[], &comment, out);
        self.frame((at, line, Side::Robot), SYN | ACK, &[], "", out);
        self.frame((at, line, Side::Host), ACK, &[], "", out);
    }

    fn send(&mut self, at: Duration, line: PeerId, by: Side, bytes: &[u8], out: &mut Vec<u8>) {
        let interface = match line.port {
            Port::Host => HOST,
            Port::Com1 => COM1,
            Port::Ip0 | Port::Ip1 | Port::Ip2 | Port::Ip3 => {
                // A transcript may begin after a connection's beginning.
                if !self.flows.contains_key(&line) {
                    self.connect(at, line, "", out);
                }
                for segment in bytes.chunks(MSS) {
                    self.frame((at, line, by), PSH | ACK, segment, "", out);
                }
                return;
            }
        };
        for piece in bytes.chunks(MAX_SERIAL) {
            packet(out, interface, at, piece, by, "");
        }
    }

    fn end(&mut self, at: Duration, line: PeerId, by: Side, how: EndReason, out: &mut Vec<u8>) {
        if !self.flows.contains_key(&line) {
            return;
        }
        match how {
            EndReason::Closed => {
                self.frame((at, line, by), FIN | ACK, &[], "", out);
                self.frame((at, line, by.other()), ACK, &[], "", out);
            }
            EndReason::Reset | EndReason::Refused => {
                let is_refused = how == EndReason::Refused;
                let comment = if is_refused { "not reached" } else { "" };
                self.frame((at, line, by), RST | ACK, &[], comment, out);
                self.flows.remove(&line);
            }
        }
    }

    fn frame(&mut self, sent: Sent, flags: u8, data: &[u8], comment: &str, out: &mut Vec<u8>) {
        let (at, line, by) = sent;
        let Some(flow) = self.flows.get_mut(&line) else {
            return;
        };
        let bytes = flow.frame(by, flags, data, self.frames);
        self.frames = self.frames.wrapping_add(1);
        packet(out, ETHERNET, at, &bytes, by, comment);
    }
}

fn packet(out: &mut Vec<u8>, interface: u32, at: Duration, data: &[u8], by: Side, comment: &str) {
    let micros = u64::try_from(at.as_micros()).unwrap_or(u64::MAX);
    let length = u32::try_from(data.len()).unwrap_or(u32::MAX);
    let mut body = Vec::with_capacity(data.len() + 48);
    body.extend(interface.to_le_bytes());
    // The upper half of the time stands first.
    body.extend(micros.rotate_left(32).to_le_bytes());
    body.extend(length.to_le_bytes());
    body.extend(length.to_le_bytes());
    body.extend_from_slice(data);
    pad(&mut body);
    if !comment.is_empty() {
        option(&mut body, OPT_COMMENT, comment.as_bytes());
    }
    // Seen from the controller.
    let direction = match by {
        Side::Host => INBOUND,
        Side::Robot => OUTBOUND,
    };
    option(&mut body, EPB_FLAGS, &direction.to_le_bytes());
    end_of_options(&mut body);
    block(out, ENHANCED_PACKET, &body);
}

/// A block; `body` is a whole number of 32-bit words long.
fn block(out: &mut Vec<u8>, kind: u32, body: &[u8]) {
    let length = u32::try_from(body.len() + 12).unwrap_or(u32::MAX).to_le_bytes();
    out.extend(kind.to_le_bytes());
    out.extend(length);
    out.extend_from_slice(body);
    out.extend(length);
}

/// An option; what is longer than its length can say is cut.
fn option(body: &mut Vec<u8>, code: u16, value: &[u8]) {
    let length = u16::try_from(value.len()).unwrap_or(u16::MAX);
    body.extend(code.to_le_bytes());
    body.extend(length.to_le_bytes());
    body.extend_from_slice(value.get(..usize::from(length)).unwrap_or(value));
    pad(body);
}

fn end_of_options(body: &mut Vec<u8>) {
    body.extend([0; 4]);
}

fn pad(body: &mut Vec<u8>) {
    body.resize(body.len().next_multiple_of(4), 0);
}
