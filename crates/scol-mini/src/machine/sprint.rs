//! Runs the quick form of a program: statements that compute with numbers, as many as there are in a row. What every
//! round of a loop does is done here, when the kinds are those one expects; the rest is left to `quick`, and what that
//! leaves, to the steps.

use super::Machine;
use super::circle;
use super::registers::{Registers, Rules, root};
use super::vm::StepOutcome;
use crate::MAX_CALL_NESTING;
use crate::cell::Cell;
use crate::code::{Code, ElementRef, Instruction, Quick, Register, Target};
use crate::memory::Memory;
use crate::program::Program;

/// So many targets of a computed GOTO are looked at one by one.
const FORESEEN: usize = 8;

/// What instructions ask of the machine.
#[derive(Clone, Copy)]
struct LoopContext {
    /// The step of the innermost loop of this program, and its numbers; `usize::MAX` when none is open.
    opener: usize,
    limit: Cell,
    step: Cell,
    /// One more call may be made.
    room: bool,
}

impl Machine {
    /// Runs quick statements until one has to be done by its step; `true` when the fuel is used up before.
    pub(super) fn sprint(&mut self, program: &Program, memory: &mut Memory, fuel: &mut u32) -> bool {
        let code = &program.code;
        let Some(entry) = code.entries.get(self.at) else {
            return false;
        };
        let mut at = usize::from(*entry);
        let (cells, of) = (memory.registers(), Rules::of(program));
        let instructions = code.instructions.as_slice();
        let mut left = *fuel;
        let mut around = self.around();
        let empty = 'block: loop {
            let Some(Instruction { charge, .. }) = instructions.get(at) else {
                break false;
            };
            let charge = u32::from(*charge);
            if left < charge {
                let empty;
                (empty, at, left) = self.single_step(program, Registers::new(cells, of), at, left);
                break empty;
            }
            left -= charge;
            loop {
                let Some(Instruction { operation, .. }) = instructions.get(at) else {
                    break 'block false;
                };
                // Anew for each instruction: what lives longer would be kept in memory.
                let registers = Registers::new(cells, of);
                match run_fast(registers, code, operation, &around) {
                    Some(Next::On(by)) => {
                        at += by;
                        continue;
                    }
                    Some(Next::To(target)) => {
                        at = usize::from(target);
                        continue 'block;
                    }
                    Some(Next::Past) => {
                        at += 1;
                        continue 'block;
                    }
                    None => {}
                }
                match self.quick(program, operation, &mut Registers::new(cells, of)) {
                    StepOutcome::On if operation.ends() => {
                        at += 1;
                        around = self.around();
                        continue 'block;
                    }
                    StepOutcome::On => {
                        left += refund(code, at);
                        at += 1;
                    }
                    StepOutcome::To(target) => {
                        at = usize::from(target);
                        around = self.around();
                        continue 'block;
                    }
                    StepOutcome::Left => {
                        left += remaining_charge(code, at) + step_cost(code, at);
                        break 'block false;
                    }
                }
            }
        };
        *fuel = left;
        if let Some(call) = code.call_around(at) {
            // From here on it is a call like any other.
            self.quick_call(code, call, cells);
        }
        if let Some(step) = code.steps.get(at) {
            self.at = *step as usize;
        }
        empty
    }

    /// Runs the last statements for which there is fuel, one by one, until it is used up (`true`) or one has to be done
    /// by its step (`false`); returns also where that is, and the fuel that is left.
    #[cold]
    fn single_step(
        &mut self,
        program: &Program,
        mut registers: Registers<'_>,
        mut at: usize,
        mut left: u32,
    ) -> (bool, usize, u32) {
        let code = &program.code;
        loop {
            let (Some(instruction), Some(cost)) = (code.instructions.get(at), code.costs.get(at)) else {
                return (false, at, left);
            };
            let Some(rest) = left.checked_sub(u32::from(*cost)) else {
                return (true, at, left);
            };
            left = rest;
            match self.quick(program, &instruction.operation, &mut registers) {
                StepOutcome::On => at += 1,
                StepOutcome::To(target) => at = usize::from(target),
                StepOutcome::Left => return (false, at, left + step_cost(code, at)),
            }
        }
    }

    fn around(&self) -> LoopContext {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let open = self.loops.get(first..).and_then(<[super::Loop]>::last);
        LoopContext {
            opener: open.map_or(usize::MAX, |open| open.opener),
            limit: open.map_or(Cell::EMPTY, |open| open.limit),
            step: open.map_or(Cell::EMPTY, |open| open.step),
            room: self.frames.len() <= MAX_CALL_NESTING,
        }
    }
}

/// What the step of an instruction has cost: it begins anew, and pays anew.
fn step_cost(code: &Code, at: usize) -> u32 {
    let step = code.steps.get(at).map_or(0, |step| *step as usize);
    let first = code.entries.get(step);
    let cost = first.and_then(|first| code.costs.get(usize::from(*first)));
    cost.map_or(0, |cost| u32::from(*cost))
}

