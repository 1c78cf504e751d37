//! Runs the instructions of a program: the loop of the machine.
//!
//! Instructions compute with numbers on the cells of the memory. An instruction whose operands are something else (no value
//! yet, a position) or whose result does not fit changes nothing. The machine then executes the operation of its step with
//! values of any kind (`execute`), which also reports the fault. The instructions are defined in `code`; start with
//! [`Machine::compute`].

use super::arithmetic::{binary, holds, reals_hold, truncated, truth, unary};
use super::functions::numeric;
use super::place::{Argument, ValuePlace};
use super::{Loop, Machine};
use crate::cell::{Cell, Held};
use crate::code::{Array, Code, Instruction, Op, Operands, Passed, Register, Rows, TEMPORARIES, Target};
use crate::options::LanguageOptions;
use crate::program::Program;
use crate::tree::{Binary, Relation};
use crate::value::Number;

/// Why the instructions stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// The next statement has no fuel.
    Fuel,
    /// The operation of the step is to be executed; the fuel for it is paid.
    Step,
    /// The main program is over.
    End,
}

/// Where an instruction leads.
enum Next {
    Following,
    To(Target),
    End,
}

/// The cells a program computes on.
struct Registers<'a> {
    cells: &'a mut [Cell],
    /// The first temporary.
    temporaries: usize,
    /// Reals that differ by so much or less are equal.
    within: f32,
}

impl Machine {
    /// Runs instructions from the step at `at` on, until one needs its step or the fuel is used up.
    #[inline(never)]
    pub(super) fn compute(&mut self, program: &Program, cells: &mut [Cell], fuel: &mut u32) -> Stop {
        let code = &program.code;
        let Some(entry) = code.entries.get(self.at) else {
            return Stop::End;
        };
        let (mut at, mut left) = (*entry as usize, *fuel);
        let (temporaries, within) = (program.symbols.cells, program.options.equal_within);
        let stop = loop {
            let Some(Instruction { cost, op }) = code.instructions.get(at) else {
                break Stop::End;
            };
            let Some(rest) = left.checked_sub(u32::from(*cost)) else {
                break Stop::Fuel;
            };
            left = rest;
            // Made anew for each instruction: a value that lives longer would be kept in memory.
            let registers = Registers {
                cells,
                temporaries,
                within,
            };
            match self.instruction(program, op, registers) {
                Some(Next::Following) => at += 1,
                Some(Next::To(target)) => at = target as usize,
                Some(Next::End) => break Stop::End,
                None => break Stop::Step,
            }
        };
        *fuel = left;
        let step = code.steps.get(at).map(|step| *step as usize);
        self.at = step.unwrap_or(program.steps.len());
        stop
    }

    /// Does one instruction; `None`: nothing has happened, and its step has to do it.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "a flat match, one arm an instruction")]
    fn instruction(&mut self, program: &Program, op: &Op, mut registers: Registers<'_>) -> Option<Next> {
        // Operands are taken apart here: handed on as one value they would be copied and cut up again.
        match *op {
            Op::Step => return None,
            Op::Jump(target) => return Some(Next::To(target)),
            Op::Call(number) => return self.called(&program.code, number, registers.cells),
            Op::Return => return self.returned(&program.code),
            Op::Next {
                variable,
                opener,
                target,
            } => {
                if self.counted(variable, opener as usize, &mut registers)? {
                    return Some(Next::To(target));
                }
            }
            Op::Copy { to, a } => {
                let value = registers.get(a)?;
                registers.put(to, value)?;
            }
            Op::Add(Operands { to, a, b }) => {
                registers.arithmetic(to, a, b, i32::checked_add, |a, b| a + b)?;
            }
            Op::Subtract(Operands { to, a, b }) => {
                registers.arithmetic(to, a, b, i32::checked_sub, |a, b| a - b)?;
            }
            Op::Multiply(Operands { to, a, b }) => {
                registers.arithmetic(to, a, b, i32::checked_mul, |a, b| a * b)?;
            }
            Op::Divide(Operands { to, a, b }) => {
                let [left, right] = [registers.get(a)?, registers.get(b)?];
                if Cell::integers([left, right]).is_none() {
                    // What is divided by zero is not finite, and left to the step.
                    registers.put_real(to, left.single()? / right.single()?)?;
                } else {
                    registers.binary(Binary::Divide, to, a, b, &program.options)?;
                }
            }
            Op::Binary(operator, Operands { to, a, b }) => {
                registers.binary(operator, to, a, b, &program.options)?;
            }
            Op::Unary { operator, to, a } => {
                let value = unary(operator, registers.number(a)?).ok()?;
                registers.put(to, value.into())?;
            }
            Op::Branch {
                relation,
                a,
                b,
                target,
            } => {
                if !registers.holds(relation, a, b)? {
                    return Some(Next::To(target));
                }
            }
            Op::Truth { a, target } => {
                if !truth(registers.number(a)?) {
                    return Some(Next::To(target));
                }
            }
            Op::Function(function, Operands { to, a, b }) => {
                let (a, b) = (registers.number(a)?, registers.number(b)?);
                registers.put(to, numeric(function, a, b, &program.options).ok()?.into())?;
            }
            Op::Load { to, array, index } => {
                let value = registers.get(registers.element(array, index)?)?;
                registers.put(to, value)?;
            }
            Op::Store { array, index, a } => {
                let value = registers.get(a)?;
                registers.put(registers.element(array, index)?, value)?;
            }
            Op::Flatten(Operands { to, a, b }, rows) => {
                let index = flat(rows, registers.get(a)?, registers.get(b)?)?;
                registers.put(to, Cell::integer(index))?;
            }
            Op::Fetch { to, parameter } => {
                let value = self.parameter(parameter, &registers)?;
                registers.put(to, value)?;
            }
            Op::Put { parameter, a } => {
                let value = registers.get(a)?;
                self.put_parameter(parameter, value, registers)?;
            }
            Op::Choose { a, first, count } => {
                if let Some(target) = choice(&program.code, registers.get(a)?.as_integer()?, first, count) {
                    return Some(Next::To(target));
                }
            }
        }
        Some(Next::Following)
    }

