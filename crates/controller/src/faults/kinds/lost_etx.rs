//! Fault `lost-etx`: a text is sent without its ETX.
//!
//! Only the last ETX is removed; a checksum that follows it is still sent.

use crate::faults::kind::{FaultKind, InjectionPoint, sends};
use crate::segment::Segment;
use ts3100_proto::text::ETX;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "lost-etx",
    summary: "Sends a text without its ETX.",
    remedy: "It drops a text that does not end in time, and sends the command again.",
    points: &[InjectionPoint::Reply],
    apply: |_, _, site| {
        let mut bytes = site.bytes.to_vec();
        if let Some(end) = bytes.iter().rposition(|byte| *byte == ETX) {
            bytes.remove(end);
        }
        sends([Segment::bytes(bytes)], format!("{site} leaves without ETX"))
    },
    ..FaultKind::DEFAULT
};
