//! Split bytes: a text in small portions, with pauses.

use super::super::kind::{Applied, Departure, Effect, Kind, Parameter, Segment, Takes};
use super::{OUT, millis};
use crate::limits::MAX_SEND;
use core::time::Duration;

/// The kind.
pub const KIND: Kind = Kind {
    name: "split-bytes",
    what: "What leaves is cut into portions, each in a write of its own behind a pause.",
    remedy: "Read on until ETX (SF: until its length), however many reads that takes.",
    parameters: &[
        Parameter {
            name: "size",
            takes: Takes::Number {
                unit: "bytes",
                least: 1,
                most: MAX_SEND as u64,
            },
            default: Some("1"),
            what: "bytes of a portion",
        },
        millis("pause", "20", "the pause before each but the first"),
    ],
    points: OUT,
    act: |_, values, prey| {
        let size = values.bytes("size").unwrap_or(1).max(1);
        let pause = values.millis("pause");
        let parcels = prey.bytes.chunks(size).enumerate().map(|(place, portion)| {
            let after = if place == 0 { Duration::ZERO } else { pause };
            Segment::after(after, Departure::Bytes(portion.to_vec()))
        });
        let words = alloc::format!("{} leaves in portions of {size} bytes", prey.words());
        Applied::new(Effect::Sent(parcels.collect()), words)
    },
    ..Kind::PLAIN
};
