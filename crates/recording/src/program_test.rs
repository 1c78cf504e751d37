//! Tests of SCOL programs: a file beside the program that says what is called, under which conditions, and the expected
//! result.
//!
//! `read` reads the file, whose keys are in [`keys`]. What happens during a test has the form of scenarios
//! ([`crate::scenario`]). `ts3100 test` runs the tests.

pub mod keys;
mod read;

pub use read::ProgramTestError;

use crate::scenario::Scenario;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// Ending of the file of tests: `pick.test.toml` belongs to `pick.scol`.
pub const ENDING: &str = ".test.toml";
/// Largest file in bytes.
pub const MAX_BYTES: u64 = 1024 * 1024;
/// Most tests of a file.
pub const MAX_TESTS: usize = 10_000;
/// Tolerance of a position, in mm and degrees, unless the test says another.
pub const TOLERANCE: f64 = 0.01;
/// Longest test in virtual time, unless the test says another.
pub const LIMIT: Duration = Duration::from_secs(600);

/// A place in the file, each from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    pub line: usize,
    /// In characters.
    pub column: usize,
}

impl Default for Place {
    /// The start of the file.
    fn default() -> Place {
        Place { line: 1, column: 1 }
    }
}

/// A value and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed<T> {
    pub place: Place,
    pub value: T,
}

/// Content of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct TestFile {
    /// The file.
    pub path: PathBuf,
    /// The program that it tests; without its key at the start of the file.
    pub program: Placed<PathBuf>,
    /// The arm, as `--model` names it.
    pub model: Option<Placed<String>>,
    /// Points taught on the controller.
    pub points: Option<Placed<PathBuf>>,
    /// Named options, `KEY=VALUE`.
    pub options: Vec<Placed<String>>,
    pub tests: Vec<ProgramTest>,
}

/// One test.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramTest {
    pub name: String,
    pub place: Place,
    /// What is called instead of the main program.
    pub call: Option<Placed<String>>,
    /// Records for INPUT by channel.
    pub records: BTreeMap<String, Placed<Vec<String>>>,
    /// Where the arm is at the start; otherwise in its ready posture.
    pub position: Option<Placed<TestPosition>>,
    /// What happens: variables and input lines at the start, then what is planned.
    pub scenario: Scenario,
    /// Longest run in virtual time; otherwise [`LIMIT`].
    pub limit: Option<Placed<Duration>>,
    pub then: Then,
}

/// The expected result of a test.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Then {
    /// Lines of PRINT by channel.
    pub printed: BTreeMap<String, Placed<Vec<String>>>,
    /// Outputs and their states.
    pub outputs: Vec<Placed<(u16, bool)>>,
    /// Variables and their numbers.
    pub variables: Vec<Placed<(String, Vec<f64>)>>,
    /// Where the arm is.
    pub position: Option<Placed<TestPosition>>,
    /// How far off it may be, in mm and degrees.
    pub tolerance: Option<f64>,
    /// Number of the alarm that ends it.
    pub alarm: Option<Placed<String>>,
    /// Longest time.
    pub within: Option<Placed<Duration>>,
    /// How it ends, in the words of `ts3100 run --json`.
    pub ending: Option<Placed<String>>,
}

/// Where the arm is, or has to be.
#[derive(Debug, Clone, PartialEq)]
pub enum TestPosition {
    /// At a point of DATA, GLOBAL or the taught points.
    Named(String),
    /// At these coordinates, the first ones of a position.
    Coordinates(Vec<f64>),
}
