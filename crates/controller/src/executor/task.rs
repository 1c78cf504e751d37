//! A task: a machine, what it is doing, and how many statements are left in its scan.
//!
//! How tasks take turns is in `scheduler`.

use crate::limits::STATEMENTS_PER_SCAN;
use crate::queries::TaskView;
use crate::time::Time;
use alloc::boxed::Box;
use alloc::vec::Vec;
use core::time::Duration;
use scol_mini::{Answer, Channel, Machine, Memory, Number};

/// What a task is doing.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TaskState {
    /// Nothing: the next statement may run.
    Ready,
    /// The statements of this scan are used up.
    Pausing {
        /// The next scan.
        until: Time,
    },
    /// A motion statement waits for the feed hold to end before it begins.
    Holding,
    /// A motion is under way.
    Moving {
        /// How long before its end the statement is over.
        lead: Duration,
    },
    /// A motion has been put behind the one under way (PASS); the statement becomes `Moving` when it begins.
    Queued {
        /// As of `Moving`.
        lead: Duration,
        /// The motion behind it is read when it begins.
        passing: bool,
    },
    /// The statement waits for the arm to rest before it begins.
    Resting,
    /// DELAY.
    Delaying {
        /// Its end.
        until: Time,
    },
    /// INPUT waits for values.
    Reading {
        /// Where from.
        channel: Channel,
        /// How many values it takes.
        wanted: usize,
        /// Those it has.
        got: Vec<Number>,
    },
    /// WAIT: its condition was false.
    Watching {
        /// When to look again; `None` when only something from outside can change it.
        again: Option<Time>,
    },
}

impl TaskState {
    /// Whether the statement has asked for something and waits for the answer.
    #[cfg(feature = "serde")]
    pub(super) fn needs_answer(&self) -> bool {
        match self {
            TaskState::Ready
            | TaskState::Pausing { .. }
            | TaskState::Resting
            | TaskState::Watching { .. } => false,
            TaskState::Holding
            | TaskState::Moving { .. }
            | TaskState::Queued { .. }
            | TaskState::Delaying { .. }
            | TaskState::Reading { .. } => true,
        }
    }

    /// The channel from which an INPUT waits for values.
    pub(super) fn channel(&self) -> Option<Channel> {
        if let TaskState::Reading { channel, .. } = self {
            return Some(*channel);
        }
        None
    }

    /// Whether the statement waits for its motion.
    #[must_use]
    pub fn is_motion(&self) -> bool {
        matches!(self, TaskState::Moving { .. } | TaskState::Queued { .. })
    }
}

/// A machine and what it is doing.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Task {
    /// The interpreter.
    pub machine: Machine,
    /// What it is doing.
    pub doing: TaskState,
    /// Statements left in the present scan.
    pub budget: u32,
    /// When the present scan began.
    pub scan_at: Time,
    /// What a monitor has begun; the task goes on behind it.
    pub handler: Option<Box<Task>>,
    /// When the monitors are to be looked at again, if time alone can change them.
    pub look_at: Option<Time>,
}

impl Task {
    /// A task that stands at its first statement.
    #[must_use]
    pub fn new(machine: Machine, now: Time) -> Task {
        Task {
            machine,
            doing: TaskState::Ready,
            budget: STATEMENTS_PER_SCAN,
            scan_at: now,
            handler: None,
            look_at: None,
        }
    }

    /// An INPUT that waits is over with the values that came (INP-09, INP-10); false if none waits.
    pub(super) fn end_reading(&mut self, memory: &mut Memory) -> bool {
        let TaskState::Reading { got, .. } = &self.doing else {
            return false;
        };
        // A value the variable cannot hold is lost with the INPUT.
        let answer = Answer::Cancelled(got.clone());
        if self.machine.answer(memory, answer).is_err() {
            self.machine.skip();
        }
        self.enter(TaskState::Ready);
        true
    }

    /// To the label `RCYCLE`; false (and nothing done) without one.
    pub(super) fn go_to_rcycle(&mut self) -> bool {
        let found = self.machine.go_to_rcycle();
        if found {
            self.enter(TaskState::Ready);
            self.handler = None;
        }
        found
    }

    /// The task as it is shown; nothing acts while its program does not run.
    pub(super) fn view(&self, runs: bool) -> TaskView {
        let acting = self.acting();
        let doing = match &acting.doing {
            TaskState::Ready => "ready",
            TaskState::Pausing { .. } => "running",
            TaskState::Holding => "held",
            TaskState::Moving { .. } => "moving",
            TaskState::Queued { .. } => "queued",
            TaskState::Resting => "resting",
            TaskState::Delaying { .. } => "delay",
            TaskState::Reading { .. } => "input",
            TaskState::Watching { .. } => "wait",
        };
        TaskView {
            id: self.id(),
            line: acting.machine.line(),
            doing: if runs { doing } else { "stopped" },
            reads: acting.doing.channel().filter(|_| runs),
        }
    }

    /// Does something else from here on: the only way to change what a task is doing.
    pub(crate) fn enter(&mut self, state: TaskState) {
        self.doing = state;
    }

    /// ID of the task: 1 the main program, 0 the statement of DO.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.machine.task_id()
    }

    /// The handler while it has something to do, otherwise the task itself.
    #[must_use]
    pub fn acting(&self) -> &Task {
        match self.handler.as_deref() {
            Some(handler) if handler.doing != TaskState::Ready => handler,
            _ => self,
        }
    }

    /// The task, and the handler in front of it.
    pub fn parts(&self) -> impl Iterator<Item = &Task> {
        core::iter::once(self).chain(self.handler.as_deref())
    }

    /// Whether nothing can become of the task at this instant: its statements are used up, and nothing is watched
    /// beside it.
    #[must_use]
    pub fn sleeps(&self, now: Time) -> bool {
        let watched = self.look_at.is_some() || self.machine.has_monitors();
        self.handler.is_none()
            && !watched
            && matches!(self.doing, TaskState::Pausing { until } if until > now)
    }

    /// When the task can go on by itself; nobody looks at its monitors while it is to stop, or while one acts.
    #[must_use]
    pub fn deadline(&self, stopping: bool) -> Option<Time> {
        let own = match &self.acting().doing {
            TaskState::Pausing { until } | TaskState::Delaying { until } => Some(*until),
            TaskState::Watching { again } => *again,
            TaskState::Ready
            | TaskState::Holding
            | TaskState::Moving { .. }
            | TaskState::Queued { .. }
            | TaskState::Resting
            | TaskState::Reading { .. } => None,
        };
        let look_at = self.look_at.filter(|_| !stopping && self.handler.is_none());
        own.into_iter().chain(look_at).min()
    }
}
