//! Fault `lost-record`: a record for INPUT never reaches the program.
//!
//! `Faults` drops the bytes of the record up to its CR.

use crate::faults::kind::{Effect, FaultKind, InjectionPoint};

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "lost-record",
    summary: "Loses a record for INPUT, up to its CR.",
    remedy: "The program confirms each record by PRINT. Without a confirmation in time the host sends \
             the record again.",
    points: &[InjectionPoint::Record],
    apply: |_, _, site| {
        let message = format!("a record for INPUT on {} is lost", site.port);
        (Effect::Lost, message)
    },
    ..FaultKind::DEFAULT
};
