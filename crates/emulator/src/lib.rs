//! The product `ts3100`: configuration, command line, embedding API, and what is put together at the start.
//!
//! It decides nothing about the robot: `ts3100-controller` does. The loop around the controller is in `ts3100-driver`, HTTP in
//! `ts3100-control`, transcripts, scenarios and reports in `ts3100-recording`. Start reading at [`launch`], which starts a
//! driver as configured; [`cli`] and [`control`] are two ways users reach it, [`embed`] is the third, for Rust tests.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod cli;
mod color;
pub mod config;
pub mod debugged;
pub mod embed;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/every_event.rs"]
mod every_event;
pub mod headless;
pub mod instances;
pub mod launch;
pub mod loading;
pub mod log;
pub mod named_values;
mod printed_lines;
pub mod profile;
pub mod program_test;
pub mod ready;
pub mod recorded;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/testing.rs"]
mod testing;
pub mod watch;

pub use ts3100_control as control;
pub use ts3100_control::client;
pub use ts3100_driver::{clock, serial, snapshot};
pub use ts3100_recording::{diff, faults, reports, scenario, tap, transcript};
