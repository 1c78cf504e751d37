//! Message of a finding: words, or values that are formatted when the message is read.

use crate::prelude::*;
use alloc::sync::Arc;
use core::fmt;
use core::time::Duration;
use ts3100_proto::words::shortened;

/// Most characters in the message of a finding.
pub const MAX_MESSAGE: usize = 500;

/// Message in one line. A message that a hasty host causes with each text is formatted only when it is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Message {
    /// In words, shared by all who keep it; at most [`MAX_MESSAGE`] characters.
    Words(Arc<str>),
    /// A text came too soon after one of the controller.
    Early {
        /// `an answer` or `a text`.
        what: &'static str,
        /// How long after.
        since: Duration,
    },
    /// A command came where OK or NG was awaited.
    Interrupts {
        /// Its letters.
        command: &'static str,
    },
    /// The same request for a status came again too soon.
    Again {
        /// Its letters.
        command: &'static str,
        /// How long after.
        since: Duration,
    },
}

impl From<String> for Message {
    fn from(words: String) -> Message {
        Message::from(words.as_str())
    }
}

impl From<&str> for Message {
    fn from(words: &str) -> Message {
        Message::Words(shortened(words, MAX_MESSAGE).into())
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Message::Words(words) => f.write_str(words),
            Message::Early { what, since } => {
                let millis = since.as_micros() as f64 / 1e3;
                write!(
                    f,
                    "{what} {millis} ms after the controller's text; 50 ms expected (5.1)"
                )
            }
            Message::Interrupts { command } => {
                write!(
                    f,
                    "the host sent {command} instead of OK or NG; the exchange has ended"
                )
            }
            Message::Again { command, since } => {
                let millis = since.as_millis();
                write!(f, "{command} again after {millis} ms; wait at least 100 ms")
            }
        }
    }
}
