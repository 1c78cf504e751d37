//! The last records of a run in memory, while the control interface is open, so that a test can fetch the transcript of a
//! running emulator. Files of unlimited length are written by `recorder`.
//!
//! The transcript replays from its first record, also when older ones are discarded: every eighth of the buffer begins with a
//! copy of the controller, and records are discarded up to the next copy. A copy is serialized only when the transcript is
//! fetched.

use super::{Format, Header, LinkRecord, PeerId, Record, RecordKind, Side};
use crate::byte_log::ByteLog;
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use ts3100_controller::{Bytes, Controller, Port, Time};
use ts3100_proto::calendar::CalendarTime;

/// Most records in the buffer; the oldest are discarded.
pub const MAX_BUFFERED_RECORDS: usize = 16_384;
/// Most bytes in the buffer; the oldest records are discarded.
pub const MAX_BUFFERED_BYTES: usize = 8 * 1024 * 1024;

/// Ends the remark that says how many records were discarded.
const GONE: &str = " records before this one are no longer kept";
/// Estimated size of a record without its bytes.
const RECORD_OVERHEAD: usize = 64;
/// Estimated size of a controller without its files.
const CONTROLLER_OVERHEAD: usize = 16 * 1024;
/// Pieces of a full buffer, each with a copy of the controller. More pieces discard fewer records at once, and cost more
/// copies.
const PIECES: usize = 8;

/// The remark at the end of a recording that was fetched later than its last record.
pub(super) const END: &str = "the recording ends here";

/// Whether a remark says that records before it were discarded.
pub(super) fn is_gone(remark: &str) -> bool {
    let count = remark.strip_suffix(GONE);
    count.is_some_and(|count| count.parse::<u64>().is_ok())
}

/// One record of the buffer.
#[derive(Debug)]
enum BufferedRecord {
    /// The bytes of the entry, and the side that sent them.
    Sent {
        at: Time,
        line: PeerId,
        by: Side,
    },
    Record(Box<Record>),
    /// A restored snapshot; it is serialized only when the transcript is fetched.
    Restored(Time, Box<Controller>),
}

impl BufferedRecord {
    /// Estimated size besides the bytes of the entry.
    fn size(&self) -> usize {
        RECORD_OVERHEAD
            + match self {
                BufferedRecord::Sent { .. } => 0,
                BufferedRecord::Record(record) => match &record.kind {
                    RecordKind::Remark(words) => words.len(),
                    RecordKind::Action(ts3100_controller::Action::PutFile { content, .. }) => content.len(),
                    RecordKind::Link(LinkRecord::SerialErrors { bytes, .. }) => bytes.len(),
                    RecordKind::Link(LinkRecord::Injected { bytes, .. }) => bytes.len(),
                    RecordKind::Link(LinkRecord::Restored { snapshot, .. }) => snapshot.len(),
                    RecordKind::Link(LinkRecord::Begin { snapshot, .. }) => snapshot.len(),
                    RecordKind::Connected { .. }
                    | RecordKind::FromHost { .. }
                    | RecordKind::FromRobot { .. }
                    | RecordKind::Ended { .. }
                    | RecordKind::Action(_)
                    | RecordKind::Link(_) => 0,
                },
                BufferedRecord::Restored(_, controller) => controller_size(controller),
            }
    }

    /// The record, with the bytes of the entry.
    fn record(&self, bytes: Vec<u8>) -> Record {
        match self {
            BufferedRecord::Sent { at, line, by } => {
                let (line, bytes) = (*line, Bytes::from(bytes));
                let kind = match by {
                    Side::Host => RecordKind::FromHost { line, bytes },
                    Side::Robot => RecordKind::FromRobot { line, bytes },
                };
                Record { at: *at, kind }
            }
            BufferedRecord::Record(record) => (**record).clone(),
            BufferedRecord::Restored(at, controller) => Record {
                at: *at,
                kind: RecordKind::Link(LinkRecord::from_restored(controller)),
            },
        }
    }
}

/// Estimated size of a copy of the controller.
fn controller_size(controller: &Controller) -> usize {
    let files = controller.files();
    let files = files.map(|(name, content)| name.len() + content.len());
    CONTROLLER_OVERHEAD + files.sum::<usize>()
}

