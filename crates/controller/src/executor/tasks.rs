//! TASK, SWITCH and KILL, and which task moves the arm. How tasks take turns is in `scheduler`.

use crate::alarm;
use crate::executor::scheduler::Step;
use crate::executor::{MAIN_TASK, Task};
use crate::robot::Robot;
use alloc::format;
use alloc::sync::Arc;
use scol_mini::{Answer, MAX_TASKS, Machine, Number};

impl Robot {
    /// TASK: the new task has the turn (M-58762 p.2-27).
    pub(crate) fn start_task(&mut self, task: &mut Task, block: usize) -> Step {
        // The main program always counts, and this task has been taken out of the others.
        let others = self.executor.tasks.len() + usize::from(task.id() != MAIN_TASK);
        if others + 1 >= MAX_TASKS {
            let line = task.machine.line();
            task.machine.skip();
            let detail = format!("line {line}: at most {MAX_TASKS} tasks expected, one more found");
            return Step::Trouble(alarm::TOO_MANY_TASKS, detail);
        }
        let id = self.executor.next_task;
        let answer = Answer::Values([Number::Integer(i32::from(id))].into());
        match self.answer(task, answer, false) {
            Step::Done { .. } => {
                let program = Arc::clone(self.executor.program());
                let started = Task::new(Machine::task(program, block, id), self.now);
                self.executor.next_task = id.saturating_add(1);
                self.executor.put_task(started);
                Step::Switch { to: id }
            }
            other => other,
        }
    }

    /// SWITCH: the turn goes to the next task.
    pub(crate) fn switch_task(&mut self, task: &mut Task) -> Step {
        let id = task.id();
        match self.answer(task, Answer::Done, false) {
            Step::Done { .. } => {
                let ids = self.executor.program_tasks().map(Task::id);
                let (mut least, mut next) = (id, None::<u16>);
                for other in ids {
                    least = least.min(other);
                    if other > id {
                        next = Some(next.map_or(other, |next| next.min(other)));
                    }
                }
                Step::Switch {
                    to: next.unwrap_or(least),
                }
            }
            other => other,
        }
    }

    /// KILL; a task that is not there has ended already.
    pub(crate) fn kill_task(&mut self, task: &mut Task, victim: i32) -> Step {
        let known = |id: u16| id == task.id() || id == MAIN_TASK || self.executor.tasks.contains_key(&id);
        let victim = u16::try_from(victim).ok().filter(|id| known(*id));
        match (self.answer(task, Answer::Done, false), victim) {
            (Step::Done { .. }, Some(id)) => Step::Killed { id },
            (step, _) => step,
        }
    }

    /// A task is over; with the main program the cycle is.
    pub(crate) fn end_task(&mut self, id: u16) {
        if self.executor.arm_owner == Some(id) {
            self.arm.stop(self.now);
            self.executor.arm_owner = None;
        }
        if id == MAIN_TASK {
            self.end_cycle();
        } else {
            self.executor.drop_task(id);
        }
    }

    /// The first task that moves the arm owns it until it ends; false for another one.
    pub(crate) fn takes_arm(&mut self, task: &Task) -> bool {
        let id = task.id();
        if id == 0 {
            return true;
        }
        *self.executor.arm_owner.get_or_insert(id) == id
    }
}
