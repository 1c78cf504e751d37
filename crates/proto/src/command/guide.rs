//! Where the arm is and how it is guided (hosts 2): PR, the position of a kind; ZS, the work or the tool coordinate system,
//! `ZS,<1|2> <name> <values>`; JG, one axis, `JG,<axis> <+|-|!>`; MP, to a position, `MP,<0|1> <position>`.
//!
//! The controller knows whether a variable exists and which form of values its arm takes. How far, how fast and in which
//! coordinates JG guides is set by MD, RT and SC before, which carry one number each as SM, IO and VL do.

use crate::codes::codes;
use crate::command::number::number;
use crate::command::operand::{Operands, list, separator, whole};
use crate::command::variable::variable;
use crate::command::{Command, CommandError, Number};
use crate::prelude::*;
use core::ops::RangeInclusive;
use nom::Parser;
use nom::character::complete::{anychar, one_of, space1};
use nom::combinator::{map_opt, rest, verify};
use nom::error::context;

codes! {
    /// Which position PR asks for.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum PositionQuery {
        /// 0: the joints as commanded.
        CommandJoint = 0,
        /// 1: world coordinates as commanded.
        CommandWorld = 1,
        /// 2: work coordinates as commanded.
        CommandWork = 2,
        /// 3: the joints as measured.
        FeedbackJoint = 3,
        /// 4: world coordinates as measured.
        FeedbackWorld = 4,
        /// 5: work coordinates as measured.
        FeedbackWork = 5,
    }
    /// The number on the wire, 0 to 5.
    fn code -> u8;
    /// The query with this number.
    fn from_code;
}

/// The number of a kind of position.
pub(super) fn pr(operands: Operands<'_>) -> Result<Command, CommandError> {
    const EXPECTED: &str = "a number from 0 to 5";
    let query = map_opt(whole(EXPECTED, 0..=u8::MAX), PositionQuery::from_code);
    operands.parse(EXPECTED, query).map(Command::Pr)
}

/// Values for a SCARA: X Y Z C.
const SCARA_VALUES: usize = 4;
/// Values for a six-axis arm: X Y Z A B C.
const SIX_AXIS_VALUES: usize = 6;

/// `height position`, one blank or more between them. A position is a name, perhaps of an element, or `POINT(...)`; what MOVE
/// would take besides is not (T27).
pub(super) fn mp(operands: Operands<'_>) -> Result<Command, CommandError> {
    const HEIGHT: &str = "0 (as it is) or 1 (the present height)";
    const POSITION: &str = "the name of a position, or POINT(...)";
    let height = context(HEIGHT, one_of("01"));
    let position = context(POSITION, verify(rest, is_position));
    let (height, _, position) = operands.parse(HEIGHT, (height, context("a blank", space1), position))?;
    Ok(Command::Mp {
        keeps_height: height == '1',
        position: position.trim_end().to_ascii_uppercase(),
    })
}

/// Whether a text is a name, with or without parentheses after it that close at its end.
fn is_position(text: &str) -> bool {
    let text = text.trim_end();
    let name_end = text
        .find(|c: char| !c.is_ascii_alphanumeric())
        .unwrap_or(text.len());
    let (name, arguments) = text.split_at(name_end);
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return false;
    }
    let mut depth = 0_i32;
    let ends = arguments.char_indices().filter_map(|(at, c)| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        (depth <= 0).then_some(at + 1)
    });
    arguments.is_empty() || ends.take(1).eq([arguments.len()])
}

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
    use crate::name::VariableName;

    type Make = fn(u8) -> Command;

    fn position(code: u8) -> Command {
        Command::Pr(PositionQuery::from_code(code).unwrap())
    }

    /// Letters, the numbers allowed, and the command.
    const REQUESTS: [(&str, RangeInclusive<u8>, Make); 7] = [
        ("SM", 1..=1, Command::Sm),
        ("IO", 1..=1, Command::Io),
        ("PR", 0..=5, position),
        ("VL", 0..=1, Command::Vl),
        ("MD", 0..=2, Command::Md),
        ("RT", 0..=2, Command::Rt),
        ("SC", 0..=3, Command::Sc),
    ];

    #[test]
    fn each_number_of_the_range_and_no_other() {
        for (letters, range, make) in REQUESTS {
            for number in 0..=u8::MAX {
                let message = format!("{letters},{number}");
                let read = Command::parse(message.as_bytes());
                if range.contains(&number) {
                    assert_eq!(read, Ok(make(number)), "{message}");
                    assert_eq!(make(number).encode(), format!("{message}\r").into_bytes());
                } else {
                    let at = read.map_err(|error| matches!(error, CommandError::Malformed { at: 3, .. }));
                    assert_eq!(at, Err(true), "{message}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_is_malformed_where_it_is() {
        for (letters, ..) in REQUESTS {
            for (rest, position) in [
                ("", 2),
                (" 1", 2),
                ("1", 2),
                (",", 3),
                (",-1", 3),
                (",+1", 3),
                (",X", 3),
                (",256", 3),
                (",4294967297", 3),
                (",1.0", 4),
                (",1,1", 4),
                (",1 1", 4),
                (",1X", 4),
            ] {
                match Command::parse(format!("{letters}{rest}").as_bytes()) {
                    Err(CommandError::Malformed { at, .. }) => assert_eq!(at, position, "{letters}{rest}"),
                    other => panic!("{letters}{rest}: {other:?}"),
                }
            }
        }
    }

    #[test]
    fn position_queries_in_the_order_of_the_vendors_calls() {
        for (code, query) in (0u8..).zip(PositionQuery::ALL) {
            assert_eq!(query.code(), code);
            assert_eq!(PositionQuery::from_code(code), Some(query));
        }
        assert_eq!(PositionQuery::from_code(6), None);
        assert_eq!(
            Command::parse(b"PR,5"),
            Ok(Command::Pr(PositionQuery::FeedbackWork))
        );
    }

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
    fn bad_axes_and_signs_are_malformed_where_they_are_bad() {
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
