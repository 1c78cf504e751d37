//! The executor in a snapshot: a task is the state of its machine and what it waits for, a program is its source.
//!
//! The `Saved*` types mirror those of `crate::executor`, which hold compiled programs.

use super::SnapshotError;
use crate::executor::{
    Direct, Executor, MAIN_TASK, Operation, RunState, Selected, Stopwatch, Task, TaskState,
};
use crate::limits::STATEMENTS_PER_SCAN;
use crate::options::Config;
use crate::time::Time;
use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::sync::Arc;
use scol_mini::{MAX_TASKS, Machine, MachineState, Memory, MemoryState, Program, compile_direct};
use ts3100_proto::status::sm::MAX_ENDED;

/// A [`Task`].
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedTask {
    machine: MachineState,
    doing: TaskState,
    budget: u32,
    scan_at: Time,
    handler: Option<Box<SavedTask>>,
    look_at: Option<Time>,
}

/// A [`Selected`] file.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedSelection {
    name: String,
    source: String,
    memory: MemoryState,
    stale: bool,
}

/// A [`Direct`] statement.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedDirect {
    statement: String,
    task: SavedTask,
    since: Time,
    #[serde(default)]
    begun: bool,
    moved: bool,
    shown_until: Option<Time>,
}

/// An [`Execution`].
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SavedExecution {
    selected: Option<SavedSelection>,
    main: Option<SavedTask>,
    tasks: BTreeMap<u16, SavedTask>,
    turn: u16,
    next_task: u16,
    arm_owner: Option<u16>,
    motion_line: u32,
    pass: f64,
    paused: bool,
    timer: Stopwatch,
    course: RunState,
    direct: Option<SavedDirect>,
    /// What older snapshots say instead of `direct_ended`; not needed.
    #[serde(default, skip_serializing)]
    direct_done: Option<bool>,
    #[serde(default)]
    direct_ended: u8,
    #[serde(default)]
    run_shown_until: Option<Time>,
    /// The data of DO while no file is selected.
    spare_memory: MemoryState,
}

impl SavedTask {
    fn new(task: &Task) -> SavedTask {
        SavedTask {
            machine: task.machine.state(),
            doing: task.doing.clone(),
            budget: task.budget,
            scan_at: task.scan_at,
            handler: task.handler.as_deref().map(SavedTask::new).map(Box::new),
            look_at: task.look_at,
        }
    }

    fn restore(self, place: &str, program: &Arc<Program>) -> Result<Task, SnapshotError> {
        let machine = Machine::restore(Arc::clone(program), self.machine)
            .map_err(|reason| SnapshotError::program(&format!("{place}.machine"), reason))?;
        let handler = match self.handler {
            Some(handler) if handler.handler.is_some() => {
                let place = format!("{place}.handler.handler");
                return Err(SnapshotError::value(&place, "none: a handler has none", "one"));
            }
            Some(handler) => Some(Box::new(handler.restore(&format!("{place}.handler"), program)?)),
            None => None,
        };
        let task = Task {
            machine,
            doing: self.doing,
            budget: self.budget,
            scan_at: self.scan_at,
            handler,
            look_at: self.look_at,
        };
        check_task(&task, place)?;
        Ok(task)
    }
}

fn check_task(task: &Task, place: &str) -> Result<(), SnapshotError> {
    if task.budget > STATEMENTS_PER_SCAN {
        let expected = format!("at most {STATEMENTS_PER_SCAN}");
        return Err(SnapshotError::value(
            &format!("{place}.budget"),
            &expected,
            task.budget,
        ));
    }
    let doing = format!("{place}.doing");
    let pending = task.machine.pending().is_some();
    let asks = match &task.doing {
        TaskState::Ready | TaskState::Pausing { .. } | TaskState::Watching { .. } => return Ok(()),
        TaskState::Reading { wanted, got, .. } => {
            if got.len() > *wanted {
                let expected = format!("at most {wanted} values");
                return Err(SnapshotError::value(&doing, &expected, got.len()));
            }
            pending
        }
        TaskState::Resting => return Ok(()),
        TaskState::Holding
        | TaskState::Moving { .. }
        | TaskState::Queued { .. }
        | TaskState::Delaying { .. } => pending,
    };
    if asks {
        return Ok(());
    }
    Err(SnapshotError::value(
        &doing,
        "a statement that waits for its answer",
        "none",
    ))
}

impl SavedSelection {
    fn new(selected: &Selected) -> SavedSelection {
        SavedSelection {
            name: selected.name.clone(),
            source: selected.source.clone(),
            memory: selected.memory.state(&selected.program),
            stale: selected.stale,
        }
    }

    fn restore(self, config: &Config) -> Result<Selected, SnapshotError> {
        let name = ts3100_proto::name::FileName::parse(&self.name).ok();
        if !name.is_some_and(|name| name.as_str() == self.name && !name.is_parameter()) {
            return Err(SnapshotError::value(
                "execution.selected.name",
                "the name of a user file, in upper case",
                &self.name,
            ));
        }
        let compilation = config.compile(&self.source);
        let Some(program) = compilation.program else {
            let errors = compilation.diagnostics.first();
            let found = errors.map_or_else(String::new, |error| error.render(&self.source, &self.name));
            return Err(SnapshotError::value(
                "execution.selected.source",
                "a program that compiles",
                found,
            ));
        };
        let memory = Memory::restore(&program, self.memory)
            .map_err(|reason| SnapshotError::program("execution.selected.memory", reason))?;
        Ok(Selected {
            name: self.name,
            source: self.source,
            program,
            memory,
            stale: self.stale,
        })
    }
}

