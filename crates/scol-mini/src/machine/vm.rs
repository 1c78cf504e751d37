//! Does the instructions of the quick form, whatever the kinds of the numbers; `sprint` does most of them faster. What
//! an instruction cannot do (a value is missing, a result does not fit, a list is no number) is left to the step it
//! belongs to, from its beginning; so faults, their words and their lines are those of the steps alone.

use super::arithmetic::{binary, truncated, truth, unary};
use super::functions::numeric;
use super::loops::past;
use super::place::{Argument, Place};
use super::registers::Registers;
use super::{Frame, Loop, Machine};
use crate::MAX_CALL_NESTING;
use crate::builtin::Builtin;
use crate::cell::{Cell, Held, Pair};
use crate::code::{Array, Called, Code, Handed, Quick, Register, TEMPORARIES, Target};
use crate::options::LanguageOptions;
use crate::program::Program;
use crate::request::Number;
use crate::tree::Binary;

impl Registers<'_> {
    fn get(&self, register: Register) -> Cell {
        self.cells
            .get(usize::from(register))
            .copied()
            .unwrap_or(Cell::EMPTY)
    }

    /// Stores a number of any kind for a parameter.
    fn hand(&mut self, to: Register, a: Register) -> bool {
        match (self.number(a), self.cells.get_mut(usize::from(to))) {
            (Some(number), Some(place)) => {
                *place = Cell::from(number);
                true
            }
            _ => false,
        }
    }

    fn pair(&self, a: Register, b: Register) -> Pair {
        self.get(a).pair(self.get(b))
    }

    fn number(&self, register: Register) -> Option<Number> {
        self.get(register).number()
    }

    /// Stores a number as the kind the variable has; `false` when that cannot be done here.
    fn integer(&mut self, register: Register, value: Option<i32>) -> bool {
        match (self.cells.get_mut(usize::from(register)), value) {
            (Some(place), Some(value)) if place.is_integer() => {
                *place = Cell::integer(value);
                true
            }
            (_, value) => change(self.cells, self.temporaries, register, value.map(Number::Integer)),
        }
    }

    /// As [`Registers::integer`]; what is not finite does not fit.
    fn real(&mut self, register: Register, value: f32) -> bool {
        match self.cells.get_mut(usize::from(register)) {
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

    fn set(&mut self, register: Register, value: Option<Number>) -> bool {
        match value {
            Some(Number::Integer(value)) => self.integer(register, Some(value)),
            Some(Number::Real(value)) => self.real(register, value),
            None => false,
        }
    }

    /// The same cells, for a function that is not a part of the loop.
    fn again(&mut self) -> Registers<'_> {
        Registers {
            cells: self.cells,
            temporaries: self.temporaries,
            within: self.within,
        }
    }
}

