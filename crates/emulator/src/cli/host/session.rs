//! One connection of `ts3100 host`: sends commands, reads texts (framed messages), acknowledges files after the
//! advised pause, and separates an unsolicited SP from an answer.
//!
//! Plain blocking sockets are enough, because a host does one thing at a time. Framing and file transfer come from
//! `ts3100-proto`. SF and IO contain arbitrary bytes and are read by length, everything else up to ETX.

use super::address::{NoAnswer, dial, robot_hint};
use crate::log::print_warning;
use std::fmt::Display;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use ts3100_controller::limits;
use ts3100_proto::command::Command;
use ts3100_proto::escape::Escaped;
use ts3100_proto::file::{FileRule, FlReceiver, Received};
use ts3100_proto::reply::Reply;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::io::{self as io_words, LineWords};
use ts3100_proto::status::sf::{SfLayout, SystemStatus};
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{self, Checksum, Decoded, EndRule, Framing, StxRule, TextDecoder, TextOptions};

/// Bytes read at once.
const READ_BUFFER: usize = 1_024;
/// Largest file taken from a controller: a full RAM drive and its directory are smaller.
const MAX_CONTENT: usize = 4 * 1024 * 1024;

/// Most bytes of an answer that a message shows: a text of the controller, whole.
const MAX_SHOWN: usize = 256;
/// Most warnings of one command. A peer that never ends sending what is no answer would otherwise fill the terminal.
const MAX_WARNINGS: usize = 10;
/// Most bytes of an unsolicited SP with everything before its ETX.
const MAX_SP: usize = text::MAX_DATA + 2;

/// These words and the bytes that came; nothing if none did.
fn with_bytes(words: &str, found: &[u8]) -> String {
    match found {
        [] => String::new(),
        found => format!("{words} {}", shown(found)),
    }
}

/// The bytes for people, cut off where they are more than a text has.
fn shown(bytes: &[u8]) -> String {
    match bytes.split_at_checked(MAX_SHOWN) {
        Some((begin, rest)) if !rest.is_empty() => {
            format!("{} and {} bytes more", Escaped::for_reading(begin), rest.len())
        }
        _ => Escaped::for_reading(bytes).to_string(),
    }
}

/// Pause between two questions for the status while a program runs.
const STATUS_PAUSE: Duration = Duration::from_millis(100);

/// Something else came than was expected.
fn unexpected(expected: &str, found: &[u8]) -> NoAnswer {
    let found = shown(found);
    NoAnswer::new(format_args!("answer: expected {expected}, found {found}"))
}

/// A file that is not what the command asks for.
pub(super) fn unreadable(letters: &str, reason: &impl Display, found: &[u8]) -> NoAnswer {
    let found = shown(found);
    NoAnswer::new(format_args!(
        "cannot read the answer to {letters}: {reason}; the answer is {found}"
    ))
}

/// Deadline of a wait, with its length for messages.
#[derive(Clone, Copy)]
struct Limit {
    end: Instant,
    length: Duration,
}

impl Limit {
    /// From now on.
    fn new(length: Duration) -> Limit {
        let end = Instant::now() + length;
        Limit { end, length }
    }
}

/// A connection to a controller.
pub(super) struct Session {
    /// As given.
    address: String,
    stream: TcpStream,
    framing: Framing,
    timeout: Duration,
    /// The limit of everything; none while the end of a program is waited for.
    total: Option<Limit>,
    decoder: TextDecoder,
    /// Received, not yet given to the decoder.
    received: Vec<u8>,
    /// Warnings so far, shown or not.
    warnings: usize,
}

impl Session {
    /// Connects. `timeout` is the longest wait for the connection and for each answer, `total` for everything.
    pub(super) fn connect(
        address: &str,
        no_stx: bool,
        timeout: Duration,
        total: Duration,
    ) -> anyhow::Result<Session> {
        let total = Some(Limit::new(total));
        let stream = dial(address, timeout)?;
        let (framing, stx) = if no_stx {
            (Framing::Bare, StxRule::Detect)
        } else {
            (Framing::Stx, StxRule::Required)
        };
        let checksum = Checksum::None;
        Ok(Session {
            address: address.to_owned(),
            stream,
            framing,
            timeout,
            total,
            decoder: TextDecoder::new(TextOptions {
                stx,
                end: EndRule::Etx,
                checksum,
            }),
            received: Vec::new(),
            warnings: 0,
        })
    }

