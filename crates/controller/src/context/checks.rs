//! Checks of the bytes of a host against the rules of `finding::rules`.
//!
//! Nothing here changes an answer. What looks at the conversation is in `endpoint::checks`, what looks at the robot in
//! `robot::checks`.

use crate::context::Context;
use crate::drive::DriveError;
use crate::finding::{Message, rules};
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::{OperateError, Refusal};
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::command::{Command, InternalCommand};
use ts3100_proto::file::FileError;
use ts3100_proto::reply::Reply;

/// Symbols of 5.2.2; blank, colon and underscore are missing in its list but used elsewhere (FRM-12).
const SYMBOLS: &[u8] = b"\"'()+-*/,.<>=![]{}%^&?; :_";

impl Context {
    /// A second peer came to a port that has one.
    pub(crate) fn report_second_peer(&mut self, port: Port, peer: &str, kept: bool) {
        let what = if kept {
            "it replaces the first"
        } else {
            "it is refused"
        };
        let message = format!("{peer} connected while {port} had a peer; {what} (option channel.second)");
        self.report(&rules::SECOND_CONNECTION, port, &[], message);
    }

    /// The peer does not read.
    pub(crate) fn report_backlog(&mut self, port: Port) {
        let message = format!("the peer of {port} does not read; its connection is closed");
        self.report(&rules::ANSWERS_UNREAD, port, &[], message);
    }

    /// Wires do not settle.
    pub(crate) fn report_wire_loop(&mut self, wires: &str) {
        let message = format!("these wires keep changing each other at one moment: {wires}");
        self.report(&rules::WIRE_LOOP, None, &[], message);
    }

    /// Reports a text received `since` after the controller's last one, less than the 50 ms of TRN-04.
    pub(crate) fn check_reply_pace(&mut self, port: Port, since: Duration, data: &Bytes) {
        let (rule, what) = match Reply::acknowledges(data) {
            true => (&rules::ANSWER_EARLY, "an answer"),
            false if since.is_zero() => (&rules::COMMAND_BEFORE_ANSWER, "a text"),
            false => (&rules::COMMAND_EARLY, "a text"),
        };
        let message = Message::Early { what, since };
        self.report_shared(rule, Some(port), data.clone(), message);
    }

    /// Checks how the first text of a file begins.
    pub(crate) fn check_file_begin(&mut self, port: Port, data: &[u8]) {
        if begins_file(data) && data.iter().take(2).any(u8::is_ascii_lowercase) {
            let text = "FL in lower case is read as FL";
            self.report(&rules::LOWER_CASE, port, data, text);
        }
    }

    /// Checks the spelling of a message that was accepted as a command.
    pub(crate) fn check_form(&mut self, port: Port, message: &[u8], command: &Command) {
        if let Command::Fl(_) = command {
            return;
        }
        let letters = command.letters();
        let lower_case = message.iter().take(2).any(u8::is_ascii_lowercase);
        let commas = command.row().separates_by_blanks() && outer_commas(message) > 1;
        let allowed = |byte: &u8| byte.is_ascii_alphanumeric() || SYMBOLS.contains(byte);
        let odd = !message.iter().all(allowed);
        let checks = [
            (&rules::LOWER_CASE, lower_case),
            (&rules::BLANK_AFTER_COMMA, message.get(2..4) == Some(b", ")),
            (&rules::BLANK_AT_END, message.last() == Some(&b' ')),
            (&rules::COMMA_FOR_BLANK, commas),
            (&rules::ODD_CHARACTER, odd),
            (&rules::ABBREVIATED, is_abbreviated(message, command)),
        ];
        for (rule, _) in checks.into_iter().filter(|(_, broken)| *broken) {
            let text = message.escape_ascii();
            self.report(rule, port, message, format!("\"{text}\" is read as {letters}"));
        }
    }

    /// Reports that a command that is valid now was refused, unless a finding since `outputs` outputs were waiting
    /// says why.
    pub(crate) fn check_refusal(&mut self, port: Port, command: &Command, reason: &Refusal, outputs: usize) {
        if self.outputs.has_finding_after(outputs) {
            return;
        }
        let rule = match (command, reason) {
            (Command::Rn, Refusal::Operate(OperateError::ServoOff)) => &rules::START_SERVO_OFF,
            (_, Refusal::NoDownload) => &rules::FILE_WITHOUT_DOWNLOAD,
            _ => &rules::REFUSED_BY_STATE,
        };
        let message = format!("{}: {reason}", command.letters());
        self.report(rule, port, &command.encode(), message);
    }

    /// Reports a text of a file that is refused.
    pub(crate) fn check_file(&mut self, port: Port, fault: &FileError, data: &[u8]) {
        let rule = match fault {
            FileError::NoPrefix | FileError::DataAfterEnd => &rules::FILE_MALFORMED,
            FileError::TooLarge { .. } => &rules::FILE_TOO_LARGE,
            FileError::Character { .. } | FileError::LongLine { .. } => &rules::FILE_BAD_LINE,
        };
        self.report(rule, port, data, fault.to_string());
    }

    /// Reports a complete file that could not be stored.
    pub(crate) fn check_store(&mut self, port: Port, error: &DriveError) {
        let rule = match error {
            DriveError::Content { .. } => &rules::FILE_BAD_LINE,
            DriveError::TooLarge { .. } | DriveError::Full { .. } => &rules::FILE_TOO_LARGE,
            // Not the host's fault.
            DriveError::NotPersisted { .. } => return,
            DriveError::TooMany { .. } | DriveError::Name(_) => &rules::REFUSED_BY_STATE,
        };
        self.report(rule, port, &[], error.to_string());
    }
}

/// Whether a text begins as one of a file does.
pub(crate) fn begins_file(data: &[u8]) -> bool {
    data.get(..3)
        .is_some_and(|start| start.eq_ignore_ascii_case(b"FL,"))
}

/// Commas outside the subscripts of an array element.
fn outer_commas(message: &[u8]) -> usize {
    let mut depth = 0_u32;
    let mut commas = 0;
    for byte in message {
        match byte {
            b'(' => depth = depth.saturating_add(1),
            b')' => depth = depth.saturating_sub(1),
            b',' if depth == 0 => commas += 1,
            _ => {}
        }
    }
    commas
}

/// Whether a mode is abbreviated, as in `EC,MODE CYC`. CONT is not reported: the maker's own library sends it.
fn is_abbreviated(message: &[u8], command: &Command) -> bool {
    let Command::Ec(InternalCommand::Mode(mode)) = command else {
        return false;
    };
    let text = message.trim_ascii_end();
    let ends_with = |word: &[u8]| {
        text.get(text.len().saturating_sub(word.len())..)
            .is_some_and(|end| end.eq_ignore_ascii_case(word))
    };
    !ends_with(mode.as_str().as_bytes()) && !ends_with(b"CONT")
}