    /// Enters a program; calls that are nested too deep are left to the step.
    fn called(&mut self, code: &Code, number: u32, cells: &[Cell]) -> Option<Next> {
        let call = code.calls.get(number as usize)?;
        let first = self.arguments.len();
        for passed in &call.arguments {
            match self.passed(*passed, cells) {
                Some(argument) => self.arguments.push(argument),
                None => {
                    self.arguments.truncate(first);
                    return None;
                }
            }
        }
        let entered = self.push_frame(first, call.return_to as usize);
        entered.then_some(Next::To(call.entry))
    }

    #[inline(always)]
    fn passed(&self, passed: Passed, cells: &[Cell]) -> Option<Argument> {
        Some(match passed {
            Passed::Variable { slot, cell } => Argument::Place(ValuePlace::Cell {
                slot: slot as usize,
                cell: cell as usize,
            }),
            Passed::Parameter(parameter) => Argument::Place(self.parameter_place(usize::from(parameter))?),
            Passed::Value(register) => Argument::Number(cells.get(usize::from(register))?.number()?),
        })
    }

    /// Leaves the program under way.
    #[inline(always)]
    fn returned(&mut self, code: &Code) -> Option<Next> {
        match self.pop_frame() {
            Some(step) => code.entries.get(step).map(|entry| Next::To(*entry)),
            None => Some(Next::End),
        }
    }

    /// Counts the innermost loop on, if it is the one of this FOR and counts with integers; `false` when that ends it.
    #[inline(always)]
    fn counted(&mut self, variable: Register, opener: usize, registers: &mut Registers<'_>) -> Option<bool> {
        let frame = self.frames.last()?;
        let open: &Loop = self.loops.get(frame.loops..)?.last()?;
        if open.opener != opener {
            return None;
        }
        let place = registers.cells.get_mut(usize::from(variable))?;
        let [now, step, limit] = Cell::integers([*place, Cell::from(open.step), Cell::from(open.limit)])?;
        let now = now.checked_add(step)?;
        *place = Cell::integer(now);
        let over = if step > 0 { now > limit } else { now < limit };
        if over {
            self.loops.pop();
        }
        Some(!over)
    }

    #[inline(always)]
    fn parameter(&self, parameter: u16, registers: &Registers<'_>) -> Option<Cell> {
        match self.parameter_place(usize::from(parameter))? {
            ValuePlace::Cell { cell, .. } => registers.cells.get(cell).copied(),
            ValuePlace::Argument(at) => match self.arguments.get(at)? {
                Argument::Number(number) => Some(Cell::from(*number)),
                Argument::Place(_) | Argument::Vector(_) | Argument::Unset => None,
            },
        }
    }

    /// Only a variable of the caller is written here.
    #[inline(always)]
    fn put_parameter(&self, parameter: u16, value: Cell, mut registers: Registers<'_>) -> Option<()> {
        match self.parameter_place(usize::from(parameter))? {
            ValuePlace::Cell { cell, .. } => registers.put(Register::try_from(cell).ok()?, value),
            ValuePlace::Argument(_) => None,
        }
    }
}

