//! Validates a memory that was read back against the variables of its program.
//!
//! Machines are validated in `machine::snapshot`.

use alloc::collections::BTreeSet;

use super::Memory;
use super::locals::extent;
use crate::MAX_TASKS;
use crate::cell::{Cell, Held};
use crate::program::{Program, Slot};
use crate::snapshot::{self, RestoreError, expect};
use crate::value::{Value, ValueKind};

impl Memory {
    /// Takes a memory that was read back into use for its program.
    ///
    /// # Errors
    /// [`RestoreError`]: the state is of another program, or no run of the program leads to it.
    pub fn relink(&mut self, program: &Program) -> Result<(), RestoreError> {
        snapshot::belongs(self.source, program)?;
        let slots = &program.symbols.slots;
        snapshot::conditions(&self.conditions)?;
        self.vectors.iter().try_for_each(snapshot::value)?;
        expect(self.parked.len() < MAX_TASKS, "no more than 4 tasks")?;
        let once = !self.parked.contains_key(&self.task);
        expect(once, "the variables of a task only once")?;
        let mut places = Places {
            vectors: &self.vectors,
            left: (0..self.vectors.len()).collect(),
        };
        places.check(slots, self.cells.variables(), &self.kinds, 0)?;
        let (first, range) = extent(slots, program.symbols.cells);
        for locals in self.parked.values() {
            let slots = slots.get(first..).unwrap_or_default();
            places.check(slots, &locals.cells, &locals.kinds, range.start)?;
        }
        for at in &self.free {
            let is_free = places.left.remove(&(*at as usize));
            expect(is_free, "free places that nothing holds")?;
        }
        expect(places.left.is_empty(), "every place to be held or free")?;
        Ok(())
    }
}

/// The values that are not numbers, and those of them that no variable holds so far.
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
        let complete = cells.len() == length;
        expect(complete, "as many values as the program has variables")?;
        let complete = kinds.len() == slots.len();
        expect(complete, "a kind for each variable of the program")?;
        for (slot, kind) in slots.iter().zip(kinds) {
            let as_declared = slot.kind.is_none() || slot.kind == *kind;
            expect(as_declared, "variables of the kinds that are declared")?;
            let from = slot.base.saturating_sub(base);
            for cell in cells.get(from..from + slot.length()).unwrap_or_default() {
                let found = self.kind(*cell)?;
                let fits = found.is_none() || found == *kind;
                expect(fits, "values of the kinds of their variables")?;
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
                let vector = kind.is_some_and(|kind| !kind.is_number());
                expect(vector, "numbers among the values that are none nowhere")?;
                kind
            }
        })
    }
}
