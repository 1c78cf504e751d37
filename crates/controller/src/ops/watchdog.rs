//! WD: a host that promises to be heard in time, and the alarm when it is not (ste80722 S11). Every text of a host feeds
//! it, in `talk`.

use crate::Controller;
use crate::alarm;
use crate::findings::rules;
use crate::session::Outcome;
use crate::state::Watchdog;
use alloc::format;
use core::time::Duration;
use ts3100_proto::status::AlarmLevel;

impl Controller {
    /// WD: from now on a text is expected at least so often; without one an alarm of the level follows.
    pub(super) fn op_watchdog(&mut self, timeout_ms: u32, level: Option<AlarmLevel>) -> Outcome {
        self.state.watchdog = level.filter(|_| timeout_ms > 0).map(|level| Watchdog {
            timeout: Duration::from_millis(u64::from(timeout_ms)),
            level,
            fed_at: self.now,
        });
        Outcome::Ok
    }

    /// The watchdog's time is over: it barks once.
    pub(crate) fn expire_watchdog(&mut self) {
        let due = self
            .state
            .watchdog
            .as_ref()
            .is_some_and(|watchdog| watchdog.deadline() <= self.now);
        if let Some(watchdog) = self.state.watchdog.take_if(|_| due) {
            for port in self.protocol_peers() {
                let message = format!(
                    "WD promised a text within {} ms; none came",
                    watchdog.timeout.as_millis()
                );
                self.report(&rules::WATCHDOG_LATE, port, &[], message);
            }
            let detail = format!("no text of a host within {} ms", watchdog.timeout.as_millis());
            self.raise(alarm::host_timeout(watchdog.level), detail);
        }
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
            let bytes = alloc::format!("{text}\r\x03").into_bytes();
            robot.feed(
                Time::from_millis(millis),
                Input::Received {
                    port: Port::Ip0,
                    bytes,
                },
            );
            assert_eq!(robot.host_is_silent(), silent, "{text}");
        }
    }
}
