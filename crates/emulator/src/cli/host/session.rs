//! One connection of `ts3100 host`: sends commands, reads texts (framed messages), acknowledges files after the
//! advised pause, and separates an unsolicited SP from an answer.
//!
//! Plain blocking sockets are enough, because a host does one thing at a time. Framing and file transfer come from
//! `ts3100-proto`. SF and IO contain arbitrary bytes and are read by length, everything else up to ETX.

use super::Answer;
use crate::loading::LoadError;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};
use ts3100_controller::limits;
use ts3100_driver::pc_file::NameError;
use ts3100_proto::command::Command;
use ts3100_proto::escape::Escaped;
use ts3100_proto::file::{FileRule, FlReceiver, Received};
use ts3100_proto::reply::Reply;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::io::{self as io_words, LineWords};
use ts3100_proto::status::sf::{SfLayout, SystemStatus};
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{self, Checksum, Decoded, Framing, StxRule, TextDecoder, TextOptions};

/// Bytes read at once.
const READ_BUFFER: usize = 1_024;
/// Largest file taken from a controller: a full RAM drive and its directory are smaller.
const MAX_CONTENT: usize = 4 * 1024 * 1024;

/// Why an exchange failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum HostError {
    /// The words of the command line make no command.
    #[error("`{message}` is no command: {reason}")]
    Command {
        /// The message they made.
        message: String,
        /// What was expected and found.
        reason: String,
    },
    /// The name of a file of the PC.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A file of the PC.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// No connection.
    #[error("cannot connect to {address}: {reason}")]
    Connect {
        /// Where.
        address: String,
        /// What the system said.
        reason: io::Error,
    },
    /// The connection broke.
    #[error("expected {expected}, but the connection failed: {reason}")]
    ConnectionFailed {
        /// What was awaited.
        expected: &'static str,
        /// What the system said.
        reason: io::Error,
    },
    /// The peer closed.
    #[error(
        "expected {expected}, but the peer closed the connection{}",
        after_bytes(found)
    )]
    Closed {
        /// What was awaited.
        expected: &'static str,
        /// Bytes of an unfinished text.
        found: Vec<u8>,
    },
    /// Nothing came.
    #[error("expected {expected} within {limit:?}, found {}", nothing_or(found))]
    Timeout {
        /// What was awaited.
        expected: &'static str,
        /// How long.
        limit: Duration,
        /// Bytes of an unfinished text.
        found: Vec<u8>,
    },
    /// All of it took too long, though something came again and again.
    #[error(
        "expected {expected}, but the command took longer than {limit:?} (--total); found {}",
        nothing_or(found)
    )]
    TotalTimeout {
        /// What was awaited.
        expected: &'static str,
        /// How long.
        limit: Duration,
        /// Bytes of an unfinished text.
        found: Vec<u8>,
    },
    /// Something else came.
    #[error("expected {expected}, found {}", Escaped::for_reading(found))]
    Unexpected {
        /// What was awaited.
        expected: &'static str,
        /// The text that came.
        found: Vec<u8>,
    },
    /// A file that is not what the command asks for.
    #[error(
        "the answer to {letters} cannot be read: {reason}; found {}",
        Escaped::for_reading(found)
    )]
    Content {
        /// The command.
        letters: &'static str,
        /// What was expected.
        reason: String,
        /// The content.
        found: Vec<u8>,
    },
    /// The result cannot be written.
    #[error("cannot write the result: {0}")]
    Output(io::Error),
}

fn after_bytes(found: &[u8]) -> String {
    if found.is_empty() {
        String::new()
    } else {
        format!(" after {}", Escaped::for_reading(found))
    }
}

fn nothing_or(found: &[u8]) -> String {
    if found.is_empty() {
        "nothing".to_owned()
    } else {
        format!("only {}", Escaped::for_reading(found))
    }
}

/// Pause between two questions for the status while a program runs.
const STATUS_PAUSE: Duration = Duration::from_millis(100);

/// How SF came: told by where its ETX stands.
enum SfForm {
    /// One text of eight floats a group.
    Long,
    /// A text of 253 data bytes: six floats a group, or the first of the manual's two texts (SF-02).
    Full,
}

/// A connection to a controller.
pub(super) struct Session {
    stream: TcpStream,
    framing: Framing,
    timeout: Duration,
    /// When everything is to be over, and how long that is; not while the end of a program is waited for.
    total_deadline: Option<(Instant, Duration)>,
    decoder: TextDecoder,
    /// Received, not yet given to the decoder.
    received: Vec<u8>,
}