/// The controller before a record.
#[derive(Debug)]
struct Beginning {
    /// Number of the record, counted from 0 since the start or the last reset.
    record: u64,
    /// Ports with a peer.
    connected: BTreeSet<Port>,
    /// Findings about the host's timing are not reported.
    is_untimed: bool,
    controller: Box<Controller>,
}

impl Beginning {
    /// The records of it.
    fn records(&self) -> impl Iterator<Item = Record> {
        let link = LinkRecord::from_beginning(&self.controller, &self.connected);
        let begin = Record {
            at: Time::ZERO,
            kind: RecordKind::Link(link),
        };
        let untimed = self.is_untimed.then(|| Record::untimed(self.controller.now()));
        [begin].into_iter().chain(untimed)
    }
}

#[derive(Debug, Default)]
struct BufferState {
    header: Header,
    /// Most records; the bytes are limited in the same proportion.
    most: usize,
    records: ByteLog<BufferedRecord>,
    /// Estimated size of the records.
    size: usize,
    /// Oldest first. The records before the first of them begin with the header.
    beginnings: VecDeque<Beginning>,
    /// Estimated size of the beginnings.
    copies: usize,
    /// Estimated size of the records since the last beginning.
    piece: usize,
    discarded: u64,
}

impl BufferState {
    fn push(&mut self, record: BufferedRecord, bytes: &[u8]) {
        let size = record.size() + bytes.len();
        self.size += size;
        self.piece += size;
        self.records.push(record, bytes);
        self.discard_surplus();
        // A single piece can grow that large only while an input is being handled. Its rest has no beginning and is discarded
        // before the next piece.
        if self.records.len() > self.most || self.size > self.most_bytes() {
            self.discard_until(self.next_record());
        }
    }

    /// Most bytes of records and copies.
    fn most_bytes(&self) -> usize {
        self.most * (MAX_BUFFERED_BYTES / MAX_BUFFERED_RECORDS)
    }

    /// Number of the next record.
    fn next_record(&self) -> u64 {
        self.discarded + self.records.len() as u64
    }

    /// Whether the records kept begin with a known controller.
    fn has_beginning(&self) -> bool {
        let first = self.beginnings.front();
        self.discarded == 0 || first.is_some_and(|beginning| beginning.record == self.discarded)
    }

    /// Whether a copy of the controller is due before the next record.
    fn needs_beginning(&self) -> bool {
        let last = self.beginnings.back().map_or(0, |beginning| beginning.record);
        let records = usize::try_from(self.next_record() - last).unwrap_or(usize::MAX);
        !self.has_beginning()
            || records >= self.most.div_ceil(PIECES)
            || self.piece >= self.most_bytes().div_ceil(PIECES)
    }

    fn begin(&mut self, connected: BTreeSet<Port>, is_untimed: bool, controller: Box<Controller>) {
        if !self.has_beginning() {
            self.discard_until(self.next_record());
        }
        self.copies += controller_size(&controller);
        self.piece = 0;
        self.beginnings.push_back(Beginning {
            record: self.next_record(),
            connected,
            is_untimed,
            controller,
        });
        self.discard_surplus();
    }

    /// Discards the oldest pieces while the buffer is too large. The last piece stays: a robot whose files alone are too large
    /// has one copy of them here.
    fn discard_surplus(&mut self) {
        while (self.records.len() > self.most || self.size + self.copies > self.most_bytes())
            && let Some(next) = self.second_piece()
        {
            self.discard_until(next);
        }
    }

    /// Number of the first record of the second piece.
    fn second_piece(&self) -> Option<u64> {
        let mut records = self.beginnings.iter().map(|beginning| beginning.record);
        records.find(|record| *record > self.discarded)
    }

    /// Discards the records before this one, and their beginnings.
    fn discard_until(&mut self, record: u64) {
        while self.discarded < record
            && let Some((oldest, length)) = self.records.pop()
        {
            self.size -= oldest.size() + length;
            self.discarded += 1;
        }
        while let Some(oldest) = self.beginnings.front()
            && oldest.record < record
        {
            self.copies -= controller_size(&oldest.controller);
            self.beginnings.pop_front();
        }
    }
}

/// The last records of a run.
#[derive(Debug, Default)]
pub struct TranscriptBuffer(Mutex<BufferState>);

