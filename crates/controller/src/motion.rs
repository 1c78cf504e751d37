//! Motion planning: from a posture and a target to a value that gives the joints at any time.
//!
//! Everything is a closed-form function of time; nothing is summed per tick (D11). So the result does not depend on when
//! or how often it is read. The arm decides in which frame a position is meant and when a motion starts.
//!
//! ```text
//!  plan(model, from, target, tool, limits)          kinematics: joints <-> pose
//!        |  path: the geometry                      profile:    place and speed on it in time
//!        v
//!  Motion  --hold--> held --resume--> moving --set_limits--> moving --stop--> ends where it comes to rest
//! ```

mod arch;
mod courses;
mod effort;
mod kinematics;
mod path;
mod plan;
mod profile;
mod run;

pub use arch::Gate;
pub use effort::Effort;
pub use kinematics::{Singularity, Unreachable};
pub use plan::plan;
pub(crate) use plan::with_axis;
pub use run::Motion;
pub(crate) use scol_mini::geometry::{self as pose, pairwise};
pub use scol_mini::geometry::{Pose, Transform, normalised};

use crate::model::{AXES, Joints};

/// Smallest part of full speed or acceleration a motion is run with: 1 % of 1 %.
pub const MIN_FRACTION: f64 = 1e-4;
/// Share of their acceleration that an empty hand leaves the axes: all.
pub const NO_LOAD: f64 = 1.0;
/// Smallest bound for the tool speed, mm/s.
pub const MIN_TOOL_SPEED: f64 = 0.1;

/// How fast a motion may be. Values out of range are taken as the nearest in range, no number as the smallest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Part of full speed that is asked for: SPEED. With the override, [`MIN_FRACTION`] to 1.
    pub speed: f64,
    /// The override, a factor on the speed.
    pub override_part: f64,
    /// Part of full acceleration, [`MIN_FRACTION`] to 1.
    pub accel: f64,
    /// Part of full deceleration, [`MIN_FRACTION`] to 1.
    pub decel: f64,
    /// Highest speed of the tool point in mm/s, if one holds: 250 in TEACHING (PRM-SPD-01).
    pub tool_speed_cap: Option<f64>,
    /// Part of its full torque each axis may use, 0 to 1: it accelerates no faster than by this part of what it can.
    /// An axis with 0 does not move: a motion that needs it is refused.
    pub torque: Joints,
}

impl Limits {
    /// 100 % of everything, no cap (PRM-SPD-02).
    pub const FULL: Limits = Limits {
        speed: 1.0,
        override_part: 1.0,
        accel: 1.0,
        decel: 1.0,
        tool_speed_cap: None,
        torque: [1.0; AXES],
    };
}

/// Where a motion goes, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// The tool point goes to a world pose, in a configuration; a digit 0 keeps the present one.
    Pose(Pose, [u8; 5], Route),
    /// MOVEA: one axis goes to a value, degrees or mm.
    Axis {
        /// Number of the axis, from 0.
        axis: usize,
        /// Value to go to.
        value: f64,
    },
    /// READY: every joint to its value.
    Joints(Joints),
}

/// How the tool point goes to a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Route {
    /// MOVE: all joints start and end together, each with a trapezoid of its own.
    Joint,
    /// MOVES: the tool point goes in a straight line, the tool turns about a fixed axis.
    Line,
    /// MOVEC: the tool point goes along the circle from here through this world pose; the tool turns about a fixed
    /// axis from its present orientation to that of the end (that of the point between does not count: ours, assumed).
    Arc(Pose),
    /// MOVEJ: up, across, down, in the direction of the world's Z, with these distances. The configuration stays.
    Arch(Gate),
}

/// Why a motion cannot be done. The arm has not moved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// No posture for the target.
    #[error("target: {0}")]
    Unreachable(Unreachable),
    /// No posture for a point of the path.
    #[error("at {percent:.0} % of the path: {reason}")]
    OnPath {
        /// Part of the path before the point, 0 to 100.
        percent: f64,
        reason: Unreachable,
    },
    /// The path runs through a singular posture: an axis would have to jump. `axis` counts from 1.
    #[error("at {percent:.0} % of the path: {posture}; axis {axis} would have to jump by {jump:.1} degrees")]
    Singular {
        posture: Singularity,
        /// Part of the path before the point, 0 to 100.
        percent: f64,
        /// Number of the axis.
        axis: usize,
        /// How far it would have to jump, degrees.
        jump: f64,
    },
    /// A line or an arc cannot end in this configuration; `place` of the digit counts from 1.
    #[error("configuration digit {place}: expected {reached} (the path leads there), found {wanted}")]
    Configuration {
        /// Place of the digit.
        place: usize,
        /// Digit the path leads to.
        reached: u8,
        /// Digit asked for.
        wanted: u8,
    },
    /// Start, via point and end do not span a circle.
    #[error("arc: expected three points of a circle, found points on one line")]
    NoArc,
    /// A distance of an arch that its way up or down does not have, in mm.
    #[error("arch: {name}: expected 0 to {max:.3} mm, found {found:.3}")]
    Gate {
        /// retreat, single-axis 1 or single-axis 2.
        name: &'static str,
        /// Distance asked for.
        found: f64,
        /// Longest that fits.
        max: f64,
    },
    /// An axis that has to move is free: its servo gain or its torque is 0. `axis` counts from 1.
    #[error("axis {axis} has to move: expected servo gain and torque, found none")]
    Free {
        /// Number of the axis.
        axis: usize,
    },
    /// The axis to be jogged is at its limit; axes count from 1.
    #[error("axis {axis} is at its limit in that direction")]
    AtLimit {
        /// Number of the axis.
        axis: usize,
    },
    /// The arm has no such axis; both count from 1.
    #[error("axis: expected 1 to {axes}, found {axis}")]
    NoSuchAxis {
        /// Number asked for.
        axis: usize,
        /// Axes the arm has.
        axes: usize,
    },
}

impl From<Unreachable> for MotionError {
    fn from(error: Unreachable) -> MotionError {
        MotionError::Unreachable(error)
    }
}

#[cfg(test)]
mod tests;
