//! Actions: what the control interface, a scenario or a test does to the controller itself.
//!
//! An action that has no effect is answered by an [`ActionError`]. `crate::input` lists everything else that can happen.

use crate::alarm::ALARMS;
use crate::drive::DriveError;
use crate::endpoint::session::Outcome;
use crate::executor::selection::SelectError;
use crate::faults::FaultAction;
use crate::input::{Input, PanelAction};
use crate::io::signals::Signals;
use crate::robot::Robot;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::time::Duration;
use scol_mini::{AccessError, ValueKind};
use thiserror::Error;
use ts3100_proto::command::{Number, VariableKind, VariableWrite};
use ts3100_proto::name::{FileName, VariableName};
use ts3100_proto::status::ExecutionStatus;

/// Something done to the controller by one who holds it.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Something at the panel; what has no effect there is refused here.
    Panel(PanelAction),
    /// Feed hold is on from now, or off.
    FeedHold(bool),
    /// Power off: nothing answers until it comes on again.
    PowerOff,
    /// Power on.
    PowerOn,
    /// An alarm of the table is raised, with all that its level brings about.
    RaiseAlarm {
        /// `level-code`, for example `2-046`.
        number: String,
        /// What stands behind its text; may be empty.
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
    /// A forced line shows again what drives it.
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
        /// Its name.
        name: String,
        /// It is written into the file of the RAM drive too.
        restore: bool,
    },
    /// A file is put on the RAM drive, whole.
    PutFile {
        /// Its name.
        name: String,
        /// Its content without EOF.
        content: Vec<u8>,
    },
    /// A file is erased, as ER does.
    EraseFile {
        /// Its name.
        name: String,
    },
    /// A file is selected, as SL does.
    Select {
        /// Its name.
        name: String,
    },
    /// Faults are armed and disarmed.
    Fault(FaultAction),
}

impl From<FaultAction> for Input {
    fn from(order: FaultAction) -> Input {
        Input::Action(Action::Fault(order))
    }
}

/// Which way a line leads, seen from the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum IoKind {
    /// Din.
    Input,
    /// Dout.
    Output,
}

/// Why a action had no effect.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}: {found} ({expected} expected)")]
pub struct ActionError {
    /// Whether the thing is missing or only in the wrong state.
    pub kind: ActionErrorKind,
    /// What would have been taken.
    pub expected: String,
    /// What was there.
    pub found: String,
    /// Where: the line, the variable, the file, the switch.
    pub place: String,
}
/// What became of an input that was not refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accepted {
    /// It has had its effect.
    Done,
    /// A file it changes is to be persisted first ([`Output::Persist`](crate::Output::Persist)).
    Pending,
}

/// What kind of refusal it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionErrorKind {
    /// There is no such line, variable, file, alarm.
    Missing,
    /// The state of the controller forbids it, or the value does not fit.
    Conflict,
    /// The change of a file cannot be kept outside of the controller.
    NotPersisted,
}

impl ActionError {
    pub(crate) fn missing(place: &str, expected: &str, found: impl Into<String>) -> ActionError {
        let (expected, found, place) = (expected.to_string(), found.into(), place.to_string());
        ActionError {
            kind: ActionErrorKind::Missing,
            expected,
            found,
            place,
        }
    }

    pub(crate) fn conflict(place: &str, expected: &str, found: impl Into<String>) -> ActionError {
        ActionError {
            kind: ActionErrorKind::Conflict,
            ..ActionError::missing(place, expected, found)
        }
    }
}

impl Robot {
    /// Does what concerns the robot alone.
    ///
    /// # Errors
    /// Why it had no effect.
    pub(crate) fn act(&mut self, action: Action) -> Result<(), ActionError> {
        match action {
            // The controller routes these before.
            Action::Panel(_) | Action::PowerOff | Action::PowerOn | Action::Fault(_) => Ok(()),
            Action::FeedHold(on) => {
                if self.state.feed_hold != on {
                    self.feed_hold();
                }
                Ok(())
            }
            Action::RaiseAlarm { number, detail } => {
                let row = ALARMS.iter().find(|row| row.number() == number).copied();
                let row =
                    row.ok_or_else(|| ActionError::missing("alarm", "a number of the alarm table", number))?;
                self.raise(row, detail);
                Ok(())
            }
            Action::Pulse {
                side,
                line,
                on,
                length,
            } => self.pulse(side, line, on, length),
            Action::SetOutput { line, on } => {
                let range = "a user output, 1-64, 101-164 or 201-208";
                if !Signals::is_user_output(line) {
                    return Err(ActionError::missing("output", range, line.to_string()));
                }
                self.signals.set_output(line, on);
                Ok(())
            }
            Action::Force { side, line, on } => self.force(side, line, Some(on)),
            Action::Release { side, line } => self.force(side, line, None),
            Action::SetVariable {
                name,
                values,
                restore,
            } => self.set_variable(&name, values, restore),
            Action::Teach { name, restore } => self.teach(&name, restore),
            Action::PutFile { name, content } => self.put(&name, &content),
            Action::EraseFile { name } => self.erase(&name),
            Action::Select { name } => self.select_by_name(&name),
        }
    }

    fn pulse(&mut self, side: IoKind, line: u16, on: bool, length: Duration) -> Result<(), ActionError> {
        if !Signals::exists(line) {
            return Err(no_line(side, line));
        }
        let until = self.now + length;
        match side {
            IoKind::Input => {
                self.drive_input(line, on);
                self.signals.schedule_input(line, until, !on);
            }
            IoKind::Output => {
                if !Signals::is_user_output(line) || !on {
                    let expected = "a pulse to on of a user output, 1-64, 101-164 or 201-208";
                    let found = format!("{line} to {}", if on { "on" } else { "off" });
                    return Err(ActionError::conflict("output", expected, found));
                }
                self.signals.pulse_output(line, until);
            }
        }
        Ok(())
    }

