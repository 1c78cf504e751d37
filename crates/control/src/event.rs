//! One event as a JSON document: what a host sent, what the controller sent, and what the controller reported.
//!
//! The stream `/events` and `/findings` serialize what the journal keeps. What the controller reports has its serde form
//! there ([`Event`]); this file has the events around it, and the schema of the document.

use serde::{Serialize, Serializer};
use ts3100_controller::findings::Finding;
use ts3100_controller::{Bytes, Event, Input, Output, Port, Time, event_form};

/// Something that happened, without its number and its moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum JournalEvent {
    Connected {
        port: Port,
        peer: String,
    },
    Disconnected {
        port: Port,
    },
    Received {
        port: Port,
        #[serde(flatten, serialize_with = "event_form::bytes")]
        data: Bytes,
    },
    Sent {
        port: Port,
        #[serde(flatten, serialize_with = "event_form::bytes")]
        data: Bytes,
    },
    /// A change of a file is about to be stored outside.
    Keep,
    Stored {
        /// Length of the content, which is not kept.
        bytes: usize,
        file: String,
    },
    Erased {
        file: String,
    },
    PowerOn,
    PowerOff,
    Closed {
        port: Port,
    },
    Stalled {
        port: Port,
    },
    Pendant {
        text: String,
    },
    Restored,
    Reset,
    #[serde(untagged)]
    Controller(Event),
}

impl JournalEvent {
    /// The event of an input. Panel actions are reported by their effects, ticks not at all.
    pub fn from_input(input: &Input) -> Option<JournalEvent> {
        match input {
            Input::Received { port, bytes } => Some(JournalEvent::Received {
                port: *port,
                data: bytes.clone(),
            }),
            Input::Connected { port, peer } => Some(JournalEvent::Connected {
                port: *port,
                peer: peer.clone(),
            }),
            Input::Disconnected { port } => Some(JournalEvent::Disconnected { port: *port }),
            Input::Tick
            | Input::SerialOpened { .. }
            | Input::SerialPurged { .. }
            | Input::SerialErrors { .. }
            | Input::SecondPeer { .. }
            | Input::Backlogged { .. }
            | Input::WireLoop { .. }
            | Input::Persisted(_)
            | Input::Action { .. } => None,
        }
    }

    /// The bytes of the event, if it has any.
    pub fn bytes_mut(&mut self) -> Option<&mut Bytes> {
        if let JournalEvent::Received { data, .. } | JournalEvent::Sent { data, .. } = self {
            Some(data)
        } else if let JournalEvent::Controller(event) = self {
            event.bytes_mut()
        } else {
            None
        }
    }

    /// The finding, if the event is one.
    pub fn finding(&self) -> Option<&Finding> {
        if let JournalEvent::Controller(Event::Finding(finding)) = self {
            Some(finding)
        } else {
            None
        }
    }
}

impl From<&Output> for JournalEvent {
    fn from(output: &Output) -> JournalEvent {
        match output {
            Output::Send { port, bytes } => JournalEvent::Sent {
                port: *port,
                data: bytes.clone(),
            },
            Output::Persist { .. } => JournalEvent::Keep,
            Output::Stored { name, content } => JournalEvent::Stored {
                bytes: content.len(),
                file: name.clone(),
            },
            Output::Erased { name } => JournalEvent::Erased { file: name.clone() },
            Output::PowerCycled => JournalEvent::PowerOn,
            Output::PowerOff => JournalEvent::PowerOff,
            Output::Disconnect { port, .. } => JournalEvent::Closed { port: *port },
            Output::Stall { port } => JournalEvent::Stalled { port: *port },
            Output::Pendant(text) => JournalEvent::Pendant { text: text.clone() },
            Output::Event(event) => JournalEvent::Controller(event.clone()),
        }
    }
}

/// An event of the journal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NumberedEvent {
    pub seq: u64,
    /// Virtual time.
    #[serde(serialize_with = "seconds")]
    pub t: Time,
    #[serde(flatten)]
    pub event: JournalEvent,
}

fn seconds<S: Serializer>(moment: &Time, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(moment.as_seconds())
}

/// An event. `event` decides which of the other keys are present.
// Describes [`NumberedEvent`] for the OpenAPI document as one object: derived from the enums it would be one for each event.
// A test of `events` compares the keys.
#[cfg(test)]
#[derive(utoipa::ToSchema)]
#[schema(as = Event)]
pub struct ApiEvent {
    /// Its number: 1, 2, 3 and so on since the emulator was started.
    pub seq: u64,
    /// Virtual time in seconds.
    pub t: f64,
    /// Type of the event: `connected`, `disconnected`, `received`, `sent`, `text-in`, `text-out`, `dropped`,
    /// `answered`, `refused`, `finding`, `fault-armed`, `fault`, `closed`, `stalled`, `alarm`, `alarms-reset`,
    /// `status`, `statement`, `breakpoint`, `servo`, `servo-delayed`, `selected`, `stored`, `erased`, `pendant`, `power-off`,
    /// `power-on`, `action-refused`, `reset`.
    pub event: &'static str,
    /// Port of the event.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub port: Option<&'static str>,
    /// Address of a peer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peer: Option<String>,
    /// Bytes as text, control codes by name: `<STX>SO<CR><ETX>`. Of an alarm and the pendant the words themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// The same bytes as hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hex: Option<String>,
    /// Number of bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<usize>,
    /// Letters of a command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Master mode in which the command came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<&'static str>,
    /// Outcome of the command: `served`, `not-valid` by the permission tables, `refused` for another reason.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<&'static str>,
    /// Reason for which something was refused or dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Name of the rule of a finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<&'static str>,
    /// Number and kind of the fault that caused a finding; absent if the host caused it.
    #[serde(rename = "caused-by", skip_serializing_if = "Option::is_none")]
    pub caused_by: Option<String>,
    /// Severity of a finding; `note` if a fault caused it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub severity: Option<&'static str>,
    /// Section of the manual and clauses of the rule of a finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<&'static str>,
    /// Remedy of a finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<&'static str>,
    /// Message.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Number of an alarm or of a fault on purpose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<String>,
    /// Kind of a fault on purpose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<&'static str>,
    /// Execution status in the manual's words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status: Option<&'static str>,
    /// Line of the selected file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// ID of a task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<u16>,
    /// Servo power.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<bool>,
    /// Virtual time in seconds at which delayed servo power comes on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
    /// Name of a file; absent when the selection ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}
