//! What the host commands do: one method for each row of the table of commands (`ts3100_proto::command`).
//!
//! The methods of a group of commands are in a file of their own. Whether a command is served and valid is decided by the
//! caller of [`Robot::operate`].

mod actions;
mod extended;
mod files;
mod jog;
mod maintenance;
mod operate;
mod panel;
mod parameters;
mod reset;
mod status;
mod variables;
mod watchdog;

pub(crate) use actions::no_line;
pub(crate) use panel::OperateError;
pub(crate) use variables::numbers;

use crate::port::Port;
use crate::robot::Robot;
use crate::variation::Variation;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use ts3100_proto::command::{
    Command, CommandHandler, CommandRow, InternalCommand, JogDirection, LineWrite, PositionQuery, Reset,
    VariableRead, VariableWrite, ZsFrame,
};
use ts3100_proto::file::{FlReceiver, FlSender};
use ts3100_proto::name::{FileName, VariableName};
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::su::StatusBody;

/// What a command comes to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outcome {
    /// OK.
    Ok,
    /// NG, with the reason for the author of the host program.
    Ng(String),
    /// FL with these texts.
    File(FlSender),
    /// Nothing yet: a file it changes is kept first.
    Held,
    /// OK, and the file's texts are awaited.
    Receive(FileName, FlReceiver),
}

impl Outcome {
    /// NG with a reason.
    pub(crate) fn ng(reason: impl Into<String>) -> Outcome {
        Outcome::Ng(reason.into())
    }

    /// OK, or NG with the error's words.
    pub(crate) fn of(result: Result<(), impl ToString>) -> Outcome {
        result.map_or_else(|error| Outcome::Ng(error.to_string()), |()| Outcome::Ok)
    }

    /// FL with a body that is cut into texts as needed.
    #[must_use]
    pub(crate) fn file(content: Vec<u8>) -> Outcome {
        Outcome::File(FlSender::new(content))
    }
}

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
    /// Carries out a command that is served and valid.
    pub(crate) fn operate(&mut self, context: &mut CommandContext<'_>, command: Command) -> Outcome {
        Operations { robot: self, context }.dispatch(command)
    }
}

/// Carries out the commands of one port: one method for each row of the table of commands.
struct Operations<'a, 'c> {
    robot: &'a mut Robot,
    context: &'a mut CommandContext<'c>,
}

impl CommandHandler for Operations<'_, '_> {
    type Outcome = Outcome;

    fn unhandled(&mut self, row: &'static CommandRow) -> Outcome {
        Outcome::Ng(format!("{} is not implemented", row.name))
    }

    fn rn(&mut self) -> Outcome {
        self.robot.op_start()
    }

    fn sp(&mut self) -> Outcome {
        self.robot.op_stop()
    }

    fn br(&mut self) -> Outcome {
        self.robot.op_servo_off()
    }

    fn so(&mut self) -> Outcome {
        self.robot.op_servo_on()
    }

    fn rs(&mut self, reset: Reset) -> Outcome {
        self.robot.op_reset(reset)
    }

    fn sl(&mut self, name: FileName) -> Outcome {
        self.robot.op_select(self.context.port, &name)
    }

    fn ul(&mut self, name: FileName) -> Outcome {
        self.robot.op_upload(&name)
    }

    fn dl(&mut self, name: FileName) -> Outcome {
        self.robot.op_download(self.context, name)
    }

    fn ca(&mut self) -> Outcome {
        self.robot.op_directory(self.context)
    }

    fn su(&mut self) -> Outcome {
        self.robot.op_status(self.context)
    }

    fn eu(&mut self) -> Outcome {
        self.robot.op_error_history(self.context)
    }

    fn er(&mut self, name: FileName) -> Outcome {
        self.robot.op_erase(&name)
    }

    fn fl(&mut self, _content: Vec<u8>) -> Outcome {
        Outcome::ng("FL came, but no DL is open")
    }

    fn ok(&mut self) -> Outcome {
        Outcome::ng("an answer is no command")
    }

    fn ng(&mut self) -> Outcome {
        Outcome::ng("an answer is no command")
    }

    fn ec(&mut self, internal: InternalCommand) -> Outcome {
        self.robot.op_internal(internal)
    }

    fn mw(&mut self, write: VariableWrite) -> Outcome {
        self.robot.op_write_variable(&write, self.context.room)
    }

    fn fd(&mut self) -> Outcome {
        self.robot.op_feed_hold()
    }

    fn sf(&mut self) -> Outcome {
        self.robot.op_system_status(self.context)
    }

    fn mr(&mut self, read: VariableRead) -> Outcome {
        self.robot.op_read_variable(&read)
    }

    fn iw(&mut self, lines: Vec<LineWrite>) -> Outcome {
        self.robot.op_write_lines(&lines)
    }

    fn vr(&mut self) -> Outcome {
        self.robot.op_version()
    }

    fn do_(&mut self, statement: String) -> Outcome {
        self.robot.op_direct(&statement)
    }

    fn sm(&mut self, _number: u8) -> Outcome {
        self.robot.op_quick_status()
    }

    fn wd(&mut self, timeout_ms: u32, level: Option<AlarmLevel>) -> Outcome {
        self.robot.op_watchdog(timeout_ms, level)
    }

    fn ac(&mut self) -> Outcome {
        self.robot.op_current_alarms()
    }

    fn ah(&mut self) -> Outcome {
        self.robot.op_alarm_history()
    }

    fn io(&mut self, _number: u8) -> Outcome {
        self.robot.op_lines()
    }

    fn hi(&mut self, first: u16, count: u8) -> Outcome {
        self.robot.op_read_inputs(first, count)
    }

    fn ho(&mut self, first: u16, count: u8, value: u32) -> Outcome {
        self.robot.op_write_outputs(first, count, value)
    }

    fn pr(&mut self, query: PositionQuery) -> Outcome {
        self.robot.op_position(query)
    }

    fn vl(&mut self, number: u8) -> Outcome {
        self.robot.op_velocity(number)
    }

    fn zs(&mut self, frame: ZsFrame, name: VariableName, values: Vec<f64>) -> Outcome {
        self.robot.op_set_frame(frame, &name, &values)
    }

    fn md(&mut self, number: u8) -> Outcome {
        self.robot.op_guide(|guide| guide.mode = u16::from(number))
    }

    fn rt(&mut self, number: u8) -> Outcome {
        self.robot.op_guide(|guide| guide.rate = u16::from(number))
    }

    fn sc(&mut self, number: u8) -> Outcome {
        self.robot.op_guide(|guide| guide.coordinate = u16::from(number))
    }

    fn jg(&mut self, axis: u8, motion: JogDirection) -> Outcome {
        self.robot.op_jog(self.context.port, axis, motion)
    }

    fn mn(&mut self) -> Outcome {
        Outcome::file(self.robot.maintenance().encode())
    }

    fn rs_err(&mut self) -> Outcome {
        self.robot.op_reset_alarms()
    }
}
