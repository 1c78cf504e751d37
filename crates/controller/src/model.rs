//! The arm models: which axes an arm has, how far and how fast they go, and the lengths of its links.
//! What the lengths mean for positions is `motion::kinematics`'s; the course of a motion is `motion`'s.
//!
//! The built-in models are the files of `fixtures/models`, which say where each number comes from; reading model
//! files is left to the edge, `check` tells whether what was read is an arm.
//!
//! No data sheet of the first arms was at hand: their numbers are ours (D11), chosen so that the manual's sample positions
//! (SF-42, EXAMPLE-05 and the DATA block of 5.4.1) can be reached with room to spare. Those of the SCARA also agree with
//! a point and with motion times measured on a real arm (hosts.md 8.11, 8.12; `tests/suites/measured_times.rs`).

mod check;

pub use check::ModelError;

use crate::prelude::*;

/// Values an SF coordinate block has room for (SF-42).
pub const AXES: usize = 8;

/// One value per axis, axis 1 first: degrees, mm for axis 3 of a SCARA arm; axes the model has not are 0.
pub type Joints = [f64; AXES];

/// One arm: its geometry and its limits at 100 %.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmModel {
    /// Name by which it is chosen.
    pub name: String,
    /// Geometry.
    pub kind: ArmKind,
    /// The axes it has, axis 1 first; at most [`AXES`].
    pub axes: Vec<Axis>,
    /// Speed of the tool point on lines and arcs at 100 %, mm/s.
    pub max_tool_speed: f64,
    /// Acceleration of the tool point on lines and arcs at 100 %, mm/s².
    pub max_tool_accel: f64,
    /// Speed of turning the tool on lines and arcs at 100 %, degrees/s. The turning acceleration follows: the
    /// full turning speed is reached in the time in which the full tool speed is.
    pub max_turn_speed: f64,
    /// Heaviest load the hand may carry, kg (ours: no data sheet at hand).
    pub max_payload: f64,
    /// The posture READY goes to, and the one at power-up.
    pub ready: Joints,
}

/// One axis: degrees, or mm for axis 3 of a SCARA arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Lowest value.
    pub min: f64,
    /// Highest value.
    pub max: f64,
    /// Speed at 100 %, units/s.
    pub max_speed: f64,
    /// Acceleration and deceleration at 100 %, units/s².
    pub max_accel: f64,
}

/// Kind of arm, with its lengths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ArmKind {
    /// Vertical articulated arm with a spherical wrist.
    SixAxis(SixAxisGeometry),
    /// Horizontal articulated arm, with or without axis T.
    Scara(ScaraGeometry),
}

/// Lengths of a six-axis arm in mm. All axes at 0: everything stretched straight up, the flange on top.
/// Axis 1 turns about the upright, axes 2 and 3 lean forward (towards +X), axis 5 bends the wrist forward,
/// axes 4 and 6 roll about the forearm and the flange. The world origin is at the foot of axis 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SixAxisGeometry {
    /// Height of axis 2.
    pub shoulder_height: f64,
    /// Distance of axis 2 in front of axis 1.
    pub shoulder_offset: f64,
    /// Axis 2 to axis 3.
    pub upper_arm: f64,
    /// Distance of the forearm line in front of axis 3, arm stretched up.
    pub elbow_offset: f64,
    /// Axis 3 to the wrist centre, along the forearm line.
    pub forearm: f64,
    /// Wrist centre to flange.
    pub flange: f64,
}

/// Lengths of a SCARA arm in mm. All axes at 0: both links along +X; world Z is the value of axis 3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScaraGeometry {
    /// Axis 1 to axis 2.
    pub first_arm: f64,
    /// Axis 2 to the shaft.
    pub second_arm: f64,
}

const fn axis(reach: f64, max_speed: f64, max_accel: f64) -> Axis {
    Axis {
        min: -reach,
        max: reach,
        max_speed,
        max_accel,
    }
}

impl ArmModel {
    /// `ts3100-tv800`: the default, a six-axis arm reaching 850 mm to the wrist centre (assumed).
    ///
    /// Axes 4 and 6 go a full turn both ways, so that SINGLE and DOUBLE both exist for every position
    /// (DATA-04); axes 1, 2, 3 and 5 go so far that LEFTY and RIGHTY, ABOVE and BELOW, NFLIP and FLIP exist for the
    /// manual's sample positions. Ready: tool straight down, 408 mm in front at a height of 293 mm, configuration 11111.
    pub fn tv800() -> ArmModel {
        ArmModel {
            name: String::from("ts3100-tv800"),
            kind: ArmKind::SixAxis(SixAxisGeometry {
                shoulder_height: 300.0,
                shoulder_offset: 100.0,
                upper_arm: 370.0,
                elbow_offset: 0.0,
                forearm: 380.0,
                flange: 80.0,
            }),
            axes: [
                axis(190.0, 240.0, 960.0),
                axis(179.0, 240.0, 960.0),
                axis(165.0, 300.0, 1200.0),
                axis(360.0, 375.0, 1500.0),
                axis(175.0, 375.0, 1500.0),
                axis(360.0, 600.0, 2400.0),
            ]
            .to_vec(),
            max_tool_speed: 2000.0,
            max_tool_accel: 8000.0,
            max_turn_speed: 360.0,
            max_payload: 10.0,
            ready: [0.0, 10.0, 130.0, 0.0, 40.0, 0.0, 0.0, 0.0],
        }
    }

