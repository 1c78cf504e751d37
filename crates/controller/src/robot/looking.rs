//! Expressions and assignments that somebody asks of a program that has stopped.

use super::Robot;
use crate::executor::Task;
use crate::inspection::{Assignment, InspectError};
use scol_mini::Value;

impl Robot {
    /// The value of an expression in the call with this index, from the outermost; an assignment is carried out.
    ///
    /// # Errors
    /// See [`InspectError`].
    pub(crate) fn evaluate(&mut self, task: u16, call: usize, text: &str) -> Result<Value, InspectError> {
        if self.executor.selected().is_none() {
            return Err(InspectError::NoFile);
        }
        let mut taken = self.executor.take_task(task).ok_or(InspectError::NoTask(task))?;
        let (inputs, memory) = self.inputs_and_memory(self.context.now);
        let outside = taken.machine().depth();
        let value = match (call.checked_sub(outside), taken.handler_mut()) {
            (Some(call), Some(handler)) => handler.machine_mut().probe(call, text, memory, &inputs),
            _ => taken.machine_mut().probe(call, text, memory, &inputs),
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
        let Assignment { task: id, call, text } = assignment;
        if *id != task.id() {
            return self.evaluate(*id, *call, text);
        }
        // The interrupted program is not at hand; what it shares with the action is.
        let call = call.saturating_sub(outside);
        let (inputs, memory) = self.inputs_and_memory(self.context.now);
        Ok(task.machine_mut().probe(call, text, memory, &inputs)?)
    }
}
