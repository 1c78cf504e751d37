//! Texts, the frames of the protocol: STX, data section, ETX, and a checksum if the option asks for one.
//!
//! [`TextDecoder`] of `decoder` cuts a byte stream into texts; [`encode_text`] writes one. What the data section means is for [`crate::message`],
//! [`crate::command`], [`crate::file`] and [`crate::reply`].

mod decoder;

pub use decoder::{Decoded, TextDecoder};

use crate::prelude::*;
use bytes::Bytes;
use core::time::Duration;

/// STX, the first byte of a text.
pub const STX: u8 = 0x02;
/// ETX, the last byte of a text before its checksum.
pub const ETX: u8 = 0x03;
/// LF, a line end in files.
pub const LF: u8 = 0x0A;
/// CR, the last byte of a message.
pub const CR: u8 = 0x0D;
/// EOF, the byte after the last one of a file.
pub const EOF: u8 = 0x1A;
/// Data bytes a text may have (FRM-02).
pub const MAX_DATA: usize = 253;
/// Bytes a text may have from STX through ETX (FRM-02).
pub const MAX_TEXT: usize = 255;
/// Advised pause of a host before its next text (TRN-04).
pub const HOST_DELAY: Duration = Duration::from_millis(50);
/// Unread bytes that a decoder buffers. Beyond that the newest are dropped.
pub const MAX_BUFFERED: usize = 65_536;
/// Data bytes of the longest text that is delimited by length instead of ETX.
pub const MAX_BINARY: usize = 1024;

/// Whether a text begins with STX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Framing {
    /// With STX, as the manual has it.
    #[default]
    Stx,
    /// Without STX, as the vendor's client library sends it by default (hosts 1.1).
    Bare,
}

/// How bytes outside a text are read (option `text.stx`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum StxRule {
    /// Any byte but ETX begins a text without STX.
    #[default]
    Detect,
    /// They are noise until an STX comes.
    Required,
}

/// End of a text without STX (option `text.end`). A text with STX, a text that begins with `FL,` and a text with a
/// checksum always end with ETX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum EndRule {
    /// ETX alone (FRM-01).
    #[default]
    Etx,
    /// CR, or ETX before any CR.
    Cr,
    /// ETX, or CR on a connection whose host sends no ETX (T6).
    Detect,
}

/// The byte that ended a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Terminator {
    /// ETX.
    #[default]
    Etx,
    /// CR, which is the last byte of the data too.
    Cr,
}

/// Which texts the reader of a stream expects next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// Texts in which each byte counts: a file without STX, a message of several texts, what a controller sends.
    Data,
    /// The first text of a file, or a later one with STX. CR, LF, NUL and blanks before it are skipped.
    File,
    /// A command or an acknowledgement. The same bytes are skipped before it, and CR may end it ([`EndRule`]).
    Command,
}

/// Whether a checksum follows ETX (option `text.checksum`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Checksum {
    /// No checksum: a text ends with ETX.
    #[default]
    None,
    /// One byte: the low 8 bits of the sum of all bytes after STX through ETX (FRM-15).
    Sum,
}

/// The framing options of a port; both sides must agree on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextOptions {
    /// How bytes outside a text are read.
    pub stx: StxRule,
    pub end: EndRule,
    /// Whether a checksum follows ETX.
    pub checksum: Checksum,
}

/// One text as it was received.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Text {
    /// Whether it began with STX. The answer is framed the same way.
    pub framing: Framing,
    /// The bytes between STX and ETX. An over-long text keeps only the first [`MAX_DATA`].
    #[serde(with = "crate::serde_latin1")]
    pub data: Bytes,
    /// The byte that ended it.
    pub terminator: Terminator,
    pub error: Option<TextError>,
}

/// A breach of the rules of framing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum TextError {
    /// More than [`MAX_DATA`] data bytes (FRM-03).
    #[error("the message has {length} bytes of data; at most {MAX_DATA} are allowed")]
    OverLong {
        /// Data bytes received, those that were not kept included.
        length: usize,
    },
    /// The checksum is wrong (FRM-15).
    #[error("wrong checksum: expected {expected:02X}, found {found:02X}")]
    BadSum {
        /// The sum computed from the received bytes.
        expected: u8,
        /// The checksum byte that followed ETX.
        found: u8,
    },
    /// A text delimited by length is not followed by ETX.
    #[error("expected ETX after the announced length, found {found:02X}")]
    NoEtx {
        /// The byte that was received instead of ETX.
        found: u8,
    },
}

/// The bytes of a text on the wire. The controller sends each text in one write (FRM-09, D2).
pub fn encode_text(data: &[u8], framing: Framing, checksum: Checksum) -> Vec<u8> {
    let mut wire = Vec::with_capacity(data.len() + 3);
    if framing == Framing::Stx {
        wire.push(STX);
    }
    wire.extend_from_slice(data);
    wire.push(ETX);
    if checksum == Checksum::Sum {
        wire.push(data.iter().fold(ETX, |sum, &byte| sum.wrapping_add(byte)));
    }
    wire
}

#[cfg(test)]
mod tests;
