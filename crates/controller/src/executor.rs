//! The selected file, its tasks, and the statement of DO.
//!
//! `run_state` has the states of automatic operation with their diagram, `scheduler` runs the tasks, `requests` serves
//! what they ask for, `run_control` starts and stops. Commands reach it through `ops`.

pub(crate) mod monitors;
#[cfg(feature = "serde")]
mod relink;
pub(crate) mod requests;
pub(crate) mod run_control;
mod run_state;
pub(crate) mod scheduler;
pub(crate) mod scol_inputs;
pub(crate) mod selection;
mod task;
pub(crate) mod tasks;

pub use run_state::{Operation, RunState, Standstill, StopCause};
pub use task::{Task, TaskState};

use crate::port::Port;
use crate::time::Time;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::sync::Arc;
use scol_mini::{Channel, LanguageOptions, MAX_TASKS, Machine, Memory, Program, compile_direct};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::sm::MAX_ENDED;

/// ID of the main program (M-58762 p.2-27).
pub const MAIN_TASK: u16 = 1;

/// The running timer of TIMER.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Stopwatch {
    /// When it was set.
    pub set_at: Time,
    /// To how many seconds.
    pub seconds: f64,
}

impl Stopwatch {
    /// Seconds at `now`.
    #[must_use]
    pub fn read(&self, now: Time) -> f64 {
        self.seconds + now.since(self.set_at).as_secs_f64()
    }
}

/// The selected file.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Selected {
    /// Its name.
    pub name: String,
    /// Its text.
    pub source: String,
    /// Its program.
    #[cfg_attr(feature = "serde", serde(skip, default = "no_program"))]
    pub program: Arc<Program>,
    /// Its data.
    pub memory: Memory,
    /// The file was downloaded anew; the next start takes it (CMD-DL-07).
    pub stale: bool,
}

/// The statement of a DO command.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Direct {
    /// Its text.
    pub statement: String,
    /// Its machine.
    pub task: Task,
    /// When it was accepted.
    pub since: Time,
    /// It has begun something that takes time.
    #[cfg_attr(feature = "serde", serde(default))]
    pub begun: bool,
    /// It has moved the arm.
    pub moved: bool,
    /// It counts as under way until then, and the next DO is refused; set once the statement is over.
    pub shown_until: Option<Time>,
}

/// Everything that runs.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Executor {
    /// The selected file.
    pub selected: Option<Selected>,
    /// Its main program; there is one exactly while a file is selected.
    pub main: Option<Task>,
    /// The tasks it has started, by their IDs.
    pub tasks: BTreeMap<u16, Task>,
    /// Whose turn it is to execute statements.
    pub turn: u16,
    /// ID of the next task.
    pub next_task: u16,
    /// The task that moves the arm: the first that did.
    pub arm_owner: Option<u16>,
    /// Line of the last motion statement that began.
    pub motion_line: u32,
    /// PASS of that motion, in percent; 0 where the arm is to rest at its end.
    pub pass: f64,
    /// The motion is held by PAUSE.
    pub paused: bool,
    /// TIMER.
    pub timer: Stopwatch,
    /// Automatic operation.
    #[cfg_attr(feature = "serde", serde(rename = "course"))]
    pub operation: Operation,
    /// The statement of DO, while it runs.
    pub direct: Option<Direct>,
    /// What older snapshots say instead of `direct_ended`.
    #[cfg(feature = "serde")]
    #[serde(default, skip_serializing)]
    direct_done: serde::de::IgnoredAny,
    /// DO statements that have ended or were cut short since power-on, modulo 10 (SM field DC, hosts 8.1).
    #[cfg_attr(feature = "serde", serde(default))]
    pub direct_ended: u8,
    /// Until then SF, SU and SM show RUN for a DO statement that is over or has failed already (hosts 8.10). Nothing is
    /// refused for it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub run_shown_until: Option<Time>,
    /// The program of DO while no file is selected.
    #[cfg_attr(feature = "serde", serde(skip, default = "no_program"))]
    spare_program: Arc<Program>,
    /// Its data.
    spare_memory: Memory,
}

/// The program of what was read back, until it is compiled again.
#[cfg(feature = "serde")]
fn no_program() -> Arc<Program> {
    Program::empty(&LanguageOptions::default())
}

