//! The compiled form of a program: for each step one or a few instructions.
//!
//! An instruction works on registers: the cells of the memory that hold variables, and after them constants and temporaries.
//! A statement that needs more than values (a motion, a PRINT, a FOR) is one instruction, [`Op::Execute`]. Its operands are
//! formulas (`tree`), which it computes one by one: it may refuse the first value before the second one is computed, and
//! the first fault in the order of the source is the one that counts.
//!
//! `compile::lower` writes this form, `machine::vm` runs it.

use crate::prelude::*;

use crate::builtin::{Builtin, Numeric, System};
use crate::cell::Cell;
use crate::tree::{Binary, Expression, Relation, Unary, Variable};

/// A cell of the memory, by its index there.
pub(crate) type Register = u32;
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
    /// Initial content of the cells after the variables: constants, and temporaries without a value.
    pub working: Vec<Cell>,
    /// The targets of all computed GOTO.
    pub choices: Vec<Target>,
    /// Parameters, and elements of arrays with more than one subscript.
    pub variables: Vec<Variable>,
    /// Functions of any values, with their arguments.
    pub functions: Vec<(Builtin, Vec<Expression>)>,
    /// Looked at after a fault only.
    pub operands: Vec<LeftOperand>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instruction {
    /// Fuel it takes: 1 for the first of a statement, 0 for the others.
    pub cost: u8,
    pub op: Op,
}

/// Operation of an instruction. `to` is written last: an instruction that fails has changed nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    /// Executes the operation of the step.
    Execute,
    /// The end of a formula.
    Done,
    Jump(Target),
    /// Skips this many instructions: the formulas of the instruction after them.
    Skip(u32),
    /// Enters the program that begins with this step, with the arguments of the operation of the step.
    Call(u32),
    Return,
    Next {
        /// Variable of the loop, if it is a plain variable.
        counter: Option<Register>,
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
    /// The other operators, which take numbers only.
    Binary(Binary, Operands),
    Unary {
        operator: Unary,
        to: Register,
        a: Register,
    },
    /// Continues if the relation holds, otherwise jumps to `target`.
    Branch {
        relation: Relation,
        a: Register,
        b: Register,
        target: Target,
    },
    /// Continues unless `a` is 0.
    Truth {
        a: Register,
        target: Target,
    },
    /// A function of one or two numbers.
    Numeric(Numeric, Operands),
    /// A function of any values, by its index in the table.
    Function {
        to: Register,
        function: u32,
    },
    System {
        to: Register,
        system: System,
    },
    /// One coordinate, by its letter.
    Component {
        to: Register,
        a: Register,
        letter: u8,
    },
    /// An element of an array of one subscript, which is `index`.
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
    /// Reads a variable of the table; one that is a parameter has its number.
    Fetch {
        to: Register,
        variable: u32,
        parameter: Option<u32>,
    },
    /// Writes a variable of the table.
    Put {
        variable: u32,
        parameter: Option<u32>,
        a: Register,
    },
    /// A computed GOTO: `count` targets from `first`; continues when `a` names none of them.
    Choose {
        a: Register,
        first: u32,
        count: u32,
    },
}

/// Registers of two operands and of the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Operands {
    pub to: Register,
    pub a: Register,
    pub b: Register,
}

/// An array: its first cell, and how many it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Array {
    pub base: Register,
    pub length: u32,
}

/// A left operand, and the instructions of the right one. The operation reads both together; but when the right one
/// fails, it counts that the left one has no value, which is the first fault in the source.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LeftOperand {
    pub register: Register,
    /// The value has to be a number.
    pub is_number: bool,
    pub before: core::ops::Range<Target>,
}
