//! Whether the program runs, and where it stands while it does not. Every change goes through [`Operation`]; who asks
//! for one is `run_control`'s, what the tasks do meanwhile is `scheduler`'s.
//!
//! Automatic operation (SU STATUS, SF-06):
//! ```text
//!            RN                     END (cycle mode), RS,PRG, RS,STP, SL
//!   Reset ---------> Running ------------------------------------------> Reset
//!                     ^   |
//!                  RN |   | SP, STOP, step and segment mode, alarm of level 2: the step ends  -> Continue
//!                     +---+ BREAK, servo off, emergency stop, alarm of level 4 or 8: at once  -> Retry
//! ```

/// Who wanted the program to stop: a host is not told of what it asked for (CMD-SP-09).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StopCause {
    /// A command of the host.
    Host,
    /// Anything else: panel, signal, alarm, end of the cycle.
    Other,
}

/// Automatic operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RunState {
    /// At step 1.
    Reset,
    /// Runs; with a wish, until the present step has ended.
    Running {
        /// Who wants it to stop, if anyone.
        stop: Option<StopCause>,
    },
    /// Stopped inside a step, which is done again.
    Retry,
    /// Stopped between steps.
    Continue,
}

/// Automatic operation: the state, and the only ways to change it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Operation {
    state: RunState,
}

impl Operation {
    /// A program at step 1.
    pub const RESET: Operation = Operation {
        state: RunState::Reset,
    };

    /// The state now.
    pub(crate) const fn state(self) -> RunState {
        self.state
    }

    /// Whether a program runs, even if it is to stop after its present step.
    pub(crate) const fn is_running(self) -> bool {
        matches!(self.state, RunState::Running { .. })
    }

    /// The program runs, or goes on.
    pub(crate) fn start(&mut self) {
        self.state = RunState::Running { stop: None };
    }

    /// A program that runs is to stop after its present step. The first cause stays: a host that asked is not told.
    pub(crate) fn request_stop(&mut self, cause: StopCause) {
        if self.state == (RunState::Running { stop: None }) {
            self.state = RunState::Running { stop: Some(cause) };
        }
    }

    /// The program stands: at its first step, inside a step, or between two.
    pub(crate) fn stand(&mut self, place: Standstill) {
        self.state = match place {
            Standstill::FirstStep => RunState::Reset,
            Standstill::InsideStep => RunState::Retry,
            Standstill::BetweenSteps => RunState::Continue,
        };
    }
}

/// Where a program stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standstill {
    /// At step 1: it begins anew.
    FirstStep,
    /// Inside a step, which is done again.
    InsideStep,
    /// Between two steps.
    BetweenSteps,
}
