//! The SCARA arm in closed form: two turning axes carry the shaft, which slides (axis 3) and turns (axis 4).
//!
//! T is an additional axis whose value is part of the position. The parent module applies limits and turns.

use super::{ROUNDING, Unreachable};
use crate::model::{Joints, ScaraGeometry};
use crate::motion::pose::{Transform, about_z, degrees, normalised, sin_cos};
use libm::{acos, atan2, hypot};

/// Rounding allowed in the cosine of the elbow, arm stretched or folded.
const ELBOW_ROUNDING: f64 = 1e-12;

/// Place of the flange.
pub(super) fn flange(geometry: &ScaraGeometry, joints: &Joints) -> Transform {
    let (first_sin, first_cos) = sin_cos(joints[0]);
    let (second_sin, second_cos) = sin_cos(joints[0] + joints[1]);
    Transform {
        rotation: about_z(joints[0] + joints[1] + joints[3]),
        origin: [
            geometry.first_arm * first_cos + geometry.second_arm * second_cos,
            geometry.first_arm * first_sin + geometry.second_arm * second_sin,
            joints[2],
        ],
    }
}

/// LEFTY with axis 2 at 0 or above; a SCARA position has no further digits.
pub(super) fn digits(joints: &Joints) -> [u8; 5] {
    [if joints[1] >= 0.0 { 1 } else { 2 }, 0, 0, 0, 0]
}

/// The posture with the first digit given, angles in (-180, 180].
pub(super) fn solve(
    geometry: &ScaraGeometry,
    flange: &Transform,
    t: f64,
    digits: [u8; 5],
) -> Result<Joints, Unreachable> {
    let [x, y, z, a, b, c] = flange.to_coords();
    if a.abs() > ROUNDING || b.abs() > ROUNDING {
        return Err(Unreachable::Tilt { a, b });
    }
    let (first, second) = (geometry.first_arm, geometry.second_arm);
    let distance = hypot(x, y);
    let cos = (distance * distance - first * first - second * second) / (2.0 * first * second);
    if cos.abs() > 1.0 + ELBOW_ROUNDING || cos.is_nan() {
        return Err(Unreachable::Reach {
            distance,
            min: (first - second).abs(),
            max: first + second,
        });
    }
    let bend = degrees(acos(cos.clamp(-1.0, 1.0)));
    let axis_2 = if digits[0] == 1 { bend } else { -bend };
    let (sin, cos) = sin_cos(axis_2);
    let axis_1 = degrees(atan2(y, x) - atan2(second * sin, first + second * cos));
    let turned = [axis_1, axis_2, c - axis_1 - axis_2].map(normalised);
    Ok([turned[0], turned[1], z, turned[2], t, 0.0, 0.0, 0.0])
}
