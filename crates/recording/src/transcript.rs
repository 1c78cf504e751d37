//! Transcripts: the traffic of each port and the actions at the panel, in order and with times. Three formats: text to
//! read and replay (`text`), JSON lines for programs (`json`), and pcapng for Wireshark (`pcapng`).
//!
//! Who records is not known here: the driver of a running emulator (`sink`) or a tap in front of a real controller
//! ([`crate::tap`]). Start with [`RecordKind`]; [`Recording::read`] reads a file back.

mod buffer;
pub mod json;
pub mod link;
pub mod pcapng;
mod recorder;
mod sink;
pub mod text;

pub use buffer::{MAX_BUFFERED_BYTES, MAX_BUFFERED_RECORDS, TranscriptBuffer};
pub use link::LinkRecord;
pub use recorder::{MAX_BYTES, Recorder};
pub use sink::{Observer, TranscriptSink, calendar_if_set};
use ts3100_driver::files::{self, PathError, cannot};
pub use ts3100_driver::seat::Side;

use core::fmt;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;
use ts3100_controller::time::DurationError;
use ts3100_controller::{Action, ActionParseError, Bytes, Port, Time};
use ts3100_proto::calendar::{CalendarError, CalendarTime};
use ts3100_proto::escape::EscapeError;
use ts3100_proto::words::{Word as _, plain_message};

/// Largest transcript that is read, in bytes.
pub const MAX_TRANSCRIPT: u64 = 256 * 1024 * 1024;
/// Origins of what the emulator and the tap record begin with this.
const RECORDED: &str = "observed, ts3100 ";
/// Begin of the origin of a recording of a real robot.
pub(crate) const TAPPED: &str = "observed, ts3100 tap ";
/// Begins the reasons of [`Recording::has_beginning`].
const MIDDLE: &str = "cannot use a recording that begins in the middle of a run";
/// Most peers of one port with numbers of their own.
pub const MAX_PEERS: u16 = 999;

/// A peer of a port: the first, or one that connected while others were connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PeerId {
    /// Port of the peer.
    pub port: Port,
    /// From 1, at most [`MAX_PEERS`].
    pub peer: u16,
}

impl PeerId {
    /// The first peer of a port.
    pub const fn first(port: Port) -> PeerId {
        PeerId { port, peer: 1 }
    }
}

impl FromStr for PeerId {
    type Err = LineError;

    /// `IP0`, or `IP0#2` for the second of two that are there at once.
    fn from_str(word: &str) -> Result<PeerId, LineError> {
        let (name, number) = word.split_once('#').unwrap_or((word, "1"));
        let peer = number.parse().ok().filter(|peer| (1..=MAX_PEERS).contains(peer));
        let peer = peer.ok_or_else(|| LineError::PeerNumber(number.to_owned()))?;
        let port = Port::from_word(name).ok_or_else(|| LineError::PeerPort(name.to_owned()))?;
        Ok(PeerId { port, peer })
    }
}

impl fmt::Display for PeerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.peer {
            1 => self.port.fmt(f),
            peer => write!(f, "{}#{peer}", self.port),
        }
    }
}

/// How a connection ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EndReason {
    /// Orderly close.
    Closed,
    /// TCP reset.
    Reset,
    /// There was no connection: the controller could not be reached.
    Refused,
}

#[derive(Debug, Clone, PartialEq)]
pub enum RecordKind {
    /// A peer connected.
    Connected {
        /// Peer.
        line: PeerId,
        /// Address without the port number, which differs each time.
        peer: String,
    },
    /// Bytes of the host, in the pieces in which they arrived.
    FromHost {
        /// Peer.
        line: PeerId,
        /// The bytes, with framing.
        bytes: Bytes,
    },
    /// Bytes of the controller, in the pieces in which they were sent.
    FromRobot {
        /// Peer.
        line: PeerId,
        /// The bytes, with framing.
        bytes: Bytes,
    },
    /// One side closed the connection or its half of it.
    Ended {
        /// Peer.
        line: PeerId,
        /// Side that closed it.
        by: Side,
        /// How it ended.
        how: EndReason,
    },
    /// An action at the panel or on the controller.
    Action(Action),
    /// Another event on a connection or a change of the whole state.
    Link(LinkRecord),
    /// A remark of one line that is not replayed, for example an applied fault.
    Remark(String),
}

impl RecordKind {
    /// The time from which later records continue, if this one changes time.
    pub fn new_time(&self) -> Option<Time> {
        let RecordKind::Link(link) = self else { return None };
        link.new_time()
    }
}

/// One record of a transcript.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Since the start of the recording; virtual time where it is an emulator's. It continues from another moment after
    /// a record that changes time ([`LinkRecord::new_time`]).
    pub at: Time,
    /// Content of the record.
    pub kind: RecordKind,
}

impl Record {
    /// A record that findings about the host's timing are not reported.
    fn untimed(at: Time) -> Record {
        let kind = RecordKind::Link(LinkRecord::TimedFindings { on: false });
        Record { at, kind }
    }
}

