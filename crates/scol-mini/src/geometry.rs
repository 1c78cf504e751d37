//! Positions in space: a pose as programs write it, and a transform as rotation matrix and vector.
//!
//! Order of rotation: Rz(C) Ry(B) Rx(A), about the fixed X, then Y, then Z axis (D11). With A = B = C = 0 the tool points
//! straight down and its axes are parallel to those of the world (assumed). So a tool that extends L mm beyond the flange
//! is a TOOL coordinate with Z = -L.
//!
//! Programs multiply positions with it (`machine::compose`). The joints for a pose are left to the controller.

use crate::options::Arm;
use crate::prelude::*;
use core::f64::consts::PI;
use libm::{atan2, cos, fmod, sin, sqrt};

/// Below this cosine of B, A and C turn about the same axis and A is given as 0.
const GIMBAL: f64 = 1e-12;

/// A rotation, by its rows.
pub type Matrix = [[f64; 3]; 3];

/// A position: mm and degrees.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// X, Y, Z in mm.
    pub xyz: [f64; 3],
    /// A, B, C: rotation about X, Y, Z in degrees. SCARA: C alone.
    pub abc: [f64; 3],
    /// U, V: axes 7 and 8. SCARA: T and 0.
    pub uv: [f64; 2],
}

impl Pose {
    /// The pose with these coordinates, in the order in which positions of this kind of arm have them.
    pub fn from_coords(kind: Arm, [x, y, z, fourth, fifth, sixth, u, v]: [f64; 8]) -> Pose {
        let (abc, uv) = match kind {
            Arm::SixAxis => ([fourth, fifth, sixth], [u, v]),
            Arm::Scara => ([0.0, 0.0, fourth], [fifth, 0.0]),
        };
        let xyz = [x, y, z];
        Pose { xyz, abc, uv }
    }

    /// Its coordinates in that order: X Y Z A B C U V; of a SCARA X Y Z C T, and zeros.
    pub fn coords(&self, kind: Arm) -> [f64; 8] {
        let ([x, y, z], [a, b, c], [u, v]) = (self.xyz, self.abc, self.uv);
        match kind {
            Arm::SixAxis => [x, y, z, a, b, c, u, v],
            Arm::Scara => [x, y, z, c, u, 0.0, 0.0, 0.0],
        }
    }

    /// The same place and orientation as a transform, U and V aside.
    pub fn transform(&self) -> Transform {
        let ([x, y, z], [a, b, c]) = (self.xyz, self.abc);
        Transform::from_coords([x, y, z, a, b, c])
    }

    /// The pose of a transform, with the additional axes given.
    pub fn from_transform(transform: &Transform, uv: [f64; 2]) -> Pose {
        let [x, y, z, a, b, c] = transform.to_coords();
        Pose {
            xyz: [x, y, z],
            abc: [a, b, c],
            uv,
        }
    }
}

/// A coordinate system in another: rotation matrix (rows) and origin in mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Its axes as columns.
    pub rotation: Matrix,
    /// Its origin, mm.
    pub origin: [f64; 3],
}

impl Transform {
    /// Identity: no displacement, no rotation.
    pub const IDENTITY: Transform = Transform {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        origin: [0.0; 3],
    };

    /// Creates the transform of X, Y, Z in mm and A, B, C in degrees.
    pub fn from_coords([x, y, z, a, b, c]: [f64; 6]) -> Transform {
        Transform {
            rotation: product(&about_z(c), &product(&about_y(b), &about_x(a))),
            origin: [x, y, z],
        }
    }

    /// X, Y, Z in mm and A, B, C in degrees, angles in (-180, 180] and B in [-90, 90].
    pub fn to_coords(&self) -> [f64; 6] {
        let ([x, y, z], r) = (self.origin, &self.rotation);
        let cos_b = sqrt(r[0][0] * r[0][0] + r[1][0] * r[1][0]);
        let b = atan2(-r[2][0], cos_b);
        let (a, c) = if cos_b < GIMBAL {
            (0.0, atan2(-r[0][1], r[1][1]))
        } else {
            (atan2(r[2][1], r[2][2]), atan2(r[1][0], r[0][0]))
        };
        let [a, b, c] = [a, b, c].map(|angle| normalised(degrees(angle)));
        [x, y, z, a, b, c]
    }

    /// `inner`, given in this coordinate system, in the one this is given in.
    #[must_use]
    pub fn compose(&self, inner: &Transform) -> Transform {
        Transform {
            rotation: product(&self.rotation, &inner.rotation),
            origin: plus(self.origin, turned(&self.rotation, inner.origin)),
        }
    }

    /// The transform that undoes this one.
    #[must_use]
    pub fn inverse(&self) -> Transform {
        let rotation = transposed(&self.rotation);
        let origin = turned(&rotation, self.origin).map(|part| -part);
        Transform { rotation, origin }
    }
}

