//! Transcripts as JSON lines: one object for the start, then one for each record. `hex` holds the bytes, `text` the same in
//! the notation of [`super::notation`]; `t_us` are microseconds since the start.

use super::text::{format_date, parse_date, parse_hex};
use super::{
    EndReason, Header, LinkRecord, PeerId, Record, RecordKind, Recording, Side, action, link, notation, panel,
};
use serde_json::{Map, Value, json};
use ts3100_controller::{Action, Time};

/// What stands in `format` of the first line.
const FORMAT: &str = "ts3100 transcript";
/// What stands in `version` of the first line.
const VERSION: u64 = 1;

/// The line of the header.
pub fn write_header(header: &Header, out: &mut Vec<u8>) {
    let files = header
        .files
        .iter()
        .map(|(name, content)| json!({"name": name, "hex": hex(content)}));
    let start = json!({
        "event": "start",
        "format": FORMAT,
        "version": VERSION,
        "origin": header.origin,
        "calendar": header.calendar.map(format_date),
        "flags": header.flags,
        "files": files.collect::<Vec<_>>(),
        "select": header.select,
    });
    out.extend_from_slice(format!("{start}\n").as_bytes());
}

/// The line of a record.
pub fn write_record(record: &Record, out: &mut Vec<u8>) {
    let t = record.at.as_micros();
    let line = |event: &str, line: PeerId| json!({"t_us": t, "event": event, "line": line.to_string()});
    let bytes = |event: &str, at: PeerId, bytes: &[u8]| {
        let mut object = line(event, at);
        object["hex"] = Value::from(hex(bytes));
        object["text"] = Value::from(notation::write(bytes));
        object
    };
    let object = match &record.kind {
        RecordKind::Connected { line: at, peer } => {
            let mut object = line("connected", *at);
            object["peer"] = Value::from(peer.as_str());
            object
        }
        RecordKind::FromHost { line, bytes: sent } => bytes("from-host", *line, sent),
        RecordKind::FromRobot { line, bytes: sent } => bytes("from-robot", *line, sent),
        RecordKind::Ended { line: at, by, how } => {
            let mut object = line("ended", *at);
            object["by"] = Value::from(side_word(*by));
            object["how"] = Value::from(end_reason_word(*how));
            object
        }
        RecordKind::Action(Action::Panel(action)) => {
            json!({"t_us": t, "event": "panel", "panel": panel::write(action)})
        }
        RecordKind::Action(action) => json!({"t_us": t, "event": "deed", "deed": action::write(action)}),
        RecordKind::Link(LinkRecord::Restored { at, snapshot }) => {
            // One that is no JSON is nobody's: it is written as it is.
            let snapshot = serde_json::from_str(snapshot).unwrap_or_else(|_| Value::from(snapshot.as_str()));
            json!({"t_us": t, "event": "restored", "to_us": at.as_micros(), "snapshot": snapshot})
        }
        RecordKind::Link(link) => json!({"t_us": t, "event": "edge", "edge": link::write(link)}),
        RecordKind::Remark(words) => json!({"t_us": t, "event": "remark", "remark": words}),
    };
    out.extend_from_slice(format!("{object}\n").as_bytes());
}

fn hex(bytes: &[u8]) -> String {
    let pairs: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    pairs.join(" ")
}

const fn side_word(side: Side) -> &'static str {
    match side {
        Side::Host => "host",
        Side::Robot => "robot",
    }
}

const fn end_reason_word(how: EndReason) -> &'static str {
    match how {
        EndReason::Closed => "closed",
        EndReason::Reset => "reset",
        EndReason::Refused => "refused",
    }
}

/// Reads a transcript.
///
/// # Errors
/// The line, from 1, and what was expected and found there.
pub fn read(text: &str) -> Result<Recording, (usize, String)> {
    let mut recording = Recording::default();
    let mut last = Time::ZERO;
    for (number, line) in (1..).zip(text.lines()) {
        let wrong = |reason: String| (number, reason);
        let value = serde_json::from_str(line).map_err(|error| wrong(error.to_string()))?;
        let Value::Object(object) = value else {
            return Err(wrong("an object expected".to_owned()));
        };
        if number == 1 {
            recording.header = read_header(&object).map_err(wrong)?;
            continue;
        }
        let record = read_record(&object).map_err(wrong)?;
        if record.at < last {
            return Err(wrong(format!(
                "a time of {last} or later expected, {} found",
                record.at
            )));
        }
        last = match &record.kind {
            RecordKind::Link(link) => link.new_time().unwrap_or(record.at),
            _ => record.at,
        };
        recording.records.push(record);
        recording.lines.push(number);
    }
    if recording.header.origin.is_empty() {
        return Err((1, "the object of the start expected, not found".to_owned()));
    }
    Ok(recording)
}

