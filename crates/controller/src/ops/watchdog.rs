//! WD: a host promises to send a text within a time, and an alarm follows if it does not (ste80722 S11).
//!
//! Every text of a host feeds the watchdog (`endpoint::exchange`); `endpoint::notices` ends it.

use super::Outcome;
use crate::panel::Watchdog;
use crate::robot::Robot;
use core::time::Duration;
use ts3100_proto::status::AlarmLevel;

impl Robot {
    /// WD: from now on a text is expected at least so often; without one an alarm of the level follows.
    pub(super) fn op_watchdog(&mut self, timeout_ms: u32, level: Option<AlarmLevel>) -> Outcome {
        let watchdog = level.filter(|_| timeout_ms > 0).map(|level| Watchdog {
            timeout: Duration::from_millis(u64::from(timeout_ms)),
            level,
            fed_at: self.now,
        });
        self.panel.set_watchdog(watchdog);
        Outcome::Ok
    }
}

#[cfg(test)]
mod tests {
    use crate::{Config, Controller, Dialect, Input, Port, Time};
    use alloc::vec::Vec;

    #[test]
    fn time_is_not_jumped_over_while_a_host_has_promised_to_be_heard() {
        let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        robot.feed(
            Time::ZERO,
            Input::Connected {
                port: Port::Ip0,
                peer: "test".into(),
            },
        );
        for (millis, text, silent) in [(1, "WD,60000 2", false), (2, "WD,0 0", true)] {
            let bytes = format!("{text}\r\x03").into_bytes();
            robot.feed(Time::from_millis(millis), Input::received(Port::Ip0, bytes));
            assert_eq!(robot.host_is_silent(), silent, "{text}");
        }
    }
}