    /// `tsl3000-thl400`: a SCARA arm reaching 400 mm, with axis T as its fifth (assumed).
    ///
    /// Axis 1 goes half a turn both ways, because a point of the real arm needs it at -175.4 degrees (hosts.md 8.11).
    /// Speeds and accelerations of axes 1 to 3 are fitted to motion times of the real arm at override 20 (T21): there axis 1
    /// takes 108 ms and 6.80 ms a degree, axis 2 119 ms and 7.69 ms, axis 3 99 ms and 5.75 ms a millimetre. The measured
    /// times have communication in them, so the accelerations are higher than those of the arm.
    /// Ready: elbow to the left (LEFTY), 312 mm in front of the foot, shaft at 0 mm.
    pub fn thl400() -> ArmModel {
        ArmModel {
            name: String::from("tsl3000-thl400"),
            kind: ArmKind::Scara(ScaraGeometry {
                first_arm: 225.0,
                second_arm: 175.0,
            }),
            axes: [
                axis(180.0, 735.0, 34_000.0),
                axis(150.0, 650.0, 27_300.0),
                axis(150.0, 870.0, 44_000.0),
                axis(360.0, 1500.0, 75_000.0),
                axis(360.0, 600.0, 30_000.0),
            ]
            .to_vec(),
            max_tool_speed: 2500.0,
            max_tool_accel: 10_000.0,
            max_turn_speed: 720.0,
            max_payload: 5.0,
            ready: [-30.0, 78.0, 0.0, -48.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    /// `tsl3000-thl400-4`: the same without axis T (assumed).
    pub fn thl400_four_axes() -> ArmModel {
        let mut model = ArmModel::thl400();
        model.name = String::from("tsl3000-thl400-4");
        model.axes.truncate(4);
        model
    }

    /// `tsl3000-thl300`: a SCARA arm reaching 300 mm, with axis T as its fifth.
    ///
    /// The links and the way of axis 3 are those of the maker's drawing (hosts.md 9, J8). The rest is that of
    /// `tsl3000-thl400`. Ready: elbow to the left (LEFTY), 235 mm in front of the foot, shaft at 0 mm.
    pub fn thl300() -> ArmModel {
        let mut model = ArmModel::thl400();
        model.name = String::from("tsl3000-thl300");
        model.kind = ArmKind::Scara(ScaraGeometry {
            first_arm: 125.0,
            second_arm: 175.0,
        });
        if let Some(shaft) = model.axes.get_mut(2) {
            (shaft.min, shaft.max) = (0.0, 160.0);
        }
        model.ready = [-47.0, 78.0, 0.0, -31.0, 0.0, 0.0, 0.0, 0.0];
        model
    }

    /// `scara-600`: a SCARA arm reaching 600 mm, without axis T.
    ///
    /// Links, limits, speeds of the axes and load are those of a data sheet that names no arm (hosts.md 9, I19). The
    /// accelerations and the speeds on lines are ours. Ready: LEFTY, 465 mm in front of the foot, shaft at 0 mm.
    pub fn scara_600() -> ArmModel {
        ArmModel {
            name: String::from("scara-600"),
            kind: ArmKind::Scara(ScaraGeometry {
                first_arm: 300.0,
                second_arm: 300.0,
            }),
            axes: [
                axis(125.0, 450.0, 4500.0),
                axis(145.0, 450.0, 4500.0),
                Axis {
                    min: 0.0,
                    ..axis(150.0, 2000.0, 20_000.0)
                },
                axis(360.0, 1700.0, 17_000.0),
            ]
            .to_vec(),
            max_tool_speed: 2500.0,
            max_tool_accel: 10_000.0,
            max_turn_speed: 720.0,
            max_payload: 10.0,
            ready: [-39.0, 78.0, 0.0, -39.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    /// Every built-in model, the default first.
    pub fn built_in() -> [ArmModel; 5] {
        [
            ArmModel::tv800(),
            ArmModel::thl400(),
            ArmModel::thl400_four_axes(),
            ArmModel::thl300(),
            ArmModel::scara_600(),
        ]
    }

    /// Which way the language writes its positions.
    pub fn language(&self) -> scol_mini::Arm {
        match self.kind {
            ArmKind::SixAxis(_) => scol_mini::Arm::SixAxis,
            ArmKind::Scara(_) => scol_mini::Arm::Scara,
        }
    }

    /// The built-in model of that name, case ignored.
    pub fn by_name(name: &str) -> Option<ArmModel> {
        let mut models = ArmModel::built_in().into_iter();
        models.find(|model| model.name.eq_ignore_ascii_case(name))
    }
}

#[cfg(test)]
mod tests {
    use super::{AXES, ArmModel};

    #[test]
    fn models_are_found_by_name_and_rest_within_their_limits() {
        let names = [
            "ts3100-tv800",
            "TSL3000-THL400",
            "tsl3000-thl400-4",
            "tsl3000-thl300",
            "scara-600",
        ];
        assert_eq!(names.len(), ArmModel::built_in().len());
        for name in names {
            let model = ArmModel::by_name(name).unwrap();
            assert!(model.axes.len() <= AXES);
            for (axis, ready) in model.axes.iter().zip(model.ready) {
                assert!((axis.min..=axis.max).contains(&ready));
            }
        }
        assert!(ArmModel::by_name("tv1000").is_none());
    }
}
