//! Puts the instructions of the steps in a row: those that often stand together get one before them that does their
//! work at once and jumps over them. It does so only where nothing is special (the kinds are those one expects, the
//! result fits); otherwise it does nothing and they follow one by one. Then jumps learn where their steps begin.

use alloc::vec::Vec;

use super::copy::Copy;
use super::lower::narrow;
use crate::code::{AccumOp, Code, Copied, ElementRef, Instruction, Quick, Register, TEMPORARIES, Target};
use crate::program::Step;
use crate::request::Number;

/// An instruction of a step; its targets are steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draft {
    pub step: u32,
    pub operation: Quick,
}

/// The code of these instructions; `None` when there are too many.
pub(super) fn assemble(
    code: Code,
    steps: &[Step],
    variables: usize,
    drafts: &[Draft],
    copies: &[Copy],
) -> Option<Code> {
    let mut row = Row {
        code,
        steps,
        variables,
    };
    row.code.entries = row.add(drafts)?;
    let entries = row.code.entries.clone();
    let end = row.code.instructions.len();
    row.resolve(0..end, |step| entries.get(usize::from(step)).copied());
    for copy in copies {
        let first = row.code.instructions.len();
        let own = row.add(&copy.drafts)?;
        let base = copy.drafts.first()?.step;
        let end = row.code.instructions.len();
        row.resolve(first..end, |step| {
            let inside = u32::from(step)
                .checked_sub(base)
                .and_then(|at| own.get(at as usize));
            inside.or_else(|| entries.get(usize::from(step))).copied()
        });
        row.code.copies.push(Copied {
            first: narrow(first)?,
            call: copy.call,
        });
    }
    row.enter();
    row.charge();
    Some(row.code)
}

struct Row<'a> {
    code: Code,
    steps: &'a [Step],
    /// Cells of the variables.
    variables: usize,
}

