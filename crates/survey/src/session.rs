//! The session of a survey: `ts3100-host`'s exchanges with the precautions of a survey. It measures reply times, logs the
//! bytes, and ends at whatever no probe expects.

mod program;
mod traffic;

use crate::delays::Delays;
use crate::forms;
use crate::peer::{Connection, Peer, PeerError};
use core::time::Duration;
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use traffic::Traffic;
pub(crate) use traffic::described;
use ts3100_host::{Client, ClientError, Event, Expected, Options, Response, Transport};
use ts3100_proto::command::RunMode;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{Checksum, Framing, STX, StxRule, Text};

/// Shortest time between the last byte in either direction and the next text: the manual asks for 50 ms (TRN-05), and at
/// most 20 texts a second are sent.
pub(crate) const PAUSE: Duration = Duration::from_millis(52);
/// Longest wait for a reply. The manual gives no time; every controller seen so far replies within 0.2 s.
pub(crate) const PATIENCE: Duration = Duration::from_secs(2);
/// A connection is quiet when no byte has come for this long.
pub(crate) const QUIET: Duration = Duration::from_millis(300);
/// How soon an interruption is noticed.
const PROMPT: Duration = Duration::from_millis(100);
/// The file of the survey on the RAM drive.
pub(crate) const FILE: &str = "TSSURVEY";

/// The reply of a controller to a probe in a few words; a number where something is measured.
pub type Reply = String;

/// Why a probe has no reply.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProbeError {
    /// The controller does not allow what the probe needs.
    #[error("{0}")]
    Refused(String),
    /// A reply that no controller is known to give. The survey ends: with an unclear state it must not continue at a
    /// machine.
    #[error("{0}")]
    Unexpected(String),
    /// No reply. The survey ends as well.
    #[error("{0}")]
    Timeout(String),
}

impl ProbeError {
    /// Whether the survey continues with the next probe.
    pub(crate) fn is_refusal(&self) -> bool {
        matches!(self, ProbeError::Refused(_))
    }
}

impl From<PeerError> for ProbeError {
    fn from(error: PeerError) -> ProbeError {
        match error {
            PeerError::Absent => ProbeError::Refused(error.to_string()),
            PeerError::Unreachable(_) | PeerError::Closed | PeerError::Interrupted => {
                ProbeError::Unexpected(error.to_string())
            }
        }
    }
}

/// The error of an exchange; `what` names what was sent.
fn probe_error(error: ClientError, what: &str) -> ProbeError {
    match error {
        ClientError::Timeout { .. } => ProbeError::Timeout(format!("no reply to {what}")),
        ClientError::Unexpected { text, .. } if text.error.is_some() => {
            ProbeError::Unexpected("a damaged text".to_owned())
        }
        ClientError::Unexpected { expected, text } => {
            let found = described(&text.data);
            ProbeError::Unexpected(match expected {
                Expected::Nothing => format!("unexpected {found}"),
                _ => format!("the reply to {what} is {found}"),
            })
        }
        ClientError::File { reason, .. } => ProbeError::Unexpected(format!("the reply to {what}: {reason}")),
        ClientError::Status { reason, .. } => ProbeError::Unexpected(format!("the reply to SU: {reason}")),
        ClientError::Closed { .. } => PeerError::Closed.into(),
        ClientError::Transport(error) => match error.get_ref().and_then(|error| error.downcast_ref()) {
            Some(error) => PeerError::clone(error).into(),
            None => ProbeError::Unexpected(error.to_string()),
        },
    }
}

/// The connection for commands as a transport, which logs the bytes and can be interrupted.
struct Commands<'a> {
    peer: &'a mut dyn Peer,
    traffic: Traffic,
    /// Set by others: nothing more is asked.
    stop: Arc<AtomicBool>,
}

impl Commands<'_> {
    /// Waits for bytes of any connection until this time; none came: empty.
    fn receive_on(&mut self, connection: Connection, until: Duration) -> Result<Vec<u8>, PeerError> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(PeerError::Interrupted);
            }
            let next = until.min(self.peer.now() + PROMPT);
            let bytes = self.peer.receive(connection, next)?;
            if !bytes.is_empty() || self.peer.now() >= until {
                return Ok(bytes);
            }
        }
    }

    fn note(&mut self, direction: char, bytes: &[u8]) {
        let at = self.peer.now();
        self.traffic.note(at, direction, bytes);
    }
}

