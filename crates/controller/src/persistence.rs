//! Files that are stored outside too: a change of the RAM drive takes effect, and is answered, only after its owner has
//! said that it is stored.
//!
//! The code that changes a file first checks everything that it can, then proposes the change with the work that is
//! left. Where files are kept inside alone it is made at once; otherwise it waits here, the controller stands still at
//! this instant, and the answer makes the change or drops it. Either way `then` is done once. The driver does the
//! writing.

use crate::asked_command::AskedCommand;
use crate::drive::Staged;
use crate::port::Port;
use crate::prelude::*;
use alloc::sync::Arc;
use bytes::Bytes;
use scol_mini::{Program, Value};
use ts3100_proto::name::VariableName;

/// A validated change of the drive, and its consequences.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    pub staged: Staged,
    /// The selected file has other initial values: its tasks continue in this program.
    pub program: Option<Arc<Program>>,
    /// The variable of MW, which counts only when the file is on the drive (CMD-MW-02).
    pub variable: Option<(VariableName, Value)>,
}

impl From<Staged> for Change {
    fn from(staged: Staged) -> Change {
        Change {
            staged,
            program: None,
            variable: None,
        }
    }
}

/// The rest of the work, once a change has been made or refused.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Then {
    /// Answer the last text of a download; `last` is its data.
    AnswerDownload { port: Port, last: Bytes },
    /// Answer ER, or MW that writes into the file.
    AnswerCommand(Box<AskedCommand>),
    /// Report the outcome of an action at this place to the owner.
    Resolve { place: String },
    /// Continue after RESTORE: of DO, or of the program.
    Restored { direct: bool },
}

/// A change that is being stored outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Waiting {
    pub change: Change,
    pub then: Then,
}

/// Where a controller is between a change of a file and the answer to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Persistence {
    outside: bool,
    waiting: Option<Box<Waiting>>,
}

impl Persistence {
    /// Whether a change waits for its answer; everything else is suspended.
    pub fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// Whether changes are stored outside first.
    pub fn is_outside(&self) -> bool {
        self.outside
    }

    /// Suspends a change until the store has answered.
    pub fn wait(&mut self, waiting: Waiting) {
        debug_assert!(self.waiting.is_none(), "two changes at one instant");
        self.waiting = Some(Box::new(waiting));
    }

    /// Whether each change has to be stored outside first.
    pub fn set_outside(&mut self, outside: bool) {
        self.outside = outside;
    }

    /// Takes the waiting change, whose answer has come.
    pub fn take_waiting(&mut self) -> Option<Waiting> {
        self.waiting.take().map(|waiting| *waiting)
    }
}

#[cfg(test)]
mod tests;
