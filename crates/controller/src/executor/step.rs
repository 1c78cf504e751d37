//! The result of carrying a task forward by one statement, or by one slice of statements.

use crate::alarm::{self, AlarmCode};
use crate::port::Port;
use crate::prelude::*;
use bytes::Bytes;
use scol_mini::{Fault, FaultKind};

/// How far a task came.
pub(crate) enum Step {
    /// It waits for something.
    Blocked,
    /// A statement has begun that takes time.
    Begun,
    /// The statement has ended.
    Done {
        /// It moved the arm.
        motion: bool,
    },
    /// The statement has ended, and with it the turn of its task.
    Switch {
        /// The task whose turn it is.
        to: u16,
    },
    /// The statement has ended its task.
    Killed {
        /// That task.
        id: u16,
    },
    /// RESTORE has ended as a statement; the file is written once every task has reached its place.
    Restore {
        /// Names to restore; none: all.
        names: Vec<String>,
    },
    /// PRINT has ended as a statement; send these bytes.
    Print { port: Port, bytes: Bytes },
    /// STOP was executed.
    Stopped,
    /// The main program, or the statement of DO, has ended.
    Ended,
    /// Something went wrong; the detail says what and where.
    Alarm {
        code: AlarmCode,
        /// File line of the statement at fault; `None` if it is not the one that the task is at.
        line: Option<u32>,
        detail: String,
    },
}

impl Step {
    /// A statement without motion has ended.
    pub(crate) const DONE: Step = Step::Done { motion: false };

    /// The alarm of a statement.
    pub(crate) fn fault(fault: &Fault) -> Step {
        Step::Alarm {
            code: alarm_of(fault.kind),
            line: Some(fault.line),
            detail: format!("{fault}"),
        }
    }

    /// The alarm of a monitor: its ON may be in another call than the statement that it interrupts.
    pub(crate) fn monitor_fault(fault: &Fault) -> Step {
        Step::Alarm {
            code: alarm_of(fault.kind),
            line: None,
            detail: format!("{fault}"),
        }
    }

    /// Replaces `Done` by `next`; other steps are unchanged.
    pub(crate) fn then(self, next: Step) -> Step {
        if matches!(self, Step::Done { .. }) {
            next
        } else {
            self
        }
    }
}

/// The alarm of a fault of the program.
fn alarm_of(kind: FaultKind) -> AlarmCode {
    match kind {
        FaultKind::DivisionByZero => alarm::DIVISION_BY_ZERO,
        FaultKind::Undefined => alarm::UNDEFINED_VARIABLE,
        FaultKind::Type => alarm::TYPE_MISMATCH,
        FaultKind::Range => alarm::OUT_OF_RANGE,
        FaultKind::Subscript => alarm::SUBSCRIPT,
        FaultKind::Nesting => alarm::NESTING,
        FaultKind::Overflow => alarm::OVERFLOW,
        FaultKind::NextWithoutFor => alarm::NEXT_WITHOUT_FOR,
        FaultKind::Domain => alarm::DOMAIN,
    }
}
