//! Checks of the effects of a host on the robot against the rules of `finding::rules`. Nothing here changes an answer.

use crate::finding::{MAX_BYTES, Rule, rules};
use crate::port::Port;
use crate::robot::Robot;
use ts3100_proto::command::Command;
use ts3100_proto::name::FileName;
use ts3100_proto::text::{CR, EOF, ETX, LF, STX};

impl Robot {
    /// Checks the arm when the peer of a port disconnects.
    pub(crate) fn check_left_jogging(&mut self, port: Port) {
        if self.arm.is_guided_from(port) && self.arm.is_jogging() {
            let text = "the connection ended while JG guided the arm; it stops";
            self.context.report(&rules::LEFT_JOGGING, port, &[], text);
        }
    }

    /// Checks the program when the peer of its channel disconnects.
    pub(crate) fn check_left_channel(&mut self, port: Port) {
        let Some(channel) = self.channels.get(port).filter(|channel| channel.peer().is_some()) else {
            return;
        };
        let half = channel.partial_value();
        if !half.is_empty() {
            let text = "the peer left after a value without comma or CR; it is dropped";
            self.context.report(&rules::HALF_VALUE, port, &half, text);
        }
        if self.executor.program_runs() {
            let line = self.executor.line();
            let text = format!("the peer left while the program runs, at line {line}");
            self.context.report(&rules::PEER_LEFT, port, &[], text);
        }
    }

    /// The rule that a command breaks by being obeyed now. Call it only for a command that is not refused.
    pub(crate) fn command_risk(&self, command: &Command) -> Option<(&'static Rule, &'static str)> {
        if *command == Command::Br && self.executor.is_running() {
            let text = "BR while the robot runs; the motion ends (CMD-BR-02)";
            return Some((&rules::SERVO_OFF_RUNNING, text));
        }
        if matches!(command, Command::Mw(_)) && self.executor.program_runs() {
            let text = "MW while the program runs; it takes effect immediately (CMD-MW-06)";
            return Some((&rules::WRITE_WHILE_RUNNING, text));
        }
        let too_long = matches!(command, Command::Dl(name) if !name.fits_editor());
        let text =
            "the file is accepted; file names should have at most 8 characters and an extension of at most 3";
        too_long.then_some((&rules::LONG_FILE_NAME, text))
    }

    /// Checks a file that was downloaded; `last` is the data of its last text.
    pub(crate) fn check_download(&mut self, port: Port, name: &FileName, content: &[u8], last: &[u8]) {
        let label = name.as_str();
        if last.ends_with(&[EOF, CR]) {
            let text = format!("{label}: CR after EOF; accepted");
            self.context.report(&rules::CR_AFTER_EOF, port, last, text);
        }
        if name.is_parameter() {
            let text = format!("{label} is stored and takes effect at the next power-on (5.2.3)");
            self.context.report(&rules::PARAMETER_PENDING, port, last, text);
            for problem in self.problems(label, content) {
                self.context
                    .report(&rules::PARAMETER_BROKEN, port, &[], format!("{label}: {problem}"));
            }
            return;
        }
        if let Some(at) = content.iter().position(|byte| *byte == LF) {
            let line = content
                .get(at.saturating_sub(MAX_BYTES / 2)..=at)
                .unwrap_or_default();
            let text = format!("{label}: lines end with LF; accepted (5.4.1)");
            self.context.report(&rules::FILE_LINE_ENDS, port, line, text);
        }
        if self.executor.file() == label {
            let text = format!("{label} is selected; the next RN runs the new one");
            self.context.report(&rules::SELECTED_OVERWRITTEN, port, &[], text);
        }
    }

    /// Checks bytes received on a SCOL channel.
    pub(crate) fn check_data(&mut self, port: Port, bytes: &[u8]) {
        if bytes.contains(&STX) || bytes.contains(&ETX) {
            let text = format!("STX or ETX came on {port}, which carries data for INPUT only (4)");
            self.context
                .report(&rules::PROTOCOL_ON_CHANNEL, port, bytes, text);
        }
        if bytes.contains(&LF) {
            let text = "LF in a record; it is dropped";
            self.context.report(&rules::INPUT_LINE_FEED, port, bytes, text);
        }
        if !self.executor.reads_from(port) {
            let text = format!(
                "data came on {port} while no INPUT waited; the manual says it may be ignored (4.1.2)"
            );
            self.context.report(&rules::DATA_BEFORE_INPUT, port, bytes, text);
        }
    }
}
