//! Expected response to a text of the host.

use core::fmt;
use ts3100_proto::command::{Answer, Command};

/// The reply that an exchange waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// No reply: the host has acknowledged the last text of a file.
    Nothing,
    /// OK or NG.
    Acknowledgement,
    /// A file in one or several texts, or NG.
    Content,
    /// A further text of a file.
    NextText,
    /// The file of SF, which may contain any byte and is read by its length; or NG.
    SystemStatus,
    /// The file of IO, which is read by its length too; or NG.
    LineWords,
    /// The SP by which a controller reports that the program has stopped.
    Stop,
    /// Any one text. The host acknowledges it with [`Conversation::acknowledge`](crate::Conversation::acknowledge).
    Text,
    /// Bytes, not cut into texts.
    Bytes,
}

impl Expected {
    /// The reply to this command.
    pub fn of(command: &Command) -> Expected {
        match (command.letters(), command.row().answer) {
            ("SF", _) => Expected::SystemStatus,
            ("IO", _) => Expected::LineWords,
            (_, Answer::Acknowledge) => Expected::Acknowledgement,
            (_, Answer::File | Answer::Status) => Expected::Content,
        }
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Expected::Nothing => "nothing",
            Expected::Acknowledgement => "OK or NG",
            Expected::Content | Expected::SystemStatus | Expected::LineWords => "FL or NG",
            Expected::NextText => "the next text of the file",
            Expected::Stop => "SP",
            Expected::Text => "a text",
            Expected::Bytes => "bytes",
        })
    }
}
