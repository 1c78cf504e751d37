//! The quick form of a program: one or a few small instructions for each step that only computes with numbers.
//! An instruction works on cells of the memory: variables, temporaries, constants. `compile::lower` writes it,
//! `compile::fuse` puts instructions together, `machine::sprint` and `machine::quick` run it; whatever it cannot do,
//! and every fault, is left to the steps themselves.

use alloc::vec::Vec;

use crate::builtin::Builtin;
use crate::cell::Cell;
use crate::request::Number;
use crate::tree::{Binary, Unary};

/// Cells for what a statement computes on its way; a statement that needs more has no quick form.
pub(crate) const TEMPORARIES: usize = 24;

/// A cell, counted as in the memory.
pub(crate) type Register = u16;
/// An instruction, by its number.
pub(crate) type Target = u16;

/// The quick form of a program.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Code {
    pub instructions: Vec<Instruction>,
    /// The step of each instruction.
    pub steps: Vec<u32>,
    /// What each instruction takes of the fuel itself: 1 for the first of a statement.
    pub costs: Vec<u8>,
    /// The first instruction of each step, and one behind the last.
    pub entries: Vec<Target>,
    /// What the cells behind the temporaries begin with; without a value where a call hands over a number.
    pub constants: Vec<Option<Number>>,
    pub loops: Vec<Counted>,
    pub calls: Vec<Called>,
    /// The targets of all computed GOTO.
    pub choices: Vec<Target>,
    /// The calls whose programs stand behind the last entry once more, in the order of the instructions.
    pub copies: Vec<Copied>,
}

/// An instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instruction {
    /// The fuel that it and those behind it take, up to one that goes elsewhere.
    pub charge: u16,
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
    Branch {
        relation: Relation,
        a: Register,
        b: Register,
        then: Target,
        otherwise: Target,
    },
    /// Whether `a` is not 0.
    Truth {
        a: Register,
        then: Target,
        otherwise: Target,
    },
    /// A function of one number.
    Function {
        builtin: Builtin,
        to: Register,
        a: Register,
    },
    /// SQRT.
    Root {
        to: Register,
        a: Register,
    },
    /// SIN.
    Sine {
        to: Register,
        a: Register,
    },
    /// COS.
    Cosine {
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
    /// The flat subscript of an element: `a` times the elements of a row, and `b`.
    Flatten {
        to: Register,
        a: Register,
        b: Register,
        row: u16,
        length: u16,
    },
    /// A parameter.
    Fetch {
        to: Register,
        parameter: u16,
    },
    Put {
        parameter: u16,
        a: Register,
    },
    /// A number that is handed over, to the cell that stands for the parameter.
    Hand {
        to: Register,
        a: Register,
    },
    For(u16),
    Next {
        variable: Register,
        /// The step of its FOR.
        opener: u16,
        body: Target,
    },
    Call(u16),
    /// A call that goes on in a copy of the program, without a frame of its own.
    Enter(Target),
    Return,
    /// A computed GOTO: `count` targets from `first`.
    Choose {
        a: Register,
        first: u16,
        count: u16,
    },
    // Those that follow do what the instructions behind them do together, and jump over them; where they cannot, they
    // do nothing.
    /// `c` and `a` times `b`: two instructions.
    MultiplyAdd {
        to: Register,
        a: Register,
        b: Register,
        c: Register,
    },
    /// `c` less `a` times `b`: two instructions.
    MultiplyFrom {
        to: Register,
        a: Register,
        b: Register,
        c: Register,
    },
    /// The element whose subscript is `index` and `offset`: two instructions.
    LoadNear {
        to: Register,
        element: ElementRef,
    },
    /// An element and `with`: two instructions, or three with an offset.
    LoadAdd {
        to: Register,
        element: ElementRef,
        with: Register,
    },
    /// An element, joined to `with` otherwise.
    LoadJoin {
        join: AccumOp,
        to: Register,
        element: ElementRef,
        with: Register,
    },
    /// An element and `with` becomes the element `index` of the same array: one instruction more.
    UpdateAdd {
        index: Register,
        element: ElementRef,
        with: Register,
    },
    /// A function of `a`, joined to `with`: two instructions.
    RootJoin {
        join: AccumOp,
        to: Register,
        a: Register,
        with: Register,
    },
    SineJoin {
        join: AccumOp,
        to: Register,
        a: Register,
        with: Register,
    },
    CosineJoin {
        join: AccumOp,
        to: Register,
        a: Register,
        with: Register,
    },
    /// A function of `a`, times `by`, joined to `with`: three instructions.
    RootScaled {
        join: AccumOp,
        to: Register,
        a: Register,
        by: Register,
        with: Register,
    },
    SineScaled {
        join: AccumOp,
        to: Register,
        a: Register,
        by: Register,
        with: Register,
    },
    CosineScaled {
        join: AccumOp,
        to: Register,
        a: Register,
        by: Register,
        with: Register,
    },
    /// A jump to a branch: the jump alone.
    JumpBranch {
        relation: Relation,
        a: Register,
        b: Register,
        then: Target,
        otherwise: Target,
    },
    /// `by` is added to `to` where the relation holds: a branch, and the only instruction it guards.
    GuardedAdd {
        relation: Relation,
        to: Register,
        a: Register,
        b: Register,
        by: Register,
    },
    GuardedSubtract {
        relation: Relation,
        to: Register,
        a: Register,
        b: Register,
        by: Register,
    },
    GuardedCopy {
        relation: Relation,
        to: Register,
        a: Register,
        b: Register,
        by: Register,
    },
}