impl Registers<'_> {
    #[inline(always)]
    fn get(&self, register: Register) -> Option<Cell> {
        self.cells.get(usize::from(register)).copied()
    }

    #[inline(always)]
    fn number(&self, register: Register) -> Option<Number> {
        self.get(register)?.number()
    }

    /// Stores an integer where one is, or in a temporary.
    #[inline(always)]
    fn put_integer(&mut self, to: Register, value: i32) -> Option<()> {
        let is_temporary = self.is_temporary(to);
        let place = self.cells.get_mut(usize::from(to))?;
        if place.is_integer() || is_temporary {
            *place = Cell::integer(value);
            return Some(());
        }
        convert_into(place, Number::Integer(value))
    }

    /// Stores a real where one is, or in a temporary; it has to be finite.
    #[inline(always)]
    fn put_real(&mut self, to: Register, value: f32) -> Option<()> {
        let is_temporary = self.is_temporary(to);
        let place = self.cells.get_mut(usize::from(to))?;
        if !value.is_finite() {
            return None;
        }
        if place.is_real() || is_temporary {
            *place = Cell::real(value);
            return Some(());
        }
        convert_into(place, Number::Real(value))
    }

    /// Stores a number.
    #[inline(always)]
    fn put(&mut self, to: Register, value: Cell) -> Option<()> {
        if let Some(value) = value.as_integer() {
            return self.put_integer(to, value);
        }
        self.put_real(to, value.as_real()?)
    }

    #[inline(always)]
    fn is_temporary(&self, register: Register) -> bool {
        usize::from(register).wrapping_sub(self.temporaries) < TEMPORARIES
    }

    #[inline(always)]
    fn binary(
        &mut self,
        operator: Binary,
        to: Register,
        a: Register,
        b: Register,
        options: &LanguageOptions,
    ) -> Option<()> {
        let (a, b) = (self.number(a)?, self.number(b)?);
        self.put(to, binary(operator, a, b, options).ok()?.into())
    }

    #[inline(always)]
    fn arithmetic(
        &mut self,
        to: Register,
        a: Register,
        b: Register,
        integers: impl Fn(i32, i32) -> Option<i32>,
        reals: impl Fn(f32, f32) -> f32,
    ) -> Option<()> {
        let (a, b) = (self.get(a)?, self.get(b)?);
        if let Some([a, b]) = Cell::integers([a, b]) {
            return self.put_integer(to, integers(a, b)?);
        }
        self.put_real(to, reals(a.single()?, b.single()?))
    }

    #[inline(always)]
    fn holds(&self, relation: Relation, a: Register, b: Register) -> Option<bool> {
        let (a, b) = (self.get(a)?, self.get(b)?);
        let holds = match Cell::integers([a, b]) {
            Some([a, b]) => holds(relation, &a, &b),
            None => reals_hold(relation, a.single()?, b.single()?, self.within),
        };
        Some(holds)
    }

    /// The cell of an element; `None` outside the array.
    #[inline(always)]
    fn element(&self, array: Array, index: Register) -> Option<Register> {
        // A negative subscript is beyond any array.
        let index = self.get(index)?.as_integer()? as u32;
        (index < u32::from(array.length)).then(|| array.base.wrapping_add(index as u16))
    }
}

/// Stores a number as the kind of the number that it replaces. The first value of a variable fixes its kind: that is left
/// to the step.
#[inline(never)]
fn convert_into(place: &mut Cell, value: Number) -> Option<()> {
    *place = match (place.held(), value) {
        (Held::Real(_), Number::Integer(value)) => Cell::real(value as f32),
        (Held::Integer(_), Number::Real(value)) => Cell::integer(truncated(value).ok()?),
        _ => return None,
    };
    Some(())
}

/// Two subscripts as one.
fn flat(Rows { row, length }: Rows, a: Cell, b: Cell) -> Option<i32> {
    let a = u32::try_from(a.as_integer()?).ok()?;
    let b = u32::try_from(b.as_integer()?).ok()?;
    let index = a.checked_mul(u32::from(row))?.checked_add(b)?;
    let exists = b < u32::from(row) && index < u32::from(length);
    exists.then(|| i32::try_from(index).ok()).flatten()
}

/// The target of a computed GOTO, counted from 1.
#[inline(always)]
fn choice(code: &Code, number: i32, first: u32, count: u16) -> Option<Target> {
    let at = usize::try_from(number).ok()?.checked_sub(1)?;
    if at >= usize::from(count) {
        return None;
    }
    code.choices.get(first as usize + at).copied()
}
