//! Composition of coordinate systems, `P * T` and `T * U`: shifted along the old axes, then turned by Rz(C) Ry(B) Rx(A), as
//! positions are meant everywhere (D11).
//!
//! `evaluate` decides when two values are composed. Kinematics of an arm are left to the controller.

use crate::options::Arm;
use crate::value::{Position, Trans};

/// Below this cosine of B, A and C turn about the same axis and A is given as 0.
const GIMBAL: f64 = 1e-12;
const DEGREES: f64 = 180.0 / core::f64::consts::PI;

type Matrix = [[f64; 3]; 3];

/// `T * U`: where `inner`, given in `outer`, lies in the system `outer` is given in.
pub(super) fn trans(outer: &Trans, inner: &Trans) -> Trans {
    Trans {
        coords: composed(outer.coords, inner.coords),
    }
}

/// `P * T`: the position moved and turned in its own axes. Posture, WORK and further axes are those of `P`.
pub(super) fn position(arm: Arm, outer: &Position, inner: &Trans) -> Position {
    let [x, y, z, fourth, fifth, sixth, u, v] = outer.coords;
    let turned = match arm {
        Arm::SixAxis => [x, y, z, fourth, fifth, sixth],
        Arm::Scara => [x, y, z, 0.0, 0.0, fourth],
    };
    let [x, y, z, a, b, c] = composed(turned, inner.coords);
    let coords = match arm {
        Arm::SixAxis => [x, y, z, a, b, c, u, v],
        Arm::Scara => [x, y, z, c, fifth, sixth, u, v],
    };
    Position {
        coords,
        ..outer.clone()
    }
}

fn composed(outer: [f64; 6], inner: [f64; 6]) -> [f64; 6] {
    let [x, y, z, ..] = outer;
    let [dx, dy, dz, ..] = inner;
    let rotation = rotation(outer);
    let shift = rotation.map(|[rx, ry, rz]| rx * dx + ry * dy + rz * dz);
    let [sx, sy, sz] = shift;
    let [a, b, c] = angles(&product(&rotation, &self::rotation(inner)));
    [x + sx, y + sy, z + sz, a, b, c]
}

fn rotation([_, _, _, a, b, c]: [f64; 6]) -> Matrix {
    let ((sa, ca), (sb, cb), (sc, cc)) = (turn(a), turn(b), turn(c));
    let about_x = [[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]];
    let about_y = [[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]];
    let about_z = [[cc, -sc, 0.0], [sc, cc, 0.0], [0.0, 0.0, 1.0]];
    product(&about_z, &product(&about_y, &about_x))
}

fn turn(degrees: f64) -> (f64, f64) {
    libm::sincos(degrees / DEGREES)
}

fn product(left: &Matrix, right: &Matrix) -> Matrix {
    let [first, second, third] = right;
    left.map(|[x, y, z]| {
        let mut row = [0.0; 3];
        for (((to, a), b), c) in row.iter_mut().zip(first).zip(second).zip(third) {
            *to = x * a + y * b + z * c;
        }
        row
    })
}

/// A, B, C in degrees.
fn angles(matrix: &Matrix) -> [f64; 3] {
    let [[xx, xy, _], [yx, yy, _], [zx, zy, zz]] = *matrix;
    let cos_b = libm::sqrt(xx * xx + yx * yx);
    let b = libm::atan2(-zx, cos_b);
    let (a, c) = if cos_b < GIMBAL {
        (0.0, libm::atan2(-xy, yy))
    } else {
        (libm::atan2(zy, zz), libm::atan2(yx, xx))
    };
    // Adding 0 makes a negative zero a positive one.
    [a * DEGREES + 0.0, b * DEGREES + 0.0, c * DEGREES + 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: &[f64], expected: &[f64]) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
        }
    }

    #[test]
    fn a_shift_goes_along_the_turned_axes() {
        let outer = Trans {
            coords: [100.0, 0.0, 0.0, 0.0, 0.0, 90.0],
        };
        let inner = Trans {
            coords: [10.0, 0.0, 5.0, 0.0, 0.0, 30.0],
        };
        close(
            &trans(&outer, &inner).coords,
            &[100.0, 10.0, 5.0, 0.0, 0.0, 120.0],
        );
    }

    #[test]
    fn composition_is_associative_and_the_scara_turns_about_z_alone() {
        let system = |coords| Trans { coords };
        let (a, b, c) = (
            system([1.0, 2.0, 3.0, 10.0, 20.0, 30.0]),
            system([4.0, 5.0, 6.0, -40.0, 15.0, 100.0]),
            system([7.0, 8.0, 9.0, 5.0, -60.0, 170.0]),
        );
        close(
            &trans(&trans(&a, &b), &c).coords,
            &trans(&a, &trans(&b, &c)).coords,
        );
        let start = Position {
            coords: [100.0, 50.0, 10.0, 90.0, 7.0, 0.0, 0.0, 0.0],
            ..Position::default()
        };
        let there = position(Arm::Scara, &start, &system([10.0, 0.0, 1.0, 0.0, 0.0, 45.0]));
        close(&there.coords, &[100.0, 60.0, 11.0, 135.0, 7.0, 0.0, 0.0, 0.0]);
    }
}
