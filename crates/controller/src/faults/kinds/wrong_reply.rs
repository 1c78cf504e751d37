//! Wrong reply: a whole, well-formed text that is not the answer to what was asked.

use super::super::kind::{Applied, Effect, Kind, Parameter, Point, Segment, Takes};
use alloc::vec::Vec;
use ts3100_proto::text::MAX_DATA;

/// In place of a file.
const OK: &[u8] = b"OK\r";
/// In place of OK or NG: a file with nothing in it.
const EMPTY_FILE: &[u8] = b"FL,\x1a";

/// The kind.
pub const KIND: Kind = Kind {
    name: "wrong-reply",
    what: "Another text leaves in place of the answer.",
    remedy: "Compare the answer with what the command can be answered with, not with NG alone; on anything else wait \
             for silence and send the command again.",
    parameters: &[Parameter {
        name: "text",
        takes: Takes::Text { most: MAX_DATA },
        default: None,
        what: "its data section; if not said, OK in place of a file and an empty file in place of OK and NG",
    }],
    points: &[Point::Reply],
    act: |_, values, prey| {
        let usual = match prey.data {
            [b'O' | b'N', ..] => EMPTY_FILE,
            _ => OK,
        };
        let data = values.text("text").unwrap_or(usual);
        let words = alloc::format!("in place of {} leaves \"{}\"", prey.words(), data.escape_ascii());
        Applied::new(
            Effect::Sent([Segment::bytes(reframed(prey.bytes, prey.data, data))].into()),
            words,
        )
    },
    ..Kind::PLAIN
};

/// The bytes of a text with another data section; its sum, if it has one, is left as it was.
fn reframed(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let head = usize::from(bytes.first() == Some(&ts3100_proto::text::STX));
    let (head, rest) = bytes.split_at(head.min(bytes.len()));
    let tail = rest.get(old.len()..).unwrap_or_default();
    [head, new, tail].concat()
}
