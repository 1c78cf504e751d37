//! The compiled form of a program: for each step one or a few small instructions. An instruction that computes with
//! numbers works on registers: the cells of the memory that hold variables, temporaries and constants. All other
//! statements are one instruction, [`Op::Step`], which hands over to the operation of the step.
//!
//! `compile::lower` writes this form, `machine::vm` runs it. The trees of the steps stay beside it: they say what an
//! instruction means when its operands turn out not to be numbers, and which fault there is.

use alloc::vec::Vec;

use crate::builtin::Builtin;
use crate::cell::Cell;
use crate::request::Number;
use crate::tree::{Binary, Unary};

/// Cells for the intermediate results of one statement; a statement that needs more becomes [`Op::Step`].
pub(crate) const TEMPORARIES: usize = 24;

/// A cell of the memory, by its index there.
pub(crate) type Register = u16;
/// An instruction, by its index.
pub(crate) type Target = u32;

/// The instructions of a program and their tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Code {
    pub instructions: Vec<Instruction>,
    /// The step of each instruction.
    pub steps: Vec<u32>,
    /// The first instruction of each step.
    pub entries: Vec<Target>,
    /// The values of the cells after the temporaries.
    pub constants: Vec<Number>,
    pub calls: Vec<Call>,
    /// The targets of all computed GOTO.
    pub choices: Vec<Target>,
}

/// An instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instruction {
    /// Fuel it takes: 1 for the first of a statement, 0 for the others.
    pub cost: u8,
    pub op: Op,
}

/// What an instruction does. `to` is written last: an instruction that cannot be completed has changed nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    /// Executes the operation of the step.
    Step,
    Jump(Target),
    /// Enters a program, by the index of the call.
    Call(u32),
    Return,
    Next {
        variable: Register,
        /// The step of its FOR.
        opener: u32,
        body: Target,
    },
    Copy {
        to: Register,
        a: Register,
    },
    Add {
        to: Register,
        a: Register,
        b: Register,
    },
    Subtract {
        to: Register,
        a: Register,
        b: Register,
    },
    Multiply {
        to: Register,
        a: Register,
        b: Register,
    },
    /// Integers truncate toward zero.
    Divide {
        to: Register,
        a: Register,
        b: Register,
    },
    Modulo {
        to: Register,
        a: Register,
        b: Register,
    },
    /// The operators that have no instruction of their own.
    Binary {
        operator: Binary,
        to: Register,
        a: Register,
        b: Register,
    },
    Unary {
        operator: Unary,
        to: Register,
        a: Register,
    },
    /// 1 where the relation holds, otherwise 0.
    Relate {
        relation: Relation,
        to: Register,
        a: Register,
        b: Register,
    },
    /// Goes on where the relation holds, to `otherwise` where it does not.
    Branch {
        relation: Relation,
        a: Register,
        b: Register,
        otherwise: Target,
    },
    /// Goes on unless `a` is 0.
    Truth {
        a: Register,
        otherwise: Target,
    },
    /// A function of one number.
    Function {
        builtin: Builtin,
        to: Register,
        a: Register,
    },
    /// A function of two numbers.
    Function2 {
        builtin: Builtin,
        to: Register,
        a: Register,
        b: Register,
    },
    /// An element of an array: its flat subscript is `index`.
    Load {
        to: Register,
        array: Array,
        index: Register,
    },
    Store {
        array: Array,
        index: Register,
        a: Register,
    },
    /// The flat subscript of an element: `a` times the elements of a row, plus `b`.
    Flatten {
        to: Register,
        a: Register,
        b: Register,
        row: u16,
        length: u16,
    },
    /// Reads a parameter.
    Fetch {
        to: Register,
        parameter: u16,
    },
    /// Writes a parameter.
    Put {
        parameter: u16,
        a: Register,
    },
    /// A computed GOTO: `count` targets from `first`; goes on when `a` names none of them.
    Choose {
        a: Register,
        first: u32,
        count: u16,
    },
}

/// A call of a program.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Call {
    pub arguments: Vec<Passed>,
    /// Where the program begins.
    pub entry: Target,
    /// The step that follows the call.
    pub return_to: u32,
}

/// The argument of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Passed {
    /// A variable, by reference.
    Variable { slot: u32, cell: u32 },
    /// What the caller's own parameter stands for.
    Parameter(u16),
    /// A number.
    Value(Register),
}

/// An array: its first cell, and how many it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Array {
    pub base: u16,
    pub length: u16,
}

/// Which outcomes of a comparison satisfy a relation, one bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Relation(u8);

impl Relation {
    const LESS: u8 = 1;
    const EQUAL: u8 = 2;
    const GREATER: u8 = 4;
    /// One of them is not a number.
    const APART: u8 = 8;

