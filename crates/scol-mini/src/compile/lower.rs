//! Writes the quick form of a program: for each step, the instructions that do it with numbers alone, or one that
//! leaves it to the step. What they mean is in `code`.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::builtin::Builtin;
use crate::code::{
    Array, Called, Code, Counted, Handed, Instruction, Quick, Register, Relation, TEMPORARIES, Target,
};
use crate::machine::constant_number;
use crate::options::{IntDivision, LanguageOptions};
use crate::program::{Entry, Operation, Slot, Step, Symbols};
use crate::request::Number;
use crate::tree::{Binary, Expression, Node, Reference, Simple, Unary, Variable};

/// The quick form of these steps.
pub(super) fn code(steps: &[Step], blocks: &[Entry], symbols: &Symbols, options: &LanguageOptions) -> Code {
    let mut lowering = Lowering {
        steps,
        blocks,
        symbols,
        options,
        code: Code::default(),
        constants: BTreeMap::new(),
        temporaries: 0,
    };
    for (number, step) in steps.iter().enumerate() {
        lowering.step(number, step);
    }
    lowering.begin();
    lowering.push(Quick::Leave);
    lowering.finish()
}

struct Lowering<'a> {
    steps: &'a [Step],
    blocks: &'a [Entry],
    symbols: &'a Symbols,
    options: &'a LanguageOptions,
    code: Code,
    /// Kind and bits of a constant, and its register.
    constants: BTreeMap<(bool, u32), Register>,
    /// Temporaries the present step uses.
    temporaries: usize,
}

/// What does not fit 32 bits has no quick form; a source is far too short for that.
fn narrow(number: usize) -> Option<u32> {
    u32::try_from(number).ok()
}

