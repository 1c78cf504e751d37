//! The output of `ts3100 test`: a line for each test and the reasons of a failure, or one JSON document; and JUnit.
//!
//! The names in the JSON document are a public format.

use super::super::output;
use crate::color;
use crate::log::print_error;
use crate::program_test::TestResult;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::Path;
use std::time::Duration;
use ts3100_control::printable::printable;
use ts3100_recording::program_test::{ProgramTest, TestFile};
use ts3100_recording::reports::junit;

/// Lines of PRINT that a failure shows.
const SHOWN_LINES: usize = 20;

/// A file under test with its results.
pub(super) struct FileOutcome {
    path: String,
    program: String,
    /// The lines of the program.
    lines: Vec<String>,
    tests: Vec<TestOutcome>,
}

/// A test and its result.
pub(super) struct TestOutcome {
    name: String,
    line: usize,
    result: TestResult,
}

impl FileOutcome {
    pub(super) fn new(file: &TestFile, source: &str) -> FileOutcome {
        FileOutcome {
            path: file.path.display().to_string(),
            program: file.program.value.display().to_string(),
            lines: source.lines().map(|line| line.trim().to_owned()).collect(),
            tests: Vec::new(),
        }
    }

    fn text(&self, line: u32) -> &str {
        let at = usize::try_from(line).unwrap_or(usize::MAX).saturating_sub(1);
        self.lines.get(at).map_or("", String::as_str)
    }
}

impl TestOutcome {
    pub(super) fn new(test: &ProgramTest, result: TestResult) -> TestOutcome {
        TestOutcome {
            name: test.name.clone(),
            line: test.place.line,
            result,
        }
    }

    fn passed(&self) -> bool {
        self.result.failures.is_empty()
    }

    /// The failures, a line each.
    fn failures<'a>(&'a self, path: &'a str) -> impl Iterator<Item = String> + 'a {
        let failures = self.result.failures.iter();
        failures.map(move |failure| format!("{path}:{}: {}", failure.place.line, failure.message))
    }
}

/// A file, or one test of it, that cannot be run.
struct Untested {
    path: String,
    /// Of the test case in a report.
    name: String,
    reason: String,
}

/// Shows results as they come, and keeps them.
pub(super) struct TestPrinter {
    is_json: bool,
    /// Documents of repeated runs are one line each.
    is_repeated: bool,
    files: Vec<FileOutcome>,
    errors: Vec<Untested>,
    count: usize,
    failed: usize,
    time: Duration,
}

impl TestPrinter {
    pub(super) fn new(is_json: bool, is_repeated: bool) -> TestPrinter {
        TestPrinter {
            is_json,
            is_repeated,
            files: Vec::new(),
            errors: Vec::new(),
            count: 0,
            failed: 0,
            time: Duration::ZERO,
        }
    }

