//! Executes the operation of one step. Assignments, branches and calls are done here; everything that touches the world
//! becomes a request (`request_values`).
//!
//! Loops are in `loops`, monitors in `monitor`.

use super::evaluate::{component_index, no_component};
use super::{Frame, Loop, Machine, Result, RunPhase, RuntimeError};
use crate::MAX_CALL_NESTING;
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{FaultKind, Inputs};
use crate::tree::{Expression, Feature, PerAxis, Simple, Variable};
use crate::value::{Number, Value};
use alloc::format;

impl Machine {
    /// Executes the step at `at` and moves on, unless it asks for something, ends the program or is a WAIT that goes on
    /// waiting: then the state says so.
    pub(super) fn execute(
        &mut self,
        program: &Program,
        operation: &Operation,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<()> {
        let context = self.context(program, memory, inputs);
        let mut next = self.at + 1;
        match operation {
            Operation::Simple(simple) => return self.simple(program, simple, memory, inputs),
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
            Operation::For {
                variable,
                from,
                to,
                step,
                exit,
            } => {
                let limit = context.number(to)?;
                let step = step
                    .as_ref()
                    .map_or(Ok(Number::Integer(1)), |step| context.number(step))?;
                let from = context.number(from)?;
                let opened = Loop {
                    opener: self.at,
                    exit: *exit,
                    limit,
                    step,
                };
                next = self.begin_loop(program, memory, inputs, variable, from, opened)?;
            }
            Operation::Next { opener } => next = self.next(program, memory, inputs, *opener)?,
            Operation::Call { block, arguments } => {
                self.call(program, memory, inputs, next, arguments)?;
                next = program
                    .blocks
                    .get(*block)
                    .map_or(program.steps.len(), |entry| entry.step);
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
    fn call(
        &mut self,
        program: &Program,
        memory: &Memory,
        inputs: &dyn Inputs,
        return_to: usize,
        arguments: &[Expression],
    ) -> Result<()> {
        let first = self.arguments.len();
        for expression in arguments {
            let argument = self.context(program, memory, inputs).argument(expression);
            let argument = argument.inspect_err(|_| self.arguments.truncate(first))?;
            self.arguments.push(argument);
        }
        if self.push_frame(first, return_to) {
            return Ok(());
        }
        let message = format!("calls are nested more than {MAX_CALL_NESTING} deep");
        Err(RuntimeError::new(FaultKind::Nesting, message))
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

    fn simple(
        &mut self,
        program: &Program,
        simple: &Simple,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<()> {
        if let Simple::Assign {
            target,
            component,
            value,
        } = simple
        {
            self.assign(program, memory, inputs, target, *component, value)?;
        } else if let Some(pending) = self.context(program, memory, inputs).request(simple)? {
            self.state = RunPhase::Requested(pending);
            return Ok(());
        } else {
            self.change(program, simple, memory, inputs)?;
        }
        self.at += 1;
        Ok(())
    }

    /// Changes the motion conditions or the monitors of the task.
    fn change(
        &mut self,
        program: &Program,
        simple: &Simple,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<()> {
        let context = self.context(program, memory, inputs);
        let mut conditions = memory.conditions().clone();
        match simple {
            Simple::Set(condition, value) => context.set(&mut conditions, *condition, value)?,
            Simple::FreeLoad => conditions.payload = None,
            Simple::Switch(Feature::Pass, on) => conditions.passing = *on,
            Simple::Switch(Feature::Nowait, on) => conditions.nowait = *on,
            Simple::Switch(Feature::Monitors, on) => self.monitors_enabled = *on,
            Simple::Ignore => self.monitors.clear(),
            Simple::PerAxis(condition, values) => {
                let values = context.per_axis(values)?;
                let axes = match condition {
                    PerAxis::Gain => &mut conditions.gain,
                    PerAxis::Torque => &mut conditions.torque,
                };
                axes.iter_mut().zip(values).for_each(|(to, value)| *to = value);
            }
            Simple::SetGain(axis, value) => {
                let (axis, value) = (context.axis(axis)?, context.axis_percent(value)?);
                if let Some(to) = conditions.gain.get_mut(usize::from(axis) - 1) {
                    *to = value;
                }
            }
            // These ask the outside, or are assignments.
            Simple::Assign { .. }
            | Simple::Move { .. }
            | Simple::Print { .. }
            | Simple::Input { .. }
            | Simple::Task { .. }
            | Simple::Delay(_)
            | Simple::Outputs(_)
            | Simple::Bcd(_)
            | Simple::Hand { .. }
            | Simple::Pulse(..)
            | Simple::Break
            | Simple::Pause
            | Simple::Resume
            | Simple::Timer(_)
            | Simple::Yield
            | Simple::Restore(_)
            | Simple::Kill(_)
            | Simple::Stop => {}
        }
        *memory.conditions_mut() = conditions;
        Ok(())
    }

    fn assign(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        target: &Variable,
        component: Option<u8>,
        value: &Expression,
    ) -> Result<()> {
        let context = self.context(program, memory, inputs);
        let mut value = context.evaluate(value)?;
        let place = context.place(target)?;
        if let Some(letter) = component {
            value = with_component(program, context.fetch(target), letter, &value)?;
        }
        self.write(program, memory, place, value)
    }
}

/// A value with one coordinate replaced by a number.
fn with_component(program: &Program, old: Result<Value>, letter: u8, number: &Value) -> Result<Value> {
    let Some(number) = number.number() else {
        let message = format!("a coordinate is a number, found {}", number.kind().description());
        return Err(RuntimeError::new(FaultKind::Type, message));
    };
    let mut value = old?;
    let index = component_index(program.options.arm, value.kind(), letter);
    let place = match (&mut value, index) {
        (Value::Position(position), Some(index)) => position.coords.get_mut(index),
        (Value::Coordinate(trans), Some(index)) => trans.coords.get_mut(index),
        _ => None,
    };
    match place {
        Some(place) => *place = super::arithmetic::double(number),
        None => return Err(no_component(&value, letter)),
    }
    Ok(value)
}
