//! Plans a motion: finds the postures, checks limits and reach along the whole path before anything moves, and
//! derives how fast the path can be followed.
//!
//! The result is a [`Motion`], whose course in time is in `run`.

use super::arch::{Arch, Gate, Stretch};
use super::courses::AxisCourses;
use super::kinematics::{Place, digits, follow, is_linear, place, singularity};
use super::path::{AxisAngle, Path, Shape, ToolPath, tool_way};
use super::pose::{Pose, Transform, minus, pairwise, plus, plus_times, product, radians, transposed};
use super::profile::{Ability, PathState, Profile};
use super::run::{Motion, clamp_fraction, nominal_rates};
use super::{Limits, MotionError, Route, Target};
use crate::model::{ArmKind, ArmModel, Axis, Joints};
use crate::prelude::*;
use core::ops::Range;
use libm::ceil;

/// Route of the tool point between two samples of a line or arc, mm, and turn of the tool, degrees.
const SAMPLE_WAY: f64 = 2.0;
const SAMPLE_TURN: f64 = 1.0;
/// Fewest and most samples of a line or arc.
const MIN_SAMPLES: f64 = 16.0;
const MAX_SAMPLES: f64 = 256.0;
/// An axis that turns more than this between two samples, degrees, would have to jump: the tool itself turns by
/// at most [`SAMPLE_TURN`] there.
const MAX_JUMP: f64 = 45.0;
/// By how much an axis may bend more between samples than at them.
const SAMPLING_MARGIN: f64 = 1.01;
/// Rounding allowed in the distances of an arch, mm, and in a way that is none, mm and degrees.
const GATE_SLACK: f64 = 1e-9;
/// Place of T among the axes of a SCARA arm.
const T_AXIS: usize = 4;
/// Route of an axis that is none, degrees or mm.
const MIN_DISTANCE: f64 = 1e-9;

/// Plans a motion from a posture at rest. `tool` is the tool point as seen from the flange.
///
/// # Errors
/// [`MotionError`] when the target, or a point of a line or an arc on the way to it, cannot be reached.
pub fn plan(
    model: &ArmModel,
    from: &Joints,
    target: &Target,
    tool: &Transform,
    limits: &Limits,
) -> Result<Motion, MotionError> {
    let planner = Planner {
        model,
        from,
        tool,
        limits,
    };
    match target {
        Target::Pose(pose, config, Route::Joint) => {
            let flange = pose.transform().compose(&tool.inverse());
            planner.joint_motion(&model.inverse_of(&(flange, pose.uv), *config, from)?)
        }
        Target::Axis { axis, value } => planner.joint_motion(&with_axis(model, from, *axis, *value)?),
        Target::Joints(to) => {
            model.check_limits(to)?;
            planner.joint_motion(to)
        }
        Target::Pose(end, config, Route::Line) => {
            let ends = planner.ends(end, *config)?;
            planner.tool_motion(&ends, Shape::line(ends.start.0.origin, end.xyz))
        }
        Target::Pose(end, config, Route::Arc(via)) => {
            let ends = planner.ends(end, *config)?;
            let shape = Shape::arc(ends.start.0.origin, via.xyz, end.xyz).ok_or(MotionError::NoArc)?;
            planner.tool_motion(&ends, shape)
        }
        Target::Pose(end, config, Route::Arch(gate)) => planner.arch(&planner.ends(end, *config)?, gate),
    }
}

/// A posture with another value of one axis, from 0.
pub(crate) fn with_axis(
    model: &ArmModel,
    from: &Joints,
    axis: usize,
    value: f64,
) -> Result<Joints, MotionError> {
    let (mut to, axes) = (*from, model.axes.len());
    let joint = to.get_mut(axis).filter(|_| axis < axes);
    let axis = axis.saturating_add(1);
    *joint.ok_or(MotionError::NoSuchAxis { axis, axes })? = value;
    model.check_limits(&to)?;
    Ok(to)
}

/// The start and end of a motion whose tool point follows a path.
struct Ends {
    start: Place,
    end: Place,
    config: [u8; 5],
}

/// Inputs for planning any motion from a posture.
struct Planner<'a> {
    model: &'a ArmModel,
    from: &'a Joints,
    tool: &'a Transform,
    limits: &'a Limits,
}

