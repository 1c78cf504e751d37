//! Runs one statement and tells what it does: values given to variables, the way of an IF, the target of a motion, a monitor that
//! acts.
//!
//! The instructions are run as in `vm`, one step at a time, and the steps say what to look at. Only a caller that listens comes
//! here. Start with [`Machine::run_told`].

use crate::prelude::*;
use alloc::sync::Arc;

use super::evaluate::Execution;
use super::place::{Argument, ValuePlace};
use super::{Machine, Result, RunPhase, needs_host};
use crate::code::{Array, Op, Register};
use crate::memory::Memory;
use crate::program::{Operation, Program, Slot};
use crate::request::{Inputs, Path, Pause, Request};
use crate::tree::{Ask, Change, Reference, Simple, Variable};
use crate::value::Value;

/// One thing that a statement does.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// A variable, an element `A(2)`, a coordinate `P.X` or a condition such as `SPEED` has a new value; a subprogram that is
    /// entered gives its parameters theirs.
    Assigned { name: String, value: Value },
    /// The condition of an IF was evaluated.
    Branch(Way),
    /// A motion was asked for, to this target.
    Target(Path),
    /// The statement is the action of a monitor, which acts now.
    Monitor,
}

/// The part of an IF that is executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// The statement after THEN.
    Then,
    /// The statement after ELSE.
    Else,
    /// None: the condition is false, and there is no ELSE.
    Neither,
}

/// A variable that a statement gives a value to: as the program names it, and where its value will be.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipient {
    name: String,
    place: ValuePlace,
}

impl Machine {
    /// Runs one statement as [`run`](Machine::run) does, and adds what it does to `effects`. Values that the answer to a request
    /// gives come later: ask [`recipients`](Machine::recipients) before the answer and [`received`](Machine::received) after it.
    pub fn run_told(
        &mut self,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        fuel: &mut u32,
        effects: &mut Vec<Effect>,
    ) -> Pause {
        let program = Arc::clone(&self.program);
        let is_head = |at: usize| program.steps.get(at).is_none_or(|step| step.head);
        if self.acts_for_monitor() {
            effects.push(Effect::Monitor);
        }
        loop {
            match &self.state {
                RunPhase::Requested(pending) => return Pause::Request(pending.request.clone()),
                RunPhase::Ended => return Pause::Ended,
                RunPhase::Waiting => {}
                RunPhase::Ready | RunPhase::Faulted => {
                    if is_head(self.at) {
                        match fuel.checked_sub(1) {
                            Some(left) => *fuel = left,
                            None => return Pause::Fuel,
                        }
                    }
                }
            }
            self.state = RunPhase::Ready;
            let stops = program
                .steps
                .get(self.at)
                .is_some_and(|step| needs_host(&step.operation));
            let done = self.enter(&program, memory, inputs).step_told(effects);
            if let Err(error) = done {
                return Pause::Fault(self.faulted(*error));
            }
            match &self.state {
                RunPhase::Waiting => return Pause::Waiting,
                RunPhase::Requested(pending) => return Pause::Request(pending.request.clone()),
                RunPhase::Ended => return Pause::Ended,
                RunPhase::Ready | RunPhase::Faulted if stops || is_head(self.at) => return Pause::Fuel,
                RunPhase::Ready | RunPhase::Faulted => {}
            }
        }
    }

    /// The variables to which the answer to the pending request gives values, in its order.
    pub fn recipients(&self) -> Vec<Recipient> {
        let RunPhase::Requested(pending) = &self.state else {
            return Vec::new();
        };
        let variables = match self.operation() {
            Some(Operation::Simple(Simple::Ask(Ask::Input(_, variables)))) => variables.as_slice(),
            Some(Operation::Simple(Simple::Ask(Ask::Task { target, .. }))) => target.as_slice(),
            _ => &[],
        };
        let pairs = variables.iter().zip(&pending.targets);
        pairs
            .map(|(variable, place)| recipient(&self.program, variable, *place))
            .collect()
    }

    /// The values that these variables have now; one without a value is left out.
    pub fn received<'a>(
        &'a self,
        memory: &'a Memory,
        recipients: &'a [Recipient],
    ) -> impl Iterator<Item = Effect> + 'a {
        recipients.iter().filter_map(|Recipient { name, place }| {
            let value = self.value_at(memory, *place)?;
            let name = name.clone();
            Some(Effect::Assigned { name, value })
        })
    }

    fn value_at(&self, memory: &Memory, place: ValuePlace) -> Option<Value> {
        match place {
            ValuePlace::Cell { cell, .. } => memory.value(cell),
            ValuePlace::Argument(at) => match self.arguments.get(at)? {
                Argument::Number(number) => Some((*number).into()),
                Argument::Vector(value) => Some(value.clone()),
                Argument::Place(place) => self.value_at(memory, *place),
                Argument::Unset => None,
            },
        }
    }

    /// Whether the next step is the action of a monitor: a program comes there no other way.
    fn acts_for_monitor(&self) -> bool {
        let before = self.at.checked_sub(1).and_then(|at| self.program.steps.get(at));
        let follows_on = before.is_some_and(|step| matches!(step.operation, Operation::On { .. }));
        follows_on && matches!(self.state, RunPhase::Ready)
    }
}

