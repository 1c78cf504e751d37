//! Emulators in this process, by the embedding API, with real sockets, terminals and files.

mod api;
mod control;
mod faults;
mod recordings;
#[path = "../../clients/rust-example/tests/robot.rs"]
mod rust_example;
#[cfg(unix)]
mod serial;
mod snapshots;
