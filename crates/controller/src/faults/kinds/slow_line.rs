//! Fault `slow-line`: a text is sent byte by byte at a low bit rate.
//!
//! Each byte is one segment of the send queue.

use crate::faults::kind::{FaultKind, OUTGOING, ReplyArrival, number, sends};
use crate::segment::{Departure, Segment};
use bytes::Bytes;
use core::time::Duration;

/// Bits a byte takes on the line: start bit, eight data bits, stop bit.
const BITS: u64 = 10;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "slow-line",
    summary: "Sends a text byte by byte, as a line of `speed` would.",
    remedy: "Its time limit counts from the last byte received, as the robot's does (10 s), not from the \
             command.",
    parameters: &[number("speed", "bit/s", (1, 115_200))
        .or("50")
        .help("speed of the line")],
    points: OUTGOING,
    apply: |_, values, site| {
        let speed = values.number("speed").unwrap_or(1).max(1);
        let pace = Duration::from_micros(BITS * 1_000_000 / speed);
        let bytes = site.bytes.iter();
        let segments =
            bytes.map(|byte| Segment::after(pace, Departure::Bytes(Bytes::copy_from_slice(&[*byte]))));
        sends(segments, format!("{site} leaves at {speed} bit/s"))
    },
    reply: ReplyArrival::Delayed,
    ..FaultKind::DEFAULT
};
