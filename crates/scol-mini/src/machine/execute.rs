//! Executes the operation of one step. Assignments, branches and calls are done here; everything that touches the world
//! becomes a request (`request_values`).
//!
//! Which loops are open is decided here too; monitors are in `monitor`.

use super::arithmetic::{binary, double};
use super::evaluate::{Context, World, component, no_component};
use super::{Frame, Loop, Machine, Result, RunPhase};
use crate::MAX_CALL_NESTING;
use crate::prelude::*;
use crate::program::Operation;
use crate::request::FaultKind;
use crate::tree::{Assignment, Binary, Expression, Simple, Variable};
use crate::value::Number;

impl Machine {
    /// Executes the step at `at` and moves on, unless it asks for something, ends the program or is a WAIT that goes on
    /// waiting: then the state says so.
    pub(super) fn execute(&mut self, world: &mut World<'_>, operation: &Operation) -> Result<()> {
        let context = self.context(world);
        let mut next = self.at + 1;
        match operation {
            Operation::Simple(simple) => return self.simple(world, simple),
            Operation::Wait(condition) => {
                if !context.truth(condition)? {
                    self.state = RunPhase::Waiting;
                    return Ok(());
                }
            }
            Operation::Branch { condition, otherwise } => {
                if !context.truth(condition)? {
                    next = *otherwise;
                }
            }
            Operation::Jump(target) => next = *target,
            Operation::Select { selector, targets } => {
                // Counted from 1; the next statement follows when the number names none of them.
                let number = usize::try_from(context.integer(selector)?).unwrap_or(0);
                let target = number.checked_sub(1).and_then(|at| targets.get(at));
                next = target.copied().unwrap_or(next);
            }
            Operation::For { counting, exit } => {
                let limit = context.number(&counting.to)?;
                let step = counting.step.as_ref().map(|step| context.number(step));
                let step = step.transpose()?;
                let from = context.number(&counting.from)?;
                let opened = Loop {
                    opener: self.at,
                    exit: *exit,
                    limit,
                    step: step.unwrap_or(Number::Integer(1)),
                };
                next = self.begin_loop(world, &counting.variable, from, opened)?;
            }
            Operation::Next { opener } => next = self.next(world, *opener)?,
            Operation::Call { block, arguments } => {
                self.call(world, next, arguments)?;
                let entry = world.program.blocks.get(*block);
                next = entry.map_or(world.program.steps.len(), |entry| entry.step);
            }
            Operation::On { condition, after, .. } => {
                let value = context.truth(condition)?;
                self.start_monitor(value)?;
                next = *after;
            }
            Operation::HandlerEnd => {
                self.state = RunPhase::Ended;
                return Ok(());
            }
            // Always an instruction.
            Operation::Return => {}
        }
        self.at = next;
        Ok(())
    }

    /// Enters a program: its arguments are evaluated, then it gets a frame. A fault leaves nothing behind.
    fn call(&mut self, world: &World<'_>, return_to: usize, arguments: &[Expression]) -> Result<()> {
        let first = self.arguments.len();
        for expression in arguments {
            let argument = self.context(world).argument(expression);
            let argument = argument.inspect_err(|_| self.arguments.truncate(first))?;
            self.arguments.push(argument);
        }
        if self.push_frame(first, return_to) {
            return Ok(());
        }
        FaultKind::Nesting.fail(format!("calls are nested more than {MAX_CALL_NESTING} deep"))
    }

    /// Gives a program, whose arguments are those from `first` on, its frame; `false`, and the arguments gone, when calls
    /// are nested too deep.
    pub(super) fn push_frame(&mut self, first: usize, return_to: usize) -> bool {
        // The main program is a frame too.
        let fits = self.frames.len() <= MAX_CALL_NESTING;
        if fits {
            self.frames.push(Frame {
                return_to,
                arguments: first,
                loops: self.loops.len(),
            });
        } else {
            self.arguments.truncate(first);
        }
        fits
    }

