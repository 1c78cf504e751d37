//! The error history file of EU (EU-01 to EU-07).
//!
//! The controller decides which errors are kept. [`super::ac`] writes its timestamps with the functions below.

use super::fields::Field;
use super::{AlarmLevel, BodyError};
use crate::calendar::CalendarTime;
use crate::prelude::*;

/// Most entries of a file: the count has two digits (EU-01).
pub const MAX_ENTRIES: usize = 99;

/// An error that occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorEntry {
    /// Level, written as the main code.
    pub level: AlarmLevel,
    /// Code within the level, 1 to 999, written as the sub code.
    pub code: u16,
    /// When it occurred. Only the last two digits of the year are written.
    pub at: CalendarTime,
}

/// The content of the file, entries in this order; the controller's is newest first (EU-06). Entries
/// beyond 99 are left out.
pub fn encode_history(entries: &[ErrorEntry]) -> Vec<u8> {
    let count = entries.len().min(MAX_ENTRIES);
    let mut out = format!("{count}\r");
    for entry in entries.iter().take(count) {
        let (main, sub) = (entry.level.number(), entry.code.min(MAX_CODE));
        out += &format!("{main:03}-{sub:03} {}\r", stamp(entry.at, YearDigits::Two));
    }
    out.into_bytes()
}

/// Reads a content; years are those of 2000 to 2099.
///
/// # Errors
/// A count that does not fit, an entry that is not `LLL-CCC YY-MM-DD HH:MM:SS`, a date that does not exist.
pub fn decode_history(content: &[u8]) -> Result<Vec<ErrorEntry>, BodyError> {
    let whole = Field::whole("EU", content);
    let mut records = whole.records();
    let header = records
        .next()
        .ok_or_else(|| whole.error("the number of entries"))?;
    let count: usize = header.number("the number of entries")?;
    let entries = records.map(decode_entry).collect::<Result<Vec<_>, _>>()?;
    let complete = entries.len() == count && count <= MAX_ENTRIES;
    let expected = "the number of the entries that follow, 99 at most";
    complete.then_some(entries).ok_or_else(|| header.error(expected))
}

/// Largest sub code of three digits.
const MAX_CODE: u16 = 999;

/// Century of the two digits of a year.
const CENTURY: u16 = 2_000;

fn decode_entry(record: Field<'_>) -> Result<ErrorEntry, BodyError> {
    let expected = "an entry LLL-CCC YY-MM-DD HH:MM:SS";
    let mut part = record.parts("LLL-CCC ", expected);
    let (level, code, at) = (part()?, part()?, part()?);
    let code = code.number(expected)?;
    let at = decode_stamp(at, YearDigits::Two)?;
    let number = level.number(expected)?;
    let level = AlarmLevel::from_number(number).ok_or_else(|| level.error("level 008, 004, 002 or 001"))?;
    Ok(ErrorEntry { level, code, at })
}

/// How the year of a date is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum YearDigits {
    /// Its last two digits: `26-03-01 13:05:59`.
    Two,
    /// All four: `2026-03-01 13:05:59`.
    Four,
}

/// A time as `YY-MM-DD HH:MM:SS` or `YYYY-MM-DD HH:MM:SS`.
pub(super) fn stamp(at: CalendarTime, digits: YearDigits) -> String {
    let year = match digits {
        YearDigits::Two => format!("{:02}", at.year % 100),
        YearDigits::Four => format!("{:04}", at.year % 10_000),
    };
    let (month, day, hour, minute, second) = (at.month, at.day, at.hour, at.minute, at.second);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}")
}

/// Reads a time as [`stamp`] writes it; two digits are a year from 2000 to 2099.
pub(super) fn decode_stamp(field: Field<'_>, digits: YearDigits) -> Result<CalendarTime, BodyError> {
    let (expected, pattern, century) = match digits {
        YearDigits::Two => ("a time YY-MM-DD HH:MM:SS", "YY-MM-DD hh:mm:ss", CENTURY),
        YearDigits::Four => ("a time YYYY-MM-DD HH:MM:SS", "YYYY-MM-DD hh:mm:ss", 0),
    };
    let mut part = field.parts(pattern, expected);
    let [year, month, day, hour, minute, second, rest] =
        [part()?, part()?, part()?, part()?, part()?, part()?, part()?];
    if !rest.bytes().is_empty() {
        return Err(rest.error("the end of the time"));
    }
    let at = CalendarTime {
        year: century + year.number::<u16>(expected)?,
        month: month.number(expected)?,
        day: day.number(expected)?,
        hour: hour.number(expected)?,
        minute: minute.number(expected)?,
        second: second.number(expected)?,
    };
    let exists = at.is_valid().then_some(at);
    exists.ok_or_else(|| field.error("a date and time that exist"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(level: AlarmLevel, code: u16) -> ErrorEntry {
        let at = CalendarTime {
            year: 2026,
            month: 3,
            day: 4,
            hour: 13,
            minute: 5,
            second: 59,
        };
        ErrorEntry { level, code, at }
    }

    // clause: EU-01 EU-02 EU-03 EU-04 EU-05 EU-06 EU-07
    #[test]
    fn the_file_to_the_byte() {
        assert_eq!(encode_history(&[]), b"0\r");
        assert_eq!(
            encode_history(&[entry(AlarmLevel::L2, 46), entry(AlarmLevel::L8, 368)]),
            b"2\r002-046 26-03-04 13:05:59\r008-368 26-03-04 13:05:59\r"
        );
    }

    // clause: EU-06
    #[test]
    fn ninety_nine_entries_at_most() {
        let many: Vec<ErrorEntry> = (0..120).map(|code| entry(AlarmLevel::L1, code)).collect();
        let bytes = encode_history(&many);
        assert!(bytes.starts_with(b"99\r001-000 "));
        assert_eq!(bytes.iter().filter(|byte| **byte == b'\r').count(), 100);
        assert_eq!(decode_history(&bytes).unwrap(), many[..99]);
    }

    #[test]
    fn every_level_reads_back() {
        for level in AlarmLevel::ALL {
            for code in [1, 46, 160, 999] {
                let entries = [entry(level, code)];
                assert_eq!(decode_history(&encode_history(&entries)).unwrap(), entries);
            }
        }
        assert_eq!(decode_history(b"0\r"), Ok(Vec::new()));
        assert_eq!(decode_history(b"0"), Ok(Vec::new()));
    }

    #[test]
    fn what_is_no_history_is_refused() {
        let bytes = encode_history(&[entry(AlarmLevel::L2, 46)]);
        for end in 0..bytes.len() - 1 {
            assert!(decode_history(&bytes[..end]).is_err(), "{end}");
        }
        for bad in [
            "x\r",
            "1\r003-046 26-03-04 13:05:59\r",
            "1\r002-046 26-02-30 13:05:59\r",
            "1\r002-046 26-03-04 24:05:59\r",
            "1\r002-046 26-03-04 13:05:590\r",
            "2\r002-046 26-03-04 13:05:59\r",
        ] {
            assert!(decode_history(bad.as_bytes()).is_err(), "{bad}");
        }
    }
}
