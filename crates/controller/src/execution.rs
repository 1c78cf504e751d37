//! The selected file and what runs of it: automatic operation, and the one statement of DO. How it is
//! carried forward is `run`'s; who may start and stop it is `ops`'.
//!
//! Automatic operation (SU STATUS, SF-06):
//! ```text
//!            RN                     END (cycle mode), RS,PRG, RS,STP, SL
//!   Reset ---------> Running ------------------------------------------> Reset
//!                     ^   |
//!                  RN |   | SP, STOP, step and segment mode, alarm of level 2: the step ends  -> Continue
//!                     +---+ BREAK, servo off, emergency stop, alarm of level 4 or 8: at once  -> Retry
//! ```

use crate::limits::STATEMENTS_PER_SCAN;
use crate::port::Port;
use crate::time::Time;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use scol_mini::{Channel, LanguageOptions, Machine, Memory, Number, Program};
use ts3100_proto::status::ExecutionStatus;

/// Who wanted the program to stop: a host is not told of what it asked for (CMD-SP-09).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// A command of the host.
    Host,
    /// Anything else: panel, signal, alarm, end of the cycle.
    Other,
}

/// Automatic operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// At step 1.
    Reset,
    /// Runs; with a wish, until the present step has ended.
    Running {
        /// Who wants it to stop, if anyone.
        stop: Option<By>,
    },
    /// Stopped inside a step, which is done again.
    Retry,
    /// Stopped between steps.
    Continue,
}

/// What a task is doing.
#[derive(Debug, Clone, PartialEq)]
pub enum Doing {
    /// Nothing: the next statement may run.
    Ready,
    /// The statements of this scan are used up.
    Pausing {
        /// The next scan.
        until: Time,
    },
    /// A motion statement waits for the feed hold to end before it begins.
    Holding,
    /// A motion is under way.
    Moving,
    /// DELAY.
    Delaying {
        /// Its end.
        until: Time,
    },
    /// INPUT waits for values.
    Reading {
        /// Where from.
        channel: Channel,
        /// How many values it takes.
        wanted: usize,
        /// Those it has.
        got: Vec<Number>,
    },
    /// WAIT: its condition was false.
    Watching {
        /// When to look again; `None` when only something from outside can change it.
        again: Option<Time>,
    },
}

/// A machine and what it is doing.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// The interpreter.
    pub machine: Machine,
    /// What it is doing.
    pub doing: Doing,
    /// Statements left in the present scan.
    pub budget: u32,
    /// When the present scan began.
    pub scan_at: Time,
}

impl Task {
    /// A task that stands at its first statement.
    #[must_use]
    pub fn new(machine: Machine, now: Time) -> Task {
        Task {
            machine,
            doing: Doing::Ready,
            budget: STATEMENTS_PER_SCAN,
            scan_at: now,
        }
    }

    /// When the task can go on by itself.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        match &self.doing {
            Doing::Pausing { until } | Doing::Delaying { until } => Some(*until),
            Doing::Watching { again } => *again,
            Doing::Ready | Doing::Holding | Doing::Moving | Doing::Reading { .. } => None,
        }
    }
}

/// The selected file.
#[derive(Debug, Clone, PartialEq)]
pub struct Selected {
    /// Its name.
    pub name: String,
    /// Its text.
    pub source: String,
    /// Its program.
    pub program: Arc<Program>,
    /// Its data.
    pub memory: Memory,
    /// The file was downloaded anew; the next start takes it (CMD-DL-07).
    pub stale: bool,
}

/// The statement of a DO command.
#[derive(Debug, Clone, PartialEq)]
pub struct Direct {
    /// Its machine.
    pub task: Task,
    /// When it was accepted.
    pub since: Time,
    /// It has moved the arm.
    pub moved: bool,
    /// SF shows RUN at least until then; set once the statement is over.
    pub shown_until: Option<Time>,
}

/// Everything that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Execution {
    /// The selected file.
    pub selected: Option<Selected>,
    /// Its main program; there is one exactly while a file is selected.
    pub main: Option<Task>,
    /// Automatic operation.
    pub course: Course,
    /// The statement of DO, while it runs.
    pub direct: Option<Direct>,
    /// A DO statement has ended since the last one began (SM field DC).
    pub direct_done: bool,
    /// The program of DO while no file is selected.
    spare_program: Arc<Program>,
    /// Its data.
    spare_memory: Memory,
}

impl Execution {
    /// No file selected.
    #[must_use]
    pub fn new(language: &LanguageOptions) -> Execution {
        let spare_program = Program::empty(language);
        let spare_memory = Memory::new(&spare_program);
        Execution {
            selected: None,
            main: None,
            course: Course::Reset,
            direct: None,
            direct_done: false,
            spare_program,
            spare_memory,
        }
    }

    /// Whether a program runs in automatic operation.
    #[must_use]
    pub fn program_runs(&self) -> bool {
        matches!(self.course, Course::Running { .. })
    }

    /// The status SU and SF show (SU-12): a DO under way is RUN too (D7).
    #[must_use]
    pub fn status(&self) -> ExecutionStatus {
        match self.course {
            _ if self.direct.is_some() => ExecutionStatus::Running,
            Course::Running { .. } => ExecutionStatus::Running,
            Course::Reset => ExecutionStatus::Reset,
            Course::Retry => ExecutionStatus::Retry,
            Course::Continue => ExecutionStatus::Continue,
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

    /// Whether an INPUT waits for values from this port.
    #[must_use]
    pub fn reads_from(&self, port: Port) -> bool {
        self.reading()
            .any(|channel| Port::of_channel(channel) == Some(port))
    }

    /// The channels from which an INPUT waits for values.
    pub fn reading(&self) -> impl Iterator<Item = Channel> {
        let tasks = self
            .main
            .iter()
            .chain(self.direct.as_ref().map(|direct| &direct.task));
        tasks.filter_map(|task| match &task.doing {
            Doing::Reading { channel, .. } => Some(*channel),
            _ => None,
        })
    }

    /// When something that runs can go on by itself.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        let program = self
            .main
            .as_ref()
            .filter(|_| self.program_runs())
            .and_then(Task::deadline);
        let direct = self
            .direct
            .as_ref()
            .and_then(|direct| direct.shown_until.or(direct.task.deadline()));
        program.into_iter().chain(direct).min()
    }

    /// Step 1 with the data as the file gives it (RS,PRG, SL).
    pub fn initialise(&mut self, now: Time) {
        if let Some(selected) = &mut self.selected {
            selected.memory = Memory::new(&selected.program);
        }
        self.rewind(now);
    }

    /// Step 1, data kept (RS,STP, end of a cycle).
    pub fn rewind(&mut self, now: Time) {
        self.course = Course::Reset;
        self.main = self
            .selected
            .as_ref()
            .map(|selected| Task::new(Machine::main(Arc::clone(&selected.program)), now));
    }
}
