//! The check of a program for one controller: errors, warnings, and what its lines and its arm refuse whatever happens.
//!
//! `scol_mini` finds and words the diagnostics and asks here which lines exist and which places the arm reaches. Start with
//! [`Config::check`].

use crate::arm::Arm;
use crate::motion::MotionError;
use crate::options::{Config, UnknownInput};
use crate::prelude::*;
use crate::signals::Signals;
use scol_mini::{Compilation, Request, Robot, check_for};

impl Config {
    /// Checks a program as `ts3100 check` does: for the arm, the options and the taught points of this controller.
    pub fn check(&self, source: &str) -> Compilation {
        let robot = Checked {
            config: self,
            arm: Arm::new(self.model.clone()),
        };
        check_for(source, &self.language(), &self.points, &robot)
    }
}

/// The controller for which a program is checked, with its arm at rest.
struct Checked<'a> {
    config: &'a Config,
    arm: Arm,
}

impl Checked<'_> {
    /// A line of the field bus may be used in the cell even where the options do not say so.
    fn no_output(&self, line: u16) -> Option<String> {
        let exists =
            Signals::is_on_field_bus(line) || Signals::is_user_output(line, self.config.options.field_bus);
        (!exists).then(|| Signals::no_output(line, self.config.options.field_bus))
    }
}

impl Robot for Checked<'_> {
    fn has_input(&self, line: u16) -> bool {
        self.config.options.din_unknown == UnknownInput::Zero || Signals::exists(line)
    }

    fn refusal(&self, request: &Request) -> Option<String> {
        if let Request::Outputs(switches) = request {
            switches.iter().find_map(|(line, _)| self.no_output(*line))
        } else if let Request::Pulse { line, .. } = request {
            self.no_output(*line)
        } else if let Request::Move(motion) = request {
            let error = self.arm.reaches(motion).err()?;
            Some(if let MotionError::Unreachable(reason) = error {
                reason.to_string()
            } else {
                error.to_string()
            })
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests;