impl Planner<'_> {
    /// A motion of all joints together: each axis has a trapezoid of its own, and the one that takes longest sets the
    /// time (T21).
    fn joint_motion(&self, to: &Joints) -> Result<Motion, MotionError> {
        let kind = &self.model.kind;
        let ways = minus(*to, *self.from).map(f64::abs);
        self.check_driven(&ways)?;
        // For the bound in `tool_way`: a sliding axis does not bend the way of the tool point.
        let turns = (0..).zip(ways).filter(|(axis, _)| !is_linear(kind, *axis));
        let turning = turns.fold(0.0, |sum, (_, way)| sum + radians(way));
        let abilities: Vec<Ability> = self
            .axes(ways)
            .map(|(axis, way, accel)| {
                let free = match way > MIN_DISTANCE {
                    true => Ability::UNBOUNDED,
                    false => Ability::FREE,
                };
                let fastest = free.bounded(way, axis.max_speed, axis.max_accel);
                fastest.capped(way, axis.max_speed, accel)
            })
            .collect();
        let course = |ability: &Ability| {
            let rates = nominal_rates(ability, self.limits);
            Profile::to_end(PathState::at_rest(0.0), 1.0, &rates)
        };
        let moving: Vec<(usize, Profile, f64)> = (0..)
            .zip(&abilities)
            .filter(|(index, _)| ways[*index] > 0.0)
            .map(|(index, ability)| (index, course(ability), ability.rates(1.0, 1.0, 1.0).accel))
            .collect();
        let (mut ability, mut courses) = (Ability::FREE, None);
        if let Some((leading, all)) = AxisCourses::new(&moving) {
            ability = abilities[leading];
            courses = Some(Box::new(all)).filter(|courses| !courses.is_alone());
        }
        let (from, to) = (*self.from, *to);
        let path = Path::Joint { from, to, courses };
        let tool_way = tool_way(kind, &path, self.tool, turning);
        Ok(Motion::new(path, ability, tool_way, self.limits))
    }

    /// Each axis with its way per whole path and the acceleration that its part of the torque gives it.
    fn axes(&self, ways: Joints) -> impl Iterator<Item = (&Axis, f64, f64)> {
        let axes = self.model.axes.iter().zip(ways).zip(self.limits.torque);
        axes.map(|((axis, way), torque)| (axis, way, axis.max_accel * torque.min(1.0)))
    }

    /// Whether every axis that has to move is driven.
    fn check_driven(&self, ways: &Joints) -> Result<(), MotionError> {
        let mut moved = ways.iter().zip(self.limits.torque);
        match moved.position(|(way, torque)| *way > MIN_DISTANCE && (torque.is_nan() || torque <= 0.0)) {
            Some(index) => Err(MotionError::Free { axis: index + 1 }),
            None => Ok(()),
        }
    }

    /// The target first: an unreachable target is reported as such, not as a point of the path.
    fn ends(&self, end: &Pose, config: [u8; 5]) -> Result<Ends, MotionError> {
        let kind = &self.model.kind;
        let end = (end.transform(), end.uv);
        let [shoulder, elbow, wrist, ..] = config;
        // Digits of axes 4 and 6 are left open: which turn they end on is known only after the path (`whole_path`).
        let flange = (end.0.compose(&self.tool.inverse()), end.1);
        let posture = [shoulder, elbow, wrist, 0, 0];
        self.model.inverse_of(&flange, posture, self.from)?;
        check_digits(0..3, digits(kind, self.from), config)?;
        let (flange, uv) = place(kind, self.from);
        let start = (flange.compose(self.tool), uv);
        Ok(Ends { start, end, config })
    }

    /// The path along a shape, checked as a whole.
    fn whole_path(&self, ends: &Ends, shape: Shape) -> Result<ToolPath, MotionError> {
        let tool_path = self.tool_path(self.from, &ends.start, &ends.end, shape)?;
        let last = tool_path.samples.last().unwrap_or(self.from);
        check_digits(3..5, digits(&self.model.kind, last), ends.config)?;
        self.check_driven(&sampled_ways(&tool_path))?;
        Ok(tool_path)
    }

    fn tool_motion(&self, ends: &Ends, shape: Shape) -> Result<Motion, MotionError> {
        let tool_path = self.whole_path(ends, shape)?;
        let ability = self.tool_path_ability(&tool_path);
        let length = tool_path.shape.length();
        let path = Path::Tool(Box::new(tool_path));
        Ok(Motion::new(path, ability, length, self.limits))
    }

    /// The three lines one by one, then all of it with its time stretched until no axis is too fast.
    fn arch(&self, ends: &Ends, gate: &Gate) -> Result<Motion, MotionError> {
        let (from, to) = (ends.start.0.origin, ends.end.0.origin);
        let top = from[2].max(to[2]) + gate.retreat;
        let (up, down) = (top - from[2], top - to[2]);
        for (name, found, max) in [
            ("retreat", gate.retreat, f64::MAX),
            ("single-axis 1", gate.single_axis_1, up),
            ("single-axis 2", gate.single_axis_2, down),
        ] {
            if !(0.0..=max + GATE_SLACK).contains(&found) {
                return Err(MotionError::Gate { name, found, max });
            }
        }
        // The tool turns while it goes across, so up and down keep the orientation of their ends.
        let above = |(place, uv): Place| {
            let [x, y, _] = place.origin;
            let origin = [x, y, top];
            (Transform { origin, ..place }, uv)
        };
        let corners = [ends.start, above(ends.start), above(ends.end), ends.end];
        let mut last = *self.from;
        let mut stretches = [Stretch {
            way: 0.0,
            rates: None,
        }; 3];
        for ((stretch, first), second) in stretches.iter_mut().zip(&corners).zip(corners.iter().skip(1)) {
            let shape = Shape::line(first.0.origin, second.0.origin);
            let line = self.tool_path(&last, first, second, shape)?;
            last = line.samples.last().copied().unwrap_or(last);
            let way = line.shape.length();
            let still = way <= GATE_SLACK && line.turn.angle <= GATE_SLACK && first.1 == second.1;
            let rates = (!still).then(|| nominal_rates(&self.tool_path_ability(&line), self.limits));
            *stretch = Stretch { way, rates };
        }
        let arch = Arch::new(from, to, gate, &stretches);
        let (duration, speed) = (arch.duration, arch.top_speed);
        let tool_path = self.whole_path(ends, Shape::Arch(Box::new(arch)))?;
        // Seconds in which no axis would have to be faster than it can.
        let axes = self.axes(sampled_ways(&tool_path));
        // Stretching the time by k divides every speed by k. Accelerations are not checked here: those of two lines add
        // up where they overlap (motion-14).
        let times = axes.map(|(axis, way, _)| way / axis.max_speed);
        let least = times.fold(0.0, f64::max);
        let path = Path::Tool(Box::new(tool_path));
        let seconds = if duration > 0.0 { duration.max(least) } else { 0.0 };
        let way = speed * duration;
        Ok(Motion::timed(path, self.model, seconds, way, self.limits))
    }

    /// A path between two places of the tool point, checked at its samples.
    fn tool_path(
        &self,
        from: &Joints,
        start: &Place,
        end: &Place,
        shape: Shape,
    ) -> Result<ToolPath, MotionError> {
        // The turn in the axes of the tool at the start, so that `flange_at` multiplies it from the right.
        let turn = product(&transposed(&start.0.rotation), &end.0.rotation);
        let mut tool_path = ToolPath {
            kind: self.model.kind,
            shape,
            rotation: start.0.rotation,
            turn: AxisAngle::from_rotation(&turn),
            uv: [start.1, end.1],
            flange: self.tool.inverse(),
            digits: digits(&self.model.kind, from),
            samples: Vec::new(),
        };
        tool_path.samples = samples(self.model, from, &tool_path)?;
        Ok(tool_path)
    }

    /// A line or an arc: at 100 % the tool speed, the turning speed and that of the axes the position gives itself;
    /// whatever is asked for, no axis is faster than it can, and neither the bend of the path nor that of the axes asks for
    /// more acceleration than there is.
    fn tool_path_ability(&self, tool_path: &ToolPath) -> Ability {
        let model = self.model;
        let (length, [from, to]) = (tool_path.shape.length(), tool_path.uv);
        // A turn reaches its full speed in the time in which the tool point reaches its own
        // (`ArmModel::max_turn_speed`).
        let turn_accel = model.max_turn_speed * model.max_tool_accel / model.max_tool_speed;
        let mut ability = Ability::FREE
            .bounded(length, model.max_tool_speed, model.max_tool_accel)
            .bounded(tool_path.turn.angle, model.max_turn_speed, turn_accel);
        if let (ArmKind::Scara(_), Some(axis)) = (model.kind, model.axes.get(T_AXIS)) {
            ability = ability.bounded((to[0] - from[0]).abs(), axis.max_speed, axis.max_accel);
        }
        if let Shape::Arc { radius, .. } = tool_path.shape {
            // On the circle the tool point is drawn to its centre by the square of its speed over the radius.
            let accel = model.max_tool_accel * clamp_fraction(self.limits.accel);
            // In parts of the path: (length v)² / radius.
            ability = ability.bent(length * length / radius, accel);
        }
        let axes = self.axes(sampled_ways(tool_path)).zip(sampled_bends(tool_path));
        axes.fold(ability, |ability, ((axis, way, accel), bend)| {
            ability.capped(way, axis.max_speed, accel).bent(bend, accel)
        })
    }
}

