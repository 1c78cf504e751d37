//! Power loss, during a download or any other command.

use super::super::kind::{Applied, Effect, Kind};
use super::super::scheduled::ScheduledAction;
use super::{DELAY, MACHINE};
use crate::input::PanelAction;

/// The kind.
pub const KIND: Kind = Kind {
    name: "power-loss",
    what: "The power goes off and on again: connections, a half-finished download, outputs and the program's place \
           are gone; the files are there.",
    remedy: "Connect again, look at the directory or read the file back, begin the download again with DL, turn the \
             servo on and start.",
    parameters: &[DELAY],
    points: MACHINE,
    command: Some("DL"),
    block: Some(1),
    act: |controller, values, prey| {
        let delay = values.millis("delay");
        let words = alloc::format!("the power goes at {}", prey.words());
        controller.schedule(delay, ScheduledAction::Panel(PanelAction::PowerCycle));
        let effect = if delay.is_zero() {
            Effect::Lost
        } else {
            Effect::Pass
        };
        Applied::new(effect, words)
    },
    ..Kind::PLAIN
};
