//! The way of a command from a port to the robot: asks the permission tables of the manual (5.3.2), carries the command
//! out, answers it, counts the outcome for coverage.
//!
//! `exchange` calls it with a parsed command. What each command does is in `ops`.

use super::Endpoints;
use crate::endpoint::session::Exchange;
use crate::findings::rules;
use crate::ops::{CommandContext, Outcome};
use crate::output::{Event, Verdict};
use crate::persistence::PendingChange;
use crate::port::Port;
use crate::robot::Robot;
use ts3100_proto::command::Command;
use ts3100_proto::permission::Permission;
use ts3100_proto::reply::Reply;

impl Endpoints {
    /// Carries out a command and answers it, or holds it until the file that it changes is stored.
    pub(crate) fn answer_command(&mut self, robot: &mut Robot, port: Port, message: &[u8], command: Command) {
        let letters = command.letters();
        let risk = robot.command_risk(&command);
        let again = robot.persistence.is_enabled().then(|| command.clone());
        let outcome = self.command(robot, port, command);
        if let (Outcome::Held, Some(command)) = (&outcome, again) {
            let message = message.to_vec();
            return robot.persistence.hold(PendingChange::Command {
                port,
                message,
                command,
            });
        }
        self.faults.drive_free = None;
        if let Some((rule, text)) = risk.filter(|_| !matches!(outcome, Outcome::Ng(_))) {
            robot.report(rule, port, message, text);
        }
        self.check_repeat(robot, port, message, matches!(outcome, Outcome::Ng(_)));
        match outcome {
            Outcome::Held => {}
            Outcome::Ok => self.send_text(robot, port, &Reply::Ok.encode()),
            Outcome::Ng(reason) => self.refuse_text(robot, port, letters, &reason),
            Outcome::File(mut sender) => {
                self.cut(&mut sender);
                let Some(text) = sender.next_text() else { return };
                self.session(port).block = 1;
                self.send_text(robot, port, text);
                self.session(port).set_exchange(Exchange::Sending { sender });
            }
            Outcome::Receive(name, receiver) => {
                self.session(port).set_exchange(Exchange::Receiving {
                    name,
                    receiver,
                    begun: false,
                });
                self.send_text(robot, port, &Reply::Ok.encode());
            }
        }
    }

    /// Carries out a command that came on a protocol port.
    fn command(&mut self, robot: &mut Robot, port: Port, command: Command) -> Outcome {
        if !robot.config.serves(&command) {
            return Outcome::ng("the manual lists no such command (option `extensions`)");
        }
        if command.is_extension() {
            self.disable_unsolicited_sp(robot, port);
        }
        let row = command.permission_row();
        let mode = robot.panel.state().master_mode();
        let table = port.protocol();
        let cell = table.and_then(|table| robot.config.permissions.get(table, row, mode));
        let refusal = cell.and_then(|cell| forbidden(robot, port, row, cell));
        let valid = refusal.is_none();
        let outcome = refusal.unwrap_or_else(|| self.carry_out(robot, port, command));
        if cell.is_some() {
            let verdict = match &outcome {
                Outcome::Ng(_) if valid => Verdict::Refused,
                Outcome::Ng(_) => Verdict::NotValid,
                Outcome::Held => return outcome,
                Outcome::Ok | Outcome::File(_) | Outcome::Receive(..) => Verdict::Served,
            };
            robot.outputs.event(Event::Answered {
                port,
                row,
                mode,
                verdict,
            });
        }
        outcome
    }

    /// Carries out a command that is valid.
    fn carry_out(&mut self, robot: &mut Robot, port: Port, command: Command) -> Outcome {
        let receiving = matches!(&command, Command::Dl(name)
            if self.sessions.values().any(|session| session.receives(name)));
        let mut last_status = self.session(port).last_status.take();
        let mut context = CommandContext {
            port,
            receiving,
            room: self.faults.drive_free,
            variation: self.variation.as_mut(),
            last_status: &mut last_status,
        };
        let known = command.clone();
        let outputs = robot.outputs.count();
        let outcome = robot.operate(&mut context, command);
        self.session(port).last_status = last_status;
        if robot.persistence.is_pending() {
            return Outcome::Held;
        }
        if let Outcome::Ng(reason) = &outcome {
            robot.check_refusal(port, &known, reason, outputs);
        }
        outcome
    }
}

/// Why the permission tables do not have a command valid now.
fn forbidden(robot: &mut Robot, port: Port, letters: &str, cell: Permission) -> Option<Outcome> {
    let stopped = !robot.executor.is_running();
    let reason = match cell {
        Permission::Valid => return None,
        Permission::WhenStopped if stopped => return None,
        Permission::WhenStopped => {
            format!("{letters} is valid on {port} only while the robot is stopped (5.3.2)")
        }
        Permission::Invalid => {
            let mode = robot.panel.state().master_mode();
            format!("{letters} is not valid on {port} in {} (5.3.2)", mode.as_str())
        }
    };
    robot.report(&rules::MODE_FORBIDS, port, letters.as_bytes(), reason.as_str());
    Some(Outcome::Ng(reason))
}
