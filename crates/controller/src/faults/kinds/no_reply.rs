//! No reply: a command is obeyed and the host never hears of it, or it never reached the robot.

use super::super::kind::{Applied, Effect, Kind, Parameter, Point, Takes};

/// Which of the two is lost.
const REPLY: &str = "reply";
/// The other one.
const COMMAND: &str = "command";

/// The kind.
pub const KIND: Kind = Kind {
    name: "no-reply",
    what: "The answer to a command, or a text of a file, never leaves; or the command never reached the robot.",
    remedy: "Wait for the answer with a time limit, then send the command again; one that must not be done twice \
             only when the status shows that it was not done.",
    parameters: &[Parameter {
        name: "lost",
        takes: Takes::Word(&[REPLY, COMMAND]),
        default: Some(REPLY),
        what: "reply: the command is obeyed; command: it is not",
    }],
    points: &[Point::Command, Point::Reply],
    bites: |values, point, _| (values.word("lost") == COMMAND) == (point == Point::Command),
    act: |_, _, prey| {
        let words = match prey.point {
            Point::Command => alloc::format!("{} is lost before the robot sees it", prey.words()),
            _ => alloc::format!("{} is not sent", prey.words()),
        };
        Applied::new(Effect::Lost, words)
    },
    ..Kind::PLAIN
};
