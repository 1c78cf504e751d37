//! The host's side of a recording played to a controller of our own, in virtual time, and every difference between
//! the answers recorded and its own: in bytes, told by field and item, and in time. Cutting lines into answers is
//! `unit`'s, playing `player`'s, comparing one answer `compare`'s; here both meet.

mod answers;
mod compare;
pub mod ignore;
mod matching;
mod player;

pub use compare::PartDifference;
pub use ignore::{Ignore, IgnoreError};

use crate::config::Settings;
use crate::driver::StartError;
use crate::transcript::{EndReason, PeerId, Recording};
use matching::Matching;
use player::Player;
use std::time::Duration;
use ts3100_controller::Time;

/// Most differences that are kept; the others are counted.
pub const MAX_DIFFERENCES: usize = 10_000;

/// What counts as a difference.
#[derive(Debug, Clone)]
pub struct Tolerance {
    /// Answers that come at most this much earlier or later are in time.
    pub time: Duration,
    /// Coordinates of SF that differ by at most this are the same.
    pub value: f64,
    /// How long behind its time an answer is waited for before it counts as missing.
    pub answer_timeout: Duration,
    /// What is not compared.
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

/// How an answer differs.
#[derive(Debug, Clone, PartialEq)]
pub enum DifferenceKind {
    /// In its bytes.
    Bytes {
        /// The answer recorded.
        recorded: Vec<u8>,
        /// The emulator's.
        emulated: Vec<u8>,
        /// Where, and what it means.
        parts: Vec<PartDifference>,
        /// Why the emulator has refused, if it has.
        reason: Option<String>,
    },
    /// In its time, since the host or the robot last did something.
    Time {
        /// The answer recorded.
        recorded: Vec<u8>,
        /// When it came.
        recorded_after: Duration,
        /// When the emulator's came; earlier than what it was measured from is zero.
        emulated_after: Duration,
    },
    /// The emulator does not send it.
    Missing {
        /// The answer recorded.
        recorded: Vec<u8>,
        /// What the emulator says about the host's bytes before it, if anything.
        reason: Option<String>,
    },
    /// The emulator sends it, the recording has nothing of the kind.
    Surplus {
        /// The emulator's answer.
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

/// A difference.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Line of the file of the recording.
    pub file_line: usize,
    /// Time of the recording.
    pub at: Time,
    /// Where.
    pub line: PeerId,
    /// The host's text before it, as far as it is worth showing; empty if there was none.
    pub question: String,
    /// How it differs.
    pub kind: DifferenceKind,
}

/// What came out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// The differences, in the order of the recording.
    pub differences: Vec<Difference>,
    /// Further differences that were not kept.
    pub more: usize,
    /// Answers of the recording.
    pub answers: usize,
    /// Inputs of the host and the panel that were played.
    pub inputs: usize,
    /// Answers that are the same when the emulator is asked a little earlier or later, within the tolerance of time.
    pub shifted: usize,
    /// Parts of answers that differ and were asked not to count.
    pub ignored: usize,
}

/// Plays a recording to a controller of these settings.
///
/// # Errors
/// A controller that cannot be made of these settings.
pub fn diff(recording: &Recording, settings: &Settings, tolerance: &Tolerance) -> Result<Report, StartError> {
    let player = Player::power_on(settings, recording)?;
    let events = answers::events(recording, settings.controller.options.text);
    Ok(Matching::new(player, tolerance).run(&events))
}

#[cfg(test)]
mod tests;
