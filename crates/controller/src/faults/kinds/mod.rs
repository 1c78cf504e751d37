//! The table of all kinds of faults. What each does stands in its own file.

mod alarm;
mod drive_full;
mod duplicate_text;
mod emergency_stop;
mod flipped_bit;
mod half_open;
mod key_turned;
mod late_reply;
mod lost_etx;
mod lost_record;
mod merged_texts;
mod ng;
mod no_reply;
mod parity_error;
mod power_loss;
mod reset_mid_text;
mod servo_failure;
mod slow_line;
mod split_bytes;
mod wrong_reply;

use super::kind::{Kind, Parameter, Point, Takes};

/// Every kind, in the order of lists.
pub const KINDS: &[&Kind] = &[
    &no_reply::KIND,
    &late_reply::KIND,
    &ng::KIND,
    &wrong_reply::KIND,
    &lost_etx::KIND,
    &flipped_bit::KIND,
    &split_bytes::KIND,
    &merged_texts::KIND,
    &duplicate_text::KIND,
    &reset_mid_text::KIND,
    &half_open::KIND,
    &slow_line::KIND,
    &drive_full::KIND,
    &power_loss::KIND,
    &alarm::KIND,
    &emergency_stop::KIND,
    &servo_failure::KIND,
    &key_turned::KIND,
    &parity_error::KIND,
    &lost_record::KIND,
];

/// Whatever leaves.
const OUT: &[Point] = &[Point::Reply, Point::Print];
/// What a fault of the machine follows upon.
const MACHINE: &[Point] = &[Point::Command, Point::Record];
/// Longest time a fault takes: ten minutes, in ms.
const LONGEST: u64 = 600_000;

/// A parameter in milliseconds.
const fn millis(name: &'static str, default: &'static str, what: &'static str) -> Parameter {
    Parameter {
        name,
        takes: Takes::Number {
            unit: "ms",
            least: 0,
            most: LONGEST,
        },
        default: Some(default),
        what,
    }
}

/// How long after its occasion a fault of the machine comes.
const DELAY: Parameter = millis("delay", "0", "how long after its occasion it comes");
