//! Splits the bytes of a recording into the units that are compared: texts on a protocol port, records on a channel. Both
//! the recording and the emulator's output are split by the same rules, because the wire may cut bytes anywhere.

use crate::transcript::{EndReason, LinkRecord, PeerId, RecordKind, Recording, Side};
use std::collections::{BTreeMap, BTreeSet};
use ts3100_controller::Time;
use ts3100_proto::dissect::text_length;
use ts3100_proto::escape::Escaped;
use ts3100_proto::reply::Reply;
use ts3100_proto::text::{CR, Checksum, Decoded, ETX, Reading, STX, TextDecoder, TextOptions};

/// Bytes that wait for the end of their text or record; then they are taken as they are.
const MAX_BUFFER: usize = 65_536;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// A text with its framing, a record with its CR, or the bytes received instead.
    pub bytes: Vec<u8>,
    /// Letters of the command that it answers, as far as that is known.
    pub letters: String,
    /// The host's text before it.
    pub question: String,
    /// When its last byte came.
    pub at: Time,
    /// Line of the file with its first byte; 0 for the emulator's own.
    pub file_line: usize,
    /// Its end has come.
    pub complete: bool,
}

impl Answer {
    /// Whether it is SP, which comes unasked.
    pub fn is_sp(&self) -> bool {
        parse_reply(&self.bytes) == Some(Reply::Sp)
    }
}

/// Cuts one line's bytes.
#[derive(Debug, Clone)]
pub(crate) struct AnswerSplitter {
    options: TextOptions,
    /// Texts; else records.
    has_texts: bool,
    host: TextDecoder,
    letters: String,
    question: String,
    buffer: Vec<u8>,
    first_line: usize,
    last: Time,
}

impl AnswerSplitter {
    pub(crate) fn new(line: PeerId, options: TextOptions) -> AnswerSplitter {
        AnswerSplitter {
            options,
            has_texts: line.port.protocol().is_some(),
            host: TextDecoder::new(options),
            letters: String::new(),
            question: String::new(),
            buffer: Vec::new(),
            first_line: 0,
            last: Time::ZERO,
        }
    }

    /// Bytes of the host: they tell what is asked.
    pub(crate) fn push_host(&mut self, bytes: &[u8]) {
        if !self.has_texts {
            self.question = Escaped::for_reading(bytes).to_string();
            return;
        }
        self.host.push(bytes);
        while let Some(decoded) = self.host.next_as(Reading::Command) {
            self.note_question(decoded);
        }
    }

    /// A text of the host tells which command comes next.
    fn note_question(&mut self, decoded: Decoded) {
        let Decoded::Text(text) = decoded else {
            return;
        };
        let message = text.data.strip_suffix(&[CR]).unwrap_or(&text.data);
        self.question = Escaped::for_reading(message).to_string();
        if let Some(letters @ [b'A'..=b'Z' | b'a'..=b'z', b'A'..=b'Z' | b'a'..=b'z']) = message.get(..2) {
            let letters = String::from_utf8_lossy(letters).to_ascii_uppercase();
            if !["OK", "NG", "FL"].contains(&letters.as_str()) {
                self.letters = letters;
            }
        }
    }

    /// Bytes of the controller: the answers they complete.
    pub(crate) fn push_robot(&mut self, at: Time, file_line: usize, bytes: &[u8]) -> Vec<Answer> {
        // The controller answers a text whose CR came last: its host sends no ETX.
        if let Some(decoded) = self.host.end_at_cr() {
            self.note_question(decoded);
        }
        if self.buffer.is_empty() {
            self.first_line = file_line;
        }
        self.buffer.extend_from_slice(bytes);
        self.last = at;
        let mut answers = Vec::new();
        while let Some(length) = self.length() {
            answers.push(self.take(length, true));
            self.first_line = file_line;
        }
        if self.buffer.len() > MAX_BUFFER {
            answers.extend(self.flush());
        }
        answers
    }

    /// Returns the incomplete answer.
    pub(crate) fn flush(&mut self) -> Option<Answer> {
        (!self.buffer.is_empty()).then(|| self.take(self.buffer.len(), false))
    }

