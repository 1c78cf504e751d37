//! The product around the controller: configuration, command line, HTTP control interface, recordings and reports.
//!
//! It does not decide what the robot does. Bytes are decoded in `ts3100-proto`, commands are executed in
//! `ts3100-controller`, and SCOL is compiled and run in `scol-mini`. Start reading at [`launch`], which starts a
//! driver (`ts3100-driver`) as configured; [`cli`] and [`control`] are the two ways users reach it, and [`embed`] is the third, for Rust tests.

pub mod cli;
pub mod client;
pub mod config;
pub mod control;
pub mod diff;
pub mod embed;
pub mod faults;
pub mod headless;
pub mod launch;
pub mod loading;
pub mod log;
mod printable;
pub mod ready;
pub mod reports;
pub mod scenario;
pub mod tap;
#[cfg(test)]
#[path = "../../driver/src/testing.rs"]
mod testing;
pub mod transcript;
pub mod watch;

pub use ts3100_driver::{clock, serial, snapshot};
