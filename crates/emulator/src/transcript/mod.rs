//! Transcripts: what went over each port and what was done at the panel, in order and with times, and the forms
//! it is kept in: text to be read and replayed, JSON lines for programs, pcapng for Wireshark. Who was listening
//! (the driver of a running emulator, a tap in front of a real controller) is not known here.

pub mod action;
mod buffer;
pub mod json;
pub mod link;
pub mod notation;
pub mod panel;
pub mod pcapng;
mod recorder;
mod sink;
pub mod text;

use crate::files;
pub use buffer::{MAX_BUFFERED_BYTES, MAX_BUFFERED_RECORDS, TranscriptBuffer};
pub use link::LinkRecord;
pub use recorder::{MAX_BYTES, Recorder, RecorderError};
pub use sink::{Observer, TranscriptSink};

use core::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use ts3100_controller::{Action, Port, Time};
use ts3100_proto::calendar::CalendarTime;

/// Largest transcript that is read, in bytes.
pub const MAX_TRANSCRIPT: u64 = 256 * 1024 * 1024;
/// Most peers of one port that are told apart.
pub const MAX_PEERS: u16 = 999;

/// A peer of a port: the first, or one that came while others were there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PeerId {
    /// The port.
    pub port: Port,
    /// From 1, at most [`MAX_PEERS`].
    pub peer: u16,
}

impl PeerId {
    /// The first peer of a port.
    #[must_use]
    pub const fn first(port: Port) -> PeerId {
        PeerId { port, peer: 1 }
    }

    /// `IP0`, or `IP0#2` for the second of two that are there at once.
    ///
    /// # Errors
    /// What is no port or no number of a peer.
    pub fn parse(word: &str) -> Result<PeerId, String> {
        let (name, peer) = match word.split_once('#') {
            Some((name, number)) => {
                let peer = number
                    .parse()
                    .ok()
                    .filter(|number| (1..=MAX_PEERS).contains(number));
                (
                    name,
                    peer.ok_or_else(|| format!("1 to {MAX_PEERS} expected behind #, found {number}"))?,
                )
            }
            None => (word, 1),
        };
        let port = Port::ALL.into_iter().find(|port| port.name() == name);
        let port = port.ok_or_else(|| format!("a port expected, for example IP0, found {name}"))?;
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

/// One of the two ends of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The host.
    Host,
    /// The controller.
    Robot,
}

/// How a connection ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndReason {
    /// By a close in order.
    Closed,
    /// By a reset.
    Reset,
    /// There was none: the controller could not be reached.
    Refused,
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordKind {
    /// A peer came.
    Connected {
        /// Where.
        line: PeerId,
        /// Its address without the port number, which is another one each time.
        peer: String,
    },
    /// Bytes of the host, as they were cut.
    FromHost {
        /// Where.
        line: PeerId,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Bytes of the controller, as they were cut.
    FromRobot {
        /// Where.
        line: PeerId,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// One of the two ended a connection, or its half of one.
    Ended {
        /// Where.
        line: PeerId,
        /// Which of them.
        by: Side,
        /// How.
        how: EndReason,
    },
    /// Something was done at the controller itself, or to it.
    Action(Action),
    /// Something else that has reached it.
    Link(LinkRecord),
    /// Something worth knowing that nobody plays again: a fault has bitten. One line.
    Remark(String),
}

/// Something that happened, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Since the start of the recording; virtual time where it is an emulator's. It goes on from another moment
    /// behind what says so ([`LinkRecord::begins_at`]).
    pub at: Time,
    /// What.
    pub kind: RecordKind,
}

/// What there was before the first record.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Header {
    /// `observed`, and by what.
    pub origin: String,
    /// Date and time at the start, when they are known and not those of a fresh controller.
    pub calendar: Option<CalendarTime>,
    /// Flags of `serve` that make the controller, for example `dialect=manual` or `set=text.stx=required`.
    pub flags: Vec<String>,
    /// Files on the RAM drive.
    pub files: Vec<(String, Vec<u8>)>,
    /// The file selected.
    pub select: Option<String>,
}

/// A transcript as read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// What there was before.
    pub header: Header,
    /// What happened, in order.
    pub records: Vec<Record>,
    /// For each record the line of the file it stands in.
    pub lines: Vec<usize>,
}

/// A transcript that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file.
    #[error("cannot read {}: {reason}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        reason: std::io::Error,
    },
    /// What stands in it.
    #[error("{}:{line}: {reason}", path.display())]
    Content {
        /// Which file.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What was expected and found.
        reason: String,
    },
    /// A capture.
    #[error("{}: expected a transcript as text (.txt) or JSON lines (.jsonl), found a capture, which is for Wireshark: give \
             --transcript once more with such a name when recording", .0.display())]
    Capture(PathBuf),
}

/// The form of a transcript.
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
    /// By the ending of a file's name; none is text.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Format> {
        match path
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase())
        {
            None => Some(Format::Text),
            Some(ending) => match ending.as_str() {
                "txt" => Some(Format::Text),
                "jsonl" => Some(Format::Json),
                "pcapng" => Some(Format::Pcapng),
                _ => None,
            },
        }
    }
}

/// A file a transcript is to be written to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TranscriptFile {
    /// Where.
    pub path: PathBuf,
    /// In which form.
    pub format: Format,
}

/// A name whose ending is none of ours.
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
    /// Reads a transcript that was kept as text or JSON lines.
    ///
    /// # Errors
    /// See [`ReadError`].
    pub fn read(path: &Path) -> Result<Recording, ReadError> {
        if Format::from_path(path) == Some(Format::Pcapng) {
            return Err(ReadError::Capture(path.to_path_buf()));
        }
        let content = files::read_text(path, MAX_TRANSCRIPT).map_err(|reason| ReadError::File {
            path: path.to_path_buf(),
            reason,
        })?;
        let read = if Format::from_path(path) == Some(Format::Json) {
            json::read(&content)
        } else {
            text::read(&content)
        };
        read.and_then(Recording::validated)
            .map_err(|(line, reason)| ReadError::Content {
                path: path.to_path_buf(),
                line,
                reason,
            })
    }

    /// Itself, if every snapshot in it can be restored; otherwise the line of the first that cannot, and why.
    fn validated(self) -> Result<Recording, (usize, String)> {
        for (record, line) in self.records.iter().zip(&self.lines) {
            if let RecordKind::Link(LinkRecord::Restored { snapshot, .. }) = &record.kind {
                crate::snapshot::from_json(snapshot).map_err(|error| (*line, error.to_string()))?;
            }
        }
        Ok(self)
    }
}

/// The address without the number of its port.
#[must_use]
pub fn without_port(peer: &str) -> String {
    match peer.parse::<std::net::SocketAddr>() {
        Ok(address) => address.ip().to_string(),
        Err(_) => peer.to_owned(),
    }
}

#[cfg(test)]
mod tests;
