//! Key turned mid-cycle: somebody takes the robot out of external operation.

use super::super::kind::{Applied, Effect, Kind, Parameter, Takes};
use super::super::scheduled::ScheduledAction;
use super::{MACHINE, millis};
use crate::input::{KeySwitch, PanelAction};

/// The positions.
const POSITIONS: [(&str, KeySwitch); 3] = [
    ("teaching", KeySwitch::Teaching),
    ("internal", KeySwitch::Internal),
    ("ext", KeySwitch::Ext),
];

/// The kind.
pub const KIND: Kind = Kind {
    name: "key-turned",
    what: "The key switch is turned, by default in the middle of the cycle that RN starts; the program stops behind \
           its step, and commands of the other mode are NG.",
    remedy: "After SP or NG read the mode (SU); wait until it is external again, then start again.",
    parameters: &[
        Parameter {
            name: "to",
            takes: Takes::Word(&["teaching", "internal", "ext"]),
            default: Some("teaching"),
            what: "where it is turned to",
        },
        millis("delay", "500", "how long after its occasion it is turned"),
        millis(
            "back",
            "0",
            "how long until it is turned to EXT again; 0: until somebody does",
        ),
    ],
    points: MACHINE,
    command: Some("RN"),
    act: |controller, values, prey| {
        let word = values.word("to");
        let (delay, back) = (values.millis("delay"), values.millis("back"));
        let position = POSITIONS.iter().find(|(name, _)| *name == word);
        let position = position.map_or(KeySwitch::Teaching, |(_, position)| *position);
        controller.schedule(delay, ScheduledAction::Panel(PanelAction::Key(position)));
        if !back.is_zero() {
            controller.schedule(
                delay + back,
                ScheduledAction::Panel(PanelAction::Key(KeySwitch::Ext)),
            );
        }
        let words = alloc::format!(
            "the key is turned to {word} {} ms behind {}",
            delay.as_millis(),
            prey.words()
        );
        Applied::new(Effect::Pass, words)
    },
    ..Kind::PLAIN
};
