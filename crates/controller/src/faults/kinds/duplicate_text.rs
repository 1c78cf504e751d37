//! Fault `duplicate-text`: a text is sent twice.
//!
//! Both copies go through the send queue, so a text sent after them keeps its place.

use crate::faults::kind::{FaultKind, OUTGOING, ReplyArrival, millis, sends};
use crate::segment::{Departure, Segment};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "duplicate-text",
    summary: "Sends a text twice.",
    remedy: "It drops unexpected bytes before it sends a command, and compares each reply with its command.",
    parameters: &[millis("pause", "10").help("pause between the two")],
    points: OUTGOING,
    apply: |_, values, site| {
        let again = Segment::after(values.millis("pause"), Departure::Bytes(site.bytes.clone()));
        let twice = [Segment::bytes(site.bytes.clone()), again];
        sends(twice, format!("{site} leaves twice"))
    },
    reply: ReplyArrival::InTime,
    ..FaultKind::DEFAULT
};
