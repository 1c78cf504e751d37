//! Where the cycle goes: how often each statement of a run was executed, and how long its task was at it.
//!
//! [`crate::headless`] counts. All time passes while a task is at some statement, so the times of the main program add up to the
//! duration of the run. A motion that is not waited for, with NOWAIT or PASS, takes no time itself; the statement that waits does.

use std::collections::BTreeMap;
use std::time::Duration;
use ts3100_controller::{Controller, Time};

/// The statements of a run.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Profile {
    /// By task and line.
    statements: BTreeMap<(u16, u32), Spent>,
    /// Time in which the program was stopped.
    pub stopped: Duration,
}

/// Executions and time of a statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Spent {
    /// How often it began.
    pub times: u64,
    /// Virtual time at it.
    pub time: Duration,
}

/// The statements of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskProfile {
    /// ID of the task, 1 for the main program.
    pub task: u16,
    /// Time of all of them.
    pub time: Duration,
    /// By their lines, those that took longest first.
    pub statements: Vec<(u32, Spent)>,
}

impl Profile {
    /// A statement begins.
    pub(crate) fn count(&mut self, task: u16, line: u32) {
        self.statements.entry((task, line)).or_default().times += 1;
    }

    /// Time passes until `now`. Each task spends it at the statement that it is at; the action of a monitor is one too.
    pub(crate) fn pass(&mut self, controller: &Controller, now: Time) {
        let passed = now.since(controller.now());
        if passed.is_zero() {
            return;
        }
        if !controller.program_runs() {
            self.stopped += passed;
            return;
        }
        for task in controller.tasks() {
            self.statements.entry((task.id, task.line)).or_default().time += passed;
        }
    }

    /// The tasks, the main program first.
    pub fn tasks(&self) -> Vec<TaskProfile> {
        let mut tasks: BTreeMap<u16, TaskProfile> = BTreeMap::new();
        for ((task, line), spent) in &self.statements {
            let profile = tasks.entry(*task).or_insert_with(|| TaskProfile {
                task: *task,
                time: Duration::ZERO,
                statements: Vec::new(),
            });
            profile.time += spent.time;
            profile.statements.push((*line, *spent));
        }
        let mut tasks: Vec<TaskProfile> = tasks.into_values().collect();
        for task in &mut tasks {
            task.statements
                .sort_by_key(|(line, spent)| (std::cmp::Reverse(spent.time), *line));
        }
        tasks
    }
}