/// What has been charged for the instructions behind this one, in its block.
fn remaining_charge(code: &Code, at: usize) -> u32 {
    let charge = code
        .instructions
        .get(at)
        .map_or(0, |found| u32::from(found.charge));
    let cost = code.costs.get(at).map_or(0, |cost| u32::from(*cost));
    charge.saturating_sub(cost)
}

/// What has been charged too much when an instruction did nothing, and the next one does its work.
fn refund(code: &Code, at: usize) -> u32 {
    let next = code
        .instructions
        .get(at + 1)
        .map_or(0, |next| u32::from(next.charge));
    remaining_charge(code, at).saturating_sub(next)
}

/// Where an instruction leads.
enum Next {
    /// So many instructions on, in the same block.
    On(usize),
    To(Target),
    /// To the next instruction, in another block.
    Past,
}

impl Registers<'_> {
    /// The counter of a loop one step on, unless that ends it.
    #[inline(always)]
    fn count_on(&mut self, variable: Register, around: &LoopContext) -> Option<()> {
        let now = self.read(variable)?;
        let [now, step, limit] = Cell::integers([now, around.step, around.limit])?;
        let now = now.checked_add(step)?;
        let over = if step > 0 { now > limit } else { now < limit };
        if over {
            return None;
        }
        *self.cells.get_mut(usize::from(variable))? = Cell::integer(now);
        Some(())
    }
}

/// Stands on one of two ways, to keep them apart: were they joined in a choice between two numbers, the processor could
/// not go on before the numbers are compared, while it foresees most jumps.
#[cold]
#[inline]
fn likely() {}

/// The target of a computed GOTO, counted from 1.
#[inline(always)]
fn chosen(targets: &[Target], number: i32) -> Option<Target> {
    let mut counted = 0;
    for target in targets.iter().take(FORESEEN) {
        counted += 1;
        // As in `foreseen`: one by one, so that the processor need not wait for the number to know where to go on.
        if core::hint::black_box(number) == counted {
            return Some(*target);
        }
    }
    let at = usize::try_from(number).ok()?.checked_sub(1)?;
    targets.get(at).copied()
}

/// Beyond the instructions that an element without an offset replaces, and one more with an offset, if it was done.
#[inline(always)]
fn beyond(done: Option<()>, element: ElementRef, by: usize) -> Next {
    if done.is_none() {
        return Next::On(1);
    }
    if element.offset == 0 {
        return Next::On(by);
    }
    likely();
    Next::On(by + 1)
}

