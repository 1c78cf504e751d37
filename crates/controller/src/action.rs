//! Actions of the control interface, a scenario or a test on the controller itself.
//!
//! An action that has no effect is answered by an [`ActionError`]. `crate::input` lists everything else that can happen;
//! `controller::owner` passes each action to the part that does it.

pub use crate::action_error::{ActionError, ActionErrorKind};
use crate::controls::PanelAction;
use crate::faults::FaultAction;
use crate::inspection::{Assignment, Breakpoint, StepKind};
pub use crate::io::signals::IoKind;
use crate::prelude::*;
use core::time::Duration;
use ts3100_proto::command::Number;
use ts3100_proto::words::Word as _;

/// An action of the owner of a controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// An operation at the panel; one without effect is refused here.
    Panel(PanelAction),
    /// Power off: nothing answers until it comes on again.
    PowerOff,
    /// Power on.
    PowerOn,
    /// Raises an alarm of the table, with all consequences of its level.
    RaiseAlarm {
        /// `level-code`, for example `2-046`.
        number: String,
        /// Shown after its text; may be empty.
        detail: String,
    },
    /// A line is driven for a time and then the other way: an input from outside, an output as a program's PULOUT.
    Pulse {
        /// Input or output.
        side: IoKind,
        /// Its number.
        line: u16,
        /// Its state meanwhile; an output pulse is always on.
        on: bool,
        /// How long, in virtual time.
        length: Duration,
    },
    /// A user output is set, as IW does.
    SetOutput {
        /// Dout number.
        line: u16,
        /// Its state.
        on: bool,
    },
    /// A line shows this state whatever drives it, until it is released.
    Force {
        /// Input or output.
        side: IoKind,
        /// Its number.
        line: u16,
        /// The state.
        on: bool,
    },
    /// A forced line shows its driver again.
    Release {
        /// Input or output.
        side: IoKind,
        /// Its number.
        line: u16,
    },
    /// A variable of GLOBAL or DATA is given a value, as MW does.
    SetVariable {
        /// Its name, with subscripts for an element: `A(1,2)`.
        name: String,
        /// The numbers in the order of MW.
        values: Vec<Number>,
        /// It is written into the file of the RAM drive too.
        restore: bool,
    },
    /// A position of GLOBAL or DATA becomes the present one.
    Teach {
        name: String,
        /// It is written into the file of the RAM drive too.
        restore: bool,
    },
    /// A file is put on the RAM drive, whole.
    PutFile {
        name: String,
        /// Its content without EOF.
        content: Vec<u8>,
    },
    /// A file is erased, as ER does.
    EraseFile { name: String },
    /// A file is selected, as SL does.
    Select { name: String },
    /// The program stops at these breakpoints of the selected file, and at no others.
    Breakpoints(Vec<Breakpoint>),
    /// The program runs until it comes to this line, from 1.
    RunTo(u32),
    /// The program runs until a step of this task ends.
    StepTask { kind: StepKind, task: u16 },
    /// A variable that a call of the stopped program sees is given a value.
    Assign(Assignment),
    /// Faults are armed and disarmed.
    Fault(FaultAction),
}

/// State of an input that was not refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accepted {
    /// It has had its effect.
    Done,
    /// A file that it changes has to be persisted first ([`Output::Persist`](crate::Output::Persist)).
    Pending,
}

impl Action {
    /// The verb phrase of its refusal, after "cannot".
    pub(crate) fn verb(&self) -> String {
        match self {
            Action::Panel(panel) => panel.purpose().1,
            Action::PowerOff => "turn the power off".to_string(),
            Action::PowerOn => "turn the power on".to_string(),
            Action::RaiseAlarm { number, .. } => format!("raise alarm {number}"),
            Action::Pulse { side, line, .. } => format!("give {} {line} a pulse", side.word()),
            Action::SetOutput { line, .. } => format!("set output {line}"),
            Action::Force { side, line, .. } => format!("force {} {line}", side.word()),
            Action::Release { side, line } => format!("release {} {line}", side.word()),
            Action::SetVariable { name, .. } => format!("set {name}"),
            Action::Teach { name, .. } => format!("teach {name}"),
            Action::PutFile { name, .. } => format!("store {name}"),
            Action::EraseFile { name } => format!("erase {name}"),
            Action::Select { name } => format!("select {name}"),
            Action::Breakpoints(_) => "set the breakpoints".to_string(),
            Action::RunTo(line) => format!("run to line {line}"),
            Action::StepTask { task, .. } => format!("step task {task}"),
            Action::Assign(assignment) => format!("set {}", assignment.target()),
            Action::Fault(_) => "change the faults".to_string(),
        }
    }

    /// Whether it has no effect while the power is off. Actions from outside work without power.
    pub(crate) fn needs_power(&self) -> bool {
        if let Action::Panel(panel) = self {
            return panel.needs_power();
        }
        !matches!(
            self,
            Action::PowerOff
                | Action::PowerOn
                | Action::Pulse {
                    side: IoKind::Input,
                    ..
                }
                | Action::Force { .. }
                | Action::Release { .. }
                | Action::Fault(_)
        )
    }
}
