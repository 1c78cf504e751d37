//! Fault `reset-mid-text`: the connection ends after a part of a text was sent.
//!
//! A serial line has no connection; there the rest of the text is lost.

use crate::faults::kind::{FaultKind, OUTGOING, number, sends, word};
use crate::limits::MAX_SEND;
use crate::output::DisconnectMode;
use crate::segment::{Departure, Segment};
use core::time::Duration;

/// Pause before the reset: RST discards bytes that the host has not read yet.
const DISCONNECT_DELAY: Duration = Duration::from_millis(20);

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "reset-mid-text",
    summary: "Sends a part of a text, then ends the connection. On a serial line only the rest of the \
             text is lost.",
    remedy: "It connects again, drops the unfinished text, reads the status, and repeats what was not done.",
    parameters: &[
        number("bytes", "bytes", (0, MAX_SEND as u64))
            .help("number of bytes that are sent; half of the text by default"),
        word("how", &["reset", "close"]).help("reset: RST; close: an orderly end (FIN)"),
    ],
    points: OUTGOING,
    apply: |_, values, site| {
        let half = site.bytes.len() / 2;
        let count = values.bytes("bytes").unwrap_or(half).min(site.bytes.len());
        let part = site.bytes.slice(..count);
        let how = match values.word("how") {
            "close" => DisconnectMode::Close,
            _ => DisconnectMode::Reset,
        };
        let what = match site.port.ethernet_index() {
            Some(_) => "the connection ends",
            None => "the rest is lost",
        };
        let message = format!("{what} after {count} bytes of {site}");
        let disconnect = Segment::after(DISCONNECT_DELAY, Departure::Disconnect(how));
        sends([Segment::bytes(part), disconnect], message)
    },
    ..FaultKind::DEFAULT
};
