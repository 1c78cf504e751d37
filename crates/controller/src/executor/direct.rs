//! The statement of DO: accepted, carried forward like a task, and shown as RUN for as long as a host may look for it.
//!
//! Commands begin it in `ops::operate`; `scheduler` calls `step_direct()`.

use super::{Executor, Task};
use crate::executor::scheduler::{Printed, Turn};
use crate::executor::step::Step;
use crate::port_facts::PortFacts;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use scol_mini::{Diagnostic, Machine, compile_direct};
use ts3100_proto::status::sm::MAX_ENDED;

/// The statement of a DO command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direct {
    /// Its text.
    pub(super) statement: String,
    /// Its machine.
    pub(super) task: Task,
    /// When it was accepted.
    pub(super) since: Time,
    /// It has begun something that takes time.
    pub(super) begun: bool,
    /// It has moved the arm.
    pub(super) moved: bool,
    /// The statement is over and counts as under way until then: the next DO is refused.
    pub(super) shown_until: Option<Time>,
}

impl Executor {
    /// Begins the statement, which sees the names of the selected file. With `keeps_height` its motion stays at the present
    /// height of the tool point (MP,1).
    ///
    /// # Errors
    /// Errors of the statement.
    pub(crate) fn begin_direct(
        &mut self,
        statement: &str,
        keeps_height: bool,
        now: Time,
    ) -> Result<(), Vec<Diagnostic>> {
        let program = compile_direct(statement, self.program())?;
        let mut task = Task::new(Machine::direct(program), now);
        task.keeps_height = keeps_height;
        self.run_shown_until = None;
        self.direct = Some(Direct {
            statement: statement.to_string(),
            task,
            since: now,
            begun: false,
            moved: false,
            shown_until: None,
        });
        Ok(())
    }

    /// Whether a statement of DO is under way.
    pub(crate) fn has_direct(&self) -> bool {
        self.direct.is_some()
    }

    /// An INPUT of the statement is over with what has come.
    pub(crate) fn cancel_direct_input(&mut self) {
        if let Some(mut direct) = self.direct.take() {
            direct.task.end_reading(self.memory_mut());
            self.direct = Some(direct);
        }
    }

    /// The statement is given up; it shows RUN until the arm rests (D7).
    pub(crate) fn end_direct(&mut self, rest: Time, now: Time) {
        self.cancel_direct_input();
        if let Some(direct) = &mut self.direct {
            // Not longer than it was to show RUN anyway, if it was over already.
            direct.shown_until = Some(direct.shown_until.unwrap_or(rest).min(rest).max(now));
        }
    }

    /// DO statements that have ended or were cut short since power-on, modulo 10 (SM field DC, hosts 8.1).
    pub(crate) fn direct_ended(&self) -> u8 {
        self.direct_ended
    }

    /// A DO statement that was under way has ended: a host that waits for it sees the count change (hosts 8.1).
    fn count_direct(&mut self) {
        self.direct_ended = (self.direct_ended + 1) % (MAX_ENDED + 1);
    }
}

impl Robot {
    /// Carries the statement of DO forward by one step.
    pub(super) fn step_direct(&mut self, ports: &dyn PortFacts) -> Turn {
        let shown = &mut self.executor.run_shown_until;
        if shown.take_if(|until| *until <= self.context.now).is_some() {
            self.report_status();
        }
        let Some(mut direct) = self.executor.direct.take() else {
            return Turn::Over;
        };
        if let Some(until) = direct.shown_until {
            let over = until <= self.context.now;
            if over {
                self.executor.count_direct();
                self.report_status();
            } else {
                self.executor.direct = Some(direct);
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
                self.executor.direct = Some(direct);
            }
            Step::Print { port, bytes } => {
                self.executor.direct = Some(direct);
                return Turn::Printed(Printed {
                    port,
                    bytes,
                    // It is no step of the program: step mode does not count it.
                    by_program: false,
                });
            }
            Step::Restore { names } => {
                self.executor.direct = Some(direct);
                self.restore_data(&names, true);
            }
            Step::Stopped | Step::Ended if direct.moved => {
                let until = direct.since + self.context.config.options.do_min_run;
                direct.shown_until = Some(until.max(self.context.now));
                self.executor.direct = Some(direct);
            }
            Step::Stopped | Step::Ended => self.leave_direct(&direct),
            Step::Trouble(code, detail) => {
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
        self.executor.run_shown_until = Some(until).filter(|until| *until > self.context.now);
        self.report_status();
    }
}
