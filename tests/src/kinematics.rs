//! Checks of kinematics and motion over random postures: there and back in all configurations, lines that stay straight,
//! durations compared with the closed form, and answers that do not depend on earlier queries.
//!
//! The suite `kinematics` runs them with few postures, the binary `kinematics` with all.

use std::time::Duration;
use ts3100_controller::model::{ArmKind, ArmModel, Joints};
use ts3100_controller::motion::{Limits, Motion, Pose, Route, Target, Transform, plan};

/// Most a pose may differ from itself there and back, mm and degrees.
pub const POSE: f64 = 1e-6;
/// Most a line may be off its line, mm.
pub const LINE: f64 = 1e-3;
/// Most a duration may differ from the closed form, s: a microsecond of rounding.
pub const SECONDS: f64 = 1.1e-6;
/// Points looked at on a line.
const POINTS: u32 = 40;

/// A seeded generator: every run sees the same postures.
#[derive(Debug, Clone)]
pub struct Seeded(u64);

impl Seeded {
    /// The generator of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Seeded {
        Seeded(seed)
    }

    /// A number between two.
    pub fn between(&mut self, min: f64, max: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        min + (max - min) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// A posture within the limits.
    pub fn posture(&mut self, model: &ArmModel) -> Joints {
        let mut joints = Joints::default();
        for (joint, axis) in joints.iter_mut().zip(&model.axes) {
            *joint = self.between(axis.min, axis.max);
        }
        joints
    }
}

/// What was found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Random poses gone to and back.
    pub poses: u32,
    /// Postures found for them, over all configurations.
    pub postures: u64,
    /// Configurations that led somewhere.
    pub configurations: usize,
    /// Worst difference of a pose, mm.
    pub worst_mm: f64,
    /// Worst difference of a pose, degrees.
    pub worst_degrees: f64,
    /// Postures whose configuration was not the one polled for, or that were lost on the way back.
    pub wrong: u64,
    /// Lines planned.
    pub lines: u32,
    /// Farthest any of them was off its line, mm.
    pub worst_line: f64,
    /// Single-axis motions timed.
    pub timed: u32,
    /// Worst difference from the closed form, s.
    pub worst_seconds: f64,
    /// Answers that depended on what was polled before.
    pub polled: u32,
}

impl Report {
    /// Whether everything is within its bounds, and there was something to look at.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.worst_mm <= POSE
            && self.worst_degrees <= POSE
            && self.wrong == 0
            && self.worst_line <= LINE
            && self.worst_seconds <= SECONDS
            && self.polled == 0
            && self.lines > 0
            && self.timed > 0
            && self.postures > u64::from(self.poses)
    }
}

/// All configurations of a kind of arm.
#[must_use]
pub fn configurations(kind: &ArmKind) -> Vec<[u8; 5]> {
    match kind {
        ArmKind::SixAxis(_) => (0..32u8)
            .map(|number| [0, 1, 2, 3, 4].map(|place| 1 + (number >> place & 1)))
            .collect(),
        ArmKind::Scara(_) => vec![[1, 0, 0, 0, 0], [2, 0, 0, 0, 0]],
    }
}

/// Checks a model with so many random poses, and a fiftieth as many lines and timed motions.
#[must_use]
pub fn verify(model: &ArmModel, seed: u64, poses: u32) -> Report {
    let mut report = Report::default();
    let mut seeded = Seeded::new(seed);
    let configurations = configurations(&model.kind);
    let mut reached = vec![false; configurations.len()];
    for _ in 0..poses {
        let joints = seeded.posture(model);
        there_and_back(model, &joints, &configurations, &mut reached, &mut report);
    }
    report.configurations = reached.iter().filter(|reached| **reached).count();
    for _ in 0..poses.div_ceil(50) {
        line(model, &mut seeded, &mut report);
        axis(model, &mut seeded, &mut report);
    }
    report
}

fn there_and_back(
    model: &ArmModel,
    joints: &Joints,
    configurations: &[[u8; 5]],
    reached: &mut [bool],
    report: &mut Report,
) {
    let (pose, own) = model.forward(joints);
    report.poses += 1;
    let mut back = false;
    for (config, reached) in configurations.iter().zip(reached) {
        let Ok(found) = model.inverse(&pose, *config, joints) else {
            continue;
        };
        let (again, digits) = model.forward(&found);
        *reached = true;
        report.postures += 1;
        report.wrong += u64::from(digits != *config);
        back |= *config == own;
        let difference = pose.transform().inverse().compose(&again.transform()).to_coords();
        for (index, part) in difference.iter().enumerate() {
            let worst = if index < 3 {
                &mut report.worst_mm
            } else {
                &mut report.worst_degrees
            };
            *worst = worst.max(part.abs());
        }
    }
    report.wrong += u64::from(!back);
}

