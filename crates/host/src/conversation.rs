//! A conversation with a controller as a value without I/O: one exchange at a time, from the command to the last
//! acknowledgement.
//!
//! The owner calls [`Conversation::request`] or one of its siblings, and then, in a loop:
//!
//! 1. sends what [`Conversation::poll_transmit`] returns,
//! 2. takes the events of [`Conversation::poll_event`],
//! 3. waits for bytes until [`Conversation::deadline`], and gives them to [`Conversation::receive`],
//! 4. calls [`Conversation::handle_timeout`].
//!
//! Time is a duration since any moment that the owner chooses. Texts are cut by
//! [`TextDecoder`]; only the texts of SF and IO, which have no end mark of their own,
//! are measured here. [`Client`](crate::Client) is the loop over blocking transports.

use crate::Expected;
use core::time::Duration;
use std::collections::VecDeque;
use ts3100_proto::command::Command;
use ts3100_proto::file::{FileError, FileRule, FlReceiver, FlSender, Received};
use ts3100_proto::reply::Reply;
use ts3100_proto::status::io;
use ts3100_proto::status::sf::SfLayout;
use ts3100_proto::text::{
    CR, Checksum, Decoded, EOF, ETX, EndRule, Framing, HOST_DELAY, MAX_DATA, MAX_TEXT, STX, StxRule, Text,
    TextDecoder, TextOptions, encode_text,
};

/// Largest file taken from a controller: a full RAM drive and its directory are smaller.
const MAX_CONTENT: usize = 4 * 1024 * 1024;
/// The beginning of a file.
const FL: &[u8] = b"FL,";
/// Data bytes of an SF of eight axes in one text: `FL,`, the content, EOF.
const WHOLE_STATUS: usize = FL.len() + SfLayout::Eight.len() + 1;
/// Data bytes of IO without EOF.
const LINE_WORDS: usize = FL.len() + io::LENGTH;

/// How a host talks. The controller must have the same settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Whether the host's texts begin with STX.
    pub framing: Framing,
    /// Whether bytes outside STX and ETX are noise or a text.
    pub stx: StxRule,
    /// Whether a checksum follows ETX.
    pub checksum: Checksum,
    /// Shortest time between the last byte in either direction and the next text. The manual advises 50 ms (TRN-04).
    pub pause: Duration,
    /// Longest wait for each text of a reply. The manual gives none.
    pub timeout: Duration,
}

impl Options {
    /// Texts with STX, as the manual has them.
    pub const fn with_stx() -> Options {
        Options {
            framing: Framing::Stx,
            stx: StxRule::Required,
            checksum: Checksum::None,
            pause: HOST_DELAY,
            timeout: Duration::from_secs(5),
        }
    }

    /// Texts without STX, as the vendor's client library sends them.
    pub const fn without_stx() -> Options {
        Options {
            framing: Framing::Bare,
            stx: StxRule::Detect,
            ..Options::with_stx()
        }
    }

    /// A text with this data section, CR included, as bytes.
    pub fn text(&self, data: &[u8]) -> Vec<u8> {
        encode_text(data, self.framing, self.checksum)
    }

    fn decoder(&self) -> TextDecoder {
        TextDecoder::new(TextOptions {
            stx: self.stx,
            end: EndRule::Etx,
            checksum: self.checksum,
        })
    }
}

/// The result of an exchange.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Response {
    /// The controller has carried the command out, or has stored the file.
    Ok,
    /// The controller refuses.
    Ng,
    /// The content of a file or status, without `FL,` and EOF. It has been acknowledged.
    Content(Vec<u8>),
}

/// Something that the owner learns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// The exchange is complete.
    Response(Response),
    /// The text that [`Expected::Text`] waits for.
    Text(Text),
    /// Bytes that [`Expected::Bytes`] waits for.
    Bytes(Vec<u8>),
    /// An SP that the host did not ask for: the program has stopped. It is not a reply; the exchange continues.
    Stopped,
    /// Bytes outside any text were dropped. The exchange continues.
    Skipped {
        /// Number of bytes.
        bytes: usize,
    },
    /// The exchange ends without its reply.
    Failed(ExchangeError),
}

