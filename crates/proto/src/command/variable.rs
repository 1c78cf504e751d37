//! MR and MW: reading and writing global variables.
//!
//! The controller knows which variables exist and how many values one takes. The answer of MR is in
//! [`crate::status::mr`].

use crate::codes::codes;
use crate::command::number::{number, with_numbers};
use crate::command::operand::{Operands, ParseResult, list, number_token, separator};
use crate::command::{Command, CommandError, Number};
use crate::name::VariableName;
use crate::prelude::*;
use nom::Parser;
use nom::bytes::complete::take_while1;
use nom::character::complete::{char, one_of};
use nom::combinator::{map_opt, opt, recognize};
use nom::error::context;

/// Values an MW may carry. The manual's longest, a position, has nine.
pub const MAX_VALUES: usize = 16;

/// The operands of MR.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableRead {
    /// The variable or the element.
    pub variable: VariableName,
    /// Its type as the host states it.
    pub kind: VariableKind,
}

/// The operands of MW.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableWrite {
    /// The value is written back to the program file too (CMD-MW-02).
    pub restore: bool,
    /// The variable or the element.
    pub variable: VariableName,
    /// Its type as the host states it.
    pub kind: VariableKind,
    /// The values; how many there must be depends on the type and the arm.
    pub values: Vec<Number>,
}

codes! {
    /// Type code of a variable (CMD-MR-04).
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum VariableKind {
        /// -1: the controller finds the type itself (CMD-MR-05).
        Unclarified = -1,
        /// 0: a 32-bit integer.
        Integer = 0,
        /// 1: a real number.
        Real = 1,
        /// 2: mass, centre of gravity, size.
        Load = 2,
        /// 3: a coordinate system.
        Coordinate = 3,
        /// 4: a position.
        Position = 4,
        /// 5: an element of an array of integers.
        IntegerArray = 5,
        /// 6: an element of an array of reals.
        RealArray = 6,
        /// 7: an element of an array of loads.
        LoadArray = 7,
        /// 8: an element of an array of coordinate systems.
        CoordinateArray = 8,
        /// 9: an element of an array of positions.
        PositionArray = 9,
    }
    /// The code on the wire, -1 to 9.
    fn code -> i32;
    /// The type with this code.
    fn from_code;
}

impl VariableKind {
    /// Whether it is an array type.
    pub fn is_array(self) -> bool {
        self.code() >= VariableKind::IntegerArray.code()
    }
}

/// `name type` (CMD-MR-01).
pub(super) fn mr(operands: Operands<'_>) -> Result<Command, CommandError> {
    let grammar = (variable, separator, kind).map(|(variable, (), kind)| VariableRead { variable, kind });
    operands.parse(NAME, grammar).map(Command::Mr)
}

/// `flag name type values` (CMD-MW-01).
pub(super) fn mw(operands: Operands<'_>) -> Result<Command, CommandError> {
    let flag = context(FLAG, one_of("01"));
    let values = list(number);
    let grammar = (flag, separator, variable, separator, kind, separator, values);
    let (flag, (), variable, (), kind, (), values) = operands.parse(FLAG, grammar)?;
    if values.len() > MAX_VALUES {
        return Err(operands.malformed(&format!("at most {MAX_VALUES} values"), 0));
    }
    Ok(Command::Mw(VariableWrite {
        restore: flag == '1',
        variable,
        kind,
        values,
    }))
}

/// The operands of MW in canonical form.
pub(super) fn encode_write(write: &VariableWrite) -> String {
    let (restore, kind) = (u8::from(write.restore), write.kind.code());
    let operands = format!("{restore} {} {kind}", write.variable);
    with_numbers(operands, write.values.iter().copied())
}

const NAME: &str = "a variable name of at most ten characters, with subscripts as (1,2)";
const FLAG: &str = "0 or 1 (the restore flag)";

/// The grammar of a variable name among operands.
pub(super) fn variable(input: &str) -> ParseResult<'_, VariableName> {
    let name = take_while1(|c| !matches!(c, ' ' | ',' | '('));
    let subscripts = (char('('), take_while1(|c| c != ')'), char(')'));
    let spelled = |text: &str| VariableName::parse(text).ok();
    context(NAME, map_opt(recognize((name, opt(subscripts))), spelled)).parse(input)
}

