//! Scenarios: a file that describes what happens to the robot during a test of a host, when or after which event, and what
//! the host is expected to do.
//!
//! `read` reads the file, whose keys are in [`keys`], `action` has its actions, `play` runs it, `progress` says how far it
//! is, `results` reports the outcome. Its conditions are those of the controller ([`Condition`]).

mod action;
pub mod keys;
mod play;
mod progress;
pub(crate) mod read;
mod results;

pub use action::{CHANNEL_ACTIONS, ScenarioAction, ScenarioActionError};
pub use play::Play;
pub use progress::{EntryProgress, EntryState, ScenarioProgress, ScenarioState};
pub use read::{ScenarioError, StepParseError, is_program};
pub use results::{ScenarioOutcome, Verdict};

use std::path::PathBuf;
use std::time::Duration;
use ts3100_controller::Condition;

/// Largest file in bytes.
pub const MAX_BYTES: u64 = 1024 * 1024;
/// Most entries of all kinds together.
pub const MAX_ENTRIES: usize = 1_000;

/// Content of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// The file it was read from.
    pub file: PathBuf,
    /// Its name in the results.
    pub name: String,
    /// The state it begins with.
    pub start: Start,
    pub steps: Vec<Step>,
    /// Expectations of the hosts.
    pub expectations: Vec<Expectation>,
}

/// The state a scenario begins with.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Start {
    /// A snapshot instead of a controller that was just powered on.
    pub restore: Option<PathBuf>,
    /// Files of the PC to put on the RAM drive.
    pub load: Vec<PathBuf>,
    /// File to select.
    pub select: Option<String>,
    /// Actions at the start.
    pub actions: Vec<ScenarioAction>,
}

/// Something that happens.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Its line of the file.
    pub line: usize,
    pub trigger: StepTrigger,
    /// How often at most; 0 for as often as its condition comes.
    pub times: u32,
    /// What, in order.
    pub actions: Vec<ScenarioAction>,
}

/// When a step happens.
#[derive(Debug, Clone, PartialEq)]
pub enum StepTrigger {
    /// At a time after the beginning.
    At(Duration),
    /// This long after an event.
    When(Condition, Duration),
}

/// Expectations of the hosts.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// Its line of the file.
    pub line: usize,
    /// Its name in the results.
    pub name: String,
    pub condition: Condition,
    /// From when on: from the beginning, or from something that happens.
    pub after: Option<Condition>,
    pub kind: ExpectationKind,
}

/// The expectation of a condition.
#[derive(Debug, Clone, PartialEq)]
pub enum ExpectationKind {
    /// It comes at least so often, in time if one is given.
    Occurs {
        /// Number of times.
        times: u32,
        /// Within this time.
        within: Option<Duration>,
    },
    /// It never comes, until something happens if that is given.
    Never {
        /// Until this.
        until: Option<Condition>,
    },
}

#[cfg(test)]
mod tests;
