//! The output of `ts3100 run`: PRINT as lines on stdout, statements, the table of times and the end on stderr; or everything in
//! one JSON document.
//!
//! The names in the JSON document are a public format. The run itself is [`crate::headless`].

use super::super::output;
use crate::headless::{RunEnd, RunEvent, RunReport};
use crate::printed_lines::PrintedLines;
use crate::profile::{Profile, TaskProfile};
use scol_mini::Arm;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;
use ts3100_controller::told::{MotionTarget, StatementDetail, StatementEffect, way_word};
use ts3100_proto::status::pr::three_decimals;
use ts3100_recording::scenario::ScenarioOutcome;

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
    /// The lines of the file, for the trace.
    lines: Vec<String>,
    /// The names of its programs, each with the line of its first statement.
    programs: Vec<(String, u32)>,
    style: Style,
    /// Channels are named: the program prints on several.
    names_channels: bool,
    /// Tasks are named: the program starts some.
    names_tasks: bool,
    unfinished: PrintedLines,
    printed: BoundedList,
    statements: BoundedList,
    /// The entry of the last statement of each task in that list.
    last_statements: BTreeMap<u16, usize>,
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
    /// For a file with these programs; for JSON everything is kept for the document.
    pub(super) fn new(source: &str, programs: Vec<(String, u32)>, style: Style) -> RunPrinter {
        let source = source.replace("\r\n", "\n").replace('\r', "\n");
        RunPrinter {
            lines: source.split('\n').map(|line| line.trim().to_owned()).collect(),
            programs,
            style,
            names_channels: scol_mini::print_channels(&source).len() > 1,
            names_tasks: scol_mini::starts_tasks(&source),
            unfinished: PrintedLines::default(),
            printed: BoundedList::default(),
            refused: BoundedList::default(),
            statements: BoundedList::default(),
            last_statements: BTreeMap::new(),
            write_error: None,
        }
    }

    /// Shows one thing.
    pub(super) fn show(&mut self, at: Duration, event: RunEvent<'_>) {
        match event {
            RunEvent::Printed { channel, bytes } => {
                for line in self.unfinished.add(at, channel, bytes) {
                    self.print_line(at, channel, &line);
                }
            }
            RunEvent::Statement { line, task, detail } => self.add_statement(at, line, task, detail),
            RunEvent::Refused { reason, .. } => self.add_refused(at, reason),
        }
    }

    fn add_statement(&mut self, at: Duration, line: u32, task: u16, detail: &StatementDetail) {
        let program = self.program(line);
        if self.style != Style::Text {
            self.add_received(task, &detail.received);
            let entry = self.statements.entries.len();
            let text = self.text(line);
            let mut document = Map::new();
            let mut put = |key: &str, value: Value| document.insert(key.to_owned(), value);
            put("time", json!(at.as_secs_f64()));
            put("task", json!(task));
            put("program", json!(program));
            put("line", json!(line));
            put("text", json!(text));
            add_effects(&mut document, &detail.effects);
            self.statements.push(|| Value::Object(document));
            self.last_statements.insert(task, entry);
            return;
        }
        // The main program is task 1; its statements bear no number while it is alone.
        let task = match self.names_tasks {
            true => format!(" task {task:<3}"),
            false => String::new(),
        };
        let width = self.programs.iter().map(|(name, _)| name.len()).max();
        let width = width.unwrap_or_default();
        let program = match self.programs.len() {
            0 | 1 => String::new(),
            _ => format!(" {program:<width$}"),
        };
        let place = format!("{task}{program} {line:>5} | ");
        if !detail.received.is_empty() {
            let received = shown_effects(&detail.received);
            let indent = place.chars().count() - 2;
            output::tell(format_args!("{:>12}{:indent$}|   -> {received}\n", "", ""));
        }
        let effects = match detail.effects.is_empty() {
            true => String::new(),
            false => format!("  -> {}", shown_effects(&detail.effects)),
        };
        let (at, text) = (at.as_secs_f64(), self.text(line));
        output::tell(format_args!("{at:>10.3} s{place}{text}{effects}\n"));
    }

    /// What the last statement of a task got from an answer becomes part of its entry.
    fn add_received(&mut self, task: u16, received: &[StatementEffect]) {
        let entry = self.last_statements.get(&task);
        let entry = entry.and_then(|at| self.statements.entries.get_mut(*at));
        if let Some(Value::Object(document)) = entry {
            add_effects(document, received);
        }
    }

    fn text(&self, line: u32) -> &str {
        let at = usize::try_from(line).unwrap_or(usize::MAX).saturating_sub(1);
        self.lines.get(at).map_or("", String::as_str)
    }

    /// Name of the program with this line.
    fn program(&self, line: u32) -> String {
        let before = self.programs.iter().rev().find(|(_, first)| *first <= line);
        before.map_or_else(String::new, |(name, _)| name.clone())
    }

    fn add_refused(&mut self, at: Duration, reason: &str) {
        let time = at.as_secs_f64();
        if self.style != Style::Text {
            self.refused.push(|| json!({ "time": time, "reason": reason }));
        } else {
            output::tell(format_args!("warning: at {time:.3} s: {reason}\n"));
        }
    }

    fn print_line(&mut self, at: Duration, channel: &'static str, text: &str) {
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
        for (channel, at, rest) in self.unfinished.take() {
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
        let arm = match world.len() {
            SCARA_COORDINATES => Arm::Scara,
            _ => Arm::SixAxis,
        };
        let world = arm.coordinates().chars().zip(&world);
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
        if let Some(profile) = &report.profile {
            self.add_table(profile, report.duration, &mut out);
        }
        output::tell(out);
        Ok(())
    }

    /// Where the cycle goes: the statements of each task by their time.
    fn add_table(&self, profile: &Profile, duration: Duration, out: &mut String) {
        let tasks = profile.tasks();
        // Writing into memory cannot fail.
        for TaskProfile {
            task,
            time,
            statements,
        } in &tasks
        {
            let of = if tasks.len() > 1 {
                format!(" of task {task}")
            } else {
                String::new()
            };
            let _ = writeln!(out, "\ntime{of}: {:.3} s", time.as_secs_f64());
            let _ = writeln!(out, "{:>12} {:>7} {:>8} {:>6}", "time", "share", "times", "line");
            let (slow, quick): (Vec<_>, Vec<_>) =
                statements.iter().partition(|(_, spent)| !spent.time.is_zero());
            for (line, spent) in slow {
                let (seconds, share) = (spent.time.as_secs_f64(), share(spent.time, duration) * 100.0);
                let (times, text) = (spent.times, self.text(line));
                let _ = writeln!(
                    out,
                    "{seconds:>10.3} s {share:>5.1} % {times:>8} {line:>6} | {text}"
                );
            }
            if !quick.is_empty() {
                let times: u64 = quick.iter().map(|(_, spent)| spent.times).sum();
                let _ = writeln!(
                    out,
                    "{:>10.3} s {:>5.1} % {times:>8}        | {} other statements",
                    0.0,
                    0.0,
                    quick.len()
                );
            }
        }
        if !profile.stopped.is_zero() {
            let _ = writeln!(out, "\nstopped: {:.3} s", profile.stopped.as_secs_f64());
        }
    }

    /// The same for programs.
    fn table_document(&self, profile: &Profile, duration: Duration) -> Value {
        let tasks = profile.tasks().into_iter().map(
            |TaskProfile {
                 task,
                 time,
                 statements,
             }| {
                let statements = statements.into_iter().map(|(line, spent)| {
                    json!({
                        "line": line,
                        "program": self.program(line),
                        "text": self.text(line),
                        "times": spent.times,
                        "seconds": spent.time.as_secs_f64(),
                        "share": rounded(share(spent.time, duration)),
                    })
                });
                let statements: Vec<Value> = statements.collect();
                json!({ "task": task, "seconds": time.as_secs_f64(), "statements": statements })
            },
        );
        let tasks: Vec<Value> = tasks.collect();
        json!({ "tasks": tasks, "stoppedSeconds": profile.stopped.as_secs_f64() })
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
        if let Some(profile) = &report.profile {
            put("profile", self.table_document(profile, report.duration));
        }
        Value::Object(document)
    }
}

