//! The program that is debugged, as the server sees it: it stops at a place, is inspected, and continues.
//!
//! A launched program and a recording are a [`Timeline`](super::Timeline); a running emulator is reached by its control
//! interface.

use serde::Serialize;
use std::fmt::Display;
use std::time::Duration;
use ts3100_controller::Controller;
use ts3100_controller::inspection::{Breakpoint, StepKind};
use ts3100_controller::queries::{TaskStack, VariableView};
use ts3100_controller::signals::Signals;
use ts3100_controller::{Port, Time};

/// The main program.
pub const MAIN_TASK: u16 = 1;

/// Why a request has no effect, in words for the person at the editor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(String);

impl Refusal {
    pub fn new(words: impl Display) -> Refusal {
        Refusal(words.to_string())
    }
}

/// Where the program is to stop next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// At the first statement, or where it is if it has been there.
    Enter,
    /// At a breakpoint.
    Run,
    /// At the next statement of this task.
    Into(u16),
    /// At its next statement that is not in a program called from here.
    Over(u16),
    /// At its next statement after the program it is in has returned.
    Out(u16),
    /// At its next statement after a motion.
    Motion(u16),
    /// At the statement before.
    Back(u16),
    /// At the last breakpoint before.
    RunBack,
}

impl Goal {
    /// The step of a task forward, if it is one.
    pub fn step(self) -> Option<(StepKind, u16)> {
        match self {
            Goal::Into(task) => Some((StepKind::Into, task)),
            Goal::Over(task) => Some((StepKind::Over, task)),
            Goal::Out(task) => Some((StepKind::Out, task)),
            Goal::Motion(task) => Some((StepKind::Motion, task)),
            Goal::Enter | Goal::Run | Goal::Back(_) | Goal::RunBack => None,
        }
    }
}

/// Why the program has stopped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StopReason {
    /// It is where it began.
    Entry,
    /// It has reached the goal of a step.
    Step,
    /// At these breakpoints, by their indices.
    Breakpoints(Vec<usize>),
    /// The condition of a breakpoint has no value; why.
    Fault(String),
    /// An alarm, by its number, with its words.
    Alarm {
        number: String,
        text: String,
    },
    Pause,
    /// Nothing comes after this place by itself; the exit code, and why.
    End {
        code: u8,
        words: String,
    },
}

/// A stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stop {
    pub reason: StopReason,
    /// The task it concerns, 1 the main program.
    pub task: u16,
}

impl Stop {
    /// A stop that concerns the main program, or all of it.
    pub fn of_program(reason: StopReason) -> Stop {
        let task = MAIN_TASK;
        Stop { reason, task }
    }
}

/// Puts each breakpoint at the first line with a statement from its own on, of these lines in ascending order. Returns those
/// that have one and pass the check there, and for each breakpoint its line, or why it is not set.
pub fn placed(
    breakpoints: Vec<Breakpoint>,
    statement_lines: &[u32],
    check: impl Fn(&Breakpoint) -> Result<(), Refusal>,
) -> (Vec<Breakpoint>, Vec<Result<u32, Refusal>>) {
    let mut set = Vec::new();
    let found = breakpoints.into_iter().map(|mut breakpoint| {
        let next = statement_lines.iter().find(|line| **line >= breakpoint.line);
        breakpoint.line = *next.ok_or_else(|| Refusal::new("no statement follows in the file"))?;
        check(&breakpoint)?;
        set.push(breakpoint.clone());
        Ok(breakpoint.line)
    });
    let found = found.collect();
    (set, found)
}

/// How far the program has come.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Progress {
    Going,
    Stopped(Stop),
    /// It is over, with this exit code.
    Ended {
        code: u8,
        words: String,
    },
}

/// Something that the program, or a breakpoint, says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Said {
    /// By a breakpoint in this line, not by the program.
    pub line: Option<u32>,
    pub text: String,
}

/// The program under way.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Source {
    /// Name of the file on the RAM drive.
    pub name: String,
    pub text: String,
}

/// Everything that is shown of a program that has stopped.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// Virtual time since the start.
    pub time: Duration,
    pub tasks: Vec<TaskStack>,
    /// GLOBAL and DATA, then those of the programs as `PROGRAM.NAME`.
    pub variables: Vec<VariableView>,
    /// Lines that are on.
    pub inputs: Vec<u16>,
    pub outputs: Vec<u16>,
    /// Name and unread bytes of each channel.
    pub channels: Vec<(String, Vec<u8>)>,
}

impl Scene {
    /// What a controller shows now.
    pub fn of(controller: &Controller, began: Time) -> Scene {
        let signals = controller.signals();
        let channels = [Port::Com1, Port::Ip1, Port::Ip2];
        let buffers = channels.map(|port| (port.name().to_owned(), controller.port(port).buffer));
        Scene {
            time: controller.now().since(began),
            tasks: controller.stacks(),
            variables: controller.variables(),
            inputs: Signals::numbers().filter(|line| signals.input(*line)).collect(),
            outputs: Signals::numbers().filter(|line| signals.output(*line)).collect(),
            channels: buffers.into(),
        }
    }
}

/// What can be done with a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Abilities {
    /// It goes back.
    pub goes_back: bool,
    /// Its variables can be given values.
    pub assigns: bool,
}

/// A program that is debugged.
pub trait Debuggee: Send {
    fn abilities(&self) -> Abilities;

    /// Reads the selected file again, where somebody else can change it.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn refresh(&mut self) -> Result<(), Refusal> {
        Ok(())
    }

    /// The selected file; empty where none is.
    fn source(&self) -> Source;

    /// The lines of the file on which a statement begins, in ascending order.
    fn statement_lines(&self) -> Vec<u32>;

    /// Sets all breakpoints. Stops name those that have a line by their place among them. Returns the line at which each stops, or why it never does.
    fn set_breakpoints(&mut self, breakpoints: Vec<Breakpoint>) -> Vec<Result<u32, Refusal>>;

    /// Sets whether an alarm stops it.
    fn stop_on_alarm(&mut self, on: bool);

    /// Sets out for a goal; `work` goes there.
    ///
    /// # Errors
    /// Why it cannot continue.
    fn go(&mut self, goal: Goal) -> Result<(), Refusal>;

    /// Runs for a moment, which is short enough for an editor that waits.
    ///
    /// # Errors
    /// The program cannot be reached any more.
    fn work(&mut self) -> Result<Progress, Refusal>;

    /// How long `work` may be put off.
    fn patience(&self) -> Duration {
        Duration::ZERO
    }

    /// Lets it stop where it is.
    fn pause(&mut self);

    /// Looks whether others have started a program that has stopped, or brought it to another place. `None`: neither.
    ///
    /// # Errors
    /// The program cannot be reached any more.
    fn look_again(&mut self) -> Result<Option<Progress>, Refusal> {
        Ok(None)
    }

    /// Takes what was said since the last call.
    fn take_said(&mut self) -> Vec<Said>;

    /// What is shown of it now.
    ///
    /// # Errors
    /// It cannot be reached.
    fn scene(&self) -> Result<Scene, Refusal>;

    /// The value of an expression in this call of a task, as it is shown.
    ///
    /// # Errors
    /// Why it has none.
    fn evaluate(&self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal>;

    /// Carries out an assignment in this call of a task; returns the value that the variable has then.
    ///
    /// # Errors
    /// Why it is refused.
    fn assign(&mut self, task: u16, call: usize, text: &str) -> Result<VariableView, Refusal>;

    /// Leaves it: an emulator that was attached to continues without breakpoints.
    fn release(&mut self);
}
