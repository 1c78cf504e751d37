//! Duplicate text: the same text twice.

use super::super::kind::{Bitten, Effect, Kind, Leaving, Parcel};
use super::{OUT, millis};

/// The kind.
pub const KIND: Kind = Kind {
    name: "duplicate-text",
    what: "What leaves, leaves twice.",
    remedy: "Before a command is sent drop what has come unasked; compare each answer with its question.",
    parameters: &[millis("pause", "10", "between the two")],
    points: OUT,
    act: |_, values, prey| {
        let again = Parcel::after(values.millis("pause"), Leaving::Bytes(prey.bytes.to_vec()));
        let words = alloc::format!("{} leaves twice", prey.words());
        Bitten::new(
            Effect::Sent([Parcel::bytes(prey.bytes.to_vec()), again].into()),
            words,
        )
    },
    ..Kind::PLAIN
};
