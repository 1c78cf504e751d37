//! Plans a motion: finds the postures, checks limits and reach along the whole path before anything moves, and
//! derives how fast the path can be followed.
//!
//! The result is a [`Motion`], whose course in time is in `run`.

use super::arch::{Arch, Gate, Stretch};
use super::kinematics::{digits, follow, is_linear, place, singularity};
use super::path::{AxisAngle, Path, Shape, ToolPath, tool_way};
use super::pose::{Pose, Transform, product, radians, transposed};
use super::profile::Ability;
use super::run::{Motion, clamp_fraction, nominal_rates};
use super::{Limits, MotionError, Target};
use crate::model::{ArmKind, ArmModel, Axis, Joints};
use alloc::boxed::Box;
use alloc::vec::Vec;
use libm::ceil;

/// Way of the tool point between two samples of a line or arc, mm, and turn of the tool, degrees.
const SAMPLE_WAY: f64 = 2.0;
const SAMPLE_TURN: f64 = 1.0;
/// Fewest and most samples of a line or arc.
const MIN_SAMPLES: f64 = 16.0;
const MAX_SAMPLES: f64 = 256.0;
/// An axis that turns more than this between two samples, degrees, would have to jump.
const MAX_JUMP: f64 = 45.0;
/// By how much an axis may bend more between samples than at them.
const SAMPLING_MARGIN: f64 = 1.01;
/// Rounding allowed in the heights of a gate, mm, and in a way that is none, mm and degrees.
const GATE_SLACK: f64 = 1e-9;
/// Place of T among the axes of a SCARA arm.
const T_AXIS: usize = 4;
/// Way of an axis that is none, degrees or mm.
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
    match target {
        Target::Joint(pose, config) => {
            let flange = pose.transform().compose(&tool.inverse());
            let to = model.inverse_of(&flange, pose.uv, *config, from)?;
            joint_motion(model, from, &to, tool, limits)
        }
        Target::Axis { axis, value } => {
            let mut to = *from;
            let axes = model.axes.len();
            match to.get_mut(*axis) {
                Some(joint) if *axis < axes => *joint = *value,
                _ => {
                    return Err(MotionError::NoSuchAxis {
                        axis: axis.saturating_add(1),
                        axes,
                    });
                }
            }
            model.check_limits(&to)?;
            joint_motion(model, from, &to, tool, limits)
        }
        Target::Joints(to) => {
            model.check_limits(to)?;
            joint_motion(model, from, to, tool, limits)
        }
        Target::Line(end, config) => {
            let ends = ToolMotion::new(model, from, tool, end, *config)?;
            let shape = Shape::line(ends.start.0.origin, end.xyz);
            ends.motion(model, shape, limits)
        }
        Target::Arc { via, end, config } => {
            let ends = ToolMotion::new(model, from, tool, end, *config)?;
            let shape = Shape::arc(ends.start.0.origin, via.xyz, end.xyz).ok_or(MotionError::NoArc)?;
            ends.motion(model, shape, limits)
        }
        Target::Arch { end, config, gate } => {
            ToolMotion::new(model, from, tool, end, *config)?.arch(model, gate, limits)
        }
    }
}

/// A motion of all joints together: the slowest axis sets the time.
fn joint_motion(
    model: &ArmModel,
    from: &Joints,
    to: &Joints,
    tool: &Transform,
    limits: &Limits,
) -> Result<Motion, MotionError> {
    let mut ways = Joints::default();
    let mut turning = 0.0;
    for (index, ((way, from), to)) in ways.iter_mut().zip(from).zip(to).enumerate() {
        *way = (to - from).abs();
        if !is_linear(&model.kind, index) {
            turning += radians(*way);
        }
    }
    check_driven(&ways, limits)?;
    let ability = axes(model, &ways, limits).fold(Ability::FREE, |ability, (axis, way, torque)| {
        ability.bounded(way, axis.max_speed, axis.max_accel).capped(
            way,
            axis.max_speed,
            axis.max_accel * torque,
        )
    });
    let tool_way = tool_way(&model.kind, from, to, tool, turning);
    let path = Path::Joint { from: *from, to: *to };
    Ok(Motion::new(path, ability, tool_way, limits))
}

/// Each axis with its way per whole path and the part of its torque it may use.
fn axes<'a>(
    model: &'a ArmModel,
    ways: &'a Joints,
    limits: &'a Limits,
) -> impl Iterator<Item = (&'a Axis, f64, f64)> {
    let torque = limits.torque.iter().map(|torque| torque.min(1.0));
    let ways = model.axes.iter().zip(ways);
    ways.zip(torque).map(|((axis, way), torque)| (axis, *way, torque))
}

