//! Cuts a stream of bytes into texts in bounded memory, and resynchronizes after noise (FRM-01 to FRM-05, FRM-15 to
//! FRM-17).
//!
//! Start at [`TextDecoder::next_as`]. A text and its options are in [`super`]; which reading the controller asks for is
//! decided in its session.

use super::{
    CR, Checksum, ETX, EndRule, Framing, LF, MAX_BINARY, MAX_BUFFERED, MAX_DATA, Reading, STX, StxRule,
    Terminator, Text, TextError, TextOptions,
};
use bytes::{Buf, BytesMut};
use serde::{Deserialize, Serialize};

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
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Partial {
    framing: Framing,
    /// The first bytes of the data section, at most the limit given to `take`.
    #[serde(with = "crate::serde_latin1")]
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

    /// Whether it is a text of a file, so that a CR in it is data.
    fn is_file(&self) -> bool {
        let start = self.data.get(..3).unwrap_or_default();
        start.eq_ignore_ascii_case(b"FL,")
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
            terminator: Terminator::Etx,
            error: over_long.then_some(TextError::OverLong { length: self.length }),
        }
    }
}

/// The state of the decoder.
///
/// ```text
///   Outside --STX, or any byte with Detect--> Inside --ETX--> Outside
///           ^                                     |\--ETX, with checksum--> Sum --one byte--> Outside
///           |                                      \--CR that may end it--> AfterCr --any byte, or none--> Outside
///           \--STX, ETX, or CR that ends a text-- Rest <--given up-- Inside
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
enum DecoderState {
    #[default]
    Outside,
    Inside(Partial),
    /// A CR came last: the end of the text, unless ETX follows.
    AfterCr(Partial),
    Sum {
        text: Text,
        expected: u8,
    },
    /// The text was given up; its rest may still come (T22).
    Rest,
    /// Of that text only the checksum may still come.
    RestOfSum,
}

impl DecoderState {
    /// Whether a text has begun and is not complete.
    fn is_partial(&self) -> bool {
        match self {
            DecoderState::Inside(_) | DecoderState::AfterCr(_) | DecoderState::Sum { .. } => true,
            DecoderState::Outside | DecoderState::Rest | DecoderState::RestOfSum => false,
        }
    }
}

