//! `FOR` and `NEXT`: the open loops and when they end.

use crate::prelude::*;

use super::arithmetic::{binary, double, integer_overflow};
use super::evaluate::Execution;
use super::{Loop, Machine, Result};
use crate::cell::Cell;
use crate::code::Register;
use crate::program::Operation;
use crate::request::FaultKind;
use crate::tree::{Binary, Variable};
use crate::value::Number;

impl Execution<'_> {
    /// Begins a FOR; returns the step that follows: the body, or what comes after NEXT.
    pub fn begin_loop(&mut self, variable: &Variable, from: Number, opened: Loop) -> Result<usize> {
        if double(opened.step) == 0.0 {
            return FaultKind::Range.fail("the STEP of a FOR cannot be 0");
        }
        let now = self.count(variable, from)?;
        // A jump may have left loops without their NEXT: those that do not surround this FOR are over.
        let Machine {
            at, frames, loops, ..
        } = &mut *self.machine;
        let (at, first) = (*at, frames.last().map_or(0, |frame| frame.loops));
        let mut number = 0;
        loops.retain(|open| {
            number += 1;
            number <= first || (open.opener < at && at < open.exit)
        });
        if opened.is_past(now) {
            return Ok(opened.exit);
        }
        loops.push(opened);
        Ok(at + 1)
    }

    /// Executes NEXT: whether the body runs again. Almost all loops are the innermost one and count with integers in a plain
    /// variable, whose register is `counter`.
    #[inline(always)]
    pub fn next(&mut self, counter: Option<Register>, opener: usize) -> Result<bool> {
        let counting = counter.zip(self.machine.innermost(opener));
        if let Some((counter, &Loop { step, limit, .. })) = counting
            && let Some([now, step, limit]) = Cell::integers([self.cell(counter), step.into(), limit.into()])
        {
            let now = now.checked_add(step).ok_or_else(integer_overflow)?;
            self.put(counter, Number::Integer(now))?;
            let over = is_past(now, limit, step > 0);
            if over {
                self.machine.loops.pop();
            }
            return Ok(!over);
        }
        self.next_of_any(opener)
    }

    /// The same with any loop, number and variable.
    #[inline(never)]
    fn next_of_any(&mut self, opener: usize) -> Result<bool> {
        let Machine { frames, loops, .. } = &mut *self.machine;
        let first = frames.last().map_or(0, |frame| frame.loops);
        let mine = loops.get(first..).unwrap_or_default();
        let found = mine.iter().position(|open| open.opener == opener).and_then(|at| {
            // A jump has left the loops within this one.
            loops.truncate(first + at + 1);
            loops.last().copied()
        });
        let operation = self.program.steps.get(opener).map(|step| &step.operation);
        let (Some(open), Some(Operation::For { counting, .. })) = (found, operation) else {
            return FaultKind::NextWithoutFor.fail("NEXT was reached without its FOR");
        };
        let variable = &counting.variable;
        let now = self.counter(variable)?;
        let sum = binary(Binary::Add, now, open.step, &self.program.options)?;
        let over = open.is_past(self.count(variable, sum)?);
        if over {
            self.machine.loops.pop();
        }
        Ok(!over)
    }

    /// Gives the variable of a loop its next number; returns the number as the variable holds it.
    fn count(&mut self, variable: &Variable, number: Number) -> Result<Number> {
        let place = self.place(variable)?;
        self.write(place, number.into())?;
        self.counter(variable)
    }

    fn counter(&mut self, variable: &Variable) -> Result<Number> {
        let value = self.fetch(variable)?;
        value.number().ok_or_else(|| {
            let (name, found) = (&variable.name.text, value.kind().description());
            FaultKind::Type.error(format!("FOR counts with a number, but {name} is {found}"))
        })
    }
}

impl Machine {
    /// The innermost loop of the program under way, if it is the one of this FOR.
    #[inline(always)]
    fn innermost(&self, opener: usize) -> Option<&Loop> {
        let first = self.frames.last()?.loops;
        let open = self.loops.get(first..)?.last()?;
        (open.opener == opener).then_some(open)
    }
}

impl Loop {
    fn is_past(&self, now: Number) -> bool {
        is_past(double(now), double(self.limit), double(self.step) > 0.0)
    }
}

/// The counter has passed its limit in the direction of the step.
#[inline(always)]
fn is_past<T: PartialOrd + Copy>(now: T, limit: T, is_upward: bool) -> bool {
    if is_upward { now > limit } else { now < limit }
}
