//! The product around the controller: TCP and serial ports, clock, storage, configuration, command line, HTTP
//! control interface and reports.
//!
//! It does not decide what the robot does. Bytes are decoded in `ts3100-proto`, commands are executed in
//! `ts3100-controller`, and SCOL is compiled and run in `scol-mini`. Start reading at [`driver`], which owns the
//! controller; [`cli`] and [`control`] are the two ways users reach it, and [`embed`] is the third, for Rust tests.

pub mod cell;
pub mod cli;
pub mod client;
pub mod clock;
pub mod config;
pub mod control;
pub mod diff;
pub mod driver;
pub mod embed;
pub mod faults;
mod files;
pub mod headless;
pub mod launch;
pub mod loading;
pub mod log;
mod port_queues;
mod printable;
pub mod ready;
pub mod reports;
pub mod scenario;
pub mod serial;
pub mod snapshot;
mod socket;
pub mod store;
pub mod tap;
pub mod tcp;
#[cfg(test)]
mod testing;
pub mod transcript;
pub mod watch;
