//! Writes the quick form of a program: for each step, the instructions that do it with numbers alone, or one that
//! leaves it to the step. What they mean is in `code`.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::copy::{Copies, Stands};
use super::fuse::{self, Draft};
use crate::builtin::Builtin;
use crate::code::{Array, Code, Counted, Quick, Register, Relation, TEMPORARIES, Target};
use crate::machine::constant_number;
use crate::options::{IntDivision, LanguageOptions};
use crate::program::{Entry, Operation, Slot, Step, Symbols};
use crate::request::Number;
use crate::tree::{Binary, Expression, Node, Reference, Simple, Unary, Variable};

/// The quick form of these steps; empty when its numbers do not fit.
pub(super) fn code(steps: &[Step], blocks: &[Entry], symbols: &Symbols, options: &LanguageOptions) -> Code {
    let mut lowering = Lowering {
        steps,
        blocks,
        symbols,
        options,
        code: Code::default(),
        step: 0,
        drafts: Vec::new(),
        copies: Copies::default(),
        stands: None,
        constants: BTreeMap::new(),
        temporaries: 0,
    };
    for number in 0..=steps.len() {
        if lowering.step(number).is_none() {
            lowering.push(Quick::Leave);
        }
    }
    let Lowering {
        code, drafts, copies, ..
    } = lowering;
    fuse::assemble(code, steps, symbols.cells, &drafts, &copies.done).unwrap_or_default()
}

pub(super) struct Lowering<'a> {
    pub(super) steps: &'a [Step],
    pub(super) blocks: &'a [Entry],
    pub(super) symbols: &'a Symbols,
    options: &'a LanguageOptions,
    pub(super) code: Code,
    /// The step under way.
    pub(super) step: usize,
    /// The instructions of the steps; targets are steps as yet.
    pub(super) drafts: Vec<Draft>,
    pub(super) copies: Copies,
    /// In a copy: what stands for the parameters and for RETURN.
    pub(super) stands: Option<Stands>,
    /// Kind and bits of a constant, and its register.
    constants: BTreeMap<(bool, u32), Register>,
    /// Temporaries the present step uses.
    pub(super) temporaries: usize,
}

/// What does not fit 16 bits has no quick form.
pub(super) fn narrow(number: usize) -> Option<u16> {
    u16::try_from(number).ok()
}

/// What does not fit 32 bits has none either; a source is far too short for that.
pub(super) fn wide(number: usize) -> Option<u32> {
    u32::try_from(number).ok()
}