    /// A command that is answered by OK or NG: whether it is OK.
    pub(super) fn plain(&mut self, command: &Command) -> Result<bool, NoAnswer> {
        self.send(&command.encode())?;
        self.ok_or_ng()
    }

    /// Whether the last text sent is answered by OK; false for NG.
    pub(super) fn ok_or_ng(&mut self) -> Result<bool, NoAnswer> {
        const EXPECTED: &str = "OK or NG";
        let data = self.answer(EXPECTED)?;
        match Reply::parse(&data) {
            Ok(Reply::Ok) => Ok(true),
            Ok(Reply::Ng) => Ok(false),
            _ => Err(unexpected(EXPECTED, &data)),
        }
    }

    /// A command that is answered by a file: its content without EOF; `None` if the answer is NG.
    pub(super) fn file(&mut self, command: &Command) -> Result<Option<Vec<u8>>, NoAnswer> {
        self.send(&command.encode())?;
        let data = self.answer(FILE)?;
        if matches!(Reply::parse(&data), Ok(Reply::Ng)) {
            return Ok(None);
        }
        self.receive(data).map(Some)
    }

    fn receive(&mut self, first: Vec<u8>) -> Result<Vec<u8>, NoAnswer> {
        let mut receiver = FlReceiver::new(MAX_CONTENT, FileRule::Parameter);
        let mut data = first;
        loop {
            let received = receiver.push(&data);
            if !matches!(received, Received::Refused(_)) {
                self.acknowledge()?;
            }
            match received {
                Received::Complete(content) => return Ok(content),
                Received::More => data = self.answer("the next text of the file")?,
                Received::Refused(fault) => return Err(unreadable("FL", &fault, &data)),
            }
        }
    }

    /// SF, in one text or two, of either layout; `None` if the answer is NG.
    pub(super) fn system_status(&mut self, command: &Command) -> Result<Option<SystemStatus>, NoAnswer> {
        let Some(limit) = self.begin_file(command)? else {
            return Ok(None);
        };
        let whole = FL.len() + SfLayout::Eight.len() + 1;
        // One text of eight floats a group has names where every other first text has its ETX, after 253 data bytes;
        // names have no control codes.
        let full = self.stx_length() + text::MAX_DATA + 1;
        self.fill(full, limit)?;
        let begin = self.received.get(..full).unwrap_or_default();
        let (layout, data) = if begin.ends_with(&[text::ETX]) {
            let mut data = self.binary(text::MAX_DATA, SF_TEXT)?;
            let layout = SfLayout::from_first_text(data.get(FL.len()..).unwrap_or_default());
            // The first of the manual's two texts (SF-02).
            if layout == SfLayout::Eight {
                data.extend(self.binary(whole - text::MAX_DATA, SF_TEXT)?);
            }
            (layout, data)
        } else {
            (SfLayout::Eight, self.binary(whole, SF_TEXT)?)
        };
        let content = data.get(FL.len()..FL.len() + layout.len());
        let content = content.unwrap_or_default();
        let decoded = SystemStatus::decode(content, layout);
        decoded
            .map(Some)
            .map_err(|error| unreadable("SF", &error, content))
    }

    /// IO, which ends with its 80 bytes (hosts 8.2); one with EOF, or EOF and CR, is read too. `None` if the answer is
    /// NG.
    pub(super) fn lines(&mut self, command: &Command) -> Result<Option<LineWords>, NoAnswer> {
        let Some(limit) = self.begin_file(command)? else {
            return Ok(None);
        };
        let length = FL.len() + io_words::LENGTH;
        let mut ending = 0;
        for byte in [text::EOF, text::CR] {
            let at = self.stx_length() + length + ending;
            self.fill(at + 1, limit)?;
            ending += usize::from(self.received.get(at) == Some(&byte));
        }
        let data = self.binary(length + ending, "a text of IO")?;
        let content = data.get(FL.len()..length).unwrap_or_default();
        let decoded = io_words::decode_lines(content);
        decoded.map(Some).map_err(|error| unreadable("IO", &error, &data))
    }

