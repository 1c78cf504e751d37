//! Breakpoints of the selected file, and the line or step up to which the program runs once.
//!
//! The controller of the manual has none: they are for the owner of the emulator. A stop at one is a STOP between two
//! steps, in every operation mode, and hosts are told of it as of any other (CMD-SP-05). A start continues with the
//! current line of each task, even if that line has a breakpoint.

use crate::executor::{Executor, MAIN_TASK, Task};
use crate::limits::MAX_BREAKPOINTS;
use crate::prelude::*;
use alloc::collections::BTreeSet;

/// Up to where the program runs once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Target {
    /// To the end of the step that ends next.
    NextStep,
    /// To the beginning of this line.
    Line(u32),
}

/// Where the program stops besides its end.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Breakpoints {
    /// Lines with a statement, from 1.
    lines: BTreeSet<u32>,
    target: Option<Target>,
    /// The lines from which each task and its handler continued, until one of them has left its line.
    left: Vec<(u16, u32)>,
}

impl Breakpoints {
    /// Whether the program has to be looked at before each statement.
    pub(crate) fn are_set(&self) -> bool {
        !self.lines.is_empty() || self.target.is_some()
    }

    /// The lines, from 1.
    pub(crate) fn lines(&self) -> impl Iterator<Item = u32> {
        self.lines.iter().copied()
    }

    /// Whether a task stops before the statement that it would begin now in this line.
    fn stops_before(&mut self, task: u16, line: u32) -> bool {
        if self.left.contains(&(task, line)) {
            return false;
        }
        // The task has left its line: a loop that comes back to it stops there.
        self.left.retain(|(left, _)| *left != task);
        self.lines.contains(&line) || self.target == Some(Target::Line(line))
    }

    /// Whether the program stops after the step that has just ended.
    pub(crate) fn stops_after_step(&self) -> bool {
        self.target == Some(Target::NextStep)
    }

    /// The file was replaced: its lines are new ones.
    pub(crate) fn relocate(&mut self, moved: impl Fn(u32) -> u32) {
        self.lines = self.lines.iter().map(|line| moved(*line)).collect();
        self.left.iter_mut().for_each(|(_, line)| *line = moved(*line));
        if let Some(Target::Line(line)) = &mut self.target {
            *line = moved(*line);
        }
    }

    /// Whether a run can have these breakpoints; for a snapshot.
    pub(crate) fn is_valid(&self) -> bool {
        self.lines.len() <= MAX_BREAKPOINTS && self.left.len() <= 2 * scol_mini::MAX_TASKS
    }
}

impl Executor {
    /// Sets the breakpoints, each at the first of these lines with a statement from there on, and ends all others. `Err`
    /// gives the line for which there is none. One that was set before a download, and is after the end of the file by
    /// now, ends.
    pub(crate) fn set_breakpoints(&mut self, lines: &[u32], statements: &[u32]) -> Result<(), u32> {
        let lines = lines.iter().take(MAX_BREAKPOINTS);
        let found = lines.map(|line| (line, next_statement(statements, *line)));
        let found = found.filter(|(line, found)| found.is_some() || !self.breakpoints.lines.contains(line));
        let found = found.map(|(line, found)| found.ok_or(*line));
        self.breakpoints.lines = found.collect::<Result<_, _>>()?;
        Ok(())
    }

    /// Lets the program, which starts now, stop after one step.
    pub(crate) fn stop_after_next_step(&mut self) {
        self.breakpoints.target = Some(Target::NextStep);
    }

    /// Lets the program stop before the first statement from this line on; false if there is none.
    pub(crate) fn stop_before_line(&mut self, line: u32) -> bool {
        let found = next_statement(&self.program().statement_lines(), line);
        self.breakpoints.target = found.map(Target::Line);
        found.is_some()
    }

    /// Drops the step or line up to which the program was to run, as it has stopped.
    pub(crate) fn drop_target(&mut self) {
        self.breakpoints.target = None;
    }

    /// Whether a task stops before the statement that it would begin now. A statement of DO has no line of the file.
    pub(crate) fn stops_before(&mut self, task: &Task) -> bool {
        self.breakpoints.are_set()
            && task.id() >= MAIN_TASK
            && task.begins_statement()
            && self.breakpoints.stops_before(task.id(), task.line())
    }

    /// Notes the line of each task and its handler, as the program starts: its breakpoint does not count for the start.
    pub(crate) fn leave_breakpoints(&mut self) {
        let parts = self.program_tasks().flat_map(Task::parts);
        self.breakpoints.left = parts.map(|task| (task.id(), task.line())).collect();
    }
}

fn next_statement(statements: &[u32], line: u32) -> Option<u32> {
    statements.iter().copied().find(|statement| *statement >= line)
}
