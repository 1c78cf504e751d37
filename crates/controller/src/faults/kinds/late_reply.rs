//! Late reply: the answer comes, but later than a host may wait.

use super::super::kind::{Applied, Departure, Effect, Kind, Segment};
use super::{OUT, millis};

/// The kind.
pub const KIND: Kind = Kind {
    name: "late-reply",
    what: "The text leaves so much later.",
    remedy: "Have a longer time limit than the delay, or drop what comes late before the command is sent again.",
    parameters: &[millis("delay", "6000", "how late it leaves")],
    points: OUT,
    act: |_, values, prey| {
        let delay = values.millis("delay");
        let parcel = Segment::after(delay, Departure::Bytes(prey.bytes.to_vec()));
        let words = alloc::format!("{} leaves {} ms late", prey.words(), delay.as_millis());
        Applied::new(Effect::Sent([parcel].into()), words)
    },
    ..Kind::PLAIN
};
