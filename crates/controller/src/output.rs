//! Everything the controller asks the embedding program to do, in order.
//!
//! Drain the outputs after every input. [`Event`]s are for logs, transcripts and findings.

use crate::action_error::ActionError;
use crate::event_form;
use crate::finding::Finding;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use crate::told::StatementDetail;
use bytes::Bytes;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{Framing, Terminator};

/// One thing the edge is asked to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Output {
    /// Send these bytes in one write.
    Send {
        port: Port,
        /// The bytes, at most [`crate::limits::MAX_SEND`].
        bytes: Bytes,
    },
    /// A file of the RAM drive is about to be stored or erased: keep it so, whole or not at all, and answer by
    /// [`Input::Persisted`](crate::Input::Persisted). Only after [`Controller::persist_outside`](crate::Controller::persist_outside).
    Persist {
        /// Its name, upper case.
        name: String,
        /// Its content without EOF; none: it is erased.
        content: Option<Bytes>,
    },
    /// A file of the RAM drive was stored.
    Stored {
        /// Its name, upper case.
        name: String,
        /// Its content without EOF.
        content: Bytes,
    },
    /// A file of the RAM drive was erased.
    Erased {
        /// Its name, upper case.
        name: String,
    },
    /// The power came on again: reopen the links of [`crate::Controller::network`].
    PowerCycled,
    /// The connection of an Ethernet channel ends, on purpose. When it has ended the edge says so by
    /// [`Input::Disconnected`](crate::Input::Disconnected), as for any lost peer.
    Disconnect {
        port: Port,
        /// Reset or orderly close.
        how: DisconnectMode,
    },
    /// From now on nothing is read from the connection of an Ethernet channel and nothing written to it; it stays
    /// open until [`Output::Disconnect`].
    Stall { port: Port },
    /// The power went off: keep every link closed until [`Output::PowerCycled`].
    PowerOff,
    /// Text shown on the teach pendant by PRINT.
    Pendant(String),
    /// Something worth a line in the log.
    Event(Event),
}

/// How a connection ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum DisconnectMode {
    /// By a reset (RST): bytes under way are lost.
    Reset,
    /// In order (FIN): the peer reads all sent bytes, then the end.
    Close,
}

ts3100_proto::codes! {
    /// How a command was answered.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Verdict {
        /// OK or FL.
        Served = "served",
        /// NG: the permission table does not have it valid in this mode, or not while the robot runs.
        NotValid = "not-valid",
        /// NG for another reason.
        Refused = "refused",
    }
    /// Its word in events and metrics.
    fn as_str -> &'static str;
    impl Word;
}

/// An event inside the controller, for logs, transcripts and findings. The control interface publishes its serde form:
/// the order of the fields is the order of the keys.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A text came in whole.
    TextIn {
        port: Port,
        /// With or without STX.
        #[serde(skip)]
        framing: Framing,
        /// Its data section.
        #[serde(flatten, serialize_with = "event_form::bytes")]
        data: Bytes,
        /// The byte that ended it.
        #[serde(skip)]
        terminator: Terminator,
    },
    /// A text goes out.
    TextOut {
        port: Port,
        /// With or without STX.
        #[serde(skip)]
        framing: Framing,
        /// Its data section.
        #[serde(flatten, serialize_with = "event_form::bytes")]
        data: Bytes,
    },
    /// Bytes that belong to no text, or a text that was given up.
    Dropped {
        port: Port,
        /// How many bytes.
        bytes: usize,
        reason: &'static str,
    },
    /// A command was refused.
    Refused {
        port: Port,
        /// The letters of the command, or the characters in their place.
        command: String,
        /// Why, in words for the author of the host program.
        reason: String,
    },
    /// A command of the permission tables was answered.
    Answered {
        port: Port,
        /// Its row in the tables: the letters, `RS,ERR` for the reset of alarms.
        #[serde(rename = "command")]
        row: &'static str,
        /// The master mode in which it came.
        #[serde(serialize_with = "event_form::word")]
        mode: MasterMode,
        /// Outcome of the command.
        #[serde(rename = "outcome", serialize_with = "event_form::word")]
        verdict: Verdict,
    },
    /// Something the manual advises against, or that the emulator forgave (D1).
    Finding(Finding),
    /// An alarm was raised.
    Alarm {
        text: String,
        /// `level-code`, for example `2-046`.
        number: String,
    },
    /// An action of the owner ([`Input::Action`](crate::Input::Action)) had no effect; its caller gets the same as the result of
    /// [`Controller::handle`](crate::Controller::handle).
    ActionRefused(ActionError),
    /// All alarms were reset.
    AlarmsReset,
    /// The execution status changed.
    Status {
        /// The new status.
        #[serde(serialize_with = "event_form::word")]
        status: ExecutionStatus,
        /// Current line of the selected file.
        line: u32,
    },
    /// A statement begins; told only after [`Controller::trace`](crate::Controller::trace).
    Statement {
        /// Its line of the selected file.
        line: u32,
        /// ID of its task: 1 the main program, 0 the statement of DO.
        task: u16,
        /// The value before it of what is watched ([`Controller::watch`](crate::Controller::watch)).
        #[serde(skip_serializing_if = "Option::is_none")]
        seen: Option<String>,
        /// What it did, after [`Controller::tell_effects`](crate::Controller::tell_effects).
        #[serde(skip)]
        detail: Option<Box<StatementDetail>>,
    },
    /// A breakpoint with a message was reached; the program continues.
    Breakpoint {
        /// Its line of the selected file.
        line: u32,
        /// ID of the task that came to it.
        task: u16,
        /// The message, with the values of its expressions.
        text: String,
    },
    /// Servo power.
    Servo(#[serde(serialize_with = "event_form::servo")] bool),
    /// Servo power was turned on and comes only at this time (option `servo.interval`).
    ServoDelayed(#[serde(serialize_with = "event_form::servo_delayed")] Time),
    /// A program file was selected (or none).
    Selected(#[serde(serialize_with = "event_form::selected")] Option<String>),
    /// A fault on purpose was armed, or has fired.
    // Two kinds of event: `fired` writes which. Serde wants such a variant to be the last.
    #[serde(untagged)]
    Fault {
        /// It has fired.
        #[serde(rename = "event", serialize_with = "event_form::fault")]
        fired: bool,
        /// Where, if it has fired.
        #[serde(skip_serializing_if = "Option::is_none")]
        port: Option<Port>,
        message: String,
        /// Its number.
        #[serde(rename = "number", serialize_with = "event_form::text")]
        id: u32,
        kind: &'static str,
    },
}

impl Event {
    /// The bytes that it is about, if it is about bytes.
    pub fn bytes_mut(&mut self) -> Option<&mut Bytes> {
        if let Event::TextIn { data, .. } | Event::TextOut { data, .. } = self {
            Some(data)
        } else if let Event::Finding(finding) = self {
            Some(&mut finding.bytes)
        } else {
            None
        }
    }
}
