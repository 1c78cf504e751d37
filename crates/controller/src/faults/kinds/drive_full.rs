//! RAM drive full: a download finds no room.

use super::super::kind::{Applied, Effect, Kind, Parameter, Point, Takes};
use super::super::{FaultError, On};
use crate::limits::MAX_FILE;

/// The commands that store a file.
const STORING: [&str; 2] = ["DL", "MW"];

/// The kind.
pub const KIND: Kind = Kind {
    name: "drive-full",
    what: "The RAM drive has only so much room for the file of this DL, or of this MW that writes into the file: NG \
           at the text that does not fit, and the file is as before.",
    remedy: "Look at every answer inside a download; after NG look at the directory, erase what is not needed, and \
             begin with DL again.",
    parameters: &[Parameter {
        name: "free",
        takes: Takes::Number {
            unit: "bytes",
            least: 0,
            most: MAX_FILE as u64,
        },
        default: Some("0"),
        what: "bytes that are free",
    }],
    points: &[Point::Command],
    command: Some("DL"),
    block: Some(0),
    // The room is that of the whole file: it is known when the command comes.
    bites: |_, _, block| block == 0,
    check: stores,
    act: |controller, values, prey| {
        let free = values.bytes("free").unwrap_or(0);
        controller.faults.free = Some(free);
        let words = alloc::format!("{} finds {free} bytes free on the RAM drive", prey.words());
        Applied::new(Effect::Pass, words)
    },
};

fn stores(on: &On, _: &super::super::Values) -> Result<(), FaultError> {
    match on.command.as_deref() {
        Some(command) if STORING.contains(&command) => match on.block {
            None | Some(0) => Ok(()),
            Some(block) => Err(KIND.wrong("block", "0, the command itself,", &alloc::format!("{block}"))),
        },
        other => Err(KIND.wrong("command", "DL or MW", other.unwrap_or(""))),
    }
}
