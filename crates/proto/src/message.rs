//! Messages longer than one text (TRN-07, TRN-08): a text of exactly 253 data bytes without a final CR is a part
//! of a longer message, any other text ends it.
//!
//! FL files are split in another way, see [`crate::file`]. A complete message is read by [`crate::command`].

use crate::prelude::*;
use crate::text::{CR, MAX_DATA};
use bytes::Bytes;

/// Bytes a joined message may have, without its CR. The manual gives no limit; ours keeps memory bounded.
pub const MAX_MESSAGE: usize = 1024;

/// The result of adding one text to the message under way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Joined {
    /// The text is a part of a longer message. Nothing is answered yet (TRN-08).
    Partial,
    /// The message is complete; its CR is removed.
    Complete(Bytes),
    /// The message ended in a short text without CR (FRM-10).
    NoCr(Bytes),
    /// The message has ended and had more than [`MAX_MESSAGE`] bytes; they are dropped.
    TooLong,
}

/// Joins the data sections of texts to messages.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MessageJoiner {
    #[serde(with = "crate::serde_latin1")]
    parts: Vec<u8>,
    too_long: bool,
}

impl MessageJoiner {
    /// Adds the data section of one text. A message of a single text shares its bytes.
    pub fn push(&mut self, data: &Bytes) -> Joined {
        let has_cr = data.last() == Some(&CR);
        let is_part = !has_cr && data.len() == MAX_DATA;
        let body = data.slice(..data.len() - usize::from(has_cr));
        if self.parts.len() + body.len() > MAX_MESSAGE {
            self.parts.clear();
            self.too_long = true;
        } else if !self.too_long && (is_part || !self.parts.is_empty()) {
            self.parts.extend_from_slice(&body);
        }
        if is_part {
            return Joined::Partial;
        }
        let parts = core::mem::take(&mut self.parts);
        let message = if parts.is_empty() { body } else { parts.into() };
        match (core::mem::take(&mut self.too_long), has_cr) {
            (true, _) => Joined::TooLong,
            (false, true) => Joined::Complete(message),
            (false, false) => Joined::NoCr(message),
        }
    }

    /// Whether it holds no more than a message may have; to validate a deserialized one.
    pub fn is_valid(&self) -> bool {
        self.parts.len() <= MAX_MESSAGE
    }

    /// Discards the parts received so far.
    pub fn reset(&mut self) {
        *self = MessageJoiner::default();
    }

    /// Whether a message has begun and is not complete.
    pub fn is_partial(&self) -> bool {
        self.too_long || !self.parts.is_empty()
    }
}

/// Cuts a message (without CR) into the data sections of its texts; a CR ends the last one. The host's side
/// of TRN-07.
pub fn split_message(message: &[u8]) -> Vec<Vec<u8>> {
    let mut whole = message.to_vec();
    whole.push(CR);
    whole.chunks(MAX_DATA).map(<[u8]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn push(joiner: &mut MessageJoiner, data: &[u8]) -> Joined {
        joiner.push(&Bytes::copy_from_slice(data))
    }

    // clause: TRN-07 TRN-08
    #[test]
    fn full_texts_without_cr_are_parts() {
        let message = [b"DO,".as_slice(), &[b'A'; 300]].concat();
        let mut joiner = MessageJoiner::default();
        let texts = split_message(&message);
        assert_eq!(texts.iter().map(Vec::len).collect::<Vec<_>>(), [253, 51]);
        assert_eq!(push(&mut joiner, &texts[0]), Joined::Partial);
        assert!(joiner.is_partial());
        assert_eq!(push(&mut joiner, &texts[1]), Joined::Complete(message.into()));
        assert!(!joiner.is_partial());
    }

    #[test]
    fn a_joiner_that_holds_more_than_a_message_is_not_valid() {
        for (held, valid) in [(0, true), (MAX_MESSAGE, true), (MAX_MESSAGE + 1, false)] {
            let joiner = MessageJoiner {
                parts: vec![b'A'; held],
                too_long: false,
            };
            assert_eq!(joiner.is_valid(), valid, "{held}");
        }
    }

    // clause: TRN-07
    #[test]
    fn every_length_is_cut_and_joined() {
        for length in 0..=MAX_MESSAGE {
            let message = vec![b'A'; length];
            let texts = split_message(&message);
            let mut joiner = MessageJoiner::default();
            let (last, parts) = texts.split_last().unwrap();
            for part in parts {
                assert_eq!((part.len(), push(&mut joiner, part)), (MAX_DATA, Joined::Partial));
            }
            assert!(last.len() <= MAX_DATA);
            assert_eq!(push(&mut joiner, last), Joined::Complete(message.into()));
        }
    }

    // clause: FRM-10
    #[test]
    fn a_short_text_without_cr_ends_the_message_without_cr() {
        let mut joiner = MessageJoiner::default();
        assert_eq!(push(&mut joiner, b"RN"), Joined::NoCr(b"RN".as_slice().into()));
        assert_eq!(push(&mut joiner, b""), Joined::NoCr(Bytes::new()));
        assert_eq!(
            push(&mut joiner, b"RN\r"),
            Joined::Complete(b"RN".as_slice().into())
        );
        assert_eq!(
            push(&mut joiner, &[b'A'; MAX_DATA - 1]),
            Joined::NoCr(vec![b'A'; MAX_DATA - 1].into())
        );
        assert_eq!(push(&mut joiner, &[b'A'; MAX_DATA]), Joined::Partial);
        assert_eq!(
            push(&mut joiner, b"B"),
            Joined::NoCr([vec![b'A'; MAX_DATA], vec![b'B']].concat().into())
        );
    }

    #[test]
    fn too_long_a_message_is_dropped_to_its_end_and_the_next_is_read() {
        let mut joiner = MessageJoiner::default();
        for _ in 0..100 {
            assert_eq!(push(&mut joiner, &[b'A'; MAX_DATA]), Joined::Partial);
            assert!(joiner.is_partial() && joiner.parts.len() <= MAX_MESSAGE);
        }
        assert_eq!(push(&mut joiner, b"end\r"), Joined::TooLong);
        assert_eq!(
            push(&mut joiner, b"SU\r"),
            Joined::Complete(b"SU".as_slice().into())
        );
        assert_eq!(push(&mut joiner, &[b'A'; 2 * MAX_MESSAGE]), Joined::TooLong);
    }

    #[test]
    fn a_reset_forgets() {
        let mut joiner = MessageJoiner::default();
        push(&mut joiner, &[b'A'; MAX_DATA]);
        joiner.reset();
        assert_eq!(
            push(&mut joiner, b"SU\r"),
            Joined::Complete(b"SU".as_slice().into())
        );
    }
}
