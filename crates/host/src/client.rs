//! A blocking client: the loop of [`conversation`](crate::conversation) over a [`Transport`].

use crate::{Conversation, Event, ExchangeError, Expected, Options, Response, Transport};
use core::fmt;
use std::io;
use std::time::Duration;
use ts3100_proto::command::Command;
use ts3100_proto::escape::Escaped;
use ts3100_proto::file::FileError;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{MAX_TEXT, Text};

/// Pause between two status requests while the client waits for the end of a program.
const STATUS_PAUSE: Duration = Duration::from_millis(100);

/// Why the client has no reply.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The reply is late.
    #[error("no reply within {} s{}: expected {expected}{}", .limit.as_secs_f64(), if *.is_total { " in total" } else { "" }, Found(", found only", .received))]
    Timeout {
        /// The time that has passed.
        limit: Duration,
        /// Whether it is the limit of [`Client::set_total`].
        is_total: bool,
        /// The expected reply.
        expected: Expected,
        /// Bytes received since the last text was sent, at most as many as a text has.
        received: Vec<u8>,
    },
    /// Another text than the expected one.
    #[error("{}", Unexpected(.expected, .text))]
    Unexpected {
        /// The expected reply.
        expected: Expected,
        text: Text,
    },
    /// The texts do not form a file.
    #[error("cannot read the file: {reason}; the text is {}", Shown(.data))]
    File {
        reason: FileError,
        /// The data section of the text with the breach.
        data: Vec<u8>,
    },
    /// The status of the controller cannot be read.
    #[error("cannot read the reply to SU: {reason}; the reply is {}", Shown(.data))]
    Status {
        reason: ts3100_proto::status::BodyError,
        /// The content.
        data: Vec<u8>,
    },
    /// The controller closed the connection.
    #[error("the controller closed the connection{} instead of sending {expected}", Found(" after", .received))]
    Closed {
        /// The expected reply.
        expected: Expected,
        /// Bytes received since the last text was sent, at most as many as a text has.
        received: Vec<u8>,
    },
    /// The connection failed.
    #[error("the connection failed")]
    Transport(#[source] io::Error),
}

/// Words and the received bytes; nothing if there are none.
struct Found<'a>(&'a str, &'a [u8]);

impl fmt::Display for Found<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            [] => Ok(()),
            bytes => write!(f, "{} {}", self.0, Shown(bytes)),
        }
    }
}

/// Bytes of a text for people, cut off where they are more than a text has.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a>(pub &'a [u8]);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.split_at_checked(MAX_TEXT) {
            Some((begin, rest)) if !rest.is_empty() => {
                write!(f, "{} and {} bytes more", Escaped::for_reading(begin), rest.len())
            }
            _ => Escaped::for_reading(self.0).fmt(f),
        }
    }
}

struct Unexpected<'a>(&'a Expected, &'a Text);

impl fmt::Display for Unexpected<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unexpected(expected, text) = self;
        let found = Shown(&text.data);
        match (expected, &text.error) {
            (Expected::Nothing, _) => write!(f, "unexpected {found}"),
            (_, Some(error)) => write!(f, "expected {expected}, found {found}: {error}"),
            (_, None) => write!(f, "expected {expected}, found {found}"),
        }
    }
}

/// A host on one connection.
#[derive(Debug)]
pub struct Client<T> {
    transport: T,
    conversation: Conversation,
    /// The limit of everything, with its length.
    total: Option<(Duration, Duration)>,
    /// Received since the last text was sent, at most as many bytes as a text has.
    received: Vec<u8>,
    stops: usize,
    skipped: usize,
}

impl<T: Transport> Client<T> {
    /// A host on this connection.
    pub fn new(transport: T, options: Options) -> Client<T> {
        Client {
            transport,
            conversation: Conversation::new(options),
            total: None,
            received: Vec::new(),
            stops: 0,
            skipped: 0,
        }
    }

    /// Limits everything from now on to this time; `None`: no limit.
    pub fn set_total(&mut self, limit: Option<Duration>) {
        self.total = limit.map(|limit| (self.now().saturating_add(limit), limit));
    }

    /// Time of the transport.
    pub fn now(&self) -> Duration {
        self.transport.now()
    }

    /// The connection.
    pub fn transport(&self) -> &T {
        &self.transport
    }

    /// The connection, to change it.
    pub fn transport_mut(&mut self) -> &mut T {
        &mut self.transport
    }

    pub fn conversation(&self) -> &Conversation {
        &self.conversation
    }

    /// The conversation, for exchanges that the client has no method for; [`Client::next_event`] carries them out.
    pub fn conversation_mut(&mut self) -> &mut Conversation {
        &mut self.conversation
    }

    /// Begins a conversation on a fresh connection, with the same options.
    pub fn restart(&mut self) {
        self.conversation = Conversation::new(self.conversation.options());
    }

    /// Unsolicited SP since the last call: how often the controller has reported that the program stopped.
    pub fn take_stops(&mut self) -> usize {
        core::mem::take(&mut self.stops)
    }

    /// Bytes outside any text since the last call.
    pub fn take_skipped(&mut self) -> usize {
        core::mem::take(&mut self.skipped)
    }

