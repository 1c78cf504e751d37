//! The positions of PR and the speeds of VL (hosts 2): numbers separated by commas.
//!
//! The arm decides how many there are. Which position PR asks for is [`crate::command::PositionQuery`].

use super::BodyError;
use super::fields::Field;
use crate::prelude::*;

/// Most values: eight axes. A configuration comes on top.
pub const MAX_VALUES: usize = 8;
/// Largest configuration: five digits.
pub const MAX_CONFIGURATION: i64 = 99_999;

/// The content of PR or VL.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Position {
    /// Coordinates in mm and degrees, or speeds in mm/s and degrees/s.
    pub values: Vec<f64>,
    /// Configuration of the arm: 0, 1 or 2 of a SCARA, five digits of a six-axis arm. Joints have none.
    pub configuration: Option<i64>,
}

/// The content of the file: finite values with three decimals, then the configuration as a whole number;
/// commas between them, no CR at the end.
pub fn encode_position(values: &[f64], configuration: Option<i64>) -> Vec<u8> {
    let mut items: Vec<String> = values.iter().copied().map(three_decimals).collect();
    items.extend(configuration.map(|number| number.to_string()));
    items.join(",").into_bytes()
}

/// A value with three decimals. One that rounds to zero has no minus.
pub fn three_decimals(value: f64) -> String {
    let text = format!("{value:.3}");
    match text.strip_prefix('-') {
        Some(zero @ "0.000") => zero.to_string(),
        _ => text,
    }
}

/// Reads a content; a CR at the end is allowed. A last item without decimal point is the configuration.
///
/// # Errors
/// No value, more than [`MAX_VALUES`], a value without decimal point or that is not a number, a configuration of more
/// than five digits.
pub fn decode_position(content: &[u8]) -> Result<Position, BodyError> {
    const NUMBER: &str = "a value with a decimal point, or a configuration of at most five digits";
    let whole = Field::record("PR", content);
    let mut items: Vec<Field<'_>> = whole.split(b',').collect();
    let configuration = match items.last() {
        Some(last) if items.len() > 1 && !last.bytes().contains(&b'.') => {
            Some(last.at_most(MAX_CONFIGURATION, NUMBER)?)
        }
        _ => None,
    };
    items.truncate(items.len() - usize::from(configuration.is_some()));
    if let Some(surplus) = items.get(MAX_VALUES) {
        return Err(surplus.error("at most eight values and a configuration"));
    }
    // Sign, digits, one decimal point; no exponent, no words.
    let value = |item: Field<'_>| item.decimal(b"+-", "a value with a decimal point");
    Ok(Position {
        values: items.into_iter().map(value).collect::<Result<_, _>>()?,
        configuration,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_to_the_byte() {
        for (values, configuration, content) in [
            (
                &[0.0, -12.5, 30.0, 0.0, 90.0][..],
                None,
                "0.000,-12.500,30.000,0.000,90.000",
            ),
            (
                &[300.0, 100.5, -20.125, 45.0, 0.0, 0.0],
                Some(2),
                "300.000,100.500,-20.125,45.000,0.000,0.000,2",
            ),
            (
                &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0],
                Some(11_211),
                "1.000,2.000,3.000,4.000,5.000,6.000,7.000,8.000,11211",
            ),
        ] {
            assert_eq!(encode_position(values, configuration), content.as_bytes());
            let position = Position {
                values: values.to_vec(),
                configuration,
            };
            assert_eq!(decode_position(content.as_bytes()).as_ref(), Ok(&position));
            assert_eq!(decode_position(format!("{content}\r").as_bytes()), Ok(position));
        }
    }

    #[test]
    fn values_have_three_decimals_and_zero_has_no_minus() {
        for (value, text) in [
            (0.000_4, "0.000"),
            (-0.0, "0.000"),
            (-0.000_4, "0.000"),
            (-0.000_6, "-0.001"),
            (0.000_6, "0.001"),
            (-179.999_9, "-180.000"),
            (1e9 + 0.25, "1000000000.250"),
        ] {
            assert_eq!(encode_position(&[value], None), text.as_bytes());
        }
    }

    #[test]
    fn what_is_no_position_is_refused() {
        for bad in [
            "",
            "\r",
            "1",
            "x",
            "1.0,",
            ",1.0",
            "1.0,,2.0",
            "1,2.0",
            "1.0 2.0",
            "1.0,-1",
            "1.0,100000",
            "1.0,99999999999999999999",
            "1e5.0",
            "inf",
            ".",
            "1.2.3",
            "1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,9.0",
            "1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,9.0,1",
        ] {
            assert!(decode_position(bad.as_bytes()).is_err(), "{bad:?}");
        }
        let error = decode_position(b"1.000,x.5,3.000").unwrap_err();
        assert_eq!((error.at, error.found.as_str()), (6, "`x.5`"));
    }

    #[test]
    fn every_truncation_is_survived() {
        let content = encode_position(&[1.5, -2.25, 3.0], Some(1));
        for end in 0..content.len() {
            if let Ok(read) = decode_position(&content[..end]) {
                let again = encode_position(&read.values, read.configuration);
                assert_eq!(decode_position(&again), Ok(read));
            }
        }
    }
}
