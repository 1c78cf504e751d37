//! The result of carrying a task forward by one statement, or by one slice of statements.

use crate::alarm::{self, AlarmCode};
use crate::port::Port;
use crate::prelude::*;
use bytes::Bytes;
use scol_mini::FaultKind;

/// How far a task came.
pub(crate) enum Step {
    /// It waits for something.
    Blocked,
    /// A statement has begun that takes time.
    Begun,
    /// A statement is over.
    Done {
        /// It moved the arm.
        motion: bool,
    },
    /// A statement is over, and with it the turn of its task.
    Switch {
        /// The task whose turn it is.
        to: u16,
    },
    /// A statement is over that ends a task.
    Killed {
        /// That task.
        id: u16,
    },
    /// RESTORE is over as a statement; the file is written when every task stands in its place.
    Restore {
        /// Names to restore; none: all.
        names: Vec<String>,
    },
    /// PRINT is over as a statement; these bytes are to be sent.
    Print {
        /// Where.
        port: Port,
        /// What.
        bytes: Bytes,
    },
    /// STOP was executed.
    Stopped,
    /// The main program, or the statement of DO, is over.
    Ended,
    /// Something went wrong; the detail says what and where.
    Alarm(AlarmCode, String),
}

impl Step {
    /// A statement without motion is over.
    pub(crate) const DONE: Step = Step::Done { motion: false };

    /// If the statement is over, this comes of it.
    pub(crate) fn then(self, next: Step) -> Step {
        if matches!(self, Step::Done { .. }) {
            next
        } else {
            self
        }
    }
}

/// The alarm of a fault of the program.
pub(crate) fn alarm_of(kind: FaultKind) -> AlarmCode {
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
