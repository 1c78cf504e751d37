//! The texts that the controller sends (Table 5.2, and the unsolicited SP of CMD-SP-05), as a host reads them.
//!
//! The content that FL carries is in [`crate::status`]; files that take several texts are in [`crate::file`].

use crate::prelude::*;
use crate::text::{CR, EOF};

/// The data section of the unsolicited SP.
pub const STOP: &[u8] = b"SP\r";

/// A text of the controller, read by a host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// Affirmative (CMD-OK-01).
    Ok,
    /// Negative (CMD-NG-01).
    Ng,
    /// The robot has stopped and the host did not ask for it (CMD-SP-05).
    Sp,
    /// A file or the first text of one: the data section after `FL,`, EOF included if it is there.
    Fl(Vec<u8>),
}

/// A text that the controller would not send.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("reply: expected OK, NG, SP or \"FL,\", found \"{found}\"")]
pub struct ReplyError {
    /// The data section, as far as it is worth showing.
    pub found: String,
}

/// OK, NG or SP of a text, whose CR may be missing.
fn word(data: &[u8]) -> &[u8] {
    data.strip_suffix(&[CR]).unwrap_or(data)
}

impl Reply {
    /// Reads the data section of a text. A missing CR after OK, NG and SP is overlooked, as the vendor's
    /// client library does (hosts 1.3); surplus letters are not.
    ///
    /// # Errors
    /// Anything but OK, NG, SP and `FL,`.
    pub fn parse(data: &[u8]) -> Result<Reply, ReplyError> {
        if let Some(rest) = data.strip_prefix(b"FL,") {
            return Ok(Reply::Fl(rest.to_vec()));
        }
        match word(data) {
            b"OK" => Ok(Reply::Ok),
            b"NG" => Ok(Reply::Ng),
            b"SP" => Ok(Reply::Sp),
            _ => Err(ReplyError {
                found: crate::command::excerpt(data),
            }),
        }
    }

    /// Whether the data section of a text is OK or NG.
    pub fn acknowledges(data: &[u8]) -> bool {
        matches!(word(data), b"OK" | b"NG")
    }

    /// The data section of the text.
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Reply::Ok => b"OK\r".to_vec(),
            Reply::Ng => b"NG\r".to_vec(),
            Reply::Sp => STOP.to_vec(),
            Reply::Fl(body) => [b"FL,", body.as_slice()].concat(),
        }
    }

    /// The content of an FL that is complete in this text: the bytes before EOF.
    pub fn content(&self) -> Option<&[u8]> {
        let Reply::Fl(body) = self else { return None };
        let end = body.strip_suffix(&[CR]).unwrap_or(body);
        end.strip_suffix(&[EOF])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    // clause: CMD-OK-01 CMD-NG-01 CMD-SP-05 FL-01 CMD-LST-02
    #[test]
    fn replies_to_the_byte() {
        for (reply, data) in [
            (Reply::Ok, b"OK\r".as_slice()),
            (Reply::Ng, b"NG\r"),
            (Reply::Sp, b"SP\r"),
            (Reply::Fl(b"NEW 24\r\x1a".to_vec()), b"FL,NEW 24\r\x1a"),
            (Reply::Fl(Vec::new()), b"FL,"),
        ] {
            assert_eq!(reply.encode(), data);
            assert_eq!(Reply::parse(data), Ok(reply));
        }
        assert_eq!(Reply::parse(b"OK"), Ok(Reply::Ok));
    }

    #[test]
    fn other_texts_are_errors() {
        for data in [b"".as_slice(), b"OKAY\r", b"ok\r", b"FL", b"SU\r", b"\xff"] {
            assert!(Reply::parse(data).is_err(), "{data:02X?}");
        }
        let error = Reply::parse(b"XY\r").map_err(|error| error.to_string());
        assert_eq!(
            error,
            Err("reply: expected OK, NG, SP or \"FL,\", found \"XY\\r\"".to_string())
        );
    }

    #[test]
    fn the_content_of_a_file_in_one_text() {
        for (data, content) in [
            (b"FL,A\x1a".as_slice(), Some(b"A".as_slice())),
            (b"FL,A\r\x1a\r", Some(b"A\r")),
            (b"FL,\x1a", Some(b"")),
            (b"FL,A", None),
            (b"OK\r", None),
        ] {
            assert_eq!(Reply::parse(data).unwrap().content(), content);
        }
    }
}
