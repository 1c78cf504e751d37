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
//! > IP0 SO<CR>                     a text of the host; STX and ETX stand around it
//! >: IP0 SO<CR><ETX>               bytes of the host
//! < IP0 OK<CR>                     a text of the controller
//! <: IP0 OK<CR><ETX>               bytes of the controller
//! > IP1 7<CR>                      on a channel without texts: the bytes
//! ! servo on                       something is done at the controller
//! ! disconnect IP0                 the host leaves; `! disconnect IP0 reset`: by a reset
//! ! closed IP0                     the controller ends the connection; also `reset`, `refused`
//! ! line HOST speed=9600           the edge knows something; also `restore`, `reset`: time goes on from there
//! # remark
//! ```

use super::{EndReason, Header, PeerId, Record, RecordKind, Recording, Side, action, link, notation};
use std::time::Duration;
use ts3100_controller::Time;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::text::{ETX, LF, STX};

/// Largest content of one file of the header, in bytes.
const MAX_FILE: usize = 2 * ts3100_controller::limits::MAX_FILE;
/// Longest pause that is read: a hundred years, in microseconds.
const MAX_PAUSE: u64 = 3_155_760_000_000_000;

/// Writes a transcript line by line.
#[derive(Debug, Clone, Default)]
pub struct Writer {
    last: Time,
}

