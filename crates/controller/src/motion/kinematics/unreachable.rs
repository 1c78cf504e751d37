//! The reasons why no posture reaches a pose, for messages.
//!
//! The parent module and the two kinds of arm detect them.

/// Why no posture reaches a pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// An axis would leave its limits; `axis` counts from 1, values in degrees or mm.
    #[error("axis {axis}: expected {min} to {max}, found {value:.3}")]
    Limit {
        /// Number of the axis, from 1.
        axis: usize,
        /// Value it would need.
        value: f64,
        /// Lowest value allowed.
        min: f64,
        /// Highest value allowed.
        max: f64,
    },
    /// The arm is too short, or cannot fold so close: distances in mm from axis 2 (six-axis) or 1 (SCARA).
    #[error("reach: expected {min:.3} to {max:.3} mm, found {distance:.3} mm")]
    Reach {
        /// Distance asked for.
        distance: f64,
        /// Smallest distance.
        min: f64,
        /// Largest distance.
        max: f64,
    },
    /// A SCARA arm cannot tilt its shaft: A and B in degrees.
    #[error("orientation: expected an upright tool, found A = {a:.3}, B = {b:.3}")]
    Tilt {
        /// Rotation about X.
        a: f64,
        /// Rotation about Y.
        b: f64,
    },
    /// The position has a value for an axis the arm has not; `axis` counts from 1.
    #[error("axis {axis}: expected 0 (the arm has no such axis), found {value:.3}")]
    NotFitted {
        /// Number of the axis, from 1.
        axis: usize,
        /// Value asked for.
        value: f64,
    },
    /// A configuration digit out of 0, 1, 2, or one that this arm does not have; `place` counts from 1.
    #[error("configuration digit {place}: expected 0 to {max}, found {found}")]
    Configuration {
        /// Place of the digit, from 1.
        place: usize,
        /// Highest digit that means something there.
        max: u8,
        /// Digit found.
        found: u8,
    },
    /// A coordinate is not finite.
    #[error("position: expected finite numbers")]
    NotFinite,
}
