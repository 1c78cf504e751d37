//! Fault `half-open`: the connection stalls although it stays open, then it is reset.
//!
//! The controller neither reads nor writes on the port while it is stalled.

use crate::faults::kind::{FaultKind, OUTGOING, millis, sends};
use crate::output::DisconnectMode;
use crate::segment::{Departure, Segment};
use core::time::Duration;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "half-open",
    summary: "Stops reading and writing on a connection without closing it, and resets it later.",
    remedy: "It has a time limit for every reply. After it, it closes the connection, connects again \
             until the robot answers, and reads the status.",
    parameters: &[
        millis("lasts", "5000").help("time until the robot resets the connection and accepts another one")
    ],
    points: OUTGOING,
    apply: |_, values, site| {
        let lasts = values.millis("lasts");
        let message = format!(
            "{site} and everything after it is lost for {} ms; the connection stays open",
            lasts.as_millis()
        );
        let stall = Segment::after(Duration::ZERO, Departure::Stall);
        let disconnect = Segment::after(lasts, Departure::Disconnect(DisconnectMode::Reset));
        sends([stall, disconnect], message)
    },
    ..FaultKind::DEFAULT
};
