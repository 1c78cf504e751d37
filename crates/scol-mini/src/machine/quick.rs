//! Runs the quick form of a program: statements that compute with numbers, as many as there are in a row. What an
//! instruction cannot do (a value is missing, a result does not fit, a list is no number) is left to the step it
//! belongs to, from its beginning; so faults, their words and their lines are those of the steps alone.

use super::arithmetic::{binary, truncated, truth, unary};
use super::functions::numeric;
use super::loops::past;
use super::place::{Argument, Place};
use super::{Frame, Loop, Machine};
use crate::MAX_CALL_NESTING;
use crate::cell::{Cell, Held, Pair};
use crate::code::{Array, Called, Code, Handed, Instruction, Quick, Register, TEMPORARIES};
use crate::memory::Memory;
use crate::options::IntDivision;
use crate::program::Program;
use crate::request::Number;
use crate::tree::Binary;

/// The cells a program works on.
struct Registers<'a> {
    cells: &'a mut [Cell],
    /// The first temporary.
    temporaries: usize,
}

impl Registers<'_> {
    #[inline(always)]
    fn get(&self, register: Register) -> Cell {
        self.cells.get(register as usize).copied().unwrap_or(Cell::EMPTY)
    }

    #[inline(always)]
    fn pair(&self, a: Register, b: Register) -> Pair {
        self.get(a).pair(self.get(b))
    }

    #[inline(always)]
    fn number(&self, register: Register) -> Option<Number> {
        self.get(register).number()
    }

    /// Stores a number as the kind the variable has; `false` when that cannot be done here.
    #[inline(always)]
    fn integer(&mut self, register: Register, value: Option<i32>) -> bool {
        match (self.cells.get_mut(register as usize), value) {
            (Some(place), Some(value)) if place.is_integer() => {
                *place = Cell::integer(value);
                true
            }
            (_, value) => change(self.cells, self.temporaries, register, value.map(Number::Integer)),
        }
    }

    /// As [`Registers::integer`]; what is not finite does not fit.
    #[inline(always)]
    fn real(&mut self, register: Register, value: f32) -> bool {
        match self.cells.get_mut(register as usize) {
            Some(place) if place.is_real() && value.is_finite() => {
                *place = Cell::real(value);
                true
            }
            _ => change(
                self.cells,
                self.temporaries,
                register,
                Some(Number::Real(value)).filter(|_| value.is_finite()),
            ),
        }
    }

    #[inline(always)]
    fn set(&mut self, register: Register, value: Option<Number>) -> bool {
        match value {
            Some(Number::Integer(value)) => self.integer(register, Some(value)),
            Some(Number::Real(value)) => self.real(register, value),
            None => false,
        }
    }

    /// The same cells, for a function that is not a part of the loop.
    #[inline(always)]
    fn again(&mut self) -> Registers<'_> {
        Registers {
            cells: self.cells,
            temporaries: self.temporaries,
        }
    }
}

/// Stores a number as the kind of what it replaces; a temporary takes any.
#[inline(never)]
fn change(cells: &mut [Cell], temporaries: usize, register: Register, value: Option<Number>) -> bool {
    let temporary = (register as usize).checked_sub(temporaries);
    let (Some(place), Some(value)) = (cells.get_mut(register as usize), value) else {
        return false;
    };
    let changed = match (place.held(), value) {
        _ if temporary.is_some_and(|at| at < TEMPORARIES) => Some(value),
        (Held::Real(_), Number::Integer(value)) => Some(Number::Real(value as f32)),
        (Held::Integer(_), Number::Real(value)) => truncated(value).ok().map(Number::Integer),
        // The first value of a variable fixes its kind; that is done by the step.
        _ => None,
    };
    match changed {
        Some(value) => {
            *place = Cell::from(value);
            true
        }
        None => false,
    }
}

