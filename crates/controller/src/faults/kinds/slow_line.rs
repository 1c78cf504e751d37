//! Slow line: a text at the pace of an old modem.

use super::super::kind::{Applied, Departure, Effect, Kind, Parameter, Segment, Takes};
use super::OUT;
use core::time::Duration;

/// Bits on the line for each byte: start, eight of data, stop.
const BITS: u64 = 10;

/// The kind.
pub const KIND: Kind = Kind {
    name: "slow-line",
    what: "What leaves takes its time, byte by byte, as on a line of so many bits a second.",
    remedy: "Count the time limit from the last byte that came, as the robot does (10 s, SER-06), not from the \
             question.",
    parameters: &[Parameter {
        name: "speed",
        takes: Takes::Number {
            unit: "bit/s",
            least: 1,
            most: 115_200,
        },
        default: Some("50"),
        what: "speed of the line",
    }],
    points: OUT,
    act: |_, values, prey| {
        let speed = values.number("speed").unwrap_or(1).max(1);
        let pace = Duration::from_micros(BITS * 1_000_000 / speed);
        let bytes = prey.bytes.iter();
        let parcels = bytes.map(|byte| Segment::after(pace, Departure::Bytes([*byte].into())));
        let words = alloc::format!("{} leaves at {speed} bit/s", prey.words());
        Applied::new(Effect::Sent(parcels.collect()), words)
    },
    ..Kind::PLAIN
};