    /// The relation of an operator, if it is one.
    pub fn from_operator(operator: Binary) -> Option<Self> {
        Some(Self(match operator {
            Binary::Equal => Self::EQUAL,
            Binary::NotEqual => Self::LESS | Self::GREATER | Self::APART,
            Binary::Less => Self::LESS,
            Binary::LessEqual => Self::LESS | Self::EQUAL,
            Binary::Greater => Self::GREATER,
            Binary::GreaterEqual => Self::GREATER | Self::EQUAL,
            _ => return None,
        }))
    }

    /// Whether it holds between two integers.
    #[inline(always)]
    pub fn integers(self, a: i32, b: i32) -> bool {
        // 0, 1 or 2: the number of the bit.
        let outcome = u32::from(a >= b) + u32::from(a > b);
        u32::from(self.0) >> outcome & 1 != 0
    }

    /// Whether it holds between two reals, of which those that differ by `within` or less are equal.
    #[inline(always)]
    pub fn reals(self, a: f32, b: f32, within: f32) -> bool {
        let outcome = if a.is_nan() || b.is_nan() {
            3
        } else if within > 0.0 && near(a, b, within) {
            1
        } else {
            u32::from(a >= b) + u32::from(a > b)
        };
        u32::from(self.0) >> outcome & 1 != 0
    }
}

/// Whether two reals differ by `within` or less. The last digit of the larger one is allowed for: 1.001 and 1.0 as
/// written in a program differ by 0.001, but as reals by a little more.
#[inline(always)]
fn near(a: f32, b: f32, within: f32) -> bool {
    let (a, b) = (f64::from(a), f64::from(b));
    let digit = libm::fmax(libm::fabs(a), libm::fabs(b)) * f64::from(f32::EPSILON);
    libm::fabs(a - b) <= f64::from(within) + digit
}

impl Code {
    /// The cells after the variables: temporaries without a value, then the constants.
    pub fn working_cells(&self) -> impl Iterator<Item = Cell> {
        let constants = self.constants.iter().map(|constant| Cell::from(*constant));
        core::iter::repeat_n(Cell::EMPTY, self.extra_cells() - self.constants.len()).chain(constants)
    }

    /// How many [`working_cells`](Code::working_cells) there are.
    pub fn extra_cells(&self) -> usize {
        let temporaries = if self.instructions.is_empty() {
            0
        } else {
            TEMPORARIES
        };
        temporaries + self.constants.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_hold_between_the_same_integers_and_reals() {
        for (operator, holds) in [
            (Binary::Equal, [false, true, false, false]),
            (Binary::NotEqual, [true, false, true, true]),
            (Binary::Less, [true, false, false, false]),
            (Binary::LessEqual, [true, true, false, false]),
            (Binary::Greater, [false, false, true, false]),
            (Binary::GreaterEqual, [false, true, true, false]),
        ] {
            let relation = Relation::from_operator(operator).expect("a relation");
            for (number, expected) in (1..=3).zip(holds) {
                assert_eq!(relation.integers(number, 2), expected, "{number} {operator:?} 2");
                assert_eq!(
                    relation.reals(number as f32, 2.0, 0.0),
                    expected,
                    "{number} {operator:?} 2.0"
                );
            }
            assert_eq!(relation.reals(f32::NAN, 2.0, 0.0), holds[3]);
            assert_eq!(relation.reals(2.0, f32::NAN, 0.0), holds[3]);
        }
        assert_eq!(Relation::from_operator(Binary::Add), None);
    }

    #[test]
    fn four_instructions_fit_a_line_of_the_cache() {
        assert_eq!(size_of::<Instruction>(), 16);
    }

    #[test]
    fn reals_within_the_difference_are_equal_and_neither_less_nor_greater() {
        for (a, b, within, equal) in [
            (1.0, 1.001, 0.001, true),
            (1.001, 1.0, 0.001, true),
            (100.001, 100.0, 0.001, true),
            (1.0, 1.0011, 0.001, false),
            (-0.0005, 0.0005, 0.001, true),
            (0.0, 1e-9, 0.0, false),
            (1.0, 1.0, 0.0, true),
            (1.0, 1.5, 0.5, true),
        ] {
            let holds = |operator| Relation::from_operator(operator).unwrap().reals(a, b, within);
            assert_eq!(holds(Binary::Equal), equal, "{a} {b}");
            assert_eq!(holds(Binary::NotEqual), !equal, "{a} {b}");
            assert_eq!(holds(Binary::Less), !equal && a < b, "{a} {b}");
            assert_eq!(holds(Binary::Greater), !equal && a > b, "{a} {b}");
            assert_eq!(holds(Binary::LessEqual), equal || a < b, "{a} {b}");
            assert_eq!(holds(Binary::GreaterEqual), equal || a > b, "{a} {b}");
        }
    }
}
