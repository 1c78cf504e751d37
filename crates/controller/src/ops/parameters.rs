//! The parameter files on the RAM drive: made if they are missing, changed value by value, read at power-on.

use crate::alarm;
use crate::drive::DriveError;
use crate::parameters::{ETHERNET_PAR, ParameterError, USER_PAR};
use crate::prelude::*;
use crate::robot::Robot;
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::{Edition, EthernetParameters, ParameterProblem, UserParameters, rewrite};

impl Robot {
    /// Changes one value of a parameter file, comments and order kept. It acts after a power cycle
    /// (PAR-FILE-03). An empty `key` is the first value of the section.
    ///
    /// # Errors
    /// See [`ParameterError`].
    pub(crate) fn set_parameter(
        &mut self,
        file: &str,
        section: &str,
        key: &str,
        value: &str,
    ) -> Result<(), ParameterError> {
        let name = FileName::parse(file)?;
        let content = self.drive.get(name.as_str()).filter(|_| name.is_parameter());
        let content = content.ok_or_else(|| ParameterError::File(name.to_string()))?;
        let content = content.to_vec();
        let changed = rewrite(&content, section, key, value)?;
        let before = self.problems(name.as_str(), &content);
        let problems = self.problems(name.as_str(), &changed);
        if let Some(problem) = problems.into_iter().find(|problem| !before.contains(problem)) {
            return Err(ParameterError::Value(problem));
        }
        Ok(self.store_inside(&name, &changed.into())?)
    }

    /// What is wrong with the content of a parameter file.
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
        let options = &self.config.options;
        let ethernet = EthernetParameters::factory_file(options.open_mode, options.line_end);
        let user = UserParameters::factory_file(options.line_end, self.edition());
        for (name, content) in [(ETHERNET_PAR, ethernet), (USER_PAR, user)] {
            if !self.drive.contains(name) {
                self.store(&FileName::parse(name)?, &content.into())?;
            }
        }
        Ok(())
    }
}
