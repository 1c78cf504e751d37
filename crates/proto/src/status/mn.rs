//! The maintenance information of MN (S29, S74): what each axis has done, and how long the controller was in which state.
//!
//! One request asks for one item. This module writes and reads its record; the controller counts.

use super::BodyError;
use super::fields::Field;
use crate::prelude::*;

/// Axes of an item.
pub const MN_AXES: usize = 6;
/// The highest number of an item.
pub const MAX_ITEM: u8 = 17;

/// How many values an item has: one for each axis, or one.
pub const fn count_values(item: u8) -> usize {
    match item {
        10..=16 => 1,
        _ => MN_AXES,
    }
}

/// An item of the maintenance information.
#[derive(Debug, Clone, PartialEq)]
pub struct MaintenanceItem {
    /// 1 to [`MAX_ITEM`].
    pub number: u8,
    /// As many as [`count_values`] says, axis 1 first.
    pub values: Vec<f64>,
}

impl MaintenanceItem {
    /// The content of the file: the number and its values with one decimal, commas between them (S29), CR (assumed).
    pub fn encode(&self) -> Vec<u8> {
        let values: String = self.values.iter().map(|value| format!(",{value:.1}")).collect();
        format!("{}{values}\r", self.number).into_bytes()
    }

    /// Reads a content; the CR may be missing.
    ///
    /// # Errors
    /// An item that is not known, or that has not as many values as it should.
    pub fn decode(content: &[u8]) -> Result<MaintenanceItem, BodyError> {
        const EXPECTED: &str = "the number of an item, 1 to 17";
        let record = Field::record("MN", content);
        let mut fields = record.split(b',');
        let item = fields.next().unwrap_or(record);
        let number = item.number(EXPECTED)?;
        if !(1..=MAX_ITEM).contains(&number) {
            return Err(item.error(EXPECTED));
        }
        let values = fields.map(value).collect::<Result<Vec<f64>, BodyError>>()?;
        if values.len() != count_values(number) {
            return Err(record.error("six values, or one from item 10 to 16"));
        }
        Ok(MaintenanceItem { number, values })
    }
}

/// Digits, one decimal point, a sign; no exponent, no words.
fn value(field: Field<'_>) -> Result<f64, BodyError> {
    field.decimal(b"-", "a value with a decimal point")
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    // clause: S29 S74
    #[test]
    fn a_record_to_the_byte_and_back() {
        let axes = MaintenanceItem {
            number: 9,
            values: vec![90.1, 90.2, 0.0, 90.4, 1234.5, 90.66],
        };
        assert_eq!(axes.encode(), b"9,90.1,90.2,0.0,90.4,1234.5,90.7\r");
        let time = MaintenanceItem {
            number: 10,
            values: vec![1000.5],
        };
        assert_eq!(time.encode(), b"10,1000.5\r");
        assert_eq!(MaintenanceItem::decode(b"10,1000.5\r"), Ok(time.clone()));
        assert_eq!(MaintenanceItem::decode(b"10,1000.5"), Ok(time));
        for number in 1..=MAX_ITEM {
            let values = vec![0.5; count_values(number)];
            let item = MaintenanceItem { number, values };
            assert_eq!(MaintenanceItem::decode(&item.encode()), Ok(item));
        }
    }

    #[test]
    fn what_is_no_record_is_refused() {
        for bad in [
            "",
            "10",
            "0,1.0",
            "18,1.0",
            "10,1.0,1.0",
            "10,1000",
            "10,1e3.5",
            "10,inf",
            "1,1.0,1.0,1.0,1.0,1.0",
            "1,1.0,1.0,1.0,1.0,1.0,1.0,1.0",
            "10,1.0\r11,1.0\r",
        ] {
            assert!(MaintenanceItem::decode(bad.as_bytes()).is_err(), "{bad}");
        }
    }
}
