//! Writes the compiled form of a program. A step that computes with numbers alone becomes the instructions that do it;
//! every other step becomes one [`Op::Step`].
//!
//! What the instructions mean is in `code`, `machine::vm` runs them. Steps come from `emit`. Start with [`code`].

use alloc::collections::BTreeMap;

use crate::builtin::Builtin;
use crate::code::{
    Array, Call, Code, Instruction, Op, Operands, Passed, Register, Rows, TEMPORARIES, Target,
};
use crate::machine::constant_value;
use crate::options::LanguageOptions;
use crate::program::{Entry, Operation, Step, Symbols};
use crate::tree::{Binary, Expression, Node, Reference, Simple, Variable};
use crate::value::Number;

/// The code of these steps.
pub(super) fn code(steps: &[Step], blocks: &[Entry], symbols: &Symbols, options: &LanguageOptions) -> Code {
    let mut lowering = Lowering {
        steps,
        blocks,
        symbols,
        options,
        code: Code::default(),
        step: 0,
        constants: BTreeMap::new(),
        temporaries: 0,
    };
    for (number, step) in steps.iter().enumerate() {
        lowering.code.entries.push(wide(lowering.code.instructions.len()));
        lowering.step(number, &step.operation);
    }
    resolve(&mut lowering.code);
    lowering.code
}

/// The code of these steps without registers, one instruction a step. A statement that is executed directly has this form,
/// since it shares the memory of another program.
pub(crate) fn plain(steps: &[Step]) -> Code {
    let mut code = Code::default();
    for (number, step) in (0..).zip(steps) {
        let returns = step.operation == Operation::Return;
        let op = if returns { Op::Return } else { Op::Step };
        let cost = u8::from(step.head);
        code.entries.push(number);
        code.steps.push(number);
        code.instructions.push(Instruction { cost, op });
    }
    code
}

/// Targets are steps while the code is written; puts the instructions of those steps in their place.
fn resolve(code: &mut Code) {
    let end = wide(code.instructions.len());
    let entries = &code.entries;
    let entry = |step: &mut Target| *step = entries.get(*step as usize).copied().unwrap_or(end);
    for instruction in &mut code.instructions {
        if let Op::Jump(target)
        | Op::Next { target, .. }
        | Op::Branch { target, .. }
        | Op::Truth { target, .. } = &mut instruction.op
        {
            entry(target);
        }
    }
    code.choices.iter_mut().for_each(entry);
    code.calls.iter_mut().for_each(|call| entry(&mut call.entry));
}

struct Lowering<'a> {
    steps: &'a [Step],
    blocks: &'a [Entry],
    symbols: &'a Symbols,
    options: &'a LanguageOptions,
    code: Code,
    /// The step under way.
    step: usize,
    /// Kind and bits of a constant, and its register.
    constants: BTreeMap<(bool, u32), Register>,
    /// Temporaries that the step under way uses.
    temporaries: usize,
}

/// Where the number of a variable is.
enum Location {
    Register(Register),
    /// In an array, with its flat subscript in this register.
    Element(Array, Register),
    Parameter(u16),
}

/// A step that needs a number beyond 16 bits becomes [`Op::Step`].
fn narrow(number: usize) -> Option<u16> {
    u16::try_from(number).ok()
}