/// Why an exchange ends without its reply.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExchangeError {
    /// Another text than the expected one, or a damaged one.
    #[error("unexpected text")]
    Unexpected {
        /// The reply that the exchange waits for.
        expected: Expected,
        text: Text,
    },
    /// The texts do not form a file.
    #[error("cannot read the file: {reason}")]
    File {
        reason: FileError,
        /// The data section of the text with the breach.
        data: Vec<u8>,
    },
    /// No complete text within [`Options::timeout`].
    #[error("no reply in time")]
    Timeout {
        /// The reply that the exchange waits for.
        expected: Expected,
    },
}

/// The awaited response.
#[derive(Debug, Clone)]
enum Exchange {
    Idle,
    /// One text.
    One(Expected),
    /// A file; whether its first text has been received.
    Content(FlReceiver, bool),
    /// A file that is read by its length, and the part of it received so far.
    Binary(Expected, Vec<u8>),
    /// The reply to a text of this file.
    Sending(FlSender),
    /// The pause before the last acknowledgement.
    Acknowledging(Response),
    Bytes,
}

/// A text to send.
#[derive(Debug, Clone)]
struct Outgoing {
    bytes: Vec<u8>,
    /// Whether it waits for [`Options::pause`].
    waits: bool,
}

/// The host's side of one connection.
#[derive(Debug, Clone)]
pub struct Conversation {
    options: Options,
    decoder: TextDecoder,
    /// Received and not yet given to the decoder: the beginning of a text whose length is not known yet.
    received: Vec<u8>,
    exchange: Exchange,
    outgoing: Option<Outgoing>,
    /// When a byte was sent or received last.
    last: Option<Duration>,
    /// When the last text was sent.
    sent: Option<Duration>,
    /// When the reply has to be complete.
    due: Option<Duration>,
    events: VecDeque<Event>,
}

impl Conversation {
    /// A conversation on a fresh connection.
    pub fn new(options: Options) -> Conversation {
        Conversation {
            options,
            decoder: options.decoder(),
            received: Vec::new(),
            exchange: Exchange::Idle,
            outgoing: None,
            last: None,
            sent: None,
            due: None,
            events: VecDeque::new(),
        }
    }

    /// How this host talks.
    pub fn options(&self) -> Options {
        self.options
    }

    /// Changes how this host talks, from the next text on. Bytes of a text under way are forgotten.
    pub fn set_options(&mut self, options: Options) {
        self.options = options;
        self.decoder = options.decoder();
    }

    /// Begins an exchange with this command. The one before is given up.
    pub fn request(&mut self, command: &Command) {
        self.send(&command.encode(), Expected::of(command));
    }

    /// Begins an exchange with a text of this data section, CR included.
    pub fn send(&mut self, data: &[u8], expected: Expected) {
        self.begin(self.options.text(data), true, expected);
    }

    /// Begins an exchange with these bytes, whatever they are.
    pub fn send_bytes(&mut self, bytes: Vec<u8>, expected: Expected) {
        self.begin(bytes, true, expected);
    }

    /// Begins an exchange with these bytes without the pause before.
    pub fn send_at_once(&mut self, bytes: Vec<u8>, expected: Expected) {
        self.begin(bytes, false, expected);
    }

    /// Sends a file after its DL was answered by OK. The response is OK when the controller has stored it.
    pub fn send_file(&mut self, content: impl AsRef<[u8]>) {
        self.exchange = Exchange::Sending(FlSender::new(content));
        self.send_next_text();
    }

    /// Acknowledges a text of a file that was awaited as [`Expected::Text`] or [`Expected::Bytes`], and expects this.
    pub fn acknowledge(&mut self, expected: Expected) {
        self.send(&Reply::Ok.encode(), expected);
    }

    /// Continues with a file whose first text was awaited as [`Expected::Text`]: acknowledges it and receives the rest.
    pub fn continue_file(&mut self, first: Text) {
        self.exchange = Exchange::new(Expected::Content);
        self.take(Text {
            framing: self.options.framing,
            ..first
        });
    }

