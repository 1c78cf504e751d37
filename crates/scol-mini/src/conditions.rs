//! The motion conditions a program sets: system variables that last until changed.
//! What they do to a motion is left to whoever moves the arm.

use alloc::string::String;

use crate::value::{Configuration, Payload, Trans};

/// A coordinate system in use, with the name of the variable it came from (SF reports names).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Upper-case name of the coordinate data; `None` when it was written in place.
    pub name: Option<String>,
    /// Where it lies.
    pub trans: Trans,
}

/// `SPEED`, `ACCEL`, `DECEL`, `CONFIG`, `BASE`, `TOOL`, `WORK`, `PAYLOAD` and their kin.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Percent of the maximum speed, 1 to 100.
    pub speed: f64,
    /// Percent of the maximum acceleration, 1 to 100.
    pub accel: f64,
    /// Percent of the maximum deceleration, 1 to 100.
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
    /// Statements do not wait for the end of a motion. No statement sets it yet.
    pub nowait: bool,
    /// Overlap ratio in percent. No statement sets it yet.
    pub pass: f64,
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
            pass: 0.0,
        }
    }
}
