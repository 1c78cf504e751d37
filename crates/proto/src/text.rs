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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Framing {
    /// With STX, as the manual has it.
    #[default]
    Stx,
    /// Without STX, as the vendor's client library sends it by default (hosts 1.1).
    Bare,
}

/// What bytes outside a text mean (option `text.stx`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StxRule {
    /// They begin a text without STX.
    #[default]
    Detect,
    /// They are noise.
    Required,
}

/// Whether a checksum follows ETX (option `text.checksum`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Checksum {
    /// No.
    #[default]
    None,
    /// One byte: the low 8 bits of the sum of all bytes after STX through ETX (FRM-15).
    Sum,
}

/// How texts are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct TextOptions {
    /// What bytes outside a text mean.
    pub stx: StxRule,
    /// Whether a checksum follows ETX.
    pub checksum: Checksum,
}

/// One text as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Text {
    /// Its form; the answer takes the same.
    pub framing: Framing,
    /// The bytes between STX and ETX; of an over-long text the first [`MAX_DATA`].
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    pub data: Vec<u8>,
    /// What is wrong with it, if anything.
    #[cfg_attr(feature = "serde", serde(rename = "fault"))]
    pub error: Option<TextError>,
}

/// What is wrong with a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TextError {
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

/// A text that has begun.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
struct Partial {
    framing: Framing,
    /// The first bytes of the data section, as many as are kept.
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    data: Vec<u8>,
    /// All bytes of the data section so far.
    length: usize,
    sum: u8,
}

impl Partial {
    fn new(framing: Framing) -> Partial {
        Partial {
            framing,
            data: Vec::new(),
            length: 0,
            sum: 0,
        }
    }

    fn add(&mut self, byte: u8, kept: usize) {
        self.length = self.length.saturating_add(1);
        self.sum = self.sum.wrapping_add(byte);
        if self.data.len() < kept {
            self.data.push(byte);
        }
    }

    /// Bytes that came for it, STX included.
    fn wire_len(&self) -> usize {
        self.length
            .saturating_add(usize::from(self.framing == Framing::Stx))
    }

    /// Whether it says OK, NG or SP and nothing else.
    fn is_reply(&self) -> bool {
        matches!(
            self.data.strip_suffix(&[CR]).unwrap_or(&self.data),
            b"OK" | b"NG" | b"SP"
        )
    }

    fn into_text(self) -> Text {
        let over_long = self.length > self.data.len();
        let fault = over_long.then_some(TextError::OverLong { length: self.length });
        Text {
            framing: self.framing,
            data: self.data,
            error: fault,
        }
    }
}

/// Where the decoder stands in the stream.
///
/// ```text
///   Outside --STX, or any byte with Detect--> Inside --ETX--> Outside
///                                                  \--ETX, with checksum--> Sum --one byte--> Outside
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum DecoderState {
    Outside,
    Inside(Partial),
    Sum { text: Text, expected: u8 },
}

/// Cuts a stream of bytes into texts. Bytes wait in it until [`TextDecoder::next`] reads them, so that what is
/// read may depend on the texts before (see [`TextDecoder::expect_binary`]); it holds at most
/// [`MAX_BUFFERED`] bytes and one text.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct TextDecoder {
    options: TextOptions,
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    input: BytesMut,
    #[cfg_attr(feature = "serde", serde(rename = "place"))]
    state: DecoderState,
    /// Bytes read that belong to no text and are not reported yet.
    noise: usize,
    /// Bytes that came when there was no room.
    lost: usize,
    /// Length of the data section of the next text, if it is cut by length.
    binary: Option<usize>,
}

