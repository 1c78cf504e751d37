//! Lost ETX: the end of a text does not come.

use super::super::kind::{Applied, Effect, Kind, Point, Segment};
use ts3100_proto::text::ETX;

/// The kind.
pub const KIND: Kind = Kind {
    name: "lost-etx",
    what: "The text leaves without its ETX.",
    remedy: "Give up a text that does not end in time, forget its beginning, and send the command again.",
    points: &[Point::Reply],
    act: |_, _, prey| {
        let end = prey.bytes.iter().rposition(|byte| *byte == ETX);
        let mut bytes = prey.bytes.to_vec();
        if let Some(end) = end {
            bytes.remove(end);
        }
        let words = alloc::format!("{} leaves without ETX", prey.words());
        Applied::new(Effect::Sent([Segment::bytes(bytes)].into()), words)
    },
    ..Kind::PLAIN
};
