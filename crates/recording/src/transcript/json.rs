//! Transcripts as JSON lines: one object for the start, then one for each record. `hex` holds the bytes, `text` the same in
//! the notation of [`ts3100_proto::escape`]; `t_us` are microseconds since the start.

use super::{
    EndReason, Header, LineError, LinkRecord, PeerId, Record, RecordKind, Recording, Side, Writer, text,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use ts3100_controller::{Action, Port, Time};
use ts3100_proto::escape::Escaped;

/// Value of `format` in the first line.
const FORMAT: &str = "ts3100 transcript";
/// Value of `version` in the first line.
const VERSION: u64 = 1;

/// The first line.
#[derive(Serialize, Deserialize)]
struct Start {
    #[serde(skip_deserializing)]
    event: &'static str,
    format: String,
    version: u64,
    origin: String,
    calendar: Option<String>,
    #[serde(default)]
    flags: Vec<String>,
    #[serde(default)]
    files: Vec<File>,
    select: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct File {
    name: String,
    #[serde(with = "hex")]
    hex: Vec<u8>,
}

/// Any other line.
#[derive(Serialize, Deserialize)]
struct Line {
    #[serde(rename = "t_us")]
    at: Time,
    #[serde(flatten)]
    event: Event,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
enum Event {
    Connected {
        #[serde(with = "as_text")]
        line: PeerId,
        peer: Option<String>,
    },
    FromHost(Bytes),
    FromRobot(Bytes),
    Ended {
        #[serde(with = "as_text")]
        line: PeerId,
        by: Side,
        how: EndReason,
    },
    Action {
        #[serde(with = "as_text")]
        action: Action,
    },
    Restored {
        #[serde(rename = "to_us")]
        at: Time,
        snapshot: Value,
    },
    Begin {
        #[serde(rename = "to_us")]
        at: Time,
        connected: BTreeSet<Port>,
        snapshot: Value,
    },
    Link {
        #[serde(with = "as_text")]
        link: LinkRecord,
    },
    Remark {
        remark: String,
    },
}

#[derive(Serialize, Deserialize)]
struct Bytes {
    #[serde(with = "as_text")]
    line: PeerId,
    #[serde(with = "hex")]
    hex: Vec<u8>,
    #[serde(skip_deserializing)]
    text: String,
}

impl Bytes {
    fn new(line: PeerId, bytes: &[u8]) -> Bytes {
        let text = Escaped::new(bytes).to_string();
        let hex = bytes.to_vec();
        Bytes { line, hex, text }
    }
}

/// A value in its text form.
pub(crate) mod as_text {
    use serde::{Deserialize, Deserializer, Serializer, de};
    use std::fmt::Display;
    use std::str::FromStr;

    pub fn serialize<T: Display, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(value)
    }

    pub fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

/// Bytes as pairs of hexadecimal digits with blanks between them.
mod hex {
    use serde::{Deserialize, Deserializer, Serializer, de};
    use ts3100_proto::escape;

    pub fn serialize<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&escape::hex(bytes))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
        super::text::parse_hex(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

fn write(line: &impl Serialize, out: &mut Vec<u8>) {
    // Text and numbers can always be written into memory.
    let _ = serde_json::to_writer(&mut *out, line);
    out.push(b'\n');
}

/// A snapshot as a value; as its text if it is not JSON.
fn json_of(snapshot: String) -> Value {
    serde_json::from_str(&snapshot).unwrap_or(Value::String(snapshot))
}

/// The text of a snapshot.
#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn text_of(snapshot: Value) -> String {
    match snapshot {
        Value::String(words) => words,
        snapshot => snapshot.to_string(),
    }
}

/// Writes a transcript, a line for each record.
pub(super) struct JsonWriter;

impl Writer for JsonWriter {
    /// The line of the header.
    fn header(&mut self, header: &Header, out: &mut Vec<u8>) {
        let file = |(name, content): &(String, Vec<u8>)| File {
            name: name.clone(),
            hex: content.clone(),
        };
        let start = Start {
            event: "start",
            format: FORMAT.to_owned(),
            version: VERSION,
            origin: header.origin.clone(),
            calendar: header.calendar.map(|calendar| calendar.to_string()),
            flags: header.flags.clone(),
            files: header.files.iter().map(file).collect(),
            select: header.select.clone(),
        };
        write(&start, out);
    }

    /// The line of a record.
    fn record(&mut self, record: &Record, out: &mut Vec<u8>) {
        let event = match record.kind.clone() {
            RecordKind::Connected { line, peer } => Event::Connected {
                line,
                peer: Some(peer),
            },
            RecordKind::FromHost { line, bytes } => Event::FromHost(Bytes::new(line, &bytes)),
            RecordKind::FromRobot { line, bytes } => Event::FromRobot(Bytes::new(line, &bytes)),
            RecordKind::Ended { line, by, how } => Event::Ended { line, by, how },
            RecordKind::Action(action) => Event::Action { action },
            RecordKind::Link(LinkRecord::Restored { at, snapshot }) => Event::Restored {
                at,
                snapshot: json_of(snapshot),
            },
            RecordKind::Link(LinkRecord::Begin {
                at,
                connected,
                snapshot,
            }) => Event::Begin {
                at,
                connected,
                snapshot: json_of(snapshot),
            },
            RecordKind::Link(link) => Event::Link { link },
            RecordKind::Remark(remark) => Event::Remark { remark },
        };
        let at = record.at;
        write(&Line { at, event }, out);
    }
}

/// Reads a transcript.
///
/// # Errors
/// The line, from 1, and what was expected and found there.
pub fn read(text: &str) -> Result<Recording, (usize, LineError)> {
    let mut recording = Recording::default();
    let mut last = Time::ZERO;
    for (number, line) in (1..).zip(text.lines()) {
        let wrong = |reason| (number, reason);
        if number == 1 {
            recording.header = read_header(line).map_err(wrong)?;
            continue;
        }
        let record = read_record(line).map_err(|error| wrong(error.into()))?;
        if record.at < last {
            return Err(wrong(LineError::TimeGoesBack(record.at, last)));
        }
        last = record.kind.new_time().unwrap_or(record.at);
        recording.records.push(record);
        recording.lines.push(number);
    }
    if recording.header.origin.is_empty() {
        return Err((1, LineError::NoStart));
    }
    Ok(recording)
}

fn read_header(line: &str) -> Result<Header, LineError> {
    let start: Start = serde_json::from_str(line)?;
    if start.format != FORMAT || start.version != VERSION {
        return Err(LineError::Format(FORMAT, VERSION));
    }
    Ok(Header {
        origin: start.origin,
        calendar: start.calendar.map(|calendar| calendar.parse()).transpose()?,
        flags: start.flags,
        files: start
            .files
            .into_iter()
            .map(|file| (file.name, file.hex))
            .collect(),
        select: start.select,
    })
}

#[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
fn read_record(line: &str) -> serde_json::Result<Record> {
    let Line { at, event } = serde_json::from_str(line)?;
    let kind = match event {
        Event::Connected { line, peer } => RecordKind::Connected {
            line,
            peer: peer.unwrap_or_default(),
        },
        Event::FromHost(Bytes { line, hex: bytes, .. }) => {
            let bytes = bytes.into();
            RecordKind::FromHost { line, bytes }
        }
        Event::FromRobot(Bytes { line, hex: bytes, .. }) => {
            let bytes = bytes.into();
            RecordKind::FromRobot { line, bytes }
        }
        Event::Ended { line, by, how } => RecordKind::Ended { line, by, how },
        Event::Action { action } => RecordKind::Action(action),
        Event::Restored { at, snapshot } => RecordKind::Link(LinkRecord::Restored {
            at,
            snapshot: text_of(snapshot),
        }),
        Event::Begin {
            at,
            connected,
            snapshot,
        } => RecordKind::Link(LinkRecord::Begin {
            at,
            connected,
            snapshot: text_of(snapshot),
        }),
        Event::Link { link } => RecordKind::Link(link),
        Event::Remark { remark } => RecordKind::Remark(remark),
    };
    Ok(Record { at, kind })
}