fn kind(input: &str) -> ParseResult<'_, VariableKind> {
    let code = |text: &str| text.parse().ok().and_then(VariableKind::from_code);
    context("a type code from -1 to 9", map_opt(number_token, code)).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(text: &str) -> VariableName {
        VariableName::parse(text).unwrap()
    }

    fn at(message: &str) -> usize {
        match Command::parse(message.as_bytes()) {
            Err(CommandError::Malformed { at, .. }) => at,
            other => panic!("{message}: {other:?}"),
        }
    }

    // clause: CMD-MR-01 CMD-MR-03 CMD-MR-04 CMD-MR-05
    #[test]
    fn read_of_every_type() {
        for kind in VariableKind::ALL {
            let message = format!("MR,TBL(1,3) {}", kind.code());
            let read = VariableRead {
                variable: named("TBL(1,3)"),
                kind,
            };
            assert_eq!(Command::parse(message.as_bytes()), Ok(Command::Mr(read.clone())));
            assert_eq!(Command::Mr(read).encode(), format!("{message}\r").into_bytes());
        }
        let plain = Ok(Command::Mr(VariableRead {
            variable: named("A"),
            kind: VariableKind::Integer,
        }));
        for message in ["MR,A 0", "mr, a 0", "MR,A,0", "MR,A , 0 "] {
            assert_eq!(Command::parse(message.as_bytes()), plain, "{message}");
        }
    }

    // clause: CMD-MR-02 CMD-MW-03
    #[test]
    fn names_have_at_most_ten_characters() {
        assert!(Command::parse(b"MR,ABCDEFGHIJ 0").is_ok());
        assert!(Command::parse(b"MW,0 ABCDEFGHIJ 0 1").is_ok());
        assert_eq!(at("MR,ABCDEFGHIJK 0"), 3);
        assert_eq!(at("MW,0 ABCDEFGHIJK 0 1"), 5);
    }

    // clause: CMD-MW-01 CMD-MW-02 CMD-MW-05
    #[test]
    fn writes_of_the_vendors_client() {
        let integer = VariableWrite {
            restore: false,
            variable: named("N1"),
            kind: VariableKind::Integer,
            values: [Number::Integer(42)].to_vec(),
        };
        assert_eq!(Command::parse(b"MW,0 N1 0 42"), Ok(Command::Mw(integer)));
        let real = VariableWrite {
            restore: true,
            variable: named("R1"),
            kind: VariableKind::Real,
            values: [Number::Real(3.25)].to_vec(),
        };
        assert_eq!(Command::Mw(real).encode(), b"MW,1 R1 1 3.250\r");
        for message in [
            "MW,0 P1 2 1.500 20.000",
            "MW,0 A1 4 1.500 -2.250 3.000 4.123 5.000 1",
            "MW,1 P1 4 1 2 3 4 5 6 7 8 12111",
        ] {
            let command = Command::parse(message.as_bytes());
            assert_eq!(
                command.map(|command| command.encode()),
                Ok(format!("{message}\r").into_bytes())
            );
        }
    }

    // clause: FRM-18 CMD-MW-06
    #[test]
    fn errors_say_where() {
        for (message, position) in [
            ("MR", 2),
            ("MR,A", 4),
            ("MR,A 10", 5),
            ("MR,A -2", 5),
            ("MR,A 0 1", 6),
            ("MR,A(1 0", 4),
            ("MR,1A 0", 3),
            ("MW,1", 4),
            ("MW,2 A 0 1", 3),
            ("MW,0 A 0", 8),
            ("MW,0 A 0 X", 9),
            ("MW,0 A 0 1 X", 11),
            ("MW,0 A 0 1X", 10),
        ] {
            assert_eq!(at(message), position, "{message}");
        }
        let values = ["1"; MAX_VALUES + 1].join(" ");
        assert!(Command::parse(format!("MW,0 A 0 {values}").as_bytes()).is_err());
    }
}