impl Lowering<'_> {
    fn begin(&mut self) {
        self.temporaries = 0;
        let at = self.code.instructions.len() as u32;
        self.code.entries.push(at);
    }

    fn push(&mut self, operation: Quick) {
        let step = self.code.entries.len().saturating_sub(1) as u32;
        self.code.steps.push(step);
        self.code.instructions.push(Instruction { cost: 0, operation });
    }

    fn step(&mut self, number: usize, step: &Step) {
        self.begin();
        let start = self.code.instructions.len();
        if self.operation(number, &step.operation).is_none() {
            self.code.instructions.truncate(start);
            self.code.steps.truncate(start);
            self.push(Quick::Leave);
        } else if let Some(first) = self.code.instructions.get_mut(start) {
            first.cost = u8::from(step.head);
        }
    }

    fn operation(&mut self, number: usize, operation: &Operation) -> Option<()> {
        match operation {
            Operation::Simple(Simple::Assign {
                target,
                component: None,
                value,
            }) => self.assign(target, value)?,
            Operation::Branch { condition, otherwise } => self.branch(condition, narrow(*otherwise)?)?,
            Operation::Jump(target) => self.push(Quick::Jump(narrow(*target)?)),
            Operation::Select { selector, targets } => {
                let a = self.register(selector)?;
                let targets = targets
                    .iter()
                    .map(|target| narrow(*target))
                    .collect::<Option<_>>()?;
                let choice = narrow(self.code.choices.len())?;
                self.code.choices.push(targets);
                self.push(Quick::Choose { a, choice });
            }
            Operation::For {
                variable,
                from,
                to,
                step,
                exit,
            } => self.counted(number, variable, from, to, step.as_ref(), *exit)?,
            Operation::Next { opener } => self.next(*opener)?,
            Operation::Call { block, arguments } => self.call(number, *block, arguments)?,
            Operation::Return => self.push(Quick::Return),
            _ => return None,
        }
        Some(())
    }

    fn assign(&mut self, target: &Variable, value: &Expression) -> Option<()> {
        match target.reference {
            Reference::Slot(_) if target.subscripts.is_empty() => {
                let to = self.plain(target)?;
                self.compute(value, Some(to)).map(drop)
            }
            Reference::Slot(_) => {
                let (array, index) = self.element(target)?;
                let a = self.register(value)?;
                self.push(Quick::Store { array, index, a });
                Some(())
            }
            Reference::Parameter(parameter) => {
                let a = self.register(value)?;
                self.push(Quick::Put {
                    parameter: narrow(parameter)?,
                    a,
                });
                Some(())
            }
            Reference::Unresolved => None,
        }
    }

    fn branch(&mut self, condition: &Expression, otherwise: Target) -> Option<()> {
        if let Node::Binary(operator, left, right) = &condition.node
            && let Some(relation) = Relation::of(*operator)
        {
            let (a, b) = (self.register(left)?, self.register(right)?);
            self.push(Quick::Branch {
                relation,
                a,
                b,
                otherwise,
            });
            return Some(());
        }
        let a = self.register(condition)?;
        self.push(Quick::Truth { a, otherwise });
        Some(())
    }

    fn counted(
        &mut self,
        number: usize,
        variable: &Variable,
        from: &Expression,
        to: &Expression,
        step: Option<&Expression>,
        exit: usize,
    ) -> Option<()> {
        let variable = self.plain(variable)?;
        let to = self.register(to)?;
        let step = match step {
            Some(step) => self.register(step)?,
            None => self.constant(Number::Integer(1))?,
        };
        let from = self.register(from)?;
        let index = narrow(self.code.loops.len())?;
        self.code.loops.push(Counted {
            variable,
            from,
            to,
            step,
            opener: narrow(number)?,
            exit: narrow(exit)?,
        });
        self.push(Quick::For(index));
        Some(())
    }

    fn next(&mut self, opener: usize) -> Option<()> {
        let Operation::For { variable, .. } = &self.steps.get(opener)?.operation else {
            return None;
        };
        let variable = self.plain(variable)?;
        let body = narrow(opener + 1)?;
        self.push(Quick::Next {
            variable,
            opener: narrow(opener)?,
            body,
        });
        Some(())
    }

    fn call(&mut self, number: usize, block: usize, arguments: &[Expression]) -> Option<()> {
        let handed = arguments
            .iter()
            .map(|argument| match &argument.node {
                Node::Variable(variable) => match variable.reference {
                    Reference::Slot(slot) if variable.subscripts.is_empty() => Some(Handed::Variable {
                        slot: narrow(slot)?,
                        cell: narrow(self.symbols.slots.get(slot)?.base)?,
                    }),
                    Reference::Parameter(parameter) => narrow(parameter).map(Handed::Parameter),
                    Reference::Slot(_) | Reference::Unresolved => None,
                },
                _ => self.register(argument).map(Handed::Value),
            })
            .collect::<Option<_>>()?;
        let step = narrow(self.blocks.get(block)?.step)?;
        let index = narrow(self.code.calls.len())?;
        self.code.calls.push(Called {
            arguments: handed,
            step,
            back: narrow(number + 1)?,
        });
        self.push(Quick::Call(index));
        Some(())
    }

    /// The register an expression is in once its instructions are done.
    fn register(&mut self, expression: &Expression) -> Option<Register> {
        match &expression.node {
            Node::Variable(variable) if variable.subscripts.is_empty() => match variable.reference {
                Reference::Slot(_) => self.plain(variable),
                _ => self.compute(expression, None),
            },
            _ if expression.is_constant() => self.constant(constant_number(expression, self.options)?),
            _ => self.compute(expression, None),
        }
    }

    /// Writes the instructions of an expression, the last of them with the result to `to`, or to a temporary.
    fn compute(&mut self, expression: &Expression, to: Option<Register>) -> Option<Register> {
        let constant = expression.is_constant();
        match &expression.node {
            _ if constant => {
                let a = self.register(expression)?;
                let to = self.target(to)?;
                self.push(Quick::Copy { to, a });
                Some(to)
            }
            Node::Variable(variable) => self.variable(variable, to),
            Node::Unary(operator, of) => {
                let a = self.register(of)?;
                let to = self.target(to)?;
                self.push(match operator {
                    Unary::Plus => Quick::Copy { to, a },
                    operator => Quick::Unary {
                        operator: *operator,
                        to,
                        a,
                    },
                });
                Some(to)
            }
            Node::Binary(operator, left, right) => {
                let (a, b) = (self.register(left)?, self.register(right)?);
                let to = self.target(to)?;
                self.push(self.binary(*operator, to, a, b));
                Some(to)
            }
            Node::Function(builtin, arguments) => self.function(*builtin, arguments, to),
            Node::Literal(_) | Node::Component(..) | Node::System(_) => None,
        }
    }

    fn variable(&mut self, variable: &Variable, to: Option<Register>) -> Option<Register> {
        match variable.reference {
            Reference::Slot(_) if variable.subscripts.is_empty() => {
                let a = self.plain(variable)?;
                let to = self.target(to)?;
                self.push(Quick::Copy { to, a });
                Some(to)
            }
            Reference::Slot(_) => {
                let (array, index) = self.element(variable)?;
                let to = self.target(to)?;
                self.push(Quick::Load { to, array, index });
                Some(to)
            }
            Reference::Parameter(parameter) => {
                let to = self.target(to)?;
                let parameter = narrow(parameter)?;
                self.push(Quick::Fetch { to, parameter });
                Some(to)
            }
            Reference::Unresolved => None,
        }
    }

    fn function(
        &mut self,
        builtin: Builtin,
        arguments: &[Expression],
        to: Option<Register>,
    ) -> Option<Register> {
        let of_numbers = !matches!(
            builtin,
            Builtin::Din
                | Builtin::Dout
                | Builtin::Bcdin
                | Builtin::Gain
                | Builtin::Torque
                | Builtin::Point
                | Builtin::Trans
                | Builtin::Payload
        );
        if !of_numbers {
            return None;
        }
        let (quick, to) = match arguments {
            [only] => {
                let a = self.register(only)?;
                let to = self.target(to)?;
                (Quick::Function { builtin, to, a }, to)
            }
            [first, second] => {
                let (a, b) = (self.register(first)?, self.register(second)?);
                let to = self.target(to)?;
                let quick = match builtin {
                    Builtin::Mod => Quick::Modulo { to, a, b },
                    builtin => Quick::Function2 { builtin, to, a, b },
                };
                (quick, to)
            }
            _ => return None,
        };
        self.push(quick);
        Some(to)
    }

    /// A plain variable that can hold a number.
    fn plain(&self, variable: &Variable) -> Option<Register> {
        let slot = self.slot(variable)?;
        let fits = slot.kind.is_none_or(crate::Kind::is_number);
        narrow(slot.base).filter(|_| fits && variable.subscripts.is_empty() && slot.bounds.is_none())
    }

    fn slot(&self, variable: &Variable) -> Option<&Slot> {
        match variable.reference {
            Reference::Slot(at) => self.symbols.slots.get(at),
            Reference::Parameter(_) | Reference::Unresolved => None,
        }
    }

    /// An element of an array of numbers with one or two subscripts: the array, and the register of its flat subscript.
    fn element(&mut self, variable: &Variable) -> Option<(u32, Register)> {
        let slot = self.slot(variable)?;
        if slot.kind.is_some_and(|kind| !kind.is_number()) {
            return None;
        }
        let row = match slot.bounds.as_deref()? {
            [_] => 1,
            [_, second] => second.checked_add(1)?,
            _ => return None,
        };
        let described = Array {
            base: narrow(slot.base)?,
            length: narrow(slot.length())?,
            row,
        };
        let index = match variable.subscripts.as_slice() {
            [only] => (self.register(only)?, None),
            [first, second] => (self.register(first)?, Some(self.register(second)?)),
            _ => return None,
        };
        let array = match self.code.arrays.iter().position(|known| *known == described) {
            Some(known) => narrow(known)?,
            None => {
                self.code.arrays.push(described);
                narrow(self.code.arrays.len() - 1)?
            }
        };
        let (a, Some(b)) = index else {
            return Some((array, index.0));
        };
        let to = self.target(None)?;
        self.push(Quick::Flatten { to, array, a, b });
        Some((array, to))
    }

    fn target(&mut self, to: Option<Register>) -> Option<Register> {
        if to.is_some() {
            return to;
        }
        if self.temporaries >= TEMPORARIES {
            return None;
        }
        self.temporaries += 1;
        narrow(self.symbols.cells + self.temporaries - 1)
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

    /// Puts instructions in place of the steps that jumps lead to.
    fn finish(mut self) -> Code {
        let entries: Vec<Target> = self.code.entries.clone();
        let last = entries.last().copied().unwrap_or(0);
        let at = |step: &mut Target| *step = entries.get(*step as usize).copied().unwrap_or(last);
        for instruction in &mut self.code.instructions {
            match &mut instruction.operation {
                Quick::Jump(target)
                | Quick::Branch {
                    otherwise: target, ..
                }
                | Quick::Truth {
                    otherwise: target, ..
                }
                | Quick::Next { body: target, .. } => at(target),
                _ => {}
            }
        }
        self.code.choices.iter_mut().flatten().for_each(at);
        self.code
    }

    fn binary(&self, operator: Binary, to: Register, a: Register, b: Register) -> Quick {
        if let Some(relation) = Relation::of(operator) {
            return Quick::Relate { relation, to, a, b };
        }
        match operator {
            Binary::Add => Quick::Add { to, a, b },
            Binary::Subtract => Quick::Subtract { to, a, b },
            Binary::Multiply => Quick::Multiply { to, a, b },
            Binary::Divide if self.options.int_division == IntDivision::Truncate => {
                Quick::Divide { to, a, b }
            }
            Binary::Modulo => Quick::Modulo { to, a, b },
            operator => Quick::Binary { operator, to, a, b },
        }
    }
}
