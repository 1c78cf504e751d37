//! What the owner of the controller does to the robot without a command: `crate::action`.
//!
//! `endpoint::actions` calls these; a refusal says what would have been taken.

use super::Outcome;
use crate::action::ActionError;
use crate::alarm::ALARMS;
use crate::executor::selection::SelectError;
use crate::io::signals::{IoKind, Signals};
use crate::robot::Robot;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use bytes::Bytes;
use core::time::Duration;
use scol_mini::{AccessError, ValueKind};
use ts3100_proto::command::{Number, VariableKind, VariableWrite};
use ts3100_proto::name::{FileName, VariableName};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::words::Word;

impl Robot {
    /// Raises an alarm of the table by its number.
    pub(crate) fn raise_by_number(&mut self, number: String, detail: String) -> Result<(), ActionError> {
        let row = ALARMS.iter().find(|row| row.number() == number).copied();
        let row = row.ok_or_else(|| ActionError::missing("alarm", "a number of the alarm table", number))?;
        self.raise(row, detail);
        Ok(())
    }

    /// Sets a user output as IW does.
    pub(crate) fn set_user_output(&mut self, line: u16, on: bool) -> Result<(), ActionError> {
        let range = "a user output, 1-64, 101-164 or 201-208";
        if !Signals::is_user_output(line) {
            return Err(ActionError::missing("output", range, line.to_string()));
        }
        self.signals.set_output(line, on);
        Ok(())
    }

    pub(crate) fn pulse_line(
        &mut self,
        side: IoKind,
        line: u16,
        on: bool,
        length: Duration,
    ) -> Result<(), ActionError> {
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

    pub(crate) fn force_line(
        &mut self,
        side: IoKind,
        line: u16,
        state: Option<bool>,
    ) -> Result<(), ActionError> {
        let was = self.signals.input(line);
        if !self.signals.force(side, line, state) {
            return Err(no_line(side, line));
        }
        if side == IoKind::Input {
            self.input_is_now(line, was);
        }
        Ok(())
    }

    pub(crate) fn set_variable(
        &mut self,
        name: &str,
        values: Vec<Number>,
        restore: bool,
    ) -> Result<(), ActionError> {
        let variable = self.variable_name(name)?;
        let write = VariableWrite {
            restore,
            variable,
            kind: VariableKind::Unclarified,
            values,
        };
        self.write_variable(&write, None)
            .map_err(|reason| ActionError::conflict(name, "a value that fits", reason.to_string()))
    }

    /// The name of a variable that exists.
    fn variable_name(&self, name: &str) -> Result<VariableName, ActionError> {
        let variable = VariableName::parse(name)
            .map_err(|error| ActionError::missing(name, "the name of a variable", error.to_string()))?;
        let selected = self.executor.selected();
        selected.ok_or_else(|| ActionError::conflict(name, "a selected file", "none"))?;
        if let Err(
            error @ (AccessError::Unknown(_) | AccessError::NotGlobal(_) | AccessError::Subscript(_)),
        ) = self.executor.global(&variable)
        {
            let expected = "a variable of GLOBAL or DATA";
            return Err(ActionError::missing(name, expected, error.to_string()));
        }
        Ok(variable)
    }

    pub(crate) fn teach(&mut self, name: &str, restore: bool) -> Result<(), ActionError> {
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

    pub(crate) fn put_file(&mut self, name: &str, content: &[u8]) -> Result<(), ActionError> {
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
        self.store(&name, &Bytes::copy_from_slice(content))
            .map_err(|error| ActionError::conflict(place, "a file the RAM drive takes", error.to_string()))
    }

    pub(crate) fn erase_file(&mut self, name: &str) -> Result<(), ActionError> {
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

    pub(crate) fn select_by_name(&mut self, name: &str) -> Result<(), ActionError> {
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

/// There is no such line.
pub(crate) fn no_line(side: IoKind, line: u16) -> ActionError {
    ActionError::missing(side.word(), "1-64, 101-164 or 201-264", line.to_string())
}

fn file_name(name: &str) -> Result<FileName, ActionError> {
    FileName::parse(name).map_err(|error| ActionError::missing(name, "a file name", error.to_string()))
}
