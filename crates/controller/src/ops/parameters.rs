//! The parameter files on the RAM drive: made if they are missing, read at power-on.

use crate::alarm;
use crate::drive::DriveError;
use crate::parameters::{ETHERNET_PAR, USER_PAR};
use crate::prelude::*;
use crate::robot::Robot;
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::{Edition, EthernetParameters, ParameterProblem, UserParameters};

impl Robot {
    /// Problems of a parameter file with this content.
    pub(crate) fn problems(&self, name: &str, content: &[u8]) -> Vec<ParameterProblem> {
        self.parameters.problems(name, content, self.edition())
    }

    /// Parameters act from now on; called when the power comes on (PAR-FILE-03).
    pub(crate) fn take_parameters(&mut self) {
        let problems = self.parameters.read(&self.drive, self.edition());
        for (file, problem) in problems {
            self.raise(alarm::PARAMETER, format!("{file}: {problem}"));
        }
    }

    /// The edition of the manual that holds for the arm.
    fn edition(&self) -> Edition {
        match self.arm.kind() {
            scol_mini::Arm::SixAxis => Edition::SixAxis,
            scol_mini::Arm::Scara => Edition::Scara,
        }
    }

    pub(crate) fn make_parameter_files(&mut self) -> Result<(), DriveError> {
        let options = &self.context.config.options;
        let ethernet = EthernetParameters::factory_file(options.open_mode, options.line_end);
        let user = UserParameters::factory_file(options.line_end, self.edition());
        for (name, content) in [(ETHERNET_PAR, ethernet), (USER_PAR, user)] {
            if !self.drive.contains(name) {
                self.store_inside(&FileName::parse(name)?, &content.into())?;
            }
        }
        Ok(())
    }
}