    fn force(&mut self, side: IoKind, line: u16, state: Option<bool>) -> Result<(), ActionError> {
        let was = self.signals.input(line);
        if !self.signals.force(side, line, state) {
            return Err(no_line(side, line));
        }
        if side == IoKind::Input {
            self.input_is_now(line, was);
        }
        Ok(())
    }

    fn set_variable(&mut self, name: &str, values: Vec<Number>, restore: bool) -> Result<(), ActionError> {
        let variable = self.variable_name(name)?;
        let write = VariableWrite {
            restore,
            variable,
            kind: VariableKind::Unclarified,
            values,
        };
        self.write_variable(&write, None)
            .map_err(|reason| ActionError::conflict(name, "a value that fits", reason))
    }

    /// The name of a variable that exists.
    fn variable_name(&self, name: &str) -> Result<VariableName, ActionError> {
        let variable = VariableName::parse(name)
            .map_err(|error| ActionError::missing(name, "the name of a variable", error.to_string()))?;
        let selected = self.executor.selected.as_ref();
        let selected = selected.ok_or_else(|| ActionError::conflict(name, "a selected file", "none"))?;
        match selected
            .memory
            .global(&selected.program, &variable.name, &variable.subscripts)
        {
            Err(
                error @ (AccessError::Unknown(_) | AccessError::NotGlobal(_) | AccessError::Subscript(_)),
            ) => Err(ActionError::missing(
                name,
                "a variable of GLOBAL or DATA",
                error.to_string(),
            )),
            _ => Ok(variable),
        }
    }

    fn teach(&mut self, name: &str, restore: bool) -> Result<(), ActionError> {
        let variable = self.variable_name(name)?;
        let kind = self
            .executor
            .program()
            .variable(&variable.name)
            .and_then(|info| info.kind);
        if let Some(kind) = kind.filter(|kind| *kind != ValueKind::Position) {
            return Err(ActionError::conflict(name, "positional data", kind.description()));
        }
        let position = self.present_position();
        let values = position.listed(self.arm.kind());
        // The configuration stands last and is whole; the others may be written as reals throughout.
        let values = values.into_iter().map(Number::Real).collect();
        self.set_variable(name, values, restore)
    }

    fn put(&mut self, name: &str, content: &[u8]) -> Result<(), ActionError> {
        let name = file_name(name)?;
        let place = name.as_str();
        if self.executor.status() == ExecutionStatus::Running && self.executor.file() == place {
            let found = "a program is running";
            return Err(ActionError::conflict(
                place,
                "another file, or the robot stopped",
                found,
            ));
        }
        self.store(&name, content).map_err(|error| match error {
            DriveError::Name(error) => ActionError::missing(place, "a file name", error.to_string()),
            error => ActionError::conflict(place, "a file the RAM drive takes", error.to_string()),
        })
    }

    fn erase(&mut self, name: &str) -> Result<(), ActionError> {
        let name = file_name(name)?;
        let place = name.as_str();
        if !self.drive.contains(place) {
            return Err(ActionError::missing(
                place,
                "a file of the RAM drive",
                "no such file",
            ));
        }
        match self.op_erase(&name) {
            Outcome::Ng(reason) => Err(ActionError::conflict(place, "a file that can be erased", reason)),
            Outcome::Ok | Outcome::Held | Outcome::File(_) | Outcome::Receive(..) => Ok(()),
        }
    }

    fn select_by_name(&mut self, name: &str) -> Result<(), ActionError> {
        let name = file_name(name)?;
        let place = name.as_str();
        let refused = |error: SelectError| match error {
            SelectError::Name(_) | SelectError::Missing(_) => {
                ActionError::missing(place, "a file of the RAM drive", error.to_string())
            }
            SelectError::Parameter(_) | SelectError::Running | SelectError::Errors { .. } => {
                ActionError::conflict(
                    place,
                    "a program that compiles, the robot stopped",
                    error.to_string(),
                )
            }
        };
        self.select_file(&name).map_err(refused)?;
        self.report_status();
        Ok(())
    }
}

impl Action {
    /// Whether it has no effect while the power is off: what acts from outside works without.
    pub(crate) fn needs_power(&self) -> bool {
        match self {
            Action::PowerOff
            | Action::PowerOn
            | Action::Force { .. }
            | Action::Release { .. }
            | Action::Fault(_) => false,
            Action::Pulse { side, .. } => *side == IoKind::Output,
            Action::Panel(panel) => matches!(
                panel,
                PanelAction::Servo(_)
                    | PanelAction::Start
                    | PanelAction::Stop
                    | PanelAction::FeedHold
                    | PanelAction::AlarmReset
                    | PanelAction::Keys(_)
                    | PanelAction::ControlRight(_)
            ),
            _ => true,
        }
    }
}

pub(crate) fn no_line(side: IoKind, line: u16) -> ActionError {
    let place = match side {
        IoKind::Input => "input",
        IoKind::Output => "output",
    };
    ActionError::missing(place, "1-64, 101-164 or 201-264", line.to_string())
}

fn file_name(name: &str) -> Result<FileName, ActionError> {
    FileName::parse(name).map_err(|error| ActionError::missing(name, "a file name", error.to_string()))
}
