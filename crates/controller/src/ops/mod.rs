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

use crate::Controller;
use crate::findings::rules;
use crate::output::{Event, Verdict};
use crate::port::Port;
use crate::session::Outcome;
use alloc::format;
use ts3100_proto::command::Command;
use ts3100_proto::permission::Permission;
use ts3100_proto::status::ExecutionStatus;

impl Controller {
    /// Carries out a command that came on a protocol port.
    pub(crate) fn command(&mut self, port: Port, command: Command) -> Outcome {
        if !self.config.serves(&command) {
            return Outcome::ng("the manual lists no such command (option `extensions`)");
        }
        if command.is_extension() {
            self.disable_unsolicited_sp(port);
        }
        let row = command.permission_row();
        let mode = self.state.master_mode();
        let refusal = self.forbidden(port, row);
        let valid = refusal.is_none();
        let outcome = refusal.unwrap_or_else(|| self.carry_out(port, command));
        let table = port
            .protocol()
            .and_then(|port| self.config.permissions.get(port, row, mode));
        if table.is_some() {
            let verdict = match &outcome {
                Outcome::Ng(_) if valid => Verdict::Refused,
                Outcome::Ng(_) => Verdict::NotValid,
                Outcome::Held => return outcome,
                Outcome::Ok | Outcome::File(_) | Outcome::Receive(..) => Verdict::Served,
            };
            self.event(Event::Answered {
                port,
                row,
                mode,
                verdict,
            });
        }
        outcome
    }

    /// Carries out a command that is valid.
    fn carry_out(&mut self, port: Port, command: Command) -> Outcome {
        let known = command.clone();
        let outputs = self.waiting().count();
        let outcome = self.operate(port, command);
        if self.persistence.is_pending() {
            return Outcome::Held;
        }
        if let Outcome::Ng(reason) = &outcome {
            self.check_refusal(port, &known, reason, outputs);
        }
        outcome
    }

    fn operate(&mut self, port: Port, command: Command) -> Outcome {
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
            Command::Sl(name) => self.op_select(port, &name),
            Command::Ul(name) => self.op_upload(&name),
            Command::Dl(name) => self.op_download(name),
            Command::Er(name) => self.op_erase(&name),
            Command::Ca => self.op_directory(),
            Command::Su => self.op_status(port),
            Command::Sf => self.op_system_status(port),
            Command::Eu => self.op_error_history(),
            Command::Vr => self.op_version(),
            Command::Mr(read) => self.op_read_variable(&read),
            Command::Mw(write) => self.op_write_variable(&write),
            Command::Fl(_) => Outcome::ng("FL came, but no DL is open"),
            Command::Ok | Command::Ng => Outcome::ng("an answer is no command"),
            Command::Wd { timeout_ms, level } => self.op_watchdog(timeout_ms, level),
            Command::Md(mode) => self.op_guide(|guide| guide.mode = u16::from(mode)),
            Command::Rt(rate) => self.op_guide(|guide| guide.rate = u16::from(rate)),
            Command::Sc(system) => self.op_guide(|guide| guide.coordinate = u16::from(system)),
            Command::Jg { axis, motion } => self.op_jog(port, axis, motion),
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

    fn forbidden(&mut self, port: Port, letters: &str) -> Option<Outcome> {
        let mode = self.state.master_mode();
        let cell = self.config.permissions.get(port.protocol()?, letters, mode)?;
        let stopped = self.executor.status() != ExecutionStatus::Running;
        let reason = match cell {
            Permission::Valid => return None,
            Permission::WhenStopped if stopped => return None,
            Permission::WhenStopped => {
                format!("{letters} is valid on {port} only while the robot is stopped (5.3.2)")
            }
            Permission::Invalid => format!("{letters} is not valid on {port} in {} (5.3.2)", mode.as_str()),
        };
        self.report(&rules::MODE_FORBIDS, port, letters.as_bytes(), reason.as_str());
        Some(Outcome::Ng(reason))
    }
}
