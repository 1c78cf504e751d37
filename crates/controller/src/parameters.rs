//! The parameter files of the RAM drive: USER.PAR and ETHERNET.PAR are created if missing, STRING.PAR comes from a host. All
//! are read at power-on.
//!
//! `ts3100_proto::parameter` parses and writes them; the emulator applies the settings to its links; `ops::parameters`
//! writes the files.

use crate::drive::Drive;
use crate::network::NetworkConfig;
use crate::port::Port;
use crate::prelude::*;
use alloc::collections::BTreeMap;
use ts3100_proto::parameter::{
    Edition, EthernetParameters, OpenMode, ParameterProblem, SerialSettings, StringRow, StringRule,
    UserParameters, parse_strings,
};

/// Name of the Ethernet parameter file.
pub(crate) const ETHERNET_PAR: &str = "ETHERNET.PAR";
/// Name of the user parameter file.
pub(crate) const USER_PAR: &str = "USER.PAR";
/// Name of the file with the numbers of strings.
pub(crate) const STRING_PAR: &str = "STRING.PAR";

/// A problem, and the file that has it.
pub(crate) type FileProblem = (&'static str, ParameterProblem);

/// The parameters as of the last power-on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameters {
    ethernet: EthernetParameters,
    user: UserParameters,
    strings: Vec<StringRow>,
    network: NetworkConfig,
}

impl Parameters {
    /// Those of the factory, but for the mode in which the channels open.
    pub(crate) fn factory(open_mode: [OpenMode; 4]) -> Parameters {
        let ethernet = EthernetParameters {
            open_mode,
            ..EthernetParameters::factory()
        };
        let network = NetworkConfig::new(&ethernet);
        Parameters::restored(ethernet, UserParameters::factory(), Vec::new(), network)
    }

    /// Those of a snapshot.
    pub(crate) fn restored(
        ethernet: EthernetParameters,
        user: UserParameters,
        strings: Vec<StringRow>,
        network: NetworkConfig,
    ) -> Parameters {
        Parameters {
            ethernet,
            user,
            strings,
            network,
        }
    }

    pub(crate) fn ethernet(&self) -> &EthernetParameters {
        &self.ethernet
    }

    pub(crate) fn user(&self) -> &UserParameters {
        &self.user
    }

    pub(crate) fn network(&self) -> &NetworkConfig {
        &self.network
    }

    pub(crate) fn strings(&self) -> &[StringRow] {
        &self.strings
    }

    /// The value that INPUT gets for a string instead of a number, if \[U25\] defines one. Letter case counts, and the
    /// first row that fits (assumed, T13).
    pub(crate) fn number_of(&self, string: &str) -> Option<u16> {
        match self.user.input_string {
            StringRule::Alarm => None,
            StringRule::Zero => Some(0),
            StringRule::LookUp => {
                let row = self.strings.iter().find(|row| row.text == string);
                row.map(|row| row.number)
            }
        }
    }

    /// Accepted input of INPUT, for the message about another string.
    pub(crate) fn expected_by_input(&self) -> &'static str {
        match self.user.input_string {
            StringRule::LookUp => "a number or a string of STRING.PAR",
            StringRule::Alarm | StringRule::Zero => "a number",
        }
    }

    /// Settings of a serial port; `None` for the Ethernet channels.
    pub(crate) fn serial_line(&self, port: Port) -> Option<SerialSettings> {
        match port {
            Port::Host => Some(self.user.host),
            Port::Com1 => Some(self.user.com1),
            Port::Ip0 | Port::Ip1 | Port::Ip2 | Port::Ip3 => None,
        }
    }

    /// Settings of both serial ports.
    pub(crate) fn serial_lines(&self) -> BTreeMap<Port, SerialSettings> {
        let settings = Port::SERIAL
            .into_iter()
            .filter_map(|port| Some((port, self.serial_line(port)?)));
        settings.collect()
    }

    /// Problems of a parameter file with this content.
    pub(crate) fn problems(&self, name: &str, content: &[u8], edition: Edition) -> Vec<ParameterProblem> {
        match name {
            ETHERNET_PAR => EthernetParameters::parse(content, &self.ethernet).1,
            STRING_PAR => parse_strings(content).1.into_iter().collect(),
            _ => UserParameters::parse(content, &self.user, edition).1,
        }
    }

    /// The files of the drive count from now on; returns what of them does not (PAR-FILE-03).
    pub(crate) fn read(&mut self, drive: &Drive, edition: Edition) -> Vec<FileProblem> {
        let mut problems = Vec::new();
        if let Some(content) = drive.get(ETHERNET_PAR) {
            let (ethernet, found) = EthernetParameters::parse(content, &self.ethernet);
            self.ethernet = ethernet;
            problems.extend(found.into_iter().map(|problem| (ETHERNET_PAR, problem)));
        }
        if let Some(content) = drive.get(USER_PAR) {
            let (user, found) = UserParameters::parse(content, &self.user, edition);
            self.user = user;
            problems.extend(found.into_iter().map(|problem| (USER_PAR, problem)));
        }
        let (strings, problem) = parse_strings(drive.get(STRING_PAR).unwrap_or_default());
        self.strings = strings;
        problems.extend(problem.map(|problem| (STRING_PAR, problem)));
        self.network = NetworkConfig::new(&self.ethernet);
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Controller;
    use crate::model::ArmModel;
    use crate::{Config, Dialect, Input, PanelAction, Time};

    // clause: PAR-FILE-03 PAR-E05-01
    #[test]
    fn a_value_changes_in_place_and_acts_after_a_power_cycle() {
        let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let before = String::from_utf8(robot.drive().get(ETHERNET_PAR).unwrap().to_vec()).unwrap();
        let changed = before.replacen("= 1001", "= 2101", 1);
        robot.put_file("ethernet.par", changed.as_bytes()).unwrap();
        let after = robot.drive().get(ETHERNET_PAR).unwrap();
        assert_eq!(
            after,
            changed.as_bytes(),
            "comments, order and every other value stay"
        );
        assert_eq!(robot.network().channels[1].own_port, 1001);
        robot.feed(Time::ZERO, Input::by_hand(PanelAction::PowerCycle));
        assert_eq!(robot.network().channels[1].own_port, 2101);
    }

    // The files that are made are not read back when the power comes on for the first time.
    #[test]
    fn the_files_that_are_made_say_what_holds_already() {
        for dialect in [Dialect::Field, Dialect::Manual] {
            for model in [
                ArmModel::tv800(),
                ArmModel::thl400(),
                ArmModel::thl400_four_axes(),
            ] {
                let mut config = Config::new(dialect);
                config.model = model;
                let mut robot = Controller::new(config, Vec::new()).unwrap();
                let before = robot.robot.parameters.clone();
                robot.feed(Time::ZERO, Input::by_hand(PanelAction::PowerCycle));
                assert_eq!(robot.robot.parameters, before);
            }
        }
    }
}
