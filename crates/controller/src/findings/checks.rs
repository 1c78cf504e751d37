//! Checks of what a host sends and does against the rules of `rules`.
//!
//! Nothing here changes an answer: the exchange of commands itself is in `exchange`, which calls these checks.
//! `history` is what they remember of a host between texts.

use super::{MAX_BYTES, Message, Rule, rules};
use crate::context::Context;
use crate::drive::DriveError;
use crate::endpoint::Endpoints;
use crate::endpoint::session::Exchange;
use crate::limits::HOST_DELAY;
use crate::ops::{OperateError, Refusal};
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::command::{Answer, Command, InternalCommand};
use ts3100_proto::file::FileError;
use ts3100_proto::name::FileName;
use ts3100_proto::reply::Reply;
use ts3100_proto::text::{CR, EOF, ETX, LF, STX};

/// Shortest time between two requests for the same status: the request, 50 ms, OK, 50 ms (TRN-04).
const MIN_POLL_INTERVAL: Duration = HOST_DELAY.saturating_mul(2);
/// Refusals of the same command in a row that make a finding.
const REPEATED_REFUSALS: u32 = 3;
/// Symbols of 5.2.2; blank, colon and underscore are missing in its list but used elsewhere (FRM-12).
const SYMBOLS: &[u8] = b"\"'()+-*/,.<>=![]{}%^&?; :_";

/// Checks of the bytes alone.
impl Context {
    /// A second peer came to a port that has one.
    pub(crate) fn report_second_peer(&mut self, port: Port, peer: &str, kept: bool) {
        let what = if kept {
            "it takes the place of the first"
        } else {
            "it is turned away"
        };
        let message = format!("{peer} came while {port} had a peer; {what} (channel.second)");
        self.report(&rules::SECOND_CONNECTION, port, &[], message);
    }

    /// The peer does not read.
    pub(crate) fn report_backlog(&mut self, port: Port) {
        let message = format!("the peer of {port} has left so much unread that its connection is closed");
        self.report(&rules::ANSWERS_UNREAD, port, &[], message);
    }

