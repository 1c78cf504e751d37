//! Fault `emergency-stop`: the emergency stop button is pressed, and released later if the fault says so.
//!
//! The panel handles it like a press of the button by hand.

use super::super::kind::{Effect, FaultKind, ScheduledAction};
use super::{DELAY, MACHINE, millis};
use crate::input::PanelAction;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "emergency-stop",
    summary: "The emergency stop button is pressed, and released later.",
    remedy: "Stop asking for motion; when the button is out again reset the alarm, turn the servo on, start.",
    parameters: &[
        DELAY,
        millis(
            "release",
            "0",
            "how long it stays pressed; 0: until somebody releases it",
        ),
    ],
    points: MACHINE,
    apply: |context, values, site| {
        let (delay, release) = (values.millis("delay"), values.millis("release"));
        context.schedule(delay, ScheduledAction::Panel(PanelAction::EmergencyStop(true)));
        if !release.is_zero() {
            context.schedule(
                delay + release,
                ScheduledAction::Panel(PanelAction::EmergencyStop(false)),
            );
        }
        let message = alloc::format!("the emergency stop follows {}", site.description());
        (Effect::Unchanged, message)
    },
    ..FaultKind::DEFAULT
};