impl TranscriptBuffer {
    /// An empty buffer for at most this many records, up to [`MAX_BUFFERED_RECORDS`].
    pub fn new(header: Header, most: usize) -> TranscriptBuffer {
        TranscriptBuffer(Mutex::new(BufferState {
            header,
            most: most.min(MAX_BUFFERED_RECORDS),
            ..BufferState::default()
        }))
    }

    /// A panic in another thread cannot leave the state inconsistent, so a poisoned lock is usable.
    fn state(&self) -> MutexGuard<'_, BufferState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends a record.
    pub fn push(&self, record: Record) {
        let (by, line, bytes) = if let RecordKind::FromHost { line, bytes } = &record.kind {
            (Side::Host, *line, bytes)
        } else if let RecordKind::FromRobot { line, bytes } = &record.kind {
            (Side::Robot, *line, bytes)
        } else {
            let record = BufferedRecord::Record(Box::new(record));
            return self.state().push(record, &[]);
        };
        let at = record.at;
        self.state().push(BufferedRecord::Sent { at, line, by }, bytes);
    }

    /// Appends a record that this controller replaces the current one.
    pub fn restored(&self, at: Time, controller: &Controller) {
        let controller = Box::new(controller.clone());
        self.state().push(BufferedRecord::Restored(at, controller), &[]);
    }

    /// Whether [`TranscriptBuffer::begin`] is due: as soon as nothing waits to be handled.
    pub fn needs_beginning(&self) -> bool {
        self.state().needs_beginning()
    }

    /// Keeps a copy of this controller, so that the records before it can be discarded. Only between two inputs: a replay
    /// continues with the next record. `is_untimed` if findings about the host's timing are not reported.
    pub fn begin(&self, connected: BTreeSet<Port>, is_untimed: bool, controller: &Controller) {
        let controller = Box::new(controller.clone());
        self.state().begin(connected, is_untimed, controller);
    }

    /// Clears the buffer after a reset to the start.
    pub fn restart(&self, calendar: Option<CalendarTime>) {
        let pages = &mut *self.state();
        let header = Header {
            calendar,
            ..std::mem::take(&mut pages.header)
        };
        *pages = BufferState {
            header,
            most: pages.most,
            ..BufferState::default()
        };
    }

    /// The transcript in a file format. If records were discarded, it begins with a remark that says how many, and with the
    /// controller as it was at the first record that is kept.
    pub fn to_bytes(&self, format: Format) -> Vec<u8> {
        self.written(format, None)
    }

    /// As [`TranscriptBuffer::to_bytes`], up to the present: time that has passed since the last record is part of the run.
    pub fn to_bytes_until(&self, format: Format, now: Time) -> Vec<u8> {
        self.written(format, Some(now))
    }

