//! Breakpoints of the selected file, the step or line up to which the program runs once, and why it stopped last.
//!
//! The controller of the manual has none: they are for the owner of the emulator. A stop at one is a STOP between two
//! steps, in every operation mode, and hosts are told of it as of any other (CMD-SP-05). A start continues with the
//! current line of each task, even if that line has a breakpoint.

use crate::executor::{Executor, MAIN_TASK, Task};
use crate::inspection::{self, Begun, Breakpoint, Reached, StopReason, Stopped};
use crate::limits::MAX_BREAKPOINTS;
use crate::prelude::*;
use scol_mini::{Inputs, Memory, Program};

/// Up to where the program runs once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Target {
    /// To the end of the step that ends next.
    NextStep,
    /// To the beginning of this line.
    Line(u32),
    /// To the statement at which a step of a task ends.
    Step(TaskStep),
}

/// A step of a task under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskStep {
    target: inspection::Target,
    /// The statement from which it sets out has begun.
    has_begun: bool,
    /// A motion has begun.
    has_moved: bool,
}

/// Where the program stops besides its end.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Breakpoints {
    /// In ascending order of their lines, each with a statement.
    #[serde(rename = "lines")]
    set: Vec<Breakpoint>,
    target: Option<Target>,
    /// The lines from which each task and its handler continued, until one of them has left its line.
    left: Vec<(u16, u32)>,
    /// Why the program stopped, from when the stop is asked for until the next start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stopped: Option<Stopped>,
}

impl Breakpoints {
    /// Whether the program has to be looked at before each statement.
    pub(crate) fn are_set(&self) -> bool {
        !self.set.is_empty() || self.target.is_some()
    }

    /// In ascending order of their lines.
    pub(crate) fn set(&self) -> &[Breakpoint] {
        &self.set
    }

    /// Looks at the statement that a task begins now; whether the program stops before it. `outside` calls belong to the program
    /// that the action of a monitor interrupts; `say` takes the messages.
    pub(crate) fn stops_before(
        &mut self,
        task: &Task,
        outside: usize,
        memory: &mut Memory,
        inputs: &dyn Inputs,
        mut say: impl FnMut(String),
    ) -> bool {
        let machine = task.machine();
        let begun = Begun {
            number: 0,
            task: task.id(),
            line: task.line(),
            depth: outside + machine.depth(),
            is_stop: false,
        };
        let mut stop = self.step_ends(&begun).then_some((StopReason::Step, None));
        if !self.left.contains(&(begun.task, begun.line)) {
            // The task has left its line: a loop that comes back to it stops there.
            self.left.retain(|(left, _)| *left != begun.task);
            for breakpoint in self.set.iter_mut().filter(|set| set.line == begun.line) {
                match breakpoint.reach(machine, memory, inputs) {
                    Reached::No => {}
                    Reached::Says(text) => say(text),
                    Reached::Stop => stop = Some((StopReason::Breakpoint, None)),
                    Reached::Fault(reason) => stop = Some((StopReason::Breakpoint, Some(reason))),
                }
            }
            if stop.is_none() && self.target == Some(Target::Line(begun.line)) {
                stop = Some((StopReason::Step, None));
            }
        }
        if let Some((reason, fault)) = stop {
            self.note_stop(Stopped {
                reason,
                task: begun.task,
                line: None,
                fault,
            });
            return true;
        }
        if let Some(Target::Step(step)) = &mut self.target
            && step.target.task() == Some(begun.task)
        {
            step.has_begun = true;
            step.has_moved |= machine.begins_motion();
        }
        false
    }

    /// Whether the step of a task ends before this statement.
    fn step_ends(&self, begun: &Begun) -> bool {
        matches!(self.target, Some(Target::Step(step))
            if step.has_begun && step.target.is_reached(begun, step.has_moved))
    }

    /// Whether the program stops after the step that has just ended.
    pub(crate) fn stops_after_step(&self) -> bool {
        self.target == Some(Target::NextStep)
    }

    /// The program is to stop: the first reason is the one that counts, but an alarm counts more than another reason.
    fn note_stop(&mut self, stopped: Stopped) {
        let is_alarm = |stopped: &Stopped| stopped.reason == StopReason::Alarm;
        let counts = |before: &Stopped| is_alarm(&stopped) && !is_alarm(before);
        if self.stopped.as_ref().is_none_or(counts) {
            self.stopped = Some(stopped);
        }
    }

    /// The same of a stop that concerns no task but the main program.
    pub(crate) fn note_stop_of_program(&mut self, reason: StopReason) {
        self.note_stop(Stopped {
            reason,
            task: MAIN_TASK,
            line: None,
            fault: None,
        });
    }