#[inline(never)]
fn other(operator: Binary, a: Option<Number>, b: Option<Number>, division: IntDivision) -> Option<Number> {
    binary(operator, a?, b?, division).ok()
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
            let cost = u32::from(*cost);
            if left < cost {
                break true;
            }
            left -= cost;
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
                let value = registers.number(a);
                registers.set(to, value).into()
            }
            Quick::Add { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_add(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a + b).into(),
                Pair::Other => Outcome::Left,
            },
            Quick::Subtract { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_sub(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a - b).into(),
                Pair::Other => Outcome::Left,
            },
            Quick::Multiply { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_mul(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a * b).into(),
                Pair::Other => Outcome::Left,
            },
            Quick::Divide { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_div(b)).into(),
                // Nothing is divided by 0: that is not finite.
                Pair::Reals(a, b) => registers.real(to, a / b).into(),
                Pair::Other => Outcome::Left,
            },
            Quick::Modulo { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_rem(b)).into(),
                Pair::Reals(a, b) => registers.real(to, libm::fmodf(a, b)).into(),
                Pair::Other => Outcome::Left,
            },
            Quick::Binary { operator, to, a, b } => {
                let division = program.options.int_division;
                let value = other(operator, registers.number(a), registers.number(b), division);
                registers.set(to, value).into()
            }
            Quick::Unary { operator, to, a } => {
                let value = registers.number(a).and_then(|a| unary(operator, a).ok());
                registers.set(to, value).into()
            }
            Quick::Relate { relation, to, a, b } => {
                let holds = match registers.pair(a, b) {
                    Pair::Integers(a, b) => Some(relation.integers(a, b)),
                    Pair::Reals(a, b) => Some(relation.reals(a, b)),
                    Pair::Other => None,
                };
                holds
                    .is_some_and(|holds| registers.integer(to, Some(i32::from(holds))))
                    .into()
            }
            Quick::Branch {
                relation,
                a,
                b,
                otherwise,
            } => match registers.pair(a, b) {
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
                registers.set(to, result).into()
            }
            Quick::Function2 { builtin, to, a, b } => {
                let pair = registers.number(a).zip(registers.number(b));
                let result =
                    pair.and_then(|(a, b)| numeric(builtin, &[a, b], program.options.int_division).ok());
                registers.set(to, result).into()
            }
            Quick::Load { to, array, index } => {
                let cell = element(code, array, registers.get(index));
                let value = cell.and_then(|cell| registers.number(cell));
                registers.set(to, value).into()
            }
            Quick::Store { array, index, a } => {
                let value = registers.number(a);
                let cell = element(code, array, registers.get(index));
                cell.is_some_and(|cell| registers.set(cell, value)).into()
            }
            Quick::Flatten { to, array, a, b } => {
                let index = flat(code, array, registers.get(a), registers.get(b));
                registers.integer(to, index).into()
            }
            Quick::Fetch { to, parameter } => {
                let value = self.parameter(parameter, registers.cells);
                registers.set(to, value).into()
            }
            Quick::Put { parameter, a } => {
                let value = registers.number(a);
                self.put_parameter(parameter, value, registers.again()).into()
            }
            Quick::For(number) => self.quick_for(code, number, registers.again()),
            Quick::Next {
                variable,
                opener,
                body,
            } => self.quick_next(variable, opener, body, registers),
            Quick::Call(number) => self.quick_call(code, number, registers.cells),
            Quick::Return => match self.leave().and_then(|step| code.entries.get(step)) {
                Some(back) => Outcome::To(*back),
                None => Outcome::Left,
            },
            Quick::Choose { a, choice } => choose(code, registers.get(a), choice),
        }
    }

    #[inline(always)]
    fn parameter(&self, parameter: u32, cells: &[Cell]) -> Option<Number> {
        match *self.argument_at(self.absolute(parameter))? {
            Argument::Place(Place::Cell { cell, .. }) => cells.get(cell)?.number(),
            Argument::Place(Place::Argument(at)) => match self.argument_at(at)? {
                Argument::Number(number) => Some(*number),
                Argument::Place(_) | Argument::Vector(_) => None,
            },
            Argument::Number(number) => Some(number),
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
    fn put_parameter(&self, parameter: u32, value: Option<Number>, mut registers: Registers<'_>) -> bool {
        match self.argument_at(self.absolute(parameter)) {
            Some(Argument::Place(Place::Cell { cell, .. })) => {
                u32::try_from(*cell).is_ok_and(|cell| registers.set(cell, value))
            }
            Some(Argument::Place(Place::Argument(_)) | Argument::Number(_) | Argument::Vector(_)) | None => {
                false
            }
        }
    }

    fn quick_for(&mut self, code: &Code, number: u32, mut registers: Registers<'_>) -> Outcome {
        let Some(counted) = code.loops.get(number as usize) else {
            return Outcome::Left;
        };
        let from = registers.number(counted.from);
        let limit = registers.number(counted.to);
        let (Some(from), Some(limit), Some(step)) = (from, limit, registers.number(counted.step)) else {
            return Outcome::Left;
        };
        if !truth(step) || !registers.set(counted.variable, Some(from)) {
            return Outcome::Left;
        }
        let now = registers.number(counted.variable).unwrap_or(from);
        let opened = Loop {
            opener: counted.opener as usize,
            exit: counted.exit as usize,
            limit: Cell::from(limit),
            step: Cell::from(step),
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
        let now = registers.get(variable);
        let over = match now.integers(open.step, open.limit) {
            Some((now, step, limit)) => {
                let Some(now) = now.checked_add(step) else {
                    return Outcome::Left;
                };
                registers.integer(variable, Some(now));
                if step > 0 { now > limit } else { now < limit }
            }
            None => match counted_on(now, open.step, open.limit) {
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

    fn quick_call(&mut self, code: &Code, number: u32, cells: &[Cell]) -> Outcome {
        let Some(Called {
            arguments,
            step,
            back,
        }) = code.calls.get(number as usize)
        else {
            return Outcome::Left;
        };
        let first = self.arguments.len();
        let handed = arguments.iter().all(|handed| match self.handed(*handed, cells) {
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

    fn handed(&self, handed: Handed, cells: &[Cell]) -> Option<Argument> {
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
            Handed::Value(register) => cells.get(register as usize)?.number().map(Argument::Number),
        }
    }
}

/// The counter of a FOR one step on, and whether the loop is over. A counter that changes its kind is not for here.
#[inline(never)]
fn counted_on(now: Cell, step: Cell, limit: Cell) -> Option<(Number, bool)> {
    let (step, limit) = (step.number()?, limit.number()?);
    let sum = match (now.held(), step) {
        (Held::Integer(now), Number::Integer(step)) => Number::Integer(now.checked_add(step)?),
        (Held::Real(now), Number::Integer(step)) => Number::Real(now + step as f32),
        (Held::Real(now), Number::Real(step)) => Number::Real(now + step),
        _ => return None,
    };
    let fits = !matches!(sum, Number::Real(sum) if !sum.is_finite());
    fits.then(|| (sum, past(sum, limit, step)))
}

/// The cell of an element.
#[inline(always)]
fn element(code: &Code, array: u32, index: Cell) -> Option<Register> {
    let Array { base, length, .. } = *code.arrays.get(array as usize)?;
    let index = u32::try_from(index.as_integer()?).ok()?;
    (index < length).then(|| base.wrapping_add(index))
}

/// Two subscripts as one.
#[inline(always)]
fn flat(code: &Code, array: u32, a: Cell, b: Cell) -> Option<i32> {
    let Array { length, row, .. } = *code.arrays.get(array as usize)?;
    let a = u32::try_from(a.as_integer()?).ok()?;
    let b = u32::try_from(b.as_integer()?).ok()?;
    let index = a.checked_mul(row)?.checked_add(b)?;
    (b < row && index < length)
        .then(|| i32::try_from(index).ok())
        .flatten()
}

/// A computed GOTO.
fn choose(code: &Code, selector: Cell, choice: u32) -> Outcome {
    let (Some(number), Some(targets)) = (selector.as_integer(), code.choices.get(choice as usize)) else {
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