fn check_digits(places: Range<usize>, reached: [u8; 5], config: [u8; 5]) -> Result<(), MotionError> {
    for place in places {
        let (reached, wanted, place) = (reached[place], config[place], place + 1);
        if wanted != 0 && wanted != reached {
            return Err(MotionError::Configuration {
                place,
                reached,
                wanted,
            });
        }
    }
    Ok(())
}

/// Joints at equal parts of the path, each checked.
fn samples(model: &ArmModel, from: &Joints, tool_path: &ToolPath) -> Result<Vec<Joints>, MotionError> {
    let steps = (tool_path.shape.length() / SAMPLE_WAY).max(tool_path.turn.angle / SAMPLE_TURN);
    let steps = ceil(steps).clamp(MIN_SAMPLES, MAX_SAMPLES) as u16;
    let mut samples = Vec::with_capacity(usize::from(steps) + 1);
    let mut last = *from;
    samples.push(last);
    for step in 1..=steps {
        let part = f64::from(step) / f64::from(steps);
        let percent = part * 100.0;
        let flange = tool_path.flange_at(part);
        // From sample to sample, so that axes 4 and 6 go on beyond half a turn instead of jumping back by a whole one.
        let joints = follow(&tool_path.kind, &flange, tool_path.digits, &last)
            .and_then(|joints| model.check_limits(&joints).map(|()| joints))
            .map_err(|reason| MotionError::OnPath { percent, reason })?;
        for (index, (joint, last)) in joints.iter().zip(&last).enumerate() {
            let jump = (joint - last).abs();
            if !is_linear(&tool_path.kind, index) && jump > MAX_JUMP {
                return Err(MotionError::Singular {
                    posture: singularity(&tool_path.kind, index),
                    percent,
                    axis: index + 1,
                    jump,
                });
            }
        }
        samples.push(joints);
        last = joints;
    }
    Ok(samples)
}