    /// A command that is answered by a file that is read by length, as soon as its answer begins: the limit of the answer;
    /// `None` if the answer is NG.
    fn begin_file(&mut self, command: &Command) -> Result<Option<Limit>, NoAnswer> {
        self.send(&command.encode())?;
        let limit = Limit::new(self.timeout);
        if self.starts_with_fl(limit)? {
            return Ok(Some(limit));
        }
        let data = self.answer(FILE)?;
        match Reply::parse(&data) {
            Ok(Reply::Ng) => Ok(None),
            _ => Err(unexpected(FILE, &data)),
        }
    }

    /// Bytes in front of the data section.
    fn stx_length(&self) -> usize {
        usize::from(self.framing == Framing::Stx)
    }

    /// Waits for the beginning of an answer: whether it is an FL. An SP in front of it is reported.
    fn starts_with_fl(&mut self, limit: Limit) -> Result<bool, NoAnswer> {
        loop {
            self.fill(self.stx_length() + FL.len(), limit)?;
            let start = self.received.get(self.stx_length()..).unwrap_or_default();
            if !start.starts_with(b"SP") {
                return Ok(start.starts_with(FL));
            }
            let end = loop {
                if let Some(end) = self.received.iter().position(|byte| *byte == text::ETX) {
                    break end;
                }
                if self.received.len() > MAX_SP {
                    return Err(unexpected(FILE, &self.received));
                }
                self.fill(self.received.len() + 1, limit)?;
            };
            self.received.drain(..=end);
            self.warn(UNSOLICITED_SP);
        }
    }

    /// A text cut by length; it is acknowledged.
    fn binary(&mut self, length: usize, expected: &str) -> Result<Vec<u8>, NoAnswer> {
        self.decoder.expect_binary(length);
        let data = self.answer(expected)?;
        self.acknowledge()?;
        Ok(data)
    }

