//! The alarm lists of AC and AH (hosts 7.2, decision D5).
//!
//! The controller decides which alarms a list has, and in which order. Timestamps are shared with [`super::eu`].

use super::BodyError;
use super::eu::{MAX_ENTRIES, YearDigits, decode_stamp, stamp};
use super::fields::Field;
use crate::calendar::CalendarTime;
use crate::prelude::*;

/// Characters of a message that are sent; the rest is cut. The limit is ours.
pub const MAX_MESSAGE: usize = 80;

/// One alarm of AC and AH.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct AlarmRecord {
    /// Level and code, for example `2-046`.
    pub number: String,
    /// Text for the operator; may be empty.
    pub message: String,
    /// When it was raised.
    pub at: CalendarTime,
}

/// The content of the file, records in this order; CR ends each, and the count comes before the first.
/// No alarm is `0`. Records beyond 99 are left out. Commas and control codes go as blanks, what is not ASCII
/// as `?`. A real AC has four digits of the year (hosts 9.1), AH has two (ste80722 S92).
pub fn encode_alarms(records: &[AlarmRecord], digits: YearDigits) -> Vec<u8> {
    let count = records.len().min(MAX_ENTRIES);
    let mut out = count.to_string();
    for (index, record) in records.iter().take(count).enumerate() {
        let comma = if index == 0 { "," } else { "" };
        let (number, message) = (plain(&record.number), plain(&record.message));
        out += &format!("{comma}{number},{message},{}\r", stamp(record.at, digits));
    }
    out.into_bytes()
}

/// Reads a content. Dates have two or four digits of the year; two are a year from 2000 to 2099.
///
/// # Errors
/// A count that does not fit, a record that is not `number,message,YYYY-MM-DD HH:MM:SS`, a date that does not
/// exist.
pub fn decode_alarms(content: &[u8]) -> Result<Vec<AlarmRecord>, BodyError> {
    const COUNT: &str = "the number of the records that follow, 99 at most";
    let whole = Field::whole("AC", content);
    let mut parts = whole
        .records()
        .map(|record| record.split(b',').collect::<Vec<_>>());
    let first = parts.next().unwrap_or_default();
    let (count, first) = first.split_first().ok_or_else(|| whole.error(COUNT))?;
    let number: usize = count.number(COUNT)?;
    let mut records = Vec::new();
    if !first.is_empty() {
        records.push(decode_record(*count, first)?);
    }
    for part in parts {
        // Without a first record there are no further ones.
        if records.is_empty() {
            return Err(count.error(COUNT));
        }
        records.push(decode_record(whole, &part)?);
    }
    let complete = records.len() == number && number <= MAX_ENTRIES;
    complete.then_some(records).ok_or_else(|| count.error(COUNT))
}

/// Length of a year of two digits.
const SHORT_YEAR: usize = 2;

fn decode_record(near: Field<'_>, parts: &[Field<'_>]) -> Result<AlarmRecord, BodyError> {
    const EXPECTED: &str = "a record number,message,YYYY-MM-DD HH:MM:SS";
    let [number, message, at] = parts else {
        return Err(parts.first().unwrap_or(&near).error(EXPECTED));
    };
    if number.bytes().is_empty() {
        return Err(number.error("the number of an alarm"));
    }
    let digits = match at.bytes().get(SHORT_YEAR) {
        Some(b'-') => YearDigits::Two,
        _ => YearDigits::Four,
    };
    Ok(AlarmRecord {
        number: number.text("the number of an alarm in ASCII")?.to_string(),
        message: message.text("a message in ASCII")?.to_string(),
        at: decode_stamp(*at, digits)?,
    })
}

