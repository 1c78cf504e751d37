//! Fault `alarm`: the controller raises one of its alarms.
//!
//! The alarm has the same effect as one raised by the controller itself (see `run_control`).

use crate::alarm::AlarmCode;
use crate::faults::kind::{DELAY, Effect, FaultKind, MACHINE, ParameterType, ScheduledAction, parameter};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "alarm",
    summary: "Raises an alarm, with the effect of its level.",
    remedy: "It notices the unsolicited SP or the changed status, reads the alarm (EU, SF), resets it, \
             and starts again where that is safe.",
    parameters: &[
        parameter("number", ParameterType::Alarm)
            .or("2-046")
            .help("its level and code"),
        DELAY,
    ],
    points: MACHINE,
    apply: |context, values, site| {
        let number = values.word("number");
        if let Some(code) = AlarmCode::from_number(number) {
            context.schedule(values.millis("delay"), ScheduledAction::Alarm(code));
        }
        (Effect::Unchanged, format!("alarm {number} follows {site}"))
    },
    ..FaultKind::DEFAULT
};
