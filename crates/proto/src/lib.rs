//! The bytes of the TS3100 simple protocol in both directions: texts, messages, commands, replies, files,
//! status bodies, parameter files and permission tables.
//!
//! Every module maps bytes to values and back. None knows the state of a robot, a clock or a connection, so that
//! host programs can use the crate too; the crate `ts3100-controller` gives commands their meaning.
//!
//! A newcomer follows a command from the wire: [`text`] cuts a byte stream into framed texts, [`message`] joins texts
//! to messages, [`command`] reads a message, [`status`] and [`reply`] are the way back.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]
#![no_std]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod calendar;
mod codes;
pub mod command;
pub mod dissect;
pub mod dissect_command;
pub mod escape;
pub mod file;
pub mod message;
pub mod name;
pub mod parameter;
pub mod permission;
mod prelude;
pub mod reply;
pub mod serde_latin1;
pub mod status;
pub mod text;
pub mod words;
