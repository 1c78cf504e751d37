//! Numbers as commands and variable data carry them: 32-bit integers and finite reals.
//!
//! Operands use the grammar below, [`crate::status::mr`] the type.

use crate::command::operand::{ParseResult, number_token};
use crate::prelude::*;
use core::fmt;
use nom::Parser;
use nom::combinator::map_opt;
use nom::error::context;

/// Decimals a real is written with at least, as the vendor's client library does (hosts 2).
const DECIMALS: usize = 3;

/// A number of a command or of variable data; in JSON too one is whole without a decimal point, real with one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Number {
    /// Written without a decimal point or exponent, and within 32 bits.
    Integer(i32),
    /// Any other number; always finite.
    Real(f64),
}

impl Number {
    /// Reads a number: sign, digits, decimal point, exponent as usual; nothing else around it. Whole numbers beyond 32
    /// bits become reals; a number beyond a double is refused.
    pub fn parse(text: &str) -> Option<Number> {
        // The standard library reads words such as "inf" too.
        let known = |byte: u8| byte.is_ascii_digit() || b"+-.eE".contains(&byte);
        if !text.bytes().all(known) {
            return None;
        }
        if let Ok(value) = text.parse() {
            return Some(Number::Integer(value));
        }
        let real = text.parse().ok().filter(|value: &f64| value.is_finite());
        real.map(Number::Real)
    }

    /// The value as a double.
    pub fn as_f64(self) -> f64 {
        match self {
            Number::Integer(value) => f64::from(value),
            Number::Real(value) => value,
        }
    }
}

impl fmt::Display for Number {
    /// Reals have at least three decimals, and as many as it takes to read the same value back.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number::Integer(value) => write!(f, "{value}"),
            Number::Real(value) => {
                let shortest = format!("{value}");
                let decimals = shortest.split_once('.').map_or(0, |(_, decimals)| decimals.len());
                if decimals < DECIMALS {
                    write!(f, "{value:.DECIMALS$}")
                } else {
                    f.write_str(&shortest)
                }
            }
        }
    }
}

/// Operands in canonical form, with these numbers as further ones.
pub(super) fn with_numbers(operands: String, numbers: impl IntoIterator<Item = Number>) -> String {
    let numbers = numbers.into_iter().map(|number| format!(" {number}"));
    numbers.fold(operands, |operands, number| operands + &number)
}

/// The grammar of a number among operands.
pub(super) fn number(input: &str) -> ParseResult<'_, Number> {
    context("a number", map_opt(number_token, Number::parse)).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn integers_and_reals_are_told_apart() {
        assert_eq!(Number::parse("42"), Some(Number::Integer(42)));
        assert_eq!(Number::parse("-7"), Some(Number::Integer(-7)));
        assert_eq!(Number::parse("+7"), Some(Number::Integer(7)));
        assert_eq!(Number::parse("42.000"), Some(Number::Real(42.0)));
        assert_eq!(Number::parse("-.5"), Some(Number::Real(-0.5)));
        assert_eq!(Number::parse("1E3"), Some(Number::Real(1000.0)));
        assert_eq!(Number::parse("2147483647"), Some(Number::Integer(i32::MAX)));
        assert_eq!(Number::parse("2147483648"), Some(Number::Real(2_147_483_648.0)));
    }

    #[test]
    fn what_is_no_number_is_none() {
        for text in [
            "", "-", ".", "e", "1e", "inf", "nan", "1e999", "1,5", " 1", "0x1", "1_0", "--1", "1.2.3",
        ] {
            assert_eq!(Number::parse(text), None, "{text}");
        }
    }

    #[test]
    fn reals_have_three_decimals_and_lose_nothing() {
        assert_eq!(Number::Real(1.5).to_string(), "1.500");
        assert_eq!(Number::Real(-2.25).to_string(), "-2.250");
        assert_eq!(Number::Real(3.0).to_string(), "3.000");
        assert_eq!(Number::Integer(3).to_string(), "3");
        for value in [
            0.1,
            -1.0 / 3.0,
            1.0e-9,
            123_456_789.123_456,
            f64::MAX,
            f64::MIN_POSITIVE,
            -0.0,
        ] {
            assert_eq!(
                Number::parse(&Number::Real(value).to_string()),
                Some(Number::Real(value))
            );
        }
    }
}