/// Text that fits a field: printable ASCII without the separator.
fn plain(text: &str) -> String {
    let shown = text.chars().take(MAX_MESSAGE).map(|char| match char {
        ',' => ' ',
        ' '..='~' => char,
        char if char.is_control() => ' ',
        _ => '?',
    });
    shown.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(number: &str, message: &str, year: u16, second: u8) -> AlarmRecord {
        AlarmRecord {
            number: number.to_string(),
            message: message.to_string(),
            at: CalendarTime {
                year,
                month: 2,
                day: 6,
                hour: 10,
                minute: 30,
                second,
            },
        }
    }

    #[test]
    fn the_file_to_the_byte() {
        assert_eq!(encode_alarms(&[], YearDigits::Two), b"0");
        let two = [
            record("8-001", "hello a", 2014, 15),
            record("4-002", "there b", 2015, 16),
        ];
        let content = b"2,8-001,hello a,14-02-06 10:30:15\r4-002,there b,15-02-06 10:30:16\r";
        assert_eq!(encode_alarms(&two, YearDigits::Two), content);
        assert_eq!(decode_alarms(content).unwrap(), two);
        assert_eq!(decode_alarms(&content[..content.len() - 1]).unwrap(), two);
        assert_eq!(decode_alarms(b"0"), Ok(Vec::new()));
    }

    // clause: T9 I13
    #[test]
    fn a_year_has_two_or_four_digits() {
        let one = [record("8-001", "a", 2014, 15)];
        for (digits, content) in [
            (YearDigits::Two, "1,8-001,a,14-02-06 10:30:15\r"),
            (YearDigits::Four, "1,8-001,a,2014-02-06 10:30:15\r"),
        ] {
            assert_eq!(encode_alarms(&one, digits), content.as_bytes());
            assert_eq!(decode_alarms(content.as_bytes()).unwrap(), one);
        }
        let old = [record("8-001", "a", 1999, 15)];
        assert_eq!(
            decode_alarms(&encode_alarms(&old, YearDigits::Four)).unwrap(),
            old
        );
    }

    #[test]
    fn a_message_holds_no_separator() {
        let odd = record("2-046", "a,b\rc\nd\u{e9}\u{7f}e\u{1a}", 2026, 0);
        let sent = encode_alarms(&[odd], YearDigits::Two);
        assert_eq!(sent, b"1,2-046,a b c d? e ,26-02-06 10:30:00\r");
        let long = record("2-046", &"x".repeat(500), 2026, 0);
        let read = decode_alarms(&encode_alarms(&[long], YearDigits::Two)).unwrap();
        assert_eq!(read[0].message.len(), MAX_MESSAGE);
        let empty = [record("2-046", "", 2026, 0)];
        assert_eq!(
            decode_alarms(&encode_alarms(&empty, YearDigits::Two)).unwrap(),
            empty
        );
    }

    #[test]
    fn ninety_nine_records_at_most() {
        let many: Vec<AlarmRecord> = (0..120)
            .map(|code| record(&format!("1-{code:03}"), "warning", 2026, 0))
            .collect();
        let content = encode_alarms(&many, YearDigits::Two);
        assert!(content.starts_with(b"99,1-000,"));
        assert_eq!(decode_alarms(&content).unwrap(), many[..MAX_ENTRIES]);
    }

    #[test]
    fn what_is_no_list_is_refused() {
        let two = [record("8-001", "a", 2014, 15), record("4-002", "b", 2015, 16)];
        let content = encode_alarms(&two, YearDigits::Two);
        for end in 0..content.len() - 1 {
            assert!(decode_alarms(&content[..end]).is_err(), "{end}");
        }
        for bad in [
            "x",
            "1",
            "0,",
            "0,2-046,a,26-02-06 10:30:15",
            "2,2-046,a,26-02-06 10:30:15",
            "1,2-046,a,b,26-02-06 10:30:15",
            "1,2-046,26-02-06 10:30:15",
            "1,,a,26-02-06 10:30:15",
            "1,2-046,a,26/02/06 10:30:15",
            "1,2-046,a,26-02-30 10:30:15",
            "1,2-046,a,026-02-06 10:30:15",
            "1,2-046,a,2026-02-30 10:30:15",
            "1,2-046,a,2026-02-06 10:30:150",
            "1,2-046,a,26-02-06 10:30:150",
            "1,2-046,a\n,26-02-06 10:30:15",
            "0\r2-046,a,26-02-06 10:30:15",
            "1\r2-046,a,26-02-06 10:30:15",
        ] {
            assert!(decode_alarms(bad.as_bytes()).is_err(), "{bad:?}");
        }
    }
}