impl TextDecoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub fn new(options: TextOptions) -> TextDecoder {
        TextDecoder {
            options,
            input: BytesMut::new(),
            state: DecoderState::Outside,
            noise: 0,
            lost: 0,
            binary: None,
        }
    }

    /// Takes in bytes as they came; how they were cut into segments does not matter (FRM-05). Bytes for which
    /// there is no room are dropped and reported by [`TextDecoder::next`] in their turn.
    pub fn push(&mut self, bytes: &[u8]) {
        let room = if self.lost > 0 {
            0
        } else {
            MAX_BUFFERED.saturating_sub(self.input.len())
        };
        let (kept, dropped) = bytes.split_at_checked(room).unwrap_or((bytes, &[]));
        self.input.extend_from_slice(kept);
        self.lost = self.lost.saturating_add(dropped.len());
    }

    /// The next text or gap; none when more bytes are needed.
    #[expect(
        clippy::should_implement_trait,
        reason = "not an iterator: more may come after None"
    )]
    pub fn next(&mut self) -> Option<Decoded> {
        while let Some(&byte) = self.input.first() {
            let decoded = match core::mem::replace(&mut self.state, DecoderState::Outside) {
                DecoderState::Outside => self.outside(byte),
                DecoderState::Inside(partial) => self.inside(partial, byte),
                DecoderState::Sum { text, expected } => Some(self.sum(text, expected, byte)),
            };
            if decoded.is_some() {
                return decoded;
            }
        }
        if self.lost > 0 {
            // The text under way has a hole: its rest must not be taken for its continuation.
            self.noise = self
                .noise
                .saturating_add(self.lost)
                .saturating_add(self.partial_len());
            self.state = DecoderState::Outside;
            self.lost = 0;
        }
        self.take_skipped()
    }

    /// Whether a text has begun and its end has not come.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        if self.input.is_empty() {
            return self.state != DecoderState::Outside;
        }
        let mut ahead = self.clone();
        while ahead.next().is_some() {}
        ahead.state != DecoderState::Outside
    }

    /// Forgets everything that is not given out yet; returns the number of bytes dropped.
    pub fn reset(&mut self) -> usize {
        let seen = self.noise.saturating_add(self.lost);
        let dropped = seen
            .saturating_add(self.input.len())
            .saturating_add(self.partial_len());
        *self = TextDecoder::new(self.options);
        dropped
    }

    /// The next text has `data_len` data bytes (at most [`MAX_BINARY`]) and is cut by length, not by ETX
    /// (FRM-17): for a host that awaits SF. If OK, NG or SP comes in its place, it is read as ever; after SP,
    /// which is unsolicited, the long text is still awaited.
    pub fn expect_binary(&mut self, data_len: usize) {
        self.binary = Some(data_len.min(MAX_BINARY));
    }

    /// Whether a decoder with these options can come to hold this, for one that was read.
    #[cfg(feature = "serde")]
    #[must_use]
    pub fn is_valid(&self, options: TextOptions) -> bool {
        let kept = match &self.state {
            DecoderState::Outside => true,
            DecoderState::Inside(partial) => partial.data.len() <= partial.length.min(MAX_BINARY),
            DecoderState::Sum { text, .. } => text.data.len() <= MAX_BINARY,
        };
        kept && self.options == options
            && self.input.len() <= MAX_BUFFERED
            && self.binary.is_none_or(|length| length <= MAX_BINARY)
    }

    /// Bytes held that are not given out yet.
    #[must_use]
    pub fn buffered(&self) -> usize {
        let held = match &self.state {
            DecoderState::Outside => 0,
            DecoderState::Inside(partial) => partial.data.len(),
            DecoderState::Sum { text, .. } => text.data.len(),
        };
        self.input.len() + held
    }

    /// Bytes that came for the text under way.
    fn partial_len(&self) -> usize {
        match &self.state {
            DecoderState::Outside => 0,
            DecoderState::Inside(partial) => partial.wire_len(),
            DecoderState::Sum { text, .. } => text.data.len() + 1 + usize::from(text.framing == Framing::Stx),
        }
    }

    /// Reports the noise so far.
    fn take_skipped(&mut self) -> Option<Decoded> {
        let bytes = core::mem::take(&mut self.noise);
        (bytes > 0).then_some(Decoded::Skipped { bytes })
    }

    /// A byte outside a text. An ETX that ends nothing is noise even where texts need no STX.
    fn outside(&mut self, byte: u8) -> Option<Decoded> {
        let noise = byte != STX && (self.options.stx == StxRule::Required || byte == ETX);
        if noise {
            self.noise = self.noise.saturating_add(1);
            self.input.advance(1);
            return None;
        }
        if self.noise > 0 {
            return self.take_skipped();
        }
        if byte == STX {
            self.input.advance(1);
            self.state = DecoderState::Inside(Partial::new(Framing::Stx));
        } else {
            self.state = DecoderState::Inside(Partial::new(Framing::Bare));
        }
        None
    }

    /// A byte of a text under way.
    fn inside(&mut self, mut partial: Partial, byte: u8) -> Option<Decoded> {
        let binary = self.binary.filter(|&length| partial.length <= length);
        match binary {
            Some(length) if partial.length < length && !(byte == ETX && partial.is_reply()) => {
                self.input.advance(1);
                partial.add(byte, length);
                self.state = DecoderState::Inside(partial);
                None
            }
            Some(_) if byte != ETX => {
                self.binary = None;
                let fault = Some(TextError::NoEtx { found: byte });
                Some(Decoded::Text(Text {
                    error: fault,
                    ..partial.into_text()
                }))
            }
            _ if byte == ETX => {
                self.input.advance(1);
                self.end(partial)
            }
            _ if byte == STX => {
                self.noise = self.noise.saturating_add(partial.wire_len());
                None
            }
            _ => {
                self.input.advance(1);
                partial.add(byte, MAX_DATA);
                self.state = DecoderState::Inside(partial);
                None
            }
        }
    }

    /// ETX has come.
    fn end(&mut self, partial: Partial) -> Option<Decoded> {
        let unsolicited = partial.is_reply() && partial.data.starts_with(b"SP");
        if !unsolicited {
            self.binary = None;
        }
        let expected = partial.sum.wrapping_add(ETX);
        let text = partial.into_text();
        match self.options.checksum {
            Checksum::None => Some(Decoded::Text(text)),
            Checksum::Sum => {
                self.state = DecoderState::Sum { text, expected };
                None
            }
        }
    }

    /// The byte after ETX.
    fn sum(&mut self, mut text: Text, expected: u8, found: u8) -> Decoded {
        self.input.advance(1);
        if text.error.is_none() && found != expected {
            text.error = Some(TextError::BadSum { expected, found });
        }
        Decoded::Text(text)
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

#[cfg(test)]
mod tests;
