//! The daemon around the pure controller: TCP links, clock, storage, configuration, command line, and
//! [`embed`] for tests that want emulators in their own process. What bytes mean, what a command does and
//! what SCOL is, is known elsewhere: in `ts3100-proto`, `ts3100-controller` and `scol-mini`.

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
