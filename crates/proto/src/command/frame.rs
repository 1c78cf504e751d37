//! ZS: sets the work or the tool coordinate system, `ZS,<1|2> <name> <values>` (hosts 2).
//!
//! The controller knows whether the variable exists and which form of values its arm takes.

use crate::codes::codes;
use crate::command::number::number;
use crate::command::operand::{Operands, list, separator, whole};
use crate::command::variable::variable;
use crate::command::{Command, CommandError, Number};
use crate::name::VariableName;
use crate::prelude::*;
use core::fmt::Write;
use nom::Parser;
use nom::combinator::map_opt;
use nom::error::context;

/// Values for a SCARA: X Y Z C.
const SCARA_VALUES: usize = 4;
/// Values for a six-axis arm: X Y Z A B C.
const SIX_AXIS_VALUES: usize = 6;

codes! {
    /// Which coordinate system ZS sets.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum ZsFrame {
        /// 1: the work coordinate system.
        Work = 1,
        /// 2: the tool coordinate system.
        Tool = 2,
    }
    /// The number on the wire, 1 or 2.
    fn code -> u8;
    /// The coordinate system of this number.
    fn from_code;
}

/// `frame name values`.
pub(super) fn zs(operands: Operands<'_>) -> Result<Command, CommandError> {
    const FRAME: &str = "1 (work) or 2 (tool)";
    let frame = context(FRAME, map_opt(whole("", 0..=u8::MAX), ZsFrame::from_code));
    let values = list(number.map(Number::as_f64));
    let grammar = (frame, separator, variable, separator, values);
    let (frame, (), name, (), values) = operands.parse(FRAME, grammar)?;
    if matches!(values.len(), SCARA_VALUES | SIX_AXIS_VALUES) {
        Ok(Command::Zs { frame, name, values })
    } else {
        let expected = format!("{SCARA_VALUES} or {SIX_AXIS_VALUES} values, not {}", values.len());
        Err(operands.malformed(&expected, 0))
    }
}

/// The operands in canonical form: the values with at least three decimals.
pub(super) fn encode(frame: ZsFrame, name: &VariableName, values: &[f64]) -> String {
    let mut text = format!("{} {name}", frame.code());
    for value in values {
        // Writing to a string cannot fail.
        let _ = write!(text, " {}", Number::Real(*value));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_the_vendors_client() {
        let name = VariableName::parse("WK1").unwrap();
        for (message, frame, values) in [
            (
                "ZS,1 WK1 1.000 2.000 3.000 4.000",
                ZsFrame::Work,
                &[1.0, 2.0, 3.0, 4.0][..],
            ),
            (
                "ZS,2 WK1 1.500 -2.250 3.000 4.000 5.000 6.125",
                ZsFrame::Tool,
                &[1.5, -2.25, 3.0, 4.0, 5.0, 6.125],
            ),
        ] {
            let command = Command::Zs {
                frame,
                name: name.clone(),
                values: values.to_vec(),
            };
            assert_eq!(Command::parse(message.as_bytes()).as_ref(), Ok(&command));
            assert_eq!(command.encode(), format!("{message}\r").into_bytes());
            let plain = message.replace(".000", "").replace(' ', ",").to_ascii_lowercase();
            assert_eq!(Command::parse(plain.as_bytes()), Ok(command), "{plain}");
        }
    }

    #[test]
    fn four_or_six_values() {
        for count in 1..=9 {
            let message = format!("ZS,1 WK1{}", " 1".repeat(count));
            let read = Command::parse(message.as_bytes());
            assert_eq!(read.is_ok(), matches!(count, 4 | 6), "{message}");
        }
    }

    #[test]
    fn bad_operands_are_malformed_where_they_are_bad() {
        for (message, position) in [
            ("ZS", 2),
            ("ZS,", 3),
            ("ZS,0 WK1 1 2 3 4", 3),
            ("ZS,3 WK1 1 2 3 4", 3),
            ("ZS,1", 4),
            ("ZS,1 WK1", 8),
            ("ZS,1 1WK 1 2 3 4", 5),
            ("ZS,1 ABCDEFGHIJK 1 2 3 4", 5),
            ("ZS,1 WK1 1 2 3 X", 15),
            ("ZS,1 WK1 1 2 3 inf", 15),
            ("ZS,1 WK1 1 2 3 1e999", 15),
            ("ZS,1 WK1 1 2 3 4 5", 0),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed {
                    letters: "ZS", at, ..
                }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }
}
