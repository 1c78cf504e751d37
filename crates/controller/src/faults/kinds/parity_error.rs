//! Fault `parity-error`: a character on a serial line is received with a parity error.
//!
//! What the controller does with such a character is the option `serial.bad_character`.

use super::super::kind::{Effect, FaultKind, InjectionPoint};
use super::number;

/// Largest value of `character`.
const FARTHEST: u64 = 15;

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "parity-error",
    summary: "A character that comes in on HOST or COM1 has a parity error; what becomes of it is \
           serial.bad_character.",
    remedy: "On HOST send the command again when no answer comes or NG; on COM1 let the program answer each record \
             with what it has read, and compare.",
    parameters: &[number(
        "character",
        "characters",
        (0, FARTHEST),
        None,
        "how many of those that came at once stand before it; drawn if not said",
    )],
    points: &[InjectionPoint::Character],
    apply: |context, values, site| {
        let last = site.bytes.len().saturating_sub(1);
        let index = values.bytes("character").map(|index| index.min(last));
        let index = index.unwrap_or_else(|| context.rng.index(site.bytes.len()));
        let byte = site.bytes.get(index).copied().unwrap_or_default();
        let message = alloc::format!("a character on {} ({byte:02X}) has a parity error", site.port);
        (Effect::ParityError(index), message)
    },
    ..FaultKind::DEFAULT
};
