//! The quick form of a program: one or a few small instructions for each step that only computes with numbers.
//! An instruction works on cells of the memory: variables, temporaries, constants. `compile::lower` writes it,
//! `machine::quick` runs it; whatever it cannot do, and every fault, is left to the steps themselves.

use alloc::vec::Vec;

use crate::builtin::Builtin;
use crate::cell::Cell;
use crate::request::Number;
use crate::tree::{Binary, Unary};

/// Cells for what a statement computes on its way; a statement that needs more has no quick form.
pub(crate) const TEMPORARIES: usize = 24;

/// A cell, counted as in the memory.
pub(crate) type Register = u32;
/// An instruction, by its number.
pub(crate) type Target = u32;

/// The quick form of a program.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Code {
    pub instructions: Vec<Instruction>,
    /// The step of each instruction.
    pub steps: Vec<u32>,
    /// The first instruction of each step, and one behind the last.
    pub entries: Vec<Target>,
    pub constants: Vec<Number>,
    pub arrays: Vec<Array>,
    pub loops: Vec<Counted>,
    pub calls: Vec<Called>,
    pub choices: Vec<Vec<Target>>,
}

/// An instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instruction {
    /// Fuel it takes: 1 for the first of a statement.
    pub cost: u8,
    pub operation: Quick,
}

/// What an instruction does. `to` is written last: until then nothing has happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Quick {
    /// The step has no quick form.
    Leave,
    Jump(Target),
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
    /// Everything that is neither one of the above nor a relation.
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
    /// Goes on where the relation holds.
    Branch {
        relation: Relation,
        a: Register,
        b: Register,
        otherwise: Target,
    },
    /// Goes on where `a` is not 0.
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
    /// An element of an array with one subscript, `index`.
    Load {
        to: Register,
        array: u32,
        index: Register,
    },
    Store {
        array: u32,
        index: Register,
        a: Register,
    },
    /// The flat subscript of an element: `a` times the elements behind one of it, and `b`.
    Flatten {
        to: Register,
        array: u32,
        a: Register,
        b: Register,
    },
    /// A parameter.
    Fetch {
        to: Register,
        parameter: u32,
    },
    Put {
        parameter: u32,
        a: Register,
    },
    For(u32),
    Next {
        variable: Register,
        opener: u32,
        body: Target,
    },
    Call(u32),
    Return,
    Choose {
        a: Register,
        choice: u32,
    },
}

/// An array: its first cell, and how many it has; for a table with two subscripts also its second bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Array {
    pub base: u32,
    pub length: u32,
    /// Elements of a row.
    pub row: u32,
}

/// A FOR.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Counted {
    pub variable: Register,
    pub from: Register,
    pub to: Register,
    pub step: Register,
    /// The steps of the FOR, and behind its NEXT.
    pub opener: u32,
    pub exit: u32,
}

/// A call.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Called {
    pub arguments: Vec<Handed>,
    /// First step of the program.
    pub step: u32,
    /// The step behind the call.
    pub back: u32,
}

/// What is handed over for a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Handed {
    Variable { slot: u32, cell: u32 },
    Parameter(u32),
    Value(Register),
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
    pub fn of(operator: Binary) -> Option<Self> {
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
        let outcome = u8::from(a < b) | (u8::from(a == b) << 1) | (u8::from(a > b) << 2);
        self.0 & outcome != 0
    }

    /// Whether it holds between two reals.
    #[inline(always)]
    pub fn reals(self, a: f32, b: f32) -> bool {
        let ordered = u8::from(a < b) | (u8::from(a == b) << 1) | (u8::from(a > b) << 2);
        let outcome = if ordered == 0 { Self::APART } else { ordered };
        self.0 & outcome != 0
    }
}

impl Code {
    /// What a memory holds behind the variables.
    pub fn working_cells(&self) -> impl Iterator<Item = Cell> {
        let temporaries = if self.instructions.is_empty() {
            0
        } else {
            TEMPORARIES
        };
        let constants = self.constants.iter().map(|constant| Cell::from(*constant));
        core::iter::repeat_n(Cell::EMPTY, temporaries).chain(constants)
    }

    /// How many cells that are.
    pub fn extra_cells(&self) -> usize {
        TEMPORARIES + self.constants.len()
    }
}
