//! Segments: the parts that a fault or a variation sends instead of a text, each after a pause of its own.
//!
//! `endpoint::send_queue` keeps them until they are due.

use crate::output::DisconnectMode;
use bytes::Bytes;
use core::time::Duration;

/// One part of the bytes that leave instead of a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Pause after the previous part.
    pub delay: Duration,
    pub departure: Departure,
}

/// Something that happens at the sending side of a port.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Departure {
    /// These bytes are sent in one write.
    Bytes(#[serde(with = "ts3100_proto::serde_latin1")] Bytes),
    /// These bytes are sent in one write with the next ones, or alone at the end of their pause.
    Held(#[serde(with = "ts3100_proto::serde_latin1")] Bytes),
    /// The connection ends.
    Disconnect(DisconnectMode),
    /// From now on nothing is read or written, until the connection ends.
    Stall,
}

impl Departure {
    /// Number of bytes it sends.
    pub fn length(&self) -> usize {
        match self {
            Departure::Bytes(bytes) | Departure::Held(bytes) => bytes.len(),
            Departure::Disconnect(_) | Departure::Stall => 0,
        }
    }
}

impl Segment {
    /// Bytes that are sent without a pause.
    pub fn bytes(bytes: impl Into<Bytes>) -> Segment {
        Segment::after(Duration::ZERO, Departure::Bytes(bytes.into()))
    }

    /// Something that happens after a pause.
    pub fn after(delay: Duration, departure: Departure) -> Segment {
        Segment { delay, departure }
    }
}
