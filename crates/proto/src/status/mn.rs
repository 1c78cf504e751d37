//! The maintenance information of MN (S29): what each axis has done, and how long the controller was in which state.
//!
//! This module writes and reads the file. The controller counts.

use super::BodyError;
use super::fields::Field;
use crate::prelude::*;

/// Axes of an item.
pub const MN_AXES: usize = 6;
/// Numbers of the items that have a value of each axis (S29).
pub const AXIS_ITEMS: [u8; 10] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 17];
/// Numbers of the items that have one value (S29).
pub const INFORMATION_ITEMS: [u8; 7] = [10, 11, 12, 13, 14, 15, 16];

/// The maintenance information. What its numbers stand for is stated only as a list of words: rotation, movement,
/// torque integrals, peak torque, load factors (items 1-9 and 17); total, energising, power-off, motion and fault
/// time, count of servo-off, servo-on time (items 10-16, in this order).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Maintenance {
    /// The values of [`AXIS_ITEMS`], axis 1 first.
    pub axes: [[f64; MN_AXES]; AXIS_ITEMS.len()],
    /// The values of [`INFORMATION_ITEMS`].
    pub information: [f64; INFORMATION_ITEMS.len()],
}

impl Maintenance {
    /// The content of the file: a record each item in the order of their numbers, its number and its values with one
    /// decimal, commas between them (S29), CR at the end of each (assumed).
    pub fn encode(&self) -> Vec<u8> {
        let mut items = *self;
        let mut records: Vec<(u8, &mut [f64])> = items.places().collect();
        records.sort_unstable_by_key(|(number, _)| *number);
        let mut content = String::new();
        for (number, values) in records {
            let values: String = values.iter().map(|value| format!(",{value:.1}")).collect();
            content += &format!("{number}{values}\r");
        }
        content.into_bytes()
    }

    /// Reads a content; the items may come in any order.
    ///
    /// # Errors
    /// An item that is not known, twice or missing, or that has not as many values as it should.
    pub fn decode(content: &[u8]) -> Result<Maintenance, BodyError> {
        let whole = Field::whole("MN", content);
        let mut read = Maintenance::default();
        let mut missing: Vec<u8> = AXIS_ITEMS.into_iter().chain(INFORMATION_ITEMS).collect();
        for record in whole.records() {
            let mut fields = record.split(b',');
            let item = fields.next().unwrap_or(record);
            let number = item.number(EXPECTED_ITEM)?;
            let place = missing.iter().position(|known| *known == number);
            missing.remove(place.ok_or_else(|| item.error(EXPECTED_ITEM))?);
            let values = fields.map(value).collect::<Result<Vec<f64>, BodyError>>()?;
            let place = read
                .places()
                .find(|(known, place)| (*known, place.len()) == (number, values.len()));
            let (_, place) = place.ok_or_else(|| record.error("six values, or one from item 10 to 16"))?;
            place.copy_from_slice(&values);
        }
        match missing.first() {
            None => Ok(read),
            Some(_) => Err(whole.error("the items 1 to 17")),
        }
    }

    /// The numbers of the items and their values.
    fn places(&mut self) -> impl Iterator<Item = (u8, &mut [f64])> {
        let axes = self.axes.iter_mut().map(<[f64; MN_AXES]>::as_mut_slice);
        let items = INFORMATION_ITEMS
            .into_iter()
            .zip(self.information.chunks_exact_mut(1));
        AXIS_ITEMS.into_iter().zip(axes).chain(items)
    }
}

const EXPECTED_ITEM: &str = "the number of an item, 1 to 17, each once";

/// Digits, one decimal point, a sign; no exponent, no words.
fn value(field: Field<'_>) -> Result<f64, BodyError> {
    field.decimal(b"-", "a value with a decimal point")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Maintenance {
        let mut sample = Maintenance::default();
        for (item, values) in (1..).zip(&mut sample.axes) {
            for (axis, value) in (1..).zip(values) {
                *value = f64::from(item) * 10.0 + f64::from(axis) / 10.0;
            }
        }
        for (item, value) in (1..).zip(&mut sample.information) {
            *value = f64::from(item) * 1000.5;
        }
        sample
    }

    // clause: S29
    #[test]
    fn the_file_to_the_byte_and_back() {
        let content = sample().encode();
        let text = String::from_utf8(content.clone()).unwrap();
        let lines: Vec<&str> = text.split_terminator('\r').collect();
        assert_eq!(lines.len(), 17);
        assert_eq!(lines[0], "1,10.1,10.2,10.3,10.4,10.5,10.6");
        assert_eq!(lines[8], "9,90.1,90.2,90.3,90.4,90.5,90.6");
        assert_eq!(lines[9], "10,1000.5");
        assert_eq!(lines[15], "16,7003.5");
        assert_eq!(lines[16], "17,100.1,100.2,100.3,100.4,100.5,100.6");
        assert_eq!(Maintenance::decode(&content), Ok(sample()));
    }

    #[test]
    fn what_is_no_maintenance_file_is_refused() {
        let text = String::from_utf8(sample().encode()).unwrap();
        for (from, to) in [
            ("10,1000.5\r", ""),
            ("10,1000.5\r", "10,1000.5\r10,1000.5\r"),
            ("10,1000.5", "18,1000.5"),
            ("10,1000.5", "10,1000.5,1.0"),
            ("10,1000.5", "10"),
            ("10,1000.5", "10,1000"),
            ("10,1000.5", "10,1e3.5"),
            ("10,1000.5", "10,inf"),
            ("1,10.1,", "1,"),
        ] {
            let bad = text.replacen(from, to, 1);
            assert!(Maintenance::decode(bad.as_bytes()).is_err(), "{from} as {to}");
        }
        assert!(Maintenance::decode(b"").is_err());
        for end in 0..text.len() - 1 {
            // A cut inside the last value is a shorter value.
            let read = Maintenance::decode(&text.as_bytes()[..end]);
            assert!(read.is_err() || end > text.len() - 3, "{end}");
        }
    }
}
