//! A host on a protocol port, as far as the rules need it: one exchange at a time, and whatever comes beside it.

use std::time::Duration;
use ts3100_controller::Time;
use ts3100_host::{Conversation, Expected, Options, Response};
use ts3100_proto::command::Command;

/// No host here waits for an answer by its own clock: a rule says how long one may take.
const NEVER: Duration = Duration::from_secs(365 * 24 * 3_600);

/// A request that is not answered yet.
#[derive(Debug, Clone)]
pub struct Asked {
    pub command: String,
    /// When something came for it last, or when it was sent.
    pub at: Time,
    /// A text was on its way when it was sent, or may have begun before the robot knew of it.
    pub crosses: bool,
    /// The file that is downloaded after the OK.
    pub file: Option<Vec<u8>>,
}

/// A host on a protocol port.
#[derive(Debug, Clone)]
pub struct Host {
    pub is_connected: bool,
    pub conversation: Conversation,
    /// It has sent noise, or a fault has hit its line: nothing is expected of answers until it connects again.
    pub is_spoiled: bool,
    pub asked: Option<Asked>,
    /// The last answer, with its time.
    pub response: Option<(Time, Response)>,
    /// Emergency stop and safety stop since its last SM.
    pub unseen: [bool; 2],
    /// Since when it is owed an SP.
    pub owed: Option<Time>,
    /// When its last exchange ended.
    pub idle_since: Time,
    /// Whether the manual has the command valid that is being answered, if it is sure.
    pub is_valid: Option<bool>,
    /// Bytes of the robot that it has not read.
    pub incoming: Vec<u8>,
    /// The robot has sent a part of a text.
    pub is_mid_text: bool,
}

impl Host {
    pub fn new() -> Host {
        let options = Options {
            pause: Duration::ZERO,
            timeout: NEVER,
            ..Options::with_stx()
        };
        Host {
            is_connected: false,
            conversation: Conversation::new(options),
            is_spoiled: false,
            asked: None,
            response: None,
            unseen: [false; 2],
            owed: None,
            idle_since: Time::ZERO,
            is_valid: None,
            incoming: Vec::new(),
            is_mid_text: false,
        }
    }

    /// It has connected just now.
    pub fn connect(&mut self) {
        *self = Host {
            is_connected: true,
            ..Host::new()
        };
    }

    /// Its connection has ended.
    pub fn leave(&mut self) {
        *self = Host::new();
    }

    /// Whether it may ask: it is there, and nothing is open.
    pub fn is_idle(&self) -> bool {
        self.is_connected && !self.is_spoiled && self.asked.is_none()
    }

    /// Begins an exchange. What cannot be read as a command is answered by NG.
    pub fn ask(&mut self, now: Time, command: &str, file: Option<Vec<u8>>) {
        let data = format!("{command}\r");
        let expected = Command::parse(command.as_bytes())
            .map_or(Expected::Acknowledgement, |command| Expected::of(&command));
        self.conversation.send(data.as_bytes(), expected);
        self.response = None;
        self.is_valid = None;
        self.asked = Some(Asked {
            command: command.to_owned(),
            at: now,
            crosses: self.is_mid_text,
            file,
        });
    }
}
