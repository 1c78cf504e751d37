//! Records of a controller and its peers: transcripts and captures, recordings of a real robot, their comparison,
//! scenarios and their results, reports for the authors of hosts.
//!
//! Nothing here owns a controller that hosts talk to: it subscribes to one ([`ts3100_driver::seat::Subscriber`]), or plays a
//! recording to one of its own ([`diff`]).
//!
//! Start with [`transcript`]; the others read or write its records.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod answers;
pub mod byte_log;
pub mod diff;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/every_event.rs"]
mod every_event;
pub mod faults;
mod player;
pub mod program_test;
pub mod replay;
pub mod reports;
pub mod scenario;
mod table_error;
pub mod tap;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/testing.rs"]
mod testing;
pub mod transcript;
pub mod uri;
