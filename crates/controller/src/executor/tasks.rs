//! TASK, SWITCH and KILL, and which task moves the arm. How tasks take turns is in `robot::scheduler`.

use crate::alarm;
use crate::executor::step::Step;
use crate::executor::{Executor, MAIN_TASK, Task};
use crate::time::Time;
use alloc::sync::Arc;
use scol_mini::{Answer, MAX_TASKS, Machine, Number};

impl Executor {
    /// Answers the statement of the task, which was not a motion.
    pub(crate) fn answer(&mut self, task: &mut Task, answer: Answer) -> Step {
        task.answer(self.memory_mut(), answer, false)
    }

    /// Ends the statement of the task, which was not a motion.
    pub(crate) fn done(&mut self, task: &mut Task) -> Step {
        self.answer(task, Answer::Done)
    }

    /// Ends the motion statement of the task.
    pub(crate) fn moved(&mut self, task: &mut Task) -> Step {
        task.answer(self.memory_mut(), Answer::Done, true)
    }

    /// TASK: the new task has the turn (M-58762 p.2-27).
    pub(crate) fn start_task(&mut self, task: &mut Task, block: usize, now: Time) -> Step {
        // The main program always counts, and this task has been taken out of the others.
        let others = self.tasks.len() + usize::from(task.id() != MAIN_TASK);
        if others + 1 >= MAX_TASKS {
            let reason = format!("at most {MAX_TASKS} tasks can run, and all of them do");
            return task.give_up(alarm::TOO_MANY_TASKS, reason);
        }
        let id = self.free_task_id(task);
        let step = self.answer(task, Answer::Values([Number::Integer(i32::from(id))].into()));
        // A task whose number cannot be stored could never be killed, so it is not started.
        if let Step::Done { .. } = step {
            let program = Arc::clone(self.program());
            self.next_task = self.next_task.saturating_add(1);
            self.put_task(Task::new(Machine::task(program, block, id), now));
        }
        step.then(Step::Switch { to: id })
    }

    /// The ID of the task that this one starts: one after the other, and when all have been used the lowest that is free.
    fn free_task_id(&self, starter: &Task) -> u16 {
        let is_free = |id: &u16| *id != starter.id() && !self.tasks.contains_key(id);
        let reused = (MAIN_TASK + 1..u16::MAX).find(is_free);
        reused
            .filter(|_| self.next_task == u16::MAX)
            .unwrap_or(self.next_task)
    }

    /// SWITCH: the turn goes to the next task.
    pub(crate) fn switch_task(&mut self, task: &mut Task) -> Step {
        let id = task.id();
        let step = self.done(task);
        let others = || self.program_tasks().map(Task::id);
        let next = others().filter(|other| *other > id).min();
        let least = others().chain([id]).min();
        step.then(Step::Switch {
            to: next.or(least).unwrap_or(id),
        })
    }

    /// KILL; a task that is not there has ended already.
    pub(crate) fn kill_task(&mut self, task: &mut Task, victim: i32) -> Step {
        let known = |id: &u16| *id == task.id() || *id == MAIN_TASK || self.tasks.contains_key(id);
        let victim = u16::try_from(victim).ok().filter(known);
        // KILL is over first: a task may kill itself, and then has no statement to end.
        let step = self.done(task);
        match victim {
            Some(id) => step.then(Step::Killed { id }),
            None => step,
        }
    }

    /// The first task that moves the arm owns it until it ends; false for another one.
    pub(crate) fn takes_arm(&mut self, task: &Task) -> bool {
        let id = task.id();
        id == 0 || *self.arm_owner.get_or_insert(id) == id
    }

    /// Whether the task moves the arm; the statement of DO always may.
    pub(crate) fn owns_arm(&self, task: &Task) -> bool {
        task.id() == 0 || self.arm_owner == Some(task.id())
    }

    /// A task has ended; returns whether a motion ends with it. The end of the main program ends the motions of all
    /// tasks.
    pub(crate) fn release_arm(&mut self, id: u16) -> bool {
        let ends = self.arm_owner == Some(id) || (id == MAIN_TASK && self.arm_owner.is_some());
        if ends {
            self.arm_owner = None;
        }
        ends
    }
}
