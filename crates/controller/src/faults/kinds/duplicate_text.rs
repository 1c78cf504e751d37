//! Duplicate text: the same text twice.

use super::super::kind::{Applied, Departure, Effect, Kind, Segment};
use super::{OUT, millis};

/// The kind.
pub const KIND: Kind = Kind {
    name: "duplicate-text",
    what: "What leaves, leaves twice.",
    remedy: "Before a command is sent drop what has come unasked; compare each answer with its question.",
    parameters: &[millis("pause", "10", "between the two")],
    points: OUT,
    act: |_, values, prey| {
        let again = Segment::after(values.millis("pause"), Departure::Bytes(prey.bytes.to_vec()));
        let words = alloc::format!("{} leaves twice", prey.words());
        Applied::new(
            Effect::Sent([Segment::bytes(prey.bytes.to_vec()), again].into()),
            words,
        )
    },
    ..Kind::PLAIN
};
