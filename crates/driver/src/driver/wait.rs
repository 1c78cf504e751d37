//! A wait of a caller for a condition (`/wait`, `/clock/advance-until`).
//!
//! [`ts3100_controller::Condition`] defines the conditions and when they happen. The driver keeps the pending waits and
//! answers them (`driver::control`); the control interface reads them.

use std::time::Duration;
use ts3100_controller::{Condition, ConditionWatch, Controller, Input, Output};

/// A condition with its timeout and its observations so far.
#[derive(Debug, Clone)]
pub struct Wait {
    /// Longest wait, in virtual time.
    pub timeout: Duration,
    /// Whether virtual time jumps from deadline to deadline during the wait, in every time mode.
    pub advance: bool,
    /// `None` waits for the timeout.
    watch: Option<ConditionWatch>,
    occurred: bool,
}

impl Wait {
    /// A wait that starts now. It ends when the condition happens, or at once if it is a state that holds already;
    /// without a condition only after `within`.
    pub fn new(condition: Option<Condition>, within: Duration, advance: bool) -> Wait {
        Wait {
            timeout: within,
            advance,
            watch: condition.map(ConditionWatch::new),
            occurred: false,
        }
    }

    /// The condition, if it waits for one.
    pub fn condition(&self) -> Option<&Condition> {
        self.watch.as_ref().map(ConditionWatch::condition)
    }

    /// Takes an input of the controller into account.
    pub fn observe_input(&mut self, input: &Input) {
        self.occurred |= self.watch.as_mut().is_some_and(|watch| watch.input(input));
    }

    /// Takes an output of the controller into account.
    pub fn observe_output(&mut self, output: &Output) {
        self.occurred |= self.watch.as_mut().is_some_and(|watch| watch.output(output));
    }

    /// Whether it needs the event of each statement.
    pub fn wants_statements(&self) -> bool {
        let condition = self.watch.as_ref().map(ConditionWatch::condition);
        matches!(condition, Some(Condition::Statement(_)))
    }

    /// Whether the condition occurred since the wait began or is true now.
    pub fn is_met(&self, controller: &Controller) -> bool {
        let condition = self.watch.as_ref().map(ConditionWatch::condition);
        self.occurred || condition.and_then(|condition| condition.holds(controller)) == Some(true)
    }
}
