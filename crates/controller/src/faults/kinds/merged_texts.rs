//! Fault `merged-texts`: two texts are sent in one write.
//!
//! The send queue holds the first text until the next one is sent or its time has expired.

use crate::faults::kind::{FaultKind, OUTGOING, ReplyArrival, millis, sends};
use crate::segment::{Departure, Segment};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "merged-texts",
    summary: "Holds a text until the next one of its port, and sends both in one packet. After `hold` the \
             text is sent alone.",
    remedy: "It splits received bytes at each ETX (on channels at each CR) and keeps the rest.",
    parameters: &[millis("hold", "1000").help("longest wait")],
    points: OUTGOING,
    apply: |_, values, site| {
        let held = Segment::after(values.millis("hold"), Departure::Held(site.bytes.clone()));
        sends([held], format!("{site} waits for what is sent next"))
    },
    reply: ReplyArrival::Delayed,
    ..FaultKind::DEFAULT
};
