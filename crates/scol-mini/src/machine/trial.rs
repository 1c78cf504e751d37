//! Tries statements whose operands are constants, for the lints: the machine itself says which of them always alarm.
//!
//! A trial has a memory of its own and no effect. Which operands are constants is decided in `lint::constants`.

use crate::prelude::*;
use alloc::sync::Arc;

use super::{Machine, NoInputs, Result};
use crate::conditions::Conditions;
use crate::lower;
use crate::memory::Memory;
use crate::options::LanguageOptions;
use crate::program::{Operation, Program, Step, Symbols};
use crate::request::{Fault, FaultKind, Inputs, Pause, Request, Robot};
use crate::tree::Expression;
use crate::value::{Position, Value};

/// The value of an expression without variables. DIN and the like read `inputs`.
pub(crate) fn try_value(
    expression: &Expression,
    options: &LanguageOptions,
    inputs: &dyn Inputs,
) -> Result<Value> {
    let mut expression = expression.clone();
    let code = lower::constant(&mut expression);
    let program = Arc::new(Program {
        code,
        ..Program::without_steps(0, options)
    });
    let mut memory = Memory::new(&program);
    let mut machine = Machine::main(Arc::clone(&program));
    machine.enter(&program, &mut memory, inputs).evaluate(&expression)
}

/// Executes operations without variables, each by itself; gives the request of each, if it asks for something.
///
/// The fault of a variable without a value, which is not an operand, counts as nothing.
pub(crate) fn try_operations(
    operations: Vec<Operation>,
    options: &LanguageOptions,
    inputs: &dyn Inputs,
) -> Vec<Result<Option<Request>, Fault>> {
    // One program for all: most of the time of a trial is that of making one.
    let steps = operations.into_iter().map(|operation| Step {
        line: 1,
        head: true,
        operation,
    });
    let mut steps: Vec<Step> = steps.collect();
    let code = lower::code(&mut steps, &[], &Symbols::default());
    let program = Arc::new(Program {
        steps,
        code,
        ..Program::without_steps(0, options)
    });
    let mut memory = Memory::new(&program);
    let tried = (0..program.steps.len()).map(|at| {
        let mut machine = Machine {
            at,
            ..Machine::main(Arc::clone(&program))
        };
        *memory.conditions_mut() = Conditions::default();
        match machine.run(&mut memory, inputs, &mut 1) {
            Pause::Request(request) => Ok(Some(request)),
            Pause::Fault(fault) if !matches!(fault.kind, FaultKind::Undefined | FaultKind::Type) => {
                Err(fault)
            }
            Pause::Fault(_) | Pause::Fuel | Pause::Waiting | Pause::Ended => Ok(None),
        }
    });
    tried.collect()
}

/// The inputs of a robot at rest, all of them off.
pub(crate) struct TrialInputs<'a> {
    pub robot: &'a dyn Robot,
}

impl Inputs for TrialInputs<'_> {
    fn din(&self, line: u16) -> bool {
        NoInputs.din(line)
    }
    fn has_input(&self, line: u16) -> bool {
        self.robot.has_input(line)
    }
    fn dout(&self, line: u16) -> bool {
        NoInputs.dout(line)
    }
    fn motion_percent(&self) -> f64 {
        NoInputs.motion_percent()
    }
    fn here(&self) -> Position {
        NoInputs.here()
    }
    fn mode(&self) -> i32 {
        NoInputs.mode()
    }
}