/// Stores a number as the kind of what it replaces; a temporary takes any.
#[inline(never)]
fn change(cells: &mut [Cell], temporaries: usize, register: Register, value: Option<Number>) -> bool {
    let temporary = (usize::from(register)).checked_sub(temporaries);
    let (Some(place), Some(value)) = (cells.get_mut(usize::from(register)), value) else {
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
fn other(
    operator: Binary,
    a: Option<Number>,
    b: Option<Number>,
    options: &LanguageOptions,
) -> Option<Number> {
    binary(operator, a?, b?, options).ok()
}

/// What came of an instruction.
pub(super) enum StepOutcome {
    /// The next one follows.
    On,
    /// This one follows.
    To(Target),
    /// The step has to do it.
    Left,
}

impl From<bool> for StepOutcome {
    fn from(done: bool) -> Self {
        if done { StepOutcome::On } else { StepOutcome::Left }
    }
}

impl Machine {
    /// Does any instruction.
    #[inline(never)]
    #[expect(clippy::too_many_lines, reason = "a flat match, one arm an instruction")]
    pub(super) fn quick(
        &mut self,
        program: &Program,
        operation: &Quick,
        registers: &mut Registers<'_>,
    ) -> StepOutcome {
        let code = &program.code;
        match *operation {
            Quick::Leave => StepOutcome::Left,
            Quick::Jump(target) => StepOutcome::To(target),
            // The instructions they stand for follow.
            Quick::MultiplyAdd { .. }
            | Quick::MultiplyFrom { .. }
            | Quick::LoadNear { .. }
            | Quick::LoadJoin { .. }
            | Quick::LoadAdd { .. }
            | Quick::UpdateAdd { .. }
            | Quick::RootJoin { .. }
            | Quick::SineJoin { .. }
            | Quick::CosineJoin { .. }
            | Quick::RootScaled { .. }
            | Quick::SineScaled { .. }
            | Quick::CosineScaled { .. }
            | Quick::JumpBranch { .. }
            | Quick::GuardedAdd { .. }
            | Quick::GuardedSubtract { .. }
            | Quick::GuardedCopy { .. } => StepOutcome::On,
            Quick::Copy { to, a } => {
                let value = registers.number(a);
                registers.set(to, value).into()
            }
            Quick::Add { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_add(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a + b).into(),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Subtract { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_sub(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a - b).into(),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Multiply { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_mul(b)).into(),
                Pair::Reals(a, b) => registers.real(to, a * b).into(),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Divide { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_div(b)).into(),
                // Nothing is divided by 0: that is not finite.
                Pair::Reals(a, b) => registers.real(to, a / b).into(),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Modulo { to, a, b } => match registers.pair(a, b) {
                Pair::Integers(a, b) => registers.integer(to, a.checked_rem(b)).into(),
                Pair::Reals(a, b) => registers.real(to, libm::fmodf(a, b)).into(),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Binary { operator, to, a, b } => {
                let (a, b) = (registers.number(a), registers.number(b));
                let value = other(operator, a, b, &program.options);
                registers.set(to, value).into()
            }
            Quick::Unary { operator, to, a } => {
                let value = registers.number(a).and_then(|a| unary(operator, a).ok());
                registers.set(to, value).into()
            }
            Quick::Relate { relation, to, a, b } => {
                let holds = match registers.pair(a, b) {
                    Pair::Integers(a, b) => Some(relation.integers(a, b)),
                    Pair::Reals(a, b) => Some(relation.reals(a, b, registers.within)),
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
                then,
                otherwise,
            } => match registers.pair(a, b) {
                Pair::Integers(a, b) if relation.integers(a, b) => StepOutcome::To(then),
                Pair::Reals(a, b) if relation.reals(a, b, registers.within) => StepOutcome::To(then),
                Pair::Integers(..) | Pair::Reals(..) => StepOutcome::To(otherwise),
                Pair::Other => StepOutcome::Left,
            },
            Quick::Truth { a, then, otherwise } => match registers.number(a) {
                Some(value) if truth(value) => StepOutcome::To(then),
                Some(_) => StepOutcome::To(otherwise),
                None => StepOutcome::Left,
            },
            Quick::Function { builtin, to, a } => function(program, builtin, to, &[a], registers).into(),
            Quick::Root { to, a } => function(program, Builtin::Sqrt, to, &[a], registers).into(),
            Quick::Sine { to, a } => function(program, Builtin::Sin, to, &[a], registers).into(),
            Quick::Cosine { to, a } => function(program, Builtin::Cos, to, &[a], registers).into(),
            Quick::Function2 { builtin, to, a, b } => {
                function(program, builtin, to, &[a, b], registers).into()
            }
            Quick::Load { to, array, index } => {
                let cell = element(array, registers.get(index));
                let value = cell.and_then(|cell| registers.number(cell));
                registers.set(to, value).into()
            }
            Quick::Store { array, index, a } => {
                let value = registers.number(a);
                let cell = element(array, registers.get(index));
                cell.is_some_and(|cell| registers.set(cell, value)).into()
            }
            Quick::Flatten {
                to,
                a,
                b,
                row,
                length,
            } => {
                let index = flat(row, length, registers.get(a), registers.get(b));
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
            Quick::Hand { to, a } => registers.hand(to, a).into(),
            Quick::For(number) => self.quick_for(code, number, registers.again()),
            Quick::Next {
                variable,
                opener,
                body,
            } => self.quick_next(variable, opener, body, registers),
            Quick::Call(number) => self.quick_call(code, number, registers.cells),
            Quick::Enter(_) if self.frames.len() > MAX_CALL_NESTING => StepOutcome::Left,
            Quick::Enter(target) => StepOutcome::To(target),
            Quick::Return => match self.leave().and_then(|step| code.entries.get(step)) {
                Some(back) => StepOutcome::To(*back),
                None => StepOutcome::Left,
            },
            Quick::Choose { a, first, count } => choose(code, registers.get(a), first, count),
        }
    }

    fn parameter(&self, parameter: u16, cells: &[Cell]) -> Option<Number> {
        match *self.argument_at(self.absolute(parameter))? {
            Argument::Place(Place::Cell { cell, .. }) => cells.get(cell)?.number(),
            Argument::Place(Place::Argument(at)) => match self.argument_at(at)? {
                Argument::Number(number) => Some(*number),
                Argument::Place(_) | Argument::Vector(_) | Argument::Unset => None,
            },
            Argument::Number(number) => Some(number),
            Argument::Vector(_) | Argument::Unset => None,
        }
    }

    fn argument_at(&self, at: usize) -> Option<&Argument> {
        self.arguments.get(at)
    }

    /// The number of a parameter in the stack of arguments.
    fn absolute(&self, parameter: u16) -> usize {
        self.frames.last().map_or(0, |frame| frame.arguments) + usize::from(parameter)
    }

    /// Only a variable of the caller is written here.
    fn put_parameter(&self, parameter: u16, value: Option<Number>, mut registers: Registers<'_>) -> bool {
        match self.argument_at(self.absolute(parameter)) {
            Some(Argument::Place(Place::Cell { cell, .. })) => {
                Register::try_from(*cell).is_ok_and(|cell| registers.set(cell, value))
            }
            Some(
                Argument::Place(Place::Argument(_))
                | Argument::Number(_)
                | Argument::Vector(_)
                | Argument::Unset,
            )
            | None => false,
        }
    }

    fn quick_for(&mut self, code: &Code, number: u16, mut registers: Registers<'_>) -> StepOutcome {
        let Some(counted) = code.loops.get(usize::from(number)) else {
            return StepOutcome::Left;
        };
        let from = registers.number(counted.from);
        let limit = registers.number(counted.to);
        let (Some(from), Some(limit), Some(step)) = (from, limit, registers.number(counted.step)) else {
            return StepOutcome::Left;
        };
        if !truth(step) || !registers.set(counted.variable, Some(from)) {
            return StepOutcome::Left;
        }
        let now = registers.number(counted.variable).unwrap_or(from);
        let opened = Loop {
            opener: counted.opener as usize,
            exit: counted.exit as usize,
            limit: Cell::from(limit),
            step: Cell::from(step),
        };
        if self.open(now, opened) {
            return StepOutcome::On;
        }
        code.entries
            .get(counted.exit as usize)
            .map_or(StepOutcome::Left, |exit| StepOutcome::To(*exit))
    }

    fn quick_next(
        &mut self,
        variable: Register,
        opener: u16,
        body: Target,
        registers: &mut Registers<'_>,
    ) -> StepOutcome {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let Some(open) = self.loops.get(first..).and_then(<[Loop]>::last) else {
            return StepOutcome::Left;
        };
        if open.opener != usize::from(opener) {
            return StepOutcome::Left;
        }
        let now = registers.get(variable);
        let over = match Cell::integers([now, open.step, open.limit]) {
            Some([now, step, limit]) => {
                let Some(now) = now.checked_add(step) else {
                    return StepOutcome::Left;
                };
                registers.integer(variable, Some(now));
                if step > 0 { now > limit } else { now < limit }
            }
            None => match counted_on(now, open.step, open.limit) {
                Some((now, over)) => {
                    registers.set(variable, Some(now));
                    over
                }
                None => return StepOutcome::Left,
            },
        };
        if over {
            self.loops.pop();
            return StepOutcome::On;
        }
        StepOutcome::To(body)
    }

    pub(super) fn quick_call(&mut self, code: &Code, number: u16, cells: &[Cell]) -> StepOutcome {
        let Some(Called {
            arguments,
            step,
            back,
        }) = code.calls.get(usize::from(number))
        else {
            return StepOutcome::Left;
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
            return StepOutcome::Left;
        };
        self.frames.push(Frame {
            return_to: *back as usize,
            arguments: first,
            loops: self.loops.len(),
        });
        StepOutcome::To(*target)
    }

    fn handed(&self, handed: Handed, cells: &[Cell]) -> Option<Argument> {
        match handed {
            Handed::Variable { slot, cell } => Some(Argument::Place(Place::Cell {
                slot: slot as usize,
                cell: usize::from(cell),
            })),
            Handed::Parameter(parameter) => {
                let at = self.absolute(parameter);
                match self.argument_at(at)? {
                    Argument::Place(place) => Some(Argument::Place(*place)),
                    Argument::Number(_) | Argument::Vector(_) | Argument::Unset => {
                        Some(Argument::Place(Place::Argument(at)))
                    }
                }
            }
            Handed::Value(register) => cells.get(usize::from(register))?.number().map(Argument::Number),
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

/// A function of these numbers.
fn function(
    program: &Program,
    builtin: Builtin,
    to: Register,
    of: &[Register],
    registers: &mut Registers<'_>,
) -> bool {
    let mut numbers = [Number::Integer(0); 2];
    for (number, register) in numbers.iter_mut().zip(of) {
        match registers.number(*register) {
            Some(found) => *number = found,
            None => return false,
        }
    }
    let numbers = numbers.get(..of.len()).unwrap_or_default();
    let result = numeric(builtin, numbers, &program.options).ok();
    registers.set(to, result)
}

/// The cell of an element.
fn element(array: Array, index: Cell) -> Option<Register> {
    let index = u16::try_from(index.as_integer()?).ok()?;
    (index < array.length).then(|| array.base.wrapping_add(index))
}

/// Two subscripts as one.
fn flat(row: u16, length: u16, a: Cell, b: Cell) -> Option<i32> {
    let a = u32::try_from(a.as_integer()?).ok()?;
    let b = u32::try_from(b.as_integer()?).ok()?;
    let index = a.checked_mul(u32::from(row))?.checked_add(b)?;
    (b < u32::from(row) && index < u32::from(length))
        .then(|| i32::try_from(index).ok())
        .flatten()
}

/// A computed GOTO.
fn choose(code: &Code, selector: Cell, first: u16, count: u16) -> StepOutcome {
    let Some(number) = selector.as_integer() else {
        return StepOutcome::Left;
    };
    let chosen = usize::try_from(number)
        .ok()
        .and_then(|number| number.checked_sub(1));
    let target = chosen
        .filter(|at| *at < usize::from(count))
        .and_then(|at| code.choices.get(usize::from(first) + at));
    target.map_or(StepOutcome::On, |target| StepOutcome::To(*target))
}
