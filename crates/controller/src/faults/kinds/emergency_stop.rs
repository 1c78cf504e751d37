//! Emergency stop: somebody presses the button.

use super::super::kind::{Applied, Effect, Kind};
use super::super::scheduled::ScheduledAction;
use super::{DELAY, MACHINE, millis};
use crate::input::PanelAction;

/// The kind.
pub const KIND: Kind = Kind {
    name: "emergency-stop",
    what: "The emergency stop button is pressed, and released later.",
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
    act: |controller, values, prey| {
        let (delay, release) = (values.millis("delay"), values.millis("release"));
        controller.schedule(delay, ScheduledAction::Panel(PanelAction::EmergencyStop(true)));
        if !release.is_zero() {
            controller.schedule(
                delay + release,
                ScheduledAction::Panel(PanelAction::EmergencyStop(false)),
            );
        }
        Applied::new(
            Effect::Pass,
            alloc::format!("the emergency stop follows {}", prey.words()),
        )
    },
    ..Kind::PLAIN
};
