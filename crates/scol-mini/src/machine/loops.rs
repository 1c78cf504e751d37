//! `FOR` and `NEXT` with numbers of any kind: which loops are open, and when they are over.
//!
//! A loop that counts with integers is counted on by its instruction (`vm`) and comes here to begin.

use alloc::format;

use super::arithmetic::{as_value, binary, double};
use super::{Loop, Machine, RuntimeError};
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{FaultKind, Inputs, Number};
use crate::tree::{Binary, Variable};
use crate::value::Value;

impl Machine {
    /// Begins a FOR; returns the step that follows: the body, or what comes after NEXT.
    pub(super) fn begin_loop(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        variable: &Variable,
        from: Value,
        opened: Loop,
    ) -> Result<usize, RuntimeError> {
        if double(opened.numbers().1) == 0.0 {
            return Err(RuntimeError::new(
                FaultKind::Range,
                "the STEP of a FOR cannot be 0",
            ));
        }
        let place = self.context(program, memory, inputs).place(variable)?;
        self.write(program, memory, place, from)?;
        let now = self.counter(program, memory, inputs, variable)?;
        let (at, exit) = (self.at, opened.exit);
        Ok(if self.open(now, opened) { at + 1 } else { exit })
    }

    /// Opens a loop unless it is over at once; a jump may have left loops without their NEXT: those that do not
    /// surround this FOR are over.
    fn open(&mut self, now: Number, opened: Loop) -> bool {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let at = opened.opener;
        let mut kept = first;
        for number in first..self.loops.len() {
            if self
                .loops
                .get(number)
                .is_some_and(|open| open.opener < at && at < open.exit)
            {
                self.loops.swap(kept, number);
                kept += 1;
            }
        }
        self.loops.truncate(kept);
        let (limit, step) = opened.numbers();
        let begins = !past(now, limit, step);
        if begins {
            self.loops.push(opened);
        }
        begins
    }

    /// Executes NEXT; returns the step that follows.
    pub(super) fn next(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        opener: usize,
    ) -> Result<usize, RuntimeError> {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let mine = self.loops.get(first..).unwrap_or_default();
        let found = mine.iter().position(|open| open.opener == opener).and_then(|at| {
            self.loops.truncate(first + at + 1);
            self.loops.last().cloned()
        });
        let operation = program.steps.get(opener).map(|step| &step.operation);
        let (Some(open), Some(Operation::For { variable, .. })) = (found, operation) else {
            return Err(RuntimeError::new(
                FaultKind::NextWithoutFor,
                "NEXT is reached without its FOR",
            ));
        };
        let now = self.counter(program, memory, inputs, variable)?;
        let (limit, step) = open.numbers();
        let sum = as_value(binary(Binary::Add, now, step, &program.options)?);
        let place = self.context(program, memory, inputs).place(variable)?;
        self.write(program, memory, place, sum)?;
        let now = self.counter(program, memory, inputs, variable)?;
        if past(now, limit, step) {
            self.loops.pop();
            return Ok(self.at + 1);
        }
        Ok(opener + 1)
    }

    fn counter(
        &self,
        program: &Program,
        memory: &Memory,
        inputs: &dyn Inputs,
        variable: &Variable,
    ) -> Result<Number, RuntimeError> {
        match self.context(program, memory, inputs).fetch(variable)? {
            Value::Integer(value) => Ok(Number::Integer(value)),
            Value::Real(value) => Ok(Number::Real(value)),
            other => {
                let message = format!(
                    "a FOR counts with a number, {} is {}",
                    variable.name.text,
                    other.kind().description()
                );
                Err(RuntimeError::new(FaultKind::Type, message))
            }
        }
    }
}

/// The counter has passed its limit in the direction of the step.
fn past(now: Number, limit: Number, step: Number) -> bool {
    let (now, limit) = (double(now), double(limit));
    if double(step) > 0.0 {
        now > limit
    } else {
        now < limit
    }
}
