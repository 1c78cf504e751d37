//! Fault `drive-full`: a download or an MW finds no room on the RAM drive.
//!
//! It sets the free bytes for the file of one command; the commands that store files read them from `Faults`.

use super::super::{FaultError, FaultFilter};
use crate::faults::kind::{Effect, FaultKind, InjectionPoint, ReplyArrival, number};
use crate::limits::MAX_FILE;

/// Commands that store a file.
const STORING: [&str; 2] = ["DL", "MW"];

/// The row of this kind in [`super::KINDS`].
pub const KIND: FaultKind = FaultKind {
    name: "drive-full",
    summary: "Limits the room on the RAM drive for a download, or for an MW that writes into the file. \
             The text that does not fit gets NG, and the file stays as it was.",
    remedy: "It checks every reply inside a download. After NG it reads the directory, erases what is \
             not needed, and begins with DL again.",
    parameters: &[number("free", "bytes", (0, MAX_FILE as u64))
        .or("0")
        .help("free bytes")],
    points: &[InjectionPoint::Command],
    command: Some("DL"),
    block: Some(0),
    // The free bytes are those for the whole file, so they are set when the command is served.
    applies: |_, _, block| block == 0,
    reply: ReplyArrival::Missing,
    validate: check_stores_file,
    apply: |context, values, site| {
        let free = values.bytes("free").unwrap_or(0);
        *context.room = Some(free);
        let message = format!("{site} finds {free} bytes free on the RAM drive");
        (Effect::Unchanged, message)
    },
};

fn check_stores_file(filter: &FaultFilter, _: &super::super::ParameterValues) -> Result<(), FaultError> {
    let command = filter.command.as_deref().unwrap_or_default();
    if !STORING.contains(&command) {
        return Err(KIND.invalid_value("command", "DL or MW", command));
    }
    match filter.block {
        None | Some(0) => Ok(()),
        Some(block) => Err(KIND.invalid_value("block", "0, the command itself", &format!("{block}"))),
    }
}