/// Whether every axis that has to move is driven.
fn check_driven(ways: &Joints, limits: &Limits) -> Result<(), MotionError> {
    let mut moved = ways.iter().zip(limits.torque);
    match moved.position(|(way, torque)| *way > MIN_DISTANCE && (torque.is_nan() || torque <= 0.0)) {
        Some(index) => Err(MotionError::Free { axis: index + 1 }),
        None => Ok(()),
    }
}

/// The start and end of a motion whose tool point follows a path.
struct ToolMotion<'a> {
    from: &'a Joints,
    tool: &'a Transform,
    start: (Transform, [f64; 2]),
    end: &'a Pose,
    config: [u8; 5],
}

impl<'a> ToolMotion<'a> {
    /// The target first: what cannot be reached at all is reported as such, not as a point of the path.
    fn new(
        model: &ArmModel,
        from: &'a Joints,
        tool: &'a Transform,
        end: &'a Pose,
        config: [u8; 5],
    ) -> Result<ToolMotion<'a>, MotionError> {
        model.inverse_of(
            &end.transform().compose(&tool.inverse()),
            end.uv,
            [config[0], config[1], config[2], 0, 0],
            from,
        )?;
        let present = digits(&model.kind, from);
        for place in 0..3 {
            check_digit(place, present, config)?;
        }
        let (flange, uv) = place(&model.kind, from);
        Ok(ToolMotion {
            from,
            tool,
            start: (flange.compose(tool), uv),
            end,
            config,
        })
    }

    /// The path along a shape, checked, and its rates at 100 %.
    fn tool_path(&self, model: &ArmModel, shape: Shape, limits: &Limits) -> Result<ToolPath, MotionError> {
        let end = (self.end.transform(), self.end.uv);
        let tool_path = tool_path(model, self.from, self.tool, &self.start, &end, shape)?;
        let last = tool_path.samples.last().copied().unwrap_or(*self.from);
        let reached = digits(&model.kind, &last);
        for place in 3..5 {
            check_digit(place, reached, self.config)?;
        }
        check_driven(&sampled_ways(&tool_path), limits)?;
        Ok(tool_path)
    }

    fn motion(&self, model: &ArmModel, shape: Shape, limits: &Limits) -> Result<Motion, MotionError> {
        let tool_path = self.tool_path(model, shape, limits)?;
        let (ability, length) = (
            tool_path_ability(model, &tool_path, limits),
            tool_path.shape.length(),
        );
        Ok(Motion::new(
            Path::Tool(Box::new(tool_path)),
            ability,
            length,
            limits,
        ))
    }

    /// The three lines one by one, then all of it with its time stretched until no axis is too fast.
    fn arch(&self, model: &ArmModel, gate: &Gate, limits: &Limits) -> Result<Motion, MotionError> {
        let (from, to) = (self.start.0.origin, self.end.xyz);
        let top = from[2].max(to[2]) + gate.height;
        let (up, down) = (top - from[2], top - to[2]);
        for (name, found, max) in [
            ("height", gate.height, f64::MAX),
            ("rise", gate.rise, up),
            ("descent", gate.descent, down),
        ] {
            if !(0.0..=max + GATE_SLACK).contains(&found) {
                return Err(MotionError::Gate { name, found, max });
            }
        }
        let at = |place: &Transform, [x, y, _]: [f64; 3]| Transform {
            origin: [x, y, top],
            ..*place
        };
        let end = (self.end.transform(), self.end.uv);
        let corners = [
            self.start,
            (at(&self.start.0, from), self.start.1),
            (at(&end.0, to), end.1),
            end,
        ];
        let mut last = *self.from;
        let mut stretches = [Stretch {
            way: 0.0,
            rates: None,
        }; 3];
        for ((stretch, first), second) in stretches.iter_mut().zip(&corners).zip(corners.iter().skip(1)) {
            let shape = Shape::line(first.0.origin, second.0.origin);
            let line = tool_path(model, &last, self.tool, first, second, shape)?;
            last = line.samples.last().copied().unwrap_or(last);
            let still =
                line.shape.length() <= GATE_SLACK && line.turn.angle <= GATE_SLACK && first.1 == second.1;
            *stretch = Stretch {
                way: line.shape.length(),
                rates: (!still).then(|| nominal_rates(&tool_path_ability(model, &line, limits), limits)),
            };
        }
        let arch = Arch::new(from, to, gate, &stretches);
        let (duration, speed) = (arch.duration, arch.top_speed);
        let tool_path = self.tool_path(model, Shape::Arch(Box::new(arch)), limits)?;
        // Seconds in which no axis would have to be faster than it can.
        let ways = sampled_ways(&tool_path);
        let seconds = axes(model, &ways, limits).map(|(axis, way, _)| way / axis.max_speed);
        let least = seconds.fold(0.0, f64::max);
        let path = Path::Tool(Box::new(tool_path));
        Ok(Motion::timed(
            path,
            model,
            if duration > 0.0 { duration.max(least) } else { 0.0 },
            speed * duration,
            limits,
        ))
    }
}

