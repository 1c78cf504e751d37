//! SP, the text that tells a host about a stop it did not ask for (CMD-SP-05), and the watchdog of WD.
//!
//! The controller says when the program starts or stops; this module decides which hosts are told, and when.

use super::Endpoints;
use super::session::Session;
use crate::context::Context;
use crate::finding::rules;
use crate::limits::MAX_SP_DELAY;
use crate::options::UnsolicitedSp;
use crate::port::Port;
use crate::time::Time;
use crate::variation::Variation;
use core::time::Duration;
use ts3100_proto::reply::Reply;

impl Endpoints {
    /// When the next waiting SP may be sent. A character on the half-duplex line of HOST holds its SP back, and its end is a
    /// deadline of its own.
    pub(crate) fn sp_deadline(&self, context: &Context) -> Option<Time> {
        let silent = |session: &&Session| !self.line_is_taken(context, session.port);
        let sessions = self.sessions.values().filter(silent);
        sessions.filter_map(Session::sp_due).min()
    }

    /// Drops the SP texts that wait, as the program starts: a host would take them for the end of the new cycle (T23).
    pub(crate) fn forget_stops(&mut self) {
        for session in self.sessions.values_mut() {
            session.waiting_sp = false;
        }
        let departed = self.lines.values_mut();
        for departed in departed.filter_map(|line| line.departed_peer.as_mut()) {
            departed.next_sp = None;
        }
    }

    /// Lets an SP wait on every port whose host is to be told of stops (D7).
    pub(crate) fn announce_stop(&mut self, context: &Context) {
        let (now, rule) = (context.now, context.config.options.unsolicited_sp);
        for session in self.sessions.values_mut() {
            // While bytes of a departed host are still on the line, the session is that host's. The next one may be connected
            // already: it is told, and nothing that it has sent has come yet.
            let line = self.lines.get_mut(&session.port);
            let departed = line.and_then(|line| line.departed_peer.as_mut());
            let (connected, polls) = match &departed {
                Some(departed) => (departed.next_peer.is_some(), false),
                None => (session.peer.is_some(), session.never_told_of_stops),
            };
            let told = match rule {
                UnsolicitedSp::Auto => !polls,
                UnsolicitedSp::Always => true,
                UnsolicitedSp::Never => false,
            };
            if told && connected {
                let delay = self.variation.as_mut().map(Variation::sp_delay);
                // The variation delays SP within the limit, not beyond it.
                let window = (now + delay.unwrap_or_default(), now + MAX_SP_DELAY);
                match departed {
                    Some(departed) => departed.next_sp = Some(window),
                    None => session.await_sp(window),
                }
            }
        }
    }

    /// Notes that the host has sent a text that only polling hosts send (hosts 8.3): they take an SP for their next answer.
    /// Under `auto` this one gets none.
    pub(crate) fn disable_unsolicited_sp(&mut self, context: &Context, port: Port) {
        let auto = context.config.options.unsolicited_sp == UnsolicitedSp::Auto;
        let session = self.session(port);
        session.never_told_of_stops = true;
        // An SP that waits already is dropped: such a host may be about to read the answer to this very text.
        session.waiting_sp &= !auto;
    }

    /// Sends the SP texts that no open exchange holds back any more (CMD-SP-07).
    pub(crate) fn release_sp(&mut self, context: &mut Context) {
        for port in [Port::Host, Port::Ip0] {
            let due = self.session(port).sp_due().filter(|due| *due <= context.now);
            if due.is_some() && !self.line_is_taken(context, port) {
                self.send_sp(context, port);
            }
        }
    }

    /// Sends an overdue SP between two texts of a host that sends without waiting for answers.
    pub(crate) fn release_overdue_sp(&mut self, context: &mut Context, port: Port) {
        if self.session(port).sp_overdue(context.now) {
            self.send_sp(context, port);
        }
    }

    fn send_sp(&mut self, context: &mut Context, port: Port) {
        self.session(port).waiting_sp = false;
        self.send_text(context, port, &Reply::Sp.encode());
    }

    /// Reports to every connected host that the time of WD has passed. WD belongs to the controller and not to a port: a text
    /// on either port would have been enough.
    pub(crate) fn report_late_watchdog(&self, context: &mut Context, timeout: Duration) {
        let millis = timeout.as_millis();
        for session in self.sessions.values().filter(|session| session.peer.is_some()) {
            let message = format!("WD promised a text within {millis} ms; none came");
            context.report(&rules::WATCHDOG_LATE, session.port, &[], message);
        }
    }
}
