//! Fault `ng`: a command that could be obeyed is answered NG.
//!
//! The command has no effect.

use crate::faults::kind::{Effect, FaultKind, InjectionPoint, ReplyArrival};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "ng",
    summary: "Answers a command or a text of a download with NG, without effect.",
    remedy: "It sends the command again after NG. After NG inside a download it begins with DL again.",
    points: &[InjectionPoint::Command],
    apply: |_, _, site| {
        let reason = "an armed fault (ng)".into();
        (Effect::Refused(reason), format!("{site} is refused"))
    },
    reply: ReplyArrival::InTime,
    ..FaultKind::DEFAULT
};
