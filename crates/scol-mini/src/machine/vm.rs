//! Runs the instructions of a program: the loop of the machine.
//!
//! Almost everything a program computes is a number, so each instruction tries numbers first. Other values, and numbers that
//! are converted, take a function beside the loop (`#[inline(never)]`): the loop is fast because it is small. Statements are
//! executed in `execute`, the instructions are defined in `code`; start with [`Execution::compute`].

use crate::prelude::*;

use super::arithmetic::{binary, holds, integers, real, reals, reals_hold, truth, unary};
use super::evaluate::{Execution, component, no_component};
use super::functions::numeric;
use super::place::{Argument, ValuePlace};
use super::{Result, RunPhase, needs_host};
use crate::cell::Cell;
use crate::code::{Array, Instruction, Op, Operands, Register, Target};
use crate::program::Operation;
use crate::request::Fault;
use crate::tree::{Binary, Formula, Relation};
use crate::value::Number;

/// Position of the machine after an instruction.
enum Next {
    Following,
    To(Target),
    /// The formula is done, or the machine pauses; `at` and `state` say where and why.
    Stop,
}

impl Execution<'_> {
    /// Runs instructions from this one on, until one stops or the fuel is used up.
    ///
    /// # Errors
    /// The fault of a statement, where `at` is then.
    #[inline(never)]
    pub(super) fn compute(&mut self, mut at: usize, fuel: &mut u64) -> Result<()> {
        let code = &self.program.code;
        let mut left = *fuel;
        let result = loop {
            let Some(Instruction { cost, op }) = code.instructions.get(at) else {
                self.machine.at = self.program.steps.len();
                self.machine.state = RunPhase::Ended;
                break Ok(());
            };
            let Some(rest) = left.checked_sub(u64::from(*cost)) else {
                self.machine.at = self.step(at);
                break Ok(());
            };
            left = rest;
            match self.instruction(at, op) {
                Ok(Next::Following) => at += 1,
                Ok(Next::To(target)) => at = target as usize,
                Ok(Next::Stop) => break Ok(()),
                Err(fault) => break Err(self.first_fault(at, fault)),
            }
        };
        *fuel = left;
        result
    }

    /// Runs the instructions of the step under way alone, from its first one on, and moves on.
    ///
    /// # Errors
    /// The fault of the step, where `at` is then.
    #[inline(never)]
    pub(super) fn compute_step(&mut self, mut at: usize) -> Result<()> {
        let step = self.step(at);
        loop {
            let Some(Instruction { op, .. }) = self.program.code.instructions.get(at) else {
                self.machine.at = self.program.steps.len();
                self.machine.state = RunPhase::Ended;
                return Ok(());
            };
            let begins = |at: usize| {
                self.program
                    .code
                    .entries
                    .get(step)
                    .is_some_and(|first| *first as usize == at)
            };
            let (next, is_over) = match self.instruction(at, op) {
                Ok(Next::Following) => (at + 1, false),
                // Formulas are skipped within a step; a loop of one step jumps to itself.
                Ok(Next::To(target)) => (target as usize, begins(target as usize)),
                Ok(Next::Stop) => return Ok(()),
                Err(fault) => return Err(self.first_fault(at, fault)),
            };
            if is_over || self.step(next) != step {
                self.machine.at = self.step(next);
                return Ok(());
            }
            at = next;
        }
    }

    /// The register that has the value of an operand.
    pub(super) fn result(&mut self, formula: Formula) -> Result<Register> {
        if let Some(start) = formula.start {
            self.compute(start as usize, &mut 0)?;
        }
        Ok(formula.result)
    }

    /// Does one instruction.
    #[inline(always)]
    fn instruction(&mut self, at: usize, op: &Op) -> Result<Next> {
        // Operands are taken apart here: handed on as one value they would be copied and cut up again.
        match *op {
            Op::Execute => return self.statement(at),
            Op::Done => return Ok(Next::Stop),
            Op::Jump(target) => return Ok(Next::To(target)),
            Op::Skip(count) => return Ok(Next::To(at as Target + 1 + count)),
            Op::Call(target) => {
                self.called(at)?;
                return Ok(Next::To(target));
            }
            Op::Return => return Ok(self.returned(at)),
            Op::Next {
                counter,
                opener,
                target,
            } => {
                if self.next(counter, opener as usize)? {
                    return Ok(Next::To(target));
                }
            }
            Op::Copy { to, a } => {
                if self.registers().copy(to, a).is_none() {
                    self.copy(to, a)?;
                }
            }
            Op::Add(operands) => self.arithmetic(Binary::Add, operands)?,
            Op::Subtract(operands) => self.arithmetic(Binary::Subtract, operands)?,
            Op::Multiply(operands) => self.arithmetic(Binary::Multiply, operands)?,
            Op::Divide(operands) => self.arithmetic(Binary::Divide, operands)?,
            Op::Binary(operator, operands) => self.operator(operator, operands)?,
            Op::Unary { operator, to, a } => {
                let number = unary(operator, self.number_in(a)?)?;
                self.put(to, number)?;
            }
            Op::Branch {
                relation,
                a,
                b,
                target,
            } => {
                if !self.holds(relation, a, b)? {
                    return Ok(Next::To(target));
                }
            }
            Op::Truth { a, target } => {
                if !truth(self.number_in(a)?) {
                    return Ok(Next::To(target));
                }
            }
            Op::Numeric(function, Operands { to, a, b }) => {
                let (a, b) = (self.number_in(a)?, self.number_in(b)?);
                self.put(to, numeric(function, a, b, &self.program.options)?)?;
            }
            Op::Function { to, function } => {
                if let Some((builtin, arguments)) = self.program.code.functions.get(function as usize) {
                    let value = self.function(*builtin, arguments)?;
                    self.store(to, value)?;
                }
            }
            Op::System { to, system } => {
                let value = self.system(system);
                self.store(to, value)?;
            }
            Op::Component { to, a, letter } => self.coordinate(to, a, letter)?,
            Op::Load { to, array, index } => {
                let mut registers = self.registers();
                let element = registers.element(array, index);
                if element.and_then(|element| registers.copy(to, element)).is_none() {
                    let element = self.element_of(array, index)?;
                    self.copy(to, element)?;
                }
            }
            Op::Store { array, index, a } => {
                let mut registers = self.registers();
                let element = registers.element(array, index);
                if element.and_then(|element| registers.copy(element, a)).is_none() {
                    self.store_element(array, index, a)?;
                }
            }
            Op::Fetch {
                to,
                variable,
                parameter,
            } => match self.parameter(parameter) {
                Some(number) => self.put(to, number)?,
                None => self.fetch_into(to, variable)?,
            },
            // An argument by value is a place of the call, not a register.
            Op::Put {
                variable,
                parameter,
                a,
            } => match (self.parameter_cell(parameter), self.cell(a).number()) {
                (Some(cell), Some(number)) => self.put(cell, number)?,
                _ => self.put_variable(variable, a)?,
            },
            Op::Choose { a, first, count } => {
                if let Some(target) = self.choice(a, first, count)? {
                    return Ok(Next::To(target));
                }
            }
        }
        Ok(Next::Following)
    }

    /// An operator. One comparison finds two integers: loops of integers are a fifth faster for it.
    #[inline(always)]
    fn arithmetic(&mut self, operator: Binary, Operands { to, a, b }: Operands) -> Result<()> {
        let options = &self.program.options;
        let mut registers = self.registers();
        let (left, right) = (registers.cell(a), registers.cell(b));
        let number = if let Some([left, right]) = Cell::integers([left, right]) {
            integers(operator, left, right, options)?
        } else if let (Some(left), Some(right)) = (left.single(), right.single()) {
            reals(operator, left, right, options.equal_within)?
        } else {
            return self.any_arithmetic(operator, to, a, b);
        };
        match registers.put(to, number) {
            Some(()) => Ok(()),
            None => self.store(to, number.into()),
        }
    }

    /// An operator that has no instruction of its own.
    #[inline(never)]
    fn operator(&mut self, operator: Binary, operands: Operands) -> Result<()> {
        self.arithmetic(operator, operands)
    }

    /// The same with values of any type, including wrong ones: the left one is reported first.
    #[inline(never)]
    fn any_arithmetic(&mut self, operator: Binary, to: Register, a: Register, b: Register) -> Result<()> {
        let value = if operator.takes_vectors() {
            let (left, right) = (self.value_in(a)?, self.value_in(b)?);
            self.combined(operator, left, right)?
        } else {
            let (left, right) = (self.number_in(a)?, self.number_in(b)?);
            binary(operator, left, right, &self.program.options)?.into()
        };
        self.store(to, value)
    }

    #[inline(always)]
    fn holds(&self, relation: Relation, a: Register, b: Register) -> Result<bool> {
        let within = self.program.options.equal_within;
        let (left, right) = (self.cell(a), self.cell(b));
        if let Some([left, right]) = Cell::integers([left, right]) {
            return Ok(holds(relation, &left, &right));
        }
        if let (Some(left), Some(right)) = (left.single(), right.single()) {
            return Ok(reals_hold(relation, left, right, within));
        }
        // One of them is no number.
        self.number_in(a).and(self.number_in(b)).map(|_| false)
    }

    #[inline(never)]
    fn coordinate(&mut self, to: Register, a: Register, letter: u8) -> Result<()> {
        let mut value = self.value_in(a)?;
        match component(self.program.options.arm, &mut value, letter) {
            Some(coordinate) => {
                let number = real(*coordinate as f32)?;
                self.put(to, number)
            }
            None => Err(no_component(&value, letter)),
        }
    }

    /// The register of an element of an array.
    #[inline(never)]
    fn element_of(&mut self, array: Array, index: Register) -> Result<Register> {
        let index = self.integer_in(index)?;
        let cell = self.element(self.slot(array.base), array.base as usize, &[index])?;
        Ok(cell as Register)
    }

    #[inline(never)]
    fn store_element(&mut self, array: Array, index: Register, a: Register) -> Result<()> {
        // The value comes before the subscript, although it is written after it.
        let value = self.value_in(a)?;
        let element = self.element_of(array, index)?;
        self.store(element, value)
    }

    /// The number of a parameter that was passed by value.
    #[inline(always)]
    fn parameter(&self, parameter: Option<u32>) -> Option<Number> {
        match self.machine.parameter_place(parameter? as usize)? {
            ValuePlace::Cell { cell, .. } => self.cell(cell as Register).number(),
            ValuePlace::Argument(at) => match self.machine.arguments.get(at)? {
                Argument::Number(number) => Some(*number),
                Argument::Place(_) | Argument::Vector(_) | Argument::Unset => None,
            },
        }
    }

    /// The register of a parameter that refers to a variable of the caller.
    #[inline(always)]
    fn parameter_cell(&self, parameter: Option<u32>) -> Option<Register> {
        match self.machine.parameter_place(parameter? as usize)? {
            ValuePlace::Cell { cell, .. } => Some(cell as Register),
            ValuePlace::Argument(_) => None,
        }
    }

    #[inline(never)]
    fn fetch_into(&mut self, to: Register, variable: u32) -> Result<()> {
        let program = self.program;
        if let Some(variable) = program.code.variables.get(variable as usize) {
            let value = self.fetch(variable)?;
            self.store(to, value)?;
        }
        Ok(())
    }

    #[inline(never)]
    fn put_variable(&mut self, variable: u32, a: Register) -> Result<()> {
        let value = self.value_in(a)?;
        let program = self.program;
        if let Some(variable) = program.code.variables.get(variable as usize) {
            let place = self.place(variable)?;
            self.write(place, value)?;
        }
        Ok(())
    }

    /// The target of a computed GOTO, counted from 1.
    #[inline(always)]
    fn choice(&self, a: Register, first: u32, count: u32) -> Result<Option<Target>> {
        // What is less than 1 becomes more than there are.
        let at = (self.integer_in(a)? as u32).wrapping_sub(1);
        let choices = self.program.code.choices.get(first as usize..);
        let target = choices.and_then(|choices| choices.get(at as usize));
        Ok(target.copied().filter(|_| at < count))
    }

    /// Executes the operation of a step.
    #[inline(never)]
    fn statement(&mut self, at: usize) -> Result<Next> {
        self.machine.at = self.step(at);
        let program = self.program;
        let Some(step) = program.steps.get(self.machine.at) else {
            return Ok(Next::Stop);
        };
        self.execute(&step.operation)?;
        if self.machine.state != RunPhase::Ready {
            return Ok(Next::Stop);
        }
        if needs_host(&step.operation) {
            self.machine.leave_if();
            return Ok(Next::Stop);
        }
        Ok(self.entry(self.machine.at))
    }

    /// Enters a program.
    #[inline(never)]
    fn called(&mut self, at: usize) -> Result<()> {
        self.machine.at = self.step(at);
        let program = self.program;
        match program.steps.get(self.machine.at).map(|step| &step.operation) {
            Some(Operation::Call { arguments, .. }) => self.call(self.machine.at + 1, arguments),
            _ => Ok(()),
        }
    }

    /// Leaves the program under way; the main program ends.
    #[inline(always)]
    fn returned(&mut self, at: usize) -> Next {
        match self.machine.pop_frame() {
            Some(step) => self.entry(step),
            None => {
                self.machine.at = self.step(at);
                self.machine.state = RunPhase::Ended;
                Next::Stop
            }
        }
    }

    /// The first instruction of a step.
    fn entry(&self, step: usize) -> Next {
        let entry = self.program.code.entries.get(step).copied();
        Next::To(entry.unwrap_or(Target::MAX))
    }

    /// The step of an instruction.
    fn step(&self, at: usize) -> usize {
        let step = self.program.code.steps.get(at);
        step.map_or(self.program.steps.len(), |step| *step as usize)
    }

    /// The fault of an instruction, or that of an operand on its left, which the source has first. To read each left
    /// operand where it is written would take an instruction more in every sum.
    #[cold]
    fn first_fault(&mut self, at: usize, fault: Box<Fault>) -> Box<Fault> {
        self.machine.at = self.step(at);
        let at = at as Target;
        let operands = self.program.code.operands.iter();
        for left in operands.filter(|left| left.before.contains(&at)) {
            let read = match left.is_number {
                true => self.number_in(left.register).map(drop),
                false => self.value_in(left.register).map(drop),
            };
            if let Err(first) = read {
                return first;
            }
        }
        fault
    }
}