/// Cuts a stream of bytes into texts. Pushed bytes are buffered until [`TextDecoder::next`] reads them, so that
/// the caller can change how the next text is read ([`TextDecoder::expect_binary`]) after it has seen the last one.
/// It holds at most [`MAX_BUFFERED`] bytes and one text.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextDecoder {
    options: TextOptions,
    #[serde(with = "crate::serde_latin1")]
    input: BytesMut,
    state: DecoderState,
    /// Bytes read that belong to no text, not yet reported as [`Decoded::Skipped`].
    noise: usize,
    /// Bytes dropped because the buffer was full, not yet reported.
    lost: usize,
    /// Length of the data section of the next text, if it is delimited by length.
    binary: Option<usize>,
    /// End of the texts of this connection, once `EndRule::Detect` has found it out.
    mark: Option<Terminator>,
    /// A CR has ended the last text, and no byte has come since: an ETX now is the late end of that text.
    after_cr_end: bool,
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

    /// The next text or run of skipped bytes, read as [`Reading::Data`]; `None` when more bytes are needed.
    #[expect(
        clippy::should_implement_trait,
        reason = "not an iterator: more may come after None"
    )]
    pub fn next(&mut self) -> Option<Decoded> {
        self.next_as(Reading::Data)
    }

    /// The next text or run of skipped bytes; `None` when more bytes are needed.
    pub fn next_as(&mut self, reading: Reading) -> Option<Decoded> {
        while let Some(&byte) = self.input.first() {
            let decoded = match core::mem::take(&mut self.state) {
                DecoderState::Outside => self.outside(reading, byte),
                DecoderState::Inside(partial) => self.inside(reading, partial, byte),
                DecoderState::AfterCr(partial) if byte == ETX => {
                    self.input.advance(1);
                    self.end(partial)
                }
                DecoderState::AfterCr(partial) => Some(self.end_by_cr(partial)),
                DecoderState::Sum { text, expected } => Some(self.sum(text, expected, byte)),
                DecoderState::Rest => self.rest(),
                DecoderState::RestOfSum => self.rest_of_sum(byte),
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

    /// Whether a text has begun and is not complete, after all buffered bytes, read as [`Reading::Data`].
    pub fn is_partial(&self) -> bool {
        self.is_partial_as(Reading::Data)
    }

    /// Whether a text has begun and is not complete, after all buffered bytes.
    pub fn is_partial_as(&self, reading: Reading) -> bool {
        if self.input.is_empty() {
            return self.state.is_partial();
        }
        let mut ahead = self.clone();
        while ahead.next_as(reading).is_some() {}
        ahead.state.is_partial()
    }

    /// Whether the text under way is complete unless ETX follows.
    pub fn awaits_etx(&self) -> bool {
        self.input.is_empty() && matches!(self.state, DecoderState::AfterCr(_))
    }

    /// The text under way, if it is complete unless ETX follows: the CR has ended it.
    pub fn end_at_cr(&mut self) -> Option<Decoded> {
        match core::mem::take(&mut self.state) {
            DecoderState::AfterCr(partial) => Some(self.end_by_cr(partial)),
            state @ (DecoderState::Outside
            | DecoderState::Inside(_)
            | DecoderState::Sum { .. }
            | DecoderState::Rest
            | DecoderState::RestOfSum) => {
                self.state = state;
                None
            }
        }
    }

    /// End of the texts of this connection, if [`EndRule::Detect`] has found it out.
    pub fn mark(&self) -> Option<Terminator> {
        self.mark
    }

    /// The same decoder on a connection that was marked before.
    #[must_use]
    pub fn with_mark(mut self, mark: Option<Terminator>) -> TextDecoder {
        self.mark = mark.filter(|_| self.options.end == EndRule::Detect);
        self
    }

    /// Discards everything that `next` has not returned; returns the number of bytes discarded. The rest of a text that
    /// was under way is skipped when it comes: up to STX, through ETX, and through CR where a CR ends texts.
    pub fn give_up(&mut self) -> usize {
        let seen = self.noise.saturating_add(self.lost);
        let unread = self.input.len().saturating_add(self.partial_len());
        let dropped = seen.saturating_add(unread);
        let state = match self.state {
            DecoderState::Outside => DecoderState::Outside,
            DecoderState::Inside(_) | DecoderState::AfterCr(_) | DecoderState::Rest => DecoderState::Rest,
            DecoderState::Sum { .. } | DecoderState::RestOfSum => DecoderState::RestOfSum,
        };
        *self = TextDecoder {
            state,
            ..TextDecoder::new(self.options).with_mark(self.mark)
        };
        dropped
    }

    /// The next text has `data_len` data bytes (at most [`MAX_BINARY`]) and is delimited by length, not by ETX
    /// (FRM-17): for a host that waits for SF. If OK, NG or SP arrives instead, it is read as usual. SP is
    /// unsolicited, so the long text is still expected after it.
    pub fn expect_binary(&mut self, data_len: usize) {
        self.binary = Some(data_len.min(MAX_BINARY));
    }

    /// Whether a decoder with these options can reach this state; to validate a deserialized one.
    pub fn is_valid(&self, options: TextOptions) -> bool {
        let most = match &self.state {
            DecoderState::Inside(partial) | DecoderState::AfterCr(partial) => partial.length.min(MAX_BINARY),
            DecoderState::Outside
            | DecoderState::Sum { .. }
            | DecoderState::Rest
            | DecoderState::RestOfSum => MAX_BINARY,
        };
        let waits = match &self.state {
            DecoderState::AfterCr(partial) => {
                self.may_end_by_cr(Reading::Command, partial) && !self.ends_by_cr()
            }
            DecoderState::Outside
            | DecoderState::Inside(_)
            | DecoderState::Sum { .. }
            | DecoderState::Rest
            | DecoderState::RestOfSum => true,
        };
        self.held() <= most
            && waits
            && (self.mark.is_none() || options.end == EndRule::Detect)
            && (!self.after_cr_end || options.end != EndRule::Etx)
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
            DecoderState::Outside | DecoderState::Rest | DecoderState::RestOfSum => 0,
            DecoderState::Inside(partial) | DecoderState::AfterCr(partial) => partial.data.len(),
            DecoderState::Sum { text, .. } => text.data.len(),
        }
    }

    /// Bytes received for the text under way.
    fn partial_len(&self) -> usize {
        match &self.state {
            DecoderState::Outside | DecoderState::Rest | DecoderState::RestOfSum => 0,
            DecoderState::Inside(partial) | DecoderState::AfterCr(partial) => partial.wire_len(),
            DecoderState::Sum { text, .. } => text.data.len() + 1 + usize::from(text.framing == Framing::Stx),
        }
    }

    /// The noise so far as a result, if there is any.
    fn take_skipped(&mut self) -> Option<Decoded> {
        let bytes = core::mem::take(&mut self.noise);
        (bytes > 0).then_some(Decoded::Skipped { bytes })
    }

    /// Whether a CR ends a text at once.
    fn ends_by_cr(&self) -> bool {
        let rule = match self.options.end {
            EndRule::Etx => false,
            EndRule::Cr => true,
            EndRule::Detect => self.mark == Some(Terminator::Cr),
        };
        // A checksum needs an ETX before it.
        rule && self.options.checksum == Checksum::None
    }

    /// Whether a CR may end this text: at once, or unless ETX follows.
    fn may_end_by_cr(&self, reading: Reading, partial: &Partial) -> bool {
        let detects = self.options.end == EndRule::Detect
            && self.mark.is_none()
            && self.options.checksum == Checksum::None;
        let of_command = reading == Reading::Command && partial.framing == Framing::Bare;
        of_command && (detects || self.ends_by_cr()) && !partial.is_file()
    }

    /// Ends the text at its CR. An ETX that comes next belongs to it: the guess was wrong, or the host sends both.
    fn end_by_cr(&mut self, partial: Partial) -> Decoded {
        if self.options.end == EndRule::Detect {
            self.mark = Some(Terminator::Cr);
        }
        self.after_cr_end = true;
        Decoded::Text(Text {
            terminator: Terminator::Cr,
            ..partial.into_text()
        })
    }

    /// The rest of a text that was given up.
    fn rest(&mut self) -> Option<Decoded> {
        let ends_by_cr = self.ends_by_cr();
        let ends = |byte: &u8| matches!(*byte, STX | ETX) || ends_by_cr && *byte == CR;
        let run = self.input.iter().position(ends).unwrap_or(self.input.len());
        self.input.advance(run);
        self.noise = self.noise.saturating_add(run);
        let Some(&end) = self.input.first() else {
            self.state = DecoderState::Rest;
            return None;
        };
        if end != STX {
            self.input.advance(1);
            self.noise = self.noise.saturating_add(1);
            self.after_cr_end = end == CR;
            if end == ETX && self.options.checksum == Checksum::Sum {
                self.state = DecoderState::RestOfSum;
            }
        }
        None
    }

    /// The checksum of a text that was given up, unless it was lost and the next text begins.
    fn rest_of_sum(&mut self, byte: u8) -> Option<Decoded> {
        if byte != STX {
            self.input.advance(1);
            self.noise = self.noise.saturating_add(1);
        }
        None
    }

    /// A byte outside a text. An ETX that ends nothing is noise even where texts need no STX.
    fn outside(&mut self, reading: Reading, byte: u8) -> Option<Decoded> {
        // No command begins with one of these (T7).
        let filler = reading != Reading::Data
            && self.options.stx == StxRule::Detect
            && matches!(byte, CR | LF | 0 | b' ');
        let late_etx = core::mem::take(&mut self.after_cr_end) && byte == ETX;
        if filler || late_etx {
            self.input.advance(1);
            return None;
        }
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
    fn inside(&mut self, reading: Reading, mut partial: Partial, byte: u8) -> Option<Decoded> {
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
            _ if byte == CR && self.may_end_by_cr(reading, &partial) => {
                partial.take(&mut self.input, 1, MAX_DATA);
                if self.ends_by_cr() {
                    return Some(self.end_by_cr(partial));
                }
                self.state = DecoderState::AfterCr(partial);
                None
            }
            _ => {
                let stops_at_cr = self.may_end_by_cr(reading, &partial);
                let ends = |byte: &u8| matches!(*byte, STX | ETX) || stops_at_cr && *byte == CR;
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
        if self.options.end == EndRule::Detect {
            self.mark.get_or_insert(Terminator::Etx);
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
