//! The compiled file: variables with their initial values, and a flat list of steps.
//!
//! A program is immutable and shared; what changes while it runs is in `Memory` and `Machine`. `compile` makes it.

use crate::prelude::*;
use alloc::collections::BTreeMap;
use alloc::sync::Arc;
use core::ops::Range;

use crate::code::Code;
use crate::options::LanguageOptions;
use crate::tree::{Counting, Expression, Reference, Simple};
use crate::value::{Value, ValueKind};

/// Version of the states of machines and memories this version of the language writes and reads.
pub const STATE_VERSION: u32 = 1;

/// A compiled file: made by [`compile`](crate::compile), run by [`Machine`](crate::Machine).
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Tells it from the programs of other sources and options.
    pub(crate) fingerprint: u64,
    pub(crate) options: LanguageOptions,
    pub(crate) symbols: Arc<Symbols>,
    pub(crate) blocks: Vec<Entry>,
    pub(crate) steps: Vec<Step>,
    /// The instructions of the steps.
    pub(crate) code: Code,
    /// The step with which the main program begins.
    pub(crate) first: usize,
    /// Step of the label `RCYCLE` in the main program.
    pub(crate) rcycle: Option<usize>,
    /// Variables that a statement executed directly makes for itself, as parameters without a value.
    pub(crate) created: usize,
}

/// Facts about a variable that are the same in all programs of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableInfo {
    /// Its kind; `None` when the first assignment will fix it.
    pub kind: Option<ValueKind>,
    /// It is an array, of which only elements can be read and written.
    pub array: bool,
}

/// A PROGRAM block.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    pub name: String,
    /// Its first step.
    pub step: usize,
    pub parameters: Vec<String>,
    /// The slots of its variables, without its parameters.
    pub locals: Range<usize>,
}

/// A step and where it came from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    /// File line, from 1.
    pub line: u32,
    /// It begins a statement and costs fuel; the others continue one.
    pub head: bool,
    pub operation: Operation,
}

/// Operation of a step. Steps are numbered through the whole file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Operation {
    Simple(Simple),
    Wait(Expression),
    /// Continues when true, jumps to `otherwise` when false.
    Branch {
        condition: Expression,
        otherwise: usize,
    },
    Jump(usize),
    Select {
        selector: Expression,
        targets: Vec<usize>,
    },
    /// `exit` is the step after the NEXT.
    For {
        counting: Counting,
        exit: usize,
    },
    Next {
        opener: usize,
    },
    Call {
        block: usize,
        arguments: Vec<Expression>,
    },
    Return,
    /// Starts a monitor; the action is the next step, `after` the one after its `HandlerEnd`.
    On {
        condition: Expression,
        after: usize,
        /// The action is a jump, not a handler.
        jump: bool,
    },
    /// The action of a monitor has ended.
    HandlerEnd,
}

/// The variables of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Symbols {
    pub slots: Vec<Slot>,
    /// Names of GLOBAL and DATA.
    pub shared: BTreeMap<String, usize>,
    /// Elements of all arrays together.
    pub elements: usize,
    /// Cells of all variables together.
    pub cells: usize,
}

impl Symbols {
    /// The variable of GLOBAL or DATA of this name, in upper case.
    pub fn find(&self, name: &str) -> Option<&Slot> {
        self.slots.get(*self.shared.get(name)?)
    }

    /// All of them by their names.
    pub fn by_name(&self) -> impl Iterator<Item = (&str, &Slot)> {
        let shared = self.shared.iter();
        shared.filter_map(|(name, at)| Some((name.as_str(), self.slots.get(*at)?)))
    }

    /// Mutable access to the same.
    pub fn find_mut(&mut self, name: &str) -> Option<&mut Slot> {
        self.slots.get_mut(*self.shared.get(name)?)
    }

    /// Adds a variable and gives it its cells.
    pub fn add(&mut self, mut slot: Slot) -> Reference {
        let (number, cell) = (self.slots.len(), self.cells);
        slot.base = cell;
        self.cells += slot.length();
        self.slots.push(slot);
        Reference::Slot { slot: number, cell }
    }

    /// Adds a variable that all programs see.
    pub fn share(&mut self, slot: Slot) {
        self.shared.insert(slot.name.clone(), self.slots.len());
        self.add(slot);
    }
}