    /// Wires do not settle.
    pub(crate) fn report_wire_loop(&mut self, wires: &str) {
        let message = format!("these wires go on changing each other at one moment: {wires}");
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
            let text = "FL in lower case is taken as FL";
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
            self.report(rule, port, message, format!("\"{text}\" is taken as {letters}"));
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

/// Checks that look at the robot.
impl Robot {
    /// Checks what the arm did when the peer of a port disconnected.
    pub(crate) fn check_left_jogging(&mut self, port: Port) {
        if self.arm.is_guided_from(port) && self.arm.is_jogging() {
            let text = "the connection ended while JG guided the arm; it stops";
            self.context.report(&rules::LEFT_JOGGING, port, &[], text);
        }
    }

    /// Checks what a program had of the peer of its channel that disconnected.
    pub(crate) fn check_left_channel(&mut self, port: Port) {
        let Some(channel) = self.channels.get(port).filter(|channel| channel.peer().is_some()) else {
            return;
        };
        let half = channel.partial_value();
        if !half.is_empty() {
            let text = "the peer left after a value without comma or CR; it is dropped";
            self.context.report(&rules::HALF_VALUE, port, &half, text);
        }
        if self.executor.program_runs() {
            let line = self.executor.line();
            let text = format!("the peer left while the program runs, at line {line}");
            self.context.report(&rules::PEER_LEFT, port, &[], text);
        }
    }

    /// The rule that a command breaks by being obeyed now. Call it only for a command that is not refused.
    pub(crate) fn command_risk(&self, command: &Command) -> Option<(&'static Rule, &'static str)> {
        if *command == Command::Br && self.executor.is_running() {
            let text = "BR while the robot runs; the motion is broken off (CMD-BR-02)";
            return Some((&rules::SERVO_OFF_RUNNING, text));
        }
        if matches!(command, Command::Mw(_)) && self.executor.program_runs() {
            let text = "MW while the program runs; it acts at once (CMD-MW-06)";
            return Some((&rules::WRITE_WHILE_RUNNING, text));
        }
        let too_long = matches!(command, Command::Dl(name) if !name.fits_editor());
        let text = "the file is taken; file names have at most 8 characters and an extension of at most 3";
        too_long.then_some((&rules::LONG_FILE_NAME, text))
    }

    /// Checks a file that was downloaded; `last` is the data of its last text.
    pub(crate) fn check_download(&mut self, port: Port, name: &FileName, content: &[u8], last: &[u8]) {
        let label = name.as_str();
        if last.ends_with(&[EOF, CR]) {
            let text = format!("{label}: CR after EOF; taken all the same");
            self.context.report(&rules::CR_AFTER_EOF, port, last, text);
        }
        if name.is_parameter() {
            let text = format!("{label} is stored and acts after the power was off (5.2.3)");
            self.context.report(&rules::PARAMETER_PENDING, port, last, text);
            for problem in self.problems(label, content) {
                self.context
                    .report(&rules::PARAMETER_BROKEN, port, &[], format!("{label}: {problem}"));
            }
            return;
        }
        if let Some(at) = content.iter().position(|byte| *byte == LF) {
            let line = content
                .get(at.saturating_sub(MAX_BYTES / 2)..=at)
                .unwrap_or_default();
            let text = format!("{label}: lines end with LF; taken all the same (5.4.1)");
            self.context.report(&rules::FILE_LINE_ENDS, port, line, text);
        }
        if self.executor.file() == label {
            let text = format!("{label} is selected; the next RN takes the new one");
            self.context.report(&rules::SELECTED_OVERWRITTEN, port, &[], text);
        }
    }

    /// Checks bytes received on a SCOL channel.
    pub(crate) fn check_data(&mut self, port: Port, bytes: &[u8]) {
        if bytes.contains(&STX) || bytes.contains(&ETX) {
            let text = format!("STX or ETX came on {port}, which carries data for INPUT only (4)");
            self.context
                .report(&rules::PROTOCOL_ON_CHANNEL, port, bytes, text);
        }
        if bytes.contains(&LF) {
            let text = "LF in a record; it is left out";
            self.context.report(&rules::INPUT_LINE_FEED, port, bytes, text);
        }
        if !self.executor.reads_from(port) {
            let text = format!(
                "data came on {port} while no INPUT waited; the manual says it may be ignored (4.1.2)"
            );
            self.context.report(&rules::DATA_BEFORE_INPUT, port, bytes, text);
        }
    }
}

/// Checks of the conversation on a port.
impl Endpoints {
    /// Whether a text belongs to a file although no download is open. Such a text ends without CR (FL-01), so it must
    /// not be reported as one that lacks it.
    pub(crate) fn is_stray_file(&mut self, port: Port, data: &[u8]) -> bool {
        let session = self.session(port);
        let message = data.strip_suffix(&[CR]).unwrap_or(data);
        !session.joiner.is_partial()
            && (begins_file(data) || session.history.file_refused && Command::parse(message).is_err())
    }

    /// Remembers that a text of a file was refused, unless it was the last.
    pub(crate) fn check_refused_file(&mut self, port: Port, data: &[u8]) {
        let ended = data.ends_with(&[EOF]) || data.ends_with(&[EOF, CR]);
        self.session(port).history.file_refused = !ended;
    }

    /// Checks a command against the present state and the previous commands.
    pub(crate) fn check_command(
        &mut self,
        context: &mut Context,
        port: Port,
        message: &Bytes,
        command: &Command,
    ) {
        if command.is_extension() {
            let answer = if context.config.serves(command) {
                "served"
            } else {
                "NG"
            };
            let row = command.permission_row();
            let text = format!("{row} is not in Table 5.1; {answer} (option `extensions`)");
            context.report(&rules::EXTENSION_COMMAND, port, message, text);
        }
        if command.row().answer != Answer::Status {
            return;
        }
        let since = self.session(port).history.note_poll(message, context.now);
        if let Some(since) = since.filter(|since| *since < MIN_POLL_INTERVAL) {
            let command = command.letters();
            let again = Message::Again { command, since };
            context.report_shared(&rules::POLL_FAST, Some(port), message.clone(), again);
        }
    }

    /// Counts refusals of the same message in a row.
    pub(crate) fn check_repeat(&mut self, context: &mut Context, port: Port, message: &[u8], refused: bool) {
        let last_refused = &mut self.session(port).history.last_refused;
        let before = last_refused.take().filter(|(text, _)| text == message);
        if !refused {
            return;
        }
        let times = before.map_or(0, |(_, times)| times).saturating_add(1);
        *last_refused = Some((message.to_vec(), times));
        if times >= REPEATED_REFUSALS {
            let text = format!("the same command was refused {times} times in a row");
            context.report(&rules::REPEATED_REFUSAL, port, message, text);
        }
    }

    /// Checks in what state the host of HOST or IP0 disconnected.
    pub(crate) fn check_left_exchange(&mut self, context: &mut Context, port: Port) {
        let Some(session) = self.sessions.get(&port).filter(|session| session.peer.is_some()) else {
            return;
        };
        let what = match session.exchange() {
            Exchange::Sending { .. } => "where OK or NG to an FL text was awaited",
            Exchange::Receiving { .. } => "in the middle of a download; nothing is stored",
            Exchange::Idle if session.is_partial() => "in the middle of a text",
            Exchange::Idle => return,
        };
        let text = format!("the connection ended {what}");
        context.report(&rules::LEFT_IN_EXCHANGE, port, &[], text);
    }
}

fn begins_file(data: &[u8]) -> bool {
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
