//! One event as a JSON document: what a host sent, what the controller sent, and what the controller reported.
//!
//! The same document is used by the stream `/events`, by `/findings` and by the journal. The events come from the
//! controller's `output` module.

use serde::Serialize;
use ts3100_controller::{Event, Output, Port, Time};
use ts3100_proto::escape::{Escaped, hex_digits};
use utoipa::ToSchema;

/// An event. `event` decides which of the other keys are present.
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema)]
#[schema(as = Event)]
pub struct ApiEvent {
    /// Its number: 1, 2, 3 and so on since the emulator was started.
    pub seq: u64,
    /// Virtual time in seconds.
    pub t: f64,
    /// What kind of thing: `connected`, `disconnected`, `received`, `sent`, `text-in`, `text-out`, `dropped`,
    /// `answered`, `refused`, `finding`, `fault-armed`, `fault`, `closed`, `stalled`, `alarm`, `alarms-reset`, `status`, `statement`, `servo`, `servo-delayed`, `selected`,
    /// `stored`, `erased`, `pendant`, `power-off`, `power-on`, `action-refused`, `reset`.
    pub event: &'static str,
    /// The port it concerns.
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
    /// How many bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<usize>,
    /// Letters of a command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Master mode in which the command came.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<&'static str>,
    /// What became of the command: `served`, `not-valid` by the permission tables, `refused` for another reason.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<&'static str>,
    /// Why something was refused or dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Name of the rule of a finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<&'static str>,
    /// The fault that has caused a finding, with its kind; absent if the host has.
    #[serde(rename = "caused-by", skip_serializing_if = "Option::is_none")]
    pub caused_by: Option<String>,
    /// How much a finding matters; `note` if a fault has caused it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub severity: Option<&'static str>,
    /// Section of the manual a finding goes by, and the clauses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<&'static str>,
    /// What to do about a finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<&'static str>,
    /// What happened.
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
    /// Virtual time in seconds at which servo power that is held back comes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
    /// Name of a file; absent when the selection ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

impl ApiEvent {
    /// An event of this kind; the journal assigns `seq` when it stores the event.
    pub fn new(now: Time, event: &'static str) -> ApiEvent {
        ApiEvent {
            t: now.as_seconds(),
            event,
            ..ApiEvent::default()
        }
    }

    /// The same, about these bytes.
    #[must_use]
    pub fn with_bytes(self, bytes: &[u8]) -> ApiEvent {
        ApiEvent {
            text: Some(Escaped::for_reading(bytes).to_string()),
            hex: Some(hex_digits(bytes)),
            bytes: Some(bytes.len()),
            ..self
        }
    }

    /// An event at a port.
    pub fn of_port(at: Time, event: &'static str, port: Port) -> ApiEvent {
        let port = Some(port.name());
        ApiEvent {
            port,
            ..ApiEvent::new(at, event)
        }
    }

    /// The event for an output of the controller.
    pub fn from_output(now: Time, output: &Output) -> ApiEvent {
        let mut event = ApiEvent {
            port: output.port().map(Port::name),
            ..ApiEvent::new(now, output.kind())
        };
        match output {
            Output::Send { bytes, .. } => return event.with_bytes(bytes),
            Output::Stored { name, content } => {
                event.file = Some(name.clone());
                event.bytes = Some(content.len());
            }
            Output::Erased { name } => event.file = Some(name.clone()),
            Output::Pendant(text) => event.text = Some(text.clone()),
            Output::Event(details) => return event.with_details(details),
            // A change that is to be persisted is `stored` or `erased` once the write has been done.
            Output::Persist { .. }
            | Output::PowerCycled
            | Output::Disconnect { .. }
            | Output::Stall { .. }
            | Output::PowerOff => {}
        }
        event
    }

    /// With what an event of the controller says besides its kind and port.
    fn with_details(mut self, event: &Event) -> ApiEvent {
        match event {
            Event::TextIn { data, .. } | Event::TextOut { data, .. } => return self.with_bytes(data),
            Event::Dropped { bytes, reason, .. } => {
                self.bytes = Some(*bytes);
                self.reason = Some((*reason).to_owned());
            }
            Event::Answered {
                row, mode, verdict, ..
            } => {
                self.command = Some((*row).to_owned());
                self.mode = Some(mode.as_str());
                self.outcome = Some(verdict.as_str());
            }
            Event::Refused { command, reason, .. } => {
                self.command = Some(command.clone());
                self.reason = Some(reason.clone());
            }
            Event::Finding(finding) => {
                let rule = finding.rule;
                self.t = finding.at.as_seconds();
                self.rule = Some(rule.id);
                self.severity = Some(finding.severity().as_str());
                self.caused_by = finding.caused_by.map(|cause| cause.to_string());
                self.source = Some(rule.source);
                self.message = Some(finding.message.to_string());
                self.remedy = Some(rule.remedy);
                return self.with_bytes(&finding.bytes);
            }
            Event::Fault {
                id, kind, message, ..
            } => {
                self.number = Some(id.to_string());
                self.kind = Some(kind);
                self.message = Some(message.clone());
            }
            Event::Alarm { number, text } => {
                self.number = Some(number.clone());
                self.text = Some(text.clone());
            }
            Event::ActionRefused(error) => self.reason = Some(error.to_string()),
            Event::Status { status, line } => {
                self.status = Some(status.as_str());
                self.line = Some(*line);
            }
            Event::Statement { line, task } => {
                self.line = Some(*line);
                self.task = Some(*task);
            }
            Event::Servo(on) => self.on = Some(*on),
            Event::ServoDelayed(until) => self.until = Some(until.as_seconds()),
            Event::Selected(file) => self.file.clone_from(file),
            Event::AlarmsReset => {}
        }
        self
    }
}
