//! The six-axis arm with a spherical wrist in closed form: three axes carry the wrist centre, three turn the tool about
//! it.
//!
//! The parent module applies limits and turns.

use super::{PostureResult, two_links};
use crate::model::{Joints, SixAxisGeometry};
use crate::motion::pose::{
    Transform, about_y, about_z, degrees, normalised, plus_times, product, sin_cos, transposed,
};
use libm::{atan2, hypot};

/// Below this sine of axis 5, axes 4 and 6 turn about the same line: axis 4 stays, axis 6 does the turning.
const WRIST_SINGULAR: f64 = 1e-9;
/// Below this distance in mm the wrist centre is on axis 1: axis 1 stays.
const SHOULDER_SINGULAR: f64 = 1e-9;

/// Flange axes against tool axes: the flange looks along its Z, the tool at A = B = C = 0 along the world's -Z.
const FLIP: [[f64; 3]; 3] = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];

/// Elbow to wrist centre: its length, and its angle to the forearm line in degrees.
fn forearm(geometry: &SixAxisGeometry) -> (f64, f64) {
    (
        hypot(geometry.elbow_offset, geometry.forearm),
        degrees(atan2(geometry.elbow_offset, geometry.forearm)),
    )
}

/// Wrist centre in the plane of the arm: distance in front of axis 1, and height.
fn wrist_centre(geometry: &SixAxisGeometry, joints: &Joints) -> (f64, f64) {
    let (length, bend) = forearm(geometry);
    let (upper_sin, upper_cos) = sin_cos(joints[1]);
    let (fore_sin, fore_cos) = sin_cos(joints[1] + joints[2] + bend);
    (
        geometry.shoulder_offset + geometry.upper_arm * upper_sin + length * fore_sin,
        geometry.shoulder_height + geometry.upper_arm * upper_cos + length * fore_cos,
    )
}

/// Place of the flange, axes as the tool's at zero.
pub(super) fn flange(geometry: &SixAxisGeometry, joints: &Joints) -> Transform {
    let arm = product(&about_z(joints[0]), &about_y(joints[1] + joints[2]));
    let wrist = product(
        &about_z(joints[3]),
        &product(&about_y(joints[4]), &about_z(joints[5])),
    );
    let look = product(&arm, &wrist);
    let (front, height) = wrist_centre(geometry, joints);
    let (sin, cos) = sin_cos(joints[0]);
    let along = look.map(|row| row[2]);
    Transform {
        rotation: product(&look, &FLIP),
        origin: plus_times([front * cos, front * sin, height], along, geometry.flange),
    }
}

/// Shoulder: LEFTY with the wrist in front of axis 1. Elbow: ABOVE with axis 3 bent downwards, as seen from the
/// side the arm leans to. Wrist: NFLIP with axis 5 at 0 or above. Axes 4, 6: SINGLE up to half a turn. (Assumed.)
pub(super) fn digits(geometry: &SixAxisGeometry, joints: &Joints) -> [u8; 5] {
    let (_, bend) = forearm(geometry);
    let lefty = wrist_centre(geometry, joints).0 >= 0.0;
    let forward = joints[2] + bend >= 0.0;
    let digit = |first: bool| if first { 1 } else { 2 };
    [
        digit(lefty),
        digit(lefty == forward),
        digit(joints[4] >= 0.0),
        digit(joints[3].abs() <= 180.0),
        digit(joints[5].abs() <= 180.0),
    ]
}

/// The posture with the first three digits given, angles in (-180, 180]. `near` decides where a singular
/// posture leaves an axis open.
pub(super) fn solve(
    geometry: &SixAxisGeometry,
    flange: &Transform,
    digits: [u8; 5],
    near: &Joints,
) -> PostureResult {
    // A spherical wrist parts the problem in two. The wrist centre lies `flange` mm behind the flange and decides axes
    // 1 to 3; the turn that these leave over decides axes 4 to 6.
    let look = product(&flange.rotation, &FLIP);
    let along = look.map(|row| row[2]);
    let [x, y, z] = plus_times(flange.origin, along, -geometry.flange);
    let lefty = digits[0] == 1;

    let distance = hypot(x, y);
    let axis_1 = if distance < SHOULDER_SINGULAR {
        near[0]
    } else {
        // RIGHTY turns the back to the point and leans over: hence the half turn, and `front` below is negative.
        degrees(atan2(y, x)) + if lefty { 0.0 } else { 180.0 }
    };
    let front = if lefty { distance } else { -distance } - geometry.shoulder_offset;
    let up = z - geometry.shoulder_height;

    let (length, bend) = forearm(geometry);
    // ABOVE is seen from the side the arm leans to. Leaning backwards mirrors it, so the bend changes its sign.
    let forward = lefty == (digits[1] == 1);
    // Axis 2 counts from the upright towards the front, so `up` is along the first axis of `two_links`.
    // The second link runs straight from elbow to wrist centre; `bend` leads back to the forearm line.
    let [axis_2, elbow] = two_links([geometry.upper_arm, length], [up, front], forward)?;
    let axis_3 = elbow - bend;

    let arm = product(&about_z(axis_1), &about_y(axis_2 + axis_3));
    let [axis_4, axis_5, axis_6] = wrist(&product(&transposed(&arm), &look), digits[2] == 1, near[3]);
    Ok([axis_1, axis_2, axis_3, axis_4, axis_5, axis_6, 0.0, 0.0].map(normalised))
}

/// Axes 4, 5, 6 of a rotation Rz(4) Ry(5) Rz(6).
fn wrist(turn: &[[f64; 3]; 3], nflip: bool, near_4: f64) -> [f64; 3] {
    // Rz(4) Ry(5) Rz(6) has the last column (c4 s5, s4 s5, c5) and the last row (-s5 c6, s5 s6, c5). The sine of axis 5
    // is known but for its sign, which NFLIP and FLIP decide. Dividing by it turns axes 4 and 6 by half a turn as well.
    let sin = hypot(turn[0][2], turn[1][2]);
    if sin < WRIST_SINGULAR && turn[2][2] > 0.0 {
        // Axes 4 and 6 are one turn here: only their sum is known.
        let together = degrees(atan2(turn[1][0], turn[0][0]));
        return [near_4, 0.0, together - near_4];
    }
    let sign = if nflip { 1.0 } else { -1.0 };
    if sin < WRIST_SINGULAR {
        // Axis 5 is folded back, beyond the range of the models here: only the difference of axes 4 and 6 is known.
        let apart = degrees(atan2(turn[1][0], turn[1][1]));
        return [near_4, sign * 180.0, near_4 + apart];
    }
    [
        degrees(atan2(sign * turn[1][2], sign * turn[0][2])),
        degrees(atan2(sign * sin, turn[2][2])),
        degrees(atan2(sign * turn[2][1], -sign * turn[2][0])),
    ]
}
