//! The input and output words of IO: binary, big-endian, 20 words of each direction, four for each group of lines
//! 1-64, 101-164, 201-264, 301-364, 401-464 (ste80722 S27).
//!
//! SF carries the first 16 of them ([`super::sf`]). The controller maps lines to signals.

use super::BodyError;
use super::fields::Field;
use crate::prelude::*;

/// Words of either direction.
pub const WORDS: usize = 20;
/// Length of the file in bytes.
pub const LENGTH: usize = 2 * WORDS * 2;

/// The content of IO; bit 0 of a word is its lowest line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct LineWords {
    /// Input words, in the order of SF.
    pub inputs: [u16; WORDS],
    /// Output words, in the order of SF.
    pub outputs: [u16; WORDS],
}

impl LineWords {
    /// The content of the file, [`LENGTH`] bytes. It may hold any byte, ETX and EOF too, so it has to go in one
    /// text, and its end is its length: no EOF follows it (ste80722 S24).
    pub fn encode(&self) -> Vec<u8> {
        let words = self.inputs.iter().chain(&self.outputs);
        words.flat_map(|word| word.to_be_bytes()).collect()
    }
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

    // clause: S27
    #[test]
    fn words_are_big_endian_and_inputs_come_first() {
        let mut words = LineWords::default();
        (words.inputs[0], words.inputs[19]) = (0x0103, 0x1A02);
        (words.outputs[0], words.outputs[19]) = (0x8001, 0x0D0A);
        let content = words.encode();
        let mut expected = [0u8; 80];
        expected[0..2].copy_from_slice(&[0x01, 0x03]);
        expected[38..40].copy_from_slice(&[0x1A, 0x02]);
        expected[40..42].copy_from_slice(&[0x80, 0x01]);
        expected[78..80].copy_from_slice(&[0x0D, 0x0A]);
        assert_eq!(content, expected);
        assert_eq!(decode_lines(&content), Ok(words));
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
