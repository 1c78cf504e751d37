//! One event as a JSON document: what a host sent, what the controller sent, and what the controller reported.
//!
//! The same document is used by the stream `/events`, by `/findings` and by the journal. The events come from the
//! controller's `output` module.

use serde::Serialize;
use std::fmt::Write as _;
use ts3100_controller::findings::Rule;
use ts3100_controller::input::Input;
use ts3100_controller::output::{Event, Output, Verdict};
use ts3100_controller::time::Time;
use ts3100_proto::escape::Escaped;
use utoipa::ToSchema;

/// One thing that happened. Which of the other keys there are depends on `event`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema)]
#[schema(as = Happening)]
pub struct ApiEvent {
    /// Its number: 1, 2, 3 and so on since the emulator was started.
    pub seq: u64,
    /// Virtual time in seconds.
    pub t: f64,
    /// What kind of thing: `connected`, `disconnected`, `received`, `sent`, `text-in`, `text-out`, `dropped`,
    /// `answered`, `refused`, `finding`, `fault-armed`, `fault`, `cut`, `deaf`, `alarm`, `alarms-reset`, `status`, `statement`, `servo`, `servo-held-back`, `selected`,
    /// `stored`, `erased`, `pendant`, `power-off`, `power-on`, `undone`, `reset`.
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
    /// How much a finding matters.
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

/// The value of `outcome` in events and metrics.
#[must_use]
pub fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Served => "served",
        Verdict::NotValid => "not-valid",
        Verdict::Refused => "refused",
    }
}

/// Bytes as hexadecimal digits, two each.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Virtual time in seconds.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "exact for the first 285 years")]
pub fn seconds(time: Time) -> f64 {
    time.as_micros() as f64 / 1e6
}

impl ApiEvent {
    /// An event of this kind; the journal assigns `seq` when it stores the event.
    #[must_use]
    pub fn new(now: Time, event: &'static str) -> ApiEvent {
        ApiEvent {
            t: seconds(now),
            event,
            ..ApiEvent::default()
        }
    }

    fn with_bytes(self, bytes: &[u8]) -> ApiEvent {
        ApiEvent {
            text: Some(Escaped::for_reading(bytes).to_string()),
            hex: Some(hex(bytes)),
            bytes: Some(bytes.len()),
            ..self
        }
    }

    /// The event for an input of the controller; `None` for panel actions, which are reported by their effects, and ticks.
    #[must_use]
    pub fn from_input(now: Time, input: &Input) -> Option<ApiEvent> {
        let new = |event| ApiEvent::new(now, event);
        match input {
            Input::Connected { port, peer } => Some(ApiEvent {
                port: Some(port.name()),
                peer: Some(peer.clone()),
                ..new("connected")
            }),
            Input::Disconnected { port } => Some(ApiEvent {
                port: Some(port.name()),
                ..new("disconnected")
            }),
            Input::Received { port, bytes } => Some(
                ApiEvent {
                    port: Some(port.name()),
                    ..new("received")
                }
                .with_bytes(bytes),
            ),
            _ => None,
        }
    }

    /// The event for an output of the controller.
    #[must_use]
    pub fn from_output(now: Time, output: &Output) -> ApiEvent {
        let new = |event| ApiEvent::new(now, event);
        match output {
            Output::Send { port, bytes } => ApiEvent {
                port: Some(port.name()),
                ..new("sent")
            }
            .with_bytes(bytes),
            Output::Stored { name, content } => ApiEvent {
                file: Some(name.clone()),
                bytes: Some(content.len()),
                ..new("stored")
            },
            Output::Erased { name } => ApiEvent {
                file: Some(name.clone()),
                ..new("erased")
            },
            // Replaced by `stored` or `erased` once the write has been done.
            Output::Persist { .. } => new("keep"),
            Output::PowerCycled => new("power-on"),
            Output::Disconnect { port, .. } => ApiEvent {
                port: Some(port.name()),
                ..new("cut")
            },
            Output::Stall { port } => ApiEvent {
                port: Some(port.name()),
                ..new("deaf")
            },
            Output::PowerOff => new("power-off"),
            Output::Pendant(text) => ApiEvent {
                text: Some(text.clone()),
                ..new("pendant")
            },
            Output::Event(event) => ApiEvent::from_event(now, event),
        }
    }

