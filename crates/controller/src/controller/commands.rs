//! The way of a command from a port to the robot and back: asks the permission tables of the manual (5.3.2), carries the
//! command out, has it answered. The same for the file of a download, and for the end of a change that was stored outside.

use crate::action::{Accepted, ActionError, ActionErrorKind};
use crate::asked_command::AskedCommand;
use crate::controller::Controller;
use crate::drive::{DriveError, PersistError, Staged};
use crate::endpoint::session::Letters;
use crate::finding::rules;
use crate::ops::CommandContext;
use crate::outcome::Outcome;
use crate::persistence::{Change, Then, Waiting};
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::Refusal;
use bytes::Bytes;
use ts3100_proto::command::Command;
use ts3100_proto::name::FileName;
use ts3100_proto::permission::Permission;

impl Controller {
    /// Carries out a command and answers it, or lets it wait until the file that it changes is stored.
    pub(super) fn answer_command(&mut self, port: Port, message: Bytes, command: Command) {
        let asked = self.asked(port, message, command);
        // A refusal is a finding of its own unless the command has made one: the count tells which are new.
        let outputs = self.robot.context.outputs.count();
        let outcome = self.command(&asked);
        if let Outcome::Change(change) = outcome {
            // The host waits for its text; a result is for owners.
            let _ = self.make(*change, Then::AnswerCommand(Box::new(asked)));
        } else {
            self.endpoints
                .conclude(&mut self.robot.context, &asked, outcome, outputs);
        }
    }

    fn asked(&self, port: Port, message: Bytes, command: Command) -> AskedCommand {
        let config = &self.robot.context.config;
        let mode = self.robot.panel.state().master_mode();
        let table = port.protocol().filter(|_| config.serves(&command));
        let tables = config.permission_table();
        AskedCommand {
            port,
            message,
            mode,
            permission: table.and_then(|table| tables.get(table, command.permission_row(), mode)),
            risk: self.robot.command_risk(&command),
            command,
        }
    }

    /// Carries out a command that came on a protocol port.
    fn command(&mut self, asked: &AskedCommand) -> Outcome {
        let AskedCommand { port, command, .. } = asked;
        let context = &mut self.robot.context;
        if !context.config.serves(command) {
            return Outcome::Ng(Refusal::NotServed);
        }
        // Also where the tables forbid it: that the host knows an extension says that it polls (hosts 8.3).
        if command.is_extension() {
            self.endpoints.disable_unsolicited_sp(context, *port);
        }
        match self.forbidden(asked) {
            Some(refusal) => Outcome::Ng(refusal),
            None => self.carry_out(*port, command),
        }
    }

    /// Checks the permission tables; returns the reason if they forbid the command now.
    fn forbidden(&mut self, asked: &AskedCommand) -> Option<Refusal> {
        let (port, letters): (Port, Letters) = (asked.port, asked.command.permission_row());
        let reason = match asked.permission? {
            Permission::Valid => return None,
            // A DO counts as running, and so does a program in feed hold (PRM-LEG-06).
            Permission::WhenStopped if !self.robot.executor.is_running() => return None,
            Permission::WhenStopped => Refusal::OnlyWhenStopped { letters, port },
            Permission::Invalid => Refusal::NotInMode {
                letters,
                port,
                mode: asked.mode,
            },
        };
        let context = &mut self.robot.context;
        context.report(&rules::MODE_FORBIDS, port, letters.as_bytes(), reason.to_string());
        Some(reason)
    }

    /// Carries out a command that is valid.
    fn carry_out(&mut self, port: Port, command: &Command) -> Outcome {
        let endpoints = &mut self.endpoints;
        let receiving = matches!(command, Command::Dl(name)
            if endpoints.sessions.values().any(|session| session.receives(name)));
        let session = endpoints.session(port);
        let (mut last_status, mut seen_requests) = (session.last_status.take(), session.seen_requests);
        let mut at_port = CommandContext {
            port,
            receiving,
            room: endpoints.faults.drive_free,
            variation: endpoints.variation.as_mut(),
            last_status: &mut last_status,
            seen_requests: &mut seen_requests,
        };
        let outcome = self.robot.operate(&mut at_port, command);
        let session = endpoints.session(port);
        (session.last_status, session.seen_requests) = (last_status, seen_requests);
        outcome
    }

