//! Decodes characters with a parity or framing error as a terminal driver marks them (PARMRK): `FF 00` and the character;
//! a good `FF` is doubled. What the errors cause is decided by the controller.

/// Characters of one kind in what a port delivers, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum CharacterRun {
    /// Good characters.
    Good(Vec<u8>),
    /// Bad ones, as read.
    Bad(Vec<u8>),
}

/// Takes the marks out of a stream, however it is cut: what the last byte was.
#[derive(Debug, Clone, Copy, Default)]
pub(super) enum MarkDecoder {
    /// A whole character, or none yet.
    #[default]
    Plain,
    /// The beginning of a mark, or of a good `FF`.
    Mark,
    /// A mark: a bad character follows.
    Bad,
}

impl MarkDecoder {
    /// Decodes bytes. On a system whose ports mark nothing every byte is good.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<CharacterRun> {
        if !cfg!(unix) {
            return vec![CharacterRun::Good(bytes.to_vec())];
        }
        let mut found = Vec::new();
        for &byte in bytes {
            *self = match (*self, byte) {
                (MarkDecoder::Plain, 0xFF) => MarkDecoder::Mark,
                (MarkDecoder::Mark, 0) => MarkDecoder::Bad,
                (MarkDecoder::Plain | MarkDecoder::Mark, byte) => {
                    put(&mut found, byte, true);
                    MarkDecoder::Plain
                }
                (MarkDecoder::Bad, byte) => {
                    put(&mut found, byte, false);
                    MarkDecoder::Plain
                }
            };
        }
        found
    }
}

fn put(found: &mut Vec<CharacterRun>, byte: u8, good: bool) {
    match (found.last_mut(), good) {
        (Some(CharacterRun::Good(bytes)), true) | (Some(CharacterRun::Bad(bytes)), false) => bytes.push(byte),
        (_, true) => found.push(CharacterRun::Good(vec![byte])),
        (_, false) => found.push(CharacterRun::Bad(vec![byte])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_taken_out_wherever_the_stream_is_cut() {
        let stream = [b'a', 0xFF, 0xFF, 0xFF, 0, b'x', 0xFF, 0, 0xFF, b'b', 0];
        let expected = [
            CharacterRun::Good(vec![b'a', 0xFF]),
            CharacterRun::Bad(vec![b'x', 0xFF]),
            CharacterRun::Good(vec![b'b', 0]),
        ];
        for cut in 0..=stream.len() {
            let mut decoder = MarkDecoder::default();
            let mut found: Vec<CharacterRun> = Vec::new();
            let (first, second) = stream.split_at(cut);
            for part in [decoder.push(first), decoder.push(second)].concat() {
                match (found.last_mut(), part) {
                    (Some(CharacterRun::Good(bytes)), CharacterRun::Good(more))
                    | (Some(CharacterRun::Bad(bytes)), CharacterRun::Bad(more)) => bytes.extend(more),
                    (_, part) => found.push(part),
                }
            }
            assert_eq!(found, expected, "{cut}");
        }
    }
}