impl Execution<'_> {
    /// Runs the step under way and adds what it does.
    fn step_told(&mut self, effects: &mut Vec<Effect>) -> Result<()> {
        let (program, at) = (self.program, self.machine.at);
        let operation = program.steps.get(at).map(|step| &step.operation);
        let stored = operation.and_then(|operation| self.stored(at, operation));
        // A subscript counts as it is before the assignment.
        let recipient = match stored {
            Some(_) => None,
            None => operation.and_then(|operation| self.recipient(at, operation)),
        };
        let entry = program.code.entries.get(at).map_or(usize::MAX, |at| *at as usize);
        self.compute_step(entry)?;
        match operation {
            Some(Operation::Branch { otherwise, .. }) => {
                let has_else = program.steps.get(*otherwise).is_some_and(|step| !step.head);
                effects.push(Effect::Branch(match (self.machine.at == *otherwise, has_else) {
                    (false, _) => Way::Then,
                    (true, true) => Way::Else,
                    (true, false) => Way::Neither,
                }));
            }
            Some(Operation::Call { block, .. }) => self.parameters(*block, effects),
            Some(Operation::Simple(Simple::Change(Change::Set(condition, _)))) => {
                let name = condition.keyword().to_string();
                let value = self.condition(*condition);
                effects.push(Effect::Assigned { name, value });
            }
            _ => {}
        }
        let element = stored.and_then(|(variable, array, index)| self.element_stored(variable, array, index));
        if let Some((recipient, letter)) = element.map(|element| (element, None)).or(recipient) {
            effects.extend(self.assigned(recipient, letter));
        }
        if let RunPhase::Requested(pending) = &self.machine.state
            && let Request::Move(motion) = &pending.request
        {
            effects.push(Effect::Target(motion.path.clone()));
        }
        Ok(())
    }

    /// The instructions of a step.
    fn instructions(&self, at: usize) -> impl Iterator<Item = &Op> + use<'_> {
        let code = &self.program.code;
        let first = code.entries.get(at).map_or(usize::MAX, |first| *first as usize);
        let of_step = move |instruction: &usize| {
            code.steps
                .get(*instruction)
                .is_some_and(|step| *step as usize == at)
        };
        let indices = (first..code.instructions.len()).take_while(of_step);
        indices.filter_map(|index| code.instructions.get(index).map(|instruction| &instruction.op))
    }

    /// The array of one subscript into which a step stores, and the register that has the subscript then: storing an element
    /// leaves it alone.
    fn stored<'o>(&self, at: usize, operation: &'o Operation) -> Option<(&'o Variable, Array, Register)> {
        let Operation::Simple(Simple::Assign(assignment)) = operation else {
            return None;
        };
        let mut stores = self.instructions(at).filter_map(|op| {
            let Op::Store { array, index, .. } = op else {
                return None;
            };
            Some((*array, *index))
        });
        let (array, index) = stores.next()?;
        Some((&assignment.target, array, index))
    }

    fn element_stored(&self, variable: &Variable, array: Array, index: Register) -> Option<Recipient> {
        let index = usize::try_from(self.integer_in(index).ok()?).ok()?;
        let (slot, cell) = (self.slot(array.base), array.base as usize + index);
        Some(recipient(self.program, variable, ValuePlace::Cell { slot, cell }))
    }

    /// The variable that a step gives a value to by itself, and the letter of a coordinate.
    fn recipient(&mut self, at: usize, operation: &Operation) -> Option<(Recipient, Option<u8>)> {
        let (variable, letter) = if let Operation::Simple(Simple::Assign(assignment)) = operation {
            // The subscripts of an assignment are those of its instruction.
            let mut puts = self.instructions(at).filter_map(|op| {
                let Op::Put { variable, .. } = op else {
                    return None;
                };
                self.program.code.variables.get(*variable as usize)
            });
            (puts.next().unwrap_or(&assignment.target), assignment.component)
        } else if let Operation::For { counting, .. } = operation {
            (&counting.variable, None)
        } else if let Operation::Next { opener } = operation
            && let Operation::For { counting, .. } = &self.program.steps.get(*opener)?.operation
        {
            (&counting.variable, None)
        } else {
            return None;
        };
        // What cannot be found is a fault of the step.
        let place = self.place(variable).ok()?;
        Some((recipient(self.program, variable, place), letter))
    }

    fn assigned(&self, Recipient { name, place }: Recipient, letter: Option<u8>) -> Option<Effect> {
        let mut value = self.machine.value_at(self.memory, place)?;
        let Some(letter) = letter else {
            return Some(Effect::Assigned { name, value });
        };
        let coordinate = *super::evaluate::component(self.program.options.arm, &mut value, letter)?;
        Some(Effect::Assigned {
            name: format!("{name}.{}", char::from(letter)),
            value: Value::Real(coordinate as f32),
        })
    }

    /// The parameters of the program that has been entered.
    fn parameters(&self, block: usize, effects: &mut Vec<Effect>) {
        let Some(entry) = self.program.blocks.get(block) else {
            return;
        };
        for (at, name) in entry.parameters.iter().enumerate() {
            let place = self.machine.parameter_place(at);
            if let Some(value) = place.and_then(|place| self.machine.value_at(self.memory, place)) {
                let name = name.clone();
                effects.push(Effect::Assigned { name, value });
            }
        }
    }
}

fn recipient(program: &Program, variable: &Variable, place: ValuePlace) -> Recipient {
    let mut name = variable.name.text.clone();
    if let (ValuePlace::Cell { slot, cell }, Reference::Slot { .. }) = (place, variable.reference)
        && let Some(slot) = program
            .symbols
            .slots
            .get(slot)
            .filter(|slot| slot.bounds.is_some())
    {
        name += &element(slot, cell);
    }
    Recipient { name, place }
}

/// The subscripts of the element in this cell: `(1,2)`.
fn element(slot: &Slot, cell: usize) -> String {
    let subscripts = slot.subscripts(cell.saturating_sub(slot.base));
    let listed: Vec<String> = subscripts.iter().map(ToString::to_string).collect();
    format!("({})", listed.join(","))
}
