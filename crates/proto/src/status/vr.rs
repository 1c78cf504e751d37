//! The version file of VR in both layouts (hosts VR, VR-01 to VR-03).
//!
//! The caller supplies names, dates and checksums.

use super::BodyError;
use super::fields::Field;
use crate::calendar::CalendarTime;
use crate::prelude::*;

/// Characters of a system name; further ones are cut.
pub const NAME_LENGTH: usize = 10;

/// One part of the system software.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VersionRecord {
    /// System name, ASCII, ten characters at most.
    pub name: String,
    /// Date and time of creation; the second is not written.
    pub date: CalendarTime,
    /// Checksum, written as four hexadecimal digits.
    pub checksum: u16,
}

/// How a record is written (option `vr.layout`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum VrLayout {
    /// One record: name filled to 11 columns, `YYYY-MM-DD HH:MM`, a blank, the checksum, CR.
    Blanks,
    /// Records of 30 bytes: name filled to 10 columns, `YYYY/MM/DD`, `HH:MM`, the checksum, CR.
    Packed,
}

/// The content of the file. [`VrLayout::Blanks`] holds the first record only: it is all that the hosts
/// that read this layout are known to accept.
pub fn encode_versions(records: &[VersionRecord], layout: VrLayout) -> Vec<u8> {
    let count = match layout {
        VrLayout::Blanks => 1,
        VrLayout::Packed => records.len(),
    };
    let mut out = String::new();
    for record in records.iter().take(count) {
        let VersionRecord { name, date, checksum } = record;
        let ascii = |char| if matches!(char, ' '..='~') { char } else { '?' };
        let name: String = name.chars().map(ascii).take(NAME_LENGTH).collect();
        let (year, month, day) = (date.year.min(LAST_YEAR), date.month, date.day);
        let (hour, minute) = (date.hour, date.minute);
        out += &match layout {
            VrLayout::Blanks => {
                format!("{name:<11}{year:04}-{month:02}-{day:02} {hour:02}:{minute:02} {checksum:04X}\r")
            }
            VrLayout::Packed => {
                format!("{name:<10}{year:04}/{month:02}/{day:02}{hour:02}:{minute:02}{checksum:04X}\r")
            }
        };
    }
    out.into_bytes()
}

/// Reads a content of either layout, record by record; the seconds are 0.
///
/// # Errors
/// A record of another length, or with a date, time or checksum that is none.
pub fn decode_versions(content: &[u8]) -> Result<Vec<VersionRecord>, BodyError> {
    Field::whole("VR", content).records().map(decode_record).collect()
}

/// Last year of four digits.
const LAST_YEAR: u16 = 9_999;
/// Records without CR: that of [`VrLayout::Blanks`] and that of [`VrLayout::Packed`].
const RECORDS: [&str; 2] = [
    "NNNNNNNNNNNYYYY-MM-DD hh:mm CCCC",
    "NNNNNNNNNNYYYY/MM/DDhh:mmCCCC",
];

fn decode_record(record: Field<'_>) -> Result<VersionRecord, BodyError> {
    let pattern = RECORDS
        .into_iter()
        .find(|known| known.len() == record.bytes().len());
    let pattern = pattern.ok_or_else(|| record.error("a record of 29 or 32 characters"))?;
    let mut part = record.parts(pattern, "name, date, time and checksum");
    let name = part()?.text("a system name in ASCII")?.trim_end().to_string();
    let date = CalendarTime {
        year: part()?.number("a year")?,
        month: part()?.number("a month")?,
        day: part()?.number("a day")?,
        hour: part()?.number("an hour")?,
        minute: part()?.number("a minute")?,
        second: 0,
    };
    let checksum = part()?;
    let hexadecimal = "a checksum of four hexadecimal digits";
    let digits = checksum.text(hexadecimal)?;
    let plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    let number = u16::from_str_radix(digits, 16).ok().filter(|_| plain);
    let checksum = number.ok_or_else(|| checksum.error(hexadecimal))?;
    let date = Some(date).filter(|date| date.is_valid());
    let date = date.ok_or_else(|| record.error("a date and time that exist"))?;
    Ok(VersionRecord { name, date, checksum })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(name: &str, checksum: u16) -> VersionRecord {
        let date = CalendarTime {
            year: 2014,
            month: 2,
            day: 6,
            hour: 10,
            minute: 30,
            second: 0,
        };
        VersionRecord {
            name: name.to_string(),
            date,
            checksum,
        }
    }

    #[test]
    fn the_layout_with_blanks_to_the_byte() {
        let records = [record("TS3100", 0xABCD), record("ROBOT", 1)];
        assert_eq!(
            encode_versions(&records, VrLayout::Blanks),
            b"TS3100     2014-02-06 10:30 ABCD\r"
        );
        assert_eq!(encode_versions(&[], VrLayout::Blanks), b"");
    }

    // clause: VR-01 VR-02 VR-03
    #[test]
    fn the_packed_layout_has_records_of_30_bytes() {
        let bytes = encode_versions(&[record("TS3100", 0xABCD), record("ROBOT", 1)], VrLayout::Packed);
        assert_eq!(
            bytes,
            b"TS3100    2014/02/0610:30ABCD\rROBOT     2014/02/0610:300001\r"
        );
        assert_eq!(bytes.len(), 60);
    }

    #[test]
    fn both_layouts_read_back_and_long_names_are_cut() {
        for layout in [VrLayout::Blanks, VrLayout::Packed] {
            for checksum in [0, 1, 0x00AB, 0xFFFF] {
                let records = [record("SYSTEM V1X", checksum)];
                let bytes = encode_versions(&records, layout);
                assert_eq!(decode_versions(&bytes).unwrap(), records);
                for end in 1..bytes.len() - 1 {
                    assert!(decode_versions(&bytes[..end]).is_err(), "{end}");
                }
            }
            let long = encode_versions(&[record("A name of many characters\u{e9}", 0)], layout);
            assert_eq!(decode_versions(&long).unwrap(), [record("A name of", 0)]);
        }
    }

    #[test]
    fn what_is_no_version_is_refused() {
        for bad in [
            "TS3100     2014/02/06 10:30 ABCD\r",
            "TS3100     2014-02-30 10:30 ABCD\r",
            "TS3100     2014-02-06 10:30 +BCD\r",
            "TS3100     2014-02-06T10:30 ABCD\r",
        ] {
            assert!(decode_versions(bad.as_bytes()).is_err(), "{bad}");
        }
    }
}
