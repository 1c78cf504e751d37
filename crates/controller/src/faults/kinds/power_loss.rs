//! Fault `power-loss`: the power goes off and on again, by default during a download.
//!
//! The panel handles it like a power cycle by hand.

use super::super::kind::{Effect, FaultKind, ScheduledAction};
use super::{DELAY, MACHINE};
use crate::input::PanelAction;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "power-loss",
    summary: "The power goes off and on again: connections, a half-finished download, outputs and the program's place \
           are gone; the files are there.",
    remedy: "Connect again, look at the directory or read the file back, begin the download again with DL, turn the \
             servo on and start.",
    parameters: &[DELAY],
    points: MACHINE,
    command: Some("DL"),
    block: Some(1),
    apply: |context, values, site| {
        let delay = values.millis("delay");
        let message = alloc::format!("the power goes at {}", site.description());
        context.schedule(delay, ScheduledAction::Panel(PanelAction::PowerCycle));
        let effect = if delay.is_zero() {
            Effect::Lost
        } else {
            Effect::Unchanged
        };
        (effect, message)
    },
    ..FaultKind::DEFAULT
};
