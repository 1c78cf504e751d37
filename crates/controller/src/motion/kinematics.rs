//! Joints to pose and back in closed form: the configuration digits of a posture (DATA-04), the turn of each axis, and
//! the axis limits.
//!
//! The trigonometry of the two kinds of arm is in `six_axis` and `scara`.

mod scara;
mod singular;
mod six_axis;
mod unreachable;

pub use singular::Singularity;
pub use unreachable::Unreachable;

pub(crate) use singular::singularity;

use super::pose::{Pose, Transform, degrees, normalised, sin_cos};
use crate::model::{AXES, ArmKind, ArmModel, Axis, Joints};
use libm::{acos, atan2, ceil, floor, hypot, round};

/// Rounding allowed at an axis limit, in the unit of the axis: a limit given as a position comes back from the
/// trigonometry a few units of the last digit beyond it.
const LIMIT_SLACK: f64 = 1e-9;
/// The least by which an axis value of DOUBLE4 or DOUBLE6 lies beyond half a turn, degrees: half a turn itself is
/// SINGLE.
const BEYOND: f64 = 1e-9;
/// Largest tilt a SCARA arm takes for rounding, degrees, and largest U or V where there is no such axis.
const ROUNDING: f64 = 1e-6;
/// Rounding allowed in the cosine of the elbow, arm stretched or folded. For links of 370 and 380 mm it adds 2e-10 mm
/// of reach.
const ELBOW_ROUNDING: f64 = 1e-12;
/// Highest configuration digit (DATA-04).
const MAX_DIGIT: u8 = 2;

/// The joints of a place, or why there are none.
type PostureResult = Result<Joints, Unreachable>;

impl ArmModel {
    /// Pose of the flange and configuration digits of a posture.
    ///
    /// Digits (DATA-04): shoulder, elbow, wrist, axis 4, axis 6, each 1 or 2. SCARA: the first alone, the
    /// others 0.
    pub fn forward(&self, joints: &Joints) -> (Pose, [u8; 5]) {
        let (transform, uv) = place(&self.kind, joints);
        (Pose::from_transform(&transform, uv), digits(&self.kind, joints))
    }

    /// Posture in which the flange has `pose`.
    ///
    /// A digit 0 keeps what the posture `near` has. A position leaves the turn of an axis open: the one next
    /// to `near` is taken, on axes 4 and 6 within SINGLE or DOUBLE. Where a kept SINGLE or DOUBLE does not fit
    /// the limits, the other is taken.
    ///
    /// # Errors
    /// [`Unreachable`] names the axis and its limit, the reach, or the value that does not fit the arm.
    pub fn inverse(&self, pose: &Pose, config: [u8; 5], near: &Joints) -> PostureResult {
        self.inverse_of(&(pose.transform(), pose.uv), config, near)
    }

    pub(crate) fn inverse_of(&self, flange: &Place, config: [u8; 5], near: &Joints) -> PostureResult {
        let wanted = self.resolved(config, near)?;
        let mut joints = solve(&self.kind, flange, wanted, near)?;
        for (axis, joint) in (1..).zip(&mut joints).skip(self.axes.len()) {
            // A SCARA arm without axis T.
            let value = core::mem::take(joint);
            if value.abs() > ROUNDING {
                return Err(Unreachable::NotFitted { axis, value });
            }
        }
        let axes = self.axes.iter().zip(&mut joints).zip(near);
        for (index, ((limits, joint), near)) in axes.enumerate() {
            let class = match (&self.kind, index) {
                (ArmKind::SixAxis(_), 3) => Some((config[3], wanted[3])),
                (ArmKind::SixAxis(_), 5) => Some((config[4], wanted[4])),
                _ => None,
            };
            let turn = if is_linear(&self.kind, index) {
                // The slack of the check is not passed on to the next planning.
                within(limits, *joint).then(|| joint.clamp(limits.min, limits.max))
            } else {
                turn_of(*joint, *near, limits, class)
            };
            *joint = turn.ok_or(limit_error(index, *joint, limits))?;
        }
        Ok(joints)
    }