impl Executor {
    /// No file selected.
    #[must_use]
    pub fn new(language: &LanguageOptions) -> Executor {
        let spare_program = Program::empty(language);
        let spare_memory = Memory::new(&spare_program);
        Executor {
            selected: None,
            main: None,
            tasks: BTreeMap::new(),
            turn: MAIN_TASK,
            next_task: MAIN_TASK + 1,
            arm_owner: None,
            motion_line: 0,
            pass: 0.0,
            paused: false,
            timer: Stopwatch::default(),
            operation: Operation::RESET,
            direct: None,
            #[cfg(feature = "serde")]
            direct_done: serde::de::IgnoredAny,
            direct_ended: 0,
            run_shown_until: None,
            spare_program,
            spare_memory,
        }
    }

    /// Whether a program runs in automatic operation.
    #[must_use]
    pub fn program_runs(&self) -> bool {
        self.operation.is_running()
    }

    /// The status SU, SF and SM show (SU-12): RUN for at least `do.min_run` after every DO (D7).
    #[must_use]
    pub fn shown_status(&self) -> ExecutionStatus {
        match self.run_shown_until {
            Some(_) => ExecutionStatus::Running,
            None => self.status(),
        }
    }

    /// The status that decides what is permitted: a DO under way is RUN too (D7).
    #[must_use]
    pub fn status(&self) -> ExecutionStatus {
        match self.operation.state() {
            _ if self.direct.is_some() => ExecutionStatus::Running,
            RunState::Running { .. } => ExecutionStatus::Running,
            RunState::Reset => ExecutionStatus::Reset,
            RunState::Retry => ExecutionStatus::Retry,
            RunState::Continue => ExecutionStatus::Continue,
        }
    }

    /// The program whose names a DO statement sees.
    #[must_use]
    pub fn program(&self) -> &Arc<Program> {
        self.selected
            .as_ref()
            .map_or(&self.spare_program, |selected| &selected.program)
    }

    /// The data of that program.
    #[must_use]
    pub fn memory(&self) -> &Memory {
        self.selected
            .as_ref()
            .map_or(&self.spare_memory, |selected| &selected.memory)
    }

    /// The data of that program, to be changed.
    pub fn memory_mut(&mut self) -> &mut Memory {
        match &mut self.selected {
            Some(selected) => &mut selected.memory,
            None => &mut self.spare_memory,
        }
    }

    /// The selected file has been written anew with another initial value: what runs of it goes on in there, so that
    /// its lines are those of the file (SF-24).
    pub fn replace_program(&mut self, program: Arc<Program>) {
        let tasks = self.main.iter_mut().chain(self.tasks.values_mut());
        for task in tasks {
            task.machine.relocate(&program);
            if let Some(handler) = &mut task.handler {
                handler.machine.relocate(&program);
            }
            if self.arm_owner == Some(task.id()) && matches!(task.acting().doing, TaskState::Moving { .. }) {
                self.motion_line = task.acting().machine.line();
            }
        }
        if let Some(direct) = &mut self.direct
            && let Ok(program) = compile_direct(&direct.statement, &program)
        {
            direct.task.machine.relocate(&program);
        }
        if let Some(selected) = &mut self.selected {
            selected.memory.relocate(&program);
            selected.program = program;
        }
    }

    /// Name of the selected file, empty if none.
    #[must_use]
    pub fn file(&self) -> &str {
        self.selected
            .as_ref()
            .map_or("", |selected| selected.name.as_str())
    }

    /// File line at which the program stands; 0 when no file is selected (SF-24).
    #[must_use]
    pub fn line(&self) -> u32 {
        self.main.as_ref().map_or(0, |task| task.machine.line())
    }

    /// The main program and the tasks it has started.
    pub fn program_tasks(&self) -> impl Iterator<Item = &Task> {
        self.main.iter().chain(self.tasks.values())
    }

    /// The IDs of all tasks, that whose turn it is first.
    pub fn order(&self) -> impl Iterator<Item = u16> + use<> {
        let mut ids = [0; MAX_TASKS];
        let (mut count, mut first) = (0, 0);
        for (place, task) in ids.iter_mut().zip(self.program_tasks()) {
            *place = task.id();
            count += 1;
            first += usize::from(*place < self.turn);
        }
        (first..count)
            .chain(0..first)
            .filter_map(move |at| ids.get(at).copied())
    }

    /// A task by its ID.
    #[must_use]
    pub fn task(&self, id: u16) -> Option<&Task> {
        if id == MAIN_TASK {
            self.main.as_ref()
        } else {
            self.tasks.get(&id)
        }
    }

