//! Conditions that a caller can wait for (`/wait`, `/clock/advance-until`).
//!
//! A condition is tested against the controller after each input and against every output since the wait began, so a
//! state that comes and goes between two inputs is not missed. The driver keeps the pending waits and answers them
//! (`driver::control`); the control interface parses them.

use std::collections::VecDeque;
use std::time::Duration;
use ts3100_controller::Controller;
use ts3100_controller::action::IoKind;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_proto::status::ExecutionStatus;

/// Number of printed bytes that are searched for the text of [`WaitCondition::Printed`].
pub const PRINT_WINDOW: usize = 4_096;

/// What a caller waits for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WaitCondition {
    /// Never true; the wait ends after its timeout.
    Never,
    /// The execution status has this value.
    Status(ExecutionStatus),
    /// A digital line has this state.
    Signal {
        /// Whether it is an input or an output.
        kind: IoKind,
        /// Line number.
        line: u16,
        /// Expected state.
        on: bool,
    },
    /// The statement in this line (from 1) of the selected file started since the wait began.
    Statement(u32),
    /// A program printed this text since the wait began.
    Printed {
        /// Channel; `None` is the teach pendant.
        port: Option<Port>,
        /// Bytes to look for, anywhere in the printed data.
        text: Vec<u8>,
    },
    /// This alarm (or any alarm, for `None`) is active or was raised since the wait began.
    Alarm(Option<String>),
    /// No program runs, nothing moves and no exchange is open.
    Idle,
}

/// A condition with its timeout and what has been observed so far.
#[derive(Debug, Clone)]
pub struct Wait {
    /// Condition that ends the wait.
    pub condition: WaitCondition,
    /// Longest wait, in virtual time.
    pub timeout: Duration,
    /// Whether virtual time jumps from deadline to deadline during the wait, in every time mode.
    pub advance: bool,
    occurred: bool,
    printed: VecDeque<u8>,
}

impl Wait {
    /// A wait that starts now.
    #[must_use]
    pub fn new(condition: WaitCondition, within: Duration, advance: bool) -> Wait {
        Wait {
            condition,
            timeout: within,
            advance,
            occurred: false,
            printed: VecDeque::new(),
        }
    }

    /// Takes an output of the controller into account.
    pub fn observe(&mut self, output: &Output) {
        match (&self.condition, output) {
            (WaitCondition::Status(expected), Output::Event(Event::Status { status, .. })) => {
                self.occurred |= status == expected;
            }
            (WaitCondition::Statement(expected), Output::Event(Event::Statement { line, .. })) => {
                self.occurred |= line == expected;
            }
            (WaitCondition::Alarm(expected), Output::Event(Event::Alarm { number, .. })) => {
                self.occurred |= expected.as_ref().is_none_or(|expected| expected == number);
            }
            (
                WaitCondition::Printed {
                    port: Some(expected), ..
                },
                Output::Send { port, bytes },
            ) if expected == port => {
                let bytes = bytes.clone();
                self.observe_print(&bytes);
            }
            (WaitCondition::Printed { port: None, .. }, Output::Pendant(text)) => {
                self.observe_print(text.as_bytes());
            }
            _ => {}
        }
    }

    fn observe_print(&mut self, bytes: &[u8]) {
        self.printed.extend(bytes);
        let WaitCondition::Printed { text, .. } = &self.condition else {
            return;
        };
        let printed = self.printed.make_contiguous();
        self.occurred |= text.is_empty() || printed.windows(text.len()).any(|found| found == text);
        let surplus = self.printed.len().saturating_sub(PRINT_WINDOW);
        self.printed.drain(..surplus);
    }

    /// Whether the condition occurred since the wait began or is true now.
    #[must_use]
    pub fn is_met(&self, controller: &Controller) -> bool {
        self.occurred
            || match &self.condition {
                WaitCondition::Never | WaitCondition::Statement(_) | WaitCondition::Printed { .. } => false,
                WaitCondition::Status(expected) => controller.status() == *expected,
                WaitCondition::Signal { kind: side, line, on } => {
                    let signals = controller.signals();
                    *on == match side {
                        IoKind::Input => signals.input(*line),
                        IoKind::Output => signals.output(*line),
                    }
                }
                WaitCondition::Alarm(expected) => controller.alarms().active().iter().any(|alarm| {
                    expected
                        .as_ref()
                        .is_none_or(|expected| *expected == alarm.code.number())
                }),
                WaitCondition::Idle => controller.is_idle(),
            }
    }
}