    /// The file was replaced: its lines are new ones.
    pub(crate) fn relocate(&mut self, moved: impl Fn(u32) -> u32) {
        let set = core::mem::take(&mut self.set).into_iter();
        self.set = sorted(set.map(|set| Breakpoint {
            line: moved(set.line),
            ..set
        }));
        self.left.iter_mut().for_each(|(_, line)| *line = moved(*line));
        if let Some(Target::Line(line)) = &mut self.target {
            *line = moved(*line);
        }
        let fault = self
            .stopped
            .iter_mut()
            .filter_map(|stopped| stopped.line.as_mut());
        fault.for_each(|line| *line = moved(*line));
    }

    /// Whether a run can have these breakpoints; for a snapshot.
    pub(crate) fn is_valid(&self) -> bool {
        self.set.len() <= MAX_BREAKPOINTS
            && self.set.is_sorted_by_key(|set| set.line)
            && self.set.iter().all(Breakpoint::fits)
            && self.left.len() <= 2 * scol_mini::MAX_TASKS
    }
}

/// Each once, in the order of their lines.
fn sorted(set: impl Iterator<Item = Breakpoint>) -> Vec<Breakpoint> {
    let mut set: Vec<Breakpoint> = set.collect();
    set.sort_by_key(|set| set.line);
    set.dedup();
    set
}

impl Executor {
    /// The breakpoints at their places, each at the first line of this program with a statement from there on. `Err` gives the
    /// line for which there is none. One that was set before a download, and is after the end of the file by now, is left out.
    pub(crate) fn found_breakpoints(
        &self,
        breakpoints: Vec<Breakpoint>,
        program: Option<&Program>,
    ) -> Result<Vec<Breakpoint>, u32> {
        let statements = program.map(Program::statement_lines).unwrap_or_default();
        let before = &self.breakpoints.set;
        let is_set = |line: u32| before.iter().any(|set| set.line == line);
        let found = breakpoints.into_iter().take(MAX_BREAKPOINTS);
        let found = found.map(|set| (next_statement(&statements, set.line), set));
        let found = found.filter(|(found, set)| found.is_some() || !is_set(set.line));
        let found = found.map(|(found, mut set)| {
            set.line = found.ok_or(set.line)?;
            set.resume(before);
            Ok(set)
        });
        found.collect()
    }

    /// Sets these breakpoints, which are at their places, and ends all others.
    pub(crate) fn set_breakpoints(&mut self, found: Vec<Breakpoint>) {
        self.breakpoints.set = sorted(found.into_iter());
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

    /// Lets the program, which starts now, stop where a step of a task ends.
    pub(crate) fn stop_after_step_of_task(&mut self, target: inspection::Target) {
        self.breakpoints.target = Some(Target::Step(TaskStep {
            target,
            has_begun: false,
            has_moved: false,
        }));
    }

    /// Drops the step or line up to which the program was to run, as it has stopped.
    pub(crate) fn drop_target(&mut self) {
        self.breakpoints.target = None;
    }

    /// Whether a task has to be looked at before the statement that it would begin now. A statement of DO has no line of the file.
    pub(crate) fn may_stop_before(&self, task: &Task) -> bool {
        self.breakpoints.are_set() && task.id() >= MAIN_TASK && task.begins_statement()
    }

    /// The running program is to stop for this reason.
    pub(crate) fn note_stop(&mut self, reason: StopReason) {
        if self.program_runs() {
            self.breakpoints.note_stop_of_program(reason);
        }
    }

    /// The running program is to stop for an alarm of this task, of the statement on this file line.
    pub(crate) fn note_alarm(&mut self, task: u16, line: Option<u32>) {
        if self.program_runs() {
            self.breakpoints.note_stop(Stopped {
                reason: StopReason::Alarm,
                task,
                line,
                fault: None,
            });
        }
    }

    /// The alarm that stops the program, from when it is raised until the next start or reset.
    pub(crate) fn alarm_stop(&self) -> Option<&Stopped> {
        let stopped = self.breakpoints.stopped.as_ref();
        stopped.filter(|stopped| stopped.reason == StopReason::Alarm)
    }

    /// Forgets why the program stopped: it starts, or is at its first step.
    pub(crate) fn forget_stop(&mut self) {
        self.breakpoints.stopped = None;
    }

    /// Why the program stopped last, while it has not been started or reset since.
    pub(crate) fn stopped(&self) -> Option<&Stopped> {
        self.breakpoints.stopped.as_ref().filter(|_| !self.program_runs())
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