    /// The last text of a download has come: stores the file and answers (CMD-DL-02, CMD-DL-06).
    pub(super) fn end_download(&mut self, port: Port, name: &FileName, content: Bytes, last: &Bytes) {
        // DL was accepted while the robot stood (tables 5.3, 5.4). Since then the panel, a signal or the other port
        // may have started it.
        if self.robot.executor.is_running() {
            let reason = Refusal::Started;
            let context = &mut self.robot.context;
            let bytes = name.as_str().as_bytes();
            context.report(&rules::REFUSED_BY_STATE, port, bytes, reason.to_string());
            return self.endpoints.refuse_block(context, port, last, &reason);
        }
        match self.robot.drive.stage(name, content) {
            Ok(staged) => {
                let last = last.clone();
                let _ = self.make(staged.into(), Then::AnswerDownload { port, last });
            }
            Err(error) => {
                let context = &mut self.robot.context;
                context.check_store(port, &error);
                self.endpoints.refuse_block(context, port, last, &error.into());
            }
        }
    }

    /// Answers the last text of a download, when its file is stored or cannot be.
    fn answer_download(&mut self, port: Port, file: &Staged, last: &Bytes, stored: Result<(), DriveError>) {
        match stored {
            Ok(()) => {
                let content = file.content().map_or(&[][..], |content| content);
                self.robot.check_download(port, file.name(), content, last);
                self.endpoints.acknowledge(&mut self.robot.context, port);
            }
            Err(error) => {
                let context = &mut self.robot.context;
                self.endpoints.refuse_block(context, port, last, &error.into());
            }
        }
    }

    /// Makes a change and continues: immediately, or when it is stored outside.
    ///
    /// # Errors
    /// The reason for which an action had no effect.
    pub(super) fn make(&mut self, change: Change, then: Then) -> Result<Accepted, ActionError> {
        match self.robot.propose(change, then) {
            Some(waiting) => self.finish(waiting, Ok(())),
            None => Ok(Accepted::Pending),
        }
    }

    /// Makes a change that was stored outside or is kept in memory only, or drops it; then continues, once.
    ///
    /// # Errors
    /// The reason for which an action had no effect.
    pub(super) fn finish(
        &mut self,
        waiting: Waiting,
        stored: Result<(), PersistError>,
    ) -> Result<Accepted, ActionError> {
        let Waiting { change, then } = waiting;
        let file = change.staged.clone();
        let outputs = self.robot.context.outputs.count();
        let made = self.robot.commit(change, stored);
        match then {
            Then::AnswerDownload { port, last } => self.answer_download(port, &file, &last, made),
            Then::AnswerCommand(asked) => {
                let outcome = Outcome::from_result(made);
                self.endpoints
                    .conclude(&mut self.robot.context, &asked, outcome, outputs);
            }
            Then::Resolve { place } => return self.resolve(&place, made),
            Then::Restored { direct } => self.robot.end_restore(direct, made),
        }
        Ok(Accepted::Done)
    }

    /// The result of an action that changes a file.
    fn resolve(&mut self, place: &str, made: Result<(), DriveError>) -> Result<Accepted, ActionError> {
        let Err(error) = made else {
            return Ok(Accepted::Done);
        };
        let refused = if let DriveError::NotPersisted { reason, .. } = &error {
            ActionError::cannot(place, "keep the change", reason)
        } else {
            ActionError::cannot(place, "keep the change", error)
        };
        self.refuse_action(ActionError {
            kind: ActionErrorKind::NotPersisted,
            ..refused
        })
    }
}