/// The element of an array whose subscript is `index` and `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElementRef {
    pub array: Array,
    pub index: Register,
    pub offset: i16,
}

/// How a number is joined to another, `with`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AccumOp {
    /// `with + it`
    Add,
    /// `with - it`
    From,
    /// `it - with`
    Less,
    /// `with * it`
    Multiply,
}

/// An array: its first cell, and how many it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Array {
    pub base: u16,
    pub length: u16,
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
    Variable { slot: u32, cell: Register },
    Parameter(u16),
    Value(Register),
}

/// The copy of a program for one call: its first instruction, and the number of the call.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Copied {
    pub first: Target,
    pub call: u16,
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

impl ElementRef {
    /// How many instructions fetch it.
    pub fn loads(self) -> usize {
        if self.offset == 0 { 1 } else { 2 }
    }
}

impl Quick {
    /// What follows it need not be the next instruction.
    pub fn ends(self) -> bool {
        matches!(
            self,
            Quick::Leave
                | Quick::Jump(_)
                | Quick::Branch { .. }
                | Quick::Truth { .. }
                | Quick::For(_)
                | Quick::Next { .. }
                | Quick::Call(_)
                | Quick::Enter(_)
                | Quick::Return
                | Quick::Choose { .. }
        )
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
        let constants = self
            .constants
            .iter()
            .map(|constant| constant.map_or(Cell::EMPTY, Cell::from));
        core::iter::repeat_n(Cell::EMPTY, temporaries).chain(constants)
    }

    /// How many cells that are.
    pub fn extra_cells(&self) -> usize {
        TEMPORARIES + self.constants.len()
    }

    /// The number of the call whose copy of a program this instruction is in.
    pub fn call_around(&self, at: usize) -> Option<u16> {
        let behind = self
            .copies
            .partition_point(|copied| usize::from(copied.first) <= at);
        self.copies.get(behind.checked_sub(1)?).map(|copied| copied.call)
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
            let relation = Relation::of(operator).expect("a relation");
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
        assert_eq!(Relation::of(Binary::Add), None);
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
            let holds = |operator| Relation::of(operator).unwrap().reals(a, b, within);
            assert_eq!(holds(Binary::Equal), equal, "{a} {b}");
            assert_eq!(holds(Binary::NotEqual), !equal, "{a} {b}");
            assert_eq!(holds(Binary::Less), !equal && a < b, "{a} {b}");
            assert_eq!(holds(Binary::Greater), !equal && a > b, "{a} {b}");
            assert_eq!(holds(Binary::LessEqual), equal || a < b, "{a} {b}");
            assert_eq!(holds(Binary::GreaterEqual), equal || a > b, "{a} {b}");
        }
    }
}
