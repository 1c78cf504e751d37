//! Fault `emergency-stop`: the emergency stop button is pressed, and released later if the fault says so.
//!
//! The panel handles it like a press of the button by hand.

use crate::controls::PanelAction;
use crate::faults::kind::{DELAY, Effect, FaultKind, MACHINE, millis};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "emergency-stop",
    summary: "Presses the emergency stop, and releases it later.",
    remedy: "It stops commanding motion. After the release it resets the alarm, turns servo power on, \
             and starts.",
    parameters: &[
        DELAY,
        millis("release", "0").help("time for which it stays pressed; 0: until it is released by hand"),
    ],
    points: MACHINE,
    apply: |context, values, site| {
        let (delay, lasts) = (values.millis("delay"), values.millis("release"));
        let [press, release] = [true, false].map(PanelAction::EmergencyStop);
        context.operate(delay, press, lasts, release);
        (Effect::Unchanged, format!("the emergency stop follows {site}"))
    },
    ..FaultKind::DEFAULT
};