/// A path between two places of the tool point, checked at its samples.
fn tool_path(
    model: &ArmModel,
    from: &Joints,
    tool: &Transform,
    start: &(Transform, [f64; 2]),
    end: &(Transform, [f64; 2]),
    shape: Shape,
) -> Result<ToolPath, MotionError> {
    let turn = AxisAngle::from_rotation(&product(&transposed(&start.0.rotation), &end.0.rotation));
    let mut tool_path = ToolPath {
        kind: model.kind,
        shape,
        rotation: start.0.rotation,
        turn,
        uv: [start.1, end.1],
        flange: tool.inverse(),
        digits: digits(&model.kind, from),
        samples: Vec::new(),
    };
    tool_path.samples = samples(model, from, &tool_path)?;
    Ok(tool_path)
}

fn check_digit(place: usize, reached: [u8; 5], config: [u8; 5]) -> Result<(), MotionError> {
    match (reached.get(place), config.get(place)) {
        (Some(&reached), Some(&wanted)) if wanted != 0 && wanted != reached => {
            Err(MotionError::Configuration {
                place: place + 1,
                reached,
                wanted,
            })
        }
        _ => Ok(()),
    }
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
        let (flange, uv) = tool_path.flange_at(part);
        let joints = follow(&tool_path.kind, &flange, uv, tool_path.digits, &last)
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
    let mut ways = Joints::default();
    for (first, second) in tool_path.samples.iter().zip(tool_path.samples.iter().skip(1)) {
        for ((way, first), second) in ways.iter_mut().zip(first).zip(second) {
            *way = way.max((second - first).abs() * steps);
        }
    }
    for (way, bend) in ways.iter_mut().zip(sampled_bends(tool_path)) {
        *way += bend / (2.0 * steps.max(1.0));
    }
    ways
}

/// Most each axis bends per whole path, anywhere on it: the second derivative of its value by the part gone.
fn sampled_bends(tool_path: &ToolPath) -> Joints {
    let steps = tool_path.samples.len().saturating_sub(1) as f64;
    let mut bends = Joints::default();
    let (second, third) = (tool_path.samples.iter().skip(1), tool_path.samples.iter().skip(2));
    for ((first, second), third) in tool_path.samples.iter().zip(second).zip(third) {
        for (((bend, first), second), third) in bends.iter_mut().zip(first).zip(second).zip(third) {
            *bend = bend.max((third - 2.0 * second + first).abs() * steps * steps * SAMPLING_MARGIN);
        }
    }
    bends
}

/// A line or an arc: at 100 % the tool speed, the turning speed and that of the axes the position gives itself;
/// whatever is asked for, no axis is faster than it can, and neither the bend of the path nor that of the axes asks for
/// more acceleration than there is.
fn tool_path_ability(model: &ArmModel, tool_path: &ToolPath, limits: &Limits) -> Ability {
    let (length, [from, to]) = (tool_path.shape.length(), tool_path.uv);
    let turn_accel = model.max_turn_speed * model.max_tool_accel / model.max_tool_speed;
    let mut ability = Ability::FREE
        .bounded(length, model.max_tool_speed, model.max_tool_accel)
        .bounded(tool_path.turn.angle, model.max_turn_speed, turn_accel);
    if let Some(axis) = model.axes.get(T_AXIS) {
        // Only a SCARA arm has such an axis: T.
        let way = (to[0] - from[0]).abs();
        ability = match model.kind {
            ArmKind::Scara(_) => ability.bounded(way, axis.max_speed, axis.max_accel),
            ArmKind::SixAxis(_) => ability,
        };
    }
    if let Some(radius) = tool_path.shape.radius() {
        // On the circle the tool point is drawn to its centre by the square of its speed over the radius.
        let accel = model.max_tool_accel * clamp_fraction(limits.accel);
        ability = ability.bent(length * length / radius, accel);
    }
    let (ways, bends) = (sampled_ways(tool_path), sampled_bends(tool_path));
    axes(model, &ways, limits)
        .zip(bends)
        .fold(ability, |ability, ((axis, way, torque), bend)| {
            let accel = axis.max_accel * torque;
            ability.capped(way, axis.max_speed, accel).bent(bend, accel)
        })
}
