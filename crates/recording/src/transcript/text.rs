//! A transcript as text, in the notation of the hand-written ones (`fixtures/transcripts`) with what a recording
//! needs besides:
//!
//! ```text
//! origin: observed, ts3100 serve 0.1.0
//! clauses: none
//! calendar: 2026-11-21 10:00:00    date and time at the start
//! flag: dialect=manual             a flag of serve; flags that say nothing are left out
//! file TEST                        a file on the RAM drive: `| ` and a line of it
//! |: END<CR>                       or `|: ` and bytes of it, whatever they are
//! select TEST
//! @+1250us                         time passes
//! ! connect IP0 192.168.0.2        a peer comes
//! > IP0 SO<CR>                     a text of the host, without its STX and ETX
//! >: IP0 SO<CR><ETX>               bytes of the host
//! < IP0 OK<CR>                     a text of the controller
//! <: IP0 OK<CR><ETX>               bytes of the controller
//! > IP1 7<CR>                      on a channel without texts: the bytes
//! ! servo on                       something is done at the controller
//! ! disconnect IP0                 the host leaves; `! disconnect IP0 reset`: by a reset
//! ! closed IP0                     the controller ends the connection; also `reset`, `refused`
//! ! line HOST speed=9600           an event of the link; `restore`, `begin` and `reset` also set the time
//! # remark
//! ```

use super::buffer::{END, is_gone};
use super::{EndReason, Header, LineError, PeerId, Record, RecordKind, Recording, Side, Writer};
use std::time::Duration;
use ts3100_controller::Time;
use ts3100_controller::time::parse_duration;
use ts3100_driver::pc_file::MAX_PC_FILE;
use ts3100_proto::escape::{self, Escaped};
use ts3100_proto::text::{ETX, LF, STX};

/// Longest pause that is read: a hundred years.
const MAX_PAUSE: Duration = Duration::from_secs(3_155_760_000);

/// Writes a transcript line by line.
#[derive(Debug, Clone, Default)]
pub(super) struct TextWriter {
    last: Time,
}

impl Writer for TextWriter {
    /// The lines of the header.
    fn header(&mut self, header: &Header, out: &mut Vec<u8>) {
        let mut text = format!("origin: {}\nclauses: none\n", header.origin);
        if let Some(calendar) = header.calendar {
            text += &format!("calendar: {calendar}\n");
        }
        for flag in &header.flags {
            text += &format!("flag: {flag}\n");
        }
        for (name, content) in &header.files {
            text += &format!("file {name}\n");
            for line in content.split_inclusive(|byte| *byte == LF) {
                let plain = line
                    .strip_suffix(&[LF])
                    .filter(|line| line.iter().all(|byte| (b' '..=b'~').contains(byte)));
                match plain {
                    Some([]) => text += "|\n",
                    Some(line) => text += &format!("| {}\n", String::from_utf8_lossy(line)),
                    None => text += &format!("|: {}\n", escape_trailing_blank(line)),
                }
            }
        }
        if let Some(name) = &header.select {
            text += &format!("select {name}\n");
        }
        out.extend_from_slice(text.as_bytes());
    }

