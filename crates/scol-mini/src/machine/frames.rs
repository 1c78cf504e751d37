//! The open calls of a machine, for a debugger: where each is, and its variables. Expressions are evaluated there by `probe`.

use crate::prelude::*;
use alloc::sync::Arc;

use super::{Argument, Frame, Machine, ValuePlace, is_motion};
use crate::memory::Memory;
use crate::options::Arm;
use crate::program::{Entry, Program, VariableInfo};
use crate::request::{Fault, Inputs};
use crate::tree::Expression;
use crate::value::Value;

/// A variable of a program, as one of its calls has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Local {
    /// Its name, in upper case.
    pub name: String,
    pub info: VariableInfo,
    /// Upper bounds of its subscripts; empty for a plain variable.
    pub bounds: Vec<u32>,
    /// `None` of an array, and before the first assignment.
    pub value: Option<Value>,
}

impl Machine {
    /// The arm for which its program is.
    pub fn arm(&self) -> Arm {
        self.program.options.arm
    }

    /// Number of open calls, the program itself among them.
    pub fn depth(&self) -> usize {
        self.frames.len()
    }

    /// The step at which the call with this index is; the program itself is 0.
    fn step_of(&self, call: usize) -> usize {
        let called = self.frames.get(call + 1);
        called.map_or(self.at, |called| called.return_to.saturating_sub(1))
    }

    fn block_of_call(&self, call: usize) -> Option<&Entry> {
        self.program.block_of(self.step_of(call))
    }

    /// The parameters and variables of the program of an open call.
    pub fn locals(&self, call: usize, memory: &Memory) -> Vec<Local> {
        let (Some(block), Some(frame)) = (self.block_of_call(call), self.frames.get(call)) else {
            return Vec::new();
        };
        let parameters = block.parameters.iter().enumerate().map(|(at, name)| {
            let value = self.argument_value(frame, at, memory);
            Local {
                name: name.clone(),
                info: VariableInfo {
                    kind: value.as_ref().map(Value::kind),
                    array: false,
                },
                bounds: Vec::new(),
                value,
            }
        });
        let slots = &self.program.symbols.slots;
        let own = slots.get(block.locals.clone()).unwrap_or_default();
        let own = own.iter().map(|slot| {
            let plain = slot.bounds.is_none();
            let value = plain
                .then(|| memory.value_in(slots, self.task, slot.base))
                .flatten();
            Local {
                name: slot.name.clone(),
                info: VariableInfo {
                    kind: slot.kind.or(value.as_ref().map(Value::kind)),
                    array: !plain,
                },
                bounds: slot.bounds.clone().unwrap_or_default(),
                value,
            }
        });
        parameters.chain(own).collect()
    }

    /// The value of the parameter with this number.
    fn argument_value(&self, frame: &Frame, parameter: usize, memory: &Memory) -> Option<Value> {
        let slots = &self.program.symbols.slots;
        let passed = self.arguments.get(frame.arguments + parameter)?;
        match passed {
            Argument::Place(ValuePlace::Cell { cell, .. }) => memory.value_in(slots, self.task, *cell),
            Argument::Place(ValuePlace::Argument(at)) => self.arguments.get(*at)?.value(),
            Argument::Number(_) | Argument::Vector(_) | Argument::Unset => passed.value(),
        }
    }

    /// The PROGRAM block of an open call, and its file.
    pub(crate) fn scope(&self, call: usize) -> (&Arc<Program>, Option<&Entry>) {
        (&self.program, self.block_of_call(call))
    }

    /// A machine before the first step of `program`, which sees the variables of an open call.
    pub(crate) fn at_call(&self, call: usize, program: &Arc<Program>) -> Machine {
        Machine {
            frames: self.frames.get(..=call).unwrap_or(&self.frames).to_vec(),
            arguments: self.arguments.clone(),
            task: self.task,
            ..Machine::main(Arc::clone(program))
        }
    }

    /// The value of an operand of its program.
    ///
    /// # Errors
    /// The fault of computing it.
    pub(crate) fn operand(
        &mut self,
        expression: &Expression,
        memory: &mut Memory,
        inputs: &dyn Inputs,
    ) -> Result<Value, Fault> {
        let program = Arc::clone(&self.program);
        let value = self.enter(&program, memory, inputs).evaluate(expression);
        value.map_err(|fault| *fault)
    }

    /// Takes over the arguments of a machine that [`Machine::at_call`] has made.
    pub(crate) fn take_arguments(&mut self, of: Machine) {
        self.arguments = of.arguments;
    }

    /// Whether the next statement, or the one under way, moves the arm.
    pub fn begins_motion(&self) -> bool {
        self.operation().is_some_and(is_motion)
    }
}
