//! Everything the controller asks the embedding program to do, in order.
//!
//! Drain the outputs after every input. [`Event`]s are for logs, transcripts and findings.

use crate::action::error::ActionError;
use crate::findings::finding::Finding;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{Framing, Terminator};

/// One thing the edge is asked to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Output {
    /// Send these bytes in one write.
    Send {
        /// The port.
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
    /// The power came on again: links are to be made anew by [`crate::Controller::network`].
    PowerCycled,
    /// The connection of an Ethernet channel ends, on purpose. When it has ended the edge says so by
    /// [`Input::Disconnected`](crate::Input::Disconnected), as for any lost peer.
    Disconnect {
        /// The port.
        port: Port,
        /// How.
        how: DisconnectMode,
    },
    /// From now on nothing is read from the connection of an Ethernet channel and nothing written to it; it stays
    /// open until [`Output::Disconnect`].
    Stall {
        /// The port.
        port: Port,
    },
    /// The power went off: every link is to be closed until [`Output::PowerCycled`].
    PowerOff,
    /// Text shown on the teach pendant by PRINT.
    Pendant(String),
    /// Something worth a line in the log.
    Event(Event),
}

/// How a connection ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum DisconnectMode {
    /// By a reset (RST): what is under way is lost.
    Reset,
    /// In order (FIN): the peer reads what was sent, and then the end.
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
}

/// An event inside the controller, for logs, transcripts and findings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A text came in whole.
    TextIn {
        /// The port.
        port: Port,
        /// With or without STX.
        framing: Framing,
        /// Its data section.
        data: Bytes,
        /// The byte that ended it.
        terminator: Terminator,
    },
    /// A text goes out.
    TextOut {
        /// The port.
        port: Port,
        /// With or without STX.
        framing: Framing,
        /// Its data section.
        data: Bytes,
    },
    /// Bytes that belong to no text, or a text that was given up.
    Dropped {
        /// The port.
        port: Port,
        /// How many bytes.
        bytes: usize,
        /// Why.
        reason: &'static str,
    },
    /// A command was refused.
    Refused {
        /// The port.
        port: Port,
        /// The command's letters, or what stood in their place.
        command: String,
        /// Why, in words for the author of the host program.
        reason: String,
    },
    /// A command of the permission tables was answered.
    Answered {
        /// The port.
        port: Port,
        /// Its row in the tables: the letters, `RS,ERR` for the reset of alarms.
        row: &'static str,
        /// The master mode in which it came.
        mode: MasterMode,
        /// How.
        verdict: Verdict,
    },
    /// Something the manual advises against, or that the emulator forgave (D1).
    Finding(Finding),
    /// A fault on purpose was armed, or has fired.
    Fault {
        /// Its number.
        id: u32,
        /// Its kind.
        kind: &'static str,
        /// Where, if it has fired.
        port: Option<Port>,
        message: String,
        /// It has fired.
        fired: bool,
    },
    /// An alarm was raised.
    Alarm {
        /// `level-code`, for example `2-046`.
        number: String,
        /// Its text.
        text: String,
    },
    /// An [`Input::Action`](crate::Input::Action) had no effect; its caller gets the same as the result of
    /// [`Controller::handle`](crate::Controller::handle).
    ActionRefused(ActionError),
    /// All alarms were reset.
    AlarmsReset,
    /// The execution status changed.
    Status {
        /// The new status.
        status: ExecutionStatus,
        /// Line of the selected file at which the program stands.
        line: u32,
    },
    /// A statement begins; told only after [`Controller::trace`](crate::Controller::trace).
    Statement {
        /// Its line of the selected file.
        line: u32,
        /// ID of its task: 1 the main program, 0 the statement of DO.
        task: u16,
    },
    /// Servo power.
    Servo(bool),
    /// Servo power was turned on and comes only at this time (option `servo.interval`).
    ServoDelayed(Time),
    /// A program file was selected (or none).
    Selected(Option<String>),
}

impl Output {
    /// Its name in streams of events.
    pub fn kind(&self) -> &'static str {
        match self {
            Output::Send { .. } => "sent",
            Output::Persist { .. } => "keep",
            Output::Stored { .. } => "stored",
            Output::Erased { .. } => "erased",
            Output::PowerCycled => "power-on",
            Output::Disconnect { .. } => "closed",
            Output::Stall { .. } => "stalled",
            Output::PowerOff => "power-off",
            Output::Pendant(_) => "pendant",
            Output::Event(event) => event.kind(),
        }
    }

    /// The port it concerns, if one.
    pub fn port(&self) -> Option<Port> {
        match self {
            Output::Send { port, .. } | Output::Disconnect { port, .. } | Output::Stall { port } => {
                Some(*port)
            }
            Output::Event(event) => event.port(),
            Output::Persist { .. }
            | Output::Stored { .. }
            | Output::Erased { .. }
            | Output::PowerCycled
            | Output::PowerOff
            | Output::Pendant(_) => None,
        }
    }
}

impl Event {
    /// Its name in logs and streams of events.
    pub fn kind(&self) -> &'static str {
        match self {
            Event::TextIn { .. } => "text-in",
            Event::TextOut { .. } => "text-out",
            Event::Dropped { .. } => "dropped",
            Event::Refused { .. } => "refused",
            Event::Answered { .. } => "answered",
            Event::Finding(_) => "finding",
            Event::Fault { fired: true, .. } => "fault",
            Event::Fault { fired: false, .. } => "fault-armed",
            Event::Alarm { .. } => "alarm",
            Event::ActionRefused(_) => "action-refused",
            Event::AlarmsReset => "alarms-reset",
            Event::Status { .. } => "status",
            Event::Statement { .. } => "statement",
            Event::Servo(_) => "servo",
            Event::ServoDelayed(_) => "servo-delayed",
            Event::Selected(_) => "selected",
        }
    }

    /// The port it concerns, if one.
    pub fn port(&self) -> Option<Port> {
        match self {
            Event::TextIn { port, .. }
            | Event::TextOut { port, .. }
            | Event::Dropped { port, .. }
            | Event::Refused { port, .. }
            | Event::Answered { port, .. } => Some(*port),
            Event::Finding(Finding { port, .. }) | Event::Fault { port, .. } => *port,
            Event::Alarm { .. }
            | Event::ActionRefused(_)
            | Event::AlarmsReset
            | Event::Status { .. }
            | Event::Statement { .. }
            | Event::Servo(_)
            | Event::ServoDelayed(_)
            | Event::Selected(_) => None,
        }
    }
}
