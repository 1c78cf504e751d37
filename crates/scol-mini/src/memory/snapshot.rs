//! The state of a memory as it is saved: all values and the motion conditions.
//!
//! What is restored is validated against the variables of the program. Names in the saved form are fixed by
//! `fixtures/snapshots`; the state of a machine is in `machine::snapshot`.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use super::Memory;
use super::locals::{Locals, extent};
use crate::MAX_TASKS;
use crate::cell::{Cell, Held};
use crate::conditions::Conditions;
use crate::program::{Program, Slot};
use crate::snapshot::{self, RestoreError, STATE_VERSION, expect};
use crate::value::{Value, ValueKind};

/// What a [`Memory`] holds, to be written down.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemoryState {
    version: u32,
    source: u64,
    cells: Vec<Cell>,
    kinds: Vec<Option<ValueKind>>,
    vectors: Vec<Value>,
    free: Vec<u32>,
    task: u16,
    parked: BTreeMap<u16, Locals>,
    conditions: Conditions,
}

impl Memory {
    /// What this memory of `program` holds.
    #[must_use]
    pub fn state(&self, program: &Program) -> MemoryState {
        MemoryState {
            version: STATE_VERSION,
            source: program.fingerprint(),
            cells: self.cells.iter().copied().take(self.variables).collect(),
            kinds: self.kinds.clone(),
            vectors: self.vectors.clone(),
            free: self.free.clone(),
            task: self.task,
            parked: self.parked.clone(),
            conditions: self.conditions.clone(),
        }
    }

    /// The memory that `state` was taken from.
    ///
    /// # Errors
    /// [`RestoreError`]: the state is of another version or program, or no run of the program leads to it.
    pub fn restore(program: &Program, state: MemoryState) -> Result<Memory, RestoreError> {
        snapshot::belongs(state.version, state.source, program)?;
        let slots = &program.symbols.slots;
        snapshot::conditions(&state.conditions)?;
        state.vectors.iter().try_for_each(snapshot::value)?;
        expect(state.parked.len() < MAX_TASKS, "no more than 4 tasks")?;
        expect(
            !state.parked.contains_key(&state.task),
            "the variables of a task only once",
        )?;
        let mut places = Places {
            vectors: &state.vectors,
            left: (0..state.vectors.len()).collect(),
        };
        places.check(slots, &state.cells, &state.kinds, 0)?;
        let (first, range) = extent(slots, program.symbols.cells);
        for locals in state.parked.values() {
            let slots = slots.get(first..).unwrap_or_default();
            places.check(slots, &locals.cells, &locals.kinds, range.start)?;
        }
        for at in &state.free {
            expect(
                places.left.remove(&(*at as usize)),
                "free places that nothing holds",
            )?;
        }
        expect(places.left.is_empty(), "every place to be held or free")?;
        let mut cells = state.cells;
        let variables = cells.len();
        cells.extend(program.code.working_cells());
        Ok(Memory {
            cells,
            variables,
            kinds: state.kinds,
            vectors: state.vectors,
            free: state.free,
            task: state.task,
            parked: state.parked,
            conditions: state.conditions,
        })
    }
}

/// The values that are no numbers, and which of them no variable has been found to hold.
struct Places<'a> {
    vectors: &'a [Value],
    left: BTreeSet<usize>,
}

impl Places<'_> {
    /// Whether these are the cells and kinds of these slots, whose first cell has the number `base`.
    fn check(
        &mut self,
        slots: &[Slot],
        cells: &[Cell],
        kinds: &[Option<ValueKind>],
        base: usize,
    ) -> Result<(), RestoreError> {
        let length: usize = slots.iter().map(Slot::length).sum();
        expect(
            cells.len() == length,
            "as many values as the program has variables",
        )?;
        expect(
            kinds.len() == slots.len(),
            "a kind for each variable of the program",
        )?;
        for (slot, kind) in slots.iter().zip(kinds) {
            expect(
                slot.kind.is_none() || slot.kind == *kind,
                "variables of the kinds that are declared",
            )?;
            let from = slot.base.saturating_sub(base);
            for cell in cells.get(from..from + slot.length()).unwrap_or_default() {
                let found = self.kind(*cell)?;
                expect(
                    found.is_none() || found == *kind,
                    "values of the kinds of their variables",
                )?;
            }
        }
        Ok(())
    }

    fn kind(&mut self, cell: Cell) -> Result<Option<ValueKind>, RestoreError> {
        Ok(match cell.held() {
            Held::Nothing => None,
            Held::Integer(_) => Some(ValueKind::Integer),
            Held::Real(value) => {
                expect(value.is_finite(), "reals that are finite")?;
                Some(ValueKind::Real)
            }
            Held::Vector(at) => {
                expect(self.left.remove(&(at as usize)), "every place to be held once")?;
                let kind = self.vectors.get(at as usize).map(Value::kind);
                expect(
                    kind.is_some_and(|kind| !kind.is_number()),
                    "numbers among the values that are none nowhere",
                )?;
                kind
            }
        })
    }
}
