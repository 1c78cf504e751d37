//! Alarm N: the controller raises one of its alarms.

use super::super::kind::{Applied, Effect, Kind, Parameter, Takes};
use super::super::scheduled::ScheduledAction;
use super::{DELAY, MACHINE};
use crate::alarm::ALARMS;

/// The kind.
pub const KIND: Kind = Kind {
    name: "alarm",
    what: "An alarm of the table comes; its level acts as always.",
    remedy: "Take the unsolicited SP, or a status that is no longer running, for what it is: read the alarm (EU, SF), \
             reset it, and start again where that is safe.",
    parameters: &[
        Parameter {
            name: "number",
            takes: Takes::Alarm,
            default: Some("2-046"),
            what: "its level and code",
        },
        DELAY,
    ],
    points: MACHINE,
    act: |controller, values, prey| {
        let number = values.word("number");
        if let Some(code) = ALARMS.iter().find(|row| row.number() == number) {
            controller.schedule(values.millis("delay"), ScheduledAction::Alarm(*code));
        }
        Applied::new(
            Effect::Pass,
            alloc::format!("alarm {number} follows {}", prey.words()),
        )
    },
    ..Kind::PLAIN
};
