//! Executes the statements that are one instruction, `Op::Execute`: WAIT, FOR, ON, and what changes conditions or asks for
//! something outside, which becomes a request (`request_values`). Calls are entered and left here too.
//!
//! Assignments and jumps are instructions of their own (`vm`). Loops are in `loops`, monitors in `monitor`.

use super::arithmetic::double;
use super::evaluate::{Execution, component, no_component};
use super::{Frame, Loop, Machine, PendingRequest, Result, RunPhase};
use crate::MAX_CALL_NESTING;
use crate::prelude::*;
use crate::program::Operation;
use crate::request::{FaultKind, Request};
use crate::tree::{Assignment, Change, Expression, Simple};
use crate::value::Number;

impl Execution<'_> {
    /// Executes the step under way and moves on, unless it asks for something, ends the program or is a WAIT whose
    /// condition is still false; `state` then says which.
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
            Operation::For { counting, exit } => {
                // Before the variable gets its first value: FOR I = 1 TO I counts to the old value of I.
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
            Operation::On { condition, after, .. } => {
                let value = self.truth(condition)?;
                self.machine.start_monitor(value)?;
                next = *after;
            }
            Operation::HandlerEnd => {
                self.machine.state = RunPhase::Ended;
                return Ok(());
            }
            // These are instructions of their own.
            Operation::Branch { .. }
            | Operation::Jump(_)
            | Operation::Select { .. }
            | Operation::Next { .. }
            | Operation::Call { .. }
            | Operation::Return => {}
        }
        self.machine.at = next;
        Ok(())
    }

    /// Enters a program: evaluates its arguments, then pushes a frame. A fault changes nothing.
    pub fn call(&mut self, return_to: usize, arguments: &[Expression]) -> Result<()> {
        let first = self.machine.arguments.len();
        for expression in arguments {
            let argument = self.argument(expression);
            let argument = argument.inspect_err(|_| self.machine.arguments.truncate(first))?;
            self.machine.arguments.push(argument);
        }
        // The main program is a frame too.
        if self.machine.frames.len() > MAX_CALL_NESTING {
            self.machine.arguments.truncate(first);
            return FaultKind::Nesting.fail(format!("calls are nested more than {MAX_CALL_NESTING} deep"));
        }
        self.machine.frames.push(Frame {
            return_to,
            arguments: first,
            loops: self.machine.loops.len(),
        });
        Ok(())
    }

    fn simple(&mut self, simple: &Simple) -> Result<()> {
        match simple {
            Simple::Assign(assignment) => self.assign_coordinate(assignment)?,
            Simple::Change(change) => {
                let conditions = self.changed(change)?;
                *self.memory.conditions_mut() = conditions;
                if let Change::Set(condition, _) = change
                    && let Some(percent) = self.memory.conditions().over_full(*condition)
                {
                    self.machine.state = RunPhase::Requested(PendingRequest {
                        request: Request::OverFull { percent },
                        targets: Vec::new(),
                    });
                    return Ok(());
                }
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

    /// Assigns one coordinate; all other assignments are instructions.
    fn assign_coordinate(&mut self, assignment: &Assignment) -> Result<()> {
        let value = self.evaluate(&assignment.value)?;
        let place = self.place(&assignment.target)?;
        let (Some(letter), Some(number)) = (assignment.component, value.number()) else {
            let found = value.kind().description();
            return FaultKind::Type.fail(format!("a coordinate is a number, found {found}"));
        };
        let mut value = self.fetch(&assignment.target)?;
        match component(self.program.options.arm, &mut value, letter) {
            Some(coordinate) => *coordinate = double(number),
            None => return Err(no_component(&value, letter)),
        }
        self.write(place, value)
    }
}

impl Machine {
    /// Returns the step after the call, or `None` in the main program.
    pub(super) fn pop_frame(&mut self) -> Option<usize> {
        let depth = self.frames.len().checked_sub(1).filter(|depth| *depth > 0)?;
        let back = self.frames.last()?.return_to;
        self.unwind(depth);
        self.drop_jump_monitors();
        Some(back)
    }
}
