//! Flipped bit: one bit of what is on the line is the other way round.

use super::super::Values;
use super::super::kind::{Applied, Effect, Kind, Parameter, Point, Segment, Takes};
use crate::Controller;

/// Towards the host.
const OUT: &str = "out";
/// Towards the robot.
const IN: &str = "in";
/// Farthest byte that can be named.
const FARTHEST: u64 = 511;

/// The kind.
pub const KIND: Kind = Kind {
    name: "flipped-bit",
    what: "One bit of a text, of what PRINT sends, or of what comes in is inverted.",
    remedy: "Compare every answer with the forms it can have, send the command again when it has none of them; for \
             files read back what was stored. A checksum (text.checksum) finds what forms do not.",
    parameters: &[
        Parameter {
            name: "way",
            takes: Takes::Word(&[OUT, IN]),
            default: Some(OUT),
            what: "out: towards the host; in: towards the robot",
        },
        Parameter {
            name: "byte",
            takes: Takes::Number {
                unit: "bytes",
                least: 0,
                most: FARTHEST,
            },
            default: None,
            what: "how many bytes stand before it, STX included; drawn if not said",
        },
        Parameter {
            name: "bit",
            takes: Takes::Number {
                unit: "bits",
                least: 0,
                most: 7,
            },
            default: None,
            what: "0 the lowest to 7 the highest; drawn if not said",
        },
    ],
    points: &[Point::Reply, Point::Print, Point::Bytes],
    bites: |values, point, _| (values.word("way") == IN) == (point == Point::Bytes),
    act: |controller, values, prey| {
        let mut bytes = prey.bytes.to_vec();
        let (byte, bit) = place(controller, values, bytes.len());
        let Some(found) = bytes.get_mut(byte) else {
            let words = alloc::format!("{} has no byte {byte}", prey.words());
            return Applied::new(Effect::Pass, words);
        };
        let before = *found;
        *found ^= 1 << bit;
        let words = alloc::format!(
            "byte {byte} of {} is {:02X}, not {before:02X}",
            prey.words(),
            *found
        );
        let effect = match prey.point {
            Point::Bytes => Effect::Came(bytes),
            _ => Effect::Sent([Segment::bytes(bytes)].into()),
        };
        Applied::new(effect, words)
    },
    ..Kind::PLAIN
};

fn place(controller: &mut Controller, values: &Values, length: usize) -> (usize, u32) {
    let dice = &mut controller.faults.dice;
    let byte = values.bytes("byte").unwrap_or_else(|| dice.place(length));
    let bit = values.number("bit").unwrap_or_else(|| dice.between(0, 7));
    (byte, u32::try_from(bit).unwrap_or(0))
}
