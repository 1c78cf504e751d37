//! Fault `wrong-reply`: a well-formed text that is not the answer is sent.
//!
//! The default is a text of the other kind: OK instead of a file, an empty file instead of OK or NG.

use crate::faults::kind::{FaultKind, InjectionPoint, ParameterType, parameter, sends};
use crate::prelude::*;
use crate::segment::Segment;
use ts3100_proto::text::MAX_DATA;

/// Sent instead of a file.
const OK: &[u8] = b"OK\r";
/// Sent instead of OK or NG: an empty file.
const EMPTY_FILE: &[u8] = b"FL,\x1a";

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "wrong-reply",
    summary: "Sends another text instead of the reply.",
    remedy: "It compares the reply with every reply to this command, not with NG alone. On anything \
             else it waits for silence and sends the command again.",
    parameters: &[parameter("text", ParameterType::Text { most: MAX_DATA })
        .help("its data section; by default OK instead of a file, and an empty file instead of OK and NG")],
    points: &[InjectionPoint::Reply],
    apply: |_, values, site| {
        let usual = match site.data.as_ref() {
            [b'O' | b'N', ..] => EMPTY_FILE,
            _ => OK,
        };
        let data = values.text("text").unwrap_or_else(|| usual.to_vec());
        let message = format!("instead of {site} leaves \"{}\"", data.escape_ascii());
        sends(
            [Segment::bytes(reframed(&site.bytes, &site.data, &data))],
            message,
        )
    },
    ..FaultKind::DEFAULT
};

/// The bytes of a text with another data section. A checksum is not corrected.
fn reframed(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let head = usize::from(bytes.first() == Some(&ts3100_proto::text::STX));
    let (head, rest) = bytes.split_at(head.min(bytes.len()));
    let tail = rest.get(old.len()..).unwrap_or_default();
    [head, new, tail].concat()
}
