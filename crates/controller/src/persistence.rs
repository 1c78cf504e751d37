//! Files that are stored outside too: a change of the RAM drive takes effect, and is answered, only after its owner has
//! said that it is stored.
//!
//! Until then the controller stands still at this instant; a refusal leaves the drive as it was. The driver of the
//! controller does the writing.

use crate::action::Action;
use crate::drive::PersistError;
use crate::input::Input;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::command::Command;
use ts3100_proto::name::FileName;

/// What waits for the answer. It is done once more with it: up to the change of the drive it has had no effect.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PendingChange {
    /// The end of a download.
    Download {
        port: Port,
        name: FileName,
        content: Bytes,
        /// The data of its last text.
        last: Vec<u8>,
    },
    /// ER, or MW that writes into the file.
    Command {
        port: Port,
        message: Vec<u8>,
        command: Command,
    },
    /// Something done by one who holds the controller.
    Action(Action),
    /// RESTORE.
    Restore {
        names: Vec<String>,
        /// By DO, not by the program.
        direct: bool,
    },
}

#[derive(Debug, Clone, PartialEq, Default)]
enum State {
    /// The files are kept nowhere else.
    #[default]
    Inside,
    /// Each change is asked for first.
    Outside,
    /// A change was asked for.
    Asked,
    /// The change that comes next was asked for, and this is the answer.
    Answered(Result<(), PersistError>),
}

/// Where a controller is between a change of a file and the answer to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Persistence {
    state: State,
    held: Option<Box<PendingChange>>,
    /// The input that came at the same instant, after what is held.
    deferred: Option<Box<(Time, Input)>>,
}

impl Persistence {
    /// Whether a change waits for its answer: nothing else goes on.
    pub fn is_pending(&self) -> bool {
        self.state == State::Asked
    }

    /// Whether changes are asked for.
    pub fn is_enabled(&self) -> bool {
        self.state != State::Inside
    }

    /// The change that was asked for is part of this.
    pub fn hold(&mut self, held: PendingChange) {
        self.held = Some(Box::new(held));
    }

    /// Why the change that was asked for is not kept.
    pub fn refusal(&self) -> Option<PersistError> {
        match &self.state {
            State::Answered(Err(reason)) => Some(reason.clone()),
            State::Inside | State::Outside | State::Asked | State::Answered(Ok(())) => None,
        }
    }

    pub fn defer(&mut self, now: Time, input: Input) {
        self.deferred = Some(Box::new((now, input)));
    }

    /// A file is about to be stored or erased; every other reason against it was looked for before.
    ///
    /// # Errors
    /// [`PersistError`]: it was not stored, or that is to be asked only now ([`Persistence::is_pending`]).
    pub fn ask(&mut self) -> Result<(), PersistError> {
        match core::mem::replace(&mut self.state, State::Outside) {
            State::Inside => {
                self.state = State::Inside;
                Ok(())
            }
            State::Answered(answer) => answer,
            State::Outside | State::Asked => {
                self.state = State::Asked;
                Err(PersistError::NoAnswer)
            }
        }
    }

    /// Whether each change is asked for first.
    pub fn set_outside(&mut self, outside: bool) {
        self.state = if outside { State::Outside } else { State::Inside };
    }

    /// The answer has come; what waited for it is to be done once more, with it.
    pub fn begin_answer(&mut self, answer: Result<(), PersistError>) -> Option<PendingChange> {
        self.state = State::Answered(answer);
        self.held.take().map(|held| *held)
    }

    /// What waited is done; an answer that it did not use is void.
    pub fn end_answer(&mut self) {
        if let State::Answered(_) = self.state {
            self.state = State::Outside;
        }
    }

    /// The input that came while the answer was awaited.
    pub fn take_deferred(&mut self) -> Option<(Time, Input)> {
        self.deferred.take().map(|deferred| *deferred)
    }
}

#[cfg(test)]
mod tests;
