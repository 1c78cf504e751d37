//! The effort of a motion between two moments: distance and torque of each axis.
//!
//! Torque is the part of its acceleration that an axis uses, as the statement TORQUE counts it: the inertia is not
//! known, so the available acceleration is used instead. `crate::arm` adds up the efforts of all motions.

use super::path::Path;
use super::pose::{minus, pairwise, plus};
use super::profile::Profile;
use crate::model::{AXES, ArmModel, Joints};

/// Steps into which a stretch of steady acceleration is cut where the axes do not follow it evenly: on lines, arcs,
/// arches, motions that overlap, and where axes have courses of their own.
const UNEVEN_STEPS: u16 = 64;
/// The same for a motion of one axis: two give its acceleration exactly.
const EVEN_STEPS: u16 = 2;
/// Shortest step in which an acceleration can be told from rounding, s: the rounding of 180 degrees counts for up to
/// 0.1 degrees/s² here.
const SHORTEST_STEP: f64 = 1e-6;

/// Effort of the axes: each value belongs to one axis, degrees, or mm of one that slides.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effort {
    /// Distance travelled in both directions.
    pub way: Joints,
    /// Torque integrated over time, percent times seconds.
    pub torque: Joints,
    /// Its square integrated over time.
    pub square: Joints,
    /// Highest torque, percent.
    pub peak: Joints,
    /// Seconds in which the arm moved.
    pub seconds: f64,
}

impl Effort {
    /// Adds the effort of a following motion.
    pub fn add(&mut self, other: &Effort) {
        *self = Effort {
            way: plus(self.way, other.way),
            torque: plus(self.torque, other.torque),
            square: plus(self.square, other.square),
            peak: pairwise(self.peak, other.peak, f64::max),
            seconds: self.seconds + other.seconds,
        };
    }

    /// The same, with no number below 0 or above `most`.
    pub(crate) fn within(self, most: f64) -> Effort {
        // A number that is none becomes 0.
        let within = |number: f64| number.max(0.0).min(most);
        Effort {
            way: self.way.map(within),
            torque: self.torque.map(within),
            square: self.square.map(within),
            peak: self.peak.map(within),
            seconds: within(self.seconds),
        }
    }

    /// The mean over its time of one of its integrals; 0 where there was none.
    pub(crate) fn mean(&self, integral: Joints) -> Joints {
        integral.map(|sum| {
            if self.seconds > 0.0 {
                sum / self.seconds
            } else {
                0.0
            }
        })
    }

    /// All its numbers, to validate a snapshot.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let joints = [self.way, self.torque, self.square, self.peak];
        joints.into_iter().flatten().chain([self.seconds])
    }
}

/// Effort of the axes between the seconds `from` and `to` of a path. `load` is the part of their acceleration that the
/// load in the hand leaves them.
pub(super) fn between(
    model: &ArmModel,
    path: &Path,
    profile: &Profile,
    load: f64,
    (from, to): (f64, f64),
) -> Effort {
    let steps = match path {
        Path::Joint { courses: None, .. } => EVEN_STEPS,
        Path::Joint { .. } | Path::Chain(_) | Path::Tool(_) => UNEVEN_STEPS,
    };
    let mut effort = Effort::default();
    for (begin, end) in profile.stretches(from, to) {
        let step = (end - begin) / f64::from(steps);
        let at = |index: u16| path.joints_at(profile.state_at(begin + step * f64::from(index)).place);
        let way = |from: &Joints, to: &Joints| minus(*to, *from).map(f64::abs);
        let mut trail = [at(0); 3];
        effort.seconds += end - begin;
        for index in 1..=steps {
            trail = [trail[1], trail[2], at(index)];
            effort.way = plus(effort.way, way(&trail[1], &trail[2]));
            if index > 1 && step > SHORTEST_STEP {
                // Each inner moment stands for an equal part of the stretch.
                let seconds = (end - begin) / f64::from(steps - 1);
                add_torque(&mut effort, model, &trail, step, load, seconds);
            }
        }
    }
    effort
}