/// A variable or an array.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Slot {
    pub name: String,
    pub owner: Owner,
    /// The declared kind, or that of the initial value.
    pub kind: Option<ValueKind>,
    /// Upper bounds; `None` for a plain variable.
    pub bounds: Option<Vec<u32>>,
    /// Every element begins as the zero of `kind`.
    pub zeroed: bool,
    /// Initial values by flat index.
    pub initial: Vec<(usize, Value)>,
    /// Positions of DATA refer to this coordinate system.
    pub is_work: bool,
    /// Its first cell in the memory.
    pub base: usize,
}

/// Visibility of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Owner {
    Global,
    Data,
    /// A variable of one PROGRAM block.
    Local,
}

impl Slot {
    pub fn plain(name: &str, owner: Owner) -> Self {
        Slot {
            name: name.into(),
            owner,
            kind: None,
            bounds: None,
            zeroed: false,
            initial: Vec::new(),
            is_work: false,
            base: 0,
        }
    }

    /// A plain variable that begins with a value.
    pub fn with_value(name: &str, owner: Owner, value: Value) -> Self {
        Slot {
            kind: Some(value.kind()),
            initial: Vec::from([(0, value)]),
            ..Slot::plain(name, owner)
        }
    }

    fn info(&self) -> VariableInfo {
        VariableInfo {
            kind: self.kind,
            array: self.bounds.is_some(),
        }
    }

    /// Number of its values.
    pub fn length(&self) -> usize {
        self.bounds.as_ref().map_or(1, |bounds| flat_length(bounds))
    }

    /// Initial value of an element; `None` if it has none.
    pub fn first_value(&self, index: usize) -> Option<Value> {
        let initial = self.initial.iter().find(|(known, _)| *known == index);
        let zero = || self.kind.filter(|_| self.zeroed).map(ValueKind::zero);
        initial.map(|(_, value)| value.clone()).or_else(zero)
    }

    /// The subscripts of the element of this flat index; none for a plain variable.
    pub fn subscripts(&self, mut index: usize) -> Vec<i32> {
        let bounds = self.bounds.as_deref().unwrap_or_default();
        let backwards = bounds.iter().rev().map(|bound| {
            let length = *bound as usize + 1;
            let subscript = index % length;
            index /= length;
            i32::try_from(subscript).unwrap_or(i32::MAX)
        });
        let mut subscripts: Vec<i32> = backwards.collect();
        subscripts.reverse();
        subscripts
    }

    /// The flat index of an element; `None` for a wrong number of subscripts or one out of bounds.
    pub fn index<T: Copy + TryInto<u32>>(&self, subscripts: &[T]) -> Option<usize> {
        let bounds = self.bounds.as_deref().unwrap_or_default();
        if bounds.len() != subscripts.len() {
            return None;
        }
        let mut pairs = bounds.iter().zip(subscripts);
        pairs.try_fold(0, |index, (bound, subscript)| {
            let subscript: u32 = (*subscript).try_into().ok()?;
            (subscript <= *bound).then(|| index * (*bound as usize + 1) + subscript as usize)
        })
    }
}

/// Elements of an array with these upper bounds; subscripts begin at 0.
pub(crate) fn flat_length(bounds: &[u32]) -> usize {
    bounds.iter().fold(1_usize, |length, bound| {
        length.saturating_mul((*bound as usize).saturating_add(1))
    })
}

/// A fingerprint of bytes on top of another one.
pub(crate) fn hash(base: u64, bytes: &[u8]) -> u64 {
    fnv(base.to_le_bytes().into_iter().chain(bytes.iter().copied()))
}

