//! Fault `no-reply`: a command is obeyed but its answer is not sent, or the command itself is lost.
//!
//! The parameter `lost` selects which of the two.

use crate::faults::kind::{Effect, FaultKind, InjectionPoint, word};

/// Value of `lost`: the reply is lost.
const REPLY: &str = "reply";
/// Value of `lost`: the command is lost.
const COMMAND: &str = "command";

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "no-reply",
    summary: "Loses the reply to a command, a text of a file, or the command itself.",
    remedy: "It waits for the reply with a time limit, then sends the command again. Before it repeats a \
             command that must not be done twice, it reads the status.",
    parameters: &[
        word("lost", &[REPLY, COMMAND]).help("reply: the robot obeys the command; command: it never gets it")
    ],
    points: &[InjectionPoint::Command, InjectionPoint::Reply],
    applies: |values, point, _| (values.word("lost") == COMMAND) == (point == InjectionPoint::Command),
    apply: |_, _, site| {
        let lost = match site.point == InjectionPoint::Command {
            true => "lost before the robot sees it",
            false => "not sent",
        };
        (Effect::Lost, format!("{site} is {lost}"))
    },
    ..FaultKind::DEFAULT
};
