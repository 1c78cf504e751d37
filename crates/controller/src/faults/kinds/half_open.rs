//! Half-open: the other side is gone and the connection does not know.

use super::super::kind::{Applied, Departure, Effect, Kind, Segment};
use super::{OUT, millis};
use crate::output::DisconnectMode;
use core::time::Duration;

/// The kind.
pub const KIND: Kind = Kind {
    name: "half-open",
    what: "From this text on nothing is read or written on the connection, which stays open; then it is reset.",
    remedy: "Give every answer a time limit; when it passes close the connection, connect again until the robot \
             serves, and ask for the status.",
    parameters: &[millis(
        "lasts",
        "5000",
        "until the robot gives the connection up and takes another one",
    )],
    points: OUT,
    act: |_, values, prey| {
        let lasts = values.millis("lasts");
        let words = alloc::format!(
            "{} and all that follows is lost for {} ms; the connection stays open",
            prey.words(),
            lasts.as_millis()
        );
        let deaf = Segment::after(Duration::ZERO, Departure::Deaf);
        let cut = Segment::after(lasts, Departure::Cut(DisconnectMode::Reset));
        Applied::new(Effect::Sent([deaf, cut].into()), words)
    },
    ..Kind::PLAIN
};
