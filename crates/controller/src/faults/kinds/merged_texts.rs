//! Merged texts: two texts in one segment.

use super::super::kind::{Applied, Departure, Effect, Kind, Segment};
use super::{OUT, millis};

/// The kind.
pub const KIND: Kind = Kind {
    name: "merged-texts",
    what: "A text waits for the next one of its port, and both leave in one write; alone when its time is over.",
    remedy: "Cut what was read at each ETX (on channels at each CR) and keep what is behind it.",
    parameters: &[millis("hold", "1000", "how long it waits at most")],
    points: OUT,
    act: |_, values, prey| {
        let held = Segment::after(values.millis("hold"), Departure::Held(prey.bytes.to_vec()));
        let words = alloc::format!("{} waits for what is sent next", prey.words());
        Applied::new(Effect::Sent([held].into()), words)
    },
    ..Kind::PLAIN
};
