//! Words of small sets of values, as files, requests and command lines have them: `on` and `off`, `teaching`, `ether`.
//!
//! A type says its words once, by [`Word`]. Readers and writers of all forms use them.

use alloc::borrow::Cow;
use alloc::string::{String, ToString};

/// A value of a small set, each with a word.
pub trait Word: Copy + 'static {
    /// All values.
    const ALL: &'static [Self];

    /// The word of this value.
    fn word(self) -> &'static str;

    /// The value of a word.
    #[must_use]
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.word() == word)
    }
}

impl Word for bool {
    const ALL: &'static [bool] = &[true, false];

    fn word(self) -> &'static str {
        if self { "on" } else { "off" }
    }
}

/// A word where another was expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found `{found}`")]
pub struct UnexpectedWord {
    expected: Cow<'static, str>,
    found: String,
}

impl UnexpectedWord {
    /// This was expected, and that was found.
    #[must_use]
    pub fn new(expected: impl Into<Cow<'static, str>>, found: &str) -> UnexpectedWord {
        UnexpectedWord {
            expected: expected.into(),
            found: found.to_string(),
        }
    }
}

/// Units of durations and their microseconds.
const UNITS: [(&str, u32); 4] = [("us", 1), ("ms", 1_000), ("min", 60_000_000), ("s", 1_000_000)];

/// Splits a duration such as `250ms` into its number and the microseconds of its unit.
///
/// Which numbers and which of the units `us`, `ms`, `s` and `min` a place accepts is its own.
#[must_use]
pub fn split_duration<'a>(text: &'a str, accepted: &[&str]) -> Option<(&'a str, u32)> {
    let mut units = UNITS.into_iter();
    let (number, unit, micros) =
        units.find_map(|(unit, micros)| Some((text.strip_suffix(unit)?, unit, micros)))?;
    accepted.contains(&unit).then_some((number, micros))
}
