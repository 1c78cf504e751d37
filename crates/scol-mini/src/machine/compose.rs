//! Composition of coordinate systems, `P * T` and `T * U`: shifted along the old axes, then turned by Rz(C) Ry(B) Rx(A), as
//! positions are meant everywhere (D11).
//!
//! `evaluate` decides when two values are composed. Kinematics of an arm are left to the controller.

use crate::geometry::{Pose, Transform};
use crate::options::Arm;
use crate::value::{Position, Trans};

/// `T * U`: where `inner`, given in `outer`, lies in the system `outer` is given in.
pub(super) fn trans(outer: &Trans, inner: &Trans) -> Trans {
    let coords = Transform::from_coords(outer.coords).compose(&Transform::from_coords(inner.coords));
    Trans {
        coords: coords.to_coords(),
    }
}

/// `P * T`: the position moved and turned in its own axes. Posture, WORK and further axes are those of `P`.
pub(super) fn position(arm: Arm, outer: &Position, inner: &Trans) -> Position {
    let pose = Pose::from_coords(arm, outer.coords);
    let moved = pose.transform().compose(&Transform::from_coords(inner.coords));
    Position {
        coords: Pose::from_transform(&moved, pose.uv).coords(arm),
        ..outer.clone()
    }
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