    /// The lines of a record.
    fn record(&mut self, record: &Record, out: &mut Vec<u8>) {
        let pause = record.at.since(self.last).as_micros();
        self.last = self.last.max(record.at);
        let mut text = match pause {
            0 => String::new(),
            micros if micros % 1_000_000 == 0 => format!("@+{}s\n", micros / 1_000_000),
            micros if micros % 1_000 == 0 => format!("@+{}ms\n", micros / 1_000),
            micros => format!("@+{micros}us\n"),
        };
        text += &match &record.kind {
            RecordKind::Connected { line, peer } if peer.is_empty() => format!("! connect {line}"),
            RecordKind::Connected { line, peer } => format!("! connect {line} {peer}"),
            RecordKind::FromHost { line, bytes } => bytes_line('>', *line, bytes),
            RecordKind::FromRobot { line, bytes } => bytes_line('<', *line, bytes),
            RecordKind::Ended { line, by, how } => {
                let word = match by {
                    Side::Host => "disconnect",
                    Side::Robot => "closed",
                };
                let how = match how {
                    EndReason::Closed => "",
                    EndReason::Reset => " reset",
                    EndReason::Refused => " refused",
                };
                format!("! {word} {line}{how}")
            }
            RecordKind::Action(action) => format!("! {action}"),
            RecordKind::Link(link) => format!("! {link}"),
            RecordKind::Remark(words) => format!("# {words}"),
        };
        self.last = record.kind.new_time().unwrap_or(self.last);
        text.push('\n');
        out.extend_from_slice(text.as_bytes());
    }
}

/// A line for bytes: as a text where it is one and nothing else, as bytes otherwise.
fn bytes_line(direction: char, line: PeerId, bytes: &[u8]) -> String {
    let inside = match bytes {
        [STX, inside @ .., ETX] if line.port.protocol().is_some() => Some(inside),
        _ if line.port.protocol().is_some() || bytes == b"nothing" => None,
        bytes => Some(bytes),
    };
    // Two texts of a host in one segment are not one text; SF of the controller may hold both codes.
    let one =
        inside.filter(|inside| direction == '<' || !inside.iter().any(|byte| matches!(*byte, STX | ETX)));
    match one {
        Some(inside) => format!("{direction} {line} {}", escape_trailing_blank(inside)),
        None => format!("{direction}: {line} {}", escape_trailing_blank(bytes)),
    }
}

/// Writes bytes in the notation; a blank at the end is escaped so that no editor removes it.
fn escape_trailing_blank(bytes: &[u8]) -> String {
    match bytes.split_last() {
        Some((b' ', rest)) => format!("{}<20>", Escaped::new(rest)),
        _ => Escaped::new(bytes).to_string(),
    }
}

/// Reads a transcript.
///
/// # Errors
/// The line, from 1, and what was expected and found there.
pub fn read(text: &str) -> Result<Recording, (usize, LineError)> {
    let mut recording = Recording::default();
    let mut now = Time::ZERO;
    for (number, line) in (1..).zip(text.lines()) {
        // `lines` leaves all but one of several CR. No word that is written ends with one.
        let line = line.trim_end_matches('\r');
        let what = read_line(&mut recording.header, &mut now, line).map_err(|reason| (number, reason))?;
        if let Some(kind) = what {
            let at = now;
            now = kind.new_time().unwrap_or(now);
            recording.records.push(Record { at, kind });
            recording.lines.push(number);
        }
    }
    if recording.header.origin.is_empty() {
        return Err((1, LineError::NoOrigin));
    }
    Ok(recording)
}

fn read_line(header: &mut Header, now: &mut Time, line: &str) -> Result<Option<RecordKind>, LineError> {
    if let Some(content) = line.strip_prefix('|') {
        return parse_file_line(header, content).map(|()| None);
    }
    // Other remarks are for people.
    if let Some(words) = line
        .strip_prefix("# ")
        .filter(|words| is_gone(words) || *words == END)
    {
        return Ok(Some(RecordKind::Remark(words.to_owned())));
    }
    if line.trim().is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    if let Some(pause) = line.strip_prefix("@+") {
        *now = *now + parse_pause(pause)?;
        return Ok(None);
    }
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match word {
        "origin:" => rest.clone_into(&mut header.origin),
        // What a transcript proves is for those written by hand.
        "clauses:" => {}
        "calendar:" => header.calendar = Some(rest.parse()?),
        "flag:" => header.flags.push(rest.to_owned()),
        "dialect:" => header.flags.push(format!("dialect={rest}")),
        "servo:" if rest == "on" => header.flags.push("servo-on=true".to_owned()),
        "servo:" if rest == "off" => {}
        "file" => header.files.push((rest.to_owned(), Vec::new())),
        "select" => header.select = Some(rest.to_owned()),
        "!" => return parse_action(rest).map(Some),
        ">" | ">:" | "<" | "<:" => return parse_bytes(word, rest).map(Some),
        ">>" | "<<" => {
            let (line, data) = rest.split_once(' ').unwrap_or((rest, ""));
            return Ok(Some(bytes_record(word, line.parse()?, parse_hex(data)?)));
        }
        _ => return Err(LineError::NoSuchLine(line.to_owned())),
    }
    Ok(None)
}

