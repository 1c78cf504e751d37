//! Runs the tests of a SCOL program and compares the result of each with its file: `ts3100 test`.
//!
//! The files are read by [`ts3100_recording::program_test`], a test is a run of [`crate::headless`]. Here a run becomes a list of
//! failures. The output is formatted in `cli::test`.

use crate::headless::{self, PENDANT, RunEnd, RunError, RunEvent, RunReport, RunRequest};
use crate::named_values::{ValueError, coordinates_of, numbers_of};
use crate::printed_lines::PrintedLines;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use ts3100_controller::{Config, Controller};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::pc_file::drive_content;
use ts3100_proto::status::pr::three_decimals;
use ts3100_recording::program_test::{LIMIT, Place, Placed, ProgramTest, TOLERANCE, TestPosition, Then};
use ts3100_recording::scenario::{StepTrigger, Verdict};

/// Statements before the end that a result keeps.
const LAST_STATEMENTS: usize = 5;
/// Most lines of PRINT that a result keeps.
const MAX_PRINTED: usize = 10_000;
/// Number of the coordinates in mm; the others are degrees, where 360 is 0.
const MILLIMETRES: usize = 3;

/// The program under test.
#[derive(Debug)]
pub struct Subject {
    /// Name of the file on the drive.
    pub name: String,
    pub source: String,
    /// Options, model and taught points.
    pub config: Config,
    /// The compiled file.
    pub program: Arc<scol_mini::Program>,
}

/// Something that is not as the test says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// Where the file of tests says it.
    pub place: Place,
    /// What is wrong, in one sentence.
    pub message: String,
}

/// A line of PRINT.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Printed {
    pub at: Duration,
    /// `TP`, `COM1`, `IP1` or `IP2`.
    pub channel: &'static str,
    pub text: String,
}

/// A statement that was executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Executed {
    pub at: Duration,
    /// Line of the program.
    pub line: u32,
    /// What it did, in words.
    pub effects: Vec<String>,
}

/// The result of a test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TestResult {
    /// None if the test passed.
    pub failures: Vec<Failure>,
    /// Virtual time from the start to the end.
    pub duration: Duration,
    /// Lines of PRINT, in order; the last ones of a program that prints very much.
    pub printed: Vec<Printed>,
    /// The last statements before the end.
    pub statements: Vec<Executed>,
}

/// A test that cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum TestError {
    /// Its call does not compile.
    #[error("{reason}")]
    Call {
        /// Where the call is.
        place: Place,
        reason: String,
    },
    /// The program did not start, or the run was interrupted.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Why a variable is not as expected.
