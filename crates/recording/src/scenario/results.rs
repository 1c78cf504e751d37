//! The outcome of a scenario, for people and as JUnit XML: one test case for each expectation, for each step with a
//! condition, and for each step at a time that the run did not reach.

use crate::reports::junit;
use std::time::Duration;

/// Result of one entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// As expected.
    Held,
    /// Not as expected: what was expected and what came.
    Failed(String),
    /// Actions that were not done before the end, or an expectation that had not begun, and why.
    Undone(String),
    /// It had no occasion, as its entry allows.
    Skipped(String),
}

/// One entry of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EntryResult {
    pub name: String,
    pub line: usize,
    /// Virtual time from the beginning to its verdict.
    pub time: Duration,
    pub verdict: Verdict,
}

/// Result of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioOutcome {
    pub name: String,
    /// How long it was played, in virtual time.
    pub time: Duration,
    /// Its entries in the order of the file.
    pub entries: Vec<EntryResult>,
}

impl ScenarioOutcome {
    /// Whether something was not as expected.
    pub fn has_failed(&self) -> bool {
        self.failures().next().is_some()
    }

    /// Unmet expectations, a line each.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.entries.iter().filter_map(|entry| match &entry.verdict {
            // The limit of actions has no line.
            Verdict::Failed(reason) if entry.line == 0 => Some(reason.clone()),
            Verdict::Failed(reason) => Some(format!("line {}, {}: {reason}", entry.line, entry.name)),
            Verdict::Held | Verdict::Undone(_) | Verdict::Skipped(_) => None,
        })
    }

    /// As JUnit XML, with times in virtual seconds.
    pub fn junit(&self) -> String {
        let cases = self.entries.iter().map(|entry| {
            let status = match &entry.verdict {
                Verdict::Held => junit::success(),
                Verdict::Failed(reason) => junit::failure(reason, &format!("line {}", entry.line)),
                Verdict::Undone(reason) | Verdict::Skipped(reason) => junit::skipped(reason),
            };
            junit::case(&self.name, &entry.name, entry.time, status)
        });
        junit::report(&self.name, self.time, cases)
    }
}
