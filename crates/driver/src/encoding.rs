//! Recognises files of the PC that are not plain text, before a compiler or the drive complains about each of their bytes.
//!
//! SCOL programs and parameter files are ASCII. UTF-8 is left to the compiler and the drive, which name its characters;
//! editors on Windows also save UTF-16, Latin-1 and Shift-JIS. A guess is good enough: it only chooses the words of one message.

use std::fmt;

/// Why a file is not read as text: its encoding, the byte that shows it, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("it is {encoding}{}; save it as ASCII", self.shown_by())]
pub struct EncodingError {
    /// Encoding of the file.
    pub encoding: Encoding,
    /// The first byte that is not ASCII; none where a byte order mark says it.
    found: Option<Found>,
}

impl EncodingError {
    fn shown_by(&self) -> String {
        let Some(Found { byte, line, column }) = self.found else {
            return String::new();
        };
        format!(" (line {line}, column {column}: byte {byte:02X})")
    }
}

/// A byte and its place, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Found {
    byte: u8,
    line: usize,
    column: usize,
}

/// An encoding that is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8 that begins with a byte order mark.
    Utf8Mark,
    /// UTF-16, with or without a byte order mark.
    Utf16 {
        /// High byte first.
        is_big_endian: bool,
        /// It begins with a byte order mark.
        has_mark: bool,
    },
    /// UTF-32 with a byte order mark.
    Utf32,
    /// Japanese.
    ShiftJis,
    /// Western European: Latin-1, or Windows-1252.
    Latin1,
    /// Bytes that no text has.
    Binary,
}

impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Encoding::Utf8Mark => f.write_str("UTF-8 with a byte order mark"),
            Encoding::Utf16 {
                is_big_endian,
                has_mark,
            } => {
                let order = if *is_big_endian {
                    "big-endian"
                } else {
                    "little-endian"
                };
                let mark = if *has_mark { "with" } else { "without" };
                write!(f, "UTF-16 ({order}) {mark} a byte order mark")
            }
            Encoding::Utf32 => f.write_str("UTF-32 with a byte order mark"),
            Encoding::ShiftJis => f.write_str("Shift-JIS"),
            Encoding::Latin1 => f.write_str("Latin-1 or Windows-1252"),
            Encoding::Binary => f.write_str("no text"),
        }
    }
}

/// Reads the content of a text file as UTF-8.
///
/// # Errors
/// It is in another encoding, begins with a byte order mark, or is binary.
pub fn decode(content: Vec<u8>) -> Result<String, EncodingError> {
    check(&content)?;
    // `check` has taken every byte that is not UTF-8 for another encoding.
    String::from_utf8(content).map_err(|error| foreign(error.as_bytes(), error.utf8_error().valid_up_to()))
}

/// As [`decode`], where the bytes are enough.
///
/// # Errors
/// As [`decode`].
pub fn check(content: &[u8]) -> Result<(), EncodingError> {
    let marked = |encoding| {
        Err(EncodingError {
            encoding,
            found: None,
        })
    };
    if content.starts_with(b"\xEF\xBB\xBF") {
        return marked(Encoding::Utf8Mark);
    }
    // That of UTF-32 in little-endian begins as that of UTF-16.
    if content.starts_with(b"\xFF\xFE\0\0") || content.starts_with(b"\0\0\xFE\xFF") {
        return marked(Encoding::Utf32);
    }
    for (mark, is_big_endian) in [(b"\xFF\xFE", false), (b"\xFE\xFF", true)] {
        if content.starts_with(mark) {
            let has_mark = true;
            return marked(Encoding::Utf16 {
                is_big_endian,
                has_mark,
            });
        }
    }
    if let Some(at) = content.iter().position(|byte| *byte == 0) {
        let encoding = match utf16_order(content) {
            Some(is_big_endian) => Encoding::Utf16 {
                is_big_endian,
                has_mark: false,
            },
            None => Encoding::Binary,
        };
        return Err(EncodingError {
            encoding,
            found: Some(place(content, at)),
        });
    }
    match str::from_utf8(content) {
        Ok(_) => Ok(()),
        Err(error) => Err(foreign(content, error.valid_up_to())),
    }
}

/// Text that is not UTF-8 from this place on.
fn foreign(content: &[u8], at: usize) -> EncodingError {
    let encoding = match is_shift_jis(content) {
        true => Encoding::ShiftJis,
        false => Encoding::Latin1,
    };
    EncodingError {
        encoding,
        found: Some(place(content, at)),
    }
}

