//! The input and output words of IO (hosts 2): binary, big-endian. That there are 20 words of each is known;
//! that they are the words of SF (SF-26 to SF-40) and four more of 0 is assumed.

use super::BodyError;
use super::fields::Field;
use alloc::vec::Vec;

/// Words of either direction.
pub const WORDS: usize = 20;
/// Words of either direction that SF has too.
pub const SF_WORDS: usize = 16;
/// Length of the file in bytes.
pub const LENGTH: usize = 2 * WORDS * 2;

/// What IO tells; bit 0 of a word is its lowest line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct LineWords {
    /// Input words, in the order of SF.
    pub inputs: [u16; WORDS],
    /// Output words, in the order of SF.
    pub outputs: [u16; WORDS],
}

/// The content of the file, [`LENGTH`] bytes, from the words of SF. It may hold any byte, ETX and EOF too, so
/// it has to go in one text.
#[must_use]
pub fn encode_lines(inputs: &[u16; SF_WORDS], outputs: &[u16; SF_WORDS]) -> Vec<u8> {
    let mut out = Vec::with_capacity(LENGTH);
    for words in [inputs, outputs] {
        out.extend(words.iter().flat_map(|word| word.to_be_bytes()));
        out.resize(out.len() + (WORDS - SF_WORDS) * 2, 0);
    }
    out
}

/// Reads a content.
///
/// # Errors
/// A content of another length than [`LENGTH`].
pub fn decode_lines(content: &[u8]) -> Result<LineWords, BodyError> {
    if content.len() != LENGTH {
        return Err(Field::whole("IO", content).error("80 bytes"));
    }
    let (pairs, _) = content.as_chunks();
    let mut read = LineWords::default();
    for (word, pair) in read.inputs.iter_mut().chain(&mut read.outputs).zip(pairs) {
        *word = u16::from_be_bytes(*pair);
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_big_endian_and_inputs_come_first() {
        let mut inputs = [0; SF_WORDS];
        let mut outputs = [0; SF_WORDS];
        (inputs[0], inputs[15]) = (0x0103, 0x1A02);
        (outputs[0], outputs[15]) = (0x8001, 0x0D0A);
        let content = encode_lines(&inputs, &outputs);
        assert_eq!(content.len(), 80);
        let mut expected = [0u8; 80];
        expected[0..2].copy_from_slice(&[0x01, 0x03]);
        expected[30..32].copy_from_slice(&[0x1A, 0x02]);
        expected[40..42].copy_from_slice(&[0x80, 0x01]);
        expected[70..72].copy_from_slice(&[0x0D, 0x0A]);
        assert_eq!(content, expected);
        let read = decode_lines(&content).unwrap();
        assert_eq!(read.inputs[..SF_WORDS], inputs);
        assert_eq!(read.outputs[..SF_WORDS], outputs);
        assert_eq!(read.inputs[SF_WORDS..], [0; 4]);
        assert_eq!(read.outputs[SF_WORDS..], [0; 4]);
    }

    #[test]
    fn every_word_reads_back_from_its_place() {
        for place in 0..2 * WORDS {
            let mut content = [0u8; LENGTH];
            content[2 * place + 1] = 1;
            let read = decode_lines(&content).unwrap();
            let all = [read.inputs, read.outputs].concat();
            let set: Vec<usize> = (0..all.len()).filter(|at| all[*at] == 1).collect();
            assert_eq!(set, [place]);
        }
    }

    #[test]
    fn other_lengths_are_refused() {
        for length in (0..LENGTH).chain([LENGTH + 1, LENGTH + 2]) {
            assert!(decode_lines(&alloc::vec![0; length]).is_err(), "{length}");
        }
    }
}