type Object = Map<String, Value>;

fn text<'a>(object: &'a Object, key: &str) -> Result<&'a str, String> {
    let value = object.get(key).and_then(Value::as_str);
    value.ok_or_else(|| format!("a text expected at {key:?}"))
}

fn optional<'a>(object: &'a Object, key: &str) -> Result<Option<&'a str>, String> {
    match object.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(_) => text(object, key).map(Some),
    }
}

fn list<'a>(object: &'a Object, key: &str) -> Result<&'a [Value], String> {
    match object.get(key) {
        None => Ok(&[]),
        Some(Value::Array(values)) => Ok(values),
        Some(_) => Err(format!("a list expected at {key:?}")),
    }
}

fn read_header(object: &Object) -> Result<Header, String> {
    let version = object.get("version").and_then(Value::as_u64);
    if text(object, "format") != Ok(FORMAT) || version != Some(VERSION) {
        return Err(format!("format {FORMAT:?} and version {VERSION} expected"));
    }
    let file = |value: &Value| {
        let object = value.as_object().ok_or("an object expected in \"files\"")?;
        Ok((text(object, "name")?.to_owned(), parse_hex(text(object, "hex")?)?))
    };
    let flag = |value: &Value| {
        let flag = value.as_str().ok_or("a text expected in \"flags\"")?;
        Ok(flag.to_owned())
    };
    Ok(Header {
        origin: text(object, "origin")?.to_owned(),
        calendar: optional(object, "calendar")?.map(parse_date).transpose()?,
        flags: list(object, "flags")?
            .iter()
            .map(flag)
            .collect::<Result<_, String>>()?,
        files: list(object, "files")?
            .iter()
            .map(file)
            .collect::<Result<_, String>>()?,
        select: optional(object, "select")?.map(str::to_owned),
    })
}

fn read_record(object: &Object) -> Result<Record, String> {
    let micros = object.get("t_us").and_then(Value::as_u64);
    let at = micros
        .map(Time::from_micros)
        .ok_or("microseconds expected at \"t_us\"")?;
    let line = || PeerId::parse(text(object, "line")?);
    let bytes = || parse_hex(text(object, "hex")?);
    let what = match text(object, "event")? {
        "connected" => RecordKind::Connected {
            line: line()?,
            peer: optional(object, "peer")?.unwrap_or_default().to_owned(),
        },
        "from-host" => RecordKind::FromHost {
            line: line()?,
            bytes: bytes()?,
        },
        "from-robot" => RecordKind::FromRobot {
            line: line()?,
            bytes: bytes()?,
        },
        "ended" => RecordKind::Ended {
            line: line()?,
            by: match text(object, "by")? {
                "host" => Side::Host,
                "robot" => Side::Robot,
                other => return Err(format!("host or robot expected at \"by\", {other:?} found")),
            },
            how: match text(object, "how")? {
                "closed" => EndReason::Closed,
                "reset" => EndReason::Reset,
                "refused" => EndReason::Refused,
                other => {
                    return Err(format!(
                        "closed, reset or refused expected at \"how\", {other:?} found"
                    ));
                }
            },
        },
        "panel" => RecordKind::Action(Action::Panel(panel::read(text(object, "panel")?)?)),
        "deed" => RecordKind::Action(action::read(text(object, "deed")?)?),
        "restored" => RecordKind::Link(LinkRecord::Restored {
            at: object
                .get("to_us")
                .and_then(Value::as_u64)
                .map(Time::from_micros)
                .ok_or("microseconds expected at \"to_us\"")?,
            snapshot: match object.get("snapshot") {
                Some(Value::String(words)) => words.clone(),
                Some(snapshot) => snapshot.to_string(),
                None => return Err("a snapshot expected at \"snapshot\"".to_owned()),
            },
        }),
        "edge" => {
            let words = text(object, "edge")?;
            RecordKind::Link(link::read(words)?.ok_or_else(|| format!("{words:?} is nothing of the edge"))?)
        }
        "remark" => RecordKind::Remark(text(object, "remark")?.to_owned()),
        other => return Err(format!("{other:?} is no event of a transcript")),
    };
    Ok(Record { at, kind: what })
}
