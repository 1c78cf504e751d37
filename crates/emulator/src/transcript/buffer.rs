//! The transcript that is kept in memory while the control interface is open: the last records, so that a test asks for
//! it while everything runs. Files of any length are `recorder`'s.

use super::{Format, Header, LinkRecord, Record, RecordKind, json, pcapng, text};
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use ts3100_controller::{Controller, Time};
use ts3100_proto::calendar::CalendarTime;

/// Records that are kept; of more, the oldest are forgotten.
pub const KEPT_RECORDS: usize = 16_384;
/// Bytes of hosts and robot that are kept; of more, the oldest are forgotten.
pub const KEPT_BYTES: usize = 8 * 1024 * 1024;

/// What one record takes besides its bytes, roughly.
const OVERHEAD: usize = 64;
/// What a controller takes besides its files, roughly.
const CONTROLLER: usize = 16 * 1024;

/// What is kept of one record.
#[derive(Debug)]
enum BufferedRecord {
    Record(Record),
    /// A snapshot was restored, which is written down only when somebody asks.
    Restored(Time, Box<Controller>),
}

impl BufferedRecord {
    fn at(&self) -> Time {
        match self {
            BufferedRecord::Record(record) => record.at,
            BufferedRecord::Restored(at, _) => *at,
        }
    }

    fn weight(&self) -> usize {
        OVERHEAD
            + match self {
                BufferedRecord::Record(record) => match &record.what {
                    RecordKind::FromHost { bytes, .. } | RecordKind::FromRobot { bytes, .. } => bytes.len(),
                    RecordKind::Remark(words) => words.len(),
                    RecordKind::Action(ts3100_controller::Action::PutFile { content, .. }) => content.len(),
                    RecordKind::Edge(LinkRecord::Garbled { bytes, .. }) => bytes.len(),
                    RecordKind::Edge(LinkRecord::Restored { snapshot, .. }) => snapshot.len(),
                    RecordKind::Connected { .. }
                    | RecordKind::Ended { .. }
                    | RecordKind::Action(_)
                    | RecordKind::Edge(_) => 0,
                },
                BufferedRecord::Restored(_, controller) => {
                    let files = controller
                        .files()
                        .map(|(name, content)| name.len() + content.len());
                    CONTROLLER + files.sum::<usize>()
                }
            }
    }

    fn record(&self) -> Record {
        match self {
            BufferedRecord::Record(record) => record.clone(),
            BufferedRecord::Restored(at, controller) => Record {
                at: *at,
                what: RecordKind::Edge(LinkRecord::restored(controller)),
            },
        }
    }
}

#[derive(Debug, Default)]
struct BufferState {
    header: Header,
    pages: VecDeque<BufferedRecord>,
    bytes: usize,
    forgotten: u64,
}

/// The last records of a run.
#[derive(Debug, Default)]
pub struct TranscriptBuffer(Mutex<BufferState>);

impl TranscriptBuffer {
    /// Nothing has happened yet.
    #[must_use]
    pub fn new(header: Header) -> TranscriptBuffer {
        TranscriptBuffer(Mutex::new(BufferState {
            header,
            ..BufferState::default()
        }))
    }

    /// The pages are whole between any two statements, so a panic elsewhere does not matter.
    fn pages(&self) -> MutexGuard<'_, BufferState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a record.
    pub fn put(&self, record: Record) {
        self.take(BufferedRecord::Record(record));
    }

    /// The state of this controller takes the present one's place.
    pub fn restored(&self, at: Time, controller: &Controller) {
        self.take(BufferedRecord::Restored(at, Box::new(controller.clone())));
    }

    fn take(&self, page: BufferedRecord) {
        let kept = &mut *self.pages();
        kept.bytes += page.weight();
        kept.pages.push_back(page);
        while kept.pages.len() > KEPT_RECORDS || kept.bytes > KEPT_BYTES {
            let Some(oldest) = kept.pages.pop_front() else {
                return;
            };
            kept.bytes -= oldest.weight();
            kept.forgotten += 1;
        }
    }

    /// Everything is as at the start, at this date and time.
    pub fn begin_anew(&self, calendar: Option<CalendarTime>) {
        let pages = &mut *self.pages();
        let header = Header {
            calendar,
            ..std::mem::take(&mut pages.header)
        };
        *pages = BufferState {
            header,
            ..BufferState::default()
        };
    }

    /// The transcript as a file has it. What is no longer kept is a remark in front of the first record.
    #[must_use]
    pub fn written(&self, format: Format) -> Vec<u8> {
        let pages = self.pages();
        let missing = pages.pages.front().filter(|_| pages.forgotten > 0);
        let missing = missing.map(|first| Record {
            at: first.at(),
            what: RecordKind::Remark(format!(
                "{} records before this one are no longer kept",
                pages.forgotten
            )),
        });
        let records = missing
            .into_iter()
            .chain(pages.pages.iter().map(BufferedRecord::record));
        let mut out = Vec::new();
        match format {
            Format::Text => {
                let mut writer = text::Writer::default();
                writer.header(&pages.header, &mut out);
                records.for_each(|record| writer.record(&record, &mut out));
            }
            Format::Json => {
                json::write_header(&pages.header, &mut out);
                records.for_each(|record| json::write_record(&record, &mut out));
            }
            Format::Pcapng => {
                let mut writer = pcapng::Writer::new(Duration::ZERO);
                writer.header(&pages.header, &mut out);
                records.for_each(|record| writer.record(&record, &mut out));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::PeerId;
    use super::*;
    use ts3100_controller::{Port, Time};

    fn record(at: u64, length: usize) -> Record {
        Record {
            at: Time::from_micros(at),
            what: RecordKind::FromHost {
                line: PeerId::first(Port::Ip1),
                bytes: vec![b'7'; length],
            },
        }
    }

    fn text(kept: &TranscriptBuffer) -> String {
        String::from_utf8(kept.written(Format::Text)).unwrap()
    }

    #[test]
    fn it_is_bounded_in_records_and_bytes_and_says_what_is_gone() {
        let kept = TranscriptBuffer::default();
        for at in 0..KEPT_RECORDS as u64 + 2 {
            kept.put(record(at, 1));
        }
        assert_eq!(text(&kept).matches("> IP1 7").count(), KEPT_RECORDS);
        assert!(text(&kept).contains("# 2 records before this one are no longer kept\n"));
        kept.put(record(99_999, KEPT_BYTES - OVERHEAD));
        assert_eq!(text(&kept).matches("> IP1 7").count(), 1);
        kept.put(record(99_999, KEPT_BYTES));
        assert!(!text(&kept).contains("> IP1 7"));
        kept.begin_anew(None);
        kept.put(record(0, 3));
        assert!(text(&kept).ends_with("> IP1 777\n") && !text(&kept).contains('#'));
    }
}
