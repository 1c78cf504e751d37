//! The current position file of the SCARA edition (S28).
//!
//! PS asks for it (S72). The controller supplies the values.

use super::fields::Field;
use super::{BodyError, ExecutionStatus};
use crate::prelude::*;

/// Axes in each of its groups.
pub const POSITION_AXES: usize = 6;
/// Items in front of the groups: motion status and execution line.
const HEAD: usize = 2;
/// Three groups.
const ITEMS: usize = HEAD + 3 * POSITION_AXES;

/// The items, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CurrentPosition {
    /// Motion status, as in SF.
    pub status: ExecutionStatus,
    /// Execution line.
    pub line: u16,
    /// Joints 1 to 6 as integer parts, degrees or mm.
    pub joints: [i32; POSITION_AXES],
    /// The same again; as measured (assumed: the manual only repeats the group).
    pub measured: [i32; POSITION_AXES],
    /// Motor torques 1 to 6, in percent (assumed).
    pub torques: [i32; POSITION_AXES],
}

impl CurrentPosition {
    /// The content: whole numbers with commas between them, CR at the end (assumed, as the files of its kind have it).
    pub fn encode(&self) -> Vec<u8> {
        let head = [i32::from(self.status.code()), i32::from(self.line)];
        let groups = [self.joints, self.measured, self.torques];
        let items = head.into_iter().chain(groups.into_iter().flatten());
        let items: Vec<String> = items.map(|item| item.to_string()).collect();
        (items.join(",") + "\r").into_bytes()
    }

    /// Reads a content; the CR may be missing.
    ///
    /// # Errors
    /// Not 20 whole numbers, a motion status other than 0 to 3, a line beyond 65535.
    pub fn decode(content: &[u8]) -> Result<CurrentPosition, BodyError> {
        const WHOLE: &str = "a whole number";
        let whole = Field::record("current position", content);
        let fields: Vec<Field<'_>> = whole.split(b',').collect();
        let [status, line, axes @ ..] = fields.as_slice() else {
            return Err(whole.error("20 items"));
        };
        if fields.len() != ITEMS {
            return Err(whole.error("20 items"));
        }
        let mut read = CurrentPosition {
            status: ExecutionStatus::from_code(status.number("a motion status from 0 to 3")?)
                .ok_or_else(|| status.error("a motion status from 0 to 3"))?,
            line: line.number("a line from 0 to 65535")?,
            ..CurrentPosition::default()
        };
        let groups = [&mut read.joints, &mut read.measured, &mut read.torques];
        for (place, field) in groups.into_iter().flatten().zip(axes) {
            let text = field.text(WHOLE)?;
            let digits = text.strip_prefix('-').unwrap_or(text);
            let plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
            let value = plain.then(|| text.parse().ok()).flatten();
            *place = value.ok_or_else(|| field.error(WHOLE))?;
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: CurrentPosition = CurrentPosition {
        status: ExecutionStatus::Running,
        line: 12,
        joints: [-30, 78, 0, -48, 0, 0],
        measured: [-30, 78, 0, -48, 0, 0],
        torques: [100, 25, 0, 3, 0, 0],
    };

    // clause: S28
    #[test]
    fn twenty_items_there_and_back() {
        let content = SAMPLE.encode();
        assert_eq!(
            content,
            b"1,12,-30,78,0,-48,0,0,-30,78,0,-48,0,0,100,25,0,3,0,0\r"
        );
        assert_eq!(content.split(|byte| *byte == b',').count(), 20);
        assert_eq!(CurrentPosition::decode(&content), Ok(SAMPLE));
        assert_eq!(
            CurrentPosition::decode(content.strip_suffix(b"\r").unwrap()),
            Ok(SAMPLE)
        );
    }

    #[test]
    fn what_is_no_current_position_is_refused() {
        let text = String::from_utf8(SAMPLE.encode()).unwrap();
        for (from, to) in [
            ("1,12,", "4,12,"),
            ("1,12,", "x,12,"),
            ("1,12,", "1,65536,"),
            ("1,12,", "1,-1,"),
            ("1,12,", "12,"),
            ("1,12,", "1,12,0,"),
            (",78,", ",7.8,"),
            (",78,", ",,"),
            (",78,", ",-,"),
            (",78,", ",99999999999,"),
        ] {
            let bad = text.replacen(from, to, 1);
            assert!(CurrentPosition::decode(bad.as_bytes()).is_err(), "{to}");
        }
        assert!(CurrentPosition::decode(b"").is_err());
    }
}