    /// Takes a task out, to work with it.
    pub fn take_task(&mut self, id: u16) -> Option<Task> {
        if id == MAIN_TASK {
            self.main.take()
        } else {
            self.tasks.remove(&id)
        }
    }

    /// Puts a task back.
    pub fn put_task(&mut self, task: Task) {
        match task.id() {
            MAIN_TASK => self.main = Some(task),
            id => {
                self.tasks.insert(id, task);
            }
        }
    }

    /// The tasks end, the main program apart; it counts them from the beginning again.
    pub fn drop_tasks(&mut self) {
        self.tasks.clear();
        if let Some(selected) = &mut self.selected {
            selected.memory.drop_tasks(&selected.program);
        }
        self.turn = MAIN_TASK;
        self.next_task = MAIN_TASK + 1;
        self.arm_owner = None;
    }

    /// What waits for a motion that is no more is to begin anew.
    pub fn redo_motions(&mut self) {
        let again = |doing: &mut TaskState| {
            if doing.is_motion() {
                *doing = TaskState::Ready;
            }
        };
        for task in self.main.iter_mut().chain(self.tasks.values_mut()) {
            again(&mut task.doing);
            if let Some(handler) = &mut task.handler {
                again(&mut handler.doing);
            }
        }
    }

    /// A task other than the main program has ended.
    pub fn drop_task(&mut self, id: u16) {
        self.tasks.remove(&id);
        if let Some(selected) = &mut self.selected {
            selected.memory.drop_task(&selected.program, id);
        }
    }

    /// Line and task of the statement that is executed: of the motion, while one is under way (SF-24).
    #[must_use]
    pub fn executed(&self, moving: bool) -> (u32, u16) {
        match self.arm_owner {
            Some(owner) if moving && self.program_runs() => (self.motion_line, owner),
            _ => (self.line(), if self.main.is_some() { MAIN_TASK } else { 0 }),
        }
    }

    /// Line and task of the statement that is analysed: a MOVE behind a MOVE is read before its time (SF-24).
    #[must_use]
    pub fn analysed(&self) -> (u32, u16) {
        let turn = self.tasks.get(&self.turn).or(self.main.as_ref());
        turn.map_or((0, 0), |task| {
            let line = task.machine.line();
            let ahead = match task.doing {
                TaskState::Moving { .. } if self.program_runs() => task.machine.motion_ahead(),
                _ => None,
            };
            (ahead.unwrap_or(line), task.id())
        })
    }

    /// Whether an INPUT waits for values from this port.
    #[must_use]
    pub fn reads_from(&self, port: Port) -> bool {
        self.reading()
            .any(|channel| Port::from_channel(channel) == Some(port))
    }

    /// The channels from which an INPUT waits for values.
    pub fn reading(&self) -> impl Iterator<Item = Channel> {
        let tasks = self
            .program_tasks()
            .chain(self.direct.as_ref().map(|direct| &direct.task));
        tasks.flat_map(Task::parts).filter_map(|task| match &task.doing {
            TaskState::Reading { channel, .. } => Some(*channel),
            _ => None,
        })
    }

    /// When something that runs can go on by itself.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        let runs = self.program_runs();
        let stopping = matches!(self.operation.state(), RunState::Running { stop: Some(_) });
        let program = self
            .program_tasks()
            .filter(|_| runs)
            .filter_map(|task| task.deadline(stopping))
            .min();
        let direct = self
            .direct
            .as_ref()
            .and_then(|direct| direct.shown_until.or(direct.task.deadline(false)));
        program
            .into_iter()
            .chain(direct)
            .chain(self.run_shown_until)
            .min()
    }

    /// A DO statement that was under way has ended: a host that waits for it sees the count change (hosts 8.1).
    pub fn count_direct(&mut self) {
        self.direct_ended = (self.direct_ended + 1) % (MAX_ENDED + 1);
    }

    /// Step 1 with the data as the file gives it (RS,PRG).
    pub fn initialise(&mut self, now: Time) {
        if let Some(selected) = &mut self.selected {
            selected.memory.start_anew(&selected.program);
        }
        self.rewind(now);
    }

    /// Step 1, data kept (RS,STP, end of a cycle).
    pub fn rewind(&mut self, now: Time) {
        self.operation.stand(Standstill::FirstStep);
        self.run_shown_until = None;
        self.drop_tasks();
        self.main = self
            .selected
            .as_ref()
            .map(|selected| Task::new(Machine::main(Arc::clone(&selected.program)), now));
    }
}
