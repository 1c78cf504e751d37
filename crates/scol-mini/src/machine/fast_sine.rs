//! SIN and COS of a real faster than the functions of libm, with the same bits.
//!
//! The value is computed in double precision with a known error. Where that error could change the real to which the value
//! is rounded, the result is `None` and `functions` computes it. Without this a loop of reals runs at 1.8 times the speed
//! of CPython; the target is 2 (`benches/README.md`).

/// Largest angle that is computed here, in degrees.
const MAX_DEGREES: f64 = 3_600.0;

/// Bound of the difference from what `functions` computes: the polynomial is exact to 4e-16, and so is an angle within a
/// quarter turn in radians.
const ERROR: f64 = 4e-14;

/// Added to a number and subtracted again, leaves the number rounded to an integer; the lowest bit of the sum tells odd
/// from even.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// The sine of an angle of -90 to 90 degrees, divided by it, in powers of its square: interpolated at the zeros of
/// the Chebyshev polynomial.
const POWERS: [f64; 8] = [
    0.017453292519943295,
    -8.860961557012664e-07,
    1.3496016231550637e-11,
    -9.78838485352312e-17,
    4.141267024292727e-22,
    -1.1468098117635106e-27,
    2.237851424186793e-33,
    -3.132466742105379e-39,
];

/// The sine of an angle in degrees (a real, or an integer, and perhaps a quarter turn), if its rounding is certain.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "rounded to a real")]
pub(super) fn sine(degrees: f64) -> Option<f32> {
    if !(-MAX_DEGREES..=MAX_DEGREES).contains(&degrees) {
        return None;
    }
    let halves = degrees * (1.0 / 180.0) + ROUNDING;
    // Both exact: the degrees of a real have 24 bits.
    let rest = degrees - (halves - ROUNDING) * 180.0;
    let [a, b, c, d, e, f, g, h] = POWERS;
    let t = rest * rest;
    let (t2, t4) = (t * t, t * t * (t * t));
    let power = ((a + b * t) + (c + d * t) * t2) + ((e + f * t) + (g + h * t) * t2) * t4;
    // The sign goes to the factor that is computed first.
    let turned = f64::from_bits(rest.to_bits() ^ (halves.to_bits() & 1) << 63);
    let value = turned * power;
    let (least, most) = ((value - ERROR) as f32, (value + ERROR) as f32);
    (least == most).then_some(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::functions;

    /// Compares every `step`-th real up to `MAX_DEGREES`, and its negative.
    fn compare(step: usize) -> (u32, u32) {
        let (mut all, mut found) = (0, 0);
        for bits in (0..=(MAX_DEGREES as f32).to_bits()).step_by(step) {
            for degrees in [f32::from_bits(bits), -f32::from_bits(bits)] {
                let angle = f64::from(degrees);
                for (fast, slow) in [
                    (sine(angle), functions::sine(0, angle) as f32),
                    (sine(angle + 90.0), functions::sine(1, angle) as f32),
                ] {
                    all += 1;
                    if let Some(fast) = fast {
                        found += 1;
                        assert_eq!(fast.to_bits(), slow.to_bits(), "of {degrees}");
                    }
                }
            }
        }
        (all, found)
    }

    #[test]
    fn the_bits_are_those_of_the_functions() {
        let (all, found) = compare(10_007);
        assert!(all > 400_000);
        // The sine of an angle close to 0 is left to the function.
        assert!(found > all / 2, "{found} of {all}");
        for degrees in [0.0, 180.0, -360.0, 1e-30, 4_000.0, f64::INFINITY, f64::NAN] {
            assert_eq!(sine(degrees), None, "{degrees}");
        }
        assert_eq!(sine(30.0), Some(0.5));
        assert_eq!(sine(60.0 + 90.0), Some(0.5));
        assert_eq!(sine(180.0 + 90.0), Some(-1.0));
    }

    /// All of them; takes minutes.
    #[test]
    #[ignore = "takes minutes"]
    fn all_bits_are_those_of_the_functions() {
        compare(1);
    }
}