impl Session {
    /// Connects. `limit` is the longest wait for the connection and for each answer, `total` for everything.
    pub(super) fn connect(
        address: &str,
        no_stx: bool,
        limit: Duration,
        total: Duration,
    ) -> Result<Session, HostError> {
        let end = Instant::now() + total;
        let refused = |reason| HostError::Connect {
            address: address.to_owned(),
            reason,
        };
        let mut last = io::Error::new(ErrorKind::NotFound, "no such address; expected HOST:PORT");
        for candidate in address.to_socket_addrs().map_err(refused)? {
            match TcpStream::connect_timeout(&candidate, limit) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(refused)?;
                    stream.set_write_timeout(Some(limit)).map_err(refused)?;
                    return Ok(Session {
                        total_deadline: Some((end, total)),
                        ..Session::over(stream, no_stx, limit)
                    });
                }
                Err(error) => last = error,
            }
        }
        Err(refused(last))
    }

    fn over(stream: TcpStream, no_stx: bool, limit: Duration) -> Session {
        let (framing, stx) = if no_stx {
            (Framing::Bare, StxRule::Detect)
        } else {
            (Framing::Stx, StxRule::Required)
        };
        let decoder = TextDecoder::new(TextOptions {
            stx,
            checksum: Checksum::None,
        });
        Session {
            stream,
            framing,
            timeout: limit,
            total_deadline: None,
            decoder,
            received: Vec::new(),
        }
    }

    /// A command that is answered by OK or NG.
    pub(super) fn plain(&mut self, command: &Command) -> Result<Answer, HostError> {
        self.send(&command.encode())?;
        self.ok_or_ng()
    }

    /// The OK or NG that answers the last text sent.
    pub(super) fn ok_or_ng(&mut self) -> Result<Answer, HostError> {
        const EXPECTED: &str = "OK or NG";
        let data = self.answer(EXPECTED)?;
        match Reply::parse(&data) {
            Ok(Reply::Ok) => Ok(Answer::Positive),
            Ok(Reply::Ng) => Ok(Answer::Negative),
            _ => Err(HostError::Unexpected {
                expected: EXPECTED,
                found: data,
            }),
        }
    }

    /// A command that is answered by a file: its content without EOF; `None` if the answer is NG.
    pub(super) fn file(&mut self, command: &Command) -> Result<Option<Vec<u8>>, HostError> {
        self.send(&command.encode())?;
        let data = self.answer(FILE)?;
        if matches!(Reply::parse(&data), Ok(Reply::Ng)) {
            return Ok(None);
        }
        self.receive(data).map(Some)
    }

    fn receive(&mut self, first: Vec<u8>) -> Result<Vec<u8>, HostError> {
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
                Received::Refused(fault) => {
                    return Err(HostError::Content {
                        letters: "FL",
                        reason: fault.to_string(),
                        found: data,
                    });
                }
            }
        }
    }

    /// SF, in one text or two, of either layout; `None` if the answer is NG.
    pub(super) fn system_status(&mut self, command: &Command) -> Result<Option<SystemStatus>, HostError> {
        self.send(&command.encode())?;
        let whole = FL.len() + SfLayout::Eight.len() + 1;
        let (layout, data) = match self.system_status_form()? {
            None => return self.ng_or_unexpected(),
            Some(SfForm::Long) => {
                let data = self.binary(whole, SF_TEXT)?;
                self.acknowledge()?;
                (SfLayout::Eight, data)
            }
            Some(SfForm::Full) => {
                let mut data = self.binary(text::MAX_DATA, SF_TEXT)?;
                self.acknowledge()?;
                let layout = SfLayout::from_first_text(data.get(FL.len()..).unwrap_or_default());
                if layout == SfLayout::Eight {
                    data.extend(self.binary(whole - text::MAX_DATA, SF_TEXT)?);
                    self.acknowledge()?;
                }
                (layout, data)
            }
        };
        let content = data
            .get(FL.len()..FL.len() + layout.len())
            .unwrap_or_default()
            .to_vec();
        let decoded = SystemStatus::decode(&content, layout);
        let failed = |reason: String| HostError::Content {
            letters: "SF",
            reason,
            found: content.clone(),
        };
        decoded.map(Some).map_err(|error| failed(error.to_string()))
    }

    /// Waits until the form of an SF answer is plain; `None` if what came is no FL.
    fn system_status_form(&mut self) -> Result<Option<SfForm>, HostError> {
        let deadline = Instant::now() + self.timeout;
        if !self.starts_with_fl(deadline)? {
            return Ok(None);
        }
        // In the long text names stand where the others have their ETX, and names have no control codes.
        let full = self.stx_length() + text::MAX_DATA + 1;
        self.fill(full, deadline)?;
        let end = self.received.get(..full).unwrap_or_default();
        Ok(Some(if end.ends_with(&[text::ETX]) {
            SfForm::Full
        } else {
            SfForm::Long
        }))
    }

    /// IO, which ends with its 80 bytes (hosts 8.2); one with EOF, or EOF and CR, is read too. `None` if the answer is
    /// NG.
    pub(super) fn lines(&mut self, command: &Command) -> Result<Option<LineWords>, HostError> {
        self.send(&command.encode())?;
        let deadline = Instant::now() + self.timeout;
        if !self.starts_with_fl(deadline)? {
            return self.ng_or_unexpected();
        }
        let length = FL.len() + io_words::LENGTH;
        let mut ending = 0;
        for byte in [text::EOF, text::CR] {
            let at = self.stx_length() + length + ending;
            self.fill(at + 1, deadline)?;
            ending += usize::from(self.received.get(at) == Some(&byte));
        }
        let data = self.binary(length + ending, "a text of IO")?;
        self.acknowledge()?;
        let content = data
            .get(FL.len()..FL.len() + io_words::LENGTH)
            .unwrap_or_default();
        let decoded = io_words::decode_lines(content);
        decoded.map(Some).map_err(|error| HostError::Content {
            letters: "IO",
            reason: error.to_string(),
            found: data,
        })
    }

    /// The answer in place of a file that is read by length: `None` for NG.
    fn ng_or_unexpected<T>(&mut self) -> Result<Option<T>, HostError> {
        let data = self.answer(FILE)?;
        match Reply::parse(&data) {
            Ok(Reply::Ng) => Ok(None),
            _ => Err(HostError::Unexpected {
                expected: FILE,
                found: data,
            }),
        }
    }

    /// Bytes in front of the data section.
    fn stx_length(&self) -> usize {
        usize::from(self.framing == Framing::Stx)
    }

    /// Waits for the beginning of an answer: whether it is an FL. An SP in front of it is reported.
    fn starts_with_fl(&mut self, deadline: Instant) -> Result<bool, HostError> {
        loop {
            self.fill(self.stx_length() + FL.len(), deadline)?;
            let start = self.received.get(self.stx_length()..).unwrap_or_default();
            if !start.starts_with(b"SP") {
                return Ok(start.starts_with(FL));
            }
            self.skip_unsolicited_sp(deadline)?;
        }
    }

    /// An SP in front of an answer that is read by length.
    fn skip_unsolicited_sp(&mut self, deadline: Instant) -> Result<(), HostError> {
        loop {
            if let Some(end) = self.received.iter().position(|byte| *byte == text::ETX) {
                self.received.drain(..=end);
                report_unsolicited_sp();
                return Ok(());
            }
            let more = self.received.len() + 1;
            self.fill(more, deadline)?;
        }
    }

    /// A text cut by length.
    fn binary(&mut self, length: usize, expected: &'static str) -> Result<Vec<u8>, HostError> {
        self.decoder.expect_binary(length);
        self.answer(expected)
    }

    /// Waits until the program has stopped: for the SP by which the controller says so, or, as it says nothing to hosts
    /// that send no STX (D7), by asking for its status. Returns what to print of it.
    pub(super) fn wait_for_stop(&mut self, limit: Option<Duration>) -> Result<&'static str, HostError> {
        const EXPECTED: &str = "SP";
        self.total_deadline = None;
        let deadline = limit.map(|limit| Instant::now() + limit);
        if self.framing == Framing::Bare {
            self.poll_until_stopped(deadline, limit.unwrap_or_default())?;
            return Ok("stopped");
        }
        let data = self.text(EXPECTED, deadline, limit.unwrap_or_default())?;
        match Reply::parse(&data) {
            Ok(Reply::Sp) => Ok(EXPECTED),
            _ => Err(HostError::Unexpected {
                expected: EXPECTED,
                found: data,
            }),
        }
    }

    fn poll_until_stopped(&mut self, deadline: Option<Instant>, limit: Duration) -> Result<(), HostError> {
        const EXPECTED: &str = "the end of the program";
        loop {
            std::thread::sleep(STATUS_PAUSE);
            let content = self.file(&Command::Su)?.unwrap_or_default();
            let status = StatusBody::decode(&content).map_err(|error| HostError::Content {
                letters: "SU",
                reason: error.to_string(),
                found: content,
            })?;
            if status.execution != ExecutionStatus::Running {
                return Ok(());
            }
            if deadline.is_some_and(|deadline| deadline <= Instant::now()) {
                return Err(HostError::Timeout {
                    expected: EXPECTED,
                    limit,
                    found: Vec::new(),
                });
            }
        }
    }

    /// Sends a text in one write.
    pub(super) fn send(&mut self, data: &[u8]) -> Result<(), HostError> {
        let bytes = text::encode_text(data, self.framing, Checksum::None);
        self.stream
            .write_all(&bytes)
            .map_err(|reason| HostError::ConnectionFailed {
                expected: "to send a text",
                reason,
            })
    }

    /// The pause a host should leave after a text of the controller (TRN-04).
    pub(super) fn pause(&self) {
        std::thread::sleep(limits::HOST_DELAY);
    }

    fn acknowledge(&mut self) -> Result<(), HostError> {
        self.pause();
        self.send(&Reply::Ok.encode())
    }

    /// The next text that is no SP of the controller's own accord.
    fn answer(&mut self, expected: &'static str) -> Result<Vec<u8>, HostError> {
        let deadline = Instant::now() + self.timeout;
        loop {
            let data = self.text(expected, Some(deadline), self.timeout)?;
            if !matches!(Reply::parse(&data), Ok(Reply::Sp)) {
                return Ok(data);
            }
            report_unsolicited_sp();
        }
    }

    fn text(
        &mut self,
        expected: &'static str,
        deadline: Option<Instant>,
        limit: Duration,
    ) -> Result<Vec<u8>, HostError> {
        loop {
            self.decoder.push(&std::mem::take(&mut self.received));
            match self.decoder.next() {
                Some(Decoded::Text(text)) => match text.error {
                    None => return Ok(text.data.into()),
                    Some(_) => {
                        return Err(HostError::Unexpected {
                            expected,
                            found: text.data.into(),
                        });
                    }
                },
                Some(Decoded::Skipped { bytes }) => {
                    eprintln!("ts3100 host: {bytes} bytes outside a text skipped");
                }
                None => self.read(expected, deadline, limit)?,
            }
        }
    }

    /// Reads until so many bytes stand ready for the decoder.
    fn fill(&mut self, length: usize, deadline: Instant) -> Result<(), HostError> {
        while self.received.len() < length {
            // A short answer (NG) is complete before the length is reached.
            if self.received.contains(&text::ETX) && !self.received.windows(FL.len()).any(|part| part == FL) {
                return Ok(());
            }
            self.read(FILE, Some(deadline), self.timeout)?;
        }
        Ok(())
    }

    fn read(
        &mut self,
        expected: &'static str,
        deadline: Option<Instant>,
        limit: Duration,
    ) -> Result<(), HostError> {
        let broken = |reason| HostError::ConnectionFailed { expected, reason };
        let silent = |found: &[u8]| HostError::Timeout {
            expected,
            limit,
            found: found.to_vec(),
        };
        let now = Instant::now();
        if let Some((end, limit)) = self.total_deadline
            && end <= now
        {
            return Err(HostError::TotalTimeout {
                expected,
                limit,
                found: self.received.clone(),
            });
        }
        let end = self.total_deadline.map(|(end, _)| end);
        let left = match deadline.into_iter().chain(end).min() {
            None => None,
            Some(deadline) => match deadline.saturating_duration_since(now) {
                Duration::ZERO => return Err(silent(&self.received)),
                left => Some(left),
            },
        };
        self.stream.set_read_timeout(left).map_err(broken)?;
        let mut buffer = [0; READ_BUFFER];
        match self.stream.read(&mut buffer) {
            Ok(0) => Err(HostError::Closed {
                expected,
                found: self.received.clone(),
            }),
            Ok(length) => {
                self.received
                    .extend_from_slice(buffer.get(..length).unwrap_or_default());
                Ok(())
            }
            // Looked at anew: one of the limits is over.
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(()),
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(()),
            Err(error) => Err(broken(error)),
        }
    }
}

/// Beginning of a file.
const FL: &[u8] = b"FL,";
/// What most commands are answered by.
const FILE: &str = "FL or NG";
/// What SF is answered by.
const SF_TEXT: &str = "a text of SF";

fn report_unsolicited_sp() {
    eprintln!("ts3100 host: SP came in between: the controller has stopped by itself");
}
