//! Fault `no-reply`: a command is obeyed but its answer is not sent, or the command itself is lost.
//!
//! The parameter `lost` selects which of the two.

use super::super::kind::{Effect, FaultKind, InjectionPoint};
use super::word;

/// Value of `lost`: the reply is lost.
const REPLY: &str = "reply";
/// Value of `lost`: the command is lost.
const COMMAND: &str = "command";

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "no-reply",
    summary: "The answer to a command, or a text of a file, never leaves; or the command never reached the robot.",
    remedy: "Wait for the answer with a time limit, then send the command again; one that must not be done twice \
             only when the status shows that it was not done.",
    parameters: &[word(
        "lost",
        &[REPLY, COMMAND],
        "reply: the command is obeyed; command: it is not",
    )],
    points: &[InjectionPoint::Command, InjectionPoint::Reply],
    applies: |values, point, _| (values.word("lost") == COMMAND) == (point == InjectionPoint::Command),
    apply: |_, _, site| {
        let lost = match site.point == InjectionPoint::Command {
            true => "lost before the robot sees it",
            false => "not sent",
        };
        (Effect::Lost, alloc::format!("{} is {lost}", site.description()))
    },
    ..FaultKind::DEFAULT
};
