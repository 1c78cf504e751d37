//! The answer to a command before it is sent, from `ops` to the port.

use crate::persistence::Change;
use crate::prelude::*;
use crate::refusal::Refusal;
use ts3100_proto::file::{FlReceiver, FlSender};
use ts3100_proto::name::FileName;

/// The answer to a command before it is sent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Outcome {
    /// OK.
    Ok,
    /// NG.
    Ng(Refusal),
    /// FL with these texts.
    File(FlSender),
    /// OK, once this change of a file is made.
    Change(Box<Change>),
    /// OK, and the file's texts are awaited.
    Receive(FileName, FlReceiver),
}

impl Outcome {
    /// OK, or NG for the reason of the error.
    pub(crate) fn from_result(result: Result<(), impl Into<Refusal>>) -> Outcome {
        result.map_or_else(|error| Outcome::Ng(error.into()), |()| Outcome::Ok)
    }

    /// OK, at once or once the change is made, or NG.
    pub(crate) fn change(result: Result<Option<Change>, impl Into<Refusal>>) -> Outcome {
        match result {
            Ok(Some(change)) => Outcome::Change(Box::new(change)),
            Ok(None) => Outcome::Ok,
            Err(reason) => Outcome::Ng(reason.into()),
        }
    }

    /// FL with a body that is cut into texts as needed.
    pub(crate) fn file(content: Vec<u8>) -> Outcome {
        Outcome::File(FlSender::new(content))
    }
}
