//! Carries the statement of DO forward like a task, and shows RUN for as long as a host may look for it.
//!
//! The statement itself is `executor::direct`; commands begin it in `ops::operate`; `scheduler` calls `step_direct()`.

use super::scheduler::{RunEffect, Turn};
use crate::executor::direct::Direct;
use crate::executor::step::Step;
use crate::port_facts::PortFacts;
use crate::robot::Robot;

impl Robot {
    /// Carries the statement of DO forward by one step.
    pub(crate) fn step_direct(&mut self, ports: &dyn PortFacts) -> Turn {
        if self.executor.end_shown_run(self.context.now) {
            self.report_status();
        }
        let Some(mut direct) = self.executor.take_direct() else {
            return Turn::Over;
        };
        if let Some(until) = direct.shown_until {
            let over = until <= self.context.now;
            if over {
                self.executor.count_direct();
                self.report_status();
            } else {
                self.executor.put_direct(direct);
            }
            return if over { Turn::Taken } else { Turn::Over };
        }
        // A stop does not end a DO: SP cancels its INPUT at once, and BREAK gives it up (`end_direct()`).
        let step = self.advance(ports, &mut direct.task, false, false);
        let turn = if matches!(step, Step::Blocked) {
            Turn::Over
        } else {
            Turn::Taken
        };
        direct.begun |= matches!(step, Step::Begun);
        direct.moved |= matches!(step, Step::Done { motion: true });
        match step {
            // Tasks are not started and ended by DO.
            Step::Blocked | Step::Begun | Step::Done { .. } | Step::Switch { .. } | Step::Killed { .. } => {
                self.executor.put_direct(direct);
            }
            Step::Print { port, bytes } => {
                self.executor.put_direct(direct);
                return Turn::Asks(RunEffect::Print {
                    port,
                    bytes,
                    // It is no step of the program: step mode does not count it.
                    by_program: false,
                });
            }
            Step::Restore { names } => {
                self.executor.put_direct(direct);
                return self.restore_data(&names, true);
            }
            Step::Stopped | Step::Ended if direct.moved => {
                let until = direct.since + self.context.config.options.do_min_run;
                direct.shown_until = Some(until.max(self.context.now));
                self.executor.put_direct(direct);
            }
            Step::Stopped | Step::Ended => self.leave_direct(&direct),
            Step::Alarm { code, detail, .. } => {
                self.raise(code, detail);
                self.leave_direct(&direct);
            }
        }
        turn
    }

    /// Ends a DO statement that moved nothing, or failed. DC counts it if it had begun something, and RUN is shown for
    /// `do.min_run` all the same: real hosts wait to see it (hosts 8.1, 8.10).
    fn leave_direct(&mut self, direct: &Direct) {
        if direct.begun || direct.moved {
            self.executor.count_direct();
        }
        let until = direct.since + self.context.config.options.do_min_run;
        self.executor.show_run(until, self.context.now);
        self.report_status();
    }
}
