//! Executes the operation of one step. Assignments, branches and calls are done here; everything that touches the world
//! becomes a request (`request_values`).
//!
//! Loops are in `loops`, monitors in `monitor`.

use super::arithmetic::double;
use super::evaluate::{Execution, component, no_component};
use super::{Frame, Loop, Machine, Result, RunPhase};
use crate::MAX_CALL_NESTING;
use crate::prelude::*;
use crate::program::Operation;
use crate::request::FaultKind;
use crate::tree::{Assignment, Expression, Simple};
use crate::value::Number;

impl Execution<'_> {
    /// Executes the step at `at` and moves on, unless it asks for something, ends the program or is a WAIT that goes on
    /// waiting: then the state says so.
    pub fn execute(&mut self, operation: &Operation) -> Result<()> {
        let mut next = self.machine.at + 1;
        match operation {
            Operation::Simple(simple) => return self.simple(simple),
            Operation::Wait(condition) => {
                if !self.truth(condition)? {
                    self.machine.state = RunPhase::Waiting;
                    return Ok(());
                }
            }
            Operation::Branch { condition, otherwise } => {
                if !self.truth(condition)? {
                    next = *otherwise;
                }
            }
            Operation::Jump(target) => next = *target,
            Operation::Select { selector, targets } => {
                // Counted from 1; the next statement follows when the number names none of them.
                let number = usize::try_from(self.integer(selector)?).unwrap_or(0);
                let target = number.checked_sub(1).and_then(|at| targets.get(at));
                next = target.copied().unwrap_or(next);
            }
            Operation::For { counting, exit } => {
                let limit = self.number(&counting.to)?;
                let step = counting.step.as_ref().map(|step| self.number(step));
                let step = step.transpose()?;
                let from = self.number(&counting.from)?;
                let opened = Loop {
                    opener: self.machine.at,
                    exit: *exit,
                    limit,
                    step: step.unwrap_or(Number::Integer(1)),
                };
                next = self.begin_loop(&counting.variable, from, opened)?;
            }
            Operation::Next { opener } => next = self.next(*opener)?,
            Operation::Call { block, arguments } => {
                self.call(next, arguments)?;
                let entry = self.program.blocks.get(*block);
                next = entry.map_or(self.program.steps.len(), |entry| entry.step);
            }
            Operation::On { condition, after, .. } => {
                let value = self.truth(condition)?;
                self.machine.start_monitor(value)?;
                next = *after;
            }
            Operation::HandlerEnd => {
                self.machine.state = RunPhase::Ended;
                return Ok(());
            }
            // Always an instruction.
            Operation::Return => {}
        }
        self.machine.at = next;
        Ok(())
    }

    /// Enters a program: its arguments are evaluated, then it gets a frame. A fault leaves nothing behind.
    fn call(&mut self, return_to: usize, arguments: &[Expression]) -> Result<()> {
        let first = self.machine.arguments.len();
        for expression in arguments {
            let argument = self.argument(expression);
            let argument = argument.inspect_err(|_| self.machine.arguments.truncate(first))?;
            self.machine.arguments.push(argument);
        }
        if self.machine.push_frame(first, return_to) {
            return Ok(());
        }
        FaultKind::Nesting.fail(format!("calls are nested more than {MAX_CALL_NESTING} deep"))
    }

    fn simple(&mut self, simple: &Simple) -> Result<()> {
        match simple {
            Simple::Assign(assignment) => self.assign(assignment)?,
            Simple::Change(change) => {
                let conditions = self.changed(change)?;
                *self.memory.conditions_mut() = conditions;
            }
            Simple::Monitors(on) => self.machine.monitors_enabled = *on,
            Simple::Ignore => {
                self.machine.monitors.clear();
                self.machine.ignored = true;
            }
            Simple::Ask(ask) => {
                self.machine.state = RunPhase::Requested(self.request(ask)?);
                return Ok(());
            }
        }
        self.machine.at += 1;
        Ok(())
    }

    fn assign(&mut self, assignment: &Assignment) -> Result<()> {
        let target = &assignment.target;
        let mut value = self.evaluate(&assignment.value)?;
        let place = self.place(target)?;
        if let Some(letter) = assignment.component {
            let Some(number) = value.number() else {
                let found = value.kind().description();
                return FaultKind::Type.fail(format!("a coordinate is a number, found {found}"));
            };
            value = self.fetch(target)?;
            match component(self.program.options.arm, &mut value, letter) {
                Some(coordinate) => *coordinate = double(number),
                None => return Err(no_component(&value, letter)),
            }
        }
        self.write(place, value)
    }
}

impl Machine {
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
}
