//! The table of all kinds of faults. Each kind is a file of this directory; `faults::kind` says what a kind consists of.
//!
//! To add a kind, write its file after one of the short ones (`ng`, `late_reply`) and add it to [`KINDS`].

mod alarm;
mod drive_full;
mod duplicate_text;
mod emergency_stop;
mod flipped_bit;
mod half_open;
pub(super) mod key_turned;
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

use super::kind::{
    Effect, FaultContext, FaultKind, InjectionPoint, Parameter, ParameterType, ParameterValues,
    ScheduledAction,
};
use crate::endpoint::send_queue::{Departure, Segment};
use crate::prelude::*;

/// Every kind, in the order in which lists show them.
pub const KINDS: &[&FaultKind] = &[
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

/// Points of faults in what is sent.
const OUTGOING: &[InjectionPoint] = &[InjectionPoint::Reply, InjectionPoint::Print];
/// Points that can trigger a fault of the machine.
const MACHINE: &[InjectionPoint] = &[InjectionPoint::Command, InjectionPoint::Record];
/// Longest duration of a parameter: ten minutes, in ms.
const LONGEST: u64 = 600_000;

/// This is sent instead; the message says so.
fn sends(segments: impl IntoIterator<Item = Segment>, message: String) -> (Effect, String) {
    (Effect::ReplaceOutput(segments.into_iter().collect()), message)
}

/// A parameter without a default.
const fn parameter(name: &'static str, value_type: ParameterType) -> Parameter {
    Parameter {
        name,
        value_type,
        default: None,
        description: "",
    }
}

/// A whole number, at least the first and at most the second of the bounds.
const fn number(name: &'static str, unit: &'static str, (min, max): (u64, u64)) -> Parameter {
    parameter(name, ParameterType::Number { unit, min, max })
}

/// A duration.
const fn millis(name: &'static str, default: &'static str) -> Parameter {
    number(name, "ms", (0, LONGEST)).or(default)
}

/// One of some words, the first if the fault does not say which.
const fn word(name: &'static str, words: &'static [&'static str]) -> Parameter {
    Parameter {
        default: words.first().copied(),
        ..parameter(name, ParameterType::Word(words))
    }
}

impl Parameter {
    /// The same with a default.
    const fn or(self, default: &'static str) -> Parameter {
        let default = Some(default);
        Parameter { default, ..self }
    }

    /// The same with its line for help.
    const fn help(self, description: &'static str) -> Parameter {
        Parameter { description, ..self }
    }
}

/// Delay between the triggering site and a fault of the machine.
const DELAY: Parameter = millis("delay", "0").help("delay after the occasion");
