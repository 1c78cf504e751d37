//! The SCARA arm in closed form: two turning axes carry the shaft, which slides (axis 3) and turns (axis 4).
//!
//! T is an additional axis whose value is part of the position. The parent module applies limits and turns.

use super::{PostureResult, ROUNDING, Unreachable, two_links};
use crate::model::{Joints, ScaraGeometry};
use crate::motion::pose::{Transform, about_z, normalised, sin_cos};

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
pub(super) fn solve(geometry: &ScaraGeometry, flange: &Transform, t: f64, digits: [u8; 5]) -> PostureResult {
    let [x, y, z, a, b, c] = flange.to_coords();
    if a.abs() > ROUNDING || b.abs() > ROUNDING {
        return Err(Unreachable::Tilt { a, b });
    }
    let links = [geometry.first_arm, geometry.second_arm];
    let [axis_1, axis_2] = two_links(links, [x, y], digits[0] == 1)?;
    // All three axes are upright, so C is the sum of their turns.
    let turned = [axis_1, axis_2, c - axis_1 - axis_2].map(normalised);
    Ok([turned[0], turned[1], z, turned[2], t, 0.0, 0.0, 0.0])
}
