//! The last records of a run in memory, while the control interface is open, so that a test can fetch the transcript of a
//! running emulator. Files of unlimited length are written by `recorder`.

use super::{Format, Header, LinkRecord, PeerId, Record, RecordKind, Side};
use crate::byte_log::ByteLog;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use ts3100_controller::{Bytes, Controller, Time};
use ts3100_proto::calendar::CalendarTime;

/// Most records in the buffer; the oldest are discarded.
pub const MAX_BUFFERED_RECORDS: usize = 16_384;
/// Most bytes in the buffer; the oldest records are discarded.
pub const MAX_BUFFERED_BYTES: usize = 8 * 1024 * 1024;

/// Estimated size of a record without its bytes.
const RECORD_OVERHEAD: usize = 64;
/// Estimated size of a controller without its files.
const CONTROLLER_OVERHEAD: usize = 16 * 1024;

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
    fn at(&self) -> Time {
        match self {
            BufferedRecord::Record(record) => record.at,
            BufferedRecord::Sent { at, .. } | BufferedRecord::Restored(at, _) => *at,
        }
    }

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
                    RecordKind::Connected { .. }
                    | RecordKind::FromHost { .. }
                    | RecordKind::FromRobot { .. }
                    | RecordKind::Ended { .. }
                    | RecordKind::Action(_)
                    | RecordKind::Link(_) => 0,
                },
                BufferedRecord::Restored(_, controller) => {
                    let files = controller
                        .files()
                        .map(|(name, content)| name.len() + content.len());
                    CONTROLLER_OVERHEAD + files.sum::<usize>()
                }
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

#[derive(Debug, Default)]
struct BufferState {
    header: Header,
    /// Most records; the bytes are limited in the same proportion.
    most: usize,
    records: ByteLog<BufferedRecord>,
    /// Estimated size of all records.
    size: usize,
    discarded: u64,
}

impl BufferState {
    fn push(&mut self, record: BufferedRecord, bytes: &[u8]) {
        self.size += record.size() + bytes.len();
        self.records.push(record, bytes);
        let most_bytes = self.most * (MAX_BUFFERED_BYTES / MAX_BUFFERED_RECORDS);
        while self.records.len() > self.most || self.size > most_bytes {
            let Some((oldest, length)) = self.records.pop() else {
                return;
            };
            self.size -= oldest.size() + length;
            self.discarded += 1;
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

    /// The transcript in a file format. A remark in front says how many records were discarded.
    pub fn to_bytes(&self, format: Format) -> Vec<u8> {
        let pages = self.state();
        let missing = pages.records.first().filter(|_| pages.discarded > 0);
        let missing = missing.map(|(first, _)| Record {
            at: first.at(),
            kind: RecordKind::Remark(format!(
                "{} records before this one are no longer kept",
                pages.discarded
            )),
        });
        let records = pages
            .records
            .iter_from(0)
            .map(|(record, bytes)| record.record(bytes.to_vec()));
        let records = missing.into_iter().chain(records);
        let mut out = Vec::new();
        let mut writer = format.writer(Duration::ZERO);
        writer.header(&pages.header, &mut out);
        records.for_each(|record| writer.record(&record, &mut out));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::{Port, Time};

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

    #[test]
    fn it_is_bounded_in_records_and_bytes_and_says_what_is_gone() {
        let buffer = TranscriptBuffer::new(Header::default(), MAX_BUFFERED_RECORDS);
        for at in 0..MAX_BUFFERED_RECORDS as u64 + 2 {
            buffer.push(record(at, 1));
        }
        assert_eq!(text(&buffer).matches("> IP1 7").count(), MAX_BUFFERED_RECORDS);
        assert!(text(&buffer).contains("# 2 records before this one are no longer kept\n"));
        buffer.push(record(99_999, MAX_BUFFERED_BYTES - RECORD_OVERHEAD));
        assert_eq!(text(&buffer).matches("> IP1 7").count(), 1);
        buffer.push(record(99_999, MAX_BUFFERED_BYTES));
        assert!(!text(&buffer).contains("> IP1 7"));
        buffer.restart(None);
        buffer.push(record(0, 3));
        assert!(text(&buffer).ends_with("> IP1 777\n") && !text(&buffer).contains('#'));
    }
}
