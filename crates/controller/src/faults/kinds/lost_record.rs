//! Fault `lost-record`: a record for INPUT never reaches the program.
//!
//! `Faults` drops the bytes of the record up to its CR.

use super::super::kind::{Effect, FaultKind, InjectionPoint};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "lost-record",
    summary: "A record for INPUT, up to its CR, is lost on its way to the program.",
    remedy: "Let the program answer each record by PRINT; when no answer comes in time send the record again.",
    points: &[InjectionPoint::Record],
    apply: |_, _, site| {
        let message = alloc::format!("a record for INPUT on {} is lost", site.port);
        (Effect::Lost, message)
    },
    ..FaultKind::DEFAULT
};
