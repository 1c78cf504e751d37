//! Lost INPUT record: what a peer sent to the program does not reach it.

use super::super::kind::{Applied, Effect, Kind, Point};

/// The kind.
pub const KIND: Kind = Kind {
    name: "lost-record",
    what: "A record for INPUT, up to its CR, is lost on its way to the program.",
    remedy: "Let the program answer each record by PRINT; when no answer comes in time send the record again.",
    points: &[Point::Record],
    act: |_, _, prey| {
        Applied::new(
            Effect::Lost,
            alloc::format!("a record for INPUT on {} is lost", prey.port),
        )
    },
    ..Kind::PLAIN
};