impl Transport for Commands<'_> {
    fn now(&self) -> Duration {
        self.peer.now()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.note('>', bytes);
        self.peer
            .send(Connection::Commands, bytes)
            .map_err(io::Error::other)
    }

    fn receive(&mut self, until: Duration) -> io::Result<Vec<u8>> {
        let bytes = self.receive_on(Connection::Commands, until);
        let bytes = bytes.map_err(io::Error::other)?;
        self.note('<', &bytes);
        Ok(bytes)
    }
}

/// A conversation with a controller.
pub struct Session<'a> {
    client: Client<Commands<'a>>,
    /// When the last command of [`Session::request`] was sent and when its reply was complete.
    request_times: (Duration, Duration),
    /// Those of the first status: with other ones the same commands are refused.
    modes: Option<(MasterMode, RunMode)>,
    /// That of the last status, while nothing has been sent since that may change it.
    execution: Option<ExecutionStatus>,
    /// Length of the reply to a command of [`Session::raw_reply`]: always the same.
    lengths: BTreeMap<&'static str, usize>,
    /// Why IP1 cannot be reached: it is not tried again.
    without_channel: Option<String>,
    delays: Delays,
}

impl<'a> Session<'a> {
    /// A session without a connection.
    pub(crate) fn new(peer: &'a mut dyn Peer, stop: Arc<AtomicBool>) -> Session<'a> {
        let now = peer.now();
        let commands = Commands {
            peer,
            traffic: Traffic::default(),
            stop,
        };
        let options = Options {
            // Some probes are about texts without STX.
            stx: StxRule::Detect,
            pause: PAUSE,
            timeout: PATIENCE,
            ..Options::with_stx()
        };
        Session {
            client: Client::new(commands, options),
            request_times: (now, now),
            modes: None,
            execution: None,
            lengths: BTreeMap::new(),
            without_channel: None,
            delays: Delays::default(),
        }
    }

    /// Ignores interruptions from now on, to restore all changes.
    pub(crate) fn ignore_interruptions(&mut self) {
        self.client.transport_mut().stop = Arc::default();
    }

    /// Time of the peer.
    pub fn now(&self) -> Duration {
        self.client.now()
    }

    /// Whether each character takes its time.
    pub fn is_serial(&self) -> bool {
        self.client.transport().peer.is_serial()
    }

    /// The checksum of the texts.
    pub fn checksum(&self) -> Checksum {
        self.client.conversation().options().checksum
    }

    /// Texts have this checksum from now on.
    pub(crate) fn set_checksum(&mut self, checksum: Checksum) {
        let options = self.client.conversation().options();
        self.client
            .conversation_mut()
            .set_options(Options { checksum, ..options });
    }

    /// The log of the bytes.
    pub(crate) fn traffic(&mut self) -> &mut Traffic {
        &mut self.client.transport_mut().traffic
    }

    /// How long replies took.
    pub(crate) fn delays(&self) -> &Delays {
        &self.delays
    }

    /// Begins a new conversation on a fresh connection.
    ///
    /// # Errors
    /// The controller cannot be reached.
    pub fn reopen(&mut self) -> Result<(), ProbeError> {
        let peer = &mut self.client.transport_mut().peer;
        peer.close(Connection::Commands);
        peer.open(Connection::Commands)?;
        self.client.restart();
        self.begin_pause();
        Ok(())
    }

    /// Opens another connection. As after [`Session::send_bytes`], the next command comes after a pause.
    ///
    /// # Errors
    /// The controller cannot be reached. That IP1 cannot be connected to is a refusal: its `[E00]` may say so.
    pub fn open(&mut self, connection: Connection) -> Result<(), ProbeError> {
        let is_channel = connection == Connection::Channel;
        if let Some(reason) = self.without_channel.clone().filter(|_| is_channel) {
            return Err(ProbeError::Refused(reason));
        }
        match self.client.transport_mut().peer.open(connection) {
            Err(PeerError::Unreachable(reason)) if is_channel => {
                let reason = format!("{reason}. IP1 has to be a server (OPEN MODE); --ip1 gives its port");
                self.without_channel = Some(reason.clone());
                Err(ProbeError::Refused(reason))
            }
            opened => {
                opened?;
                self.begin_pause();
                Ok(())
            }
        }
    }

    /// Closes another connection.
    pub fn close(&mut self, connection: Connection) {
        self.client.transport_mut().peer.close(connection);
    }

    fn begin_pause(&mut self) {
        let now = self.now();
        self.client.conversation_mut().begin_pause(now);
    }

    /// Sends on another connection. An SP may follow, and a strict controller ignores a command that follows SP too soon:
    /// the next command comes after a pause.
    ///
    /// # Errors
    /// The controller has closed it.
    pub fn send_bytes(&mut self, connection: Connection, bytes: &[u8]) -> Result<(), PeerError> {
        self.begin_pause();
        let commands = self.client.transport_mut();
        commands.note('>', bytes);
        commands.peer.send(connection, bytes)
    }

    /// Receives bytes of another connection until it is quiet; for the first of them it waits this long.
    ///
    /// # Errors
    /// The controller has closed it.
    pub fn receive_bytes(&mut self, connection: Connection, wait: Duration) -> Result<Vec<u8>, PeerError> {
        let commands = self.client.transport_mut();
        let (mut received, mut until) = (Vec::new(), commands.now() + wait);
        while commands.now() < until {
            let bytes = commands.receive_on(connection, until)?;
            if !bytes.is_empty() {
                until = commands.now() + QUIET;
                received.extend(bytes);
            }
        }
        commands.note('<', &received);
        Ok(received)
    }

    /// The next event of the exchange with this command; `None` if the time comes before.
    fn next_event(&mut self, what: &str, end: Option<Duration>) -> Result<Option<Event>, ProbeError> {
        loop {
            let event = self.client.next_event(end);
            match self.client.take_skipped() {
                0 => {}
                bytes => {
                    return Err(ProbeError::Unexpected(format!(
                        "{bytes} bytes that belong to no text"
                    )));
                }
            }
            match event.map_err(|error| probe_error(error, what))? {
                Some(Event::Stopped | Event::Skipped { .. }) => {}
                event => return Ok(event),
            }
        }
    }

    /// Waits. Anything received meanwhile, other than an unsolicited SP, is unexpected.
    ///
    /// # Errors
    /// Something came.
    pub fn wait(&mut self, duration: Duration) -> Result<(), ProbeError> {
        let end = self.now() + duration;
        while self.next_event("nothing", Some(end))?.is_some() {}
        Ok(())
    }

    /// Sends these bytes without a pause before.
    ///
    /// # Errors
    /// The connection has ended.
    pub fn send_at_once(&mut self, bytes: &[u8]) -> Result<(), ProbeError> {
        self.execution = None;
        let now = self.now();
        self.client
            .conversation_mut()
            .send_at_once(bytes.to_vec(), Expected::Nothing);
        self.next_event("the bytes", Some(now)).map(drop)
    }

    /// Waits for one text after [`Session::send_at_once`].
    ///
    /// # Errors
    /// Two texts came, or bytes that are not a text.
    pub fn receive(&mut self) -> Result<Option<Text>, ProbeError> {
        self.expect(Expected::Text);
        self.text_of("the bytes")
    }

    fn expect(&mut self, expected: Expected) {
        let now = self.now();
        self.client.conversation_mut().expect(now, expected);
    }

    /// The text that is awaited; `None` if none comes in time.
    fn text_of(&mut self, what: &str) -> Result<Option<Text>, ProbeError> {
        match self.next_event(what, None) {
            Ok(Some(Event::Text(text))) => Ok(Some(text)),
            Ok(_) | Err(ProbeError::Timeout(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Sends these bytes and waits for one text. A text under way at the end of the wait is unexpected.
    ///
    /// # Errors
    /// Two texts came, or bytes that are not a text.
    pub fn exchange(&mut self, bytes: &[u8]) -> Result<Option<Text>, ProbeError> {
        self.execution = None;
        self.client
            .conversation_mut()
            .send_bytes(bytes.to_vec(), Expected::Text);
        let text = self.text_of("the bytes")?;
        if text.is_none() && self.is_partial() {
            return Err(ProbeError::Unexpected("a text without its end".to_owned()));
        }
        Ok(text)
    }

    /// A text with this data section as bytes.
    pub fn text(&self, data: &str) -> Vec<u8> {
        self.client.conversation().options().text(data.as_bytes())
    }

    /// Sends a command and returns the first text of its reply.
    ///
    /// # Errors
    /// None came.
    pub fn request(&mut self, command: &str) -> Result<Text, ProbeError> {
        self.execution = None;
        let conversation = self.client.conversation_mut();
        conversation.send(format!("{command}\r").as_bytes(), Expected::Text);
        let text = self.text_of(command)?;
        let text = text.ok_or_else(|| ProbeError::Timeout(format!("no reply to {command}")))?;
        let replied = self.now();
        let sent = self.client.conversation().sent_at().unwrap_or(replied);
        self.request_times = (sent, replied);
        self.delays.add(replied.saturating_sub(sent));
        if text.framing != Framing::Stx {
            return Err(ProbeError::Unexpected(format!(
                "the reply to {command} has no STX"
            )));
        }
        Ok(text)
    }

    /// When the last command was sent, and when its reply was complete.
    pub fn request_times(&self) -> (Duration, Duration) {
        self.request_times
    }

    /// A command that is answered by OK.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn command(&mut self, command: &str) -> Result<(), ProbeError> {
        match self.is_accepted(command)? {
            true => Ok(()),
            false => Err(ProbeError::Refused(format!("{command} got NG"))),
        }
    }

    /// Whether a command is answered by OK; false for NG.
    ///
    /// # Errors
    /// Anything else came.
    pub fn is_accepted(&mut self, command: &str) -> Result<bool, ProbeError> {
        match self.request(command)?.data.as_ref() {
            b"OK\r" => Ok(true),
            b"NG\r" => Ok(false),
            other => {
                let found = described(other);
                Err(ProbeError::Unexpected(format!(
                    "the reply to {command} is {found}"
                )))
            }
        }
    }

    /// The reply to a command: `OK` or `NG`.
    ///
    /// # Errors
    /// Anything else came.
    pub fn acknowledgement(&mut self, command: &str) -> Result<&'static str, ProbeError> {
        Ok(if self.is_accepted(command)? { "OK" } else { "NG" })
    }

    /// Acknowledges a text of a file.
    ///
    /// # Errors
    /// Something came before.
    pub fn acknowledge(&mut self) -> Result<(), ProbeError> {
        self.client.conversation_mut().acknowledge(Expected::Nothing);
        self.flush("OK")
    }

    /// Sends what the conversation has to send, after its pause.
    fn flush(&mut self, what: &str) -> Result<(), ProbeError> {
        while let Some(end) = self.client.conversation().transmit_time() {
            self.next_event(what, Some(end))?;
        }
        Ok(())
    }

    /// Sends these bytes and returns the type of the reply: `answer`, `OK`, `NG` or `silence`.
    ///
    /// # Errors
    /// Two texts came, or bytes that are not a text.
    pub fn reply_kind(&mut self, bytes: &[u8]) -> Result<Reply, ProbeError> {
        let text = self.exchange(bytes)?;
        self.kind_of(text)
    }

    /// The same for a text with this data section.
    ///
    /// # Errors
    /// Those of [`Session::reply_kind`].
    pub fn reply_kind_to(&mut self, data: &str) -> Result<Reply, ProbeError> {
        let text = self.text(data);
        self.reply_kind(&text)
    }

    /// The type of a text. A file is received to its end.
    ///
    /// # Errors
    /// A file that is none.
    pub fn kind_of(&mut self, text: Option<Text>) -> Result<Reply, ProbeError> {
        let Some(text) = text else {
            return Ok("silence".to_owned());
        };
        let without = match text.framing {
            Framing::Stx => "",
            Framing::Bare => " without STX",
        };
        let kind = match text.data.as_ref() {
            b"OK\r" => "OK",
            b"NG\r" => "NG",
            data if data.starts_with(b"FL,") => {
                self.rest_of_content("it", text)?;
                "answer"
            }
            _ => "another text",
        };
        Ok(format!("{kind}{without}"))
    }

    /// The response to what the conversation sends.
    fn response(&mut self, what: &str) -> Result<Response, ProbeError> {
        loop {
            if let Some(Event::Response(response)) = self.next_event(what, None)? {
                return Ok(response);
            }
        }
    }

    /// SF: in how many texts it travels and of which arm it is, as in [`forms::total_status`], and its content.
    ///
    /// # Errors
    /// NG is a refusal.
    pub fn total_status(&mut self) -> Result<(&'static str, Vec<u8>), ProbeError> {
        let sum = usize::from(self.checksum() == Checksum::Sum);
        let mut raw = self.raw_reply("SF")?;
        raw.truncate(raw.len() - sum);
        let has_stx = raw.first() == Some(&STX);
        let begin = usize::from(has_stx);
        if raw.get(begin..).is_some_and(|data| data.starts_with(b"NG")) {
            return Err(ProbeError::Refused("SF got NG".to_owned()));
        }
        let form = forms::total_status(&raw, has_stx);
        self.acknowledge()?;
        if form.starts_with("several") {
            raw.pop();
            self.expect(Expected::Bytes);
            let rest = self.bytes("SF", usize::MAX)?;
            raw.extend(rest.into_iter().skip(begin));
            self.acknowledge()?;
        }
        let content = raw.get(begin + 3..).unwrap_or_default().to_vec();
        Ok((form, content))
    }

    /// Whether a text has begun and is not complete.
    pub(crate) fn is_partial(&self) -> bool {
        self.client.conversation().is_partial()
    }

    /// Whether the controller has closed the connection for commands.
    pub fn is_closed(&mut self) -> bool {
        let until = self.now() + PAUSE;
        let received = self
            .client
            .transport_mut()
            .receive_on(Connection::Commands, until);
        received == Err(PeerError::Closed)
    }

    /// Waits for the first byte after [`Session::send_at_once`], which stays part of its text.
    ///
    /// # Errors
    /// The connection has ended.
    pub fn wait_for_byte(&mut self) -> Result<(), ProbeError> {
        let until = self.now() + PATIENCE;
        while self.now() < until && !self.is_partial() {
            let received = self
                .client
                .transport_mut()
                .receive_on(Connection::Commands, until)?;
            self.client.transport_mut().note('<', &received);
            let now = self.now();
            self.client.conversation_mut().receive(now, &received);
        }
        Ok(())
    }

    /// Bytes that follow a command, not cut into texts: those of SF may have ETX among them. The first time until the
    /// connection is quiet, then as many.
    ///
    /// # Errors
    /// Nothing came.
    pub fn raw_reply(&mut self, command: &'static str) -> Result<Vec<u8>, ProbeError> {
        self.execution = None;
        let conversation = self.client.conversation_mut();
        conversation.send(format!("{command}\r").as_bytes(), Expected::Bytes);
        self.flush(command)?;
        let enough = self.lengths.get(command).copied();
        let reply = self.bytes(command, enough.unwrap_or(usize::MAX))?;
        if reply.is_empty() {
            return Err(ProbeError::Timeout(format!("no reply to {command}")));
        }
        self.lengths.entry(command).or_insert(reply.len());
        Ok(reply)
    }

    /// Bytes until there are enough, or the connection is quiet; for the first of them it waits longer.
    fn bytes(&mut self, what: &str, enough: usize) -> Result<Vec<u8>, ProbeError> {
        let (mut bytes, mut until) = (Vec::new(), self.now() + PATIENCE);
        while bytes.len() < enough {
            match self.next_event(what, Some(until))? {
                Some(Event::Bytes(more)) => bytes.extend(more),
                Some(_) => {}
                None => break,
            }
            until = self.now() + QUIET;
        }
        Ok(bytes)
    }

    /// Whether the robot works, asked for where it is not known.
    ///
    /// # Errors
    /// Those of [`Session::status`].
    pub fn execution(&mut self) -> Result<ExecutionStatus, ProbeError> {
        match self.execution {
            Some(execution) => Ok(execution),
            None => Ok(self.status()?.execution),
        }
    }

    /// The status of the controller.
    ///
    /// # Errors
    /// There is no reply to SU, or in no form that is known.
    pub fn status(&mut self) -> Result<StatusBody, ProbeError> {
        let content = self.file("SU")?;
        let status = StatusBody::decode(&content)
            .map_err(|error| ProbeError::Unexpected(format!("the reply to SU: {error}")))?;
        let modes = (status.master_mode, status.run_mode);
        if *self.modes.get_or_insert(modes) != modes {
            return Err(ProbeError::Unexpected("somebody has changed the mode".to_owned()));
        }
        self.execution = Some(status.execution);
        Ok(status)
    }

    /// The number of unsolicited SP since the last call.
    pub fn take_stops(&mut self) -> usize {
        self.client.take_stops()
    }
}
