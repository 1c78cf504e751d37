//! Expressions and assignments in the scope of an open call, for a debugger: what `compile` makes of the text, carried out by a
//! machine that sees the variables of that call.
//!
//! An expression changes nothing. Who may ask, and when, is left to the controller.

use alloc::sync::Arc;

use crate::compile::{Probe, compile_probe};
use crate::diagnostic::{Diagnostic, Span};
use crate::machine::Machine;
use crate::memory::Memory;
use crate::program::Program;
use crate::request::{Fault, Inputs, Pause};
use crate::value::Value;

/// Why something that was asked of a program has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// The text is neither an expression nor an assignment, or it has an unknown name.
    #[error("{}", .0.message)]
    Text(Diagnostic),
    /// It has no value now.
    #[error("{}", .0.message)]
    Fault(Fault),
}

/// The target and the value of an assignment; `==`, `<=` and the like compare.
pub fn split_assignment(text: &str) -> Option<(&str, &str)> {
    let (target, value) = text.split_once('=')?;
    let assigns = !value.starts_with('=') && !target.ends_with(['<', '>', '!']);
    assigns.then(|| (target.trim(), value.trim()))
}

impl Program {
    /// Checks an expression as the PROGRAM block with a statement in this file line reads it.
    ///
    /// # Errors
    /// It is not an expression, or has a name that this block does not know.
    pub fn check_expression(&self, line: u32, text: &str) -> Result<(), ProbeError> {
        let step = self.steps.iter().position(|step| step.line == line);
        let block = step.and_then(|step| self.block_of(step));
        let (_, probe) = compile_probe(text, self, block).map_err(ProbeError::Text)?;
        match probe {
            Probe::Value(_) => Ok(()),
            Probe::Assignment => Err(assigns(text)),
        }
    }
}

/// An assignment was found where an expression has to be.
fn assigns(text: &str) -> ProbeError {
    let whole = Span::new(0, text.len());
    ProbeError::Text(Diagnostic::new(
        "E0101",
        whole,
        "\"=\" assigns; compare with \"==\"",
    ))
}

impl Machine {
    /// The value of an expression as the program of an open call reads it.
    ///
    /// # Errors
    /// See [`ProbeError`].
    pub fn value(
        &self,
        call: usize,
        text: &str,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<Value, ProbeError> {
        let (program, probe) = self.compiled(call, text)?;
        let Probe::Value(expression) = probe else {
            return Err(assigns(text));
        };
        let value = self.at_call(call, &program).operand(&expression, memory, inputs);
        value.map_err(ProbeError::Fault)
    }

    /// As [`Machine::value`]; an assignment is carried out and has the value that its variable has afterwards.
    ///
    /// # Errors
    /// See [`ProbeError`].
    pub fn probe(
        &mut self,
        call: usize,
        text: &str,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<Value, ProbeError> {
        let (program, probe) = self.compiled(call, text)?;
        if let Probe::Value(_) = probe {
            return self.value(call, text, memory, inputs);
        }
        let mut machine = self.at_call(call, &program);
        if let Pause::Fault(fault) = machine.run(memory, inputs, &mut 1) {
            return Err(ProbeError::Fault(fault));
        }
        self.take_arguments(machine);
        let (target, _) = split_assignment(text).unwrap_or((text, ""));
        self.value(call, target, memory, inputs)
    }

    fn compiled(&self, call: usize, text: &str) -> Result<(Arc<Program>, Probe), ProbeError> {
        let (program, block) = self.scope(call);
        compile_probe(text, program, block).map_err(ProbeError::Text)
    }
}