/// Does an instruction as long as nothing is special; returns the one that follows. `None`: nothing has happened, and
/// `quick` has to do it.
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "a flat match, one arm an instruction")]
fn run_fast(
    mut registers: Registers<'_>,
    code: &Code,
    operation: &Quick,
    around: &LoopContext,
) -> Option<Next> {
    match *operation {
        Quick::Jump(target) => Some(Next::To(target)),
        Quick::Copy { to, a } => {
            let value = registers.read(a)?;
            registers.put(to, value)?;
            Some(Next::On(1))
        }
        Quick::Add { to, a, b } => {
            registers.arithmetic((to, a, b), i32::checked_add, |a, b| a + b)?;
            Some(Next::On(1))
        }
        Quick::Subtract { to, a, b } => {
            registers.arithmetic((to, a, b), i32::checked_sub, |a, b| a - b)?;
            Some(Next::On(1))
        }
        Quick::Multiply { to, a, b } => {
            registers.arithmetic((to, a, b), i32::checked_mul, |a, b| a * b)?;
            Some(Next::On(1))
        }
        Quick::Divide { to, a, b } => {
            // Nothing is divided by 0: that is not finite.
            registers.arithmetic((to, a, b), i32::checked_div, |a, b| a / b)?;
            Some(Next::On(1))
        }
        Quick::Modulo { to, a, b } => {
            let [a, b] = Cell::integers([registers.read(a)?, registers.read(b)?])?;
            registers.put_integer(to, a.checked_rem(b)?)?;
            Some(Next::On(1))
        }
        Quick::Branch {
            relation,
            a,
            b,
            then,
            otherwise,
        }
        | Quick::JumpBranch {
            relation,
            a,
            b,
            then,
            otherwise,
        } => {
            if registers.holds(relation, a, b)? {
                return Some(Next::To(then));
            }
            likely();
            Some(Next::To(otherwise))
        }
        Quick::Root { to, a } => {
            let a = registers.read_real(a)?;
            registers.put_real(to, root(a)?)?;
            Some(Next::On(1))
        }
        Quick::Sine { to, a } => {
            let a = registers.read_real(a)?;
            registers.put_real(to, circle::sine(a)?)?;
            Some(Next::On(1))
        }
        Quick::Cosine { to, a } => {
            let a = registers.read_real(a)?;
            registers.put_real(to, circle::cosine(a)?)?;
            Some(Next::On(1))
        }
        Quick::Load { to, array, index } => {
            let value = registers.loaded(ElementRef {
                array,
                index,
                offset: 0,
            })?;
            registers.put(to, value)?;
            Some(Next::On(1))
        }
        Quick::Store { array, index, a } => {
            let value = registers.read(a)?;
            registers.put(
                registers.element(ElementRef {
                    array,
                    index,
                    offset: 0,
                })?,
                value,
            )?;
            Some(Next::On(1))
        }
        Quick::Next {
            variable,
            opener,
            body,
        } => {
            if around.opener != usize::from(opener) {
                return None;
            }
            registers.count_on(variable, around)?;
            Some(Next::To(body))
        }
        Quick::Enter(target) => around.room.then_some(Next::To(target)),
        Quick::Choose { a, first, count } => {
            let number = registers.read(a)?.as_integer()?;
            let targets = code
                .choices
                .get(usize::from(first)..)?
                .get(..usize::from(count))?;
            Some(chosen(targets, number).map_or(Next::Past, Next::To))
        }
        Quick::MultiplyAdd { to, a, b, c } => {
            let done = registers.multiplied(to, [a, b, c], i32::checked_add, |c, it| c + it);
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::MultiplyFrom { to, a, b, c } => {
            let done = registers.multiplied(to, [a, b, c], i32::checked_sub, |c, it| c - it);
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::LoadNear { to, element } => {
            let done = registers
                .loaded(element)
                .and_then(|value| registers.put(to, value));
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::LoadAdd { to, element, with } => {
            let done = registers
                .loaded(element)
                .and_then(|it| registers.combine(to, (with, it), i32::checked_add, |with, it| with + it));
            Some(beyond(done, element, 3))
        }
        Quick::LoadJoin {
            join,
            to,
            element,
            with,
        } => {
            let done = registers.loaded(element).and_then(|it| {
                registers.combine(
                    to,
                    (with, it),
                    |with, it| join.integers(with, it),
                    |with, it| join.reals(with, it),
                )
            });
            Some(beyond(done, element, 3))
        }
        Quick::UpdateAdd { index, element, with } => {
            let place = ElementRef {
                index,
                offset: 0,
                ..element
            };
            let done = registers.loaded(element).and_then(|it| {
                let to = registers.element(place)?;
                registers.combine(to, (with, it), i32::checked_add, |with, it| with + it)
            });
            Some(beyond(done, element, 4))
        }
        Quick::RootJoin { join, to, a, with } => {
            let done = registers.joined(root, a, to, join, with);
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::SineJoin { join, to, a, with } => {
            let done = registers.joined(circle::sine, a, to, join, with);
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::CosineJoin { join, to, a, with } => {
            let done = registers.joined(circle::cosine, a, to, join, with);
            Some(Next::On(if done.is_some() { 3 } else { 1 }))
        }
        Quick::RootScaled {
            join,
            to,
            a,
            by,
            with,
        } => {
            let done = registers.scaled(root, (a, by), to, join, with);
            Some(Next::On(if done.is_some() { 4 } else { 1 }))
        }
        Quick::SineScaled {
            join,
            to,
            a,
            by,
            with,
        } => {
            let done = registers.scaled(circle::sine, (a, by), to, join, with);
            Some(Next::On(if done.is_some() { 4 } else { 1 }))
        }
        Quick::CosineScaled {
            join,
            to,
            a,
            by,
            with,
        } => {
            let done = registers.scaled(circle::cosine, (a, by), to, join, with);
            Some(Next::On(if done.is_some() { 4 } else { 1 }))
        }
        Quick::GuardedAdd {
            relation,
            to,
            a,
            b,
            by,
        } => {
            registers.guarded((relation, a, b), (to, by), i32::checked_add, |c, by| c + by)?;
            Some(Next::On(3))
        }
        Quick::GuardedSubtract {
            relation,
            to,
            a,
            b,
            by,
        } => {
            registers.guarded((relation, a, b), (to, by), i32::checked_sub, |c, by| c - by)?;
            Some(Next::On(3))
        }
        Quick::GuardedCopy {
            relation,
            to,
            a,
            b,
            by,
        } => {
            registers.guarded((relation, a, b), (to, by), |_, by| Some(by), |_, by| by)?;
            Some(Next::On(3))
        }
        // All by name: then the processor looks up where to go without asking whether it is in the list.
        Quick::Leave
        | Quick::Binary { .. }
        | Quick::Unary { .. }
        | Quick::Relate { .. }
        | Quick::Truth { .. }
        | Quick::Function { .. }
        | Quick::Function2 { .. }
        | Quick::Flatten { .. }
        | Quick::Fetch { .. }
        | Quick::Put { .. }
        | Quick::Hand { .. }
        | Quick::For(_)
        | Quick::Call(_)
        | Quick::Return => None,
    }
}
