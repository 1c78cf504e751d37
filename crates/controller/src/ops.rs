//! Effects of the host commands: [`Robot::operate`] has one arm for each row of the table of commands
//! (`ts3100_proto::command`).
//!
//! The methods of a group of commands are in a file of their own. Whether a command is served and valid is decided by the
//! caller.

pub(crate) mod actions;
mod extended;
mod files;
mod jog;
mod maintenance;
mod operate;
mod panel;
mod parameters;
mod reset;
mod status;
pub(crate) mod variables;

use crate::executor::StopCause;
use crate::outcome::Outcome;
use crate::panel::StopRequests;
use crate::port::Port;
use crate::refusal::Refusal;
use crate::robot::Robot;
use crate::variation::Variation;
use ts3100_proto::command::Command;
use ts3100_proto::file::FlSender;
use ts3100_proto::status::su::StatusBody;

/// The reason of the first condition that holds forbids something.
fn refuse_if<E>(conditions: impl IntoIterator<Item = (bool, E)>) -> Result<(), E> {
    let mut holding = conditions.into_iter().filter(|(holds, _)| *holds);
    holding.next().map_or(Ok(()), |(_, reason)| Err(reason))
}

/// The port of a command, as far as commands read or change it.
pub(crate) struct CommandContext<'a> {
    pub(crate) port: Port,
    /// The file of DL is being received already, here or on another port (TRN-11).
    pub(crate) receiving: bool,
    /// Bytes that are left on the RAM drive while a fault says so.
    pub(crate) room: Option<usize>,
    pub(crate) variation: Option<&'a mut Variation>,
    /// The body of SU as the host has last seen it, for the SU request of SF (SF-21).
    pub(crate) last_status: &'a mut Option<StatusBody>,
    /// Requests to stop that the host has been shown, for the events of SM (T1).
    pub(crate) seen_requests: &'a mut StopRequests,
}

impl Robot {
    /// Carries out a command that is served and valid.
    pub(crate) fn operate(&mut self, context: &mut CommandContext<'_>, command: &Command) -> Outcome {
        let port = context.port;
        match command {
            Command::Rn => Outcome::from_result(self.start()),
            Command::Sp => self.op_stop(),
            Command::Br => {
                self.servo_off(StopCause::Host);
                Outcome::Ok
            }
            Command::So => Outcome::from_result(self.servo_on()),
            Command::Rs(reset) => self.op_reset(Some(*reset)),
            Command::Sl(name) => self.op_select(port, name),
            Command::Ul(name) => self.op_upload(name),
            Command::Dl(name) => self.op_download(context, name.clone()),
            Command::Ca => self.op_directory(context),
            Command::Su => self.op_status(context),
            Command::Eu => self.op_error_history(context),
            Command::Er(name) => Outcome::change(self.stage_erase(name).map(|staged| Some(staged.into()))),
            Command::Fl(_) => Outcome::Ng(Refusal::NoDownload),
            Command::Ok | Command::Ng => Outcome::Ng(Refusal::Answer),
            Command::Ec(internal) => self.op_internal(*internal),
            Command::Mw(write) => Outcome::change(self.write_variable(write, context.room)),
            Command::Fd => {
                self.feed_hold();
                Outcome::Ok
            }
            Command::Sf => self.op_system_status(context),
            Command::Mr(read) => self.op_read_variable(read),
            Command::Iw(lines) => self.op_write_lines(lines),
            Command::Vr => self.op_version(),
            Command::Do(statement) => self.op_direct(statement, false),
            Command::Sm(_) => self.op_quick_status(context),
            Command::Wd { timeout_ms, level } => self.op_watchdog(*timeout_ms, *level),
            Command::Ac => self.op_active_alarms(),
            Command::Ah => self.op_alarm_history(),
            Command::Io(_) => Outcome::File(FlSender::single_text(self.signals.line_words().encode(), &[])),
            Command::Hi { first, count } => self.op_read_inputs(*first, *count),
            Command::Ho { first, count, value } => self.op_write_outputs(*first, *count, *value),
            Command::Pr(query) => self.op_position(*query),
            Command::Vl(number) => self.op_velocity(*number),
            Command::Zs { frame, name, values } => self.op_set_frame(*frame, name, values),
            Command::Md(number) => self.op_guide(|guide| guide.mode = u16::from(*number)),
            Command::Rt(number) => self.op_guide(|guide| guide.rate = u16::from(*number)),
            Command::Sc(number) => self.op_guide(|guide| guide.coordinate = u16::from(*number)),
            Command::Jg { axis, motion } => self.op_jog(port, *axis, *motion),
            Command::Mp {
                keeps_height,
                position,
            } => self.op_direct(&format!("MOVE {position}"), *keeps_height),
            Command::Ps => Outcome::file(self.current_position().encode()),
            Command::Mn(item) => self.op_maintenance(*item),
            Command::Rm(item) => self.op_reset_maintenance(*item),
            // There is no origin change: the function is invalid, its value 0 (S83).
            Command::Zc => Outcome::file(b"0,0".to_vec()),
            Command::Em(right) => self.op_give_control(*right),
            Command::RsErr => self.op_reset(None),
        }
    }
}