/// A line to a place nearby, with a tool; what cannot be gone straight is left out.
fn line(model: &ArmModel, seeded: &mut Seeded, report: &mut Report) {
    let tool = Transform::from_coords([
        seeded.between(-50.0, 50.0),
        seeded.between(-50.0, 50.0),
        seeded.between(-150.0, 0.0),
        0.0,
        0.0,
        seeded.between(-90.0, 90.0),
    ]);
    let from = seeded.posture(model);
    let start = tool_point(model, &from, &tool);
    let mut end = start;
    for part in &mut end.xyz {
        *part += seeded.between(-150.0, 150.0);
    }
    end.abc[2] += seeded.between(-45.0, 45.0);
    let limits = Limits {
        speed: seeded.between(0.05, 1.0),
        ..Limits::FULL
    };
    let Ok(motion) = plan(
        model,
        &from,
        &Target::Pose(end, [0; 5], Route::Line),
        &tool,
        &limits,
    ) else {
        return;
    };
    report.lines += 1;
    let mut polled = motion.clone();
    for step in 0..=POINTS {
        let at = motion.duration() * step / POINTS;
        let joints = motion.joints_at(at);
        // Asked in another order, and of a motion polled before.
        let other = polled.joints_at(motion.duration() - at);
        report.polled += u32::from(polled.joints_at(at) != joints);
        report.polled += u32::from(motion.joints_at(motion.duration() - at) != other);
        let here = tool_point(model, &joints, &tool);
        report.worst_line = report.worst_line.max(off_line(here.xyz, start.xyz, end.xyz));
    }
    // Feed hold and its release at the same moments lead to the same, however often it was polled between.
    let mut once = motion;
    for motion in [&mut polled, &mut once] {
        let third = motion.duration() / 3;
        motion.hold(third);
        let rest = motion.duration();
        motion.resume(rest + Duration::from_millis(7));
    }
    report.polled += u32::from(polled != once);
}

fn tool_point(model: &ArmModel, joints: &Joints, tool: &Transform) -> Pose {
    let flange = model.forward(joints).0;
    Pose::from_transform(&flange.transform().compose(tool), flange.uv)
}

fn off_line(at: [f64; 3], from: [f64; 3], to: [f64; 3]) -> f64 {
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (way, gone) = (minus(to, from), minus(at, from));
    let part = (dot(gone, way) / dot(way, way)).clamp(0.0, 1.0);
    let off = minus(gone, way.map(|along| along * part));
    dot(off, off).sqrt()
}

/// MOVEA of a random axis, timed beside the trapezoid written out.
fn axis(model: &ArmModel, seeded: &mut Seeded, report: &mut Report) {
    let from = seeded.posture(model);
    let index = (seeded.between(0.0, model.axes.len() as f64) as usize).min(model.axes.len() - 1);
    let axis = model.axes[index];
    let value = seeded.between(axis.min, axis.max);
    let limits = Limits {
        speed: seeded.between(0.01, 1.0),
        override_part: seeded.between(0.01, 1.0),
        accel: seeded.between(0.01, 1.0),
        decel: seeded.between(0.01, 1.0),
        ..Limits::FULL
    };
    let target = Target::Axis { axis: index, value };
    let Ok(motion) = plan(model, &from, &target, &Transform::IDENTITY, &limits) else {
        report.wrong += 1;
        return;
    };
    let way = (value - from[index]).abs();
    let (up, down) = (axis.max_accel * limits.accel, axis.max_accel * limits.decel);
    let full = axis.max_speed * limits.speed;
    let speed = full.min((2.0 * way * up * down / (up + down)).sqrt());
    let ramps = speed * speed * (1.0 / up + 1.0 / down) / 2.0;
    // The override is a factor on the time (T27.15).
    let expected = (speed / up + speed / down + (way - ramps).max(0.0) / speed) / limits.override_part;
    report.timed += 1;
    report.worst_seconds = report.worst_seconds.max(difference(&motion, expected));
}

fn difference(motion: &Motion, expected: f64) -> f64 {
    (motion.duration().as_secs_f64() - expected).abs()
}
