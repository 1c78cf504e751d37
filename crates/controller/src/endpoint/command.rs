//! The answer to a command, with the findings about it and its outcome for coverage.
//!
//! The controller carries it out (`controller::commands`). What each command does is in `ops`.

use super::Endpoints;
use crate::context::Context;
use crate::findings::Rule;
use crate::ops::Outcome;
use crate::output::{Event, Verdict};
use crate::port::Port;
use bytes::Bytes;
use ts3100_proto::command::Command;
use ts3100_proto::permission::Permission;
use ts3100_proto::status::MasterMode;

/// A command on its way to its answer. Mode and permission are those of its arrival: the command itself may change the mode.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AskedCommand {
    pub(crate) port: Port,
    pub(crate) message: Bytes,
    pub(crate) command: Command,
    pub(crate) mode: MasterMode,
    /// Its cell of the permission tables; none: they do not have it.
    pub(crate) permission: Option<Permission>,
    /// The rule that it breaks by being obeyed.
    pub(crate) risk: Option<(&'static Rule, &'static str)>,
}

impl Endpoints {
    /// A command has come to its outcome: answers it. Findings among the outputs after the first `outputs` say why it
    /// was refused.
    pub(crate) fn conclude(
        &mut self,
        context: &mut Context,
        asked: &AskedCommand,
        outcome: Outcome,
        outputs: usize,
    ) {
        let AskedCommand {
            port,
            message,
            command,
            ..
        } = asked;
        let port = *port;
        let verdict = match &outcome {
            Outcome::Ng(reason) if reason.is_not_valid() => Verdict::NotValid,
            Outcome::Ng(reason) => {
                context.check_refusal(port, command, reason, outputs);
                Verdict::Refused
            }
            Outcome::Ok | Outcome::Change(_) | Outcome::File(_) | Outcome::Receive(..) => Verdict::Served,
        };
        if asked.permission.is_some() {
            context.outputs.event(Event::Answered {
                port,
                row: command.permission_row(),
                mode: asked.mode,
                verdict,
            });
        }
        self.faults.drive_free = None;
        let served = verdict == Verdict::Served;
        if let Some((rule, text)) = asked.risk.filter(|_| served) {
            context.report(rule, port, message, text);
        }
        self.check_repeat(context, port, message, !served);
        if served {
            context.fault_effects.obeyed(port);
        }
        match outcome {
            Outcome::Ok | Outcome::Change(_) => self.acknowledge(context, port),
            Outcome::Ng(reason) => self.refuse_text(context, port, command.letters(), &reason),
            Outcome::File(mut sender) => {
                self.cut(&mut sender);
                let Some(text) = sender.next_text() else { return };
                // Before the text leaves: a fault may be set for block 1.
                self.session(port).block = 1;
                self.send_text(context, port, text);
                self.session(port).await_acknowledgement(sender);
            }
            Outcome::Receive(name, receiver) => {
                // Open before the OK: an SP that is overdue by then must see the download and keep waiting
                // (`Session::replied`).
                self.session(port).await_file(name, receiver);
                self.acknowledge(context, port);
            }
        }
    }
}
