//! The readable notation of bytes: printable ASCII as it is, the control codes of the protocol by name (`<CR>`), other
//! bytes in hexadecimal (`<1B>`).
//!
//! [`Escaped`] writes it, [`parse`] reads it; [`units`] is for readers that accept more. Logs, transcripts and fault specifications use the same notation; they
//! differ only in the characters that they must escape besides, and in how lenient they read. The encoding of bytes in
//! snapshots is another, see `serde_latin1`.

use crate::prelude::*;
use crate::text::{CR, EOF, ETX, LF, STX};
use core::fmt::{self, Write as _};

/// Names of the control codes.
const CONTROL_CODES: [(&str, u8); 5] = [("STX", STX), ("ETX", ETX), ("LF", LF), ("CR", CR), ("EOF", EOF)];

/// Bytes in the readable notation.
#[derive(Debug, Clone, Copy)]
pub struct Escaped<'a> {
    bytes: &'a [u8],
    /// Printable characters that are written in hexadecimal too.
    special: &'static [u8],
}

impl<'a> Escaped<'a> {
    /// For people: `<` is written as it is, so that the text cannot always be read back.
    pub const fn for_reading(bytes: &'a [u8]) -> Escaped<'a> {
        Escaped { bytes, special: b"" }
    }

    /// For files: [`units`] reads the same bytes back.
    pub const fn new(bytes: &'a [u8]) -> Escaped<'a> {
        Escaped { bytes, special: b"<" }
    }

    /// As one word: as [`Escaped::new`], without blanks in it.
    pub const fn word(bytes: &'a [u8]) -> Escaped<'a> {
        let special = b"< ";
        Escaped { bytes, special }
    }

    /// For use within double quotes: as [`Escaped::new`], without quotes in it.
    pub const fn within_quotes(bytes: &'a [u8]) -> Escaped<'a> {
        let special = b"<\"";
        Escaped { bytes, special }
    }
}

impl fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.bytes.iter().try_for_each(|byte| {
            if let Some((name, _)) = CONTROL_CODES.iter().find(|(_, code)| code == byte) {
                return write!(f, "<{name}>");
            }
            match *byte {
                printable @ b' '..=b'~' if !self.special.contains(&printable) => {
                    f.write_char(char::from(printable))
                }
                other => write!(f, "<{other:02X}>"),
            }
        })
    }
}

/// One unit of the notation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit<'a> {
    /// A plain character.
    Char(char),
    /// The content of angle brackets: the name of a control code, a byte in hexadecimal, or what the reader adds.
    Code(&'a str),
}

/// A `<` without its `>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no > after <{rest}")]
pub struct UnclosedCode<'a> {
    /// The text after the `<`.
    pub rest: &'a str,
}

/// Splits text in the notation into its units; ends after the first error.
pub fn units(text: &str) -> impl Iterator<Item = Result<Unit<'_>, UnclosedCode<'_>>> {
    let mut rest = text;
    core::iter::from_fn(move || {
        let mut chars = rest.chars();
        let first = chars.next()?;
        let after = chars.as_str();
        if first != '<' {
            rest = after;
            return Some(Ok(Unit::Char(first)));
        }
        let Some((code, after_code)) = after.split_once('>') else {
            rest = "";
            return Some(Err(UnclosedCode { rest: after }));
        };
        rest = after_code;
        Some(Ok(Unit::Code(code)))
    })
}

/// Why a text is not bytes in the notation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EscapeError {
    /// A `<` without its `>`.
    #[error("no > after <{0}; write a < alone as <3C>")]
    Unclosed(String),
    /// Two characters in angle brackets that are not hexadecimal digits.
    #[error("<{0}> is not a byte")]
    NotByte(String),
    /// Anything else in angle brackets.
    #[error("<{0}> is not a control code, a byte or a count")]
    UnknownCode(String),
    /// A count of arbitrary bytes, which only an expectation has.
    #[error("expected fixed bytes from a host, found {0}")]
    Count(String),
    /// A character that has to be in hexadecimal.
    #[error("expected printable ASCII, found {0:?}")]
    NotPrintable(char),
}