fn parse_file_line(header: &mut Header, line: &str) -> Result<(), LineError> {
    let (_, content) = header.files.last_mut().ok_or(LineError::NoFile)?;
    match line.strip_prefix(':') {
        Some(raw) => content.extend(escape::parse(raw.strip_prefix(' ').unwrap_or(raw))?),
        None => {
            content.extend_from_slice(line.strip_prefix(' ').unwrap_or(line).as_bytes());
            content.push(LF);
        }
    }
    if content.len() as u64 > MAX_PC_FILE {
        return Err(LineError::FileSize(MAX_PC_FILE));
    }
    Ok(())
}

/// The bytes after `>`, `>:`, `<` and `<:`.
fn parse_bytes(word: &str, rest: &str) -> Result<RecordKind, LineError> {
    let (line, data) = rest.split_once(' ').unwrap_or((rest, ""));
    let line: PeerId = line.parse()?;
    if word == "<" && data == "nothing" {
        return Err(LineError::Nothing);
    }
    let mut bytes = escape::parse(data)?;
    if !word.ends_with(':') && line.port.protocol().is_some() {
        bytes.insert(0, STX);
        bytes.push(ETX);
    }
    Ok(bytes_record(word, line, bytes))
}

fn bytes_record(word: &str, line: PeerId, bytes: Vec<u8>) -> RecordKind {
    let bytes = bytes.into();
    if word.starts_with('>') {
        RecordKind::FromHost { line, bytes }
    } else {
        RecordKind::FromRobot { line, bytes }
    }
}

fn parse_action(words: &str) -> Result<RecordKind, LineError> {
    let all: Vec<&str> = words.split(' ').collect();
    match all.as_slice() {
        ["connect", line, peer @ ..] => Ok(RecordKind::Connected {
            line: line.parse()?,
            peer: peer.join(" "),
        }),
        [word @ ("disconnect" | "closed"), line, how @ ..] if how.len() < 2 => Ok(RecordKind::Ended {
            how: match how {
                [] => EndReason::Closed,
                ["reset", ..] => EndReason::Reset,
                ["refused", ..] => EndReason::Refused,
                [word, ..] => return Err(LineError::expected("reset or refused", word)),
            },
            by: match *word {
                "closed" => Side::Robot,
                _ => Side::Host,
            },
            line: line.parse()?,
        }),
        _ => match words.parse() {
            Err(LineError::NoLink(_)) => Ok(RecordKind::Action(words.parse()?)),
            link => link.map(RecordKind::Link),
        },
    }
}

/// Reads a pause such as `250ms`, `5 s` or `1250us`.
///
/// # Errors
/// No duration, or more than a hundred years.
pub fn parse_pause(text: &str) -> Result<Duration, LineError> {
    let pause = parse_duration(text)?;
    let fits = Some(pause).filter(|pause| *pause <= MAX_PAUSE);
    fits.ok_or_else(|| LineError::LongPause(text.to_owned()))
}

/// Reads bytes as pairs of hexadecimal digits.
///
/// # Errors
/// A pair that is not a byte.
pub fn parse_hex(text: &str) -> Result<Vec<u8>, LineError> {
    let byte = |word: &str| escape::hex_byte(word).ok_or_else(|| LineError::NotByte(word.to_owned()));
    text.split_whitespace().map(byte).collect()
}
