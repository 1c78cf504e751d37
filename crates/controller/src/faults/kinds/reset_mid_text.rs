//! Reset mid-text: the connection breaks while a text is on its way.

use super::super::kind::{Applied, Departure, Effect, Kind, Parameter, Segment, Takes};
use super::OUT;
use crate::limits::MAX_SEND;
use crate::output::DisconnectMode;
use core::time::Duration;

/// Time for the bytes sent last to reach the host before the reset overtakes them.
const BEFORE_THE_CUT: Duration = Duration::from_millis(20);

/// The kind.
pub const KIND: Kind = Kind {
    name: "reset-mid-text",
    what: "A part of the text leaves, then the connection ends; on a serial line the rest is lost and the line stays.",
    remedy: "Connect again, forget the unfinished text, ask for the status, and do again what is not done.",
    parameters: &[
        Parameter {
            name: "bytes",
            takes: Takes::Number {
                unit: "bytes",
                least: 0,
                most: MAX_SEND as u64,
            },
            default: None,
            what: "how many leave before; half of them if not said",
        },
        Parameter {
            name: "how",
            takes: Takes::Word(&["reset", "close"]),
            default: Some("reset"),
            what: "reset: RST; close: an orderly end (FIN)",
        },
    ],
    points: OUT,
    act: |_, values, prey| {
        let half = prey.bytes.len() / 2;
        let count = values.bytes("bytes").unwrap_or(half).min(prey.bytes.len());
        let part = prey.bytes.get(..count).unwrap_or_default().to_vec();
        let how = match values.word("how") {
            "close" => DisconnectMode::Close,
            _ => DisconnectMode::Reset,
        };
        let what = match prey.port.ethernet_index() {
            Some(_) => "the connection ends",
            None => "the rest is lost",
        };
        let words = alloc::format!("{what} behind {count} bytes of {}", prey.words());
        let cut = Segment::after(BEFORE_THE_CUT, Departure::Cut(how));
        Applied::new(Effect::Sent([Segment::bytes(part), cut].into()), words)
    },
    ..Kind::PLAIN
};
