//! Coordinates without the rounding noise of the kinematics, for the documents of the control interface.

use ts3100_proto::command::Number;

/// Coordinates are rounded to this many parts of a millimetre or degree.
const PARTS: f64 = 1e9;

/// A coordinate to the billionth; zero has no minus.
fn rounded(value: f64) -> f64 {
    let rounded = (value * PARTS).round() / PARTS;
    // The sum with zero makes -0.0 positive.
    if rounded.is_finite() { rounded + 0.0 } else { value }
}

/// Coordinates to the billionth; zero has no minus.
pub fn without_noise(values: &[f64]) -> Vec<f64> {
    values.iter().copied().map(rounded).collect()
}

/// The numbers of a variable: coordinates to the billionth, a plain number as it is; zero has no minus.
pub fn numbers(values: Vec<Number>) -> Vec<Number> {
    let is_plain = values.len() == 1;
    let shown = |number| match number {
        Number::Integer(_) => number,
        Number::Real(value) if is_plain => Number::Real(value + 0.0),
        Number::Real(value) => Number::Real(rounded(value)),
    };
    values.into_iter().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_the_sign_of_zero_are_gone() {
        let values = [-0.0, -1.27e-14, 408.509, 0.1, -12.000_000_001, f64::MAX];
        let shown: Vec<String> = without_noise(&values[..5]).iter().map(f64::to_string).collect();
        assert_eq!(shown, ["0", "0", "408.509", "0.1", "-12.000000001"]);
        assert_eq!(without_noise(&values)[5], f64::MAX);
    }

    #[test]
    fn a_plain_number_keeps_what_is_small() {
        let small = Number::Real(-1.27e-14);
        assert_eq!(numbers(vec![small]), [small]);
        let position = numbers(vec![small, Number::Integer(11_111)]);
        assert_eq!(position, [Number::Real(0.0), Number::Integer(11_111)]);
    }
}
