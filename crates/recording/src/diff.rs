//! Replays the host's side of a recording against an emulated controller in virtual time and reports every difference of
//! its answers: in bytes, named by field, and in time.
//!
//! `answers` splits a recording into answers, `player` runs the controller, `compare` compares two answers, and `matching`
//! pairs recorded with emulated answers. The command `ts3100 diff` prints the [`Report`].

mod compare;
pub mod ignore;
mod matching;

pub use crate::player::Candidate;
pub use compare::PartDifference;
pub use ignore::{Ignore, IgnoreError};

use crate::answers;
use crate::player::Player;
use crate::transcript::json::as_text;
use crate::transcript::{EndReason, PeerId, Recording};
use matching::Matching;
use serde::{Serialize, Serializer};
use std::time::Duration;
use ts3100_controller::Time;
use ts3100_proto::escape::Escaped;

/// Most differences in a report; further ones are only counted.
pub const MAX_DIFFERENCES: usize = 10_000;

#[derive(Debug, Clone)]
pub struct Tolerance {
    /// Largest time difference that is not reported.
    pub time: Duration,
    /// Largest difference between coordinates that is not reported.
    pub value: f64,
    /// How long after its recorded time an answer may come before it counts as missing.
    pub answer_timeout: Duration,
    /// Parts of answers that are not compared.
    pub ignore: Ignore,
}

impl Default for Tolerance {
    fn default() -> Tolerance {
        Tolerance {
            time: Duration::from_millis(100),
            value: 0.0,
            answer_timeout: Duration::from_secs(10),
            ignore: Ignore::default(),
        }
    }
}

/// How an answer differs. In JSON, answers are texts for people and times are microseconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum DifferenceKind {
    /// In its bytes.
    Bytes {
        /// The answer recorded.
        #[serde(serialize_with = "for_reading")]
        recorded: Vec<u8>,
        /// The emulator's.
        #[serde(serialize_with = "for_reading")]
        emulated: Vec<u8>,
        /// Why the emulator has refused, if it has.
        reason: Option<String>,
        /// Place and meaning.
        parts: Vec<PartDifference>,
    },
    /// In its time, since the host or the robot last did something.
    Time {
        /// The answer recorded.
        #[serde(serialize_with = "for_reading")]
        recorded: Vec<u8>,
        /// When it came.
        #[serde(rename = "recorded_after_us", serialize_with = "micros")]
        recorded_after: Duration,
        /// When the emulator's came; earlier than what it was measured from is zero.
        #[serde(rename = "emulated_after_us", serialize_with = "micros")]
        emulated_after: Duration,
    },
    /// The emulator does not send it.
    Missing {
        /// The answer recorded.
        #[serde(serialize_with = "for_reading")]
        recorded: Vec<u8>,
        /// Remark of the emulator about the host's bytes before it, if any.
        reason: Option<String>,
    },
    /// The emulator sends it, the recording has nothing of the kind.
    Surplus {
        /// The emulator's answer.
        #[serde(serialize_with = "for_reading")]
        emulated: Vec<u8>,
        /// Why the emulator has refused, if it has.
        reason: Option<String>,
    },
    /// One of the two ends the connection, the other does not, or in another way.
    Ended {
        /// In the recording.
        recorded: Option<EndReason>,
        /// By the emulator.
        emulated: Option<EndReason>,
    },
}

fn for_reading<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&Escaped::for_reading(bytes))
}

fn micros<S: Serializer>(duration: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(u64::try_from(duration.as_micros()).unwrap_or(u64::MAX))
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Kind of the difference.
    #[serde(flatten)]
    pub kind: DifferenceKind,
    /// Line of the file of the recording.
    pub file_line: usize,
    /// Time of the recording.
    #[serde(rename = "t_us")]
    pub at: Time,
    #[serde(serialize_with = "as_text::serialize")]
    pub line: PeerId,
    /// The host's text before it, as far as it is worth showing; empty if there was none.
    pub question: String,
}

/// Result of a replay.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The differences, in the order of the recording.
    pub differences: Vec<Difference>,
    /// Number of further differences.
    pub more: usize,
    /// Number of recorded answers.
    pub answers: usize,
    /// Number of replayed inputs of hosts and panel.
    pub inputs: usize,
    /// Number of answers that match only if the question is shifted in time, within the tolerance.
    pub shifted: usize,
    /// Number of differing parts that `--ignore` excludes.
    pub ignored: usize,
}

/// Plays a recording to an emulator and compares what that answers.
pub fn diff(recording: &Recording, candidate: Candidate, tolerance: &Tolerance) -> Report {
    let events = answers::events(recording, candidate.controller.config().options.text);
    Matching::new(Player::new(candidate, recording), tolerance).run(&events)
}

#[cfg(test)]
mod tests;
