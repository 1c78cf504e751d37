//! The variables of the programs. Each task has its own, so that two tasks can run the same program.
//!
//! Those of the running task are in the cells, so the machine reads them without asking whose they are; those of the other
//! tasks are parked. GLOBAL and DATA are left to `memory`.

use crate::prelude::*;
use core::ops::Range;

use super::{MAIN_TASK, Memory};
use crate::cell::{Cell, Held};
use crate::program::{Owner, Program, Slot};
use crate::value::{Value, ValueKind};

/// Task ID of a statement that is executed directly: it sees no variables of programs.
const DIRECT: u16 = 0;

/// The variables of the programs as one task has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Locals {
    pub(super) cells: Vec<Cell>,
    pub(super) kinds: Vec<Option<ValueKind>>,
}

/// Slots and cells of the variables of the programs.
pub(super) fn extent(slots: &[Slot], variables: usize) -> (usize, Range<usize>) {
    let first = slots.partition_point(|slot| slot.owner != Owner::Local);
    let base = slots.get(first).map_or(variables, |slot| slot.base);
    (first, base.min(variables)..variables)
}

impl Memory {
    /// Brings the variables of this task into the cells; a task that has none yet begins with the initial ones.
    pub(crate) fn switch_task(&mut self, program: &Program, task: u16) {
        if task == self.task || task == DIRECT {
            return;
        }
        let slots = &program.symbols.slots;
        let own = self.parked.remove(&task);
        let others = self.exchange_locals(slots, own);
        self.parked.insert(self.task, others);
        self.task = task;
    }

    /// Brings these variables into the cells, or those of a new task; returns the previous content.
    fn exchange_locals(&mut self, slots: &[Slot], own: Option<Locals>) -> Locals {
        let (first, range) = extent(slots, self.cells.variables);
        let locals = slots.get(first..).unwrap_or_default();
        let fresh = own.is_none();
        let own = own.unwrap_or_else(|| Locals {
            cells: core::iter::repeat_n(Cell::EMPTY, range.len()).collect(),
            kinds: locals.iter().map(|slot| slot.kind).collect(),
        });
        let first = first.min(self.kinds.len());
        let others = Locals {
            cells: self.cells.all.splice(range, own.cells).collect(),
            kinds: self.kinds.splice(first.., own.kinds).collect(),
        };
        if fresh {
            self.begin(locals);
        }
        others
    }

    /// The value of a variable of a program: that of the main task, else of the first task in which it has one.
    pub(super) fn value_in_tasks(&self, slots: &[Slot], cell: usize) -> Option<Value> {
        let mut tasks: Vec<u16> = self.parked.keys().copied().chain([self.task]).collect();
        tasks.sort_unstable();
        tasks.iter().find_map(|task| self.value_in(slots, *task, cell))
    }

    /// The value of a variable as this task has it; those of GLOBAL and DATA are the same for all.
    pub(crate) fn value_in(&self, slots: &[Slot], task: u16, cell: usize) -> Option<Value> {
        let (_, range) = extent(slots, self.cells.variables);
        match cell
            .checked_sub(range.start)
            .filter(|_| task != self.task && task != DIRECT)
        {
            Some(at) => self.held(*self.parked.get(&task)?.cells.get(at)?),
            None => self.value(cell),
        }
    }

    /// A task has ended: its variables are gone. Those of the main program stay.
    pub fn drop_task(&mut self, program: &Program, task: u16) {
        if task == self.task {
            self.switch_task(program, MAIN_TASK);
        }
        if task != MAIN_TASK
            && let Some(locals) = self.parked.remove(&task)
        {
            self.release(&locals);
        }
    }

    /// All tasks but the main program have ended.
    pub fn drop_tasks(&mut self, program: &Program) {
        self.switch_task(program, MAIN_TASK);
        for locals in core::mem::take(&mut self.parked).values() {
            self.release(locals);
        }
    }

    /// The variables of the programs begin as in a task that was just started. All tasks but the main program have
    /// ended. GLOBAL, DATA and the conditions stay.
    pub fn reset_locals(&mut self, program: &Program) {
        self.drop_tasks(program);
        let old = self.exchange_locals(&program.symbols.slots, None);
        self.release(&old);
    }

    /// Releases the values of these variables.
    fn release(&mut self, locals: &Locals) {
        for cell in &locals.cells {
            if let Held::Vector(at) = cell.held()
                && let Some(value) = self.vectors.get_mut(at as usize)
            {
                *value = Value::Integer(0);
                self.free.push(at);
            }
        }
    }
}
