//! Writes the instructions of the steps.
//!
//! The instructions are defined in `code` and run by `machine::vm`. Steps come from `emit`, names are resolved before.
//! Start with [`code`].

use crate::prelude::*;
use alloc::collections::BTreeMap;

use crate::builtin::Builtin;
use crate::cell::Cell;
use crate::code::{Array, Code, Instruction, LeftOperand, Op, Operands, Register, Target};
use crate::program::{Entry, Operation, Slot, Step, Symbols};
use crate::tree::{
    Assignment, Binary, Counting, Expression, Formula, Node, Reference, Simple, Unary, Variable,
};
use crate::value::Number;

/// The code of these steps, whose operands learn where their formulas are.
pub(crate) fn code(steps: &mut [Step], blocks: &[Entry], symbols: &Symbols) -> Code {
    let mut lowering = Lowering::new(blocks, symbols);
    for (number, step) in (0..).zip(steps) {
        lowering.code.entries.push(lowering.here());
        (lowering.step, lowering.is_head, lowering.held) = (number, step.head, 0);
        lowering.operation(&mut step.operation);
    }
    lowering.resolve();
    lowering.code
}

/// The code of one operand without variables.
pub(crate) fn constant(expression: &mut Expression) -> Code {
    let symbols = Symbols::default();
    let mut lowering = Lowering::new(&[], &symbols);
    lowering.formula(expression);
    lowering.code
}

struct Lowering<'a> {
    blocks: &'a [Entry],
    symbols: &'a Symbols,
    code: Code,
    /// The step under way.
    step: u32,
    is_head: bool,
    /// Kind and bits of a constant, and its register.
    constants: BTreeMap<(bool, u32), Register>,
    /// The registers of temporaries, and how many of them hold something.
    temporaries: Vec<Register>,
    held: usize,
    /// Variables of the loops of these steps, where they are plain variables.
    counters: BTreeMap<usize, Register>,
}

/// Place of a variable.
enum Location {
    Register(Register),
    /// In an array, with its subscript in this register.
    Element(Array, Register),
    /// In the table of variables; a parameter has its number.
    Table(u32, Option<u32>),
}

