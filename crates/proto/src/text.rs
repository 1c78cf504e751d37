//! Texts, the frames of the protocol: STX, data section, ETX, and a checksum if the option asks for one.
//!
//! [`TextDecoder`] cuts a byte stream into texts in bounded memory and resynchronizes after noise (FRM-01 to FRM-05,
//! FRM-15 to FRM-17); [`encode_text`] writes one. What the data section means is for [`crate::message`],
//! [`crate::command`], [`crate::file`] and [`crate::reply`].

use crate::error_text;
use crate::prelude::*;
use bytes::{Buf, Bytes, BytesMut};

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
/// Unread bytes that a decoder buffers. Beyond that the newest are dropped.
pub const MAX_BUFFERED: usize = 65_536;
/// Data bytes of the longest text that is delimited by length instead of ETX.
pub const MAX_BINARY: usize = 1024;

/// Whether a text begins with STX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Framing {
    /// With STX, as the manual has it.
    #[default]
    Stx,
    /// Without STX, as the vendor's client library sends it by default (hosts 1.1).
    Bare,
}

/// How bytes outside a text are read (option `text.stx`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum StxRule {
    /// Any byte but ETX begins a text without STX.
    #[default]
    Detect,
    /// They are noise until an STX comes.
    Required,
}

/// Whether a checksum follows ETX (option `text.checksum`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Checksum {
    /// No checksum: a text ends with ETX.
    #[default]
    None,
    /// One byte: the low 8 bits of the sum of all bytes after STX through ETX (FRM-15).
    Sum,
}

/// The framing options of a port; both sides must agree on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct TextOptions {
    /// How bytes outside a text are read.
    pub stx: StxRule,
    /// Whether a checksum follows ETX.
    pub checksum: Checksum,
}

/// One text as it was received.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct Text {
    /// Whether it began with STX. The answer is framed the same way.
    pub framing: Framing,
    /// The bytes between STX and ETX. An over-long text keeps only the first [`MAX_DATA`].
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    pub data: Bytes,
    /// What is wrong with it, if anything.
    #[cfg_attr(feature = "serde", serde(rename = "fault"))]
    pub error: Option<TextError>,
}

/// What is wrong with a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum TextError {
    /// More than [`MAX_DATA`] data bytes (FRM-03).
    OverLong {
        /// Data bytes received, those that were not kept included.
        length: usize,
    },
    /// The checksum is wrong (FRM-15).
    BadSum {
        /// The sum computed from the received bytes.
        expected: u8,
        /// The checksum byte that followed ETX.
        found: u8,
    },
    /// A text delimited by length is not followed by ETX.
    NoEtx {
        /// The byte that was received instead of ETX.
        found: u8,
    },
}

error_text! {
    TextError;
    Self::OverLong { length } => "the message has {length} bytes of data; at most {MAX_DATA} are allowed";
    Self::BadSum { expected, found } => "wrong checksum: expected {expected:02X}, found {found:02X}";
    Self::NoEtx { found } => "expected ETX after the announced length, found {found:02X}";
}

/// One result of [`TextDecoder::next`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Decoded {
    /// A complete text.
    Text(Text),
    /// Bytes that belong to no complete text: noise, an unfinished text that an STX restarted (FRM-04), or
    /// bytes for which there was no room.
    Skipped {
        /// Number of bytes skipped.
        bytes: usize,
    },
}

/// A text whose ETX has not been received yet.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
struct Partial {
    framing: Framing,
    /// The first bytes of the data section, at most the limit given to `take`.
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    data: BytesMut,
    /// Bytes of the data section so far, those that were not kept included.
    length: usize,
    sum: u8,
}

impl Partial {
    /// Takes the next `count` bytes of the input. What follows on what it has is not copied.
    fn take(&mut self, input: &mut BytesMut, count: usize, kept: usize) {
        let mut run = input.split_to(count);
        self.length = self.length.saturating_add(count);
        self.sum = run.iter().fold(self.sum, |sum, &byte| sum.wrapping_add(byte));
        run.truncate(kept.saturating_sub(self.data.len()));
        self.data.unsplit(run);
    }

    /// Bytes received for it, STX included.
    fn wire_len(&self) -> usize {
        self.length
            .saturating_add(usize::from(self.framing == Framing::Stx))
    }

    /// Whether its data section is OK, NG or SP and nothing else.
    fn is_reply(&self) -> bool {
        let word = self.data.strip_suffix(&[CR]).unwrap_or(&self.data);
        matches!(word, b"OK" | b"NG" | b"SP")
    }

    fn into_text(self) -> Text {
        let over_long = self.length > self.data.len();
        Text {
            framing: self.framing,
            data: self.data.freeze(),
            error: over_long.then_some(TextError::OverLong { length: self.length }),
        }
    }
}

/// The state of the decoder.
///
/// ```text
///   Outside --STX, or any byte with Detect--> Inside --ETX--> Outside
///                                                  \--ETX, with checksum--> Sum --one byte--> Outside
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
enum DecoderState {
    #[default]
    Outside,
    Inside(Partial),
    Sum {
        text: Text,
        expected: u8,
    },
}

/// Cuts a stream of bytes into texts. Pushed bytes are buffered until [`TextDecoder::next`] reads them, so that
/// the caller can change how the next text is read ([`TextDecoder::expect_binary`]) after it has seen the last one.
/// It holds at most [`MAX_BUFFERED`] bytes and one text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct TextDecoder {
    options: TextOptions,
    #[cfg_attr(feature = "serde", serde(with = "crate::serde_latin1"))]
    input: BytesMut,
    #[cfg_attr(feature = "serde", serde(rename = "place"))]
    state: DecoderState,
    /// Bytes read that belong to no text, not yet reported as [`Decoded::Skipped`].
    noise: usize,
    /// Bytes dropped because the buffer was full, not yet reported.
    lost: usize,
    /// Length of the data section of the next text, if it is delimited by length.
    binary: Option<usize>,
}

