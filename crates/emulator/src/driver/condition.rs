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
pub const KEPT_PRINT: usize = 4_096;

/// Something that may happen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Condition {
    /// Nothing: only time passes.
    Never,
    /// The execution status is this.
    Status(ExecutionStatus),
    /// A line shows this state.
    Signal {
        /// Input or output.
        side: IoKind,
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
    pub condition: Condition,
    /// For so much virtual time.
    pub within: Duration,
    /// Time jumps from deadline to deadline until then, whatever the mode.
    pub advance: bool,
    seen: bool,
    printed: VecDeque<u8>,
}

impl Wait {
    /// Nothing has been seen yet.
    #[must_use]
    pub fn new(condition: Condition, within: Duration, advance: bool) -> Wait {
        Wait {
            condition,
            within,
            advance,
            seen: false,
            printed: VecDeque::new(),
        }
    }

    /// Something was put out.
    pub fn observe(&mut self, output: &Output) {
        match (&self.condition, output) {
            (Condition::Status(wanted), Output::Event(Event::Status { status, .. })) => {
                self.seen |= *status == words(*wanted);
            }
            (Condition::Statement(wanted), Output::Event(Event::Statement { line, .. })) => {
                self.seen |= line == wanted;
            }
            (Condition::Alarm(wanted), Output::Event(Event::Alarm { number, .. })) => {
                self.seen |= wanted.as_ref().is_none_or(|wanted| wanted == number);
            }
            (
                Condition::Printed {
                    port: Some(wanted), ..
                },
                Output::Send { port, bytes },
            ) if wanted == port => {
                let bytes = bytes.clone();
                self.print(&bytes);
            }
            (Condition::Printed { port: None, .. }, Output::Pendant(text)) => self.print(text.as_bytes()),
            _ => {}
        }
    }

    fn print(&mut self, bytes: &[u8]) {
        self.printed.extend(bytes);
        let Condition::Printed { text, .. } = &self.condition else {
            return;
        };
        let printed = self.printed.make_contiguous();
        self.seen |= text.is_empty() || printed.windows(text.len()).any(|found| found == text);
        let surplus = self.printed.len().saturating_sub(KEPT_PRINT);
        self.printed.drain(..surplus);
    }

    /// Whether it has happened, or holds now.
    #[must_use]
    pub fn is_met(&self, controller: &Controller) -> bool {
        self.seen
            || match &self.condition {
                Condition::Never | Condition::Statement(_) | Condition::Printed { .. } => false,
                Condition::Status(wanted) => controller.status() == *wanted,
                Condition::Signal { side, line, on } => {
                    let signals = controller.signals();
                    *on == match side {
                        IoKind::Input => signals.input(*line),
                        IoKind::Output => signals.output(*line),
                    }
                }
                Condition::Alarm(wanted) => controller.alarms().active().iter().any(|alarm| {
                    wanted
                        .as_ref()
                        .is_none_or(|wanted| *wanted == alarm.code.number())
                }),
                Condition::Idle => controller.is_idle(),
            }
    }
}

/// The manual's words for an execution status, as events tell it.
#[must_use]
pub fn words(status: ExecutionStatus) -> &'static str {
    match status {
        ExecutionStatus::Reset => "stop (reset)",
        ExecutionStatus::Running => "running",
        ExecutionStatus::Retry => "stop (retry)",
        ExecutionStatus::Continue => "stop (continue)",
    }
}
