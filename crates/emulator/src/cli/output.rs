//! Output of subcommands to stdout and stderr. `println!` would end the process by a panic if the stream is closed or
//! its disk is full.

use anyhow::Context as _;
use std::fmt::Display;
use std::io::{self, ErrorKind, Write as _};

/// The result of writing to stdout. A closed pipe is not an error: the reader has seen enough.
///
/// # Errors
/// Stdout takes nothing for another reason, for example a full disk.
pub(super) fn written(result: io::Result<()>) -> anyhow::Result<()> {
    match result {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to stdout"),
    }
}

/// Writes all of this to stdout.
///
/// # Errors
/// As [`written`].
pub(super) fn print(text: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    written(stdout.write_all(text.as_ref()).and_then(|()| stdout.flush()))
}

/// Writes this to stderr. Errors are ignored: they cannot be reported.
pub(super) fn tell(text: impl Display) {
    let _ = io::stderr().write_all(text.to_string().as_bytes());
}
