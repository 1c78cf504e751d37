//! The variable read data of MR (MR-01 to MR-05). How many values a variable has is the arm's business.

use super::BodyError;
use super::fields::Field;
use crate::command::Number;
use alloc::vec::Vec;

/// The content of the file: integers as they are, reals with three decimals (a half away from zero),
/// separated by one blank, CR at the end.
#[must_use]
pub fn encode_values(values: &[Number]) -> Vec<u8> {
    let _ = values;
    Vec::new()
}

/// Reads a content: a number with a decimal point is a real, any other an integer.
///
/// # Errors
/// No value at all, a value that is no finite number, an integer beyond 32 bits.
pub fn decode_values(content: &[u8]) -> Result<Vec<Number>, BodyError> {
    Err(Field::whole("MR", content).error("numbers"))
}
