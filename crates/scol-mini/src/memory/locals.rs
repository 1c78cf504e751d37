//! Variables of the programs: each task has its own, so that two tasks can run the same program. Those of the task
//! that runs lie in the cells, where they are found without asking whose they are; the others wait aside.

use super::{Cell, Memory};
use crate::machine::MAIN_TASK;
use crate::program::{Owner, Program};

/// Task ID of a statement that is executed directly: it sees no variables of programs.
const DIRECT: u16 = 0;

impl Memory {
    /// Brings the variables of this task into the cells; a task that has none yet begins with the initial ones.
    pub(crate) fn enter(&mut self, program: &Program, task: u16) {
        if task == self.task || task == DIRECT {
            return;
        }
        let slots = &program.symbols.slots;
        let first = slots.partition_point(|slot| slot.owner != Owner::Local);
        let own = self.parked.remove(&task);
        let own = own.unwrap_or_else(|| slots.iter().skip(first).map(Cell::new).collect());
        let others = self.cells.split_off(first.min(self.cells.len()));
        self.cells.extend(own);
        self.parked.insert(self.task, others);
        self.task = task;
    }

    /// A task has ended: its variables are gone. Those of the main program stay.
    pub fn forget(&mut self, program: &Program, task: u16) {
        if task == self.task {
            self.enter(program, MAIN_TASK);
        }
        if task != MAIN_TASK {
            self.parked.remove(&task);
        }
    }

    /// All tasks but the main program have ended.
    pub fn forget_tasks(&mut self, program: &Program) {
        self.enter(program, MAIN_TASK);
        self.parked.clear();
    }
}
