//! The compiled form of a program: for each step one or a few small instructions. An instruction that computes with
//! numbers works on registers: the cells of the memory that hold variables, temporaries and constants. All other
//! statements are one instruction, [`Op::Step`], which hands over to the operation of the step.
//!
//! Numbers have instructions for the sake of speed alone: measured by `benches`, the operations of the steps run at a tenth of
//! Lua's speed, and half of it is the target.
//!
//! `compile::lower` writes this form, `machine::vm` runs it. The trees of the steps stay beside it: they say what an
//! instruction means when its operands turn out not to be numbers, and which fault there is.

use crate::prelude::*;

use crate::builtin::Numeric;
use crate::cell::Cell;
use crate::tree::{Binary, Relation, Unary};
use crate::value::Number;

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
        /// The body of the loop.
        target: Target,
    },
    Copy {
        to: Register,
        a: Register,
    },
    Add(Operands),
    Subtract(Operands),
    Multiply(Operands),
    Divide(Operands),
    /// The operators that have no instruction of their own.
    Binary(Binary, Operands),
    Unary {
        operator: Unary,
        to: Register,
        a: Register,
    },
    /// Goes on where the relation holds, to `target` where it does not.
    Branch {
        relation: Relation,
        a: Register,
        b: Register,
        target: Target,
    },
    /// Goes on unless `a` is 0.
    Truth {
        a: Register,
        target: Target,
    },
    /// A function of one or two numbers.
    Function(Numeric, Operands),
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
    Flatten(Operands, Rows),
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

/// Where two operands are, and where the result goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Operands {
    pub to: Register,
    pub a: Register,
    pub b: Register,
}

/// An array of two subscripts: how many elements a row has, and the whole array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rows {
    pub row: u16,
    pub length: u16,
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

impl Code {
    /// The cells after the variables: temporaries without a value, then the constants.
    pub fn working_cells(&self) -> impl Iterator<Item = Cell> {
        let constants = self.constants.iter().map(|constant| Cell::from(*constant));
        core::iter::repeat_n(Cell::EMPTY, self.extra_cells() - self.constants.len()).chain(constants)
    }

    /// How many [`working_cells`](Code::working_cells) there are.
    pub fn extra_cells(&self) -> usize {
        let none = self.instructions.is_empty();
        self.constants.len() + if none { 0 } else { TEMPORARIES }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_instructions_fit_a_line_of_the_cache() {
        assert_eq!(size_of::<Instruction>(), 16);
    }
}