    /// Back to where the program was called; `None` when it was not.
    pub(super) fn pop_frame(&mut self) -> Option<usize> {
        let depth = self.frames.len().checked_sub(1).filter(|depth| *depth > 0)?;
        let back = self.frames.last()?.return_to;
        self.unwind(depth);
        self.drop_jump_monitors();
        Some(back)
    }

    fn simple(&mut self, world: &mut World<'_>, simple: &Simple) -> Result<()> {
        match simple {
            Simple::Assign(assignment) => self.assign(world, assignment)?,
            Simple::Change(change) => {
                let conditions = self.context(world).changed(change)?;
                *world.memory.conditions_mut() = conditions;
            }
            Simple::Monitors(on) => self.monitors_enabled = *on,
            Simple::Ignore => self.monitors.clear(),
            Simple::Ask(ask) => {
                self.state = RunPhase::Requested(self.context(world).request(ask)?);
                return Ok(());
            }
        }
        self.at += 1;
        Ok(())
    }

    fn assign(&mut self, world: &mut World<'_>, assignment: &Assignment) -> Result<()> {
        let target = &assignment.target;
        let context = self.context(world);
        let mut value = context.evaluate(&assignment.value)?;
        let place = context.place(target)?;
        if let Some(letter) = assignment.component {
            let number = value.number().ok_or_else(|| {
                FaultKind::Type.error(format!(
                    "a coordinate is a number, found {}",
                    value.kind().description()
                ))
            })?;
            value = context.fetch(target)?;
            match component(world.program.options.arm, &mut value, letter) {
                Some(coordinate) => *coordinate = double(number),
                None => return Err(no_component(&value, letter)),
            }
        }
        self.write(world, place, value)
    }

    /// Begins a FOR; returns the step that follows: the body, or what comes after NEXT.
    fn begin_loop(
        &mut self,
        world: &mut World<'_>,
        variable: &Variable,
        from: Number,
        opened: Loop,
    ) -> Result<usize> {
        if double(opened.step) == 0.0 {
            return FaultKind::Range.fail("the STEP of a FOR cannot be 0");
        }
        let now = self.count(world, variable, from)?;
        // A jump may have left loops without their NEXT: those that do not surround this FOR are over.
        let (at, first) = (self.at, self.frames.last().map_or(0, |frame| frame.loops));
        let mut number = 0;
        self.loops.retain(|open| {
            number += 1;
            number <= first || (open.opener < at && at < open.exit)
        });
        if opened.is_past(now) {
            return Ok(opened.exit);
        }
        self.loops.push(opened);
        Ok(at + 1)
    }

    /// Executes NEXT; returns the step that follows.
    fn next(&mut self, world: &mut World<'_>, opener: usize) -> Result<usize> {
        let first = self.frames.last().map_or(0, |frame| frame.loops);
        let mine = self.loops.get(first..).unwrap_or_default();
        let found = mine.iter().position(|open| open.opener == opener).and_then(|at| {
            self.loops.truncate(first + at + 1);
            self.loops.last().copied()
        });
        let operation = world.program.steps.get(opener).map(|step| &step.operation);
        let (Some(open), Some(Operation::For { counting, .. })) = (found, operation) else {
            return FaultKind::NextWithoutFor.fail("NEXT is reached without its FOR");
        };
        let variable = &counting.variable;
        let now = self.context(world).counter(variable)?;
        let sum = binary(Binary::Add, now, open.step, &world.program.options)?;
        if open.is_past(self.count(world, variable, sum)?) {
            self.loops.pop();
            return Ok(self.at + 1);
        }
        Ok(opener + 1)
    }

    /// Gives the variable of a loop its next number; returns the number as the variable holds it.
    fn count(&mut self, world: &mut World<'_>, variable: &Variable, number: Number) -> Result<Number> {
        let place = self.context(world).place(variable)?;
        self.write(world, place, number.into())?;
        self.context(world).counter(variable)
    }
}

impl Context<'_> {
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
