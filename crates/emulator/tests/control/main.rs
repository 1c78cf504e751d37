//! The control interface: who may call, what each call does, and that what it does is seen on the protocol side.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests, which may fail as tests do"
)]

mod clock;
#[cfg(unix)]
mod drive;
mod guard;
mod resources;
mod support;
mod whole;
