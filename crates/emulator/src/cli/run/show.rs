//! The output of `ts3100 run`: PRINT as lines on stdout, statements and the end on stderr; or everything in one
//! JSON document.
//!
//! The names in the JSON document are a public format. The run itself is [`crate::headless`].

use super::super::output;
use crate::headless::{RunEnd, RunEvent, RunReport};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use ts3100_proto::status::pr::three_decimals;
use ts3100_recording::scenario::ScenarioOutcome;

/// Longest line held back for its CR, in bytes.
const MAX_LINE: usize = 65_536;
/// Coordinates of a position of a SCARA.
const SCARA_COORDINATES: usize = 5;
/// Most entries of each list of the JSON document; what is more is counted.
const MAX_ENTRIES: usize = 100_000;

/// Form of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    Text,
    /// One document, indented.
    Json,
    /// One document on one line.
    JsonLine,
}

impl Style {
    /// Documents of repeated runs are one line each.
    pub(super) fn new(json: bool, repeated: bool) -> Style {
        match (json, repeated) {
            (false, _) => Style::Text,
            (true, false) => Style::Json,
            (true, true) => Style::JsonLine,
        }
    }
}

/// Shows the progress of a run.
pub(super) struct RunPrinter {
    /// The lines of the program, for the trace.
    program: Vec<String>,
    style: Style,
    /// Channels are named: the program prints on several.
    names_channels: bool,
    /// Tasks are named: the program starts some.
    names_tasks: bool,
    /// Output of each channel since its last CR.
    unfinished: BTreeMap<&'static str, (Duration, Vec<u8>)>,
    printed: BoundedList,
    statements: BoundedList,
    /// Actions without effect.
    refused: BoundedList,
    /// Why stdout took no more.
    write_error: Option<anyhow::Error>,
}

/// A bounded list.
#[derive(Default)]
struct BoundedList {
    entries: Vec<Value>,
    left_out: u64,
}

impl BoundedList {
    fn push(&mut self, entry: impl FnOnce() -> Value) {
        if self.entries.len() < MAX_ENTRIES {
            self.entries.push(entry());
        } else {
            self.left_out += 1;
        }
    }
}

impl RunPrinter {
    /// For this program; for JSON everything is kept for the document.
    pub(super) fn new(source: &str, style: Style) -> RunPrinter {
        let source = source.replace("\r\n", "\n").replace('\r', "\n");
        RunPrinter {
            program: source.split('\n').map(|line| line.trim().to_owned()).collect(),
            style,
            names_channels: scol_mini::print_channels(&source).len() > 1,
            names_tasks: scol_mini::starts_tasks(&source),
            unfinished: BTreeMap::new(),
            printed: BoundedList::default(),
            refused: BoundedList::default(),
            statements: BoundedList::default(),
            write_error: None,
        }
    }

    /// Shows one thing.
    pub(super) fn show(&mut self, at: Duration, event: RunEvent<'_>) {
        match event {
            RunEvent::Printed { channel, bytes } => self.add_printed(at, channel, bytes),
            RunEvent::Statement { line, task } => self.add_statement(at, line, task),
            RunEvent::Refused { reason } => self.add_refused(at, reason),
        }
    }

    fn add_statement(&mut self, at: Duration, line: u32, task: u16) {
        let number = usize::try_from(line).unwrap_or(usize::MAX);
        let text = self
            .program
            .get(number.saturating_sub(1))
            .map_or("", String::as_str);
        if self.style != Style::Text {
            let time = at.as_secs_f64();
            self.statements
                .push(|| json!({ "time": time, "task": task, "line": line, "text": text }));
        } else {
            // The main program is task 1; its statements bear no number while it is alone.
            let task = if self.names_tasks {
                format!(" task {task:<3}")
            } else {
                String::new()
            };
            output::tell(format_args!(
                "{:>10.3} s{task} {line:>5} | {text}\n",
                at.as_secs_f64()
            ));
        }
    }

    fn add_refused(&mut self, at: Duration, reason: &str) {
        let time = at.as_secs_f64();
        if self.style != Style::Text {
            self.refused.push(|| json!({ "time": time, "reason": reason }));
        } else {
            output::tell(format_args!("warning: at {time:.3} s: {reason}\n"));
        }
    }

    fn add_printed(&mut self, at: Duration, channel: &'static str, bytes: &[u8]) {
        let (_, mut rest) = self.unfinished.remove(channel).unwrap_or_default();
        rest.extend_from_slice(bytes);
        while let Some(end) = rest.iter().position(|byte| *byte == b'\r') {
            let line: Vec<u8> = rest.drain(..=end).take(end).collect();
            self.print_line(at, channel, &line);
        }
        if rest.len() > MAX_LINE {
            self.print_line(at, channel, &rest);
            rest.clear();
        }
        if !rest.is_empty() {
            self.unfinished.insert(channel, (at, rest));
        }
    }

    fn print_line(&mut self, at: Duration, channel: &'static str, line: &[u8]) {
        let text = String::from_utf8_lossy(line);
        if self.style != Style::Text {
            let time = at.as_secs_f64();
            self.printed
                .push(|| json!({ "time": time, "channel": channel, "text": text }));
            return;
        }
        let written = output::print(if self.names_channels {
            format!("{channel}: {text}\n")
        } else {
            format!("{text}\n")
        });
        if let Err(error) = written {
            self.write_error.get_or_insert(error);
        }
    }

