//! `FOR` and `NEXT`: which loops are open, and when they are over.

use crate::prelude::*;

use super::arithmetic::{binary, double};
use super::evaluate::Execution;
use super::{Loop, Machine, Result};
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

    /// Executes NEXT; returns the step that follows.
    pub fn next(&mut self, opener: usize) -> Result<usize> {
        let Machine { frames, loops, .. } = &mut *self.machine;
        let first = frames.last().map_or(0, |frame| frame.loops);
        let mine = loops.get(first..).unwrap_or_default();
        let found = mine.iter().position(|open| open.opener == opener).and_then(|at| {
            loops.truncate(first + at + 1);
            loops.last().copied()
        });
        let operation = self.program.steps.get(opener).map(|step| &step.operation);
        let (Some(open), Some(Operation::For { counting, .. })) = (found, operation) else {
            return FaultKind::NextWithoutFor.fail("NEXT is reached without its FOR");
        };
        let variable = &counting.variable;
        let now = self.counter(variable)?;
        let sum = binary(Binary::Add, now, open.step, &self.program.options)?;
        if open.is_past(self.count(variable, sum)?) {
            self.machine.loops.pop();
            return Ok(self.machine.at + 1);
        }
        Ok(opener + 1)
    }

    /// Gives the variable of a loop its next number; returns the number as the variable holds it.
    fn count(&mut self, variable: &Variable, number: Number) -> Result<Number> {
        let place = self.place(variable)?;
        self.write(place, number.into())?;
        self.counter(variable)
    }

    fn counter(&self, variable: &Variable) -> Result<Number> {
        let value = self.fetch(variable)?;
        value.number().ok_or_else(|| {
            let (name, found) = (&variable.name.text, value.kind().description());
            FaultKind::Type.error(format!("a FOR counts with a number, {name} is {found}"))
        })
    }
}

impl Loop {
    /// The counter has passed its limit in the direction of the step.
    fn is_past(&self, now: Number) -> bool {
        let (now, limit) = (double(now), double(self.limit));
        if double(self.step) > 0.0 {
            now > limit
        } else {
            now < limit
        }
    }
}
