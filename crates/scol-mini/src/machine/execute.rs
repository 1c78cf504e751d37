//! One step: assignments and jumps are done here, everything that touches the world becomes a request.

use alloc::boxed::Box;
use alloc::format;
use alloc::vec::Vec;

use super::evaluate::{Context, binary, component_index, double, no_component};
use super::functions::configuration;
use super::print::field;
use super::{Frame, Loop, Machine, Pending, State, Trouble};
use crate::MAX_CALL_NESTING;
use crate::conditions::{Conditions, Frame as System};
use crate::memory::Memory;
use crate::program::{Operation, Program};
use crate::request::{Channel, FaultKind, Inputs, MAX_PRINT, Motion, Number, Path, Request};
use crate::tree::{Binary, Condition, Course, Expression, Item, Node, Simple, Variable};
use crate::value::{Position, Value};

/// Text that clears a receive buffer instead of being sent (BUF-03).
const BUFFER_RESET: &str = "BUFFRESET";
/// Most axes `MOVEA` and `MOVEI` can name.
const MAX_AXIS: i32 = 8;

impl Machine {
    /// Executes the step at `at` and moves on; `false` when it is a WAIT that goes on waiting.
    pub(super) fn execute(
        &mut self,
        program: &Program,
        operation: &Operation,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<bool, Trouble> {
        let context = Context { program, memory, inputs, frames: &self.frames };
        let mut next = self.at + 1;
        match operation {
            Operation::Simple(simple) => return self.simple(program, simple, memory, inputs).map(|()| true),
            Operation::Wait(condition) => {
                if !context.truth(condition)? {
                    return Ok(false);
                }
            }
            Operation::Branch { condition, otherwise } => {
                if !context.truth(condition)? {
                    next = *otherwise;
                }
            }
            Operation::Jump(target) => next = *target,
            Operation::Select { selector, targets } => {
                let choice = usize::try_from(context.integer(selector)?).unwrap_or(0);
                next = choice.checked_sub(1).and_then(|at| targets.get(at)).copied().unwrap_or(next);
            }
            Operation::For { variable, from, to, step, exit } => {
                let limit = context.number(to)?;
                let step = step.as_ref().map_or(Ok(Number::Integer(1)), |step| context.number(step))?;
                let from = value(context.number(from)?);
                let opened = Loop { opener: self.at, exit: *exit, limit, step };
                next = self.enter(program, memory, inputs, variable, from, opened)?;
            }
            Operation::Next { opener } => next = self.next(program, memory, inputs, *opener)?,
            Operation::Call { block, arguments } => {
                let arguments = arguments.iter().map(|e| context.argument(e)).collect::<Result<_, _>>()?;
                if self.frames.len() > MAX_CALL_NESTING {
                    let message = format!("calls are nested more than {MAX_CALL_NESTING} deep");
                    return Err(Trouble::new(FaultKind::Nesting, message));
                }
                self.frames.push(Frame { return_to: next, arguments, loops: Vec::new() });
                next = program.blocks.get(*block).map_or(program.steps.len(), |entry| entry.step);
            }
            Operation::Return => {
                if self.frames.len() <= 1 {
                    self.state = State::Ended;
                    return Ok(true);
                }
                next = self.frames.pop().map_or(next, |frame| frame.return_to);
            }
        }
        self.at = next;
        Ok(true)
    }

    /// Begins a FOR; returns the step that follows: the body, or what comes after NEXT.
    fn enter(
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
        let place = Context { program, memory, inputs, frames: &self.frames }.place(variable)?;
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
    fn next(
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
            return Err(Trouble::new(FaultKind::NextWithoutFor, "NEXT is reached without its FOR"));
        };
        let now = self.counter(program, memory, inputs, variable)?;
        let sum = binary(Binary::Add, now, open.step, program.options.int_division)?;
        let place = Context { program, memory, inputs, frames: &self.frames }.place(variable)?;
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
        match (Context { program, memory, inputs, frames: &self.frames }).fetch(variable)? {
            Value::Integer(value) => Ok(Number::Integer(value)),
            Value::Real(value) => Ok(Number::Real(value)),
            other => {
                let message = format!("a FOR counts with a number, {} is {}", variable.name.text, other.kind().word());
                Err(Trouble::new(FaultKind::Type, message))
            }
        }
    }

    fn simple(
        &mut self,
        program: &Program,
        simple: &Simple,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<(), Trouble> {
        let context = Context { program, memory, inputs, frames: &self.frames };
        let request = match simple {
            Simple::Assign { target, component, value } => {
                let value = context.evaluate(value)?;
                let place = context.place(target)?;
                let value = match component {
                    Some(letter) => with_component(&context, target, *letter, &value)?,
                    None => value,
                };
                self.write(program, memory, place, value)?;
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
            Simple::Input { channel, targets } => {
                let targets: Vec<_> = targets.iter().map(|t| context.place(t)).collect::<Result<_, _>>()?;
                let request = Request::Input { channel: *channel, wanted: targets.len() };
                self.state = State::Asked(Pending { request, targets });
                return Ok(());
            }
            Simple::Move { course, with } => {
                let mut conditions = memory.conditions().clone();
                for (condition, value) in with {
                    context.set(&mut conditions, *condition, value)?;
                }
                Some(Request::Move(Box::new(Motion { path: context.path(course)?, conditions })))
            }
            Simple::Print { channel, items, cr } => Some(context.print(*channel, items, *cr)?),
            Simple::Delay(seconds) => {
                let seconds = context.double(seconds)?;
                if seconds < 0.0 {
                    let message = format!("DELAY takes seconds from 0 up, found {seconds}");
                    return Err(Trouble::new(FaultKind::Range, message));
                }
                Some(Request::Delay { seconds })
            }
            Simple::Outputs(lines) => {
                Some(Request::Outputs(lines.iter().map(|line| context.signal(line)).collect::<Result<_, _>>()?))
            }
            Simple::Stop => Some(Request::Stop),
        };
        match request {
            Some(request) => self.state = State::Asked(Pending { request, targets: Vec::new() }),
            None => self.at += 1,
        }
        Ok(())
    }
}

/// The value of `target` with one coordinate replaced.
fn with_component(context: &Context<'_>, target: &Variable, letter: u8, to: &Value) -> Result<Value, Trouble> {
    let number = match to {
        Value::Integer(value) => f64::from(*value),
        Value::Real(value) => f64::from(*value),
        other => {
            let message = format!("a coordinate is a number, found {}", other.kind().word());
            return Err(Trouble::new(FaultKind::Type, message));
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

fn value(number: Number) -> Value {
    match number {
        Number::Integer(value) => Value::Integer(value),
        Number::Real(value) => Value::Real(value),
    }
}

/// The counter has passed its limit in the direction of the step.
fn past(now: Number, limit: Number, step: Number) -> bool {
    let (now, limit) = (double(now), double(limit));
    if double(step) > 0.0 { now > limit } else { now < limit }
}

impl Context<'_> {
    /// Sets one condition to the value of an expression.
    fn set(&self, into: &mut Conditions, condition: Condition, value: &Expression) -> Result<(), Trouble> {
        match condition {
            Condition::Speed => into.speed = self.percent("SPEED", value)?,
            Condition::Accel => into.accel = self.percent("ACCEL", value)?,
            Condition::Decel => into.decel = self.percent("DECEL", value)?,
            Condition::Config => {
                into.config = configuration(self.program.options.arm, self.double(value)?)?;
            }
            Condition::Payload => match self.evaluate(value)? {
                Value::Load(load) => into.payload = Some((name(value), load)),
                other => return Err(wrong("load data", &other)),
            },
            Condition::Work => into.work = self.system_frame(value)?,
            Condition::Tool => into.tool = self.system_frame(value)?,
            Condition::Base => into.base = self.system_frame(value)?,
        }
        Ok(())
    }

    fn percent(&self, name: &str, value: &Expression) -> Result<f64, Trouble> {
        let percent = self.double(value)?;
        if (1.0..=100.0).contains(&percent) {
            return Ok(percent);
        }
        Err(Trouble::new(FaultKind::Range, format!("{name} takes 1 to 100, found {percent}")))
    }

    fn system_frame(&self, value: &Expression) -> Result<System, Trouble> {
        match self.evaluate(value)? {
            Value::Coordinate(trans) => Ok(System { name: name(value), trans }),
            other => Err(wrong("coordinate data", &other)),
        }
    }

    fn position(&self, value: &Expression) -> Result<Position, Trouble> {
        match self.evaluate(value)? {
            Value::Position(position) => Ok(position),
            other => Err(wrong("positional data", &other)),
        }
    }

    fn path(&self, course: &Course) -> Result<Path, Trouble> {
        Ok(match course {
            Course::Ptp(to) => Path::Ptp(self.position(to)?),
            Course::Line(to) => Path::Line(self.position(to)?),
            Course::Arc(via, end) => Path::Arc { via: self.position(via)?, end: self.position(end)? },
            Course::Axis(axis, value) => Path::Axis { axis: self.axis(axis)?, value: self.double(value)? },
            Course::AxisBy(axis, delta) => Path::AxisBy { axis: self.axis(axis)?, delta: self.double(delta)? },
            Course::Ready => Path::Ready,
        })
    }

    fn axis(&self, axis: &Expression) -> Result<u8, Trouble> {
        let axis = self.integer(axis)?;
        match u8::try_from(axis) {
            Ok(number) if (1..=MAX_AXIS).contains(&axis) => Ok(number),
            _ => Err(Trouble::new(FaultKind::Range, format!("axes count from 1 to {MAX_AXIS}, found {axis}"))),
        }
    }

    fn print(&self, channel: Channel, items: &[Item], cr: bool) -> Result<Request, Trouble> {
        if let ([Item::Text(text)], false) = (items, cr)
            && text == BUFFER_RESET
            && channel != Channel::Tp
        {
            return Ok(Request::BufferReset { channel });
        }
        let mut data = Vec::new();
        for item in items {
            match item {
                Item::Text(text) => data.extend_from_slice(text.as_bytes()),
                Item::Value(value) => data.extend_from_slice(field(self.number(value)?).as_bytes()),
            }
        }
        if cr {
            data.push(b'\r');
        }
        data.truncate(MAX_PRINT);
        Ok(Request::Print { channel, data })
    }
}

/// The name of a plain variable, which SF reports.
fn name(value: &Expression) -> Option<alloc::string::String> {
    match &value.node {
        Node::Variable(variable) if variable.subscripts.is_empty() => Some(variable.name.text.clone()),
        _ => None,
    }
}

fn wrong(expected: &str, found: &Value) -> Trouble {
    Trouble::new(FaultKind::Type, format!("expected {expected}, found {}", found.kind().word()))
}
