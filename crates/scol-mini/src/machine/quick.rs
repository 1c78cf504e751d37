//! Runs the quick form of a program: statements that compute with numbers, as many as there are in a row. What an
//! instruction cannot do (a value is missing, a result does not fit, a list is no number) is left to the step it
//! belongs to, from its beginning; so faults, their words and their lines are those of the steps alone.

use super::arithmetic::{binary, truncated, truth, unary};
use super::functions::numeric;
use super::loops::past;
use super::place::{Argument, Place};
use super::{Frame, Loop, Machine};
use crate::MAX_CALL_NESTING;
use crate::code::{Array, Called, Code, Handed, Instruction, Quick, Register, TEMPORARIES};
use crate::memory::{Cell, Memory};
use crate::options::IntDivision;
use crate::program::Program;
use crate::request::Number;

/// The cells a program works on.
struct Registers<'a> {
    cells: &'a mut [Cell],
    /// The first temporary.
    temporaries: usize,
}

impl Registers<'_> {
    #[inline(always)]
    fn get(&self, register: Register) -> Cell {
        self.cells.get(register as usize).copied().unwrap_or(Cell::Empty)
    }

    #[inline(always)]
    fn number(&self, register: Register) -> Option<Number> {
        number(self.get(register))
    }

    /// Stores a number as the kind the variable has; `false` when that cannot be done here.
    #[inline(always)]
    fn set(&mut self, register: Register, value: Option<Cell>) -> bool {
        let (Some(place), Some(value)) = (self.cells.get_mut(register as usize), value) else {
            return false;
        };
        match (*place, value) {
            (Cell::Integer(_), Cell::Integer(_)) | (Cell::Real(_), Cell::Real(_)) => {
                *place = value;
                true
            }
            (held, value) => {
                let temporary = (register as usize)
                    .checked_sub(self.temporaries)
                    .is_some_and(|at| at < TEMPORARIES);
                match converted(held, value, temporary) {
                    Some(value) => {
                        *place = value;
                        true
                    }
                    None => false,
                }
            }
        }
    }
}

#[inline(always)]
fn number(cell: Cell) -> Option<Number> {
    match cell {
        Cell::Integer(value) => Some(Number::Integer(value)),
        Cell::Real(value) => Some(Number::Real(value)),
        Cell::Empty | Cell::Vector(_) => None,
    }
}

/// A number as the kind of what it replaces; a temporary takes any.
#[inline(never)]
fn converted(held: Cell, value: Cell, temporary: bool) -> Option<Cell> {
    match (held, value) {
        _ if temporary => Some(value),
        (Cell::Real(_), Cell::Integer(value)) => Some(Cell::Real(value as f32)),
        (Cell::Integer(_), Cell::Real(value)) => truncated(value).ok().map(Cell::Integer),
        // The first value of a variable fixes its kind; that is done by the step.
        _ => None,
    }
}

/// The two numbers an operation takes, if they are such: one real makes both real.
enum Pair {
    Integers(i32, i32),
    Reals(f32, f32),
    Other,
}

#[inline(always)]
fn pair(a: Cell, b: Cell) -> Pair {
    match (a, b) {
        (Cell::Integer(a), Cell::Integer(b)) => Pair::Integers(a, b),
        (Cell::Real(a), Cell::Real(b)) => Pair::Reals(a, b),
        (Cell::Integer(a), Cell::Real(b)) => Pair::Reals(a as f32, b),
        (Cell::Real(a), Cell::Integer(b)) => Pair::Reals(a, b as f32),
        _ => Pair::Other,
    }
}

#[inline(always)]
fn arithmetic(
    a: Cell,
    b: Cell,
    integers: impl Fn(i32, i32) -> Option<i32>,
    reals: impl Fn(f32, f32) -> f32,
) -> Option<Cell> {
    match pair(a, b) {
        Pair::Integers(a, b) => integers(a, b).map(Cell::Integer),
        Pair::Reals(a, b) => Some(reals(a, b))
            .filter(|value| value.is_finite())
            .map(Cell::Real),
        Pair::Other => None,
    }
}

#[inline(never)]
fn other(operator: crate::tree::Binary, a: Cell, b: Cell, division: IntDivision) -> Option<Cell> {
    binary(operator, number(a)?, number(b)?, division)
        .ok()
        .map(Cell::from)
}

/// What came of an instruction.
enum Outcome {
    /// The next one follows.
    On,
    /// This one follows.
    To(u32),
    /// The step has to do it.
    Left,
}

