//! `FOR` and `NEXT`: which loops are open, and when they are over.

use alloc::format;

use super::arithmetic::{binary, double};
use super::evaluate::Context;
use super::{Loop, Machine, Trouble};
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{FaultKind, Inputs, Number};
use crate::tree::{Binary, Variable};
use crate::value::Value;

impl Machine {
    /// Begins a FOR; returns the step that follows: the body, or what comes after NEXT.
    pub(super) fn enter(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        variable: &Variable,
        from: Value,
        opened: Loop,
    ) -> Result<usize, Trouble> {
        if double(opened.step) == 0.0 {
            return Err(Trouble::new(FaultKind::Range, "the STEP of a FOR cannot be 0"));
        }
        let place = Context {
            program,
            memory,
            inputs,
            frames: &self.frames,
            task: self.task,
        }
        .place(variable)?;
        self.write(program, memory, place, from)?;
        let now = self.counter(program, memory, inputs, variable)?;
        let (at, exit) = (self.at, opened.exit);
        let done = past(now, opened.limit, opened.step);
        if let Some(frame) = self.frames.last_mut() {
            // A jump may have left loops without their NEXT; those that do not surround this FOR are over.
            frame.loops.retain(|open| open.opener < at && at < open.exit);
            if !done {
                frame.loops.push(opened);
            }
        }
        Ok(if done { exit } else { at + 1 })
    }

    /// Executes NEXT; returns the step that follows.
    pub(super) fn next(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        opener: usize,
    ) -> Result<usize, Trouble> {
        let frame = self.frames.last_mut();
        let found = frame.and_then(|frame| {
            let at = frame.loops.iter().position(|open| open.opener == opener)?;
            frame.loops.truncate(at + 1);
            frame.loops.last().cloned()
        });
        let operation = program.steps.get(opener).map(|step| &step.operation);
        let (Some(open), Some(Operation::For { variable, .. })) = (found, operation) else {
            return Err(Trouble::new(
                FaultKind::NextWithoutFor,
                "NEXT is reached without its FOR",
            ));
        };
        let now = self.counter(program, memory, inputs, variable)?;
        let sum = binary(Binary::Add, now, open.step, program.options.int_division)?;
        let place = Context {
            program,
            memory,
            inputs,
            frames: &self.frames,
            task: self.task,
        }
        .place(variable)?;
        self.write(program, memory, place, sum)?;
        let now = self.counter(program, memory, inputs, variable)?;
        if past(now, open.limit, open.step) {
            if let Some(frame) = self.frames.last_mut() {
                frame.loops.pop();
            }
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
    ) -> Result<Number, Trouble> {
        match (Context {
            program,
            memory,
            inputs,
            frames: &self.frames,
            task: self.task,
        })
        .fetch(variable)?
        {
            Value::Integer(value) => Ok(Number::Integer(value)),
            Value::Real(value) => Ok(Number::Real(value)),
            other => {
                let message = format!(
                    "a FOR counts with a number, {} is {}",
                    variable.name.text,
                    other.kind().word()
                );
                Err(Trouble::new(FaultKind::Type, message))
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
