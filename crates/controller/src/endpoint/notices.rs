//! SP, the text that tells a host about a stop it did not ask for (CMD-SP-05), and the watchdog of WD.
//!
//! The robot leaves a [`RunNotice`] when the program starts or stops; this module decides which hosts are told, and when.

use super::Endpoints;
use super::session::Session;
use crate::alarm;
use crate::findings::rules;
use crate::limits::MAX_SP_DELAY;
use crate::options::UnsolicitedSp;
use crate::port::Port;
use crate::robot::{Robot, RunNotice};
use crate::time::Time;
use crate::variation::Variation;
use ts3100_proto::reply::Reply;

impl Endpoints {
    /// Sends the SP texts that are due.
    pub(crate) fn tell_of_stops(&mut self, robot: &mut Robot) {
        self.take_notices(robot);
        if robot.panel.state().powered && !robot.persistence.is_pending() {
            self.release_sp(robot);
        }
    }

    /// When an SP may be sent that waits.
    pub(crate) fn sp_deadline(&self, robot: &Robot) -> Option<Time> {
        let silent = |session: &&Session| !self.line_is_taken(robot, session.port);
        let sessions = self.sessions.values().filter(silent);
        sessions.filter_map(Session::sp_due).min()
    }

    /// Notes in the sessions that the program has started or stopped.
    pub(crate) fn take_notices(&mut self, robot: &mut Robot) {
        for notice in core::mem::take(&mut robot.notices) {
            match notice {
                RunNotice::Stopped => self.announce_stop(robot),
                // The stop before this start is history: its SP must not be taken for one of the cycle that begins.
                RunNotice::Started => {
                    for session in self.sessions.values_mut() {
                        session.waiting_sp = false;
                    }
                }
            }
        }
    }

    /// An SP waits on every port whose host is to be told of stops (D7).
    fn announce_stop(&mut self, robot: &Robot) {
        let (now, rule) = (robot.now, robot.config.options.unsolicited_sp);
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
    pub(crate) fn disable_unsolicited_sp(&mut self, robot: &Robot, port: Port) {
        let auto = robot.config.options.unsolicited_sp == UnsolicitedSp::Auto;
        let session = self.session(port);
        session.never_told_of_stops = true;
        session.waiting_sp &= !auto;
    }

    /// Sends the SP texts that no open exchange holds back any more (CMD-SP-07).
    fn release_sp(&mut self, robot: &mut Robot) {
        for port in [Port::Host, Port::Ip0] {
            let due = self.session(port).sp_due().filter(|due| *due <= robot.now);
            if due.is_some() && !self.line_is_taken(robot, port) {
                self.send_sp(robot, port);
            }
        }
    }

    /// The same between two texts of a host that sends without waiting for answers.
    pub(crate) fn release_overdue_sp(&mut self, robot: &mut Robot, port: Port) {
        if self.session(port).sp_overdue(robot.now) {
            self.send_sp(robot, port);
        }
    }

    fn send_sp(&mut self, robot: &mut Robot, port: Port) {
        self.session(port).waiting_sp = false;
        self.send_text(robot, port, &Reply::Sp.encode());
    }

    /// Raises the alarm of WD, once, if its time is over.
    pub(crate) fn expire_watchdog(&mut self, robot: &mut Robot) {
        if let Some(watchdog) = robot.panel.take_late_watchdog(robot.now) {
            let millis = watchdog.timeout.as_millis();
            for session in self.sessions.values().filter(|session| session.peer.is_some()) {
                let message = format!("WD promised a text within {millis} ms; none came");
                robot.report(&rules::WATCHDOG_LATE, session.port, &[], message);
            }
            let detail = format!("no text of a host within {millis} ms");
            robot.raise(alarm::host_timeout(watchdog.level), detail);
        }
    }
}