    /// Whether every axis is within its limits, and those the arm has not are 0.
    pub(crate) fn check_limits(&self, joints: &Joints) -> Result<(), Unreachable> {
        let mut missing = (1..).zip(joints).skip(self.axes.len());
        if let Some((axis, &value)) = missing.find(|(_, value)| **value != 0.0) {
            return Err(Unreachable::NotFitted { axis, value });
        }
        for (index, (limits, value)) in self.axes.iter().zip(joints).enumerate() {
            if !within(limits, *value) {
                return Err(limit_error(index, *value, limits));
            }
        }
        Ok(())
    }

    /// The digits with those of `near` where they are 0; refuses digits this arm does not know.
    fn resolved(&self, config: [u8; 5], near: &Joints) -> Result<[u8; 5], Unreachable> {
        let mut resolved = digits(&self.kind, near);
        for (index, (digit, found)) in resolved.iter_mut().zip(config).enumerate() {
            let is_known = matches!(self.kind, ArmKind::SixAxis(_)) || index == 0;
            let max = if is_known { MAX_DIGIT } else { 0 };
            if found > max {
                return Err(Unreachable::Configuration {
                    place: index + 1,
                    max,
                    found,
                });
            }
            if found != 0 {
                *digit = found;
            }
        }
        Ok(resolved)
    }
}

/// A place of the flange or of the tool point, with the values of the additional axes.
pub(crate) type Place = (Transform, [f64; 2]);

/// Flange and additional axes of a posture.
pub(crate) fn place(kind: &ArmKind, joints: &Joints) -> Place {
    match kind {
        ArmKind::SixAxis(geometry) => (six_axis::flange(geometry, joints), [0.0; 2]),
        ArmKind::Scara(geometry) => (scara::flange(geometry, joints), [joints[4], 0.0]),
    }
}

/// Configuration digits of a posture.
pub(crate) fn digits(kind: &ArmKind, joints: &Joints) -> [u8; 5] {
    match kind {
        ArmKind::SixAxis(geometry) => six_axis::digits(geometry, joints),
        ArmKind::Scara(_) => scara::digits(joints),
    }
}

/// The posture of the shoulder, elbow and wrist in `digits`, every turning axis on the turn next to `near`, limits
/// aside: for points of a path, where the axes continue from their present turn.
pub(crate) fn follow(kind: &ArmKind, flange: &Place, digits: [u8; 5], near: &Joints) -> PostureResult {
    let mut joints = solve(kind, flange, digits, near)?;
    for (index, (joint, near)) in joints.iter_mut().zip(near).enumerate() {
        if !is_linear(kind, index) {
            // The value next to `near` is the right one as long as the axis has turned less than half a turn from
            // there. `plan` refuses paths with larger steps (MAX_JUMP).
            *joint += 360.0 * round((near - *joint) / 360.0);
        }
    }
    Ok(joints)
}

/// Longest distance in mm between an axis and the flange.
pub(crate) fn reach(kind: &ArmKind) -> f64 {
    match kind {
        ArmKind::SixAxis(g) => {
            let upper = g.shoulder_offset.abs() + g.upper_arm.abs();
            upper + g.elbow_offset.abs() + g.forearm.abs() + g.flange.abs()
        }
        ArmKind::Scara(g) => g.first_arm.abs() + g.second_arm.abs(),
    }
}

/// Whether the axis (from 0) has no turns: it slides, or its value is given by the position itself.
pub(crate) fn is_linear(kind: &ArmKind, index: usize) -> bool {
    match kind {
        ArmKind::SixAxis(_) => index >= 6,
        ArmKind::Scara(_) => index == 2 || index >= 4,
    }
}