#[derive(Debug, thiserror::Error)]
enum Mismatch {
    #[error("expected {expected}, found {found}")]
    Value { expected: String, found: String },
    #[error(transparent)]
    None(#[from] ValueError),
}

/// Runs a test.
///
/// # Errors
/// [`TestError`]: it did not run at all.
pub fn run(subject: &Subject, test: &ProgramTest, interrupted: &AtomicBool) -> Result<TestResult, TestError> {
    if let Some(call) = &test.call {
        check_call(subject, call)?;
    }
    let records = test.records.iter().map(|(channel, records)| {
        let records = records.value.iter().map(|record| record.clone().into_bytes());
        (channel.clone(), records.collect())
    });
    let job = RunRequest {
        config: subject.config.clone(),
        name: subject.name.clone(),
        source: drive_content(subject.source.as_bytes(), subject.config.options.line_end),
        records: records.collect(),
        lines_on: Vec::new(),
        position: test.position.as_ref().map(|position| position.value.clone()),
        scenario: Some(test.scenario.clone()),
        call: test.call.as_ref().map(|call| call.value.clone()),
        trace: true,
        profile: false,
        record_lines: false,
        time: TimeMode::Auto,
        max_time: test.limit.as_ref().map_or(LIMIT, |limit| limit.value),
    };
    let mut seen = Seen {
        place: test.place,
        ..Seen::default()
    };
    let report = match headless::run_until(interrupted, job, &mut |at, event| seen.note(at, event)) {
        // A program that cannot be started in this state is a result.
        Err(RunError::Start(reason)) => {
            seen.fail_at_line(line_before_start(test), reason);
            return Ok(seen.result(Duration::ZERO));
        }
        Err(RunError::Position(reason)) => {
            let position = test.position.as_ref();
            let place = position.map_or(test.place, |position| position.place);
            seen.fail(place, reason.to_string());
            return Ok(seen.result(Duration::ZERO));
        }
        report => report?,
    };
    seen.end();
    judge(test, &report, &mut seen);
    Ok(seen.result(report.duration))
}

/// The line of the last step before START, which alone can prevent it; 0 without one.
fn line_before_start(test: &ProgramTest) -> usize {
    let mut steps = test.scenario.steps.iter().rev();
    let step = steps.find(|step| step.trigger == StepTrigger::At(Duration::ZERO));
    step.map_or(0, |step| step.line)
}

/// What is wrong with a call is said of its place in the file of tests.
fn check_call(subject: &Subject, call: &Placed<String>) -> Result<(), TestError> {
    let Err(found) = scol_mini::compile_call(&call.value, &subject.program) else {
        return Ok(());
    };
    let errors = found.iter().map(|found| {
        let help = found.help.as_ref().map(|help| format!("; {help}"));
        format!("{}{}", found.message, help.unwrap_or_default())
    });
    let reason = errors.collect::<Vec<_>>().join("; ");
    let place = call.place;
    Err(TestError::Call { place, reason })
}

/// What was seen of a run.
#[derive(Debug, Default)]
struct Seen {
    /// Of the test.
    place: Place,
    unfinished: PrintedLines,
    /// The last lines.
    printed: VecDeque<Printed>,
    /// There were more.
    is_incomplete: bool,
    statements: VecDeque<Executed>,
    failures: Vec<Failure>,
}

impl Seen {
    fn note(&mut self, at: Duration, event: RunEvent<'_>) {
        match event {
            RunEvent::Printed { channel, bytes } => {
                let lines = self.unfinished.add(at, channel, bytes);
                lines
                    .into_iter()
                    .for_each(|text| self.add_printed(at, channel, text));
            }
            // The call itself is no line of the file.
            RunEvent::Statement { line: 0, .. } => {}
            RunEvent::Statement { line, detail, .. } => {
                if self.statements.len() >= LAST_STATEMENTS {
                    self.statements.pop_front();
                }
                let effects = detail.effects.iter().map(ToString::to_string).collect();
                self.statements.push_back(Executed { at, line, effects });
            }
            RunEvent::Refused { line, reason } => {
                let at = three_decimals(at.as_secs_f64());
                self.fail_at_line(line, format!("at {at} s: {reason}"));
            }
        }
    }

    fn add_printed(&mut self, at: Duration, channel: &'static str, text: String) {
        if self.printed.len() >= MAX_PRINTED {
            self.printed.pop_front();
            self.is_incomplete = true;
        }
        self.printed.push_back(Printed { at, channel, text });
    }

    fn end(&mut self) {
        for (channel, at, text) in self.unfinished.take() {
            self.add_printed(at, channel, text);
        }
    }

    fn fail(&mut self, place: Place, message: String) {
        self.failures.push(Failure { place, message });
    }

    /// Fails at the line of an action or expectation; one without a line has 0.
    fn fail_at_line(&mut self, line: usize, message: String) {
        let place = match line {
            0 => self.place,
            line => Place { line, column: 1 },
        };
        self.fail(place, message);
    }

