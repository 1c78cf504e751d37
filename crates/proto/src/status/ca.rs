//! The directory file of CA (DIR-01 to DIR-04).
//!
//! The RAM drive of the controller decides which files are listed, and in which order. For the spelling of names see
//! [`crate::name`].

use super::BodyError;
use super::fields::Field;
use crate::prelude::*;

/// One file of the RAM drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DirectoryEntry {
    /// File name, 1 to 12 characters, no blank.
    pub name: String,
    /// Size in bytes without EOF (DIR-03).
    pub size: u32,
    /// Attribute, left out if there is none; no blank.
    pub attribute: Option<String>,
}

/// The content of the file: `NAME SIZE` or `NAME SIZE ATTRIBUTE` and CR for each entry, with these blanks between the
/// fields: the figure that would show them is lost (DIR-02).
pub fn encode_directory(entries: &[DirectoryEntry], blanks: &str) -> Vec<u8> {
    let mut out = String::new();
    for entry in entries {
        out += &format!("{}{blanks}{}", entry.name, entry.size);
        if let Some(attribute) = &entry.attribute {
            out += &format!("{blanks}{attribute}");
        }
        out.push('\r');
    }
    out.into_bytes()
}

/// Reads a content.
///
/// # Errors
/// A record that is not a name, a number and at most one attribute, separated by blanks. The number of blanks was in a
/// figure of the manual that is lost (DIR-02).
pub fn decode_directory(content: &[u8]) -> Result<Vec<DirectoryEntry>, BodyError> {
    Field::whole("CA", content).records().map(decode_entry).collect()
}

fn decode_entry(record: Field<'_>) -> Result<DirectoryEntry, BodyError> {
    let fields: Vec<Field<'_>> = record.split(b' ').collect();
    if let Some(end) = fields.last().filter(|last| last.bytes().is_empty()) {
        return Err(end.error("the end of the record, or a field after the blank"));
    }
    let (name, further) = fields.split_first().unwrap_or((&record, &[]));
    let mut further = further.iter().filter(|field| !field.bytes().is_empty());
    let (false, Some(size)) = (name.bytes().is_empty(), further.next()) else {
        return Err(record.error("a file name, a blank and a size"));
    };
    let attribute = |word: &Field<'_>| word.text("an attribute in ASCII").map(ToString::to_string);
    let entry = DirectoryEntry {
        name: name.text("a file name in ASCII")?.to_string(),
        size: size.number("a size in bytes")?,
        attribute: further.next().map(attribute).transpose()?,
    };
    match further.next() {
        Some(surplus) => Err(surplus.error("the end of the record")),
        None => Ok(entry),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, size: u32, attribute: Option<&str>) -> DirectoryEntry {
        DirectoryEntry {
            name: name.to_string(),
            size,
            attribute: attribute.map(ToString::to_string),
        }
    }

    // clause: DIR-01 DIR-02
    #[test]
    fn records_to_the_byte() {
        assert_eq!(
            encode_directory(&[entry("NEW", 24, None)], " "),
            [0x4E, 0x45, 0x57, 0x20, 0x32, 0x34, 0x0D]
        );
        let entries = [entry("ETHERNET.PAR", 99_999, Some("R")), entry("A", 0, None)];
        assert_eq!(encode_directory(&entries, " "), b"ETHERNET.PAR 99999 R\rA 0\r");
        assert_eq!(decode_directory(b"ETHERNET.PAR 99999 R\rA 0\r").unwrap(), entries);
        assert_eq!(decode_directory(b"ETHERNET.PAR 99999 R\rA 0").unwrap(), entries);
        assert_eq!(decode_directory(&encode_directory(&[], " ")), Ok(Vec::new()));
    }

    // clause: DIR-02
    #[test]
    fn any_number_of_blanks_separates_fields() {
        let entries = [entry("ABC", 12, Some("R")), entry("D", 3, None)];
        for blanks in [" ", "  ", "      "] {
            let content = encode_directory(&entries, blanks);
            assert_eq!(decode_directory(&content).unwrap(), entries);
        }
        assert_eq!(encode_directory(&entries, "  "), b"ABC  12  R\rD  3\r");
    }

    #[test]
    fn what_is_no_directory_is_refused() {
        for bad in [
            "A",
            "A ",
            " 1",
            "A x",
            "A -1",
            "A 1 ",
            "A 1 R ",
            "A 99999999999",
            "A,1",
            "A 1\r\rB 2",
        ] {
            assert!(decode_directory(bad.as_bytes()).is_err(), "{bad}");
        }
        assert!(decode_directory(b"\xFF 1\r").is_err());
        let error = decode_directory(b"A 1\rB x\r").unwrap_err();
        assert_eq!(
            error.to_string(),
            "CA file, byte 6: expected a size in bytes, found `x`"
        );
    }
}