impl From<bool> for Outcome {
    #[inline(always)]
    fn from(done: bool) -> Self {
        if done { Outcome::On } else { Outcome::Left }
    }
}

impl Machine {
    /// Runs quick statements until one has to be done by its step; `true` when the fuel is used up before.
    pub(super) fn sprint(&mut self, program: &Program, memory: &mut Memory, fuel: &mut u32) -> bool {
        let code = &program.code;
        let Some(entry) = code.entries.get(self.at) else {
            return false;
        };
        let mut registers = Registers {
            cells: memory.registers(),
            temporaries: program.symbols.cells,
        };
        let mut at = *entry as usize;
        let mut left = *fuel;
        let empty = loop {
            let Some(Instruction { cost, operation }) = code.instructions.get(at) else {
                break false;
            };
            let Some(rest) = left.checked_sub(u32::from(*cost)) else {
                break true;
            };
            left = rest;
            match self.quick(program, code, *operation, &mut registers) {
                Outcome::On => at += 1,
                Outcome::To(target) => at = target as usize,
                Outcome::Left => {
                    // The step begins anew, and pays anew.
                    let step = code.steps.get(at).map_or(0, |step| *step as usize);
                    let first = code
                        .entries
                        .get(step)
                        .and_then(|first| code.instructions.get(*first as usize));
                    left += first.map_or(0, |first| u32::from(first.cost));
                    break false;
                }
            }
        };
        *fuel = left;
        if let Some(step) = code.steps.get(at) {
            self.at = *step as usize;
        }
        empty
    }

    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "a flat match, one arm an instruction")]
    fn quick(
        &mut self,
        program: &Program,
        code: &Code,
        operation: Quick,
        registers: &mut Registers<'_>,
    ) -> Outcome {
        match operation {
            Quick::Leave => Outcome::Left,
            Quick::Jump(target) => Outcome::To(target),
            Quick::Copy { to, a } => {
                let value = registers.number(a).map(Cell::from);
                registers.set(to, value).into()
            }
            Quick::Add { to, a, b } => {
                let sum = arithmetic(registers.get(a), registers.get(b), i32::checked_add, |a, b| a + b);
                registers.set(to, sum).into()
            }
            Quick::Subtract { to, a, b } => {
                let rest = arithmetic(registers.get(a), registers.get(b), i32::checked_sub, |a, b| a - b);
                registers.set(to, rest).into()
            }
            Quick::Multiply { to, a, b } => {
                let product = arithmetic(registers.get(a), registers.get(b), i32::checked_mul, |a, b| a * b);
                registers.set(to, product).into()
            }
            Quick::Binary { operator, to, a, b } => {
                let division = program.options.int_division;
                let value = other(operator, registers.get(a), registers.get(b), division);
                registers.set(to, value).into()
            }
            Quick::Unary { operator, to, a } => {
                let value = registers.number(a).and_then(|a| unary(operator, a).ok());
                registers.set(to, value.map(Cell::from)).into()
            }
            Quick::Relate { relation, to, a, b } => {
                let holds = match pair(registers.get(a), registers.get(b)) {
                    Pair::Integers(a, b) => Some(relation.integers(a, b)),
                    Pair::Reals(a, b) => Some(relation.reals(a, b)),
                    Pair::Other => None,
                };
                registers
                    .set(to, holds.map(|holds| Cell::Integer(i32::from(holds))))
                    .into()
            }
            Quick::Branch {
                relation,
                a,
                b,
                otherwise,
            } => match pair(registers.get(a), registers.get(b)) {
                Pair::Integers(a, b) if relation.integers(a, b) => Outcome::On,
                Pair::Reals(a, b) if relation.reals(a, b) => Outcome::On,
                Pair::Integers(..) | Pair::Reals(..) => Outcome::To(otherwise),
                Pair::Other => Outcome::Left,
            },
            Quick::Truth { a, otherwise } => match registers.number(a) {
                Some(value) if truth(value) => Outcome::On,
                Some(_) => Outcome::To(otherwise),
                None => Outcome::Left,
            },
            Quick::Function { builtin, to, a } => {
                let value = registers.number(a);
                let result =
                    value.and_then(|value| numeric(builtin, &[value], program.options.int_division).ok());
                registers.set(to, result.map(Cell::from)).into()
            }
            Quick::Function2 { builtin, to, a, b } => {
                let pair = registers.number(a).zip(registers.number(b));
                let result =
                    pair.and_then(|(a, b)| numeric(builtin, &[a, b], program.options.int_division).ok());
                registers.set(to, result.map(Cell::from)).into()
            }
            Quick::Load { to, array, index } => {
                let cell = element(code, array, registers.get(index));
                let value = cell.and_then(|cell| registers.number(cell)).map(Cell::from);
                registers.set(to, value).into()
            }
            Quick::Store { array, index, a } => {
                let value = registers.number(a).map(Cell::from);
                let cell = element(code, array, registers.get(index));
                cell.is_some_and(|cell| registers.set(cell, value)).into()
            }
            Quick::Flatten { to, array, a, b } => {
                let index = flat(code, array, registers.get(a), registers.get(b));
                registers.set(to, index).into()
            }
            Quick::Fetch { to, parameter } => {
                let value = self.parameter(parameter, registers);
                registers.set(to, value).into()
            }
            Quick::Put { parameter, a } => {
                let value = registers.number(a).map(Cell::from);
                self.put_parameter(parameter, value, registers).into()
            }
            Quick::For(number) => self.quick_for(code, number, registers),
            Quick::Next {
                variable,
                opener,
                body,
            } => self.quick_next(variable, opener, body, registers),
            Quick::Call(number) => self.quick_call(code, number, registers),
            Quick::Return => match self.leave().and_then(|step| code.entries.get(step)) {
                Some(back) => Outcome::To(*back),
                None => Outcome::Left,
            },
            Quick::Choose { a, choice } => choose(code, registers.get(a), choice),
        }
    }

    fn parameter(&self, parameter: u32, registers: &Registers<'_>) -> Option<Cell> {
        match *self.argument_at(self.absolute(parameter))? {
            Argument::Place(Place::Cell { cell, .. }) => {
                registers.number(u32::try_from(cell).ok()?).map(Cell::from)
            }
            Argument::Place(Place::Argument(at)) => match self.argument_at(at)? {
                Argument::Number(number) => Some(Cell::from(*number)),
                Argument::Place(_) | Argument::Vector(_) => None,
            },
            Argument::Number(number) => Some(Cell::from(number)),
            Argument::Vector(_) => None,
        }
    }

    fn argument_at(&self, at: usize) -> Option<&Argument> {
        self.arguments.get(at)
    }

    /// The number of a parameter in the stack of arguments.
    #[inline(always)]
    fn absolute(&self, parameter: u32) -> usize {
        self.frames.last().map_or(0, |frame| frame.arguments) + parameter as usize
    }

    /// Only a variable of the caller is written here.
    fn put_parameter(&self, parameter: u32, value: Option<Cell>, registers: &mut Registers<'_>) -> bool {
        match self.argument_at(self.absolute(parameter)) {
            Some(Argument::Place(Place::Cell { cell, .. })) => {
                u32::try_from(*cell).is_ok_and(|cell| registers.set(cell, value))
            }
            Some(Argument::Place(Place::Argument(_)) | Argument::Number(_) | Argument::Vector(_)) | None => {
                false
            }
        }
    }

    fn quick_for(&mut self, code: &Code, number: u32, registers: &mut Registers<'_>) -> Outcome {
        let Some(counted) = code.loops.get(number as usize) else {
            return Outcome::Left;
        };
        let from = registers.number(counted.from);
        let limit = registers.number(counted.to);
        let (Some(from), Some(limit), Some(step)) = (from, limit, registers.number(counted.step)) else {
            return Outcome::Left;
        };
        if !truth(step) || !registers.set(counted.variable, Some(Cell::from(from))) {
            return Outcome::Left;
        }
        let now = registers.number(counted.variable).unwrap_or(from);
        let opened = Loop {
            opener: counted.opener as usize,
            exit: counted.exit as usize,
            limit,
            step,
        };
        if self.open(now, opened) {
            return Outcome::On;
        }
        code.entries
            .get(counted.exit as usize)
            .map_or(Outcome::Left, |exit| Outcome::To(*exit))
    }

    #[inline(always)]
    fn quick_next(
        &mut self,
        variable: Register,
        opener: u32,
        body: u32,
        registers: &mut Registers<'_>,
    ) -> Outcome {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let Some(open) = self.loops.get(first..).and_then(<[Loop]>::last) else {
            return Outcome::Left;
        };
        if open.opener != opener as usize {
            return Outcome::Left;
        }
        let over = match (registers.get(variable), open.step, open.limit) {
            (Cell::Integer(now), Number::Integer(step), Number::Integer(limit)) => {
                let Some(now) = now.checked_add(step) else {
                    return Outcome::Left;
                };
                registers.set(variable, Some(Cell::Integer(now)));
                if step > 0 { now > limit } else { now < limit }
            }
            (now, step, limit) => match counted_on(now, step, limit) {
                Some((now, over)) => {
                    registers.set(variable, Some(now));
                    over
                }
                None => return Outcome::Left,
            },
        };
        if over {
            self.loops.pop();
            return Outcome::On;
        }
        Outcome::To(body)
    }

    fn quick_call(&mut self, code: &Code, number: u32, registers: &Registers<'_>) -> Outcome {
        let Some(Called {
            arguments,
            step,
            back,
        }) = code.calls.get(number as usize)
        else {
            return Outcome::Left;
        };
        let first = self.arguments.len();
        let handed = arguments
            .iter()
            .all(|handed| match self.handed(*handed, registers) {
                Some(argument) => {
                    self.arguments.push(argument);
                    true
                }
                None => false,
            });
        let target = code.entries.get(*step as usize);
        let (true, Some(target), true) = (handed, target, self.frames.len() <= MAX_CALL_NESTING) else {
            self.arguments.truncate(first);
            return Outcome::Left;
        };
        self.frames.push(Frame {
            return_to: *back as usize,
            arguments: first,
            loops: self.loops.len(),
        });
        Outcome::To(*target)
    }

    fn handed(&self, handed: Handed, registers: &Registers<'_>) -> Option<Argument> {
        match handed {
            Handed::Variable { slot, cell } => Some(Argument::Place(Place::Cell {
                slot: slot as usize,
                cell: cell as usize,
            })),
            Handed::Parameter(parameter) => {
                let at = self.absolute(parameter);
                match self.argument_at(at)? {
                    Argument::Place(place) => Some(Argument::Place(*place)),
                    Argument::Number(_) | Argument::Vector(_) => Some(Argument::Place(Place::Argument(at))),
                }
            }
            Handed::Value(register) => registers.number(register).map(Argument::Number),
        }
    }
}

