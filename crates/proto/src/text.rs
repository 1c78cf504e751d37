//! Texts: STX, data section, ETX, and perhaps a checksum. Frames are cut by hand, in bounded memory, and
//! find their way back after noise (FRM-01 to FRM-05, FRM-15 to FRM-17). What the data says is for `message`,
//! `command`, `file` and `reply`.

use alloc::vec::Vec;
use bytes::{Buf, BytesMut};

/// Start of a text.
pub const STX: u8 = 0x02;
/// End of a text.
pub const ETX: u8 = 0x03;
/// Line feed.
pub const LF: u8 = 0x0A;
/// Carriage return, the end of a message.
pub const CR: u8 = 0x0D;
/// End of a file.
pub const EOF: u8 = 0x1A;
/// Data bytes a text may have (FRM-02).
pub const MAX_DATA: usize = 253;
/// Bytes a text may have from STX through ETX (FRM-02).
pub const MAX_TEXT: usize = 255;
/// Bytes that may wait in a decoder to be read; the newest are dropped beyond that.
pub const MAX_BUFFERED: usize = 65_536;
/// Data bytes of the longest text that is cut by length.
pub const MAX_BINARY: usize = 1024;

/// Form of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Framing {
    /// With STX, as the manual has it.
    #[default]
    Stx,
    /// Without STX, as the vendor's client library sends it by default (hosts 1.1).
    Bare,
}

/// What bytes outside a text mean (option `text.stx`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StxRule {
    /// They begin a text without STX.
    #[default]
    Detect,
    /// They are noise.
    Required,
}

/// Whether a checksum follows ETX (option `text.checksum`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Checksum {
    /// No.
    #[default]
    None,
    /// One byte: the low 8 bits of the sum of all bytes after STX through ETX (FRM-15).
    Sum,
}

/// How texts are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TextOptions {
    /// What bytes outside a text mean.
    pub stx: StxRule,
    /// Whether a checksum follows ETX.
    pub checksum: Checksum,
}

/// One text as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// Its form; the answer takes the same.
    pub framing: Framing,
    /// The bytes between STX and ETX; of an over-long text the first [`MAX_DATA`].
    pub data: Vec<u8>,
    /// What is wrong with it, if anything.
    pub fault: Option<TextFault>,
}

/// What is wrong with a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TextFault {
    /// More than [`MAX_DATA`] data bytes (FRM-03).
    #[error("at most {MAX_DATA} data bytes expected, {length} found")]
    OverLong {
        /// Data bytes found.
        length: usize,
    },
    /// The checksum is wrong (FRM-15).
    #[error("checksum {expected:02X} expected, {found:02X} found")]
    BadSum {
        /// The sum of the bytes.
        expected: u8,
        /// The byte after ETX.
        found: u8,
    },
    /// A text that is cut by length does not end where it should.
    #[error("ETX expected after the announced length, {found:02X} found")]
    NoEtx {
        /// The byte in its place.
        found: u8,
    },
}

/// What the decoder found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Decoded {
    /// A complete text.
    Text(Text),
    /// Bytes that belong to no complete text: noise, an unfinished text that an STX restarted (FRM-04), or
    /// bytes for which there was no room.
    Skipped {
        /// How many.
        bytes: usize,
    },
}

/// Cuts a stream of bytes into texts.
#[derive(Debug, Clone, PartialEq)]
pub struct TextDecoder {
    options: TextOptions,
    input: BytesMut,
}

impl TextDecoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub fn new(options: TextOptions) -> TextDecoder {
        TextDecoder { options, input: BytesMut::new() }
    }

    /// Takes in bytes as they came; how they were cut into segments does not matter (FRM-05).
    pub fn push(&mut self, bytes: &[u8]) {
        self.input.extend_from_slice(bytes);
    }

    /// The next text or gap; none when more bytes are needed.
    #[expect(clippy::should_implement_trait, reason = "not an iterator: more may come after None")]
    pub fn next(&mut self) -> Option<Decoded> {
        None
    }

    /// Whether a text has begun and its end has not come.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        self.buffered() > 0
    }

    /// Forgets everything that is not given out yet; returns the number of bytes dropped.
    pub fn reset(&mut self) -> usize {
        let dropped = self.buffered();
        self.input.clear();
        dropped
    }

    /// The next text has `data_len` data bytes (at most [`MAX_BINARY`]) and is cut by length, not by ETX
    /// (FRM-17): for a host that awaits SF.
    pub fn expect_binary(&mut self, data_len: usize) {
        let _ = data_len;
    }

    /// Bytes held that are not given out yet.
    #[must_use]
    pub fn buffered(&self) -> usize {
        self.input.remaining()
    }
}

/// A text on the wire, to be sent in one write.
#[must_use]
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
