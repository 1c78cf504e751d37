//! The messages of an editor on stdin, for `ts3100 lsp` and `ts3100 dap`.

use std::io::{self, BufReader};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use ts3100_workbench::framing::{self, FramingError};

/// Messages that are read ahead; an editor that sends more waits.
pub(super) const AHEAD: usize = 256;

/// A message; `None` where the stream ends.
pub(super) type Message = Result<Option<Vec<u8>>, FramingError>;

/// Reads messages in a thread, so that all that have arrived are there together. Others may end the stream by the sender.
///
/// # Errors
/// The thread cannot be started.
pub(super) fn messages() -> io::Result<(SyncSender<Message>, Receiver<Message>)> {
    let (sender, messages) = sync_channel(AHEAD);
    let reader = sender.clone();
    // It ends with the process, since a read of stdin cannot be given up.
    thread::Builder::new().name("stdin".to_owned()).spawn(move || {
        let mut stdin = BufReader::new(io::stdin());
        loop {
            let message = framing::read(&mut stdin);
            let is_last = !matches!(message, Ok(Some(_)));
            if reader.send(message).is_err() || is_last {
                return;
            }
        }
    })?;
    Ok((sender, messages))
}