/// FNV-1a.
fn fnv(bytes: impl Iterator<Item = u8>) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    bytes.fold(OFFSET, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

/// The fingerprint of a source and its options, on top of another one.
pub(crate) fn fingerprint(base: u64, source: &str, options: &LanguageOptions) -> u64 {
    let LanguageOptions {
        arm,
        sticky_work,
        int_division,
        data_copy,
        equal_within,
    } = *options;
    let switches = [
        u8::from(arm == crate::Arm::Scara),
        u8::from(sticky_work),
        u8::from(int_division == crate::IntDivision::Real),
        u8::from(data_copy),
    ];
    let base = base.to_le_bytes().into_iter();
    // Only where it differs from the exact comparison: fingerprints of older snapshots stay valid.
    let within = Some(equal_within)
        .filter(|within| *within != 0.0)
        .map(f32::to_le_bytes);
    let within = within.into_iter().flatten();
    fnv(base.chain(switches).chain(within).chain(source.bytes()))
}

impl Program {
    /// A program without blocks, variables and steps: what a statement is executed in when no file is selected.
    pub fn empty(options: &LanguageOptions) -> Arc<Program> {
        Arc::new(Program::without_steps(fingerprint(0, "", options), options))
    }

    pub(crate) fn without_steps(fingerprint: u64, options: &LanguageOptions) -> Program {
        Program {
            fingerprint,
            options: *options,
            symbols: Arc::default(),
            blocks: Vec::new(),
            steps: Vec::new(),
            code: Code::default(),
            first: 0,
            rcycle: None,
            created: 0,
        }
    }

    /// A number that tells this program from those of other sources and options.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// The options it was compiled with.
    pub fn options(&self) -> &LanguageOptions {
        &self.options
    }

    /// The variables of GLOBAL and the names of DATA in alphabetical order, each with the upper bounds of its
    /// subscripts; a plain variable has none.
    pub fn variables(&self) -> impl Iterator<Item = (&str, VariableInfo, &[u32])> {
        let slots = self.symbols.by_name();
        slots.map(|(name, slot)| (name, slot.info(), slot.bounds.as_deref().unwrap_or_default()))
    }

    /// The variables of the PROGRAM blocks in file order, each as `PROGRAM.NAME`, as [`Program::variables`] gives those of GLOBAL.
    /// Parameters are not among them: their values are those of the caller.
    pub fn locals(&self) -> impl Iterator<Item = (String, VariableInfo, &[u32])> {
        let slots = |block: &Entry| self.symbols.slots.get(block.locals.clone()).unwrap_or_default();
        self.blocks.iter().flat_map(move |block| {
            let named = move |slot: &'_ Slot| format!("{}.{}", block.name, slot.name);
            let slots = slots(block).iter();
            slots.map(move |slot| {
                (
                    named(slot),
                    slot.info(),
                    slot.bounds.as_deref().unwrap_or_default(),
                )
            })
        })
    }

    /// The slot of the variable `name` of a PROGRAM block, both in upper case.
    pub(crate) fn local(&self, block: &str, name: &str) -> Option<&Slot> {
        let block = self.blocks.iter().find(|entry| entry.name == block)?;
        let slots = self.symbols.slots.get(block.locals.clone())?;
        slots.iter().find(|slot| slot.name == name)
    }

    /// File lines on which a statement begins, in ascending order.
    pub fn statement_lines(&self) -> Vec<u32> {
        let heads = self.steps.iter().filter(|step| step.head);
        let mut lines: Vec<u32> = heads.map(|step| step.line).collect();
        lines.sort_unstable();
        lines.dedup();
        lines
    }

    /// Line of the statement of this line in `other`, which has the same steps.
    pub fn line_in(&self, other: &Program, line: u32) -> u32 {
        let mut steps = self.steps.iter().zip(&other.steps);
        let found = steps.find(|(step, _)| step.line == line);
        found.map_or(line, |(_, step)| step.line)
    }

    /// The PROGRAM blocks in file order: name in upper case, and the file line of its first statement.
    pub fn program_lines(&self) -> Vec<(&str, u32)> {
        let line = |entry: &Entry| self.steps.get(entry.step).map_or(1, |step| step.line);
        let blocks = self.blocks.iter();
        blocks.map(|block| (block.name.as_str(), line(block))).collect()
    }

    /// The PROGRAM block with this step.
    pub(crate) fn block_of(&self, step: usize) -> Option<&Entry> {
        let before = self.blocks.iter().filter(|block| block.step <= step);
        before.max_by_key(|block| block.step)
    }

    /// A variable of GLOBAL or a name of DATA; `None` when there is no such. Case does not matter (RAM-07).
    pub fn variable(&self, name: &str) -> Option<VariableInfo> {
        self.symbols.find(&name.to_ascii_uppercase()).map(Slot::info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: CMD-MR-03
    #[test]
    fn subscripts_run_from_0_to_the_bound() {
        let slot = Slot {
            bounds: Some(Vec::from([2, 3])),
            ..Slot::plain("T", Owner::Global)
        };
        assert_eq!(slot.length(), 12);
        assert_eq!(slot.index(&[0, 0]), Some(0));
        assert_eq!(slot.index(&[2, 3]), Some(11));
        for index in 0..12 {
            assert_eq!(slot.index(&slot.subscripts(index)), Some(index));
        }
        assert_eq!(slot.index(&[3, 0]), None);
        assert_eq!(slot.index(&[-1, 0]), None);
        assert_eq!(slot.index(&[1]), None);
        assert_eq!(Slot::plain("N", Owner::Local).index::<i32>(&[]), Some(0));
    }
}
