//! Files that are kept outside too: a change of the RAM drive happens, and is answered, when whoever keeps them has said
//! that it is kept. Until then the controller stands still at this instant; a refusal leaves the drive as it was. What
//! changes files is in `ops`, `action` and `run`; where they are kept is the edge's matter.

use crate::Controller;
use crate::action::Action;
use crate::drive::DriveError;
use crate::input::Input;
use crate::output::Output;
use crate::port::Port;
use crate::time::Time;
use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use ts3100_proto::command::Command;
use ts3100_proto::name::FileName;

/// What waits for the answer. It is done once more with it: up to the change of the drive it has had no effect.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PendingChange {
    /// The end of a download.
    Download {
        port: Port,
        name: FileName,
        content: Vec<u8>,
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
    Answered(Result<(), String>),
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
    pub fn refusal(&self) -> Option<String> {
        match &self.state {
            State::Answered(Err(reason)) => Some(reason.clone()),
            State::Inside | State::Outside | State::Asked | State::Answered(Ok(())) => None,
        }
    }

    pub fn defer(&mut self, now: Time, input: Input) {
        self.deferred = Some(Box::new((now, input)));
    }
}

impl Controller {
    /// From now on every change of a file is asked for by [`Output::Persist`] first, and happens when [`Input::Persisted`] has
    /// come; or, with `false`, no longer.
    pub fn persist_outside(&mut self, outside: bool) {
        self.persistence.state = if outside { State::Outside } else { State::Inside };
    }

    /// A file is about to be stored, or with no content erased; every other reason against it was looked for before.
    ///
    /// # Errors
    /// [`DriveError::Unkept`]: it is not kept, or that is asked only now ([`Keeping::is_asked`]).
    pub(crate) fn persist(&mut self, name: &str, content: Option<&[u8]>) -> Result<(), DriveError> {
        let unkept = |reason: String| DriveError::NotPersisted {
            name: name.to_string(),
            reason,
        };
        match core::mem::replace(&mut self.persistence.state, State::Outside) {
            State::Inside => {
                self.persistence.state = State::Inside;
                Ok(())
            }
            State::Answered(answer) => answer.map_err(unkept),
            State::Outside | State::Asked => {
                self.persistence.state = State::Asked;
                self.push_output(Output::Persist {
                    name: name.to_string(),
                    content: content.map(<[u8]>::to_vec),
                });
                Err(unkept("nobody has answered".to_string()))
            }
        }
    }

    /// The answer has come: what waited for it goes on, and then what came at the same instant.
    pub(crate) fn persisted(&mut self, answer: Result<(), String>) {
        if !self.persistence.is_pending() {
            return;
        }
        self.persistence.state = State::Answered(answer);
        match self.persistence.held.take().map(|held| *held) {
            Some(PendingChange::Download {
                port,
                name,
                content,
                last,
            }) => self.end_download(port, name, content, &last),
            Some(PendingChange::Command {
                port,
                message,
                command,
            }) => self.answer_command(port, &message, command),
            Some(PendingChange::Action(action)) => self.act(action),
            Some(PendingChange::Restore { names, direct }) => self.restore_data(names, direct),
            None => {}
        }
        if let State::Answered(_) = self.persistence.state {
            self.persistence.state = State::Outside;
        }
        self.settle();
        for port in [Port::Host, Port::Ip0] {
            self.read_texts(port, false);
        }
        if self.persistence.is_pending() {
            return;
        }
        if let Some((now, input)) = self.persistence.deferred.take().map(|put_off| *put_off) {
            self.handle(now, input);
        }
    }
}

#[cfg(test)]
mod tests;
