//! Tests of the binary `ts3100` from outside: processes, exit codes, bytes on sockets. Ports are chosen by
//! the system, nothing waits by the clock.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests, which may fail as tests do"
)]

mod client;
mod ctl;
mod evidence;
mod exec;
mod extensions;
#[cfg(unix)]
mod faults;
mod headless;
mod recordings;
#[cfg(unix)]
mod serial;
mod serve;
mod snapshots;
mod support;
mod tools;