impl SavedDirect {
    fn new(direct: &Direct) -> SavedDirect {
        SavedDirect {
            statement: direct.statement.clone(),
            task: SavedTask::new(&direct.task),
            since: direct.since,
            begun: direct.begun,
            moved: direct.moved,
            shown_until: direct.shown_until,
        }
    }

    fn restore(self, program: &Program) -> Result<Direct, SnapshotError> {
        let program = compile_direct(&self.statement, program).map_err(|diagnostics| {
            let first = diagnostics.first();
            let found = first.map_or_else(String::new, |error| error.render(&self.statement, "DO"));
            SnapshotError::value(
                "execution.direct.statement",
                "a statement that can be executed",
                found,
            )
        })?;
        let task = self.task.restore("execution.direct.task", &program)?;
        if task.id() != 0 || task.handler.is_some() {
            let found = format!("task {}", task.id());
            return Err(SnapshotError::value(
                "execution.direct.task",
                "task 0 without a handler",
                found,
            ));
        }
        Ok(Direct {
            statement: self.statement,
            task,
            since: self.since,
            begun: self.begun,
            moved: self.moved,
            shown_until: self.shown_until,
        })
    }
}

impl SavedExecution {
    pub(super) fn new(execution: &Executor) -> SavedExecution {
        let tasks = execution.tasks.iter();
        SavedExecution {
            selected: execution.selected.as_ref().map(SavedSelection::new),
            main: execution.main.as_ref().map(SavedTask::new),
            tasks: tasks.map(|(id, task)| (*id, SavedTask::new(task))).collect(),
            turn: execution.turn,
            next_task: execution.next_task,
            arm_owner: execution.arm_owner,
            motion_line: execution.motion_line,
            pass: execution.pass,
            paused: execution.paused,
            timer: execution.timer,
            course: execution.operation.state(),
            direct: execution.direct.as_ref().map(SavedDirect::new),
            direct_done: None,
            direct_ended: execution.direct_ended,
            run_shown_until: execution.run_shown_until,
            spare_memory: execution.spare_state(),
        }
    }

    pub(super) fn restore(self, config: &Config) -> Result<Executor, SnapshotError> {
        let mut execution = Executor::new(&config.language());
        execution
            .restore_spare(self.spare_memory)
            .map_err(|reason| SnapshotError::program("execution.spare_memory", reason))?;
        execution.selected = self
            .selected
            .map(|selected| selected.restore(config))
            .transpose()?;
        let program = Arc::clone(execution.program());
        let main = self.main.map(|task| task.restore("execution.main", &program));
        execution.main = main.transpose()?;
        for (id, task) in self.tasks {
            let place = format!("execution.tasks.{id}");
            let task = task.restore(&place, &program)?;
            if task.id() != id || id <= MAIN_TASK {
                return Err(SnapshotError::value(&place, "the task of that number", task.id()));
            }
            execution.tasks.insert(id, task);
        }
        execution.direct = self.direct.map(|direct| direct.restore(&program)).transpose()?;
        execution.turn = self.turn;
        execution.next_task = self.next_task;
        execution.arm_owner = self.arm_owner;
        execution.motion_line = self.motion_line;
        execution.pass = self.pass;
        execution.paused = self.paused;
        execution.timer = self.timer;
        execution.operation = Operation::restored(self.course);
        execution.direct_ended = self.direct_ended;
        execution.run_shown_until = self.run_shown_until;
        validate(&execution)?;
        Ok(execution)
    }
}

fn validate(execution: &Executor) -> Result<(), SnapshotError> {
    let fail = |place: &str, expected: &str, found: String| {
        Err(SnapshotError::value(
            &format!("execution.{place}"),
            expected,
            found,
        ))
    };
    let word = |is: bool| if is { "one" } else { "none" }.to_string();
    let selected = execution.selected.is_some();
    if execution.main.is_some() != selected {
        let found = word(execution.main.is_some());
        return fail("main", "a main program exactly while a file is selected", found);
    }
    if let Some(main) = execution.main.as_ref().filter(|main| main.id() != MAIN_TASK) {
        return fail("main", "task 1", format!("task {}", main.id()));
    }
    let count = execution.tasks.len();
    if count >= MAX_TASKS || (count > 0 && !selected) {
        let expected = format!("fewer than {MAX_TASKS} tasks of a selected file");
        return fail("tasks", &expected, count.to_string());
    }
    if let Some(last) = execution.tasks.keys().next_back().copied()
        && execution.next_task < last
    {
        return fail(
            "next_task",
            &format!("more than {last}"),
            execution.next_task.to_string(),
        );
    }
    if execution.next_task <= MAIN_TASK {
        return fail("next_task", "2 or more", execution.next_task.to_string());
    }
    if execution.program_runs() && !selected {
        return fail(
            "course",
            "no operation without a file",
            format!("{:?}", execution.operation.state()),
        );
    }
    if execution.program_runs() && execution.direct.is_some() {
        return fail("direct", "none while a program runs", word(true));
    }
    if execution.direct_ended > MAX_ENDED {
        let expected = format!("at most {MAX_ENDED}");
        return fail("direct_ended", &expected, execution.direct_ended.to_string());
    }
    if !(0.0..=100.0).contains(&execution.pass) {
        return fail("pass", "0 to 100 percent", execution.pass.to_string());
    }
    if !execution.timer.seconds.is_finite() {
        return fail("timer.seconds", "a number", execution.timer.seconds.to_string());
    }
    Ok(())
}
