//! Both arms, there and back: many postures, every configuration, and what is refused.

use super::Unreachable;
use crate::model::{ArmKind, ArmModel, Joints};
use crate::motion::{Pose, Transform};

/// A seeded generator, so that every run sees the same postures.
struct Seeded(u64);

impl Seeded {
    fn between(&mut self, min: f64, max: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        min + (max - min) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn joints(&mut self, model: &ArmModel) -> Joints {
        let mut joints = Joints::default();
        for (joint, axis) in joints.iter_mut().zip(&model.axes) {
            *joint = self.between(axis.min, axis.max);
        }
        joints
    }
}

fn pose(xyz: [f64; 3], abc: [f64; 3]) -> Pose {
    Pose {
        xyz,
        abc,
        uv: [0.0; 2],
    }
}

#[track_caller]
fn assert_same(found: &Pose, expected: &Pose) {
    let (a, b) = (found.transform(), expected.transform());
    for (a, b) in a
        .origin
        .iter()
        .chain(a.rotation.iter().flatten())
        .zip(b.origin.iter().chain(b.rotation.iter().flatten()))
    {
        assert!((a - b).abs() < 1e-6, "{found:?} is not {expected:?}");
    }
    assert_eq!(found.uv, expected.uv);
}

// clause: SF-42 SF-43
#[test]
fn a_posture_comes_back_from_its_pose_and_digits() {
    let mut offset = ArmModel::tv800();
    if let ArmKind::SixAxis(geometry) = &mut offset.kind {
        geometry.elbow_offset = 35.0;
    }
    for (model, seed) in [(ArmModel::tv800(), 1), (ArmModel::thl400(), 2), (offset, 3)] {
        let mut seeded = Seeded(seed);
        for _ in 0..5000 {
            let joints = seeded.joints(&model);
            let (pose, digits) = model.forward(&joints);
            let found = model.inverse(&pose, digits, &joints).unwrap();
            for (found, joint) in found.iter().zip(joints) {
                assert!(
                    (found - joint).abs() < 1e-5,
                    "{found} is not {joint} in {joints:?}"
                );
            }
            assert_same(&model.forward(&found).0, &pose);
            assert_eq!(
                model.inverse(&pose, [0; 5], &joints),
                Ok(found),
                "0 keeps what `near` has"
            );
        }
    }
}

// clause: DATA-04
#[test]
fn every_configuration_of_the_six_axis_arm_reaches_the_same_pose() {
    let model = ArmModel::tv800();
    let mut seeded = Seeded(3);
    let mut reached = [0; 32];
    for _ in 0..500 {
        let at = [
            seeded.between(-450.0, 450.0),
            seeded.between(250.0, 450.0),
            seeded.between(200.0, 500.0),
        ];
        let pose = pose(at, [0; 3].map(|_: i32| seeded.between(-50.0, 50.0)));
        for (number, count) in reached.iter_mut().enumerate() {
            let config = [0, 1, 2, 3, 4].map(|place| 1 + u8::from(number >> place & 1 == 1));
            let Ok(joints) = model.inverse(&pose, config, &model.ready) else {
                continue;
            };
            *count += 1;
            let (found, digits) = model.forward(&joints);
            assert_same(&found, &pose);
            assert_eq!(digits, config);
        }
    }
    assert!(reached.iter().all(|count| *count > 50), "{reached:?}");
}

// clause: DATA-04
#[test]
fn both_configurations_of_the_scara_arm_reach_the_same_pose() {
    let model = ArmModel::thl400();
    let mut seeded = Seeded(4);
    for _ in 0..1000 {
        let at = [
            seeded.between(200.0, 270.0),
            seeded.between(-270.0, 270.0),
            seeded.between(-150.0, 150.0),
        ];
        let pose = Pose {
            uv: [7.0, 0.0],
            ..pose(at, [0.0, 0.0, seeded.between(-179.0, 179.0)])
        };
        for lefty in [1, 2] {
            let joints = model.inverse(&pose, [lefty, 0, 0, 0, 0], &model.ready).unwrap();
            assert_eq!(joints[1] > 0.0, lefty == 1);
            assert_same(&model.forward(&joints).0, &pose);
        }
    }
}

// clause: SF-42 EXAMPLE-05 DATA-01
#[test]
fn positions_of_the_manual_and_of_known_hosts_are_in_reach() {
    let tv800 = ArmModel::tv800();
    let world = [
        [400.0, 0.0, 200.0],
        [400.0, 200.0, 200.0],
        [400.0, 200.0, 50.0],
        [400.0, -200.0, 200.0],
        [400.0, -200.0, 50.0],
    ];
    for at in world {
        tv800.inverse(&pose(at, [0.0; 3]), [0; 5], &tv800.ready).unwrap();
        for config in [[1, 1, 1, 1, 1], [1, 2, 1, 1, 1], [2, 1, 2, 1, 2], [2, 2, 1, 2, 1]] {
            tv800.inverse(&pose(at, [0.0; 3]), config, &tv800.ready).unwrap();
        }
    }
    tv800
        .inverse(
            &pose([300.0, 100.5, -20.123], [45.0, 0.0, 0.0]),
            [0; 5],
            &tv800.ready,
        )
        .unwrap();
    let in_work = [
        (
            [400.0, 200.0, 50.0, 90.0, 0.0, 0.0],
            [50.0, 0.0, 60.0, -45.0, 0.0, 0.0],
        ),
        (
            [400.0, 200.0, 50.0, 90.0, 0.0, 0.0],
            [0.0, 50.0, 70.0, 0.0, 0.0, 0.0],
        ),
        (
            [400.0, 200.0, 50.0, 90.0, 0.0, 0.0],
            [-50.0, 0.0, 60.0, 45.0, 0.0, 0.0],
        ),
        (
            [400.0, -200.0, 50.0, 0.0, 0.0, 0.0],
            [-80.0, 0.0, 60.0, 30.0, 0.0, 0.0],
        ),
        (
            [400.0, -200.0, 50.0, 0.0, 0.0, 0.0],
            [0.0, 30.0, 70.0, 0.0, 0.0, 0.0],
        ),
        (
            [400.0, -200.0, 50.0, 0.0, 0.0, 0.0],
            [-80.0, 0.0, 60.0, -30.0, 0.0, 0.0],
        ),
    ];
    for (work, point) in in_work {
        let placed = Transform::from_coords(work).compose(&Transform::from_coords(point));
        tv800
            .inverse(&Pose::from_transform(&placed, [0.0; 2]), [0; 5], &tv800.ready)
            .unwrap();
    }
    let thl400 = ArmModel::thl400();
    for (at, c, config) in [
        ([300.0, 100.5, -20.123], 45.0, 2),
        ([0.0, -250.0, 28.0], 89.167, 1),
        ([0.0, -250.0, 28.0], 89.167, 2),
    ] {
        thl400
            .inverse(&pose(at, [0.0, 0.0, c]), [config, 0, 0, 0, 0], &thl400.ready)
            .unwrap();
    }
}

#[test]
fn ready_points_the_tool_down_in_the_first_configuration() {
    let (tv800, thl400) = (ArmModel::tv800(), ArmModel::thl400());
    let (pose, digits) = tv800.forward(&tv800.ready);
    assert_eq!(digits, [1; 5]);
    assert!(pose.abc.iter().all(|angle| angle.abs() < 1e-9), "{pose:?}");
    assert!(
        (pose.xyz[0] - 408.5).abs() < 0.1 && (pose.xyz[2] - 293.3).abs() < 0.1,
        "{pose:?}"
    );
    assert_eq!(thl400.forward(&thl400.ready).1, [1, 0, 0, 0, 0]);
}

#[test]
fn a_bent_wrist_passes_its_singular_posture() {
    let model = ArmModel::tv800();
    let joints = [10.0, 20.0, 60.0, 30.0, 0.0, -50.0, 0.0, 0.0];
    let (pose, digits) = model.forward(&joints);
    let found = model.inverse(&pose, digits, &joints).unwrap();
    assert!(
        (found[3] - 30.0).abs() < 1e-6 && (found[5] + 50.0).abs() < 1e-6,
        "{found:?}"
    );
}

/// A model of one's own may let axis 5 fold back: there axes 4 and 6 turn against each other.
#[test]
fn a_wrist_that_is_folded_back_passes_its_singular_posture() {
    let mut model = ArmModel::tv800();
    (model.axes[4].min, model.axes[4].max) = (-200.0, 200.0);
    for axis_5 in [180.0, -180.0] {
        let joints = [10.0, 20.0, 60.0, 30.0, axis_5, -50.0, 0.0, 0.0];
        let (pose, digits) = model.forward(&joints);
        let found = model.inverse(&pose, digits, &joints).unwrap();
        for (found, expected) in found.iter().zip(joints) {
            assert!(
                (found - expected).abs() < 1e-6,
                "{found} for {expected} at {axis_5}"
            );
        }
        assert_same(&model.forward(&found).0, &pose);
    }
}

// clause: DATA-04
#[test]
fn what_cannot_be_reached_is_named() {
    let (tv800, thl400) = (ArmModel::tv800(), ArmModel::thl400());
    let six = |xyz, abc, uv, config| tv800.inverse(&Pose { xyz, abc, uv }, config, &tv800.ready);
    let down = [400.0, 0.0, 200.0];
    assert!(
        matches!(six([2000.0, 0.0, 0.0], [0.0; 3], [0.0; 2], [0; 5]), Err(Unreachable::Reach { distance, .. }) if distance > 1900.0)
    );
    assert!(matches!(
        six([120.0, 0.0, 220.0], [0.0; 3], [0.0; 2], [0; 5]),
        Err(Unreachable::Limit { axis: 3, .. })
    ));
    assert!(matches!(
        six(down, [0.0; 3], [0.0, 5.0], [0; 5]),
        Err(Unreachable::NotFitted { axis: 8, .. })
    ));
    assert_eq!(
        six(down, [0.0; 3], [0.0; 2], [1, 1, 3, 1, 1]),
        Err(Unreachable::Configuration {
            place: 3,
            max: 2,
            found: 3
        })
    );
    assert_eq!(
        six([f64::NAN, 0.0, 0.0], [0.0; 3], [0.0; 2], [0; 5]),
        Err(Unreachable::NotFinite)
    );
    assert!(six([1e300; 3], [1e300; 3], [0.0; 2], [0; 5]).is_err());

    let scara = |xyz, abc, uv, config| thl400.inverse(&Pose { xyz, abc, uv }, config, &thl400.ready);
    let at = [300.0, 0.0, 0.0];
    assert!(matches!(
        scara(at, [10.0, 0.0, 0.0], [0.0; 2], [0; 5]),
        Err(Unreachable::Tilt { .. })
    ));
    assert!(matches!(
        scara(at, [0.0; 3], [0.0; 2], [1, 1, 0, 0, 0]),
        Err(Unreachable::Configuration { place: 2, .. })
    ));
    assert!(matches!(
        scara(at, [0.0; 3], [0.0, 1.0], [0; 5]),
        Err(Unreachable::NotFitted { axis: 8, .. })
    ));
    assert!(matches!(
        scara([300.0, 0.0, 151.0], [0.0; 3], [0.0; 2], [0; 5]),
        Err(Unreachable::Limit { axis: 3, .. })
    ));
    assert!(matches!(
        scara([401.0, 0.0, 0.0], [0.0; 3], [0.0; 2], [0; 5]),
        Err(Unreachable::Reach { .. })
    ));
}

// clause: DATA-04
#[test]
fn single_and_double_decide_the_turn_of_axis_4() {
    let model = ArmModel::tv800();
    let near = [0.0, 10.0, 130.0, 170.0, 40.0, 0.0, 0.0, 0.0];
    let mut there = near;
    there[3] = -175.0;
    let pose = model.forward(&there).0;
    for (digit, expected) in [(0, -175.0), (1, -175.0), (2, 185.0)] {
        let found = model.inverse(&pose, [0, 0, 0, digit, 0], &near).unwrap();
        assert!((found[3] - expected).abs() < 1e-6, "{digit}: {found:?}");
    }
    // DOUBLE is kept as well, though the nearer turn is SINGLE.
    let mut near = near;
    near[3] = 190.0;
    there[3] = 175.0;
    let found = model.inverse(&model.forward(&there).0, [0; 5], &near).unwrap();
    assert!((found[3] + 185.0).abs() < 1e-6, "{found:?}");
}
