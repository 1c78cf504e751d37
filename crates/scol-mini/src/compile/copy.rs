//! Calls in the quick form. A program that is short and calls nothing stands in the code once more for each call of it,
//! with the cells of the caller in place of its parameters: entering and leaving it costs no more than a jump.
//! What the call would have left behind is made up for by the machine when it stops within.

use alloc::vec::Vec;
use core::mem;

use super::fuse::Draft;
use super::lower::{Lowering, narrow, wide};
use crate::code::{Called, Handed, Quick, Register, TEMPORARIES, Target};
use crate::program::Operation;
use crate::tree::{Expression, Node, Reference};

/// Most steps of a program that is copied.
const MAX_COPIED: usize = 24;
/// Most instructions of all copies together.
const MAX_COPIES: usize = 8_192;

/// The copies of programs.
#[derive(Debug, Default)]
pub(super) struct Copies {
    pub done: Vec<Copy>,
    instructions: usize,
}

/// A copy of a program for one call.
#[derive(Debug)]
pub(super) struct Copy {
    pub call: u16,
    pub drafts: Vec<Draft>,
}

/// What stands in a copy for the parameters, and where RETURN and END go.
#[derive(Debug)]
pub(super) struct Stands {
    parameters: Vec<Register>,
    pub back: Target,
}

impl Lowering<'_> {
    pub(super) fn call(&mut self, number: usize, block: usize, arguments: &[Expression]) -> Option<()> {
        let mut handed: Vec<Handed> = arguments
            .iter()
            .map(|argument| self.handed(argument))
            .collect::<Option<_>>()?;
        let parameters = self.parameters(block, &handed);
        let step = wide(self.blocks.get(block)?.step)?;
        let back = number + 1;
        let call = narrow(self.code.calls.len())?;
        let copy = parameters.and_then(|parameters| {
            let stands = Stands {
                parameters: parameters.clone(),
                back: narrow(back)?,
            };
            Some((self.copy(call, block, stands)?, parameters))
        });
        match copy {
            Some((entered, cells)) => {
                for (handed, to) in handed.iter_mut().zip(cells) {
                    if let Handed::Value(a) = handed {
                        self.push(Quick::Hand { to, a: *a });
                        *a = to;
                    }
                }
                self.push(Quick::Enter(entered));
            }
            None => self.push(Quick::Call(call)),
        }
        self.code.calls.push(Called {
            arguments: handed,
            step,
            back: wide(back)?,
        });
        Some(())
    }

    fn handed(&mut self, argument: &Expression) -> Option<Handed> {
        match &argument.node {
            Node::Variable(variable) => match variable.reference {
                Reference::Slot(slot) if variable.subscripts.is_empty() => Some(Handed::Variable {
                    slot: wide(slot)?,
                    cell: narrow(self.symbols.slots.get(slot)?.base)?,
                }),
                Reference::Parameter(parameter) => narrow(parameter).map(Handed::Parameter),
                Reference::Slot(_) | Reference::Unresolved => None,
            },
            _ => self.register(argument).map(Handed::Value),
        }
    }

    /// The cells that stand for the parameters in a copy of this program; `None` when it is not one to copy.
    fn parameters(&mut self, block: usize, handed: &[Handed]) -> Option<Vec<Register>> {
        let steps = self.steps.get(self.extent(block)?)?;
        let short = steps.len() <= MAX_COPIED && self.copies.instructions < MAX_COPIES;
        // A loop belongs to its frame, and a copy has none.
        let plain = |operation: &Operation| {
            !matches!(
                operation,
                Operation::Call { .. } | Operation::For { .. } | Operation::Next { .. }
            )
        };
        if !short || !steps.iter().all(|step| plain(&step.operation)) {
            return None;
        }
        handed
            .iter()
            .map(|handed| match handed {
                Handed::Variable { slot, cell } => {
                    let slot = self.symbols.slots.get(*slot as usize)?;
                    let number = slot.kind.is_none_or(crate::ValueKind::is_number);
                    (number && slot.bounds.is_none()).then_some(*cell)
                }
                Handed::Value(_) => {
                    let at = self.symbols.cells + TEMPORARIES + self.code.constants.len();
                    self.code.constants.push(None);
                    narrow(at)
                }
                Handed::Parameter(_) => None,
            })
            .collect()
    }

    /// The steps of a program.
    fn extent(&self, block: usize) -> Option<core::ops::Range<usize>> {
        let end = self
            .blocks
            .get(block + 1)
            .map_or(self.steps.len(), |next| next.step);
        Some(self.blocks.get(block)?.step..end)
    }

    /// Writes a copy; returns its number, or `None` when a step has no quick form.
    fn copy(&mut self, call: u16, block: usize, stands: Stands) -> Option<u16> {
        let entered = narrow(self.copies.done.len())?;
        let mut extent = self.extent(block)?;
        let caller = (mem::take(&mut self.drafts), self.step, self.temporaries);
        self.stands = Some(stands);
        let done = extent.try_for_each(|number| self.step(number));
        self.stands = None;
        let drafts = mem::replace(&mut self.drafts, caller.0);
        (self.step, self.temporaries) = (caller.1, caller.2);
        done?;
        self.copies.instructions += drafts.len();
        self.copies.done.push(Copy { call, drafts });
        Some(entered)
    }

    /// The cell that stands for a parameter, in a copy.
    pub(super) fn stand_in(&self, parameter: usize) -> Option<Option<Register>> {
        match &self.stands {
            Some(stands) => stands.parameters.get(parameter).map(|cell| Some(*cell)),
            None => Some(None),
        }
    }
}
