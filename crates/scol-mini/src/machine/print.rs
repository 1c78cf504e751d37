//! The bytes of a PRINT: texts as they are, numbers in fields of twelve (PRT-04 to PRT-12).
//!
//! Sending them is left to the caller, who gets them as a request.

use crate::prelude::*;

use crate::value::Number;

/// Width of the field of a number (PRT-04).
const FIELD: usize = 12;

/// The field of a number: right-aligned; integers decimal, reals with exactly three decimals rounded half away from
/// zero; what does not fit is twelve asterisks (PRT-04 to PRT-07, PRT-11, PRT-12).
pub(super) fn field(number: Number) -> String {
    let text = match number {
        Number::Integer(value) => format!("{value}"),
        Number::Real(value) => {
            // A real has 24 significant bits, so thousandths of one that fits the field are exact in a double. What is
            // too large for the cast becomes its largest number, which does not fit either.
            let thousandths = libm::round(libm::fabs(f64::from(value) * 1000.0)) as u64;
            let sign = if value.is_sign_negative() { "-" } else { "" };
            format!("{sign}{}.{:03}", thousandths / 1000, thousandths % 1000)
        }
    };
    if text.len() > FIELD {
        "*".repeat(FIELD)
    } else {
        format!("{text:>FIELD$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: PRT-04 PRT-05 PRT-06 PRT-07 PRT-11 PRT-12
    #[test]
    fn fields_are_twelve_wide() {
        for (number, text) in [
            (Number::Integer(7), "           7"),
            (Number::Integer(1_234_567_890), "  1234567890"),
            (Number::Integer(-5), "          -5"),
            (Number::Integer(i32::MIN), " -2147483648"),
            (Number::Real(1.5), "       1.500"),
            (Number::Real(1234.5), "    1234.500"),
            (Number::Real(-12.25), "     -12.250"),
            (Number::Real(-1000.0 / 3.0), "    -333.333"),
            (Number::Real(2.0 / 3.0), "       0.667"),
            (Number::Real(0.0625), "       0.063"),
            (Number::Real(-0.0625), "      -0.063"),
            (Number::Real(12345.678), "   12345.678"),
            (Number::Real(99_999_990.0), "99999992.000"),
            (Number::Real(1e9), "************"),
            (Number::Real(-99_999_992.0), "************"),
            (Number::Real(f32::MAX), "************"),
        ] {
            assert_eq!(field(number), text);
        }
    }
}
