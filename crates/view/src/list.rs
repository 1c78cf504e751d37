//! The events of a run as lines for a terminal, and as documents for programs: what the timeline shows, in words.

use crate::lanes::Level;
use crate::run::Run;
use serde::Serialize;
use std::fmt;
use ts3100_control::event::{JournalEvent, NumberedEvent};
use ts3100_controller::{Bytes, Event, Port, Time};
use ts3100_proto::escape::Escaped;

/// Most characters of the bytes in a line; a document has them all in `/trace/events`.
const MAX_TEXT: usize = 120;

/// A line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Line {
    /// The number of the event; of an action at the panel the last one before it.
    pub event: u64,
    /// Virtual time in microseconds.
    pub t: Time,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub port: Option<Port>,
    /// `host`, `robot`, `ng`, `finding`, `alarm`, `status`, `fault`, `panel`, `connection`, `file`, `run`.
    pub kind: &'static str,
    /// `note`, `warning` or `error`; none where nothing is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<&'static str>,
    pub text: String,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let port = self.port.map_or("", Port::name);
        let level = self.level.map(|level| format!("{level}: ")).unwrap_or_default();
        write!(
            f,
            "{:>13} {:>6} {port:<4} {:<10} {level}{}",
            self.t, self.event, self.kind, self.text
        )
    }
}

/// The lines of a run, or of them those about something that is wrong.
pub fn lines(run: &Run, errors: bool) -> Vec<Line> {
    let events = run.events();
    let mut lines: Vec<Line> = events.iter().filter_map(line).collect();
    let actions = run.lanes().actions();
    lines.extend(actions.into_iter().map(|item| Line {
        event: item.event,
        t: item.at,
        port: None,
        kind: "panel",
        level: (item.level > Level::Plain).then_some("warning"),
        text: item.label,
    }));
    // Stable: an action follows the event that it came after.
    lines.sort_by_key(|line| line.event);
    lines.retain(|line| !errors || line.level.is_some_and(|level| level != "note"));
    lines
}

fn line(found: &NumberedEvent) -> Option<Line> {
    let plain = |port: Option<Port>, kind: &'static str, text: String| (port, kind, None, text);
    let (port, kind, level, text) = match &found.event {
        JournalEvent::Connected { port, peer } => {
            plain(Some(*port), "connection", format!("connected {peer}"))
        }
        JournalEvent::Disconnected { port } => plain(Some(*port), "connection", "disconnected".to_owned()),
        JournalEvent::Closed { port } => plain(Some(*port), "connection", "closed by the robot".to_owned()),
        JournalEvent::Stalled { port } => plain(
            Some(*port),
            "connection",
            "no longer read by the robot".to_owned(),
        ),
        JournalEvent::Received { port, data } => plain(Some(*port), "host", bytes(data)),
        JournalEvent::Sent { port, data } => plain(Some(*port), "robot", bytes(data)),
        JournalEvent::Stored { file, bytes } => plain(None, "file", format!("{file} stored, {bytes} bytes")),
        JournalEvent::Erased { file } => plain(None, "file", format!("{file} erased")),
        JournalEvent::PowerOn => plain(None, "run", "power on".to_owned()),
        JournalEvent::PowerOff => plain(None, "run", "power off".to_owned()),
        JournalEvent::Restored => plain(None, "run", "snapshot restored".to_owned()),
        JournalEvent::Reset => plain(None, "run", "reset".to_owned()),
        JournalEvent::Pendant { text } => {
            plain(None, "robot", format!("on the pendant: {}", text.trim_end()))
        }
        JournalEvent::Keep => return None,
        JournalEvent::Controller(event) => of_controller(event)?,
    };
    let (event, t) = (found.seq, found.t);
    Some(Line {
        event,
        t,
        port,
        kind,
        level,
        text,
    })
}

type Parts = (Option<Port>, &'static str, Option<&'static str>, String);

fn of_controller(event: &Event) -> Option<Parts> {
    Some(match event {
        // Bytes that came in and went out show the same.
        Event::TextIn { .. } | Event::TextOut { .. } | Event::Answered { .. } => return None,
        Event::Statement { .. } | Event::ServoDelayed(_) => return None,
        Event::Dropped { port, bytes, reason } => {
            let text = format!("{bytes} bytes dropped: {reason}");
            (Some(*port), "host", Some("warning"), text)
        }
        Event::Refused {
            port,
            command,
            reason,
        } => (Some(*port), "ng", Some("error"), format!("{command}: {reason}")),
        Event::Finding(finding) => {
            let cause = finding.caused_by.map(|cause| format!(" (caused-by: {cause})"));
            let text = format!(
                "{}: {}{}",
                finding.rule.id,
                finding.message,
                cause.unwrap_or_default()
            );
            (finding.port, "finding", Some(finding.severity().as_str()), text)
        }
        Event::Alarm { number, text } => (None, "alarm", Some("error"), format!("{number} {text}")),
        Event::AlarmsReset => (None, "alarm", None, "reset".to_owned()),
        Event::ActionRefused(reason) => (None, "panel", Some("warning"), reason.to_string()),
        Event::Status { status, line } => (None, "status", None, format!("{}, line {line}", status.as_str())),
        Event::Breakpoint { line, text, .. } => (None, "breakpoint", None, format!("line {line}: {text}")),
        Event::Servo(on) => (
            None,
            "status",
            None,
            if *on { "servo on" } else { "servo off" }.to_owned(),
        ),
        Event::Selected(Some(file)) => (None, "file", None, format!("{file} selected")),
        Event::Selected(None) => (None, "file", None, "none selected".to_owned()),
        Event::Fault {
            fired,
            port,
            kind,
            message,
            ..
        } => {
            let level = fired.then_some("note");
            (*port, "fault", level, format!("{kind}: {message}"))
        }
    })
}

fn bytes(data: &Bytes) -> String {
    let text = Escaped::for_reading(data).to_string();
    match text.char_indices().nth(MAX_TEXT) {
        Some((end, _)) => format!("{}... ({} bytes)", &text[..end], data.len()),
        None => text,
    }
}
