//! Emergency stop: somebody presses the button.

use super::super::kind::{Bitten, Effect, Kind};
use super::super::strike::Strike;
use super::{DELAY, MACHINE, millis};
use crate::input::Panel;

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
        controller.strike(delay, Strike::Panel(Panel::EmergencyStop(true)));
        if !release.is_zero() {
            controller.strike(delay + release, Strike::Panel(Panel::EmergencyStop(false)));
        }
        Bitten::new(
            Effect::Pass,
            alloc::format!("the emergency stop follows {}", prey.words()),
        )
    },
    ..Kind::PLAIN
};
