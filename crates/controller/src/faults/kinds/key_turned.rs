//! Fault `key-turned`: the key switch is turned, and turned back to EXT if the fault says so.
//!
//! The panel handles it like a turn of the key by hand.

use crate::controls::PanelAction;
use crate::faults::kind::{Effect, FaultKind, MACHINE, millis, word};
use crate::panel::KeySwitch;
use ts3100_proto::words::Word;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "key-turned",
    summary: "Turns the key switch, by default in the middle of the cycle that RN starts. The program \
             stops after its step, and commands that the new mode forbids get NG.",
    remedy: "After SP or NG it reads the mode (SU), waits until it is external again, and starts again.",
    parameters: &[
        word("to", &["teaching", "internal", "ext"]).help("the new position; internal needs a TS3100"),
        millis("delay", "500").help("delay after the occasion"),
        millis("back", "0").help("time until it is turned back to EXT; 0: it is turned back by hand"),
    ],
    points: MACHINE,
    command: Some("RN"),
    apply: |context, values, site| {
        let to = values.word("to");
        let (delay, back) = (values.millis("delay"), values.millis("back"));
        let position = KeySwitch::from_word(to).unwrap_or(KeySwitch::Teaching);
        let [turn, turn_back] = [position, KeySwitch::Ext].map(PanelAction::Key);
        context.operate(delay, turn, back, turn_back);
        let message = format!("the key is turned to {to} {} ms after {site}", delay.as_millis());
        (Effect::Unchanged, message)
    },
    ..FaultKind::DEFAULT
};