/// Part of the duration of the run.
fn share(time: Duration, duration: Duration) -> f64 {
    if duration.is_zero() {
        return 0.0;
    }
    time.as_secs_f64() / duration.as_secs_f64()
}

fn shown_effects(effects: &[StatementEffect]) -> String {
    let effects: Vec<String> = effects.iter().map(ToString::to_string).collect();
    effects.join(", ")
}

/// Adds what a statement did to its entry.
fn add_effects(entry: &mut Map<String, Value>, effects: &[StatementEffect]) {
    for effect in effects {
        let (key, value) = match effect {
            StatementEffect::Assigned { name, values } => {
                let assigned = json!({ "name": name, "value": numbers(values) });
                let list = entry.entry("assigned").or_insert_with(|| json!([]));
                if let Value::Array(list) = list {
                    list.push(assigned);
                }
                continue;
            }
            StatementEffect::Branch(way) => ("branch", json!(way_word(*way))),
            StatementEffect::Target(MotionTarget::Position { via: None, end }) => {
                ("target", json!({ "position": numbers(end) }))
            }
            StatementEffect::Target(MotionTarget::Position { via: Some(via), end }) => {
                ("target", json!({ "position": numbers(end), "via": numbers(via) }))
            }
            StatementEffect::Target(MotionTarget::Axis { axis, value, by }) => {
                let key = if *by { "by" } else { "to" };
                ("target", json!({ "axis": axis, key: number(value) }))
            }
            StatementEffect::Target(MotionTarget::Origin) => ("target", json!({ "origin": true })),
            StatementEffect::Monitor => ("monitor", json!(true)),
        };
        entry.insert(key.to_owned(), value);
    }
}

/// One number alone, several as a list.
fn numbers(values: &[String]) -> Value {
    match values {
        [only] => number(only),
        several => several.iter().map(|value| number(value)).collect(),
    }
}

fn number(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| Value::from(text))
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

/// A word for programs, and a sentence for people with what to do about it.
pub(in super::super) fn describe_end(ending: &RunEnd) -> (&'static str, String) {
    let sentence = ending.sentence();
    let words = match ending {
        RunEnd::NoInput { channel, .. } => {
            let flag = channel.to_ascii_lowercase();
            format!("{sentence}; give it records with --input {flag}=FILE")
        }
        RunEnd::Blocked { .. } => format!("{sentence}; set inputs with --din or --at"),
        RunEnd::TimeUp { .. } => format!("{sentence} after --max-time"),
        RunEnd::End
        | RunEnd::Stopped { .. }
        | RunEnd::OutOfInput { .. }
        | RunEnd::PowerOff
        | RunEnd::Alarm { .. } => sentence,
    };
    (ending.word(), words)
}
