//! Emulators in this process, by the embedding API, with real sockets, terminals and files.

mod api;
mod faults;
mod recordings;
#[cfg(unix)]
mod serial;
mod snapshots;
