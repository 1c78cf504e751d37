//! The variable data that answers MR (MR-01 to MR-05).
//!
//! The arm decides how many values a variable has. The types of variables are in [`crate::command::VariableKind`].

use super::BodyError;
use super::fields::Field;
use crate::command::Number;
use crate::prelude::*;

/// The content of the file: integers as they are, reals with three decimals (a half away from zero),
/// separated by one blank, CR at the end. Reals are finite.
pub fn encode_values(values: &[Number]) -> Vec<u8> {
    let words: Vec<String> = values
        .iter()
        .map(|value| match value {
            Number::Integer(value) => format!("{value}"),
            Number::Real(value) => three_decimals(*value),
        })
        .collect();
    (words.join(" ") + "\r").into_bytes()
}

/// Reads a content: a number with a decimal point is a real, any other an integer.
///
/// # Errors
/// No value at all, a value that is not a number, an integer beyond 32 bits.
pub fn decode_values(content: &[u8]) -> Result<Vec<Number>, BodyError> {
    let fields = Field::record("MR", content).split(b' ');
    fields.map(decode_value).collect()
}

/// Three decimals as `%.3f`, but a half goes away from zero. Formatting rounds the exact binary value, so
/// only a true half is left to decide: an odd number of sixteenths, so below 2^53 of them.
fn three_decimals(value: f64) -> String {
    const SIXTEENTHS: f64 = 16.0;
    let sixteenths = value.abs() * SIXTEENTHS;
    if sixteenths % 2.0 == 1.0 {
        let sign = if value.is_sign_negative() { "-" } else { "" };
        let thousandths = (sixteenths as u64 * 1_000).div_ceil(16);
        return format!("{sign}{}.{:03}", thousandths / 1_000, thousandths % 1_000);
    }
    format!("{value:.3}")
}

/// Sign, digits, and at most one decimal point; no exponent, no words.
fn decode_value(field: Field<'_>) -> Result<Number, BodyError> {
    let expected = "a number; integers within 32 bits";
    let text = field.text(expected)?;
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    let known = digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let number = match (known, digits.contains('.')) {
        (false, _) => None,
        (true, true) => text.parse().ok().map(Number::Real),
        (true, false) => text.parse().ok().map(Number::Integer),
    };
    let finite = number.filter(|number| number.as_f64().is_finite());
    finite.ok_or_else(|| field.error(expected))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Number::{Integer, Real};

    // clause: MR-01 MR-02 MR-04 MR-05
    #[test]
    fn the_file_to_the_byte() {
        assert_eq!(encode_values(&[Integer(10)]), [0x31, 0x30, 0x0D]);
        assert_eq!(encode_values(&[Integer(i32::MIN)]), b"-2147483648\r");
        assert_eq!(encode_values(&[Real(1.5)]), b"1.500\r");
        let position = [400.0, 0.0, 200.0, -2.25, 0.1, 6.0, 7.0, 8.0, 12111.0].map(Real);
        assert_eq!(
            encode_values(&position),
            b"400.000 0.000 200.000 -2.250 0.100 6.000 7.000 8.000 12111.000\r"
        );
    }

    // clause: MR-02
    #[test]
    fn a_half_goes_away_from_zero() {
        for (value, text) in [
            (0.0625, "0.063"),
            (-0.0625, "-0.063"),
            (0.1875, "0.188"),
            (0.3125, "0.313"),
            (0.9375, "0.938"),
            (-7.5625, "-7.563"),
            (1.125, "1.125"),
            (0.0624, "0.062"),
            (0.9995, "1.000"),
            (1e9 + 0.0625, "1000000000.063"),
            (0.0, "0.000"),
        ] {
            assert_eq!(three_decimals(value), text);
        }
        for odd in (1..4_000).step_by(2) {
            let up = three_decimals(f64::from(odd) / 16.0);
            assert_eq!(
                up.replace('.', "").parse::<i64>().unwrap(),
                (i64::from(odd) * 1_000 + 8) / 16,
                "{odd}"
            );
        }
    }

    #[test]
    fn values_read_back() {
        for values in [
            &[Integer(0)][..],
            &[Integer(i32::MAX), Integer(-1)],
            &[Real(-3.25), Real(0.0), Integer(7)],
        ] {
            assert_eq!(decode_values(&encode_values(values)).unwrap(), values);
        }
        assert_eq!(decode_values(b"42").unwrap(), [Integer(42)]);
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for bad in [
            "",
            "\r",
            "x",
            "1  2",
            " 1",
            "1 ",
            "1.2.3",
            ".",
            "-",
            "+-1",
            "1e5",
            "inf",
            "NaN",
            "2147483648",
            "1,2",
        ] {
            assert!(decode_values(bad.as_bytes()).is_err(), "{bad:?}");
        }
        let error = decode_values(b"1 2.5 x\r").unwrap_err();
        assert_eq!((error.at, error.found.as_str()), (6, "`x`"));
    }
}
