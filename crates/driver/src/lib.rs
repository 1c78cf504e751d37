//! The surroundings of a controller: sockets, serial lines, clock, disk, and the loop that owns it.
//!
//! Nothing here knows what bytes or statements mean; that is `ts3100-proto`, `scol-mini` and `ts3100-controller`. Nothing
//! here records, reports or serves HTTP either: who wants to know what happens is a [`seat::Subscriber`].
//!
//! Start with [`seat::Seat`], which feeds a controller without any I/O, then [`world::World`], robots that share one time,
//! and [`driver::Driver`], the loop around it.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod clock;
pub mod driver;
pub mod encoding;
pub mod files;
mod pause;
pub mod pc_file;
mod portion;
pub mod seat;
pub mod serial;
pub mod snapshot;
pub mod socket;
pub mod store;
pub mod tcp;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/testing.rs"]
mod testing;
pub mod world;
