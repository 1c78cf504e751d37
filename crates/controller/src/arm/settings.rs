//! The speeds a motion asks for, and how the load reduces them.
//!
//! [`MotionSettings`] holds what SPEED, ACCEL, DECEL, TORQUE and PAYLOAD say; `limits` turns it into the limits that
//! `crate::motion` plans with.

use super::SpeedLimits;
use crate::model::Joints;
use crate::motion::Limits;

/// The speeds a motion asks for, in percent, and the part of its torque each axis may use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotionSettings {
    pub speed: f64,
    pub accel: f64,
    pub decel: f64,
    pub torque: Joints,
    /// Part of their acceleration that the load leaves the axes.
    pub load_part: f64,
}

/// Part of the acceleration that the heaviest load takes away (ours: the real curve is not known).
const LOAD_EFFECT: f64 = 0.5;

/// The part of acceleration and deceleration that a load leaves, in proportion to its part of the heaviest one.
pub(super) fn load_part(mass: f64, heaviest: f64) -> f64 {
    1.0 - LOAD_EFFECT * (mass / heaviest).clamp(0.0, 1.0)
}

impl MotionSettings {
    /// Speeds and accelerations with these settings.
    pub fn limits(self, pace: SpeedLimits) -> Limits {
        Limits {
            speed: self.speed / 100.0,
            override_part: f64::from(pace.override_percent) / 100.0,
            accel: self.accel / 100.0,
            decel: self.decel / 100.0,
            tool_speed_cap: pace.tool_speed_cap,
            torque: self.torque,
        }
    }
}
