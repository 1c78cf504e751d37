//! SM, IO, PR, VL, MD, RT, SC: extensions that carry one number (hosts 2).
//!
//! The answers are in [`crate::status`]; the controller keeps what MD, RT and SC set.

use crate::codes::codes;
use crate::command::operand::{Operands, whole};
use crate::command::{Command, CommandError};
use nom::combinator::map_opt;

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

pub(super) fn pr(operands: Operands<'_>) -> Result<Command, CommandError> {
    const EXPECTED: &str = "a number from 0 to 5";
    let query = map_opt(whole(EXPECTED, 0..=u8::MAX), PositionQuery::from_code);
    operands.parse(EXPECTED, query).map(Command::Pr)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;
    use core::ops::RangeInclusive;

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
}
