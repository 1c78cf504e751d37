//! Emulators in this process, by the embedding API, with real sockets, terminals and files.

mod api;
mod control;
mod faults;
mod recordings;
mod rust_page;
#[cfg(unix)]
mod serial;
mod snapshots;
