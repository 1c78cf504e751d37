//! The notation of expectations in transcripts: that of [`ts3100_proto::escape`], and `<*12>` for twelve arbitrary bytes.

use ts3100_proto::escape::{self, Escaped};

/// One byte of an expectation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExpectedByte {
    /// Exactly this byte.
    Byte(u8),
    /// Any byte.
    Any,
}

/// Reads an expectation.
///
/// # Errors
/// What stands in angle brackets and means nothing.
pub fn read(text: &str) -> Result<Vec<ExpectedByte>, String> {
    let mut pieces = Vec::new();
    for (index, part) in text.split("<*").enumerate() {
        let bytes = match index {
            0 => part,
            _ => {
                let (count, rest) = part.split_once('>').ok_or("no > after <*")?;
                let count: usize = count
                    .parse()
                    .map_err(|_| format!("a number expected in <*{count}>"))?;
                pieces.extend(vec![ExpectedByte::Any; count]);
                rest
            }
        };
        pieces.extend(read_bytes(bytes)?.into_iter().map(ExpectedByte::Byte));
    }
    Ok(pieces)
}

/// Reads known bytes, without `<*n>`.
///
/// # Errors
/// As [`read`], and a `<*n>`.
pub fn read_bytes(text: &str) -> Result<Vec<u8>, String> {
    escape::parse(text).map_err(|error| error.to_string())
}

/// Whether the bytes match the expectation.
#[must_use]
pub fn matches(pieces: &[ExpectedByte], bytes: &[u8]) -> bool {
    pieces.len() == bytes.len()
        && pieces.iter().zip(bytes).all(|(piece, byte)| match piece {
            ExpectedByte::Byte(expected) => expected == byte,
            ExpectedByte::Any => true,
        })
}

/// Writes bytes in the notation.
#[must_use]
pub fn write(bytes: &[u8]) -> String {
    Escaped::new(bytes).to_string()
}
