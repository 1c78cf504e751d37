//! The value of `--vary`: a seed, a randomly drawn seed, or off.
//!
//! The controller's `variation` module decides what varies with the seed.

use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::str::FromStr;
use ts3100_proto::words::UnexpectedWord;

/// Largest drawn seed; six digits are easily typed again.
const LARGEST_DRAWN: u64 = 999_999;

/// The value of `--vary`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seed {
    /// Nothing varies.
    Off,
    /// The seed given.
    Number(u64),
    /// A seed drawn at random when the flag was parsed.
    Drawn(u64),
}

impl Seed {
    /// The seed at an offset from this one.
    #[must_use]
    pub fn after(self, number: u64) -> Seed {
        match self {
            Seed::Off => Seed::Off,
            Seed::Number(seed) => Seed::Number(seed.wrapping_add(number)),
            Seed::Drawn(seed) => Seed::Drawn(seed.wrapping_add(number)),
        }
    }

    /// The seed; `None` if nothing varies.
    pub fn number(self) -> Option<u64> {
        match self {
            Seed::Off => None,
            Seed::Number(seed) | Seed::Drawn(seed) => Some(seed),
        }
    }
}

impl FromStr for Seed {
    type Err = UnexpectedWord;

    fn from_str(text: &str) -> Result<Seed, UnexpectedWord> {
        match text {
            "off" => Ok(Seed::Off),
            // The random keys of std's hasher are the only randomness without another dependency.
            "random" => Ok(Seed::Drawn(
                RandomState::new().hash_one(text) % (LARGEST_DRAWN + 1),
            )),
            number => number
                .parse()
                .map(Seed::Number)
                .map_err(|_| UnexpectedWord::new("a whole number, random or off", text)),
        }
    }
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Seed::Off => f.write_str("off"),
            Seed::Number(seed) | Seed::Drawn(seed) => write!(f, "{seed}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_is_a_number_a_word_or_an_error() {
        assert_eq!("12".parse(), Ok(Seed::Number(12)));
        assert_eq!("off".parse::<Seed>().unwrap().number(), None);
        let drawn: Vec<u64> = (0..8)
            .filter_map(|_| "random".parse::<Seed>().unwrap().number())
            .collect();
        assert!(drawn.iter().all(|seed| *seed <= LARGEST_DRAWN));
        assert!(drawn.iter().any(|seed| *seed != drawn[0]), "{drawn:?}");
        assert_eq!(
            "-1".parse::<Seed>(),
            Err(UnexpectedWord::new("a whole number, random or off", "-1"))
        );
    }
}
