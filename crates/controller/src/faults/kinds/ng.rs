//! NG: a command that could be obeyed is refused.

use super::super::kind::{Applied, Effect, Kind, Point};

/// The kind.
pub const KIND: Kind = Kind {
    name: "ng",
    what: "A command, or a text of a download, is answered NG and has no effect.",
    remedy: "Send the command again after NG; after NG inside a download begin with DL again (TRN-02, TRN-03).",
    points: &[Point::Command],
    act: |_, _, prey| {
        let words = alloc::format!("{} is refused", prey.words());
        Applied::new(Effect::Refused("a fault on purpose (ng)".into()), words)
    },
    ..Kind::PLAIN
};
