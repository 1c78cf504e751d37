//! Messages of a stream: headers as of HTTP, an empty line, and as many bytes of JSON as `Content-Length` says (LSP 3.17, base
//! protocol; DAP has the same).

use std::io::{self, BufRead, Read as _, Write};

/// Most bytes of a message.
pub const MAX_MESSAGE: usize = 16 * 1024 * 1024;
/// Most bytes of the headers of a message.
const MAX_HEADERS: u64 = 4096;

/// A stream that cannot be cut into messages; what follows on it is lost.
#[derive(Debug, thiserror::Error)]
pub enum FramingError {
    #[error("cannot read a message")]
    Read(#[from] io::Error),
    #[error("the stream ended within a message")]
    CutOff,
    #[error("expected a header as `Content-Length: 12`, found `{}`", .0.escape_debug())]
    Header(String),
    #[error("a message begins without `Content-Length`")]
    NoLength,
    #[error("a message has {0} bytes, at most {MAX_MESSAGE} are accepted")]
    TooLong(usize),
}

/// Reads the next message; `None` where the stream ends between two.
///
/// # Errors
/// [`FramingError`].
pub fn read(stream: &mut impl BufRead) -> Result<Option<Vec<u8>>, FramingError> {
    let mut headers = stream.by_ref().take(MAX_HEADERS);
    let mut length = None;
    let mut is_first = true;
    loop {
        let mut line = Vec::new();
        if headers.read_until(b'\n', &mut line)? == 0 && is_first {
            return Ok(None);
        }
        is_first = false;
        let text = String::from_utf8_lossy(&line);
        let Some(text) = text.strip_suffix('\n') else {
            return Err(match headers.limit() {
                0 => FramingError::Header(text.into_owned()),
                _ => FramingError::CutOff,
            });
        };
        let text = text.trim_end_matches('\r');
        if text.is_empty() {
            break;
        }
        let (name, value) = text
            .split_once(':')
            .ok_or_else(|| FramingError::Header(text.to_owned()))?;
        if name.trim().eq_ignore_ascii_case("Content-Length") {
            let number = value.trim().parse::<usize>();
            length = Some(number.map_err(|_| FramingError::Header(text.to_owned()))?);
        }
    }
    let length = length.ok_or(FramingError::NoLength)?;
    if length > MAX_MESSAGE {
        return Err(FramingError::TooLong(length));
    }
    // The memory grows with what arrives, not with what is announced.
    let mut message = Vec::new();
    stream.by_ref().take(length as u64).read_to_end(&mut message)?;
    match message.len() == length {
        true => Ok(Some(message)),
        false => Err(FramingError::CutOff),
    }
}

/// Writes a message.
///
/// # Errors
/// The stream does not take it.
pub fn write(stream: &mut impl Write, message: &str) -> io::Result<()> {
    write!(stream, "Content-Length: {}\r\n\r\n{message}", message.len())?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_all(mut stream: &[u8]) -> Result<Vec<Vec<u8>>, FramingError> {
        let mut messages = Vec::new();
        while let Some(message) = read(&mut stream)? {
            messages.push(message);
        }
        Ok(messages)
    }

    #[test]
    fn what_is_written_is_read() {
        let mut stream = Vec::new();
        write(&mut stream, "{\"a\":\"\u{e9}\"}").unwrap();
        write(&mut stream, "").unwrap();
        stream.extend(b"content-type: x\r\ncontent-length:2\n\n[]");
        assert_eq!(
            read_all(&stream).unwrap(),
            ["{\"a\":\"\u{e9}\"}".as_bytes(), b"", b"[]"]
        );
    }

    #[test]
    fn a_stream_that_cannot_be_cut_says_why() {
        for (stream, why) in [
            ("{}\n", "expected a header as `Content-Length: 12`, found `{}`"),
            (
                "Content-Length: x\r\n\r\n",
                "expected a header as `Content-Length: 12`, found `Content-Length: x`",
            ),
            ("X: 1\r\n\r\n", "a message begins without `Content-Length`"),
            ("Content-Length: 3\r\n\r\n{}", "the stream ended within a message"),
            ("Content-Length: 3", "the stream ended within a message"),
            (
                "Content-Length: 99999999\r\n\r\n",
                "a message has 99999999 bytes, at most 16777216 are accepted",
            ),
        ] {
            assert_eq!(read_all(stream.as_bytes()).unwrap_err().to_string(), why);
        }
        let long = "X".repeat(5000);
        assert!(matches!(read_all(long.as_bytes()), Err(FramingError::Header(_))));
    }
}