/// Steps, instructions and cells are far fewer than 32 bits count: a source has at most
/// [`MAX_SOURCE`](crate::MAX_SOURCE) bytes.
fn wide(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

impl<'a> Lowering<'a> {
    fn new(blocks: &'a [Entry], symbols: &'a Symbols) -> Self {
        Lowering {
            blocks,
            symbols,
            code: Code::default(),
            step: 0,
            is_head: false,
            constants: BTreeMap::new(),
            temporaries: Vec::new(),
            held: 0,
            counters: BTreeMap::new(),
        }
    }

    /// The next instruction.
    fn here(&self) -> Target {
        wide(self.code.instructions.len())
    }

    fn push(&mut self, op: Op) {
        let starts = self.code.entries.last() == Some(&self.here());
        let cost = u8::from(starts && self.is_head);
        self.code.steps.push(self.step);
        self.code.instructions.push(Instruction { cost, op });
    }

    /// Targets are steps while the code is written; puts the instructions of those steps in their place.
    fn resolve(&mut self) {
        let end = self.here();
        let entries = &self.code.entries;
        let entry = |step: &mut Target| *step = entries.get(*step as usize).copied().unwrap_or(end);
        for instruction in &mut self.code.instructions {
            if let Op::Jump(target)
            | Op::Call(target)
            | Op::Next { target, .. }
            | Op::Branch { target, .. }
            | Op::Truth { target, .. } = &mut instruction.op
            {
                entry(target);
            }
        }
        self.code.choices.iter_mut().for_each(entry);
    }

    fn operation(&mut self, operation: &mut Operation) {
        match operation {
            Operation::Simple(Simple::Assign(assignment)) if assignment.component.is_none() => {
                self.assign(assignment);
            }
            Operation::Branch { condition, otherwise } => self.branch(condition, wide(*otherwise)),
            Operation::Jump(target) => self.push(Op::Jump(wide(*target))),
            Operation::Select { selector, targets } => {
                let a = self.register(selector);
                let (first, count) = (wide(self.code.choices.len()), wide(targets.len()));
                let targets = targets.iter().map(|target| wide(*target));
                self.code.choices.extend(targets);
                self.push(Op::Choose { a, first, count });
            }
            Operation::Next { opener } => {
                let counter = self.counters.get(opener).copied();
                let (opener, target) = (wide(*opener), wide(*opener + 1));
                self.push(Op::Next {
                    counter,
                    opener,
                    target,
                });
            }
            Operation::Call { block, arguments } => {
                let entry = self.blocks.get(*block).map_or(0, |entry| entry.step);
                self.push(Op::Call(wide(entry)));
                for argument in arguments {
                    // A variable is passed itself.
                    if let Node::Variable(variable) = &mut argument.node {
                        self.subscripts(variable);
                    } else {
                        self.formula(argument);
                    }
                }
            }
            Operation::Return => self.push(Op::Return),
            // The formulas follow: execution goes on with the next step, not with the next instruction.
            Operation::Simple(simple) => {
                self.push(Op::Execute);
                simple.expressions(&mut |expression, _| self.formula(expression));
                simple
                    .targets()
                    .iter_mut()
                    .for_each(|variable| self.subscripts(variable));
            }
            Operation::Wait(condition) | Operation::On { condition, .. } => {
                self.push(Op::Execute);
                self.formula(condition);
            }
            Operation::For { counting, .. } => {
                self.push(Op::Execute);
                self.counting(counting);
            }
            Operation::HandlerEnd => self.push(Op::Execute),
        }
    }

    fn counting(&mut self, counting: &mut Counting) {
        if let Some(register) = self.plain(&counting.variable) {
            self.counters.insert(self.step as usize, register);
        }
        self.subscripts(&mut counting.variable);
        self.formula(&mut counting.from);
        self.formula(&mut counting.to);
        counting.step.iter_mut().for_each(|step| self.formula(step));
    }

    fn assign(&mut self, Assignment { target, value, .. }: &mut Assignment) {
        if let Some(to) = self.plain(target) {
            self.compute(value, Some(to));
            return;
        }
        let a = self.register(value);
        let operand = self.left(a, false);
        let location = self.location(target);
        self.right(operand);
        self.push(match location {
            Location::Register(to) => Op::Copy { to, a },
            Location::Element(array, index) => Op::Store { array, index, a },
            Location::Table(variable, parameter) => Op::Put {
                variable,
                parameter,
                a,
            },
        });
    }

    fn branch(&mut self, condition: &mut Expression, target: Target) {
        let op = if let Node::Binary(Binary::Relation(relation), left, right) = &mut condition.node {
            let relation = *relation;
            let [a, b] = self.operands(true, left, right);
            Op::Branch {
                relation,
                a,
                b,
                target,
            }
        } else {
            let a = self.register(condition);
            Op::Truth { a, target }
        };
        self.push(op);
    }

    /// Writes the instructions of an operand where execution does not pass.
    fn formula(&mut self, expression: &mut Expression) {
        let (here, held) = (self.here(), self.held);
        let result = self.register(expression);
        self.held = held;
        let start = (self.here() > here).then_some(here);
        if start.is_some() {
            self.push(Op::Done);
        }
        expression.formula = Formula { start, result };
    }

    fn subscripts(&mut self, variable: &mut Variable) {
        variable
            .subscripts
            .iter_mut()
            .for_each(|subscript| self.formula(subscript));
    }

    /// Writes formulas in the midst of other instructions, which pass over them.
    fn aside(&mut self, formulas: impl FnOnce(&mut Self)) {
        let skip = self.code.instructions.len();
        self.push(Op::Skip(0));
        formulas(self);
        let after = self.code.instructions.len();
        if after == skip + 1 {
            self.code.instructions.truncate(skip);
            self.code.steps.truncate(skip);
        } else if let Some(instruction) = self.code.instructions.get_mut(skip) {
            instruction.op = Op::Skip(wide(after - skip - 1));
        }
    }

    /// The register an expression is in once its instructions are done.
    fn register(&mut self, expression: &mut Expression) -> Register {
        self.compute(expression, None)
    }

    /// The registers of two operands, of which the left one comes first.
    fn operands(&mut self, numbers: bool, left: &mut Expression, right: &mut Expression) -> [Register; 2] {
        let a = self.register(left);
        let operand = self.left(a, numbers);
        let b = self.register(right);
        self.right(operand);
        [a, b]
    }

    /// Notes a left operand; the instructions of the right one follow.
    fn left(&mut self, register: Register, is_number: bool) -> usize {
        let before = self.here()..self.here();
        self.code.operands.push(LeftOperand {
            register,
            is_number,
            before,
        });
        self.code.operands.len() - 1
    }

    /// The instructions of the right operand are written.
    fn right(&mut self, operand: usize) {
        let here = self.here();
        if let Some(left) = self.code.operands.get_mut(operand) {
            left.before.end = here;
            if left.before.is_empty() {
                self.code.operands.truncate(operand);
            }
        }
    }

    /// Writes the instructions of an expression, the last of them with the result to `to`. Without `to` the result is
    /// where it already is, or in a temporary.
    fn compute(&mut self, expression: &mut Expression, to: Option<Register>) -> Register {
        let held = self.held;
        let op: &dyn Fn(Register) -> Op = match &mut expression.node {
            Node::Literal(number) => {
                let a = self.constant(*number);
                return self.copy(to, a);
            }
            Node::Unary(Unary::Value, of) => return self.compute(of, to),
            Node::Variable(variable) => match self.location(variable) {
                Location::Register(a) => return self.copy(to, a),
                Location::Element(array, index) => &move |to| Op::Load { to, array, index },
                Location::Table(variable, parameter) => &move |to| Op::Fetch {
                    to,
                    variable,
                    parameter,
                },
            },
            Node::Unary(operator, of) => {
                let (operator, a) = (*operator, self.register(of));
                &move |to| Op::Unary { operator, to, a }
            }
            Node::Component(of, letter) => {
                let (letter, a) = (*letter, self.register(of));
                &move |to| Op::Component { to, a, letter }
            }
            Node::Binary(operator, left, right) => {
                let operator = *operator;
                let [a, b] = self.operands(!operator.takes_vectors(), left, right);
                &move |to| binary(operator, Operands { to, a, b })
            }
            Node::Function(Builtin::Numeric(function), arguments) => {
                let function = *function;
                let [a, b] = match arguments.as_mut_slice() {
                    [first, second, ..] => self.operands(true, first, second),
                    [only] => [self.register(only); 2],
                    [] => [self.constant(Number::Integer(0)); 2],
                };
                &move |to| Op::Numeric(function, Operands { to, a, b })
            }
            Node::Function(builtin, arguments) => {
                self.aside(|aside| arguments.iter_mut().for_each(|argument| aside.formula(argument)));
                let function = wide(self.code.functions.len());
                self.code.functions.push((*builtin, arguments.clone()));
                &move |to| Op::Function { to, function }
            }
            Node::System(system) => {
                let system = *system;
                &move |to| Op::System { to, system }
            }
        };
        // The operands are read before the result is written: it may take the place of one of them.
        self.held = held;
        let to = to.unwrap_or_else(|| self.temporary());
        self.push(op(to));
        to
    }

    /// Copies a register to `to`, if it is to be there.
    fn copy(&mut self, to: Option<Register>, a: Register) -> Register {
        if let Some(to) = to {
            self.push(Op::Copy { to, a });
        }
        to.unwrap_or(a)
    }

    /// The register of a plain variable.
    fn plain(&self, variable: &Variable) -> Option<Register> {
        match variable.reference {
            Reference::Slot { cell, .. } if variable.subscripts.is_empty() => Some(wide(cell)),
            Reference::Slot { .. } | Reference::Parameter(_) | Reference::Unresolved => None,
        }
    }

    /// Place of a variable; the instructions of its subscript come first.
    fn location(&mut self, variable: &mut Variable) -> Location {
        if let Some(register) = self.plain(variable) {
            return Location::Register(register);
        }
        if let (Reference::Slot { slot, cell }, [only]) =
            (variable.reference, variable.subscripts.as_mut_slice())
        {
            let array = Array {
                base: wide(cell),
                length: wide(self.symbols.slots.get(slot).map_or(0, Slot::length)),
            };
            return Location::Element(array, self.register(only));
        }
        self.aside(|aside| aside.subscripts(variable));
        let parameter = match variable.reference {
            Reference::Parameter(number) => Some(wide(number)),
            Reference::Slot { .. } | Reference::Unresolved => None,
        };
        self.code.variables.push(variable.clone());
        Location::Table(wide(self.code.variables.len() - 1), parameter)
    }

    fn temporary(&mut self) -> Register {
        let known = self.temporaries.get(self.held).copied();
        self.held += 1;
        known.unwrap_or_else(|| {
            let register = self.working(Cell::EMPTY);
            self.temporaries.push(register);
            register
        })
    }

    fn constant(&mut self, number: Number) -> Register {
        let key = match number {
            Number::Integer(value) => (false, value as u32),
            Number::Real(value) => (true, value.to_bits()),
        };
        if let Some(known) = self.constants.get(&key) {
            return *known;
        }
        let register = self.working(number.into());
        self.constants.insert(key, register);
        register
    }

    /// A register after the variables.
    fn working(&mut self, cell: Cell) -> Register {
        self.code.working.push(cell);
        wide(self.symbols.cells + self.code.working.len() - 1)
    }
}

fn binary(operator: Binary, operands: Operands) -> Op {
    match operator {
        Binary::Add => Op::Add(operands),
        Binary::Subtract => Op::Subtract(operands),
        Binary::Multiply => Op::Multiply(operands),
        Binary::Divide => Op::Divide(operands),
        operator @ (Binary::Or | Binary::And | Binary::Relation(_) | Binary::Modulo | Binary::Power) => {
            Op::Binary(operator, operands)
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{LanguageOptions, compile};

    #[test]
    fn temporaries_are_used_again() {
        let sum = "(I+J)*(I-J)+".repeat(15) + "I";
        let source = std::format!("PROGRAM M\nI=1\nJ=1\nI={sum}\nJ={sum}\nEND\n");
        let program = compile(&source, &LanguageOptions::default()).program.unwrap();
        // The sum so far and two operands, and the constant 1.
        assert_eq!(program.code.working.len(), 4);
    }
}
