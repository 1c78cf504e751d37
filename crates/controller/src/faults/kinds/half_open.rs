//! Fault `half-open`: the connection stalls although it stays open, then it is reset.
//!
//! The controller neither reads nor writes on the port while it is stalled.

use super::super::kind::{Effect, FaultKind};
use super::{OUTGOING, millis};
use crate::endpoint::send_queue::{Departure, Segment};
use crate::output::DisconnectMode;
use core::time::Duration;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "half-open",
    summary: "From this text on nothing is read or written on the connection, which stays open; then it is reset.",
    remedy: "Give every answer a time limit; when it passes close the connection, connect again until the robot \
             serves, and ask for the status.",
    parameters: &[millis(
        "lasts",
        "5000",
        "until the robot gives the connection up and takes another one",
    )],
    points: OUTGOING,
    apply: |_, values, site| {
        let lasts = values.millis("lasts");
        let message = alloc::format!(
            "{} and all that follows is lost for {} ms; the connection stays open",
            site.description(),
            lasts.as_millis()
        );
        let stall = Segment::after(Duration::ZERO, Departure::Stall);
        let disconnect = Segment::after(lasts, Departure::Disconnect(DisconnectMode::Reset));
        (Effect::ReplaceOutput([stall, disconnect].into()), message)
    },
    ..FaultKind::DEFAULT
};