impl Row<'_> {
    /// Appends instructions; returns where each of their steps begins.
    fn add(&mut self, drafts: &[Draft]) -> Option<Vec<Target>> {
        let mut entries = Vec::new();
        let (mut covered, mut last) = (0, None);
        for (number, draft) in drafts.iter().enumerate() {
            let first = last != Some(draft.step);
            last = Some(draft.step);
            if first {
                entries.push(narrow(self.code.instructions.len())?);
            }
            let head = self.steps.get(draft.step as usize).is_some_and(|step| step.head);
            let mut cost = u8::from(first && head);
            let fused = match drafts.get(number..) {
                Some(ahead) if covered == 0 => self.fused(ahead).or_else(|| self.jump(drafts, draft)),
                _ => None,
            };
            if let Some((fused, covers)) = fused {
                self.push(draft.step, cost, fused);
                (cost, covered) = (0, covers);
            }
            self.push(draft.step, cost, draft.operation);
            covered = usize::saturating_sub(covered, 1);
        }
        narrow(self.code.instructions.len())?;
        Some(entries)
    }

    fn push(&mut self, step: u32, cost: u8, operation: Quick) {
        self.code.steps.push(step);
        self.code.costs.push(cost);
        self.code.instructions.push(Instruction { charge: 0, operation });
    }

    /// Puts instructions in place of steps.
    fn resolve(&mut self, range: core::ops::Range<usize>, at: impl Fn(Target) -> Option<Target>) {
        let at = |step: &mut Target| *step = at(*step).unwrap_or_default();
        let Code {
            instructions,
            choices,
            ..
        } = &mut self.code;
        for instruction in instructions.get_mut(range).unwrap_or_default() {
            match &mut instruction.operation {
                Quick::Choose { first, count, .. } => {
                    let first = usize::from(*first);
                    let own = choices.get_mut(first..first + usize::from(*count));
                    own.unwrap_or_default().iter_mut().for_each(at);
                }
                Quick::Jump(target) | Quick::Next { body: target, .. } => at(target),
                Quick::Branch { then, otherwise, .. }
                | Quick::JumpBranch { then, otherwise, .. }
                | Quick::Truth { then, otherwise, .. } => {
                    at(then);
                    at(otherwise);
                }
                _ => {}
            }
        }
    }

    /// Instructions learn what they take together with those behind them.
    fn charge(&mut self) {
        let mut behind = 0;
        let instructions = &mut self.code.instructions;
        for (at, cost) in self.code.costs.iter().enumerate().rev() {
            let Some((instruction, rest)) = instructions.get_mut(at..).and_then(<[_]>::split_first_mut)
            else {
                continue;
            };
            if instruction.operation.ends() {
                behind = 0;
            }
            // A guarded instruction goes on behind the branch, and a jump to a branch ends with that.
            behind = match instruction.operation {
                Quick::GuardedAdd { .. } | Quick::GuardedSubtract { .. } | Quick::GuardedCopy { .. } => {
                    rest.get(2).map_or(0, |behind| behind.charge)
                }
                Quick::JumpBranch { .. } => 1,
                _ => behind,
            };
            behind += u16::from(*cost);
            instruction.charge = behind;
        }
    }

    /// Calls learn where their copies begin.
    fn enter(&mut self) {
        let copies = &self.code.copies;
        for instruction in &mut self.code.instructions {
            if let Quick::Enter(copy) = &mut instruction.operation {
                *copy = copies
                    .get(usize::from(*copy))
                    .map_or_else(Target::default, |copied| copied.first);
            }
        }
    }

    /// What does the work of the first of these instructions, and of how many.
    fn fused(&self, ahead: &[Draft]) -> Option<(Quick, usize)> {
        let [first, second, ..] = ahead else {
            return None;
        };
        let alone = ahead.get(2).is_some_and(|third| third.step == second.step + 1);
        if let Some(guarded) = guarded(first, second).filter(|_| alone) {
            return Some((guarded, 2));
        }
        let last = ahead
            .iter()
            .position(|draft| draft.step != first.step)
            .unwrap_or(ahead.len());
        let mut ahead = ahead.iter().take(last).map(|draft| draft.operation);
        let (first, second) = (ahead.next()?, ahead.next()?);
        let (third, fourth) = (ahead.next(), ahead.next());
        self.multiplied(first, second)
            .map(|multiplied| (multiplied, 2))
            .or_else(|| self.function(first, second, third))
            .or_else(|| self.element(first, second, third, fourth))
    }

    /// A jump to a branch.
    fn jump(&self, drafts: &[Draft], draft: &Draft) -> Option<(Quick, usize)> {
        let Quick::Jump(target) = draft.operation else {
            return None;
        };
        let at = drafts.partition_point(|other| other.step < u32::from(target));
        let found = drafts.get(at).filter(|found| found.step == u32::from(target))?;
        let head = self.steps.get(usize::from(target)).is_some_and(|step| step.head);
        match found.operation {
            Quick::Branch {
                relation,
                a,
                b,
                then,
                otherwise,
            } if head => Some((
                Quick::JumpBranch {
                    relation,
                    a,
                    b,
                    then,
                    otherwise,
                },
                1,
            )),
            _ => None,
        }
    }

    fn is_temporary(&self, register: Register) -> bool {
        usize::from(register)
            .checked_sub(self.variables)
            .is_some_and(|at| at < TEMPORARIES)
    }

    fn multiplied(&self, first: Quick, second: Quick) -> Option<Quick> {
        let Quick::Multiply { to: product, a, b } = first else {
            return None;
        };
        match self.joined(product, second)? {
            (AccumOp::Add, to, c) => Some(Quick::MultiplyAdd { to, a, b, c }),
            (AccumOp::From, to, c) => Some(Quick::MultiplyFrom { to, a, b, c }),
            (AccumOp::Less | AccumOp::Multiply, ..) => None,
        }
    }

    /// `X + COS(A)`, `X + R * COS(A)` and their like.
    fn function(&self, first: Quick, second: Quick, third: Option<Quick>) -> Option<(Quick, usize)> {
        let (Quick::Root { to, a } | Quick::Sine { to, a } | Quick::Cosine { to, a }) = first else {
            return None;
        };
        let (join, to, with) = self.joined(to, second)?;
        let scaled = match (join, third.and_then(|third| self.joined(to, third))) {
            (AccumOp::Multiply, Some((join, to, sum))) if join != AccumOp::Multiply => {
                Some((join, to, with, sum))
            }
            _ => None,
        };
        Some(match (first, scaled) {
            (Quick::Root { .. }, None) => (Quick::RootJoin { join, to, a, with }, 2),
            (Quick::Sine { .. }, None) => (Quick::SineJoin { join, to, a, with }, 2),
            (_, None) => (Quick::CosineJoin { join, to, a, with }, 2),
            (_, Some((join, to, by, with))) => {
                let quick = match first {
                    Quick::Root { .. } => Quick::RootScaled {
                        join,
                        to,
                        a,
                        by,
                        with,
                    },
                    Quick::Sine { .. } => Quick::SineScaled {
                        join,
                        to,
                        a,
                        by,
                        with,
                    },
                    _ => Quick::CosineScaled {
                        join,
                        to,
                        a,
                        by,
                        with,
                    },
                };
                (quick, 3)
            }
        })
    }

    /// How an instruction joins the number in a temporary to another.
    fn joined(&self, temporary: Register, operation: Quick) -> Option<(AccumOp, Register, Register)> {
        let (join, to, with) = match operation {
            Quick::Add { to, a, b } if b == temporary => (AccumOp::Add, to, a),
            Quick::Add { to, a, b } if a == temporary => (AccumOp::Add, to, b),
            Quick::Multiply { to, a, b } if b == temporary => (AccumOp::Multiply, to, a),
            Quick::Multiply { to, a, b } if a == temporary => (AccumOp::Multiply, to, b),
            Quick::Subtract { to, a, b } if b == temporary => (AccumOp::From, to, a),
            Quick::Subtract { to, a, b } if a == temporary => (AccumOp::Less, to, b),
            _ => return None,
        };
        self.is_temporary(temporary).then_some((join, to, with))
    }

    /// `A(I - 1) + X` and its like, and where that goes.
    fn element(
        &self,
        first: Quick,
        second: Quick,
        third: Option<Quick>,
        fourth: Option<Quick>,
    ) -> Option<(Quick, usize)> {
        let (near, load, mut after) = match (self.near(first), first) {
            (Some(near), _) => (Some(near), second, [third, fourth].into_iter()),
            (None, load) => (None, load, [Some(second), third].into_iter()),
        };
        let Quick::Load { to, array, index } = load else {
            return None;
        };
        let (index, offset) = match near {
            Some((temporary, near, offset)) => (temporary == index).then_some((near, offset))?,
            None => (index, 0),
        };
        let element = ElementRef { array, index, offset };
        let joined = after
            .next()
            .flatten()
            .and_then(|operation| self.joined(to, operation));
        let (fused, covers) = match (joined, after.next().flatten()) {
            (Some((AccumOp::Add, sum, with)), Some(Quick::Store { array, index, a }))
                if array == element.array && a == sum && self.is_temporary(sum) =>
            {
                let update = Quick::UpdateAdd { index, element, with };
                (update, 2)
            }
            (Some((AccumOp::Add, to, with)), _) => (Quick::LoadAdd { to, element, with }, 1),
            (Some((join, to, with)), _) => {
                let joined = Quick::LoadJoin {
                    join,
                    to,
                    element,
                    with,
                };
                (joined, 1)
            }
            (None, _) if offset != 0 => (Quick::LoadNear { to, element }, 0),
            (None, _) => return None,
        };
        Some((fused, element.loads() + covers))
    }

    /// `I - 1` and its like: where it goes, the number, and what is added.
    fn near(&self, operation: Quick) -> Option<(Register, Register, i16)> {
        let (to, a, b, sign) = match operation {
            Quick::Add { to, a, b } => (to, a, b, 1),
            Quick::Subtract { to, a, b } => (to, a, b, -1),
            _ => return None,
        };
        let constant = usize::from(b).checked_sub(self.variables + TEMPORARIES)?;
        let Some(Number::Integer(value)) = *self.code.constants.get(constant)? else {
            return None;
        };
        let offset = i16::try_from(value.checked_mul(sign)?).ok()?;
        (self.is_temporary(to) && offset != 0).then_some((to, a, offset))
    }
}

/// `IF A > B THEN C = C - D` and its like, without an ELSE.
fn guarded(first: &Draft, second: &Draft) -> Option<Quick> {
    let Quick::Branch {
        relation,
        a,
        b,
        then,
        otherwise,
    } = first.operation
    else {
        return None;
    };
    let alone = u32::from(then) == second.step && u32::from(otherwise) == second.step + 1;
    if !alone {
        return None;
    }
    Some(match second.operation {
        Quick::Add { to, a: first, b: by } if first == to => Quick::GuardedAdd {
            relation,
            to,
            a,
            b,
            by,
        },
        Quick::Subtract { to, a: first, b: by } if first == to => Quick::GuardedSubtract {
            relation,
            to,
            a,
            b,
            by,
        },
        Quick::Copy { to, a: by } => Quick::GuardedCopy {
            relation,
            to,
            a,
            b,
            by,
        },
        _ => return None,
    })
}
