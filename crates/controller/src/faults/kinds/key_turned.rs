//! Fault `key-turned`: the key switch is turned, and turned back to EXT if the fault says so.
//!
//! The panel handles it like a turn of the key by hand.

use super::super::kind::{Effect, FaultKind, ScheduledAction};
use super::{MACHINE, millis, word};
use crate::input::{KeySwitch, PanelAction};
use ts3100_proto::words::Word;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "key-turned",
    summary: "The key switch is turned, by default in the middle of the cycle that RN starts; the program stops behind \
           its step, and commands of the other mode are NG.",
    remedy: "After SP or NG read the mode (SU); wait until it is external again, then start again.",
    parameters: &[
        word("to", &["teaching", "internal", "ext"], "where it is turned to"),
        millis("delay", "500", "how long after its occasion it is turned"),
        millis(
            "back",
            "0",
            "how long until it is turned to EXT again; 0: until somebody does",
        ),
    ],
    points: MACHINE,
    command: Some("RN"),
    apply: |context, values, site| {
        let to = values.word("to");
        let (delay, back) = (values.millis("delay"), values.millis("back"));
        let position = KeySwitch::from_word(to).unwrap_or(KeySwitch::Teaching);
        context.schedule(delay, ScheduledAction::Panel(PanelAction::Key(position)));
        if !back.is_zero() {
            context.schedule(
                delay + back,
                ScheduledAction::Panel(PanelAction::Key(KeySwitch::Ext)),
            );
        }
        let message = alloc::format!(
            "the key is turned to {to} {} ms behind {}",
            delay.as_millis(),
            site.description()
        );
        (Effect::Unchanged, message)
    },
    ..FaultKind::DEFAULT
};