/// The counter of a FOR one step on, and whether the loop is over. A counter that changes its kind is not for here.
#[inline(never)]
fn counted_on(now: Cell, step: Number, limit: Number) -> Option<(Cell, bool)> {
    let sum = match (now, step) {
        (Cell::Integer(now), Number::Integer(step)) => Number::Integer(now.checked_add(step)?),
        (Cell::Real(now), Number::Integer(step)) => Number::Real(now + step as f32),
        (Cell::Real(now), Number::Real(step)) => Number::Real(now + step),
        _ => return None,
    };
    let fits = !matches!(sum, Number::Real(sum) if !sum.is_finite());
    fits.then(|| (Cell::from(sum), past(sum, limit, step)))
}

/// The cell of an element.
#[inline(always)]
fn element(code: &Code, array: u32, index: Cell) -> Option<Register> {
    let Array { base, length, .. } = *code.arrays.get(array as usize)?;
    match index {
        Cell::Integer(index) => u32::try_from(index)
            .ok()
            .filter(|index| *index < length)
            .map(|index| base + index),
        Cell::Empty | Cell::Real(_) | Cell::Vector(_) => None,
    }
}

/// Two subscripts as one.
#[inline(always)]
fn flat(code: &Code, array: u32, a: Cell, b: Cell) -> Option<Cell> {
    let Array { length, row, .. } = *code.arrays.get(array as usize)?;
    let (Cell::Integer(a), Cell::Integer(b)) = (a, b) else {
        return None;
    };
    let (a, b) = (u32::try_from(a).ok()?, u32::try_from(b).ok()?);
    let index = a.checked_mul(row)?.checked_add(b)?;
    (b < row && index < length)
        .then(|| i32::try_from(index).ok().map(Cell::Integer))
        .flatten()
}

/// A computed GOTO.
fn choose(code: &Code, selector: Cell, choice: u32) -> Outcome {
    let (Cell::Integer(number), Some(targets)) = (selector, code.choices.get(choice as usize)) else {
        return Outcome::Left;
    };
    let chosen = usize::try_from(number)
        .ok()
        .and_then(|number| number.checked_sub(1));
    match chosen.and_then(|at| targets.get(at)) {
        Some(target) => Outcome::To(*target),
        None => Outcome::On,
    }
}
