//! From target to motion: finds the postures, checks limits and reach along the whole path before anything moves,
//! and derives how fast the path may be run through. The course in time is left to `run`.

use super::kinematics::{digits, follow, is_linear, place};
use super::path::{Guided, Path, Shape, Turn, tool_way};
use super::pose::{Pose, Transform, product, radians, transposed};
use super::profile::Rates;
use super::run::Motion;
use super::{Limits, MotionError, Target};
use crate::model::{ArmModel, Joints};
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
/// By how much an axis may be faster between two samples than from one to the other.
const SAMPLING_MARGIN: f64 = 1.05;
/// Rates of a path on which almost nothing moves, 1/s and 1/s².
const MAX_RATE: f64 = 1e6;

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
            Ok(joint_motion(model, from, &to, tool, limits))
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
            Ok(joint_motion(model, from, &to, tool, limits))
        }
        Target::Joints(to) => {
            model.check_limits(to)?;
            Ok(joint_motion(model, from, to, tool, limits))
        }
        Target::Line(end, config) => {
            let start = start_of(model, from, tool);
            let shape = Shape::line(start.0.origin, end.xyz);
            guided_motion(model, from, tool, &start, shape, end, *config, limits)
        }
        Target::Arc { via, end, config } => {
            let start = start_of(model, from, tool);
            let shape = Shape::arc(start.0.origin, via.xyz, end.xyz).ok_or(MotionError::NoArc)?;
            guided_motion(model, from, tool, &start, shape, end, *config, limits)
        }
    }
}

fn start_of(model: &ArmModel, from: &Joints, tool: &Transform) -> (Transform, [f64; 2]) {
    let (flange, uv) = place(&model.kind, from);
    (flange.compose(tool), uv)
}

/// The slowest axis leads, the others go with it.
fn joint_motion(model: &ArmModel, from: &Joints, to: &Joints, tool: &Transform, limits: &Limits) -> Motion {
    let mut ways = Joints::default();
    let mut turning = 0.0;
    for (index, ((way, from), to)) in ways.iter_mut().zip(from).zip(to).enumerate() {
        *way = (to - from).abs();
        if !is_linear(&model.kind, index) {
            turning += radians(*way);
        }
    }
    let rates = axis_rates(model, &ways);
    let tool_way = tool_way(&model.kind, from, to, tool, turning);
    Motion::new(Path::Joint { from: *from, to: *to }, rates, tool_way, limits)
}

#[expect(
    clippy::too_many_arguments,
    reason = "the parts of one target, taken apart by `plan`"
)]
fn guided_motion(
    model: &ArmModel,
    from: &Joints,
    tool: &Transform,
    start: &(Transform, [f64; 2]),
    shape: Shape,
    end: &Pose,
    config: [u8; 5],
    limits: &Limits,
) -> Result<Motion, MotionError> {
    // The target first: what cannot be reached at all is reported as such, not as a point of the path.
    model.inverse_of(
        &end.transform().compose(&tool.inverse()),
        end.uv,
        [config[0], config[1], config[2], 0, 0],
        from,
    )?;
    let present = digits(&model.kind, from);
    for place in 0..3 {
        same_digit(place, present, config)?;
    }
    let (start, start_uv) = start;
    let turn = Turn::of(&product(&transposed(&start.rotation), &end.transform().rotation));
    let mut guided = Guided {
        kind: model.kind,
        shape,
        rotation: start.rotation,
        turn,
        uv: [*start_uv, end.uv],
        flange: tool.inverse(),
        digits: present,
        samples: Vec::new(),
    };
    guided.samples = samples(model, from, &guided)?;
    let last = guided.samples.last().copied().unwrap_or(*from);
    let reached = digits(&model.kind, &last);
    for place in 3..5 {
        same_digit(place, reached, config)?;
    }
    let rates = guided_rates(model, &guided);
    let length = guided.shape.length();
    Ok(Motion::new(Path::Guided(Box::new(guided)), rates, length, limits))
}

fn same_digit(place: usize, reached: [u8; 5], config: [u8; 5]) -> Result<(), MotionError> {
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
fn samples(model: &ArmModel, from: &Joints, guided: &Guided) -> Result<Vec<Joints>, MotionError> {
    let wanted = (guided.shape.length() / SAMPLE_WAY).max(guided.turn.angle / SAMPLE_TURN);
    let steps = ceil(wanted).clamp(MIN_SAMPLES, MAX_SAMPLES) as u16;
    let mut samples = Vec::with_capacity(usize::from(steps) + 1);
    let mut last = *from;
    samples.push(last);
    for step in 1..=steps {
        let part = f64::from(step) / f64::from(steps);
        let percent = part * 100.0;
        let (flange, uv) = guided.flange_at(part);
        let joints = follow(&guided.kind, &flange, uv, guided.digits, &last)
            .and_then(|joints| model.check_limits(&joints).map(|()| joints))
            .map_err(|reason| MotionError::OnPath { percent, reason })?;
        for (index, (joint, last)) in joints.iter().zip(&last).enumerate() {
            let jump = (joint - last).abs();
            if !is_linear(&guided.kind, index) && jump > MAX_JUMP {
                return Err(MotionError::Singular {
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

/// Rates at 100 % of a line or arc: tool speed, turning speed, and no axis faster than it can.
fn guided_rates(model: &ArmModel, guided: &Guided) -> Rates {
    let steps = guided.samples.len().saturating_sub(1) as f64;
    let mut ways = Joints::default();
    for (first, second) in guided.samples.iter().zip(guided.samples.iter().skip(1)) {
        for ((way, first), second) in ways.iter_mut().zip(first).zip(second) {
            *way = way.max((second - first).abs() * steps * SAMPLING_MARGIN);
        }
    }
    let turn_accel = model.max_turn_speed * model.max_tool_accel / model.max_tool_speed;
    let rates = bounded(
        axis_rates(model, &ways),
        guided.shape.length(),
        model.max_tool_speed,
        model.max_tool_accel,
    );
    bounded(rates, guided.turn.angle, model.max_turn_speed, turn_accel)
}

/// Rates at which no axis is too fast when each has at most this way to go per whole path.
fn axis_rates(model: &ArmModel, ways: &Joints) -> Rates {
    let free = Rates {
        speed: MAX_RATE,
        accel: MAX_RATE,
        decel: MAX_RATE,
    };
    model.axes.iter().zip(ways).fold(free, |rates, (axis, way)| {
        bounded(rates, *way, axis.max_speed, axis.max_accel)
    })
}

fn bounded(rates: Rates, way: f64, speed: f64, accel: f64) -> Rates {
    if way <= 0.0 {
        return rates;
    }
    Rates {
        speed: rates.speed.min(speed / way),
        accel: rates.accel.min(accel / way),
        decel: rates.decel.min(accel / way),
    }
}
