//! SP, the text that tells a host about a stop it did not ask for (CMD-SP-05), and the watchdog of WD.
//!
//! The controller says when the program starts or stops; this module decides which hosts are told, and when.

use super::Endpoints;
use super::session::Session;
use crate::context::Context;
use crate::findings::rules;
use crate::limits::MAX_SP_DELAY;
use crate::options::UnsolicitedSp;
use crate::port::Port;
use crate::time::Time;
use crate::variation::Variation;
use core::time::Duration;
use ts3100_proto::reply::Reply;

impl Endpoints {
    /// When an SP may be sent that waits.
    pub(crate) fn sp_deadline(&self, context: &Context) -> Option<Time> {
        let silent = |session: &&Session| !self.line_is_taken(context, session.port);
        let sessions = self.sessions.values().filter(silent);
        sessions.filter_map(Session::sp_due).min()
    }

    /// The program runs (again): the stop before this start is history, and its SP must not be taken for one of the cycle
    /// that begins.
    pub(crate) fn forget_stops(&mut self) {
        for session in self.sessions.values_mut() {
            session.waiting_sp = false;
        }
    }

    /// An SP waits on every port whose host is to be told of stops (D7).
    pub(crate) fn announce_stop(&mut self, context: &Context) {
        let (now, rule) = (context.now, context.config.options.unsolicited_sp);
        for session in self.sessions.values_mut() {
            let told = match rule {
                UnsolicitedSp::Auto => !session.never_told_of_stops,
                UnsolicitedSp::Always => true,
                UnsolicitedSp::Never => false,
            };
            if told && session.peer.is_some() {
                session.waiting_sp = true;
                let delay = self.variation.as_mut().map(Variation::sp_delay);
                session.sp_after = now + delay.unwrap_or_default();
                session.sp_by = now + MAX_SP_DELAY;
            }
        }
    }

    /// A text has come that only hosts send which take an SP for their next answer: under `auto` this one gets none.
    pub(crate) fn disable_unsolicited_sp(&mut self, context: &Context, port: Port) {
        let auto = context.config.options.unsolicited_sp == UnsolicitedSp::Auto;
        let session = self.session(port);
        session.never_told_of_stops = true;
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

    /// The same between two texts of a host that sends without waiting for answers.
    pub(crate) fn release_overdue_sp(&mut self, context: &mut Context, port: Port) {
        if self.session(port).sp_overdue(context.now) {
            self.send_sp(context, port);
        }
    }

    fn send_sp(&mut self, context: &mut Context, port: Port) {
        self.session(port).waiting_sp = false;
        self.send_text(context, port, &Reply::Sp.encode());
    }

    /// The time of WD is over: every host that is there has let it pass.
    pub(crate) fn report_late_watchdog(&self, context: &mut Context, timeout: Duration) {
        let millis = timeout.as_millis();
        for session in self.sessions.values().filter(|session| session.peer.is_some()) {
            let message = format!("WD promised a text within {millis} ms; none came");
            context.report(&rules::WATCHDOG_LATE, session.port, &[], message);
        }
    }
}
