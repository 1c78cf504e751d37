//! What can be compared one by one: the texts of a protocol port, the records of a channel. Recordings have bytes as
//! they were cut on the wire, and a controller sends them as it likes; both are cut anew here, by the same rules.

use crate::transcript::{EndReason, PeerId, RecordKind, Recording, Side};
use std::collections::{BTreeMap, BTreeSet};
use ts3100_controller::Time;
use ts3100_proto::dissect::text_length;
use ts3100_proto::text::{CR, Checksum, Decoded, TextDecoder, TextOptions};

/// Bytes that wait for the end of their text or record; then they are taken as they are.
const MAX_WAITING: usize = 65_536;

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Unit {
    /// A text with its framing, a record with its CR, or what stands there in their place.
    pub(super) bytes: Vec<u8>,
    /// Letters of the command that it answers, as far as that is known.
    pub(super) letters: String,
    /// The host's text before it.
    pub(super) question: String,
    /// When its last byte came.
    pub(super) at: Time,
    /// Line of the file in which its first byte stands; 0 for the emulator's own.
    pub(super) file_line: usize,
    /// Its end has come.
    pub(super) complete: bool,
}

/// Cuts one line's bytes.
#[derive(Debug, Clone)]
pub(super) struct Cutter {
    options: TextOptions,
    /// Texts; else records.
    texts: bool,
    host: TextDecoder,
    letters: String,
    question: String,
    waiting: Vec<u8>,
    since: usize,
    last: Time,
}

impl Cutter {
    pub(super) fn new(line: PeerId, options: TextOptions) -> Cutter {
        Cutter {
            options,
            texts: line.port.protocol().is_some(),
            host: TextDecoder::new(options),
            letters: String::new(),
            question: String::new(),
            waiting: Vec::new(),
            since: 0,
            last: Time::ZERO,
        }
    }

    /// Bytes of the host: they tell what is asked.
    pub(super) fn host(&mut self, bytes: &[u8]) {
        if !self.texts {
            self.question = crate::log::Escaped(bytes).to_string();
            return;
        }
        self.host.push(bytes);
        while let Some(decoded) = self.host.next() {
            let Decoded::Text(text) = decoded else {
                continue;
            };
            let message = text.data.strip_suffix(&[CR]).unwrap_or(&text.data);
            self.question = crate::log::Escaped(message).to_string();
            if let Some(letters @ [b'A'..=b'Z' | b'a'..=b'z', b'A'..=b'Z' | b'a'..=b'z']) = message.get(..2) {
                let letters = String::from_utf8_lossy(letters).to_ascii_uppercase();
                if !["OK", "NG", "FL"].contains(&letters.as_str()) {
                    self.letters = letters;
                }
            }
        }
    }

    /// Bytes of the controller: the answers they complete.
    pub(super) fn robot(&mut self, at: Time, file_line: usize, bytes: &[u8]) -> Vec<Unit> {
        if self.waiting.is_empty() {
            self.since = file_line;
        }
        self.waiting.extend_from_slice(bytes);
        self.last = at;
        let mut units = Vec::new();
        while let Some(length) = self.length() {
            units.push(self.take(length, true));
            self.since = file_line;
        }
        if self.waiting.len() > MAX_WAITING {
            units.extend(self.flush());
        }
        units
    }

    /// What waits for its end, as it is.
    pub(super) fn flush(&mut self) -> Option<Unit> {
        (!self.waiting.is_empty()).then(|| self.take(self.waiting.len(), false))
    }

    fn length(&self) -> Option<usize> {
        if !self.texts {
            return self.waiting.iter().position(|byte| *byte == CR).map(|at| at + 1);
        }
        let length = text_length(&self.letters, &self.waiting)?;
        let whole = length + usize::from(self.options.checksum == Checksum::Sum);
        (whole <= self.waiting.len()).then_some(whole)
    }

    fn take(&mut self, length: usize, complete: bool) -> Unit {
        let rest = self.waiting.split_off(length.min(self.waiting.len()));
        Unit {
            bytes: std::mem::replace(&mut self.waiting, rest),
            letters: self.letters.clone(),
            question: self.question.clone(),
            at: self.last,
            file_line: self.since,
            complete,
        }
    }
}

/// Something in a recording that is played or compared.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Event {
    /// Of the host or the panel, to be played.
    Input(RecordKind),
    /// An answer.
    Answer(PeerId, Unit),
    /// The controller ends a connection.
    Ended(PeerId, EndReason),
}

/// An event with its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    pub(super) at: Time,
    pub(super) file_line: usize,
    pub(super) event: Event,
}

/// The events of a recording, in order. What has no end when the host does the next thing is an answer as it is.
pub(super) fn events(recording: &Recording, options: TextOptions) -> Vec<Placed> {
    let mut events = Vec::new();
    let mut cutters: BTreeMap<PeerId, Cutter> = BTreeMap::new();
    let mut left_by_host = BTreeSet::new();
    for (record, &file_line) in recording.records.iter().zip(&recording.lines) {
        let at = record.at;
        let place = |event| Placed { at, file_line, event };
        match &record.what {
            RecordKind::FromRobot { line, bytes } => {
                let cutter = cutters
                    .entry(*line)
                    .or_insert_with(|| Cutter::new(*line, options));
                let units = cutter.robot(at, file_line, bytes);
                events.extend(units.into_iter().map(|unit| answer(*line, unit)));
            }
            RecordKind::Ended {
                line,
                by: Side::Robot,
                how,
            } => {
                events.extend(
                    cutters
                        .get_mut(line)
                        .and_then(Cutter::flush)
                        .map(|unit| answer(*line, unit)),
                );
                cutters.remove(line);
                // Behind the host's own end it says nothing.
                if !left_by_host.remove(line) {
                    events.push(place(Event::Ended(*line, *how)));
                }
            }
            RecordKind::Remark(_) => {}
            input => {
                for (line, cutter) in &mut cutters {
                    events.extend(cutter.flush().map(|unit| answer(*line, unit)));
                }
                match input {
                    RecordKind::Connected { line, .. } => {
                        left_by_host.remove(line);
                        cutters.insert(*line, Cutter::new(*line, options));
                    }
                    RecordKind::FromHost { line, bytes } => {
                        let cutter = cutters
                            .entry(*line)
                            .or_insert_with(|| Cutter::new(*line, options));
                        cutter.host(bytes);
                    }
                    RecordKind::Ended { line, .. } => {
                        left_by_host.insert(*line);
                    }
                    RecordKind::FromRobot { .. }
                    | RecordKind::Action(_)
                    | RecordKind::Edge(_)
                    | RecordKind::Remark(_) => {}
                }
                events.push(place(Event::Input(input.clone())));
            }
        }
    }
    for (line, cutter) in &mut cutters {
        events.extend(cutter.flush().map(|unit| answer(*line, unit)));
    }
    events
}

fn answer(line: PeerId, unit: Unit) -> Placed {
    Placed {
        at: unit.at,
        file_line: unit.file_line,
        event: Event::Answer(line, unit),
    }
}
