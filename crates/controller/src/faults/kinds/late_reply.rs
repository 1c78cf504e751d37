//! Fault `late-reply`: the answer is sent after a delay.
//!
//! The default delay is longer than the time-out of most hosts.

use crate::faults::kind::{FaultKind, OUTGOING, ReplyArrival, millis, sends};
use crate::segment::{Departure, Segment};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "late-reply",
    summary: "Delays a text by `delay`.",
    remedy: "Its time limit is longer than the delay, or it drops a late reply before it sends the \
             command again.",
    parameters: &[millis("delay", "6000").help("delay of the text")],
    points: OUTGOING,
    apply: |_, values, site| {
        let delay = values.millis("delay");
        let segment = Segment::after(delay, Departure::Bytes(site.bytes.clone()));
        sends([segment], format!("{site} leaves {} ms late", delay.as_millis()))
    },
    reply: ReplyArrival::Delayed,
    ..FaultKind::DEFAULT
};