/// Most each axis moves per whole path, anywhere on it: between two samples, and by how much it is faster there than
/// from one to the other, which its bend tells; an axis that moves evenly is taken exactly.
fn sampled_ways(tool_path: &ToolPath) -> Joints {
    let steps = tool_path.samples.len().saturating_sub(1) as f64;
    let samples = tool_path.samples.iter();
    let moves = samples.clone().zip(samples.skip(1));
    let ways = moves.map(|(first, second)| minus(*second, *first).map(|way| way.abs() * steps));
    let most = ways.fold(Joints::default(), |most, ways| pairwise(most, ways, f64::max));
    plus(
        most,
        sampled_bends(tool_path).map(|bend| bend / (2.0 * steps.max(1.0))),
    )
}

/// Most each axis bends per whole path, anywhere on it: the second derivative of its value by the part gone.
fn sampled_bends(tool_path: &ToolPath) -> Joints {
    let steps = tool_path.samples.len().saturating_sub(1) as f64;
    let samples = tool_path.samples.iter();
    let places = samples.clone().zip(samples.clone().skip(1)).zip(samples.skip(2));
    let bends = places.map(|((first, second), third)| {
        // Second difference of three samples, with a step of 1 / steps.
        let bends = plus(plus_times(*third, *second, -2.0), *first);
        bends.map(|bend| bend.abs() * steps * steps * SAMPLING_MARGIN)
    });
    bends.fold(Joints::default(), |most, bends| pairwise(most, bends, f64::max))
}
