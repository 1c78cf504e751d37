//! Fault `split-bytes`: a text is sent in small portions with pauses.
//!
//! Each portion is one write, which is usually one TCP segment.

use crate::faults::kind::{FaultKind, OUTGOING, ReplyArrival, millis, number, sends};
use crate::limits::MAX_SEND;
use crate::segment::{Departure, Segment};
use core::time::Duration;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "split-bytes",
    summary: "Sends a text in portions, with a pause before each.",
    remedy: "It reads until ETX (SF: until its length), however many reads that takes.",
    parameters: &[
        number("size", "bytes", (1, MAX_SEND as u64))
            .or("1")
            .help("bytes of a portion"),
        millis("pause", "20").help("the pause before each portion but the first"),
    ],
    points: OUTGOING,
    apply: |_, values, site| {
        let size = values.bytes("size").unwrap_or(1).max(1);
        let pause = values.millis("pause");
        let segments = site.bytes.chunks(size).enumerate().map(|(index, portion)| {
            let after = if index == 0 { Duration::ZERO } else { pause };
            Segment::after(after, Departure::Bytes(site.bytes.slice_ref(portion)))
        });
        sends(segments, format!("{site} leaves in portions of {size} bytes"))
    },
    reply: ReplyArrival::Delayed,
    ..FaultKind::DEFAULT
};