impl Writer {
    /// The lines of the header.
    pub fn header(&mut self, header: &Header, out: &mut Vec<u8>) {
        let mut text = format!("origin: {}\nclauses: none\n", header.origin);
        if let Some(calendar) = header.calendar {
            text += &format!("calendar: {}\n", format_date(calendar));
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
    pub fn record(&mut self, record: &Record, out: &mut Vec<u8>) {
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
            RecordKind::Action(action) => format!("! {}", action::write(action)),
            RecordKind::Link(link) => {
                self.last = link.new_time().unwrap_or(self.last);
                format!("! {}", link::write(link))
            }
            RecordKind::Remark(words) => format!("# {words}"),
        };
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

/// As the notation has it; a blank at the end is written so that nobody's editor removes it.
fn escape_trailing_blank(bytes: &[u8]) -> String {
    match bytes.split_last() {
        Some((b' ', rest)) => format!("{}<20>", notation::write(rest)),
        _ => notation::write(bytes),
    }
}

/// Reads a transcript.
///
/// # Errors
/// The line, from 1, and what was expected and found there.
pub fn read(text: &str) -> Result<Recording, (usize, String)> {
    let mut recording = Recording::default();
    let mut now = Time::ZERO;
    for (number, line) in (1..).zip(text.lines()) {
        let what = read_line(&mut recording.header, &mut now, line).map_err(|reason| (number, reason))?;
        if let Some(what) = what {
            let at = now;
            if let RecordKind::Link(link) = &what {
                now = link.new_time().unwrap_or(now);
            }
            recording.records.push(Record { at, kind: what });
            recording.lines.push(number);
        }
    }
    if recording.header.origin.is_empty() {
        return Err((1, "`origin:` expected in the header, not found".to_owned()));
    }
    Ok(recording)
}

fn read_line(header: &mut Header, now: &mut Time, line: &str) -> Result<Option<RecordKind>, String> {
    if let Some(content) = line.strip_prefix('|') {
        return parse_file_line(header, content).map(|()| None);
    }
    if line.trim().is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match word {
        "origin:" => rest.clone_into(&mut header.origin),
        // What a transcript proves is for those written by hand.
        "clauses:" => {}
        "calendar:" => header.calendar = Some(parse_date(rest)?),
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
            return Ok(Some(bytes_record(word, PeerId::parse(line)?, parse_hex(data)?)));
        }
        word => match word.strip_prefix("@+") {
            Some(pause) => *now = *now + parse_duration(pause)?,
            None => return Err(format!("no such line: {line}")),
        },
    }
    Ok(None)
}

fn parse_file_line(header: &mut Header, line: &str) -> Result<(), String> {
    let (_, content) = header
        .files
        .last_mut()
        .ok_or("`file NAME` expected before a line of a file")?;
    match line.strip_prefix(':') {
        Some(raw) => content.extend(notation::read_bytes(raw.strip_prefix(' ').unwrap_or(raw))?),
        None => {
            content.extend_from_slice(line.strip_prefix(' ').unwrap_or(line).as_bytes());
            content.push(LF);
        }
    }
    if content.len() > MAX_FILE {
        return Err(format!("a file of at most {MAX_FILE} bytes expected, more found"));
    }
    Ok(())
}

/// Behind `>`, `>:`, `<` and `<:`.
fn parse_bytes(word: &str, rest: &str) -> Result<RecordKind, String> {
    let (line, data) = rest.split_once(' ').unwrap_or((rest, ""));
    let line = PeerId::parse(line)?;
    if word == "<" && data == "nothing" {
        return Err("bytes expected: a recording has no line for what did not come".to_owned());
    }
    let mut bytes = notation::read_bytes(data)?;
    if !word.ends_with(':') && line.port.protocol().is_some() {
        bytes.insert(0, STX);
        bytes.push(ETX);
    }
    Ok(bytes_record(word, line, bytes))
}

fn bytes_record(word: &str, line: PeerId, bytes: Vec<u8>) -> RecordKind {
    if word.starts_with('>') {
        RecordKind::FromHost { line, bytes }
    } else {
        RecordKind::FromRobot { line, bytes }
    }
}

fn parse_action(words: &str) -> Result<RecordKind, String> {
    let all: Vec<&str> = words.split(' ').collect();
    let how = |word: &str| match word {
        "reset" => Ok(EndReason::Reset),
        "refused" => Ok(EndReason::Refused),
        _ => Err(format!("reset or refused expected, {word:?} found")),
    };
    let ended = |line: &str, by, how| {
        Ok(RecordKind::Ended {
            line: PeerId::parse(line)?,
            by,
            how,
        })
    };
    match all.as_slice() {
        ["connect", line, peer @ ..] => Ok(RecordKind::Connected {
            line: PeerId::parse(line)?,
            peer: peer.join(" "),
        }),
        ["disconnect", line] => ended(line, Side::Host, EndReason::Closed),
        ["disconnect", line, word] => ended(line, Side::Host, how(word)?),
        ["closed", line] => ended(line, Side::Robot, EndReason::Closed),
        ["closed", line, word] => ended(line, Side::Robot, how(word)?),
        _ => Ok(match link::read(words)? {
            Some(link) => RecordKind::Link(link),
            None => RecordKind::Action(action::read(words)?),
        }),
    }
}

/// Reads `250ms`, `5s` or `1250us`.
///
/// # Errors
/// Another unit, no number, more than a hundred years.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let units = [("us", 1), ("ms", 1_000), ("s", 1_000_000)];
    let unit = units
        .into_iter()
        .find_map(|(unit, micros)| Some((text.strip_suffix(unit)?, micros)));
    let (number, micros) = unit.ok_or_else(|| format!("us, ms or s expected behind @+, {text:?} found"))?;
    let number: u64 = number
        .parse()
        .map_err(|_| format!("a number expected behind @+, {number:?} found"))?;
    let pause = number.checked_mul(micros).filter(|pause| *pause <= MAX_PAUSE);
    pause
        .map(Duration::from_micros)
        .ok_or_else(|| format!("a hundred years at most expected, {text} found"))
}

/// Reads bytes as pairs of hexadecimal digits.
///
/// # Errors
/// What is no byte.
pub fn parse_hex(text: &str) -> Result<Vec<u8>, String> {
    let byte = |word: &str| u8::from_str_radix(word, 16).map_err(|_| format!("{word} is no byte"));
    text.split_whitespace().map(byte).collect()
}

/// A date and time as the header writes it.
#[must_use]
pub fn format_date(at: CalendarTime) -> String {
    let CalendarTime {
        year,
        month,
        day,
        hour,
        minute,
        second,
    } = at;
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}")
}

/// Reads a date and time as [`format_date`] writes it.
///
/// # Errors
/// Anything else.
pub fn parse_date(text: &str) -> Result<CalendarTime, String> {
    let wrong = || format!("a date and time YYYY-MM-DD HH:MM:SS expected, {text:?} found");
    let mut numbers = text.split(['-', ' ', ':']).map(str::parse::<u16>);
    let mut next = || numbers.next().and_then(Result::ok).ok_or_else(wrong);
    let small = |number: u16| u8::try_from(number).map_err(|_| wrong());
    let at = CalendarTime {
        year: next()?,
        month: small(next()?)?,
        day: small(next()?)?,
        hour: small(next()?)?,
        minute: small(next()?)?,
        second: small(next()?)?,
    };
    if at.is_valid() && format_date(at) == text {
        Ok(at)
    } else {
        Err(wrong())
    }
}