    /// Sends a command and returns the response. Files are acknowledged.
    ///
    /// # Errors
    /// There is no reply, or another one than the command has.
    pub fn request(&mut self, command: &Command) -> Result<Response, ClientError> {
        self.conversation.request(command);
        self.response()
    }

    /// Sends a file after its DL was answered by OK; false if the controller refuses it.
    ///
    /// # Errors
    /// A text of it is not answered by OK or NG.
    pub fn send_file(&mut self, content: impl AsRef<[u8]>) -> Result<bool, ClientError> {
        self.conversation.send_file(content);
        Ok(self.response()? == Response::Ok)
    }

    /// Waits for the SP by which the controller reports that the program has stopped, at most this long.
    ///
    /// Hosts that send no STX get no SP: they use [`Client::poll_until_stopped`].
    ///
    /// # Errors
    /// None came, or another text.
    pub fn wait_for_stop(&mut self, limit: Option<Duration>) -> Result<(), ClientError> {
        let now = self.now();
        self.conversation.expect(now, Expected::Stop);
        let end = limit.map(|limit| now.saturating_add(limit));
        loop {
            match self.next_event(end)? {
                Some(Event::Stopped) => {
                    self.stops -= 1;
                    return Ok(());
                }
                Some(_) => {}
                None => return Err(self.timeout(limit.unwrap_or_default(), false, Expected::Stop)),
            }
        }
    }

    /// Asks for the status until the program has stopped, at most this long. Returns the last status.
    ///
    /// # Errors
    /// The controller does not answer SU, or not by a status.
    pub fn poll_until_stopped(&mut self, limit: Option<Duration>) -> Result<StatusBody, ClientError> {
        let end = limit.map(|limit| self.now().saturating_add(limit));
        loop {
            self.wait(STATUS_PAUSE)?;
            let data = match self.request(&Command::Su)? {
                Response::Content(content) => content,
                Response::Ok | Response::Ng => Vec::new(),
            };
            let status = StatusBody::decode(&data).map_err(|reason| ClientError::Status { reason, data })?;
            let is_running = status.execution == ExecutionStatus::Running;
            if !is_running || end.is_some_and(|end| end <= self.now()) {
                return Ok(status);
            }
        }
    }

    /// Waits. Unsolicited SP are counted.
    ///
    /// # Errors
    /// Another text came, or the connection has ended.
    pub fn wait(&mut self, duration: Duration) -> Result<(), ClientError> {
        let end = self.now().saturating_add(duration);
        while self.next_event(Some(end))?.is_some() {}
        Ok(())
    }

    /// The response to what the conversation has been told to send.
    ///
    /// # Errors
    /// Those of [`Client::request`].
    pub fn response(&mut self) -> Result<Response, ClientError> {
        loop {
            if let Some(Event::Response(response)) = self.next_event(None)? {
                return Ok(response);
            }
        }
    }

    /// Sends and receives until the next event; `None` if this time comes before. Unsolicited SP and skipped bytes are
    /// counted, too.
    ///
    /// # Errors
    /// The exchange has failed, or the connection has.
    pub fn next_event(&mut self, end: Option<Duration>) -> Result<Option<Event>, ClientError> {
        loop {
            let now = self.now();
            if let Some(bytes) = self.conversation.poll_transmit(now) {
                self.received.clear();
                self.transport.send(&bytes).map_err(ClientError::Transport)?;
            }
            self.conversation.handle_timeout(now);
            if let Some(event) = self.conversation.poll_event() {
                match &event {
                    Event::Stopped => self.stops += 1,
                    Event::Skipped { bytes } => self.skipped += bytes,
                    Event::Failed(error) => return Err(self.failed(error.clone())),
                    Event::Response(_) | Event::Text(_) | Event::Bytes(_) => {}
                }
                return Ok(Some(event));
            }
            if end.is_some_and(|end| end <= now) {
                return Ok(None);
            }
            if let Some((total, limit)) = self.total
                && total <= now
            {
                return Err(self.timeout(limit, true, self.conversation.expected()));
            }
            self.read(end)?;
        }
    }

    /// Waits for bytes until something has to be done.
    fn read(&mut self, end: Option<Duration>) -> Result<(), ClientError> {
        let total = self.total.map(|(total, _)| total);
        let ends = [end, total, self.conversation.deadline()];
        let until = ends.into_iter().flatten().min().unwrap_or(Duration::MAX);
        let bytes = match self.transport.receive(until) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(ClientError::Closed {
                    expected: self.conversation.expected(),
                    received: self.received.clone(),
                });
            }
            Err(error) => return Err(ClientError::Transport(error)),
        };
        let room = MAX_TEXT.saturating_sub(self.received.len());
        self.received.extend(bytes.iter().take(room));
        let now = self.now();
        self.conversation.receive(now, &bytes);
        Ok(())
    }

    fn failed(&self, error: ExchangeError) -> ClientError {
        match error {
            ExchangeError::Unexpected { expected, text } => ClientError::Unexpected { expected, text },
            ExchangeError::File { reason, data } => ClientError::File { reason, data },
            ExchangeError::Timeout { expected } => {
                self.timeout(self.conversation.options().timeout, false, expected)
            }
        }
    }

    fn timeout(&self, limit: Duration, is_total: bool, expected: Expected) -> ClientError {
        let received = self.received.clone();
        ClientError::Timeout {
            limit,
            is_total,
            expected,
            received,
        }
    }
}
