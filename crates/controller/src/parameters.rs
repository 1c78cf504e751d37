//! The parameter files of the RAM drive: created if missing, read at power-on, changed value by value.
//!
//! `ts3100_proto::parameter` parses and writes them; the emulator applies the settings to its links.

use crate::drive::DriveError;
use crate::network::NetworkConfig;
use crate::robot::Robot;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use thiserror::Error;
use ts3100_proto::name::{FileName, NameError};
use ts3100_proto::parameter::{
    Edition, EthernetParameters, ParameterProblem, RewriteError, UserParameters, rewrite,
};

/// Name of the Ethernet parameter file.
const ETHERNET_PAR: &str = "ETHERNET.PAR";
/// Name of the user parameter file.
const USER_PAR: &str = "USER.PAR";

/// Why a parameter was not changed; the file is as before.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ParameterError {
    /// Not a parameter file.
    #[error("USER.PAR or ETHERNET.PAR expected, {0} found")]
    File(String),
    /// The value cannot be put into the file.
    #[error(transparent)]
    Rewrite(#[from] RewriteError),
    /// The value is not allowed.
    #[error("{0}")]
    Value(ParameterProblem),
    /// The file cannot be stored.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// Not a file name.
    #[error(transparent)]
    Name(#[from] NameError),
}

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
        let content = content
            .ok_or_else(|| ParameterError::File(name.to_string()))?
            .to_vec();
        let changed = rewrite(&content, section, key, value)?;
        let before = self.problems(name.as_str(), &content);
        let problems = self.problems(name.as_str(), &changed);
        if let Some(problem) = problems.into_iter().find(|problem| !before.contains(problem)) {
            return Err(ParameterError::Value(problem));
        }
        self.drive.check(&name, &changed)?;
        self.put_in_place(&name, &changed);
        Ok(())
    }

    pub(crate) fn problems(&self, name: &str, content: &[u8]) -> Vec<ParameterProblem> {
        if name == ETHERNET_PAR {
            EthernetParameters::parse(content, &self.ethernet).1
        } else {
            UserParameters::parse(content, &self.user, self.edition()).1
        }
    }

    /// Parameters act from now on; called when the power comes on (PAR-FILE-03).
    pub(crate) fn take_parameters(&mut self) {
        let mut problems = Vec::new();
        if let Some(content) = self.drive.get(ETHERNET_PAR) {
            let (ethernet, found) = EthernetParameters::parse(content, &self.ethernet);
            self.ethernet = ethernet;
            problems.extend(found.into_iter().map(|problem| (ETHERNET_PAR, problem)));
        }
        if let Some(content) = self.drive.get(USER_PAR) {
            let (user, found) = UserParameters::parse(content, &self.user, self.edition());
            self.user = user;
            problems.extend(found.into_iter().map(|problem| (USER_PAR, problem)));
        }
        self.network = NetworkConfig::new(&self.ethernet);
        for (file, problem) in problems {
            self.raise(crate::alarm::PARAMETER, alloc::format!("{file}: {problem}"));
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
                self.store(&FileName::parse(name)?, &content)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Controller;
    use crate::{Config, Dialect, Input, PanelAction, Time};

    // clause: PAR-FILE-03 PAR-E05-01
    #[test]
    fn a_value_changes_in_place_and_acts_after_a_power_cycle() {
        let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let before = String::from_utf8(robot.drive().get(ETHERNET_PAR).unwrap().to_vec()).unwrap();
        robot.set_parameter("ethernet.par", "E05", "IP1", "2101").unwrap();
        let after = String::from_utf8(robot.drive().get(ETHERNET_PAR).unwrap().to_vec()).unwrap();
        let expected = before.replacen("= 1001", "= 2101", 1);
        assert_eq!(after, expected, "comments, order and every other value stay");
        assert_eq!(robot.network().channels[1].own_port, 1001);
        robot.feed(Time::ZERO, Input::Panel(PanelAction::PowerCycle));
        assert_eq!(robot.network().channels[1].own_port, 2101);
    }

    #[test]
    fn a_value_that_is_not_allowed_changes_nothing() {
        let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let before = robot.drive().clone();
        for (file, section, key, value) in [
            ("USER.PAR", "U06", "HOST", "12345 8 0 1"),
            ("USER.PAR", "U06", "COM1", "115200 8 0 1"),
            ("ETHERNET.PAR", "E00", "", "3 1 1 1"),
            ("ETHERNET.PAR", "E05", "IP9", "1"),
            ("TEST", "E05", "IP1", "1"),
        ] {
            assert!(
                robot.set_parameter(file, section, key, value).is_err(),
                "{file} {section} {value}"
            );
        }
        assert_eq!(*robot.drive(), before);
    }
}