    /// A finding with severity, source and remedy of its rule.
    fn from_finding(event: &Event) -> Option<ApiEvent> {
        let Event::Finding {
            rule,
            port,
            at,
            bytes,
            message,
        } = event
        else {
            return None;
        };
        let known = Rule::by_id(rule);
        let finding = ApiEvent {
            port: port.map(ts3100_controller::Port::name),
            rule: Some(rule),
            severity: known.map(|rule| rule.severity.as_str()),
            source: known.map(|rule| rule.source),
            message: Some(message.clone()),
            remedy: known.map(|rule| rule.remedy),
            ..ApiEvent::new(*at, "finding")
        };
        Some(finding.with_bytes(bytes))
    }

    /// A fault that was armed or has fired.
    fn from_fault(now: Time, event: &Event) -> Option<ApiEvent> {
        let Event::Fault {
            id,
            kind,
            port,
            message,
            fired,
        } = event
        else {
            return None;
        };
        let word = if *fired { "fault" } else { "fault-armed" };
        Some(ApiEvent {
            port: port.map(ts3100_controller::Port::name),
            number: Some(id.to_string()),
            kind: Some(kind),
            message: Some(message.clone()),
            ..ApiEvent::new(now, word)
        })
    }

    fn from_servo(now: Time, event: &Event) -> ApiEvent {
        match event {
            Event::ServoDelayed(until) => ApiEvent {
                until: Some(seconds(*until)),
                ..ApiEvent::new(now, "servo-held-back")
            },
            _ => ApiEvent {
                on: Some(*event == Event::Servo(true)),
                ..ApiEvent::new(now, "servo")
            },
        }
    }

    fn from_event(now: Time, event: &Event) -> ApiEvent {
        let new = |event| ApiEvent::new(now, event);
        match event {
            Event::TextIn { port, data, .. } => ApiEvent {
                port: Some(port.name()),
                ..new("text-in")
            }
            .with_bytes(data),
            Event::TextOut { port, data, .. } => ApiEvent {
                port: Some(port.name()),
                ..new("text-out")
            }
            .with_bytes(data),
            Event::Dropped { port, bytes, reason } => ApiEvent {
                port: Some(port.name()),
                bytes: Some(*bytes),
                reason: Some((*reason).to_owned()),
                ..new("dropped")
            },
            Event::Answered {
                port,
                row,
                mode,
                verdict,
            } => ApiEvent {
                port: Some(port.name()),
                command: Some((*row).to_owned()),
                mode: Some(mode.as_str()),
                outcome: Some(verdict_name(*verdict)),
                ..new("answered")
            },
            Event::Refused {
                port,
                command,
                reason,
            } => ApiEvent {
                port: Some(port.name()),
                command: Some(command.clone()),
                reason: Some(reason.clone()),
                ..new("refused")
            },
            Event::Finding { .. } => ApiEvent::from_finding(event).unwrap_or_else(|| new("finding")),
            Event::Fault { .. } => ApiEvent::from_fault(now, event).unwrap_or_else(|| new("fault")),
            Event::Alarm { number, text } => ApiEvent {
                number: Some(number.clone()),
                text: Some(text.clone()),
                ..new("alarm")
            },
            Event::ActionRefused(error) => ApiEvent {
                reason: Some(error.to_string()),
                ..new("undone")
            },
            Event::AlarmsReset => new("alarms-reset"),
            Event::Status { status, line } => ApiEvent {
                status: Some(status.as_str()),
                line: Some(*line),
                ..new("status")
            },
            Event::Statement { line, task } => ApiEvent {
                line: Some(*line),
                task: Some(*task),
                ..new("statement")
            },
            Event::Servo(_) | Event::ServoDelayed(_) => ApiEvent::from_servo(now, event),
            Event::Selected(file) => ApiEvent {
                file: file.clone(),
                ..new("selected")
            },
        }
    }
}
