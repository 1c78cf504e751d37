//! An executor that was read back from a snapshot gets its programs, compiled again from their sources, and is
//! validated: an impossible state is refused.

use super::selection::render;
use super::{Direct, Executor, MAIN_TASK, Selected, Task};
use crate::options::Config;
use crate::snapshot_error::{SnapshotError, check};
use alloc::sync::Arc;
use scol_mini::{MAX_TASKS, Program, compile_direct};
use ts3100_proto::name::FileName;
use ts3100_proto::status::sm::MAX_ENDED;

impl Executor {
    pub(crate) fn relink(&mut self, config: &Config) -> Result<(), SnapshotError> {
        self.spare_program = Program::empty(&config.language());
        self.spare_memory
            .relink(&self.spare_program)
            .map_err(|reason| SnapshotError::program("executor.spare_memory", reason))?;
        if let Some(selected) = &mut self.selected {
            selected.relink(config)?;
        }
        let program = Arc::clone(self.program());
        if let Some(main) = &mut self.main {
            main.relink("executor.main", &program)?;
        }
        for (id, task) in &mut self.tasks {
            let place = format!("executor.tasks.{id}");
            task.relink(&place, &program)?;
            let fits = task.id() == *id && *id > MAIN_TASK;
            check(fits, &place, "the task of that number", task.id())?;
        }
        if let Some(direct) = &mut self.direct {
            direct.relink(&program)?;
        }
        self.validate()
    }

    fn validate(&self) -> Result<(), SnapshotError> {
        let word = |is: bool| if is { "one" } else { "none" };
        let (selected, runs) = (self.selected.is_some(), self.program_runs());
        let (place, there) = ("executor.main", self.main.is_some());
        let expected = "a main program exactly while a file is selected";
        check(there == selected, place, expected, word(there))?;
        let main = self.main.as_ref().map_or(MAIN_TASK, Task::id);
        check(main == MAIN_TASK, place, "task 1", format!("task {main}"))?;
        let (place, count) = ("executor.tasks", self.tasks.len());
        let expected = format!("fewer than {MAX_TASKS} tasks of a selected file");
        let fits = count < MAX_TASKS && (count == 0 || selected);
        check(fits, place, &expected, count)?;
        let (place, expected) = ("executor.breakpoints", "breakpoints within their bounds");
        check(self.breakpoints.is_valid(), place, expected, "more")?;
        let last = self.tasks.keys().next_back().copied().unwrap_or_default();
        let (place, next) = ("executor.next_task", self.next_task);
        check(next >= last, place, &format!("more than {last}"), next)?;
        check(next > MAIN_TASK, place, "2 or more", next)?;
        let (place, expected) = ("executor.operation", "no operation without a file");
        let state = format!("{:?}", self.operation.state());
        check(selected || !runs, place, expected, state)?;
        let (place, expected) = ("executor.direct", "none while a program runs");
        check(self.direct.is_none() || !runs, place, expected, "one")?;
        let (place, ended) = ("executor.direct_ended", self.direct_ended);
        check(ended <= MAX_ENDED, place, &format!("at most {MAX_ENDED}"), ended)?;
        let percent = (0.0..=100.0).contains(&self.pass);
        check(percent, "executor.pass", "0 to 100 percent", self.pass)?;
        let (place, seconds) = ("executor.timer.seconds", self.timer.seconds);
        check(seconds.is_finite(), place, "a number", seconds)
    }
}

impl Selected {
    fn relink(&mut self, config: &Config) -> Result<(), SnapshotError> {
        let name = FileName::parse(&self.name).ok();
        let fits = name.is_some_and(|name| name.as_str() == self.name && !name.is_parameter());
        let expected = "the name of a user file, in upper case";
        check(fits, "executor.selected.name", expected, &self.name)?;
        let compilation = config.compile(&self.source);
        self.program = compilation.program.ok_or_else(|| {
            let found = render(compilation.diagnostics.iter().take(1), &self.source, &self.name);
            SnapshotError::value("executor.selected.source", "a program that compiles", found)
        })?;
        self.memory
            .relink(&self.program)
            .map_err(|reason| SnapshotError::program("executor.selected.memory", reason))
    }
}

impl Direct {
    fn relink(&mut self, program: &Program) -> Result<(), SnapshotError> {
        let place = "executor.direct.task";
        let program = compile_direct(&self.statement, program).map_err(|diagnostics| {
            let found = render(diagnostics.iter().take(1), &self.statement, "DO");
            let expected = "a statement that can be executed";
            SnapshotError::value("executor.direct.statement", expected, found)
        })?;
        self.task.relink(place, &program)?;
        let (id, alone) = (self.task.id(), self.task.parts().count() == 1);
        let expected = "task 0 without a handler";
        check(id == 0 && alone, place, expected, format!("task {id}"))
    }
}
