//! The byte notation of transcripts: printable ASCII as it is, control codes by name in angle brackets, other bytes in
//! hexadecimal, and `<*12>` for twelve arbitrary bytes in an expectation.

use ts3100_proto::escape::{Escaped, Unit, control_code, units};

/// One byte of an expectation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExpectedByte {
    /// Exactly this byte.
    Byte(u8),
    /// Any byte.
    Any,
}

/// Reads the notation.
///
/// # Errors
/// What stands in angle brackets and means nothing.
pub fn read(text: &str) -> Result<Vec<ExpectedByte>, String> {
    let byte = |code: &str| match control_code(code) {
        Some(byte) => Ok(byte),
        None if code.len() == 2 => u8::from_str_radix(code, 16).map_err(|_| format!("<{code}> is no byte")),
        None => Err(format!(
            "<{code}> is neither a control code, nor a byte, nor a count"
        )),
    };
    let mut pieces = Vec::new();
    for unit in units(text) {
        match unit.map_err(|error| error.to_string())? {
            Unit::Char(char) => match u8::try_from(char) {
                Ok(byte @ b' '..=b'~') => pieces.push(ExpectedByte::Byte(byte)),
                _ => return Err(format!("printable ASCII expected, {char:?} found")),
            },
            Unit::Code(code) => match code.strip_prefix('*') {
                Some(count) => {
                    let count = count.parse();
                    let count: usize = count.map_err(|_| format!("a number expected in <{code}>"))?;
                    pieces.extend(vec![ExpectedByte::Any; count]);
                }
                None => pieces.push(ExpectedByte::Byte(byte(code)?)),
            },
        }
    }
    Ok(pieces)
}

/// Reads the notation of known bytes, without `<*n>`.
///
/// # Errors
/// As [`read`], and a `<*n>`.
pub fn read_bytes(text: &str) -> Result<Vec<u8>, String> {
    let plain = |piece: ExpectedByte| match piece {
        ExpectedByte::Byte(byte) => Ok(byte),
        ExpectedByte::Any => Err(format!("a host sends certain bytes, not {text}")),
    };
    read(text)?.into_iter().map(plain).collect()
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