/// Whether the high byte comes first in UTF-16 of mostly ASCII characters, whose high bytes are 0; `None` if it is not UTF-16.
fn utf16_order(content: &[u8]) -> Option<bool> {
    if content.len() < 2 {
        return None;
    }
    let zeros = |parity: usize| {
        content
            .iter()
            .skip(parity)
            .step_by(2)
            .filter(|byte| **byte == 0)
            .count()
    };
    let (even, odd) = (zeros(0), zeros(1));
    // At least half of the characters, so that a file with a stray NUL is not taken for one.
    let enough = content.len() / 4;
    match (even > enough, odd > enough) {
        (true, false) => Some(true),
        (false, true) => Some(false),
        // One character alone.
        _ if content.len() == 2 => Some(even == 1),
        _ => None,
    }
}

/// Whether every byte fits Shift-JIS, and one begins a character of two bytes that no text in Latin-1 has: 81 to 9F are
/// control characters there.
fn is_shift_jis(content: &[u8]) -> bool {
    let (mut bytes, mut is_certain) = (content.iter().copied(), false);
    while let Some(byte) = bytes.next() {
        match byte {
            0x00..=0x7F | 0xA1..=0xDF => {}
            0x81..=0x9F | 0xE0..=0xFC => {
                if !matches!(bytes.next(), Some(0x40..=0x7E | 0x80..=0xFC)) {
                    return false;
                }
                is_certain |= byte <= 0x9F;
            }
            _ => return false,
        }
    }
    is_certain
}

fn place(content: &[u8], at: usize) -> Found {
    let before = content.get(..at).unwrap_or_default();
    let begin = before
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |end| end + 1);
    Found {
        byte: content.get(at).copied().unwrap_or_default(),
        line: 1 + before.iter().filter(|byte| **byte == b'\n').count(),
        column: 1 + at - begin,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &str = "PROGRAM P\nPRINT TP, \"HALLO\", CR\nEND\n";

    fn utf16(text: &str, to_bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(to_bytes).collect()
    }

    fn message(content: &[u8]) -> String {
        decode(content.to_vec()).unwrap_err().to_string()
    }

    #[test]
    fn text_in_ascii_and_utf_8_is_read_as_it_is() {
        for text in ["", "A", PROGRAM, "' Größe µ 日本\r\n"] {
            assert_eq!(decode(text.as_bytes().to_vec()).as_deref(), Ok(text));
        }
    }

    #[test]
    fn each_encoding_is_named_with_the_byte_that_shows_it() {
        let remedy = "save it as ASCII";
        let latin = PROGRAM.replace("HALLO", "GR__E").into_bytes();
        let latin: Vec<u8> = latin
            .iter()
            .map(|byte| if *byte == b'_' { 0xFC } else { *byte })
            .collect();
        let mut japanese = b"PROGRAM P\n' ".to_vec();
        japanese.extend(b"\x83\x65\x83\x58\x83\x67\nEND\n");
        let little = utf16(PROGRAM, u16::to_le_bytes);
        let big = utf16(PROGRAM, u16::to_be_bytes);
        for (content, expected) in [
            (
                [b"\xEF\xBB\xBF", PROGRAM.as_bytes()].concat(),
                "UTF-8 with a byte order mark; ",
            ),
            (
                [b"\xFF\xFE", &little[..]].concat(),
                "UTF-16 (little-endian) with a byte order mark; ",
            ),
            (
                [b"\xFE\xFF", &big[..]].concat(),
                "UTF-16 (big-endian) with a byte order mark; ",
            ),
            (
                little,
                "UTF-16 (little-endian) without a byte order mark (line 1, column 2: byte 00); ",
            ),
            (
                big,
                "UTF-16 (big-endian) without a byte order mark (line 1, column 1: byte 00); ",
            ),
            (latin, "Latin-1 or Windows-1252 (line 2, column 14: byte FC); "),
            (japanese, "Shift-JIS (line 2, column 3: byte 83); "),
            (b"AB\0CDEFGH\n".to_vec(), "no text (line 1, column 3: byte 00); "),
            (
                b"AB\0CDEFGHIJ\n".to_vec(),
                "no text (line 1, column 3: byte 00); ",
            ),
            (b"\0".to_vec(), "no text (line 1, column 1: byte 00); "),
            (b"\xFF\xFE\0\0P\0\0\0".to_vec(), "UTF-32 with a byte order mark; "),
            (b"\0\0\xFE\xFF\0\0\0P".to_vec(), "UTF-32 with a byte order mark; "),
        ] {
            assert_eq!(message(&content), format!("it is {expected}{remedy}"));
        }
    }

    #[test]
    fn no_cut_and_no_broken_byte_is_taken_for_text() {
        let little = utf16(PROGRAM, u16::to_le_bytes);
        for end in 2..little.len() {
            assert!(decode(little[..end].to_vec()).is_err(), "{end}");
        }
        for byte in 0x80..=0xFF {
            let broken = [b"PROGRAM P\n' ", &[byte][..], b"\nEND\n"].concat();
            assert!(decode(broken).is_err(), "{byte:02X}");
        }
    }
}
