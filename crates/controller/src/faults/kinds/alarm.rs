//! Fault `alarm`: the controller raises one of its alarms.
//!
//! The alarm has the same effect as one raised by the controller itself (see `run_control`).

use super::{DELAY, Effect, FaultKind, MACHINE, Parameter, ParameterType, ScheduledAction};
use crate::alarm::ALARMS;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "alarm",
    summary: "Raises an alarm, with the effect of its level.",
    remedy: "It notices the unsolicited SP or the changed status, reads the alarm (EU, SF), resets it, \
             and starts again where that is safe.",
    parameters: &[
        Parameter {
            name: "number",
            value_type: ParameterType::Alarm,
            default: Some("2-046"),
            description: "its level and code",
        },
        DELAY,
    ],
    points: MACHINE,
    apply: |context, values, site| {
        let number = values.word("number");
        if let Some(code) = ALARMS.iter().find(|row| row.number() == number) {
            context.schedule(values.millis("delay"), ScheduledAction::Alarm(*code));
        }
        let message = format!("alarm {number} follows {}", site.description());
        (Effect::Unchanged, message)
    },
    ..FaultKind::DEFAULT
};
