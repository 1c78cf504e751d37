//! Fault `late-reply`: the answer is sent after a delay.
//!
//! The default delay is longer than the time-out of most hosts.

use super::super::kind::{Effect, FaultKind};
use super::{OUTGOING, millis};
use crate::endpoint::send_queue::{Departure, Segment};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "late-reply",
    summary: "The text leaves so much later.",
    remedy: "Have a longer time limit than the delay, or drop what comes late before the command is sent again.",
    parameters: &[millis("delay", "6000", "how late it leaves")],
    points: OUTGOING,
    apply: |_, values, site| {
        let delay = values.millis("delay");
        let segment = Segment::after(delay, Departure::Bytes(site.bytes.clone()));
        let message = alloc::format!("{} leaves {} ms late", site.description(), delay.as_millis());
        (Effect::ReplaceOutput([segment].into()), message)
    },
    ..FaultKind::DEFAULT
};