/// Reads bytes as [`Escaped::new`] writes them.
///
/// # Errors
/// The first unit that is not a byte.
pub fn parse(text: &str) -> Result<Vec<u8>, EscapeError> {
    let byte = |unit| match unit {
        Err(UnclosedCode { rest }) => Err(EscapeError::Unclosed(rest.to_string())),
        Ok(Unit::Char(char @ ' '..='~')) => Ok(char as u8),
        Ok(Unit::Char(char)) => Err(EscapeError::NotPrintable(char)),
        Ok(Unit::Code(code)) if code.starts_with('*') => Err(EscapeError::Count(text.to_string())),
        Ok(Unit::Code(code)) => match (control_code(code), code.len()) {
            (Some(byte), _) => Ok(byte),
            (None, 2) => hex_byte(code).ok_or_else(|| EscapeError::NotByte(code.to_string())),
            (None, _) => Err(EscapeError::UnknownCode(code.to_string())),
        },
    };
    units(text).map(byte).collect()
}

/// Bytes as pairs of hexadecimal digits with blanks between them.
pub fn hex(bytes: &[u8]) -> String {
    let pairs: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    pairs.join(" ")
}

/// Bytes as pairs of hexadecimal digits in lower case, without blanks, as JSON documents have them.
pub fn hex_digits(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// A byte of one or two hexadecimal digits.
pub fn hex_byte(digits: &str) -> Option<u8> {
    let plain = digits.len() <= 2 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    u8::from_str_radix(digits, 16).ok().filter(|_| plain)
}

/// The control code of this name; case does not matter.
pub fn control_code(name: &str) -> Option<u8> {
    let mut codes = CONTROL_CODES.iter();
    codes
        .find(|(known, _)| known.eq_ignore_ascii_case(name))
        .map(|(_, code)| *code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_is_read_back() {
        let every: Vec<u8> = (0..=u8::MAX).collect();
        for escaped in [Escaped::new(&every), Escaped::within_quotes(&every)] {
            let text = escaped.to_string();
            assert!(text.is_ascii());
            assert_eq!(parse(&text), Ok(every.clone()));
        }
    }

    #[test]
    fn the_three_forms() {
        let bytes = b"\x02A<\"\r\n\x1a\x03\x00\x7f\xff";
        let end = "<CR><LF><EOF><ETX><00><7F><FF>";
        assert_eq!(
            Escaped::for_reading(bytes).to_string(),
            alloc::format!("<STX>A<\"{end}")
        );
        assert_eq!(
            Escaped::new(bytes).to_string(),
            alloc::format!("<STX>A<3C>\"{end}")
        );
        assert_eq!(
            Escaped::within_quotes(bytes).to_string(),
            alloc::format!("<STX>A<3C><22>{end}")
        );
    }

    #[test]
    fn text_that_is_not_bytes_is_an_error_with_its_reason() {
        let cases = [
            ("a<1A", EscapeError::Unclosed("1A".into())),
            ("<1G>", EscapeError::NotByte("1G".into())),
            ("<BEL>", EscapeError::UnknownCode("BEL".into())),
            ("a<*2>", EscapeError::Count("a<*2>".into())),
            ("<*>", EscapeError::Count("<*>".into())),
            ("a\n", EscapeError::NotPrintable('\n')),
            ("ä", EscapeError::NotPrintable('ä')),
        ];
        for (text, error) in cases {
            assert_eq!(parse(text), Err(error), "{text}");
        }
    }

    #[test]
    fn an_open_bracket_is_an_error() {
        let found: Vec<_> = units("a<CR>b<1A").collect();
        assert_eq!(found.len(), 4);
        assert_eq!(found[1], Ok(Unit::Code("CR")));
        assert_eq!(found[3], Err(UnclosedCode { rest: "1A" }));
        assert_eq!(found[3].unwrap_err().to_string(), "no > after <1A");
    }
}