/// The torque computed from three postures a step apart, and its duration in seconds.
fn add_torque(
    effort: &mut Effort,
    model: &ArmModel,
    [before, here, after]: &[Joints; 3],
    step: f64,
    load: f64,
    seconds: f64,
) {
    for (index, axis) in model.axes.iter().enumerate().take(AXES) {
        // Second difference: exact where the acceleration is steady, whatever the step.
        let accel = (after[index] - 2.0 * here[index] + before[index]).abs() / (step * step);
        let percent = accel / (axis.max_accel * load) * 100.0;
        effort.torque[index] += percent * seconds;
        effort.square[index] += percent * percent * seconds;
        effort.peak[index] = effort.peak[index].max(percent);
    }
}

#[cfg(test)]
mod tests {
    use crate::model::ArmModel;
    use crate::motion::{Limits, NO_LOAD, Route, Target, Transform, plan};
    use core::time::Duration;

    fn close(found: f64, expected: f64, slack: f64) {
        assert!((found - expected).abs() < slack, "{found}, {expected} expected");
    }

    /// Axis 1 of the default arm over 100 degrees: 240 degrees/s, 960 degrees/s²; 0.25 s up, 0.25 s down.
    #[test]
    fn the_effort_of_a_trapezoid_is_its_closed_form() {
        let model = ArmModel::tv800();
        let target = Target::Axis {
            axis: 0,
            value: 100.0,
        };
        for accel in [1.0, 0.5] {
            let limits = Limits {
                accel,
                decel: accel,
                ..Limits::FULL
            };
            let motion = plan(&model, &model.ready, &target, &Transform::IDENTITY, &limits).unwrap();
            let effort = motion.effort(&model, NO_LOAD, Duration::ZERO, motion.duration());
            // At half the acceleration the way is over before the full speed is reached.
            let top = (100.0 * 960.0 * accel).sqrt().min(240.0);
            let ramps = 2.0 * top / (960.0 * accel);
            close(effort.way[0], 100.0, 1e-9);
            close(effort.torque[0], 100.0 * accel * ramps, 1e-6);
            close(effort.square[0], 1e4 * accel * accel * ramps, 1e-4);
            close(effort.peak[0], 100.0 * accel, 1e-6);
            close(effort.seconds, motion.duration().as_secs_f64(), 2e-6);
            assert_eq!((effort.way[1], effort.torque[1], effort.peak[1]), (0.0, 0.0, 0.0));
            // In two parts as in one; half the acceleration left by the load is twice the torque.
            let middle = motion.duration() / 3;
            let mut parts = motion.effort(&model, NO_LOAD, Duration::ZERO, middle);
            parts.add(&motion.effort(&model, NO_LOAD, middle, motion.duration() * 2));
            close(parts.way[0], effort.way[0], 1e-9);
            close(parts.torque[0], effort.torque[0], 1e-3);
            let loaded = motion.effort(&model, 0.5, Duration::ZERO, motion.duration());
            close(loaded.peak[0], 2.0 * effort.peak[0], 1e-6);
        }
    }

    #[test]
    fn on_a_line_every_axis_is_followed() {
        let model = ArmModel::thl400();
        let (pose, _) = model.forward(&model.ready);
        let mut end = pose;
        end.xyz[1] -= 200.0;
        end.xyz[2] += 40.0;
        let target = Target::Pose(end, [0; 5], Route::Line);
        let motion = plan(&model, &model.ready, &target, &Transform::IDENTITY, &Limits::FULL).unwrap();
        let effort = motion.effort(&model, NO_LOAD, Duration::ZERO, motion.duration());
        close(effort.way[2], 40.0, 1e-6);
        let direct = (motion.end()[0] - model.ready[0]).abs();
        assert!(
            effort.way[0] >= direct && effort.way[0] < direct * 1.2,
            "{effort:?}"
        );
        for (axis, peak) in effort.peak.iter().enumerate().take(3) {
            assert!(*peak > 1.0 && *peak < 201.0, "axis {axis}: {peak} %");
        }
    }
}
