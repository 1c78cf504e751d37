//! How far a scenario is while it is played, for people who watch it. The outcome at its end is in `results`.

use serde::Serialize;
use std::time::Duration;

/// How far a scenario is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioProgress {
    /// Name of its file, without directories.
    pub file: String,
    /// All in all.
    pub state: ScenarioState,
    /// Its entries in the order of the file.
    pub entries: Vec<EntryProgress>,
}

/// How far a scenario is all in all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ScenarioState {
    /// An entry waits.
    Running,
    /// Nothing waits, and everything came as expected.
    Passed,
    /// Something came not as expected.
    Failed,
}

/// How far one entry is: an expectation, or something that is done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EntryProgress {
    pub name: String,
    /// Line of the file, from 1; 0 without a line.
    pub line: usize,
    /// How far it is.
    pub state: EntryState,
    /// Virtual time from the beginning to its verdict, or at which it was last done.
    pub time: Option<Duration>,
    /// Details of the entry.
    pub message: Option<String>,
}

/// How far an entry is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EntryState {
    /// It can still come either way.
    Waiting,
    /// It came as expected, or was done.
    Passed,
    /// It did not come as expected.
    Failed,
}

impl ScenarioProgress {
    /// The progress of these entries.
    pub fn new(file: String, mut entries: Vec<EntryProgress>) -> ScenarioProgress {
        entries.sort_by_key(|entry| entry.line);
        let any = |state| entries.iter().any(|entry| entry.state == state);
        let state = if any(EntryState::Failed) {
            ScenarioState::Failed
        } else if any(EntryState::Waiting) {
            ScenarioState::Running
        } else {
            ScenarioState::Passed
        };
        ScenarioProgress { file, state, entries }
    }
}
