//! What a caller may wait for. A condition looks at the controller as it stands after an input, and at what it has
//! put out since the wait began, so that nothing that comes and goes in between is missed.

use std::collections::VecDeque;
use std::time::Duration;
use ts3100_controller::Controller;
use ts3100_controller::action::IoKind;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_proto::status::ExecutionStatus;

/// Bytes of what was printed that are kept for [`Condition::Printed`].
pub const PRINT_WINDOW: usize = 4_096;

/// Something that may happen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WaitCondition {
    /// Nothing: only time passes.
    Never,
    /// The execution status is this.
    Status(ExecutionStatus),
    /// A line shows this state.
    Signal {
        /// Input or output.
        kind: IoKind,
        /// Its number.
        line: u16,
        /// The state.
        on: bool,
    },
    /// The statement in this line of the selected file has begun since.
    Statement(u32),
    /// This text was printed since, on a channel or, without one, on the teach pendant.
    Printed {
        /// Where.
        port: Option<Port>,
        /// The bytes.
        text: Vec<u8>,
    },
    /// This alarm, or without a number any, is active or was raised since.
    Alarm(Option<String>),
    /// Nothing runs, nothing moves, no exchange is open.
    Idle,
}

/// A condition, what has been seen of it, and for how long it is looked for.
#[derive(Debug, Clone)]
pub struct Wait {
    /// What is looked for.
    pub condition: WaitCondition,
    /// For so much virtual time.
    pub timeout: Duration,
    /// Time jumps from deadline to deadline until then, whatever the mode.
    pub advance: bool,
    occurred: bool,
    printed: VecDeque<u8>,
}

impl Wait {
    /// Nothing has been seen yet.
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

    /// Something was put out.
    pub fn observe(&mut self, output: &Output) {
        match (&self.condition, output) {
            (WaitCondition::Status(expected), Output::Event(Event::Status { status, .. })) => {
                self.occurred |= *status == status_description(*expected);
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
                self.observe_print(text.as_bytes())
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

    /// Whether it has happened, or holds now.
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

/// The manual's words for an execution status, as events tell it.
#[must_use]
pub fn status_description(status: ExecutionStatus) -> &'static str {
    match status {
        ExecutionStatus::Reset => "stop (reset)",
        ExecutionStatus::Running => "running",
        ExecutionStatus::Retry => "stop (retry)",
        ExecutionStatus::Continue => "stop (continue)",
    }
}
