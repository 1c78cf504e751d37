//! Validates an arm model: every number finite and within bounds, and as many axes as the geometry has.
//!
//! Model files are read by the emulator; this module names the table and key of the first wrong number.

use super::{ArmKind, ArmModel, Axis};
use crate::prelude::*;

/// Longest name of a model.
const MAX_NAME: usize = 32;
/// Longest link, farthest sliding axis, mm.
const MAX_LENGTH: f64 = 10_000.0;
/// Shortest link that carries another, mm.
const MIN_LENGTH: f64 = 1.0;
/// Farthest turn of an axis, degrees.
const MAX_ANGLE: f64 = 3600.0;
/// Highest speed, units/s.
const MAX_SPEED: f64 = 100_000.0;
/// Highest acceleration, units/s².
const MAX_ACCEL: f64 = 10_000_000.0;
/// Lowest speed and acceleration.
const MIN_RATE: f64 = 0.001;
/// Heaviest load, kg.
const MAX_LOAD: f64 = 10_000.0;

/// An invalid value of a model, with its place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The name.
    #[error("name: expected 1 to {MAX_NAME} letters, digits, `-`, `_` or `.`, found `{0}`")]
    Name(String),
    /// As many axes as the geometry moves: 6; SCARA 4, or 5 with axis T.
    #[error("axes: expected {}, found {found}", if *max == 6 { "6" } else { "4, or 5 with axis T" })]
    Axes {
        /// Most axes this kind of arm has.
        max: usize,
        /// Axes given.
        found: usize,
    },
    /// A number out of its range, or no number.
    #[error("{place}: expected {min} to {max}, found {found}")]
    Number {
        /// Table and key.
        place: String,
        /// Lowest value.
        min: f64,
        /// Highest value.
        max: f64,
        /// Value given.
        found: f64,
    },
}

fn check_number(place: impl Into<String>, found: f64, min: f64, max: f64) -> Result<(), ModelError> {
    if (min..=max).contains(&found) {
        return Ok(());
    }
    Err(ModelError::Number {
        place: place.into(),
        min,
        max,
        found,
    })
}

impl ArmModel {
    /// Whether this is an arm.
    ///
    /// # Errors
    /// The first number, name or count that is none of an arm, with its place.
    pub fn validate(&self) -> Result<(), ModelError> {
        let known = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        if self.name.is_empty() || self.name.len() > MAX_NAME || !self.name.bytes().all(known) {
            return Err(ModelError::Name(self.name.chars().take(MAX_NAME).collect()));
        }
        self.check_geometry()?;
        check_number("tool.max_speed", self.max_tool_speed, MIN_RATE, MAX_SPEED)?;
        check_number("tool.max_accel", self.max_tool_accel, MIN_RATE, MAX_ACCEL)?;
        check_number("tool.max_turn_speed", self.max_turn_speed, MIN_RATE, MAX_SPEED)?;
        check_number("tool.max_payload", self.max_payload, MIN_RATE, MAX_LOAD)?;
        let (least, most) = match self.kind {
            ArmKind::SixAxis(_) => (6, 6),
            ArmKind::Scara(_) => (4, 5),
        };
        let found = self.axes.len();
        if !(least..=most).contains(&found) {
            return Err(ModelError::Axes { max: most, found });
        }
        for (index, (axis, ready)) in self.axes.iter().zip(self.ready).enumerate() {
            self.check_axis(index, axis)?;
            check_number(format!("ready: joint {}", index + 1), ready, axis.min, axis.max)?;
        }
        for (index, ready) in self.ready.iter().enumerate().skip(found) {
            check_number(format!("ready: joint {}", index + 1), *ready, 0.0, 0.0)?;
        }
        Ok(())
    }

    fn check_geometry(&self) -> Result<(), ModelError> {
        let link =
            |key: &str, value: f64| check_number(format!("geometry.{key}"), value, MIN_LENGTH, MAX_LENGTH);
        let offset =
            |key: &str, value: f64| check_number(format!("geometry.{key}"), value, -MAX_LENGTH, MAX_LENGTH);
        match &self.kind {
            ArmKind::SixAxis(arm) => {
                offset("shoulder_height", arm.shoulder_height)?;
                offset("shoulder_offset", arm.shoulder_offset)?;
                link("upper_arm", arm.upper_arm)?;
                offset("elbow_offset", arm.elbow_offset)?;
                link("forearm", arm.forearm)?;
                check_number("geometry.flange", arm.flange, 0.0, MAX_LENGTH)
            }
            ArmKind::Scara(arm) => {
                link("first_arm", arm.first_arm)?;
                link("second_arm", arm.second_arm)
            }
        }
    }

    fn check_axis(&self, index: usize, axis: &Axis) -> Result<(), ModelError> {
        let place = |key: &str| format!("axis {}: {key}", index + 1);
        let slides = matches!(self.kind, ArmKind::Scara(_)) && index == 2;
        let most = if slides { MAX_LENGTH } else { MAX_ANGLE };
        check_number(place("max"), axis.max, -most, most)?;
        check_number(place("min"), axis.min, -most, axis.max)?;
        check_number(place("max_speed"), axis.max_speed, MIN_RATE, MAX_SPEED)?;
        check_number(place("max_accel"), axis.max_accel, MIN_RATE, MAX_ACCEL)
    }
}

#[cfg(test)]
mod tests {
    use super::ModelError;
    use crate::model::{ArmKind, ArmModel};
    use crate::prelude::*;

    #[test]
    fn the_built_in_models_are_arms() {
        for model in ArmModel::built_in() {
            assert_eq!(model.validate(), Ok(()), "{}", model.name);
        }
    }

    #[track_caller]
    fn refused(change: impl FnOnce(&mut ArmModel), message: &str) {
        let mut model = ArmModel::tv800();
        change(&mut model);
        assert_eq!(model.validate().unwrap_err().to_string(), message);
    }

    #[test]
    fn what_is_no_arm_is_named_with_its_place() {
        refused(
            |model| model.name = String::from("my arm"),
            "name: expected 1 to 32 letters, digits, `-`, `_` or `.`, found `my arm`",
        );
        refused(
            |model| model.axes[2].max_speed = 0.0,
            "axis 3: max_speed: expected 0.001 to 100000, found 0",
        );
        refused(
            |model| model.axes[0].min = 200.0,
            "axis 1: min: expected -3600 to 190, found 200",
        );
        refused(
            |model| model.max_tool_accel = f64::NAN,
            "tool.max_accel: expected 0.001 to 10000000, found NaN",
        );
        refused(
            |model| model.ready[3] = 361.0,
            "ready: joint 4: expected -360 to 360, found 361",
        );
        refused(
            |model| {
                if let ArmKind::SixAxis(arm) = &mut model.kind {
                    arm.forearm = f64::INFINITY;
                }
            },
            "geometry.forearm: expected 1 to 10000, found inf",
        );
        let mut model = ArmModel::thl400();
        model.axes.pop();
        assert_eq!(model.validate(), Ok(()), "T may be missing");
        model.ready[4] = 10.0;
        assert_eq!(
            model.validate().unwrap_err().to_string(),
            "ready: joint 5: expected 0 to 0, found 10"
        );
        model.axes.pop();
        assert_eq!(model.validate(), Err(ModelError::Axes { max: 5, found: 3 }));
        assert_eq!(
            model.validate().unwrap_err().to_string(),
            "axes: expected 4, or 5 with axis T, found 3"
        );
        refused(|model| model.axes.truncate(5), "axes: expected 6, found 5");
    }
}
