//! The product around the controller: configuration, command line, HTTP control interface, recordings and reports.
//!
//! It does not decide what the robot does. Bytes are decoded in `ts3100-proto`, commands are executed in
//! `ts3100-controller`, and SCOL is compiled and run in `scol-mini`. Start reading at [`launch`], which starts a
//! driver (`ts3100-driver`) as configured; [`cli`] and [`control`] are the two ways users reach it, and [`embed`] is the third, for Rust tests.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

pub mod cli;
pub mod config;
pub mod embed;
pub mod headless;
pub mod launch;
pub mod loading;
pub mod log;
pub mod ready;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../driver/src/testing.rs"]
mod testing;
pub mod watch;

pub use ts3100_control as control;
pub use ts3100_control::client;
pub use ts3100_driver::{clock, serial, snapshot};
pub use ts3100_recording::{diff, faults, reports, scenario, tap, transcript};
