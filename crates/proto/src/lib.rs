//! What the bytes of the TS3100 simple protocol say, in both directions: texts, messages, commands,
//! replies, files, status bodies, parameter files, permission tables. It leaves everything that has a
//! state of the robot, a time, or a line to its users, so that host programs can use it too.

#![no_std]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod calendar;
pub mod command;
pub mod dissect;
pub mod file;
pub mod message;
pub mod name;
pub mod parameter;
pub mod permission;
pub mod reply;
#[cfg(feature = "serde")]
pub mod serde_latin1;
pub mod status;
pub mod text;