    fn result(mut self, duration: Duration) -> TestResult {
        self.failures.sort_by_key(|failure| failure.place.line);
        TestResult {
            failures: self.failures,
            duration,
            printed: self.printed.into(),
            statements: self.statements.into(),
        }
    }
}

/// Compares the run with the expected result.
fn judge(test: &ProgramTest, report: &RunReport, seen: &mut Seen) {
    let then = &test.then;
    judge_end(test, report, seen);
    if let Some(within) = then
        .within
        .as_ref()
        .filter(|within| report.duration > within.value)
    {
        let (limit, found) = (within.value.as_secs_f64(), report.duration.as_secs_f64());
        let (limit, found) = (three_decimals(limit), three_decimals(found));
        seen.fail(
            within.place,
            format!("cycle time: expected at most {limit} s, found {found} s"),
        );
    }
    for (channel, expected) in &then.printed {
        judge_printed(channel, expected, seen);
    }
    for Placed { place, value } in &then.outputs {
        let (line, expected) = *value;
        if report.controller.signals().output(line) != expected {
            let (expected, found) = if expected { ("on", "off") } else { ("off", "on") };
            seen.fail(
                *place,
                format!("output {line}: expected {expected}, found {found}"),
            );
        }
    }
    for Placed { place, value } in &then.variables {
        let (name, expected) = value;
        if let Err(found) = compare_variable(&report.controller, name, expected) {
            seen.fail(*place, format!("variable {name}: {found}"));
        }
    }
    judge_position(then, report, seen);
    for (channel, records) in &test.records {
        if let Some(unread) = report.unused.get(channel) {
            let of = records.value.len();
            let message = format!(
                "records of {channel}: {unread} of {of} were not read; remove what the program has no INPUT for"
            );
            seen.fail(records.place, message);
        }
    }
    let entries = report.scenario.iter().flat_map(|outcome| &outcome.entries);
    for entry in entries {
        let reason = match &entry.verdict {
            Verdict::Failed(reason) => reason.clone(),
            Verdict::Undone(reason) => format!("{reason}; {}", remedy_of_entry(test, entry.line)),
            Verdict::Held | Verdict::Skipped(_) => continue,
        };
        seen.fail_at_line(entry.line, format!("{}: {reason}", entry.name));
    }
}

/// The remedy for a step that was not done, or an expectation that had not begun.
fn remedy_of_entry(test: &ProgramTest, line: usize) -> &'static str {
    let step = test.scenario.steps.iter().find(|step| step.line == line);
    match step.map(|step| &step.trigger) {
        Some(StepTrigger::At(_)) => "choose an earlier time, or remove the step",
        Some(StepTrigger::When(..)) => {
            "correct the step or remove it, or write `times = 0` if it need not happen"
        }
        None => "correct `after`, or remove the entry",
    }
}

fn judge_end(test: &ProgramTest, report: &RunReport, seen: &mut Seen) {
    let then = &test.then;
    let expected = match (&then.ending, &then.alarm) {
        (Some(ending), _) => ending.value.as_str(),
        (None, Some(_)) => "alarm",
        (None, None) => "end",
    };
    let place = then.ending.as_ref().or(then.alarm.as_ref());
    let place = place.map(|placed| placed.place);
    let place = place.or(cause(test, &report.end)).unwrap_or(test.place);
    let line = seen.statements.back().map(|last| last.line);
    let line = line.filter(|_| matches!(report.end, RunEnd::Alarm { .. }));
    let line = line.map_or_else(String::new, |line| format!(" at line {line}"));
    let found = format!("{}{line}", explained(&report.end));
    match (&report.end, &then.alarm) {
        (RunEnd::Alarm { number, .. }, Some(alarm)) if *number == alarm.value => {}
        (_, Some(alarm)) => seen.fail(
            alarm.place,
            format!("alarm: expected {}, found{found}", alarm.value),
        ),
        (end, None) if end.word() == expected => {}
        (_, None) => seen.fail(place, format!("ending: expected {expected}, found{found}")),
    }
}

/// The key that the end comes from.
fn cause(test: &ProgramTest, end: &RunEnd) -> Option<Place> {
    match end {
        RunEnd::TimeUp { .. } => test.limit.as_ref().map(|limit| limit.place),
        RunEnd::OutOfInput { channel, .. } => test.records.get(*channel).map(|records| records.place),
        RunEnd::End
        | RunEnd::Stopped { .. }
        | RunEnd::NoInput { .. }
        | RunEnd::PowerOff
        | RunEnd::Alarm { .. }
        | RunEnd::Blocked { .. } => None,
    }
}

/// The end, with its word where that does not explain itself, and what to do about it in a file of tests.
fn explained(end: &RunEnd) -> String {
    // The call itself is no line of the file.
    let sentence = end.sentence().replace("line 0: ", "the call: ");
    let remedy = match end {
        RunEnd::NoInput { channel, .. } => {
            let channel = channel.to_ascii_lowercase();
            format!("; give it records with `given.records.{channel}`")
        }
        RunEnd::OutOfInput { channel, .. } => {
            let channel = channel.to_ascii_lowercase();
            format!("; add a record for it to `given.records.{channel}`")
        }
        RunEnd::Blocked { .. } => {
            "; change an input with `given.inputs` or `at`, or a variable with `given.variables`".to_owned()
        }
        RunEnd::TimeUp { .. } => " when its time was up; give it more with `limit`".to_owned(),
        RunEnd::Alarm { number, .. } => {
            return format!(": {sentence}; `ts3100 explain {number}` has cause and remedy");
        }
        RunEnd::End | RunEnd::Stopped { .. } | RunEnd::PowerOff => {
            return format!(" {}: {sentence}", end.word());
        }
    };
    let word = end.word();
    format!(" {word}: {sentence}{remedy}, or expect it with `then.ending = \"{word}\"`")
}

