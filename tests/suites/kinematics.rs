//! Kinematics over random postures, and compared with an independent implementation, the crate rs-opw-kinematics.
//!
//! The checks themselves are in `ts3100_tests::kinematics`; the binary `kinematics` runs them at full scale.

use rs_opw_kinematics::glam::{DQuat, DVec3, EulerRot};
use rs_opw_kinematics::kinematic_traits::{Kinematics, Pose as OpwPose};
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;
use std::f64::consts::PI;
use ts3100_controller::model::{ArmKind, ArmModel, Joints};
use ts3100_controller::motion::Pose;
use ts3100_tests::kinematics::{Seeded, configurations, verify};

/// Few enough for an unoptimised build; the binary `kinematics` takes 100,000.
const POSES: u32 = 2_000;

// clause: DATA-04 SF-42 SF-43
#[test]
fn there_and_back_in_all_configurations_along_lines_and_in_time() {
    for (model, seed) in [
        (ArmModel::tv800(), 21),
        (ArmModel::thl400(), 22),
        (ArmModel::thl400_four_axes(), 23),
        (ArmModel::thl300(), 24),
        (ArmModel::scara_600(), 25),
    ] {
        let report = verify(&model, seed, POSES);
        assert!(report.holds(), "{}: {report:?}", model.name);
        assert_eq!(report.configurations, configurations(&model.kind).len());
    }
}

/// A six-axis model with every length in use, and the same as the crate describes it.
fn both(elbow_offset: f64) -> (ArmModel, OPWKinematics) {
    let mut model = ArmModel::tv800();
    let ArmKind::SixAxis(arm) = &mut model.kind else {
        panic!("a six-axis model");
    };
    arm.elbow_offset = elbow_offset;
    let parameters = Parameters {
        a1: arm.shoulder_offset,
        a2: arm.elbow_offset,
        b: 0.0,
        c1: arm.shoulder_height,
        c2: arm.upper_arm,
        c3: arm.forearm,
        c4: arm.flange,
        offsets: [0.0; 6],
        sign_corrections: [1; 6],
        dof: 6,
    };
    (model, OPWKinematics::new(parameters))
}

fn radians(joints: &Joints) -> [f64; 6] {
    [0, 1, 2, 3, 4, 5].map(|axis: usize| joints[axis] * PI / 180.0)
}

/// The crate's flange looks along its Z, the tool at A = B = C = 0 down: half a turn about Y.
fn opw(pose: &Pose) -> OpwPose {
    let [a, b, c] = pose.abc.map(|angle| angle * PI / 180.0);
    let [x, y, z] = pose.xyz;
    OpwPose::from_parts(
        DVec3::new(x, y, z),
        DQuat::from_euler(EulerRot::ZYX, c, b, a) * DQuat::from_rotation_y(PI),
    )
}

#[test]
fn the_crate_finds_the_same_poses() {
    for elbow_offset in [0.0, 35.0] {
        let (model, crates) = both(elbow_offset);
        let mut seeded = Seeded::new(31);
        for _ in 0..3_000 {
            let joints = seeded.posture(&model);
            let (ours, theirs) = (opw(&model.forward(&joints).0), crates.forward(&radians(&joints)));
            assert!(ours.translation.distance(theirs.translation) < 1e-9, "{joints:?}");
            assert!(
                ours.rotation.dot(theirs.rotation).abs() > 1.0 - 1e-12,
                "{joints:?}"
            );
        }
    }
}

/// Every posture the crate finds within the limits is the one we find for its configuration.
#[test]
fn the_crate_finds_the_same_postures() {
    let mut compared = 0;
    for elbow_offset in [0.0, 35.0] {
        let (model, crates) = both(elbow_offset);
        let mut seeded = Seeded::new(32);
        for _ in 0..1_000 {
            let joints = seeded.posture(&model);
            let pose = model.forward(&joints).0;
            for solution in crates.inverse(&opw(&pose)) {
                let mut theirs = Joints::default();
                for (joint, angle) in theirs.iter_mut().zip(solution) {
                    *joint = angle * 180.0 / PI;
                }
                let digits = model.forward(&theirs).1;
                let fits = model
                    .axes
                    .iter()
                    .zip(theirs)
                    .all(|(axis, joint)| (axis.min..=axis.max).contains(&joint));
                if !fits {
                    continue;
                }
                let ours = model.inverse(&pose, digits, &theirs).unwrap();
                for (ours, theirs) in ours.iter().zip(theirs) {
                    assert!((ours - theirs).abs() < 1e-4, "{ours} is not {theirs}");
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 4_000, "{compared}");
}