    /// Waits until the program has stopped: for the SP by which the controller says so, or, as it says nothing to hosts
    /// that send no STX (D7), by asking for its status. Returns what to print of it.
    pub(super) fn wait_for_stop(&mut self, limit: Option<Duration>) -> Result<&'static str, NoAnswer> {
        const EXPECTED: &str = "SP";
        self.total = None;
        let limit = limit.map(Limit::new);
        if self.framing == Framing::Bare {
            self.poll_until_stopped(limit)?;
            return Ok("stopped");
        }
        let data = self.text(EXPECTED, limit)?;
        match Reply::parse(&data) {
            Ok(Reply::Sp) => Ok(EXPECTED),
            _ => Err(unexpected(EXPECTED, &data)),
        }
    }

    fn poll_until_stopped(&mut self, limit: Option<Limit>) -> Result<(), NoAnswer> {
        loop {
            std::thread::sleep(STATUS_PAUSE);
            let content = self.file(&Command::Su)?.unwrap_or_default();
            let status = StatusBody::decode(&content).map_err(|error| unreadable("SU", &error, &content))?;
            if status.execution != ExecutionStatus::Running {
                return Ok(());
            }
            if let Some(limit) = limit
                && limit.end <= Instant::now()
            {
                return Err(NoAnswer::new(format_args!(
                    "the program is still running after {} s",
                    limit.length.as_secs_f64()
                )));
            }
        }
    }

    /// Sends a text in one write.
    pub(super) fn send(&mut self, data: &[u8]) -> Result<(), NoAnswer> {
        let bytes = text::encode_text(data, self.framing, Checksum::None);
        let sent = self.stream.write_all(&bytes);
        sent.map_err(|error| NoAnswer::new(format_args!("cannot send to {}: {error}", self.address)))
    }

    /// The pause a host should leave after a text of the controller (TRN-04).
    pub(super) fn pause(&self) {
        std::thread::sleep(limits::HOST_DELAY);
    }

    fn acknowledge(&mut self) -> Result<(), NoAnswer> {
        self.pause();
        self.send(&Reply::Ok.encode())
    }

    /// The next text that is no SP of the controller's own accord.
    fn answer(&mut self, expected: &str) -> Result<Vec<u8>, NoAnswer> {
        let limit = Limit::new(self.timeout);
        loop {
            let data = self.text(expected, Some(limit))?;
            if !matches!(Reply::parse(&data), Ok(Reply::Sp)) {
                return Ok(data);
            }
            self.warn(UNSOLICITED_SP);
        }
    }

    /// Prints a warning, unless there were many already.
    fn warn(&mut self, words: &str) {
        self.warnings += 1;
        if self.warnings < MAX_WARNINGS {
            print_warning(words);
        } else if self.warnings == MAX_WARNINGS {
            print_warning(format_args!("{words}; further warnings are left out"));
        }
    }

    fn text(&mut self, expected: &str, limit: Option<Limit>) -> Result<Vec<u8>, NoAnswer> {
        loop {
            self.decoder.push(&std::mem::take(&mut self.received));
            match self.decoder.next() {
                Some(Decoded::Text(text)) if text.error.is_some() => {
                    return Err(unexpected(expected, &text.data));
                }
                Some(Decoded::Text(text)) => return Ok(text.data.into()),
                Some(Decoded::Skipped { bytes }) => {
                    self.warn(&format!("skipped {bytes} bytes outside a text"));
                }
                None => self.read(expected, limit)?,
            }
        }
    }

    /// Reads until so many bytes stand ready for the decoder.
    fn fill(&mut self, length: usize, limit: Limit) -> Result<(), NoAnswer> {
        while self.received.len() < length {
            // A short answer (NG) is complete before the length is reached.
            if self.received.contains(&text::ETX) && !self.received.windows(FL.len()).any(|part| part == FL) {
                return Ok(());
            }
            self.read(FILE, Some(limit))?;
        }
        Ok(())
    }

    fn read(&mut self, expected: &str, limit: Option<Limit>) -> Result<(), NoAnswer> {
        let now = Instant::now();
        let late = |limit: Limit, flag: &str| {
            let length = limit.length.as_secs_f64();
            let found = with_bytes(", found only", &self.received);
            let (address, hint) = (&self.address, robot_hint(&self.address));
            NoAnswer::new(format_args!(
                "{address} does not answer within {length} s{flag}: expected {expected}{found}{hint}"
            ))
        };
        if let Some(total) = self.total.filter(|total| total.end <= now) {
            return Err(late(total, " (--total)"));
        }
        let ends = limit.into_iter().chain(self.total).map(|limit| limit.end);
        let left = ends.min().map(|end| end.saturating_duration_since(now));
        if let (Some(Duration::ZERO), Some(limit)) = (left, limit) {
            return Err(late(limit, ""));
        }
        let mut buffer = [0; READ_BUFFER];
        let configured = self.stream.set_read_timeout(left);
        match configured.and_then(|()| self.stream.read(&mut buffer)) {
            Ok(0) => {
                let (address, found) = (&self.address, with_bytes(" after", &self.received));
                return Err(NoAnswer::new(format_args!(
                    "{address} closed the connection{found} instead of sending {expected}"
                )));
            }
            Ok(length) => {
                let bytes = buffer.get(..length).unwrap_or_default();
                self.received.extend_from_slice(bytes);
                if self.received.starts_with(HTTP) {
                    return Err(not_a_robot(&self.address));
                }
            }
            // Looked at anew: one of the limits is over.
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => {
                let address = &self.address;
                return Err(NoAnswer::new(format_args!("cannot read from {address}: {error}")));
            }
        }
        Ok(())
    }
}

/// The error for a web server at this address.
fn not_a_robot(address: &str) -> NoAnswer {
    NoAnswer::new(format_args!(
        "{address} answers in HTTP, as the control interface does: give the address of IP0{}",
        robot_hint(address)
    ))
}

/// Beginning of an answer of a web server.
const HTTP: &[u8] = b"HTTP/1.";
/// Beginning of a file.
const FL: &[u8] = b"FL,";
/// Answer to most commands, for messages.
const FILE: &str = "FL or NG";
/// Answer to SF, for messages.
const SF_TEXT: &str = "a text of SF";

/// The warning of an SP that is not the answer.
const UNSOLICITED_SP: &str = "SP came before the answer: the controller has stopped by itself";
