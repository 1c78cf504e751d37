//! Numbers that look drawn and are computed from a seed (splitmix64): the controller has no other randomness, so
//! the same seed gives the same run. What they decide is for those who draw.

/// Millionths in a whole: what a probability is counted in.
pub const MILLION: u32 = 1_000_000;

/// A row of numbers that follows from its seed.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rng(u64);

impl Rng {
    /// The row of this seed and purpose: rows of different purposes do not disturb each other.
    #[must_use]
    pub fn new(seed: u64, purpose: &str) -> Rng {
        let mixed = purpose
            .bytes()
            .fold(seed, |mixed, byte| Rng(mixed ^ u64::from(byte)).draw());
        Rng(mixed)
    }

    /// The next number.
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number from `least` to `most`, both included; `least` when `most` is not above it.
    pub fn between(&mut self, least: u64, most: u64) -> u64 {
        let width = u128::from(most.saturating_sub(least)) + 1;
        let part = (u128::from(self.draw()) * width) >> 64;
        // Below `width`, which fits but for the whole range, and then so does the part.
        least + u64::try_from(part).unwrap_or(0)
    }

    /// A place in a row of `length`; 0 in an empty one.
    pub fn place(&mut self, length: usize) -> usize {
        let last = u64::try_from(length.saturating_sub(1)).unwrap_or(u64::MAX);
        usize::try_from(self.between(0, last)).unwrap_or(0)
    }

    /// Whether something of this probability, in millionths, happens. Certain things draw no number.
    pub fn happens(&mut self, millionths: u32) -> bool {
        millionths >= MILLION || self.between(0, u64::from(MILLION) - 1) < u64::from(millionths)
    }

    /// Puts things into a drawn order.
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            let other = self.place(last + 1);
            things.swap(last, other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn the_same_seed_gives_the_same_row_and_another_purpose_another() {
        let row = |seed, purpose| {
            let mut dice = Rng::new(seed, purpose);
            (0..8).map(|_| dice.draw()).collect::<Vec<_>>()
        };
        assert_eq!(row(7, "a"), row(7, "a"));
        assert_ne!(row(7, "a"), row(8, "a"));
        assert_ne!(row(7, "a"), row(7, "b"));
    }

    #[test]
    fn numbers_keep_to_their_range_and_reach_its_ends() {
        let mut dice = Rng::new(1, "range");
        let drawn: Vec<u64> = (0..200).map(|_| dice.between(3, 6)).collect();
        assert_eq!((drawn.iter().min(), drawn.iter().max()), (Some(&3), Some(&6)));
        assert_eq!(dice.between(5, 5), 5);
        assert_eq!(dice.place(0), 0);
        let hits = (0..10_000).filter(|_| dice.happens(250_000)).count();
        assert!((2_300..2_700).contains(&hits), "{hits}");
        assert!(!dice.happens(0));
        assert!(dice.happens(MILLION));
    }

    #[test]
    fn an_order_loses_nothing() {
        let mut things: Vec<u32> = (0..20).collect();
        Rng::new(4, "order").shuffle(&mut things);
        assert_ne!(things, (0..20).collect::<Vec<_>>());
        things.sort_unstable();
        assert_eq!(things, (0..20).collect::<Vec<_>>());
    }
}