    fn length(&self) -> Option<usize> {
        if !self.has_texts {
            return self.buffer.iter().position(|byte| *byte == CR).map(|at| at + 1);
        }
        let length = text_length(&self.letters, &self.buffer)?;
        let whole = length + usize::from(self.options.checksum == Checksum::Sum);
        (whole <= self.buffer.len()).then_some(whole)
    }

    fn take(&mut self, length: usize, complete: bool) -> Answer {
        let rest = self.buffer.split_off(length.min(self.buffer.len()));
        Answer {
            bytes: std::mem::replace(&mut self.buffer, rest),
            letters: self.letters.clone(),
            question: self.question.clone(),
            at: self.last,
            file_line: self.first_line,
            complete,
        }
    }
}

/// Something in a recording that is played or compared.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// Of the host or the panel, to be played.
    Input(RecordKind),
    Answer(PeerId, Answer),
    /// The controller ends a connection.
    Ended(PeerId, EndReason),
}

/// An event with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedEvent {
    pub at: Time,
    pub file_line: usize,
    pub event: Event,
}

/// The events of a recording, in order. Bytes without an end before the next action of the host count as an answer.
pub fn events(recording: &Recording, options: TextOptions) -> Vec<RecordedEvent> {
    let mut events = Vec::new();
    let mut splitters: BTreeMap<PeerId, AnswerSplitter> = BTreeMap::new();
    let new = |line| AnswerSplitter::new(line, options);
    let mut left_by_host = BTreeSet::new();
    for (record, &file_line) in recording.records.iter().zip(&recording.lines) {
        let at = record.at;
        let place = |event| RecordedEvent { at, file_line, event };
        match &record.kind {
            RecordKind::FromRobot { line, bytes } => {
                let splitter = splitters.entry(*line).or_insert_with(|| new(*line));
                let answers = splitter.push_robot(at, file_line, bytes);
                events.extend(answers.into_iter().map(|answer| answer_event(*line, answer)));
            }
            RecordKind::Ended {
                line,
                by: Side::Robot,
                how,
            } => {
                let rest = splitters.remove(line).and_then(|mut splitter| splitter.flush());
                events.extend(rest.map(|answer| answer_event(*line, answer)));
                // Behind the host's own end it says nothing.
                if !left_by_host.remove(line) {
                    events.push(place(Event::Ended(*line, *how)));
                }
            }
            RecordKind::Remark(_) => {}
            input @ (RecordKind::Connected { .. }
            | RecordKind::FromHost { .. }
            | RecordKind::Ended { .. }
            | RecordKind::Action(_)
            | RecordKind::Link(_)) => {
                for (line, splitter) in &mut splitters {
                    events.extend(splitter.flush().map(|answer| answer_event(*line, answer)));
                }
                match input {
                    RecordKind::Connected { line, .. } => {
                        left_by_host.remove(line);
                        splitters.insert(*line, new(*line));
                    }
                    RecordKind::FromHost { line, bytes } => {
                        let splitter = splitters.entry(*line).or_insert_with(|| new(*line));
                        splitter.push_host(bytes);
                    }
                    RecordKind::Ended { line, .. } => {
                        left_by_host.insert(*line);
                    }
                    // As the player does it.
                    RecordKind::Link(LinkRecord::Begin { .. }) => {
                        splitters.clear();
                        left_by_host.clear();
                    }
                    RecordKind::FromRobot { .. }
                    | RecordKind::Action(_)
                    | RecordKind::Link(_)
                    | RecordKind::Remark(_) => {}
                }
                events.push(place(Event::Input(input.clone())));
            }
        }
    }
    for (line, splitter) in &mut splitters {
        events.extend(splitter.flush().map(|answer| answer_event(*line, answer)));
    }
    events
}

fn answer_event(line: PeerId, answer: Answer) -> RecordedEvent {
    RecordedEvent {
        at: answer.at,
        file_line: answer.file_line,
        event: Event::Answer(line, answer),
    }
}

/// The reply in a text, if it is one.
pub fn parse_reply(wire: &[u8]) -> Option<Reply> {
    let end = wire.iter().rposition(|byte| *byte == ETX)?;
    let data = wire.get(..end)?;
    Reply::parse(data.strip_prefix(&[STX]).unwrap_or(data)).ok()
}