/// Degrees brought into (-180, 180].
pub fn normalised(angle: f64) -> f64 {
    let rest = match fmod(angle, 360.0) {
        rest if rest > 180.0 => rest - 360.0,
        rest if rest <= -180.0 => rest + 360.0,
        rest => rest,
    };
    // Never a negative zero: it would be printed as one.
    rest + 0.0
}

/// Radians in degrees.
pub fn degrees(radians: f64) -> f64 {
    radians * (180.0 / PI)
}

/// Degrees in radians.
pub fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}

/// Sine and cosine of degrees.
pub fn sin_cos(degrees: f64) -> (f64, f64) {
    (sin(radians(degrees)), cos(radians(degrees)))
}

/// The turn about X by degrees.
fn about_x(angle: f64) -> Matrix {
    let (s, c) = sin_cos(angle);
    [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
}

/// The turn about Y by degrees.
pub fn about_y(angle: f64) -> Matrix {
    let (s, c) = sin_cos(angle);
    [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
}

/// The turn about Z by degrees.
pub fn about_z(angle: f64) -> Matrix {
    let (s, c) = sin_cos(angle);
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

/// The right rotation, then the left one.
pub fn product(left: &Matrix, right: &Matrix) -> Matrix {
    left.map(|row| {
        [0, 1, 2].map(|column: usize| {
            row[0] * right[0][column] + row[1] * right[1][column] + row[2] * right[2][column]
        })
    })
}

/// The rotation that undoes this one.
pub fn transposed(matrix: &Matrix) -> Matrix {
    [0, 1, 2].map(|column: usize| matrix.map(|row| row[column]))
}

/// A vector turned.
fn turned(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| dot(row, vector))
}

/// The scalar product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Applies a function to two arrays, place by place.
pub fn pairwise<A: Copy, B: Copy, C, const N: usize>(a: [A; N], b: [B; N], of: impl Fn(A, B) -> C) -> [C; N] {
    core::array::from_fn(|place| of(a[place], b[place]))
}

/// The sum, place by place.
pub fn plus<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    pairwise(a, b, |a, b| a + b)
}

/// The difference, place by place.
pub fn minus<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    pairwise(a, b, |a, b| a - b)
}

/// The sum of the first and a multiple of the second.
pub fn plus_times<const N: usize>(a: [f64; N], b: [f64; N], factor: f64) -> [f64; N] {
    pairwise(a, b, |a, b| a + b * factor)
}

/// The length of a vector.
pub fn norm(vector: [f64; 3]) -> f64 {
    sqrt(dot(vector, vector))
}

#[cfg(test)]
mod tests {
    use super::{Transform, normalised};

    fn near(found: [f64; 6], expected: [f64; 6]) {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
        }
    }

    #[test]
    fn angles_come_into_half_a_turn_either_side() {
        assert_eq!(
            [180.0, -180.0, 540.0, -190.0, 370.0, 0.0].map(normalised),
            [180.0, 180.0, 180.0, 170.0, 10.0, 0.0]
        );
        assert!(normalised(-360.0).is_sign_positive());
    }

    #[test]
    fn coordinates_survive_the_matrix_and_rotation_is_x_then_y_then_z() {
        for coords in [
            [1.0, -2.0, 3.0, 10.0, -20.0, 30.0],
            [0.0, 0.0, 0.0, 180.0, 45.0, -170.0],
        ] {
            near(Transform::from_coords(coords).to_coords(), coords);
        }
        // A turns Y into Z, then C leaves Z alone.
        let frame = Transform::from_coords([0.0, 0.0, 0.0, 90.0, 0.0, 90.0]);
        let point = frame.compose(&Transform::from_coords([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]));
        near(point.to_coords(), [0.0, 0.0, 1.0, 90.0, 0.0, 90.0]);
    }

    #[test]
    fn upright_b_still_gives_the_same_rotation() {
        let frame = Transform::from_coords([0.0, 0.0, 0.0, 25.0, 90.0, 60.0]);
        let again = Transform::from_coords(frame.to_coords());
        for (row, again) in frame.rotation.iter().zip(again.rotation) {
            for (cell, again) in row.iter().zip(again) {
                assert!((cell - again).abs() < 1e-9);
            }
        }
    }

    // clause: DATA-01
    #[test]
    fn sample_work_coordinate_places_its_point() {
        let work = Transform::from_coords([400.0, 200.0, 50.0, 90.0, 0.0, 0.0]);
        let point = Transform::from_coords([50.0, 0.0, 60.0, -45.0, 0.0, 0.0]);
        near(
            work.compose(&point).to_coords(),
            [450.0, 140.0, 50.0, 45.0, 0.0, 0.0],
        );
        near(
            work.inverse().compose(&work.compose(&point)).to_coords(),
            [50.0, 0.0, 60.0, -45.0, 0.0, 0.0],
        );
    }
}
