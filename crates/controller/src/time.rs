//! Virtual time: whole microseconds since the controller was created.
//!
//! The emulator decides how virtual time follows the wall clock (real, scaled, stepped, automatic).

use crate::prelude::*;
use core::fmt;
use core::ops::{Add, Sub};
use core::time::Duration;

/// A moment of virtual time, in microseconds since the controller value was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct Time(u64);

/// A duration that a program gives in seconds, clamped to 0 to `longest` and rounded to the nearest microsecond:
/// `0.1` is a real of 32 bits and slightly more than a tenth.
pub fn duration_from_seconds(seconds: f64, longest: f64) -> Duration {
    let micros = libm::round(seconds.clamp(0.0, longest) * 1e6);
    // Not negative, and the cast saturates.
    Duration::from_micros(micros as u64)
}

/// Units of durations and their microseconds. A unit comes before its own suffixes.
const UNITS: [(&str, f64); 4] = [("us", 1.0), ("ms", 1e3), ("s", 1e6), ("min", 60e6)];

/// Text that is not a duration.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot read `{0}` as a duration: expected e.g. `5s`, `500 ms`, `1.5 s`")]
pub struct DurationError(String);

/// Reads a duration with its unit (`us`, `ms`, `s`, `min`), for example `250 ms` or `1.5s`, to the nearest microsecond.
///
/// # Errors
/// No unit, no number, or more than 500,000 years.
pub fn parse_duration(text: &str) -> Result<Duration, DurationError> {
    let error = || DurationError(text.to_string());
    to_duration(text.trim_end()).ok_or_else(error)
}

/// Reads a duration as [`parse_duration`]; a number without a unit has `unit`.
///
/// # Errors
/// As [`parse_duration`].
pub fn parse_duration_in(unit: &str, text: &str) -> Result<Duration, DurationError> {
    if text
        .trim_end()
        .ends_with(|last: char| last.is_ascii_digit() || last == '.')
    {
        let error = |_| DurationError(text.to_string());
        return parse_duration(&format!("{text}{unit}")).map_err(error);
    }
    parse_duration(text)
}

/// A duration in words: `1 microsecond`, `500 ms`, `10 min`, `24 h`.
pub fn duration_in_words(duration: Duration) -> String {
    let micros = duration.as_micros();
    let units = [
        ("h", 3_600_000_000),
        ("min", 60_000_000),
        ("s", 1_000_000),
        ("ms", 1_000),
    ];
    let whole = |(_, size): &(&str, u128)| micros > 0 && micros.is_multiple_of(*size);
    match (units.into_iter().find(whole), micros) {
        (Some((unit, size)), _) => format!("{} {unit}", micros / size),
        (None, 0) => "0 s".to_string(),
        (None, 1) => "1 microsecond".to_string(),
        (None, _) => format!("{micros} microseconds"),
    }
}

fn to_duration(text: &str) -> Option<Duration> {
    let mut units = UNITS.into_iter();
    let (number, micros) = units.find_map(|(unit, micros)| Some((text.strip_suffix(unit)?, micros)))?;
    let number = number.trim_end();
    if number.contains(|letter: char| !letter.is_ascii_digit() && letter != '.') {
        return None;
    }
    let number: f64 = number.parse().ok()?;
    let time = Duration::try_from_secs_f64(number * micros / 1e6).ok()?;
    let micros = (time + Duration::from_nanos(500)).as_micros();
    Some(Duration::from_micros(u64::try_from(micros).ok()?))
}

impl Time {
    /// The moment the controller was made.
    pub const ZERO: Time = Time(0);

    /// The moment `micros` microseconds after [`Time::ZERO`].
    pub const fn from_micros(micros: u64) -> Time {
        Time(micros)
    }

    /// The moment `millis` milliseconds after [`Time::ZERO`].
    pub const fn from_millis(millis: u64) -> Time {
        Time(millis.saturating_mul(1_000))
    }

    /// Microseconds since [`Time::ZERO`].
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// Seconds since [`Time::ZERO`], exact for the first 285 years.
    pub const fn as_seconds(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// The time since `earlier`; zero if `earlier` is later.
    pub const fn since(self, earlier: Time) -> Duration {
        Duration::from_micros(self.0.saturating_sub(earlier.0))
    }
}

impl Add<Duration> for Time {
    type Output = Time;
    fn add(self, rhs: Duration) -> Time {
        // Round up, so that no timer expires early.
        let micros = u64::try_from(rhs.as_nanos().div_ceil(1_000)).unwrap_or(u64::MAX);
        Time(self.0.saturating_add(micros))
    }
}

impl Sub<Duration> for Time {
    type Output = Time;
    fn sub(self, rhs: Duration) -> Time {
        let micros = u64::try_from(rhs.as_micros()).unwrap_or(u64::MAX);
        Time(self.0.saturating_sub(micros))
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06}", self.0 / 1_000_000, self.0 % 1_000_000)
    }
}
