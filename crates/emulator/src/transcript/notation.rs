//! The byte notation of transcripts: printable ASCII as it is, control codes by name in angle brackets, other bytes in
//! hexadecimal, and `<*12>` for twelve arbitrary bytes in an expectation.

const CONTROL_CODES: [(&str, u8); 5] = [
    ("STX", 0x02),
    ("ETX", 0x03),
    ("LF", 0x0A),
    ("CR", 0x0D),
    ("EOF", 0x1A),
];

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
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let Some(inner) = rest.strip_prefix('<') else {
            if !(' '..='~').contains(&first) {
                return Err(format!("printable ASCII expected, {first:?} found"));
            }
            pieces.push(ExpectedByte::Byte(first as u8));
            rest = &rest[1..];
            continue;
        };
        let (name, after) = inner
            .split_once('>')
            .ok_or_else(|| format!("no > after <{inner}"))?;
        rest = after;
        if let Some(count) = name.strip_prefix('*') {
            let count: usize = count
                .parse()
                .map_err(|_| format!("a number expected in <{name}>"))?;
            pieces.extend(vec![ExpectedByte::Any; count]);
        } else if let Some((_, byte)) = CONTROL_CODES.iter().find(|(known, _)| *known == name) {
            pieces.push(ExpectedByte::Byte(*byte));
        } else if name.len() == 2 {
            let byte = u8::from_str_radix(name, 16).map_err(|_| format!("<{name}> is no byte"))?;
            pieces.push(ExpectedByte::Byte(byte));
        } else {
            return Err(format!(
                "<{name}> is neither a control code, nor a byte, nor a count"
            ));
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
    let one = |byte: &u8| match CONTROL_CODES.iter().find(|(_, known)| known == byte) {
        Some((name, _)) => format!("<{name}>"),
        None if (0x20..0x7F).contains(byte) && *byte != b'<' => char::from(*byte).to_string(),
        None => format!("<{byte:02X}>"),
    };
    bytes.iter().map(one).collect()
}