impl TextDecoder {
    /// A decoder at the start of a stream.
    pub fn new(options: TextOptions) -> TextDecoder {
        TextDecoder {
            options,
            ..TextDecoder::default()
        }
    }

    /// Appends received bytes; how they were split into segments does not matter (FRM-05). Bytes that do not
    /// fit the buffer are dropped, and [`TextDecoder::next`] reports them in stream order.
    pub fn push(&mut self, bytes: &[u8]) {
        let room = match self.lost {
            0 => MAX_BUFFERED.saturating_sub(self.input.len()),
            _ => 0,
        };
        let (kept, dropped) = bytes.split_at_checked(room).unwrap_or((bytes, &[]));
        self.input.extend_from_slice(kept);
        self.lost = self.lost.saturating_add(dropped.len());
    }

    /// The next text or run of skipped bytes; `None` when more bytes are needed.
    #[expect(
        clippy::should_implement_trait,
        reason = "not an iterator: more may come after None"
    )]
    pub fn next(&mut self) -> Option<Decoded> {
        while let Some(&byte) = self.input.first() {
            let decoded = match core::mem::take(&mut self.state) {
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
            let lost = core::mem::take(&mut self.lost).saturating_add(self.partial_len());
            self.noise = self.noise.saturating_add(lost);
            self.state = DecoderState::Outside;
        }
        self.take_skipped()
    }

    /// Whether a text has begun and is not complete, after all buffered bytes.
    pub fn is_partial(&self) -> bool {
        if self.input.is_empty() {
            return self.state != DecoderState::Outside;
        }
        let mut ahead = self.clone();
        while ahead.next().is_some() {}
        ahead.state != DecoderState::Outside
    }

    /// Discards everything that `next` has not returned; returns the number of bytes discarded.
    pub fn reset(&mut self) -> usize {
        let seen = self.noise.saturating_add(self.lost);
        let unread = self.input.len().saturating_add(self.partial_len());
        let dropped = seen.saturating_add(unread);
        *self = TextDecoder::new(self.options);
        dropped
    }

    /// The next text has `data_len` data bytes (at most [`MAX_BINARY`]) and is delimited by length, not by ETX
    /// (FRM-17): for a host that waits for SF. If OK, NG or SP arrives instead, it is read as usual. SP is
    /// unsolicited, so the long text is still expected after it.
    pub fn expect_binary(&mut self, data_len: usize) {
        self.binary = Some(data_len.min(MAX_BINARY));
    }

    /// Whether a decoder with these options can reach this state; to validate a deserialized one.
    #[cfg(feature = "serde")]
    pub fn is_valid(&self, options: TextOptions) -> bool {
        let most = match &self.state {
            DecoderState::Inside(partial) => partial.length.min(MAX_BINARY),
            DecoderState::Outside | DecoderState::Sum { .. } => MAX_BINARY,
        };
        self.held() <= most
            && self.options == options
            && self.input.len() <= MAX_BUFFERED
            && self.binary.is_none_or(|length| length <= MAX_BINARY)
    }

    /// Bytes held: unread ones and the data of the text under way.
    pub fn buffered(&self) -> usize {
        self.input.len() + self.held()
    }

    /// Bytes held of the data of the text under way.
    fn held(&self) -> usize {
        match &self.state {
            DecoderState::Outside => 0,
            DecoderState::Inside(partial) => partial.data.len(),
            DecoderState::Sum { text, .. } => text.data.len(),
        }
    }

    /// Bytes received for the text under way.
    fn partial_len(&self) -> usize {
        match &self.state {
            DecoderState::Outside => 0,
            DecoderState::Inside(partial) => partial.wire_len(),
            DecoderState::Sum { text, .. } => text.data.len() + 1 + usize::from(text.framing == Framing::Stx),
        }
    }

    /// The noise so far as a result, if there is any.
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
        let framing = if byte == STX { Framing::Stx } else { Framing::Bare };
        self.input.advance(usize::from(byte == STX));
        self.state = DecoderState::Inside(Partial {
            framing,
            ..Partial::default()
        });
        None
    }

    /// A byte of a text under way.
    fn inside(&mut self, mut partial: Partial, byte: u8) -> Option<Decoded> {
        let binary = self.binary.filter(|&length| partial.length <= length);
        match binary {
            Some(length) if partial.length < length && !(byte == ETX && partial.is_reply()) => {
                partial.take(&mut self.input, 1, length);
                self.state = DecoderState::Inside(partial);
                None
            }
            Some(_) if byte != ETX => {
                self.binary = None;
                let mut text = partial.into_text();
                text.error = Some(TextError::NoEtx { found: byte });
                Some(Decoded::Text(text))
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
                let ends = |byte: &u8| matches!(*byte, STX | ETX);
                let run = self.input.iter().position(ends).unwrap_or(self.input.len());
                partial.take(&mut self.input, run, MAX_DATA);
                self.state = DecoderState::Inside(partial);
                None
            }
        }
    }

    /// Ends the text at its ETX. With a checksum option the next byte completes it.
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

    /// Compares the checksum byte after ETX.
    fn sum(&mut self, mut text: Text, expected: u8, found: u8) -> Decoded {
        self.input.advance(1);
        if text.error.is_none() && found != expected {
            text.error = Some(TextError::BadSum { expected, found });
        }
        Decoded::Text(text)
    }
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
