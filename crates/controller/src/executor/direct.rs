//! The statement of DO: accepted, given up, counted. `robot::direct` carries it forward like a task.

use super::{Executor, Task};
use crate::prelude::*;
use crate::time::Time;
use scol_mini::{Diagnostic, Machine, compile_direct};
use ts3100_proto::status::sm::MAX_ENDED;

/// The statement of a DO command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direct {
    /// Its text.
    pub(crate) statement: String,
    /// Its machine.
    pub(crate) task: Task,
    /// When it was accepted.
    pub(crate) since: Time,
    /// It has begun something that takes time.
    pub(crate) begun: bool,
    /// It has moved the arm.
    pub(crate) moved: bool,
    /// The statement has ended but counts as running until then: the next DO is refused.
    pub(crate) shown_until: Option<Time>,
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

    /// Takes the statement out, to work with it.
    pub(crate) fn take_direct(&mut self) -> Option<Direct> {
        self.direct.take()
    }

    /// Puts it back.
    pub(crate) fn put_direct(&mut self, direct: Direct) {
        self.direct = Some(direct);
    }

    /// Whether a statement of DO is under way.
    pub(crate) fn has_direct(&self) -> bool {
        self.direct.is_some()
    }

    /// Ends an INPUT of the statement with the values received so far.
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
    pub(crate) fn count_direct(&mut self) {
        self.direct_ended = (self.direct_ended + 1) % (MAX_ENDED + 1);
    }
}
