//! RN SP BR SO FD EC DO IW WD: the commands that move the robot, stop it, set its lines, or watch over its host.
//!
//! Every text of a host feeds the watchdog (`controller::texts`); `controller::timers` ends it.

use super::refuse_if;
use crate::executor::StopCause;
use crate::executor::selection::render;
use crate::io::signals::Signals;
use crate::outcome::Outcome;
use crate::panel::{ControlRight, Watchdog};
use crate::refusal::{OperateError, Refusal};
use crate::robot::Robot;
use core::time::Duration;
use ts3100_proto::command::{InternalCommand, LineWrite};
use ts3100_proto::status::AlarmLevel;

impl Robot {
    /// SP: the present step ends, an INPUT that waits is cancelled (CMD-SP-03). In feed hold the step is left
    /// unfinished and will be done again (CMD-FD-03).
    pub(super) fn op_stop(&mut self) -> Outcome {
        self.panel.note_stop_request();
        if self.panel.state().feed_hold && self.executor.is_running() {
            self.interrupt(StopCause::Host);
            self.set_feed_hold(false);
        } else {
            self.stop_after_step(StopCause::Host);
            self.executor.cancel_direct_input();
        }
        Outcome::Ok
    }

    /// EC (CMD-EC-01 to CMD-EC-04).
    pub(super) fn op_internal(&mut self, internal: InternalCommand) -> Outcome {
        match internal {
            InternalCommand::Override(percent) => {
                self.set_override(percent);
                Outcome::Ok
            }
            InternalCommand::Mode(mode) => Outcome::from_result(self.set_run_mode(mode)),
            InternalCommand::Break => {
                self.panel.note_break_request();
                self.interrupt(StopCause::Host);
                Outcome::Ok
            }
        }
    }

    /// EM: who has the control right from now on, until EM or the panel changes it or the power goes off (T4).
    pub(super) fn op_give_control(&mut self, right: u8) -> Outcome {
        let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
        let Some(right) = rights.get(usize::from(right)) else {
            return Outcome::Ng(Refusal::NoSuchRight);
        };
        let refused = refuse_if([
            (self.executor.is_running(), Refusal::Running),
            (self.arm.is_jogging(), OperateError::Jogging.into()),
            (self.panel.state().feed_hold, OperateError::FeedHold.into()),
        ]);
        if let Err(reason) = refused {
            return Outcome::Ng(reason);
        }
        self.panel.give_control_right(*right);
        Outcome::Ok
    }

    /// DO, and MP as a MOVE: OK when the statement is accepted (CMD-DO-01 to CMD-DO-04, D7).
    pub(super) fn op_direct(&mut self, statement: &str, keeps_height: bool) -> Outcome {
        if let Err(reason) = refuse_if([
            (self.executor.program_runs(), Refusal::ProgramRuns),
            (self.arm.is_jogging(), OperateError::Jogging.into()),
            (self.executor.has_direct(), Refusal::DirectRuns),
            (!self.panel.state().servo, OperateError::ServoOff.into()),
            (self.panel.state().feed_hold, OperateError::FeedHold.into()),
        ]) {
            return Outcome::Ng(reason);
        }
        match self
            .executor
            .begin_direct(statement, keeps_height, self.context.now)
        {
            Ok(()) => {
                self.report_status();
                Outcome::Ok
            }
            Err(diagnostics) => Outcome::Ng(Refusal::Statement(render(diagnostics.iter(), statement, "DO"))),
        }
    }

    /// IW: all lines or none (CMD-IW-01 to CMD-IW-05). How many there may be is held by the command's grammar.
    pub(super) fn op_write_lines(&mut self, writes: &[LineWrite]) -> Outcome {
        let states = writes.iter().map(|write| (write.line, write.on));
        let bus = self.context.config.options.field_bus;
        let set = self.signals.set_user_outputs(states, bus);
        Outcome::from_result(set.map_err(|line| Refusal::NoOutput(Signals::no_output(line, bus))))
    }

    /// WD (ste80722 S11): from now on a text is expected at least so often; without one an alarm of the level follows.
    pub(super) fn op_watchdog(&mut self, timeout_ms: u32, level: Option<AlarmLevel>) -> Outcome {
        let watchdog = level.filter(|_| timeout_ms > 0).map(|level| Watchdog {
            timeout: Duration::from_millis(u64::from(timeout_ms)),
            level,
            fed_at: self.context.now,
        });
        self.panel.set_watchdog(watchdog);
        Outcome::Ok
    }
}

#[cfg(test)]
mod tests {
    use crate::prelude::*;
    use crate::{Config, Controller, Dialect, Input, Port, Time};

    #[test]
    fn time_is_not_jumped_over_while_a_host_has_promised_a_text() {
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