/// The state before the first record.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Header {
    /// `observed`, and the observer.
    pub origin: String,
    /// Date and time at the start, when they are known and not those of a fresh controller.
    pub calendar: Option<CalendarTime>,
    /// Flags of `serve` that make the controller, for example `dialect=manual` or `set=text.stx=required`.
    pub flags: Vec<String>,
    /// Files on the RAM drive.
    pub files: Vec<(String, Vec<u8>)>,
    /// The selected file.
    pub select: Option<String>,
}

impl Header {
    /// Whether a real robot was recorded, of which only the traffic is known.
    pub fn is_of_robot(&self) -> bool {
        self.origin.starts_with(TAPPED)
    }
}

/// A transcript that was read from a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    pub header: Header,
    /// The records, in order.
    pub records: Vec<Record>,
    /// Line number in the file of each record.
    pub lines: Vec<usize>,
}

/// A part of a recording in which time only advances. A restored snapshot or a reset begins the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch<'a> {
    /// The time at which it begins.
    pub begins_at: Time,
    /// Place of its first record in the recording.
    pub first: usize,
    /// If another epoch follows, the last of them changes time.
    pub records: &'a [Record],
}

/// A fault in a line of a transcript.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    #[error("expected {expected}, found {found:?}")]
    Expected { expected: &'static str, found: String },
    #[error("unknown line `{0}`")]
    NoSuchLine(String),
    #[error("the header has no `origin:`")]
    NoOrigin,
    #[error("expected `file NAME` before a line of a file")]
    NoFile,
    #[error("the file is longer than {0} bytes")]
    FileSize(u64),
    #[error("expected bytes: a recording has no line for missing bytes")]
    Nothing,
    #[error(transparent)]
    Pause(#[from] DurationError),
    #[error("expected at most a hundred years, found {0}")]
    LongPause(String),
    #[error("{0} is not a byte")]
    NotByte(String),
    #[error("expected 1 to {MAX_PEERS} after #, found {0}")]
    PeerNumber(String),
    #[error("expected a port (IP0, HOST, COM1 ...), found {0}")]
    PeerPort(String),
    #[error("unknown event {0:?}")]
    NoLink(String),
    #[error("the first line is not the object of the start")]
    NoStart,
    #[error("expected format {0:?} and version {1}")]
    Format(&'static str, u64),
    #[error("expected a time of {1} or later, found {0}")]
    TimeGoesBack(Time, Time),
    #[error(
        "{MIDDLE}: the records before this line are gone, and no line has the controller as it was then; record the run \
             again with --transcript, which keeps every record"
    )]
    RecordsGone,
    #[error(
        "{MIDDLE}: {0} is in use here, and no line before says that it was connected; use the whole recording"
    )]
    NeverConnected(PeerId),
    #[error(transparent)]
    Bytes(#[from] EscapeError),
    #[error(transparent)]
    Calendar(#[from] CalendarError),
    #[error(transparent)]
    Action(#[from] ActionParseError),
    #[error("{}", plain_message(&.0.to_string()))]
    Json(#[from] serde_json::Error),
    #[error(transparent)]
    Snapshot(#[from] ts3100_driver::snapshot::ParseError),
}

impl LineError {
    fn expected(expected: &'static str, found: &str) -> LineError {
        let found = found.to_owned();
        LineError::Expected { expected, found }
    }
}

/// A transcript that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] PathError),
    /// A line is invalid.
    #[error("{}:{line}: {reason}", path.display())]
    Content {
        /// Path of the file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        reason: LineError,
    },
    /// A pcapng capture, which cannot be replayed.
    #[error("{}: expected a transcript as text (.txt) or JSON lines (.jsonl), found a capture, which is for Wireshark: give \
             --transcript once more with such a name when recording", .0.display())]
    Capture(PathBuf),
}

/// Format of a transcript.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Text.
    Text,
    /// JSON lines.
    Json,
    /// pcapng.
    Pcapng,
}

impl Format {
    /// A writer of this format; `base` is the time of the first moment since 1970 in a capture.
    fn writer(self, base: Duration) -> Box<dyn Writer> {
        match self {
            Format::Text => Box::new(text::TextWriter::default()),
            Format::Json => Box::new(json::JsonWriter),
            Format::Pcapng => Box::new(pcapng::CaptureWriter::new(base)),
        }
    }

    /// The format for a file extension; text without one.
    pub fn from_path(path: &Path) -> Option<Format> {
        match files::extension(path).as_str() {
            "" if path.extension().is_none() => Some(Format::Text),
            "txt" => Some(Format::Text),
            "jsonl" => Some(Format::Json),
            "pcapng" => Some(Format::Pcapng),
            _ => None,
        }
    }
}

/// Writes the lines or packets of one format.
trait Writer: Send {
    /// Everything before the first record.
    fn header(&mut self, header: &Header, out: &mut Vec<u8>);
    fn record(&mut self, record: &Record, out: &mut Vec<u8>);
}

/// A target file for a transcript.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TranscriptFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Format of the file.
    pub format: Format,
}

/// A file name with an unknown extension.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a name that ends in .txt, .jsonl or .pcapng, found `{0}`")]
pub struct FormatError(String);

impl FromStr for TranscriptFile {
    type Err = FormatError;

    fn from_str(word: &str) -> Result<TranscriptFile, FormatError> {
        let path = PathBuf::from(word);
        match Format::from_path(&path) {
            Some(format) if !word.is_empty() => Ok(TranscriptFile { path, format }),
            _ => Err(FormatError(word.to_owned())),
        }
    }
}

impl Recording {
    /// Reads a transcript in text or JSON lines format.
    ///
    /// # Errors
    /// See [`ReadError`].
    pub fn read(path: &Path) -> Result<Recording, ReadError> {
        let format = Format::from_path(path).unwrap_or(Format::Text);
        if format == Format::Pcapng {
            return Err(ReadError::Capture(path.to_path_buf()));
        }
        let content = files::read_text(path, MAX_TRANSCRIPT).map_err(cannot("read", path))?;
        Recording::parse(path, format, &content)
    }

    /// Reads a transcript that is at hand; `path` is its name in messages.
    ///
    /// # Errors
    /// See [`ReadError`].
    pub fn parse(path: &Path, format: Format, content: &str) -> Result<Recording, ReadError> {
        let read = match format {
            Format::Pcapng => return Err(ReadError::Capture(path.to_path_buf())),
            Format::Json => json::read,
            Format::Text => text::read,
        };
        let read = read(content).and_then(Recording::validated);
        read.map_err(|(line, reason)| ReadError::Content {
            path: path.to_path_buf(),
            line,
            reason,
        })
    }

    /// The epochs of the recording, in order.
    pub fn epochs(&self) -> impl Iterator<Item = Epoch<'_>> {
        let parts = self
            .records
            .split_inclusive(|record| record.kind.new_time().is_some());
        parts.scan((Time::ZERO, 0), |(begins_at, first), records| {
            let epoch = Epoch {
                begins_at: *begins_at,
                first: *first,
                records,
            };
            let last = records.last();
            *begins_at = last.and_then(|record| record.kind.new_time()).unwrap_or_default();
            *first += records.len();
            Some(epoch)
        })
    }

    /// Checks that the recording begins where its run began, or with a controller as it was ([`LinkRecord::Begin`]): otherwise
    /// a replay of it is about another state, and nearly every answer differs. `path` is named in the error.
    ///
    /// A transcript that a person or a foreign program has written may leave out connections.
    ///
    /// # Errors
    /// [`ReadError::Content`] with the first line that tells.
    pub fn has_beginning(&self, path: &Path) -> Result<(), ReadError> {
        let wrong = |line, reason| {
            let path = path.to_path_buf();
            Err(ReadError::Content { path, line, reason })
        };
        let is_recorded = self.header.origin.starts_with(RECORDED);
        let mut connected = BTreeSet::new();
        let mut gone = None;
        for (record, &line) in self.records.iter().zip(&self.lines) {
            match &record.kind {
                RecordKind::Link(LinkRecord::Begin { connected: ports, .. }) => {
                    connected.extend(ports.iter().copied().map(PeerId::first));
                    gone = None;
                }
                RecordKind::Remark(words) if buffer::is_gone(words) => gone = Some(line),
                RecordKind::Connected { line, .. } => {
                    connected.insert(*line);
                }
                RecordKind::FromHost { line: peer, .. } | RecordKind::FromRobot { line: peer, .. }
                    if is_recorded && gone.is_none() && !connected.contains(peer) =>
                {
                    return wrong(line, LineError::NeverConnected(*peer));
                }
                RecordKind::FromHost { .. }
                | RecordKind::FromRobot { .. }
                | RecordKind::Ended { .. }
                | RecordKind::Action(_)
                | RecordKind::Link(_)
                | RecordKind::Remark(_) => {}
            }
        }
        gone.map_or(Ok(()), |line| wrong(line, LineError::RecordsGone))
    }

    /// Checks that every snapshot in the recording can be restored; otherwise returns the line and the reason.
    fn validated(self) -> Result<Recording, (usize, LineError)> {
        for (record, line) in self.records.iter().zip(&self.lines) {
            if let RecordKind::Link(link) = &record.kind
                && let Some(snapshot) = link.snapshot()
            {
                ts3100_driver::snapshot::from_json(snapshot).map_err(|error| (*line, error.into()))?;
            }
        }
        Ok(self)
    }
}

/// The address without its port number.
pub fn without_port(peer: &str) -> String {
    match peer.parse::<std::net::SocketAddr>() {
        Ok(address) => address.ip().to_string(),
        Err(_) => peer.to_owned(),
    }
}

#[cfg(test)]
mod tests;
