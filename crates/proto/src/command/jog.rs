//! JG: guides one axis, `JG,<axis> <+|-|!>` (hosts 2).
//!
//! How far, how fast and in which coordinates is set by MD, RT and SC before, see `request.rs`.

use crate::codes::codes;
use crate::command::operand::{Operands, separator, whole};
use crate::command::{Command, CommandError};
use core::ops::RangeInclusive;
use nom::character::complete::anychar;
use nom::combinator::map_opt;
use nom::error::context;

/// The axes that SF has room for (SF-42).
const AXES: RangeInclusive<u8> = 1..=8;

codes! {
    /// The direction of JG.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum JogDirection {
        /// `+`: towards larger values.
        Plus = '+',
        /// `-`: towards smaller values.
        Minus = '-',
        /// `!`: stops the motion.
        Stop = '!',
    }
    /// The character on the wire.
    fn sign -> char;
    /// The direction of this character.
    fn from_sign;
}

/// The grammar `axis sign`.
pub(super) fn jg(operands: Operands<'_>) -> Result<Command, CommandError> {
    const AXIS: &str = "an axis from 1 to 8";
    let motion = context("+, - or !", map_opt(anychar, JogDirection::from_sign));
    operands
        .parse(AXIS, (whole(AXIS, AXES), separator, motion))
        .map(|(axis, (), motion)| Command::Jg { axis, motion })
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;

    #[test]
    fn every_axis_and_sign() {
        for axis in AXES {
            for motion in JogDirection::ALL {
                let message = format!("JG,{axis} {}", motion.sign());
                let command = Command::Jg { axis, motion };
                assert_eq!(Command::parse(message.as_bytes()).as_ref(), Ok(&command));
                assert_eq!(command.encode(), format!("{message}\r").into_bytes());
            }
        }
        assert_eq!(JogDirection::from_sign('!'), Some(JogDirection::Stop));
    }

    #[test]
    fn bad_operands_are_malformed_where_they_are_bad() {
        for (message, position) in [
            ("JG", 2),
            ("JG,", 3),
            ("JG,0 +", 3),
            ("JG,9 +", 3),
            ("JG,1", 4),
            ("JG,1+", 4),
            ("JG,1 ", 5),
            ("JG,1 *", 5),
            ("JG,1 +-", 6),
            ("JG,1 + 1", 6),
            ("JG,+ 1", 3),
        ] {
            match Command::parse(message.as_bytes()) {
                Err(CommandError::Malformed {
                    letters: "JG", at, ..
                }) => assert_eq!(at, position, "{message}"),
                other => panic!("{message}: {other:?}"),
            }
        }
    }
}
