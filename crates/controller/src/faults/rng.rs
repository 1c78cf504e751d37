//! Pseudo-random numbers (splitmix64). The controller has no other randomness: the same seed gives the same run.
//!
//! `faults` and `variation` each take their own sequence of the seed.

/// Unit of probabilities: a probability of 1 is a million millionths.
pub const MILLION: u32 = 1_000_000;

/// A generator that repeats its sequence for the same seed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rng(u64);

impl Rng {
    /// The generator for this seed and purpose. Generators of different purposes are independent of each other.
    pub fn new(seed: u64, purpose: &str) -> Rng {
        let mix = |mixed, byte| Rng(mixed ^ u64::from(byte)).next_u64();
        Rng(purpose.bytes().fold(seed, mix))
    }

    /// The next number of the sequence.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number from `least` to `most` inclusive; `least` if `most` is smaller.
    pub fn between(&mut self, least: u64, most: u64) -> u64 {
        let width = u128::from(most.saturating_sub(least)) + 1;
        let part = (u128::from(self.next_u64()) * width) >> 64;
        // `part` is below `width`, so it fits: only a `width` of the whole range exceeds 64 bits.
        least + u64::try_from(part).unwrap_or(0)
    }

    /// An index into a sequence of `length`; 0 if it is empty.
    pub fn index(&mut self, length: usize) -> usize {
        let last = u64::try_from(length.saturating_sub(1)).unwrap_or(u64::MAX);
        usize::try_from(self.between(0, last)).unwrap_or(0)
    }

    /// True with this probability, in millionths. A probability of 1 consumes no number.
    pub fn happens(&mut self, millionths: u32) -> bool {
        millionths >= MILLION || self.between(0, u64::from(MILLION) - 1) < u64::from(millionths)
    }

    /// Shuffles a slice (Fisher-Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let other = self.index(last + 1);
            items.swap(last, other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prelude::*;

    #[test]
    fn a_seed_and_purpose_give_their_own_sequence() {
        let sequence = |seed, purpose| {
            let mut rng = Rng::new(seed, purpose);
            (0..8).map(|_| rng.next_u64()).collect::<Vec<_>>()
        };
        assert_eq!(sequence(7, "a"), sequence(7, "a"));
        assert_ne!(sequence(7, "a"), sequence(8, "a"));
        assert_ne!(sequence(7, "a"), sequence(7, "b"));
    }

    #[test]
    fn numbers_keep_to_their_range_and_reach_its_ends() {
        let mut rng = Rng::new(1, "range");
        let drawn: Vec<u64> = (0..200).map(|_| rng.between(3, 6)).collect();
        assert_eq!((drawn.iter().min(), drawn.iter().max()), (Some(&3), Some(&6)));
        assert_eq!(rng.between(5, 5), 5);
        assert_eq!(rng.index(0), 0);
        let hits = (0..10_000).filter(|_| rng.happens(250_000)).count();
        assert!((2_300..2_700).contains(&hits), "{hits}");
        assert!(!rng.happens(0));
        assert!(rng.happens(MILLION));
    }

    #[test]
    fn shuffling_keeps_every_item() {
        let mut things: Vec<u32> = (0..20).collect();
        Rng::new(4, "order").shuffle(&mut things);
        assert_ne!(things, (0..20).collect::<Vec<_>>());
        things.sort_unstable();
        assert_eq!(things, (0..20).collect::<Vec<_>>());
    }
}
