//! Fault `power-loss`: the power goes off and on again, by default during a download.
//!
//! The panel handles it like a power cycle by hand.

use crate::controls::PanelAction;
use crate::faults::kind::{DELAY, Effect, FaultKind, MACHINE, ScheduledAction};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "power-loss",
    summary: "Turns the power off and on. Connections, an unfinished download, outputs and the place in \
             the program are lost; the files remain.",
    remedy: "It connects again, checks the file, repeats the download from DL, turns servo power on, and \
             starts.",
    parameters: &[DELAY],
    points: MACHINE,
    command: Some("DL"),
    block: Some(1),
    apply: |context, values, site| {
        let delay = values.millis("delay");
        context.schedule(delay, ScheduledAction::Panel(PanelAction::PowerCycle));
        let effect = match delay.is_zero() {
            true => Effect::Lost,
            false => Effect::Unchanged,
        };
        (effect, format!("the power goes off at {site}"))
    },
    ..FaultKind::DEFAULT
};