    /// Restarts the pause before the next text, as after a byte in either direction.
    pub fn begin_pause(&mut self, now: Duration) {
        self.last = Some(now);
    }

    /// Expects a reply without sending anything.
    pub fn expect(&mut self, now: Duration, expected: Expected) {
        self.exchange = Exchange::new(expected);
        self.outgoing = None;
        self.due = self.reply_deadline(now);
    }

    fn begin(&mut self, bytes: Vec<u8>, waits: bool, expected: Expected) {
        self.exchange = Exchange::new(expected);
        self.outgoing = Some(Outgoing { bytes, waits });
        self.due = None;
    }

    /// The bytes to send now, as one write.
    pub fn poll_transmit(&mut self, now: Duration) -> Option<Vec<u8>> {
        if self.pause_end().is_some_and(|end| now < end) {
            return None;
        }
        let outgoing = self.outgoing.take()?;
        (self.last, self.sent) = (Some(now), Some(now));
        if matches!(self.exchange, Exchange::Acknowledging(_)) {
            if let Exchange::Acknowledging(response) = self.end() {
                self.events.push_back(Event::Response(response));
            }
        } else {
            self.due = self.reply_deadline(now);
        }
        Some(outgoing.bytes)
    }

    /// When [`Conversation::poll_transmit`] or [`Conversation::handle_timeout`] has to be called next.
    pub fn deadline(&self) -> Option<Duration> {
        self.transmit_time().or(self.due)
    }

    /// When the text that waits for its pause can be sent; `None` if none waits.
    pub fn transmit_time(&self) -> Option<Duration> {
        self.outgoing.as_ref()?;
        Some(self.pause_end().unwrap_or_default())
    }

    /// When the last text was sent.
    pub fn sent_at(&self) -> Option<Duration> {
        self.sent
    }

