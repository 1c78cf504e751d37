//! Fault `servo-failure`: the servo fails (alarm 8-026).
//!
//! The alarm is ours: its real number is not known.

use crate::alarm::SERVO_FAILURE;
use crate::faults::kind::{DELAY, Effect, FaultKind, MACHINE, ScheduledAction};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "servo-failure",
    summary: "Fails the servo: alarm 8-026, servo power goes off, and the motion ends.",
    remedy: "It sees by SP and SF that servo power is off, resets the alarm, sends SO, and starts again. \
             The step is repeated.",
    parameters: &[DELAY],
    points: MACHINE,
    apply: |context, values, site| {
        context.schedule(values.millis("delay"), ScheduledAction::Alarm(SERVO_FAILURE));
        (Effect::Unchanged, format!("the servo fails after {site}"))
    },
    ..FaultKind::DEFAULT
};
