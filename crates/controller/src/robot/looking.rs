//! Expressions and assignments for a debugger, in a call of one of the tasks.

use super::Robot;
use crate::executor::Task;
use crate::inspection::{Assignment, InspectError, words};
use crate::io::line_names::line_name;
use crate::io::signals::{IoKind, Signals};
use scol_mini::{Inputs, Machine, Memory, ProbeError, Value};

impl Robot {
    /// The value of an expression in the call with this index, from the outermost.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub(crate) fn evaluate(&mut self, task: u16, call: usize, text: &str) -> Result<Value, InspectError> {
        self.in_call(task, call, |machine, call, memory, inputs| {
            machine.value(call, text, memory, inputs)
        })
    }

    /// Carries out an assignment. One to DIN drives the input as from outside.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub(crate) fn assign(&mut self, assignment: &Assignment) -> Result<Value, InspectError> {
        let Assignment { task, call, text } = assignment;
        if let Some((line, state)) = assignment.of_input() {
            let line = self.evaluate(*task, *call, line)?;
            let state = self.evaluate(*task, *call, state)?;
            self.drive_as_assigned(&line, &state)?;
            return self.evaluate(*task, *call, &assignment.target());
        }
        self.in_call(*task, *call, |machine, call, memory, inputs| {
            machine.probe(call, text, memory, inputs)
        })
    }

    fn in_call(
        &mut self,
        task: u16,
        call: usize,
        ask: impl FnOnce(&mut Machine, usize, &mut Memory, &dyn Inputs) -> Result<Value, ProbeError>,
    ) -> Result<Value, InspectError> {
        if self.executor.selected().is_none() {
            return Err(InspectError::NoFile);
        }
        let taken = self.executor.take_task(task);
        let mut taken = taken.ok_or(InspectError::NoTask(task))?;
        let (inputs, memory) = self.inputs_and_memory(self.context.now);
        let outside = taken.machine().depth();
        let value = match (call.checked_sub(outside), taken.handler_mut()) {
            (Some(call), Some(handler)) => ask(handler.machine_mut(), call, memory, &inputs),
            _ => ask(taken.machine_mut(), call, memory, &inputs),
        };
        self.executor.put_task(taken);
        Ok(value?)
    }

    /// Carries out an assignment while this task is taken out, before its statement begins. `outside` calls are of the program
    /// that it interrupts, as the action of a monitor does.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub(crate) fn assign_between(
        &mut self,
        task: &mut Task,
        outside: usize,
        assignment: &Assignment,
    ) -> Result<Value, InspectError> {
        if assignment.task != task.id() {
            return self.assign(assignment);
        }
        // The interrupted program is not at hand; what it shares with the action is.
        let call = assignment.call.saturating_sub(outside);
        let (inputs, memory) = self.inputs_and_memory(self.context.now);
        if let Some((line, state)) = assignment.of_input() {
            let mut value = |text| task.machine().value(call, text, memory, &inputs);
            let (line, state) = (value(line)?, value(state)?);
            self.drive_as_assigned(&line, &state)?;
            return Ok(state);
        }
        let value = task.machine_mut().probe(call, &assignment.text, memory, &inputs);
        Ok(value?)
    }

    /// Drives the input with this number, unless the controller itself acts on it: a task may be taken out.
    fn drive_as_assigned(&mut self, line: &Value, state: &Value) -> Result<(), InspectError> {
        let integer = |value: &Value| {
            let Value::Integer(number) = value else {
                return None;
            };
            u16::try_from(*number).ok()
        };
        let line = integer(line).filter(|line| Signals::exists(*line));
        let line = line.ok_or(InspectError::NoInput)?;
        if let Some(name) = line_name(IoKind::Input, line) {
            return Err(InspectError::SystemInput { line, name });
        }
        let on = match integer(state) {
            Some(0) => false,
            Some(1) => true,
            Some(_) | None => return Err(InspectError::NoState(words(state, self.arm.kind()))),
        };
        self.drive_input(line, on);
        Ok(())
    }
}
