//! The motion conditions that a program sets (`SPEED`, `ACCEL`, `TOOL` ...): system variables that last until changed.
//!
//! Setting them is in `machine::request_values`. Their effect on a motion is left to the mover of the arm.

use crate::builtin::Condition;
use crate::prelude::*;

use crate::value::{Configuration, Frame, Payload};

/// Axes that `GAIN` and `TORQUE` know.
pub const AXES: usize = 8;
/// The most that SPEED, PASS, GAIN and TORQUE take, and what the arm has of ACCEL and DECEL, in percent.
pub const FULL: f64 = 100.0;
/// The most that ACCEL and DECEL take, in percent (ste85409 L72).
pub const MAX_ACCEL: f64 = 100_000.0;
/// Overlap ratio before `PASS` sets one, in percent.
const FIRST_PASS: f64 = 50.0;

impl Condition {
    /// Whether it is a coordinate system.
    pub fn is_frame(self) -> bool {
        matches!(self, Condition::Work | Condition::Tool | Condition::Base)
    }
}

/// Accuracy with which a motion ends before the program continues (`ACCUR`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Accuracy {
    /// The next statement begins a little before the arm rests.
    Coarse,
    /// The arm rests first.
    Fine,
}

/// `SPEED`, `ACCEL`, `DECEL`, `CONFIG`, `BASE`, `TOOL`, `WORK`, `PAYLOAD` and the like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Percent of the maximum speed, 1 to 100.
    pub speed: f64,
    /// Percent of the maximum acceleration, 1 to [`MAX_ACCEL`]; the arm has [`FULL`].
    pub accel: f64,
    /// Percent of the maximum deceleration, as `accel`.
    pub decel: f64,
    /// Posture for positions that have none.
    pub config: Configuration,
    /// Base coordinate system.
    pub base: Frame,
    /// Tool coordinate system.
    pub tool: Frame,
    /// Work coordinate system.
    pub work: Frame,
    /// Selected load and the name of its data; `None` after `FREELOAD`.
    pub payload: Option<(Option<String>, Payload)>,
    /// `ENABLE NOWAIT`: the program continues once a motion has started.
    pub nowait: bool,
    /// Overlap ratio of `PASS` in percent, 0 to 100; it holds while `passing`.
    pub pass: f64,
    /// `ENABLE PASS`: the arm does not rest between two motions.
    pub passing: bool,
    /// `ACCUR`: how exactly the arm has arrived before the next statement.
    pub accuracy: Accuracy,
    /// `GAIN` of each axis, axis 1 first.
    pub gain: [f64; AXES],
    /// `TORQUE` of each axis in percent, axis 1 first.
    pub torque: [f64; AXES],
}

impl Conditions {
    /// The value of this condition, if it is ACCEL or DECEL and asks for more than there is.
    pub(crate) fn over_full(&self, condition: Condition) -> Option<f64> {
        let percent = match condition {
            Condition::Accel => self.accel,
            Condition::Decel => self.decel,
            Condition::Speed
            | Condition::Config
            | Condition::Payload
            | Condition::Work
            | Condition::Tool
            | Condition::Base
            | Condition::Pass
            | Condition::Accur => return None,
        };
        (percent > FULL).then_some(percent)
    }
}

impl Default for Conditions {
    fn default() -> Self {
        Self {
            speed: 100.0,
            accel: 100.0,
            decel: 100.0,
            config: Configuration::default(),
            base: Frame::default(),
            tool: Frame::default(),
            work: Frame::default(),
            payload: None,
            nowait: false,
            pass: FIRST_PASS,
            passing: false,
            accuracy: Accuracy::Fine,
            gain: [1.0; AXES],
            torque: [100.0; AXES],
        }
    }
}