    /// Ends an exchange whose reply is late.
    pub fn handle_timeout(&mut self, now: Duration) {
        if self.outgoing.is_none() && self.due.is_some_and(|due| due <= now) {
            let expected = self.expected();
            self.fail(ExchangeError::Timeout { expected });
        }
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// The reply that the conversation is waiting for.
    pub fn expected(&self) -> Expected {
        match &self.exchange {
            Exchange::Idle | Exchange::Acknowledging(_) => Expected::Nothing,
            Exchange::One(expected) => *expected,
            Exchange::Content(_, false) => Expected::Content,
            Exchange::Content(_, true) => Expected::NextText,
            Exchange::Binary(expected, data) if data.is_empty() => *expected,
            Exchange::Binary(..) => Expected::NextText,
            Exchange::Sending(_) => Expected::Acknowledgement,
            Exchange::Bytes => Expected::Bytes,
        }
    }

    /// Whether a text has begun and is not complete.
    pub fn is_partial(&self) -> bool {
        !self.received.is_empty() || self.decoder.is_partial()
    }

    /// Takes received bytes; how they were split does not matter.
    pub fn receive(&mut self, now: Duration, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.last = Some(now);
        if matches!(self.exchange, Exchange::Bytes) {
            self.events.push_back(Event::Bytes(bytes.to_vec()));
            return;
        }
        self.received.extend_from_slice(bytes);
        while let Some(count) = self.decodable() {
            self.decoder.push(self.received.get(..count).unwrap_or_default());
            self.received.drain(..count);
            while let Some(decoded) = self.decoder.next() {
                match decoded {
                    Decoded::Text(text) => self.take(text),
                    Decoded::Skipped { bytes } => self.events.push_back(Event::Skipped { bytes }),
                }
            }
        }
    }

    /// How many received bytes the decoder can have now. The beginning of SF or IO waits until its length is known.
    fn decodable(&mut self) -> Option<usize> {
        let raw = self.received.as_slice();
        let begin = match raw.first()? {
            &STX => 1,
            // Noise before the text.
            _ if self.options.stx == StxRule::Required => {
                let noise = raw.iter().position(|byte| *byte == STX);
                return Some(noise.unwrap_or(raw.len()));
            }
            _ => 0,
        };
        let expected = if let Exchange::Binary(expected, data) = &self.exchange
            && data.is_empty()
            && self.outgoing.is_none()
        {
            *expected
        } else {
            return Some(raw.len());
        };
        let data = raw.get(begin..).unwrap_or_default();
        let after_etx = usize::from(self.options.checksum == Checksum::Sum);
        if data.starts_with(FL) {
            let length = binary_length(expected, data)?;
            let whole = begin + length + 1 + after_etx;
            let is_whole = raw.len() >= whole;
            if is_whole {
                self.decoder.expect_binary(length);
            }
            return is_whole.then_some(whole);
        }
        // Another reply, such as NG, or an SP before the file: one text, so that what follows it is measured.
        let end = raw.iter().position(|byte| *byte == ETX);
        match end.map(|end| end + 1 + after_etx) {
            Some(whole) => (raw.len() >= whole).then_some(whole),
            None => (raw.len() > MAX_TEXT).then_some(raw.len()),
        }
    }

    /// Takes a text.
    fn take(&mut self, text: Text) {
        let reply = Reply::parse(&text.data);
        if text.error.is_none() && matches!(reply, Ok(Reply::Sp)) {
            self.events.push_back(Event::Stopped);
            if matches!(self.exchange, Exchange::One(Expected::Stop)) {
                self.end();
            }
            return;
        }
        let is_text = matches!(self.exchange, Exchange::One(Expected::Text));
        let has_other_framing = self.options.framing == Framing::Stx && text.framing == Framing::Bare;
        if text.error.is_some() || self.outgoing.is_some() || has_other_framing && !is_text {
            return self.unexpected(text);
        }
        let is_first = match &self.exchange {
            Exchange::Content(_, is_begun) => !is_begun,
            Exchange::Binary(_, data) => data.is_empty(),
            Exchange::One(Expected::Acknowledgement) | Exchange::Sending(_) => true,
            Exchange::Idle | Exchange::One(_) | Exchange::Acknowledging(_) | Exchange::Bytes => false,
        };
        if is_first && matches!(reply, Ok(Reply::Ng)) {
            return self.respond(Response::Ng);
        }
        match &mut self.exchange {
            Exchange::One(Expected::Text) => {
                self.end();
                self.events.push_back(Event::Text(text));
            }
            Exchange::One(Expected::Acknowledgement) if matches!(reply, Ok(Reply::Ok)) => {
                self.respond(Response::Ok);
            }
            Exchange::Sending(_) if matches!(reply, Ok(Reply::Ok)) => self.send_next_text(),
            Exchange::Content(receiver, is_begun) if *is_begun || text.data.starts_with(FL) => {
                *is_begun = true;
                match receiver.push(&text.data) {
                    Received::More => self.acknowledge_text(),
                    Received::Complete(content) => self.acknowledge_last(content),
                    Received::Refused(reason) => {
                        let data = text.data.to_vec();
                        self.fail(ExchangeError::File { reason, data });
                    }
                }
            }
            Exchange::Binary(expected, data) if !data.is_empty() || text.data.starts_with(FL) => {
                data.extend_from_slice(&text.data);
                let length = content_length(*expected, data);
                if data.len() < FL.len() + length {
                    let rest = WHOLE_STATUS.saturating_sub(data.len());
                    self.decoder.expect_binary(rest);
                    self.acknowledge_text();
                } else {
                    let content = data.get(FL.len()..FL.len() + length).unwrap_or_default();
                    let content = content.to_vec();
                    self.acknowledge_last(content);
                }
            }
            Exchange::Idle
            | Exchange::One(_)
            | Exchange::Content(..)
            | Exchange::Binary(..)
            | Exchange::Sending(_)
            | Exchange::Acknowledging(_)
            | Exchange::Bytes => self.unexpected(text),
        }
    }

    fn unexpected(&mut self, text: Text) {
        let expected = match self.outgoing {
            Some(_) => Expected::Nothing,
            None => self.expected(),
        };
        self.fail(ExchangeError::Unexpected { expected, text });
    }

    fn respond(&mut self, response: Response) {
        self.end();
        self.events.push_back(Event::Response(response));
    }

    fn fail(&mut self, error: ExchangeError) {
        self.end();
        self.events.push_back(Event::Failed(error));
    }

    /// Ends the exchange; returns what it was.
    fn end(&mut self) -> Exchange {
        (self.outgoing, self.due) = (None, None);
        core::mem::replace(&mut self.exchange, Exchange::Idle)
    }

    fn send_next_text(&mut self) {
        let Exchange::Sending(sender) = &mut self.exchange else {
            return;
        };
        match sender.next_text() {
            Some(data) => {
                let bytes = self.options.text(data);
                self.outgoing = Some(Outgoing { bytes, waits: true });
            }
            None => self.respond(Response::Ok),
        }
    }

    /// Acknowledges a text of a file that is not complete.
    fn acknowledge_text(&mut self) {
        let bytes = self.options.text(&Reply::Ok.encode());
        self.outgoing = Some(Outgoing { bytes, waits: true });
    }

    /// Acknowledges the last text of a file. The response follows the acknowledgement, so that an owner that closes the
    /// connection has sent it.
    fn acknowledge_last(&mut self, content: Vec<u8>) {
        self.acknowledge_text();
        self.exchange = Exchange::Acknowledging(Response::Content(content));
    }

    fn pause_end(&self) -> Option<Duration> {
        let outgoing = self.outgoing.as_ref()?;
        outgoing.waits.then_some(self.last? + self.options.pause)
    }

    /// When the reply has to be complete that is expected from now on.
    fn reply_deadline(&self, now: Duration) -> Option<Duration> {
        let has_limit = match self.expected() {
            Expected::Nothing | Expected::Stop | Expected::Bytes => false,
            Expected::Acknowledgement
            | Expected::Content
            | Expected::NextText
            | Expected::SystemStatus
            | Expected::LineWords
            | Expected::Text => true,
        };
        has_limit.then(|| now.saturating_add(self.options.timeout))
    }
}

impl Exchange {
    fn new(expected: Expected) -> Exchange {
        match expected {
            Expected::Nothing => Exchange::Idle,
            Expected::Acknowledgement | Expected::Stop | Expected::Text => Exchange::One(expected),
            Expected::Content | Expected::NextText => Exchange::Content(
                FlReceiver::new(MAX_CONTENT, FileRule::Parameter),
                expected == Expected::NextText,
            ),
            Expected::SystemStatus | Expected::LineWords => Exchange::Binary(expected, Vec::new()),
            Expected::Bytes => Exchange::Bytes,
        }
    }
}

/// Data bytes of the first text of SF or IO, from its beginning; `None` while too little of it is there.
fn binary_length(expected: Expected, data: &[u8]) -> Option<usize> {
    if expected == Expected::LineWords {
        // The manual's IO ends with its 80 bytes (hosts 8.2); EOF, or EOF and CR, is read too.
        if *data.get(LINE_WORDS)? != EOF {
            return Some(LINE_WORDS);
        }
        let has_cr = *data.get(LINE_WORDS + 1)? == CR;
        return Some(LINE_WORDS + 1 + usize::from(has_cr));
    }
    // The one text of an SF of eight axes has names where every other first text has its ETX, after 253 data bytes;
    // names have no control codes.
    Some(match *data.get(MAX_DATA)? {
        ETX => MAX_DATA,
        _ => WHOLE_STATUS,
    })
}

/// Length of the content of SF or IO, whose first text has come.
fn content_length(expected: Expected, data: &[u8]) -> usize {
    if expected == Expected::LineWords {
        return io::LENGTH;
    }
    if data.len() == MAX_DATA {
        // A SCARA's, or the first of the manual's two texts (SF-02).
        return SfLayout::from_first_text(data.get(FL.len()..).unwrap_or_default()).len();
    }
    SfLayout::Eight.len()
}

#[cfg(test)]
mod tests;