    /// Whether there is no result and no error.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0 && self.errors.is_empty()
    }

    /// A file, or one test of it, that cannot be run.
    pub(super) fn add_error(&mut self, path: &Path, name: &str, error: &anyhow::Error) {
        print_error(format_args!("{error:#}"));
        self.errors.push(Untested {
            path: path.display().to_string(),
            name: name.to_owned(),
            reason: format!("{error:#}"),
        });
    }

    /// A test has ended.
    ///
    /// # Errors
    /// Stdout takes no more.
    pub(super) fn add(&mut self, file: &mut FileOutcome, test: TestOutcome) -> anyhow::Result<()> {
        self.count += 1;
        self.failed += usize::from(!test.passed());
        self.time += test.result.duration;
        if !self.is_json {
            let (mut stdout, paints) = color::stream(io::stdout().lock());
            let (passed, seconds) = (test.passed(), test.result.duration.as_secs_f64());
            let verdict = color::verdict(if passed { "ok  " } else { "FAIL" }, passed, paints);
            let mut text = format!("{verdict} {}: {} ({seconds:.3} s)\n", file.path, test.name);
            if !passed {
                text += &details(file, &test);
            }
            let text = if paints { text } else { printable_lines(&text) };
            output::written(stdout.write_all(text.as_bytes()))?;
        }
        file.tests.push(test);
        Ok(())
    }

    /// All tests of a file have ended.
    pub(super) fn add_file(&mut self, file: FileOutcome) {
        self.files.push(file);
    }

    /// Ends the output: whether a file could not be tested, and whether a test failed.
    ///
    /// # Errors
    /// Stdout takes no more.
    pub(super) fn finish(self) -> anyhow::Result<(bool, bool)> {
        let outcome = (!self.errors.is_empty(), self.failed > 0);
        if self.is_json {
            let document = self.document();
            output::print(match self.is_repeated {
                true => format!("{document}\n"),
                false => format!("{document:#}\n"),
            })?;
            return Ok(outcome);
        }
        let tests = match self.count {
            1 => "1 test".to_owned(),
            count => format!("{count} tests"),
        };
        let seconds = self.time.as_secs_f64();
        let verdict = match self.failed {
            0 => "all passed".to_owned(),
            failed => format!("{} passed, {failed} failed", self.count - failed),
        };
        if self.count > 0 {
            output::print(format!("{tests}: {verdict}, {seconds:.3} s of robot time\n"))?;
        }
        Ok(outcome)
    }

    fn document(&self) -> Value {
        let tests = self
            .files
            .iter()
            .flat_map(|file| file.tests.iter().map(|test| document(file, test)));
        let tests: Vec<Value> = tests.collect();
        json!({
            "version": 1,
            "tests": tests,
            "passed": self.count - self.failed,
            "failed": self.failed,
            "errors": self.errors.iter().map(|error| &error.reason).collect::<Vec<_>>(),
            "seconds": self.time.as_secs_f64(),
        })
    }

    /// The results as JUnit XML, with times in virtual seconds.
    pub(super) fn junit(&self) -> String {
        let cases = self.files.iter().flat_map(|file| {
            file.tests.iter().map(|test| {
                let failures: Vec<String> = test.failures(&file.path).collect();
                let status = match failures.first() {
                    None => junit::success(),
                    Some(first) => junit::failure(first, &details(file, test)),
                };
                junit::case(&file.path, &test.name, test.result.duration, status)
            })
        });
        let errors = self.errors.iter().map(|error| {
            let reason = &error.reason;
            let status = junit::error(reason.lines().next().unwrap_or_default(), reason);
            junit::case(&error.path, &error.name, Duration::ZERO, status)
        });
        junit::report("ts3100 test", self.time, cases.chain(errors))
    }
}

/// What a failure shows below its line: the reasons, the lines of PRINT and the last statements.
fn details(file: &FileOutcome, test: &TestOutcome) -> String {
    let mut text = String::new();
    // Writing into memory cannot fail.
    for failure in test.failures(&file.path) {
        let _ = writeln!(text, "     {failure}");
    }
    let printed = &test.result.printed;
    if !printed.is_empty() {
        let _ = writeln!(text, "     printed:");
        let left_out = printed.len().saturating_sub(SHOWN_LINES);
        if left_out > 0 {
            let _ = writeln!(text, "       {left_out} lines before");
        }
        for line in printed.iter().skip(left_out) {
            let at = line.at.as_secs_f64();
            let _ = writeln!(text, "       {at:>9.3} s {}: {}", line.channel, line.text);
        }
    }
    if !test.result.statements.is_empty() {
        let _ = writeln!(text, "     last statements of {}:", file.program);
        for statement in &test.result.statements {
            let (at, line) = (statement.at.as_secs_f64(), statement.line);
            let effects = match statement.effects.is_empty() {
                true => String::new(),
                false => format!("  -> {}", statement.effects.join(", ")),
            };
            let _ = writeln!(
                text,
                "       {at:>9.3} s {line:>5} | {}{effects}",
                file.text(line)
            );
        }
    }
    text
}

fn document(file: &FileOutcome, test: &TestOutcome) -> Value {
    let failures = test.result.failures.iter();
    let failures = failures.map(|failure| json!({ "line": failure.place.line, "message": failure.message }));
    let printed = test
        .result
        .printed
        .iter()
        .map(|line| json!({ "time": line.at.as_secs_f64(), "channel": line.channel, "text": line.text }));
    let statements = test.result.statements.iter().map(|statement| {
        json!({
            "time": statement.at.as_secs_f64(),
            "line": statement.line,
            "text": file.text(statement.line),
            "effects": statement.effects,
        })
    });
    json!({
        "file": file.path,
        "program": file.program,
        "name": test.name,
        "line": test.line,
        "passed": test.passed(),
        "seconds": test.result.duration.as_secs_f64(),
        "failures": failures.collect::<Vec<_>>(),
        "printed": printed.collect::<Vec<_>>(),
        "lastStatements": statements.collect::<Vec<_>>(),
    })
}

/// The lines without control characters: programs print what they like.
fn printable_lines(text: &str) -> String {
    text.lines().fold(String::new(), |lines, line| {
        lines + &printable(line).to_string() + "\n"
    })
}
