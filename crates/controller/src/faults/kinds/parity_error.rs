//! Parity error: a character on a serial line arrives with the wrong number of ones.

use super::super::kind::{Applied, Effect, Kind, Parameter, Point, Takes};

/// Farthest character that can be named.
const FARTHEST: u64 = 15;

/// The kind.
pub const KIND: Kind = Kind {
    name: "parity-error",
    what: "A character that comes in on HOST or COM1 has a parity error; what becomes of it is \
           serial.bad_character.",
    remedy: "On HOST send the command again when no answer comes or NG; on COM1 let the program answer each record \
             with what it has read, and compare.",
    parameters: &[Parameter {
        name: "character",
        takes: Takes::Number {
            unit: "characters",
            least: 0,
            most: FARTHEST,
        },
        default: None,
        what: "how many of those that came at once stand before it; drawn if not said",
    }],
    points: &[Point::Character],
    act: |controller, values, prey| {
        let last = prey.bytes.len().saturating_sub(1);
        let place = values.bytes("character").map(|place| place.min(last));
        let place = place.unwrap_or_else(|| controller.faults.dice.place(prey.bytes.len()));
        let byte = prey.bytes.get(place).copied().unwrap_or_default();
        let words = alloc::format!("a character on {} ({byte:02X}) has a parity error", prey.port);
        Applied::new(Effect::Garbled(place), words)
    },
    ..Kind::PLAIN
};
