//! Executes the operation of one step with values of any kind. Assignments, branches and calls are done here; everything that
//! touches the world becomes a request.
//!
//! Operations that compute with numbers alone come here only when their instructions cannot do them (`vm`). The values of
//! requests are in `request_values`, loops in `loops`.

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;

use super::arithmetic::as_value;
use super::evaluate::{Context, component_index, no_component};
use super::{Frame, Loop, Machine, PendingRequest, RunPhase, RuntimeError};
use crate::MAX_CALL_NESTING;
use crate::cell::Cell;
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{FaultKind, Inputs, Motion, Number, Request};
use crate::tree::{Expression, Feature, PerAxis, Simple, Variable};
use crate::value::Value;

impl Machine {
    /// Executes the step at `at` and moves on, unless it asks for something, ends the program or is a WAIT that goes on
    /// waiting: then the state says so.
    pub(super) fn execute(
        &mut self,
        program: &Program,
        operation: &Operation,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<(), RuntimeError> {
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
            Operation::Select { selector, targets } => {
                next = context.choice(selector, targets)?.unwrap_or(next);
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
                let from = as_value(context.number(from)?);
                let opened = Loop {
                    opener: self.at,
                    exit: *exit,
                    limit: Cell::from(limit),
                    step: Cell::from(step),
                };
                next = self.begin_loop(program, memory, inputs, variable, from, opened)?;
            }
            Operation::Next { opener } => next = self.next(program, memory, inputs, *opener)?,
            Operation::Call { block, arguments } => {
                let first = self.arguments.len();
                if let Err(error) = self.call(program, memory, inputs, next, arguments) {
                    self.arguments.truncate(first);
                    return Err(error);
                }
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
            // These are always instructions.
            Operation::Jump(_) | Operation::Return => {}
        }
        self.at = next;
        Ok(())
    }

    /// Enters a program: its arguments are evaluated, then it gets a frame.
    fn call(
        &mut self,
        program: &Program,
        memory: &Memory,
        inputs: &dyn Inputs,
        return_to: usize,
        arguments: &[Expression],
    ) -> Result<(), RuntimeError> {
        let first = self.arguments.len();
        for expression in arguments {
            let argument = self.context(program, memory, inputs).argument(expression)?;
            self.arguments.push(argument);
        }
        if self.push_frame(first, return_to) {
            return Ok(());
        }
        let message = format!("calls are nested more than {MAX_CALL_NESTING} deep");
        Err(RuntimeError::new(FaultKind::Nesting, message))
    }

    /// Gives a program, whose arguments are those from `first` on, its frame; `false` when calls are nested too deep.
    pub(super) fn push_frame(&mut self, first: usize, return_to: usize) -> bool {
        // The main program is a frame too.
        let fits = self.frames.len() <= MAX_CALL_NESTING;
        if fits {
            self.frames.push(Frame {
                return_to,
                arguments: first,
                loops: self.loops.len(),
            });
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

    #[expect(clippy::too_many_lines, reason = "a flat match, one arm a statement")]
    fn simple(
        &mut self,
        program: &Program,
        simple: &Simple,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<(), RuntimeError> {
        let context = self.context(program, memory, inputs);
        let mut targets = Vec::new();
        let request = match simple {
            Simple::Assign {
                target,
                component,
                value,
            } => {
                self.assign(program, memory, inputs, target, *component, value)?;
                None
            }
            Simple::Set(condition, value) => {
                let mut conditions = memory.conditions().clone();
                context.set(&mut conditions, *condition, value)?;
                *memory.conditions_mut() = conditions;
                None
            }
            Simple::FreeLoad => {
                memory.conditions_mut().payload = None;
                None
            }
            Simple::Input {
                channel,
                targets: variables,
            } => {
                targets = variables
                    .iter()
                    .map(|t| context.place(t))
                    .collect::<Result<_, _>>()?;
                Some(Request::Input {
                    channel: *channel,
                    expected: targets.len(),
                })
            }
            Simple::Move { motion, with } => {
                let mut conditions = memory.conditions().clone();
                for (condition, value) in with {
                    context.set(&mut conditions, *condition, value)?;
                }
                Some(Request::Move(Box::new(Motion {
                    path: context.path(motion)?,
                    conditions,
                    own_frames: with.iter().any(|(condition, _)| condition.is_frame()),
                })))
            }
            Simple::Print { channel, items, cr } => Some(context.print(*channel, items, *cr)?),
            Simple::Task { target, block, .. } => {
                targets = target
                    .iter()
                    .map(|target| context.place(target))
                    .collect::<Result<_, _>>()?;
                Some(Request::Task { program: *block })
            }
            Simple::Switch(feature, on) => {
                self.feature(memory, *feature, *on);
                None
            }
            Simple::Ignore => {
                self.monitors.clear();
                None
            }
            Simple::PerAxis(condition, values) => {
                let values = context.per_axis(values)?;
                let conditions = memory.conditions_mut();
                let axes = match condition {
                    PerAxis::Gain => &mut conditions.gain,
                    PerAxis::Torque => &mut conditions.torque,
                };
                axes.iter_mut().zip(values).for_each(|(to, value)| *to = value);
                None
            }
            Simple::SetGain(axis, value) => {
                let (axis, value) = (context.axis(axis)?, context.axis_percent(value)?);
                let gain = &mut memory.conditions_mut().gain;
                if let Some(to) = gain.get_mut(usize::from(axis) - 1) {
                    *to = value;
                }
                None
            }
            other => Some(context.device(other)?),
        };
        match request {
            Some(request) => self.state = RunPhase::Requested(PendingRequest { request, targets }),
            None => self.at += 1,
        }
        Ok(())
    }

    fn feature(&mut self, memory: &mut Memory, feature: Feature, on: bool) {
        match feature {
            Feature::Pass => memory.conditions_mut().passing = on,
            Feature::Nowait => memory.conditions_mut().nowait = on,
            Feature::Monitors => self.monitors_enabled = on,
        }
    }

    fn assign(
        &mut self,
        program: &Program,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        target: &Variable,
        component: Option<u8>,
        value: &Expression,
    ) -> Result<(), RuntimeError> {
        let context = self.context(program, memory, inputs);
        let value = context.evaluate(value)?;
        let place = context.place(target)?;
        let value = match component {
            Some(letter) => with_component(&context, target, letter, &value)?,
            None => value,
        };
        self.write(program, memory, place, value)
    }
}

impl Context<'_> {
    /// The target of a computed GOTO, counted from 1; `None` outside the list.
    fn choice(&self, selector: &Expression, targets: &[usize]) -> Result<Option<usize>, RuntimeError> {
        let number = self.integer(selector)?;
        Ok(usize::try_from(number)
            .ok()
            .and_then(|n| n.checked_sub(1))
            .and_then(|at| targets.get(at))
            .copied())
    }
}

/// The value of `target` with one coordinate replaced.
fn with_component(
    context: &Context<'_>,
    target: &Variable,
    letter: u8,
    to: &Value,
) -> Result<Value, RuntimeError> {
    let number = match to {
        Value::Integer(value) => f64::from(*value),
        Value::Real(value) => f64::from(*value),
        other => {
            let message = format!("a coordinate is a number, found {}", other.kind().description());
            return Err(RuntimeError::new(FaultKind::Type, message));
        }
    };
    let mut value = context.fetch(target)?;
    let index = component_index(context.program.options.arm, value.kind(), letter);
    let place = match (&mut value, index) {
        (Value::Position(position), Some(index)) => position.coords.get_mut(index),
        (Value::Coordinate(trans), Some(index)) => trans.coords.get_mut(index),
        _ => None,
    };
    match place {
        Some(place) => *place = number,
        None => return Err(no_component(&value, letter)),
    }
    Ok(value)
}