/// Steps and instructions are fewer than the bytes of a source.
fn wide(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

impl Lowering<'_> {
    fn push(&mut self, op: Op) {
        let starts = self.code.entries.last() == Some(&wide(self.code.instructions.len()));
        let head = self.steps.get(self.step).is_some_and(|step| step.head);
        let cost = u8::from(starts && head);
        self.code.steps.push(wide(self.step));
        self.code.instructions.push(Instruction { cost, op });
    }

    fn step(&mut self, number: usize, operation: &Operation) {
        let start = self.code.instructions.len();
        (self.step, self.temporaries) = (number, 0);
        if self.operation(operation).is_none() {
            self.code.instructions.truncate(start);
            self.code.steps.truncate(start);
            self.push(Op::Step);
        }
    }

    /// Writes the instructions of a step; `None` when numbers alone cannot do it.
    fn operation(&mut self, operation: &Operation) -> Option<()> {
        match operation {
            Operation::Simple(Simple::Assign(assignment)) if assignment.component.is_none() => {
                self.assign(&assignment.target, &assignment.value)?;
            }
            Operation::Branch { condition, otherwise } => self.branch(condition, wide(*otherwise))?,
            Operation::Jump(target) => self.push(Op::Jump(wide(*target))),
            Operation::Select { selector, targets } => {
                let a = self.register(selector)?;
                let (first, count) = (wide(self.code.choices.len()), narrow(targets.len())?);
                let targets = targets.iter().map(|target| wide(*target));
                self.code.choices.extend(targets);
                self.push(Op::Choose { a, first, count });
            }
            Operation::Next { opener } => self.next(*opener)?,
            Operation::Call { block, arguments } => self.call(*block, arguments)?,
            Operation::Return => self.push(Op::Return),
            Operation::Simple(_)
            | Operation::Wait(_)
            | Operation::For { .. }
            | Operation::On { .. }
            | Operation::HandlerEnd => return None,
        }
        Some(())
    }

    fn assign(&mut self, target: &Variable, value: &Expression) -> Option<()> {
        let op = match self.location(target)? {
            Location::Register(to) => return self.compute(value, Some(to)).map(drop),
            Location::Element(array, index) => {
                let a = self.register(value)?;
                Op::Store { array, index, a }
            }
            Location::Parameter(parameter) => {
                let a = self.register(value)?;
                Op::Put { parameter, a }
            }
        };
        self.push(op);
        Some(())
    }

    fn branch(&mut self, condition: &Expression, target: Target) -> Option<()> {
        let op = if let Node::Binary(Binary::Relation(relation), left, right) = &condition.node {
            Op::Branch {
                relation: *relation,
                a: self.register(left)?,
                b: self.register(right)?,
                target,
            }
        } else {
            let a = self.register(condition)?;
            Op::Truth { a, target }
        };
        self.push(op);
        Some(())
    }

    fn next(&mut self, opener: usize) -> Option<()> {
        let Operation::For { counting, .. } = &self.steps.get(opener)?.operation else {
            return None;
        };
        let Location::Register(variable) = self.location(&counting.variable)? else {
            return None;
        };
        self.push(Op::Next {
            variable,
            opener: wide(opener),
            target: wide(opener + 1),
        });
        Some(())
    }

    fn call(&mut self, block: usize, arguments: &[Expression]) -> Option<()> {
        let entry = wide(self.blocks.get(block)?.step);
        let arguments = arguments.iter().map(|argument| self.passed(argument));
        let arguments = arguments.collect::<Option<_>>()?;
        self.push(Op::Call(wide(self.code.calls.len())));
        self.code.calls.push(Call {
            arguments,
            entry,
            return_to: wide(self.step + 1),
        });
        Some(())
    }

    fn passed(&mut self, argument: &Expression) -> Option<Passed> {
        let Node::Variable(variable) = &argument.node else {
            return self.register(argument).map(Passed::Value);
        };
        match variable.reference {
            Reference::Slot { slot, cell } if variable.subscripts.is_empty() => Some(Passed::Variable {
                slot: wide(slot),
                cell: wide(cell),
            }),
            Reference::Parameter(parameter) => narrow(parameter).map(Passed::Parameter),
            Reference::Slot { .. } | Reference::Unresolved => None,
        }
    }

    /// The register an expression is in once its instructions are done.
    fn register(&mut self, expression: &Expression) -> Option<Register> {
        self.compute(expression, None)
    }

    /// Writes the instructions of an expression, the last of them with the result to `to`. Without `to` the result is
    /// where it already is, or in a temporary.
    fn compute(&mut self, expression: &Expression, to: Option<Register>) -> Option<Register> {
        if expression.is_constant() {
            let value = constant_value(expression, self.options).ok()?;
            let a = self.constant(value.number()?)?;
            return self.copy(to, a);
        }
        match &expression.node {
            Node::Variable(variable) => match self.location(variable)? {
                Location::Register(a) => self.copy(to, a),
                Location::Element(array, index) => self.result(to, |to| Op::Load { to, array, index }),
                Location::Parameter(parameter) => self.result(to, |to| Op::Fetch { to, parameter }),
            },
            Node::Unary(operator, of) => {
                let (operator, a) = (*operator, self.register(of)?);
                self.result(to, |to| Op::Unary { operator, to, a })
            }
            Node::Binary(operator, left, right) => {
                let (a, b) = (self.register(left)?, self.register(right)?);
                let op = match *operator {
                    Binary::Add => Op::Add,
                    Binary::Subtract => Op::Subtract,
                    Binary::Multiply => Op::Multiply,
                    Binary::Divide => Op::Divide,
                    operator @ (Binary::Or
                    | Binary::And
                    | Binary::Relation(_)
                    | Binary::Modulo
                    | Binary::Power) => {
                        return self.result(to, |to| Op::Binary(operator, Operands { to, a, b }));
                    }
                };
                self.result(to, |to| op(Operands { to, a, b }))
            }
            Node::Function(Builtin::Numeric(function), arguments) => {
                let a = self.register(arguments.first()?)?;
                let b = arguments.get(1).map_or(Some(a), |second| self.register(second))?;
                self.result(to, |to| Op::Function(*function, Operands { to, a, b }))
            }
            Node::Function(..) | Node::Literal(_) | Node::Component(..) | Node::System(_) => None,
        }
    }

    /// Writes an instruction with its result to `to`, or to a temporary.
    fn result(&mut self, to: Option<Register>, op: impl FnOnce(Register) -> Op) -> Option<Register> {
        let to = to.or_else(|| self.temporary())?;
        self.push(op(to));
        Some(to)
    }

    /// Copies a register to `to`, if it is to be there.
    fn copy(&mut self, to: Option<Register>, a: Register) -> Option<Register> {
        match to {
            Some(_) => self.result(to, |to| Op::Copy { to, a }),
            None => Some(a),
        }
    }

    /// Where a variable is that can hold a number; an array has one or two subscripts.
    fn location(&mut self, variable: &Variable) -> Option<Location> {
        let slot = match variable.reference {
            Reference::Slot { slot, .. } => self.symbols.slots.get(slot)?,
            Reference::Parameter(parameter) => return narrow(parameter).map(Location::Parameter),
            Reference::Unresolved => return None,
        };
        if slot.kind.is_some_and(|kind| !kind.is_number()) {
            return None;
        }
        let (base, subscripts) = (narrow(slot.base)?, variable.subscripts.as_slice());
        let row = match slot.bounds.as_deref() {
            None => return subscripts.is_empty().then_some(Location::Register(base)),
            Some([_]) => 1,
            Some([_, second]) => u16::try_from(second.checked_add(1)?).ok()?,
            Some(_) => return None,
        };
        let length = narrow(slot.length())?;
        // That the last cell has a number spares looking at that of each.
        base.checked_add(length)?;
        let index = match subscripts {
            [only] => self.register(only)?,
            [first, second] => {
                let (a, b) = (self.register(first)?, self.register(second)?);
                self.result(None, |to| {
                    Op::Flatten(Operands { to, a, b }, Rows { row, length })
                })?
            }
            _ => return None,
        };
        Some(Location::Element(Array { base, length }, index))
    }

    fn temporary(&mut self) -> Option<Register> {
        let number = Some(self.temporaries).filter(|number| *number < TEMPORARIES)?;
        self.temporaries += 1;
        narrow(self.symbols.cells + number)
    }

    fn constant(&mut self, number: Number) -> Option<Register> {
        let key = match number {
            Number::Integer(value) => (false, value as u32),
            Number::Real(value) => (true, value.to_bits()),
        };
        if let Some(known) = self.constants.get(&key) {
            return Some(*known);
        }
        let register = narrow(self.symbols.cells + TEMPORARIES + self.code.constants.len())?;
        self.code.constants.push(number);
        self.constants.insert(key, register);
        Some(register)
    }
}
