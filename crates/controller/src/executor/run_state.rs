//! Whether the program runs, and its place while it does not. Every change goes through [`Operation`]. `run_control`
//! asks for changes, `scheduler` runs the tasks meanwhile.
//!
//! Automatic operation (SU STATUS, SF-06):
//! ```text
//!            RN                     END (not in continuous mode)
//!   Reset ---------> Running ------------------------------------------> Reset
//!                     ^   |
//!                  RN |   | SP, STOP, step and segment mode, alarm of level 2: the step ends  -> Continue
//!                     +---+ BREAK, servo off, emergency stop, alarm of level 4 or 8: at once  -> Retry
//! ```
//! SP ends in Retry, too, where the step cannot end: in feed hold (CMD-FD-03) and while PAUSE holds the arm. BREAK ends in
//! Continue where the step was an INPUT, which any stop cancels (INP-09).
//!
//! Only resets move a stopped program (CMD-RS-10): RS,PRG, RS,STP, RS,SEL, SL and a download of the selected file lead
//! to Reset, RS,CYC to Continue at the step of its label. All of them are refused while it runs. An interrupted step is
//! never skipped otherwise: it is repeated, or its program starts from the beginning.

/// Who wanted the program to stop: a host gets no SP for a stop that it asked for (CMD-SP-09).
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
    /// Runs; with `stop`, only until the present step has ended.
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

    /// The program starts or continues.
    pub(crate) fn start(&mut self) {
        // A start would forget who wanted the program to stop.
        debug_assert!(!self.is_running(), "{:?} becomes Running", self.state);
        self.state = RunState::Running { stop: None };
    }

    /// Asks a running program to stop after its present step. The first cause stays: a host that asked first gets no SP, even
    /// if STOP is pressed before the step ends.
    pub(crate) fn request_stop(&mut self, cause: StopCause) {
        // A stop of a program that stands changes nothing (CMD-SP-04): the next start must not end with its first step.
        if self.state == (RunState::Running { stop: None }) {
            self.state = RunState::Running { stop: Some(cause) };
        }
    }

    /// Sets the place of the stopped program.
    pub(crate) fn stand(&mut self, place: Standstill) {
        self.state = match place {
            Standstill::FirstStep => RunState::Reset,
            Standstill::InsideStep => RunState::Retry,
            Standstill::BetweenSteps => RunState::Continue,
        };
    }
}

/// The place of a stopped program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standstill {
    /// At step 1: it starts from the beginning.
    FirstStep,
    /// Inside a step, which is done again.
    InsideStep,
    /// Between two steps.
    BetweenSteps,
}