impl Lowering<'_> {
    pub(super) fn push(&mut self, operation: Quick) {
        let step = self.step as u32;
        self.drafts.push(Draft { step, operation });
    }

    /// The instructions of a step; `None`, and nothing written, when it has no quick form.
    pub(super) fn step(&mut self, number: usize) -> Option<()> {
        let start = self.drafts.len();
        (self.step, self.temporaries) = (number, 0);
        let done = self
            .steps
            .get(number)
            .and_then(|step| self.operation(number, &step.operation));
        if done.is_none() {
            self.drafts.truncate(start);
        }
        done
    }

    fn operation(&mut self, number: usize, operation: &Operation) -> Option<()> {
        match operation {
            Operation::Simple(Simple::Assign {
                target,
                component: None,
                value,
            }) => self.assign(target, value)?,
            Operation::Branch { condition, otherwise } => {
                self.branch(condition, narrow(number + 1)?, narrow(*otherwise)?)?;
            }
            Operation::Jump(target) => self.push(Quick::Jump(narrow(*target)?)),
            Operation::Select { selector, targets } => {
                let a = self.register(selector)?;
                let targets: Vec<Target> = targets
                    .iter()
                    .map(|target| narrow(*target))
                    .collect::<Option<_>>()?;
                let (first, count) = (narrow(self.code.choices.len())?, narrow(targets.len())?);
                self.code.choices.extend(targets);
                self.push(Quick::Choose { a, first, count });
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
            Operation::Return => {
                let back = self.stands.as_ref().map(|stands| stands.back);
                self.push(back.map_or(Quick::Return, Quick::Jump));
            }
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
                if let Some(cell) = self.stand_in(parameter)? {
                    return self.compute(value, Some(cell)).map(drop);
                }
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

    fn branch(&mut self, condition: &Expression, then: Target, otherwise: Target) -> Option<()> {
        // A jump that is all there is to do is done at once.
        let then = match self.steps.get(usize::from(then)) {
            Some(Step {
                head: false,
                operation: Operation::Jump(target),
                ..
            }) => narrow(*target)?,
            _ => then,
        };
        if let Node::Binary(operator, left, right) = &condition.node
            && let Some(relation) = Relation::of(*operator)
        {
            let (a, b) = (self.register(left)?, self.register(right)?);
            self.push(Quick::Branch {
                relation,
                a,
                b,
                then,
                otherwise,
            });
            return Some(());
        }
        let a = self.register(condition)?;
        self.push(Quick::Truth { a, then, otherwise });
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
            opener: wide(number)?,
            exit: wide(exit)?,
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

    /// The register an expression is in once its instructions are done.
    pub(super) fn register(&mut self, expression: &Expression) -> Option<Register> {
        match &expression.node {
            Node::Variable(variable) if variable.subscripts.is_empty() => match variable.reference {
                Reference::Slot(_) => self.plain(variable),
                Reference::Parameter(parameter) => match self.stand_in(parameter)? {
                    Some(cell) => Some(cell),
                    None => self.compute(expression, None),
                },
                Reference::Unresolved => None,
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
                let stand_in = self.stand_in(parameter)?;
                let to = self.target(to)?;
                self.push(match stand_in {
                    Some(a) => Quick::Copy { to, a },
                    None => Quick::Fetch {
                        to,
                        parameter: narrow(parameter)?,
                    },
                });
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
                let quick = match builtin {
                    Builtin::Sqrt => Quick::Root { to, a },
                    Builtin::Sin => Quick::Sine { to, a },
                    Builtin::Cos => Quick::Cosine { to, a },
                    builtin => Quick::Function { builtin, to, a },
                };
                (quick, to)
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
    pub(super) fn plain(&self, variable: &Variable) -> Option<Register> {
        let slot = self.slot(variable)?;
        let fits = slot.kind.is_none_or(crate::ValueKind::is_number);
        narrow(slot.base).filter(|_| fits && variable.subscripts.is_empty() && slot.bounds.is_none())
    }

    fn slot(&self, variable: &Variable) -> Option<&Slot> {
        match variable.reference {
            Reference::Slot(at) => self.symbols.slots.get(at),
            Reference::Parameter(_) | Reference::Unresolved => None,
        }
    }

    /// An element of an array of numbers with one or two subscripts: the array, and the register of its flat subscript.
    fn element(&mut self, variable: &Variable) -> Option<(Array, Register)> {
        let slot = self.slot(variable)?;
        if slot.kind.is_some_and(|kind| !kind.is_number()) {
            return None;
        }
        let row = match slot.bounds.as_deref()? {
            [_] => 1,
            [_, second] => u16::try_from(second.checked_add(1)?).ok()?,
            _ => return None,
        };
        let length = narrow(slot.length())?;
        let array = Array {
            base: narrow(slot.base)?,
            length,
        };
        // That the last cell has a number spares looking at that of each.
        array.base.checked_add(length)?;
        match variable.subscripts.as_slice() {
            [only] => Some((array, self.register(only)?)),
            [first, second] => {
                let (a, b) = (self.register(first)?, self.register(second)?);
                let to = self.target(None)?;
                self.push(Quick::Flatten {
                    to,
                    a,
                    b,
                    row,
                    length,
                });
                Some((array, to))
            }
            _ => None,
        }
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
        self.code.constants.push(Some(number));
        self.constants.insert(key, register);
        Some(register)
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
