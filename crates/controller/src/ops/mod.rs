//! What the host commands do. This file asks the permission tables and wires each command to its
//! operation; each group has a file of its own.

mod extended;
mod files;
mod jog;
mod operate;
mod reset;
mod status;
mod variables;
mod watchdog;

pub(crate) use variables::numbers;

use crate::port::Port;
use crate::robot::Robot;
use crate::session::Outcome;
use crate::variation::Variation;
use ts3100_proto::command::Command;
use ts3100_proto::status::su::StatusBody;

/// What a command finds at the port it came on.
pub(crate) struct CommandContext<'a> {
    pub(crate) port: Port,
    /// The file of DL is being received already, here or on another port (TRN-11).
    pub(crate) receiving: bool,
    /// Bytes that are left on the RAM drive while a fault says so.
    pub(crate) room: Option<usize>,
    pub(crate) variation: Option<&'a mut Variation>,
    /// The body of SU as the host has last seen it, for the SU request of SF (SF-21).
    pub(crate) last_status: &'a mut Option<StatusBody>,
}

impl Robot {
    pub(crate) fn operate(&mut self, context: &mut CommandContext<'_>, command: Command) -> Outcome {
        match command {
            Command::Rn => self.op_start(),
            Command::Sp => self.op_stop(),
            Command::Br => self.op_servo_off(),
            Command::So => self.op_servo_on(),
            Command::Fd => self.op_feed_hold(),
            Command::Ec(internal) => self.op_internal(internal),
            Command::Do(statement) => self.op_direct(&statement),
            Command::Iw(writes) => self.op_write_lines(&writes),
            Command::Rs(reset) => self.op_reset(reset),
            Command::Sl(name) => self.op_select(context.port, &name),
            Command::Ul(name) => self.op_upload(&name),
            Command::Dl(name) => self.op_download(context, name),
            Command::Er(name) => self.op_erase(&name),
            Command::Ca => self.op_directory(context),
            Command::Su => self.op_status(context),
            Command::Sf => self.op_system_status(context),
            Command::Eu => self.op_error_history(context),
            Command::Vr => self.op_version(),
            Command::Mr(read) => self.op_read_variable(&read),
            Command::Mw(write) => self.op_write_variable(&write, context.room),
            Command::Fl(_) => Outcome::ng("FL came, but no DL is open"),
            Command::Ok | Command::Ng => Outcome::ng("an answer is no command"),
            Command::Wd { timeout_ms, level } => self.op_watchdog(timeout_ms, level),
            Command::Md(mode) => self.op_guide(|guide| guide.mode = u16::from(mode)),
            Command::Rt(rate) => self.op_guide(|guide| guide.rate = u16::from(rate)),
            Command::Sc(system) => self.op_guide(|guide| guide.coordinate = u16::from(system)),
            Command::Jg { axis, motion } => self.op_jog(context.port, axis, motion),
            Command::Sm(_) => self.op_quick_status(),
            Command::Ac => self.op_current_alarms(),
            Command::Ah => self.op_alarm_history(),
            Command::Mn => Outcome::file(self.maintenance().encode()),
            Command::Io(_) => self.op_lines(),
            Command::Hi { first, count } => self.op_read_inputs(first, count),
            Command::Ho { first, count, value } => self.op_write_outputs(first, count, value),
            Command::Pr(query) => self.op_position(query),
            Command::Vl(which) => self.op_velocity(which),
            Command::Zs { frame, name, values } => self.op_set_frame(frame, &name, &values),
        }
    }
}
