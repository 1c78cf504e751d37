//! The answer to a command, with the findings about it and its outcome for coverage.
//!
//! The controller carries it out (`controller::commands`). What each command does is in `ops`.

use super::Endpoints;
use crate::asked_command::AskedCommand;
use crate::context::Context;
use crate::outcome::Outcome;
use crate::output::{Event, Verdict};

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
        debug_assert!(
            !matches!(outcome, Outcome::Change(_)),
            "{}: answered before its change is made",
            command.letters()
        );
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
                // Its bytes may be any, so a host reads SF by the lengths of its texts (SF-02).
                if command.letters() != "SF" {
                    self.cut(&mut sender);
                }
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