fn solve(kind: &ArmKind, (flange, uv): &Place, digits: [u8; 5], near: &Joints) -> PostureResult {
    let place = flange.origin.iter().chain(flange.rotation.iter().flatten());
    if place.chain(uv).any(|value| !value.is_finite()) {
        return Err(Unreachable::NotFinite);
    }
    // U of a SCARA is its axis T, number 5. Neither kind of arm has an axis for what is left: numbers 7 and 8.
    let additional: &[f64] = match kind {
        ArmKind::SixAxis(_) => uv,
        ArmKind::Scara(_) => &uv[1..],
    };
    let first = AXES - additional.len();
    let mut numbered = (first + 1..).zip(additional);
    if let Some((axis, &value)) = numbered.find(|(_, value)| value.abs() > ROUNDING) {
        return Err(Unreachable::NotFitted { axis, value });
    }
    match kind {
        ArmKind::SixAxis(geometry) => six_axis::solve(geometry, flange, digits, near),
        ArmKind::Scara(geometry) => scara::solve(geometry, flange, uv[0], digits),
    }
}

/// The turns of two links whose far end is `along` their first axis and `across` it, bent forward or back: that of the
/// first, and that of the second against it, 0 to 180 degrees either way.
fn two_links(
    [first, second]: [f64; 2],
    [along, across]: [f64; 2],
    forward: bool,
) -> Result<[f64; 2], Unreachable> {
    let distance = hypot(across, along);
    // Law of cosines in the triangle of both links and the line to the far end. `cos` is that of the bend at the elbow,
    // 0 degrees when stretched. One cosine belongs to two bends: `forward` selects the sign.
    let cos = (distance * distance - first * first - second * second) / (2.0 * first * second);
    if cos.abs() > 1.0 + ELBOW_ROUNDING || cos.is_nan() {
        return Err(Unreachable::Reach {
            distance,
            min: (first - second).abs(),
            max: first + second,
        });
    }
    let bend = degrees(acos(cos.clamp(-1.0, 1.0)));
    let elbow = if forward { bend } else { -bend };
    let (sin, cos) = sin_cos(elbow);
    // The first link points beside the far end by the angle that the bent second link covers, seen from the first axis.
    let turn = atan2(across, along) - atan2(second * sin, first + second * cos);
    Ok([degrees(turn), elbow])
}

fn within(limits: &Axis, value: f64) -> bool {
    (limits.min - LIMIT_SLACK..=limits.max + LIMIT_SLACK).contains(&value)
}

fn limit_error(index: usize, value: f64, limits: &Axis) -> Unreachable {
    Unreachable::Limit {
        axis: index + 1,
        value,
        min: limits.min,
        max: limits.max,
    }
}

/// The turn of `angle` next to `near` within the limits; with a class (digit asked for, digit resolved), within
/// SINGLE or DOUBLE.
fn turn_of(angle: f64, near: f64, limits: &Axis, class: Option<(u8, u8)>) -> Option<f64> {
    let angle = normalised(angle);
    let (min, max) = (limits.min, limits.max);
    let any = || turn_between(angle, near, min, max);
    let Some((asked, resolved)) = class else {
        return any();
    };
    let of_class = if resolved == 1 {
        turn_between(angle, near, min.max(-180.0), max.min(180.0))
    } else {
        // DOUBLE has two ranges, below -180 and above 180 degrees. At equal distance the upper one wins.
        let low = turn_between(angle, near, min, max.min(-180.0 - BEYOND));
        let high = turn_between(angle, near, min.max(180.0 + BEYOND), max);
        match (low, high) {
            (Some(low), Some(high)) if (high - near).abs() <= (low - near).abs() => Some(high),
            (low, high) => low.or(high),
        }
    };
    if asked == 0 {
        of_class.or_else(any)
    } else {
        of_class
    }
}

fn turn_between(angle: f64, near: f64, min: f64, max: f64) -> Option<f64> {
    let lowest = ceil((min - LIMIT_SLACK - angle) / 360.0);
    let highest = floor((max + LIMIT_SLACK - angle) / 360.0);
    // `min` exceeds `max` where the limits leave no room for the class: DOUBLE of an axis that stays within half a
    // turn.
    if lowest > highest || min > max {
        return None;
    }
    let turns = round((near - angle) / 360.0).clamp(lowest, highest);
    Some((angle + 360.0 * turns).clamp(min, max))
}

#[cfg(test)]
mod tests;
