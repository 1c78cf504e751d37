//! Servo failure: the servo drops out.

use super::super::kind::{Applied, Effect, Kind};
use super::super::scheduled::ScheduledAction;
use super::{DELAY, MACHINE};
use crate::alarm::SERVO_FAILURE;

/// The kind.
pub const KIND: Kind = Kind {
    name: "servo-failure",
    what: "The servo drops out: alarm 8-204, servo power goes off, the motion is given up.",
    remedy: "See by SP and SF that the servo is off, reset the alarm, SO, and start again: the step is done again.",
    parameters: &[DELAY],
    points: MACHINE,
    act: |controller, values, prey| {
        controller.schedule(values.millis("delay"), ScheduledAction::Alarm(SERVO_FAILURE));
        Applied::new(
            Effect::Pass,
            alloc::format!("the servo drops out behind {}", prey.words()),
        )
    },
    ..Kind::PLAIN
};
