//! Fault `parity-error`: a character on a serial line is received with a parity error.
//!
//! What the controller does with such a character is the option `serial.bad_character`.

use crate::faults::kind::{Effect, FaultKind, InjectionPoint, number};

/// Largest value of `character`.
const FARTHEST: u64 = 15;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "parity-error",
    summary: "Gives a character received on HOST or COM1 a parity error. The option serial.bad_character \
             decides what happens to it.",
    remedy: "On HOST it sends the command again without a reply or after NG. On COM1 the program prints \
             what it has read, and the host compares.",
    parameters: &[number("character", "characters", (0, FARTHEST))
        .help("number of characters before it in one reading; random by default")],
    points: &[InjectionPoint::Character],
    apply: |context, values, site| {
        let last = site.bytes.len().saturating_sub(1);
        let index = values.bytes("character").map(|index| index.min(last));
        let index = index.unwrap_or_else(|| context.rng.index(site.bytes.len()));
        let byte = site.bytes.get(index).copied().unwrap_or_default();
        let message = format!("a character on {} ({byte:02X}) has a parity error", site.port);
        (Effect::ParityError(index), message)
    },
    ..FaultKind::DEFAULT
};
