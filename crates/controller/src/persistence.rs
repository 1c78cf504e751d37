//! Files that are stored outside too: a change of the RAM drive takes effect, and is answered, only after its owner has
//! said that it is stored.
//!
//! Whoever changes a file checks everything that can be checked, and proposes the change with what is left to do. Where
//! files are kept inside alone it is made at once; otherwise it waits here, the controller stands still at this instant,
//! and the answer makes the change or drops it. Either way `then` is done once. The driver does the writing.

use crate::asked_command::AskedCommand;
use crate::drive::Staged;
use crate::port::Port;
use crate::prelude::*;
use alloc::sync::Arc;
use bytes::Bytes;
use scol_mini::{Program, Value};
use ts3100_proto::name::VariableName;

/// A change of the drive that nothing speaks against, and what changes with it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    pub staged: Staged,
    /// The selected file has other initial values: what runs of it goes on in this program.
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
    /// Tell the owner what became of an action at this place.
    Resolve { place: String },
    /// Go on after RESTORE: of DO, or of the program.
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
    /// Whether a change waits for its answer: nothing else goes on.
    pub fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// Whether changes are stored outside first.
    pub fn is_outside(&self) -> bool {
        self.outside
    }

    /// Has a change wait for the answer of the one who stores it.
    pub fn wait(&mut self, waiting: Waiting) {
        debug_assert!(self.waiting.is_none(), "two changes at one instant");
        self.waiting = Some(Box::new(waiting));
    }

    /// Whether each change is to be stored outside first.
    pub fn set_outside(&mut self, outside: bool) {
        self.outside = outside;
    }

    /// The answer has come for what waits.
    pub fn take_waiting(&mut self) -> Option<Waiting> {
        self.waiting.take().map(|waiting| *waiting)
    }
}

#[cfg(test)]
mod tests;