    fn written(&self, format: Format, now: Option<Time>) -> Vec<u8> {
        let pages = self.state();
        let missing = (pages.discarded > 0).then(|| Record {
            at: Time::ZERO,
            kind: RecordKind::Remark(format!("{}{GONE}", pages.discarded)),
        });
        let first = pages.beginnings.front();
        let first = first.filter(|_| pages.discarded > 0 && pages.has_beginning());
        let begin = first.into_iter().flat_map(Beginning::records);
        let records = pages
            .records
            .iter_from(0)
            .map(|(record, bytes)| record.record(bytes.to_vec()));
        let records = missing.into_iter().chain(begin).chain(records);
        let mut out = Vec::new();
        let mut writer = format.writer(Duration::ZERO);
        writer.header(&pages.header, &mut out);
        let mut last = Time::ZERO;
        for record in records {
            last = record.kind.new_time().unwrap_or(record.at);
            writer.record(&record, &mut out);
        }
        if let Some(at) = now.filter(|now| *now > last) {
            let kind = RecordKind::Remark(END.to_owned());
            writer.record(&Record { at, kind }, &mut out);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::{Config, Dialect, Port, Time};

    fn record(at: u64, length: usize) -> Record {
        Record {
            at: Time::from_micros(at),
            kind: RecordKind::FromHost {
                line: PeerId::first(Port::Ip1),
                bytes: vec![b'7'; length].into(),
            },
        }
    }

    fn text(buffer: &TranscriptBuffer) -> String {
        String::from_utf8(buffer.to_bytes(Format::Text)).unwrap()
    }

    /// A controller with files of 64 KiB.
    fn robot(files: usize) -> Controller {
        let mut controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        for number in 0..files {
            let content = b"END\n".repeat(16_384);
            controller.put_file(&format!("BIG{number}"), &content).unwrap();
        }
        controller
    }

    /// Appends a record, after which nothing waits.
    fn settle(buffer: &TranscriptBuffer, record: Record, controller: &Controller) {
        buffer.push(record);
        if buffer.needs_beginning() {
            buffer.begin(BTreeSet::new(), false, controller);
        }
    }

    /// Number of records kept, after a check that they begin with a controller if others are gone.
    fn kept(buffer: &TranscriptBuffer) -> usize {
        let text = text(buffer);
        let mut lines = text.lines().skip(2);
        let gone = text.contains(" records before this one are no longer kept\n");
        if gone {
            assert!(lines.next().unwrap().starts_with("# "), "{text}");
            assert!(lines.next().unwrap().starts_with("! begin "), "{text}");
        }
        text.matches("> IP1 7").count()
    }

    #[test]
    fn it_is_bounded_in_records_and_says_what_is_gone() {
        let buffer = TranscriptBuffer::new(Header::default(), MAX_BUFFERED_RECORDS);
        let controller = robot(0);
        for at in 0..MAX_BUFFERED_RECORDS as u64 {
            settle(&buffer, record(at, 1), &controller);
        }
        assert_eq!(kept(&buffer), MAX_BUFFERED_RECORDS);
        assert!(!text(&buffer).contains('#'));
        settle(&buffer, record(99_999, 1), &controller);
        let piece = MAX_BUFFERED_RECORDS / PIECES;
        assert_eq!(kept(&buffer), MAX_BUFFERED_RECORDS - piece + 1);
        let gone = format!("# {piece} records before this one are no longer kept\n");
        assert!(text(&buffer).contains(&gone));
        for at in 0..MAX_BUFFERED_RECORDS as u64 {
            settle(&buffer, record(at, 1), &controller);
            let kept = buffer.state().records.len();
            assert!((MAX_BUFFERED_RECORDS - piece..=MAX_BUFFERED_RECORDS).contains(&kept));
        }
        buffer.restart(None);
        buffer.push(record(0, 3));
        assert!(text(&buffer).ends_with("> IP1 777\n") && !text(&buffer).contains('#'));
    }

    #[test]
    fn copies_of_the_controller_count_with_their_files() {
        let most_bytes = 256 * MAX_BUFFERED_BYTES / MAX_BUFFERED_RECORDS;
        for files in [0, 1, 4] {
            let buffer = TranscriptBuffer::new(Header::default(), 256);
            let controller = robot(files);
            let copy = controller_size(&controller);
            assert!(copy > files * 65_536);
            for at in 0..1_000 {
                settle(
                    &buffer,
                    record(at, 100 + usize::try_from(at).unwrap() % 50),
                    &controller,
                );
                assert!(buffer.state().has_beginning());
                let state = buffer.state();
                assert_eq!(state.copies, state.beginnings.len() * copy);
                // One copy alone may be larger than the buffer.
                let most = most_bytes.max(copy + most_bytes / PIECES + 500);
                assert!(
                    state.size + state.copies <= most,
                    "{files}: {}",
                    state.size + state.copies
                );
            }
            assert!(kept(&buffer) > 0, "{files}");
        }
    }

    #[test]
    fn an_input_with_more_records_than_fit_leaves_those_after_it() {
        let buffer = TranscriptBuffer::new(Header::default(), 64);
        let controller = robot(0);
        for at in 0..200 {
            buffer.push(record(at, 1));
            assert!(buffer.state().records.len() <= 64);
        }
        assert!(buffer.needs_beginning());
        buffer.begin(BTreeSet::new(), false, &controller);
        settle(&buffer, record(200, 1), &controller);
        assert_eq!(kept(&buffer), 1);
        assert!(text(&buffer).contains("# 200 records before this one are no longer kept\n"));
        settle(&buffer, record(201, MAX_BUFFERED_BYTES), &controller);
        assert_eq!(kept(&buffer), 0);
        assert!(text(&buffer).contains("# 202 records before this one are no longer kept\n"));
    }
}