    /// Shows the end.
    ///
    /// # Errors
    /// Stdout does not take it.
    pub(super) fn finish(mut self, report: &RunReport) -> anyhow::Result<()> {
        for (channel, (at, rest)) in std::mem::take(&mut self.unfinished) {
            self.print_line(at, channel, &rest);
        }
        if let Some(error) = self.write_error {
            return Err(error);
        }
        match self.style {
            Style::Json => return output::print(format!("{:#}\n", self.document(report))),
            Style::JsonLine => return output::print(format!("{}\n", self.document(report))),
            Style::Text => {}
        }
        let (_, words) = describe_end(&report.end);
        let mut out = format!("after {:.3} s: {words}\n", report.duration.as_secs_f64());
        let world = report.arm.world_values();
        let names: &[&str] = match world.len() {
            SCARA_COORDINATES => &["X", "Y", "Z", "C", "T"],
            _ => &["X", "Y", "Z", "A", "B", "C", "U", "V"],
        };
        let world = names.iter().zip(&world);
        let world = joined(world.map(|(name, value)| format!("{name} {}", three_decimals(*value))));
        out += &format!("position {world}, configuration {}\n", configuration(report));
        let joints = report.arm.joint_values();
        let joints = joined(joints.into_iter().map(three_decimals));
        out += &format!("joints {joints}\n");
        let on = joined(report.outputs.iter().map(u16::to_string));
        out += &format!("outputs on: {}\n", if on.is_empty() { "none" } else { &on });
        for (channel, number) in &report.unused {
            out += &format!("{channel}: {number} records unused\n");
        }
        for failure in failures(report) {
            out += &format!("scenario: {failure}\n");
        }
        output::tell(out);
        Ok(())
    }

    fn document(&self, report: &RunReport) -> Value {
        let (word, words) = describe_end(&report.end);
        let mut document = Map::new();
        let mut put = |key: &str, value: Value| document.insert(key.to_owned(), value);
        put("version", json!(1));
        put("ending", json!(word));
        put("message", json!(words));
        if let RunEnd::Alarm { number, text } = &report.end {
            put("alarm", json!({ "number": number, "text": text }));
        }
        put("seconds", json!(report.duration.as_secs_f64()));
        let rounded = |values: &[f64]| values.iter().map(|v| rounded(*v)).collect::<Vec<f64>>();
        put("position", json!(rounded(&report.arm.world_values())));
        put("configuration", json!(configuration(report)));
        put("joints", json!(rounded(&report.arm.joint_values())));
        put("outputs", json!(report.outputs));
        put("unused", json!(report.unused));
        if report.scenario.is_some() {
            put("scenarioFailures", json!(failures(report).collect::<Vec<_>>()));
            put("refused", json!(self.refused.entries));
        }
        put("printed", json!(self.printed.entries));
        put("printedLeftOut", json!(self.printed.left_out));
        if !self.statements.entries.is_empty() {
            put("trace", json!(self.statements.entries));
            put("traceLeftOut", json!(self.statements.left_out));
        }
        Value::Object(document)
    }
}

/// Expectations of the scenario that were not met, a line each.
fn failures(report: &RunReport) -> impl Iterator<Item = String> {
    let outcome = report.scenario.iter();
    outcome.flat_map(ScenarioOutcome::failures)
}

fn joined(values: impl Iterator<Item = String>) -> String {
    values.collect::<Vec<_>>().join(" ")
}

/// Rounds to a millionth; there is no minus before a zero.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6 + 0.0
}

/// The configuration as a program writes it: a word on a SCARA, five digits on six axes.
fn configuration(report: &RunReport) -> String {
    let digits = &report.arm.configuration;
    match (report.arm.world_values().len(), digits.first()) {
        (SCARA_COORDINATES, Some(1)) => "LEFTY".to_owned(),
        (SCARA_COORDINATES, Some(2)) => "RIGHTY".to_owned(),
        (SCARA_COORDINATES, _) => "FREE".to_owned(),
        _ => digits.iter().map(u8::to_string).collect(),
    }
}

/// A word for programs and a sentence for people.
pub(in super::super) fn describe_end(ending: &RunEnd) -> (&'static str, String) {
    match ending {
        RunEnd::End => ("end", "ended".to_owned()),
        RunEnd::Stopped { line } => ("stopped", format!("stopped, line {line} is next")),
        RunEnd::OutOfInput { channel, line } => (
            "out-of-input",
            format!("INPUT at line {line} waits: all records of {channel} are used"),
        ),
        RunEnd::NoInput { channel, line } => {
            let flag = channel.to_ascii_lowercase();
            let words =
                format!("INPUT {channel} at line {line} waits; give it records with --input {flag}=FILE");
            ("no-input", words)
        }
        RunEnd::PowerOff => ("power-off", "stopped: the power was turned off".to_owned()),
        RunEnd::Alarm { number, text } => ("alarm", format!("alarm {number} {text}")),
        RunEnd::Blocked { line } => (
            "stuck",
            format!(
                "line {line} waits for a condition that can no longer become true; set inputs with --din or --at"
            ),
        ),
        RunEnd::TimeUp { line } => ("time-up", format!("stopped at line {line} after --max-time")),
    }
}