fn judge_printed(channel: &str, expected: &Placed<Vec<String>>, seen: &mut Seen) {
    let printed = seen.printed.iter().filter(|line| line.channel == channel);
    let found: Vec<&str> = printed.map(|line| line.text.as_str()).collect();
    let place = expected.place;
    let of = match channel {
        PENDANT => "PRINT to the teach pendant".to_owned(),
        channel => format!("PRINT to {channel}"),
    };
    if seen.is_incomplete {
        let message =
            format!("{of}: the program printed more than {MAX_PRINTED} lines, the most that a test compares");
        return seen.fail(place, message);
    }
    let differs = expected
        .value
        .iter()
        .zip(&found)
        .position(|(expected, found)| expected != found);
    let message = match (differs, expected.value.len(), found.len()) {
        (Some(at), ..) => {
            let (expected, found) = (expected.value.get(at), found.get(at));
            let (expected, found) = (
                expected.map_or("", String::as_str),
                found.copied().unwrap_or_default(),
            );
            format!("{of}, line {}: expected {expected:?}, found {found:?}", at + 1)
        }
        (None, expected_lines, found_lines) if expected_lines > found_lines => {
            let next = expected.value.get(found_lines).map_or("", String::as_str);
            format!("{of}, line {}: expected {next:?}, found nothing", found_lines + 1)
        }
        (None, expected_lines, found_lines) if expected_lines < found_lines => {
            let next = found.get(expected_lines).copied().unwrap_or_default();
            format!(
                "{of}, line {}: expected nothing, found {next:?}",
                expected_lines + 1
            )
        }
        _ => return,
    };
    seen.fail(place, message);
}

/// Whether a variable has these numbers, to the digits of a real of the language.
fn compare_variable(controller: &Controller, name: &str, expected: &[f64]) -> Result<(), Mismatch> {
    let found = numbers_of(controller, name)?;
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= b.abs().max(1.0) * f64::from(f32::EPSILON) * 4.0;
    if found.len() == expected.len() && found.iter().zip(expected).all(is_near) {
        return Ok(());
    }
    let (expected, found) = (listed(expected), listed(&found));
    Err(Mismatch::Value { expected, found })
}

fn listed(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    match numbers.as_slice() {
        [only] => only.clone(),
        several => format!("[{}]", several.join(", ")),
    }
}

fn judge_position(then: &Then, report: &RunReport, seen: &mut Seen) {
    let Some(Placed { place, value }) = &then.position else {
        return;
    };
    let arm = report.arm.world_values();
    let mut expected = match coordinates_of(&report.controller, value) {
        Ok(expected) => expected,
        Err(reason) => return seen.fail(*place, reason.to_string()),
    };
    // The configuration of a point is not compared.
    expected.truncate(arm.len());
    let name = match value {
        TestPosition::Named(name) => format!("{name} "),
        TestPosition::Coordinates(_) => String::new(),
    };
    let tolerance = then.tolerance.unwrap_or(TOLERANCE);
    let is_off = |(at, (expected, found)): (usize, (&f64, &f64))| {
        let off = (expected - found).abs();
        let off = if at < MILLIMETRES {
            off
        } else {
            (off + 180.0) % 360.0 - 180.0
        };
        off.abs() > tolerance
    };
    if expected.iter().zip(&arm).enumerate().any(is_off) {
        let shown = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|value| three_decimals(*value)).collect();
            values.join(" ")
        };
        let found = shown(arm.get(..expected.len()).unwrap_or_default());
        let expected = shown(&expected);
        let message = format!("position: expected {name}{expected} within {tolerance}, found {found}");
        seen.fail(*place, message);
    }
}
