//! Tests of the binary `ts3100` from outside: processes, exit codes, bytes on sockets. Ports are chosen by
//! the system, nothing waits by the clock.

mod client;
mod ctl;
mod exec;
mod extensions;
#[cfg(unix)]
mod faults;
mod fleet;
mod headless;
mod mcp;
mod program_tests;
mod ready;
mod recordings;
mod reports;
#[cfg(unix)]
mod serial;
mod serve;
mod snapshots;
pub mod support;
mod survey;
mod tools;
#[cfg(unix)]
mod watch;
