//! Tests of the binary `ts3100` from outside: processes, exit codes, bytes on sockets. Ports are chosen by
//! the system, nothing waits by the clock.

mod client;
mod serve;
mod support;
