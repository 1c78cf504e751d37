//! Whole motions, from plan to rest.

use super::{Limits, Motion, MotionError, Pose, Route, Singularity, Target, Transform, Unreachable, plan};
use crate::model::{ArmModel, Joints};
use core::time::Duration;

mod arch;
mod blend;
mod bounds;
mod change;
mod courses;
mod random;

const KEEP: [u8; 5] = [0; 5];

/// A SCARA arm whose axes reach their full speed after a quarter of a second or later: ramps are long enough to look at.
fn scara() -> ArmModel {
    let mut model = ArmModel::thl400();
    let rates = [
        (660.0, 2640.0),
        (660.0, 1000.0),
        (840.0, 3360.0),
        (1500.0, 6000.0),
        (600.0, 2400.0),
    ];
    for (axis, (max_speed, max_accel)) in model.axes.iter_mut().zip(rates) {
        (axis.max_speed, axis.max_accel) = (max_speed, max_accel);
    }
    model
}

fn down(x: f64, y: f64, z: f64) -> Pose {
    Pose {
        xyz: [x, y, z],
        ..Pose::default()
    }
}

/// Posture with the tool down there.
fn posture(model: &ArmModel, x: f64, y: f64, z: f64) -> Joints {
    model.inverse(&down(x, y, z), KEEP, &model.ready).unwrap()
}

fn planned(model: &ArmModel, from: &Joints, target: &Target, limits: &Limits) -> Motion {
    plan(model, from, target, &Transform::IDENTITY, limits).unwrap()
}

fn seconds(value: f64) -> Duration {
    Duration::from_secs_f64(value)
}

fn point(model: &ArmModel, motion: &Motion, t: Duration) -> [f64; 3] {
    model.forward(&motion.joints_at(t)).0.xyz
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

/// Fastest the tool point is between any two of many samples, mm/s.
fn top_speed(model: &ArmModel, motion: &Motion, tool: &Transform) -> f64 {
    let step = motion.duration() / 2000;
    let at = |index: u32| {
        model
            .forward(&motion.joints_at(step * index))
            .0
            .transform()
            .compose(tool)
            .origin
    };
    (0..2000)
        .map(|index| distance(at(index), at(index + 1)) / step.as_secs_f64())
        .fold(0.0, f64::max)
}

#[track_caller]
fn assert_close(found: &Joints, expected: &Joints) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} is not {expected}");
    }
}

fn teaching() -> Limits {
    Limits {
        tool_speed_cap: Some(250.0),
        ..Limits::FULL
    }
}

// clause: PRM-SPD-01 PRM-SPD-02
#[test]
fn teaching_caps_the_tool_speed_and_ext_is_faster() {
    let model = ArmModel::tv800();
    let tool = Transform::from_coords([30.0, 0.0, -120.0, 0.0, 20.0, 0.0]);
    let from = posture(&model, 400.0, -250.0, 300.0);
    let there = model
        .forward(&posture(&model, 400.0, 250.0, 300.0))
        .0
        .transform()
        .compose(&tool);
    let end = Pose::from_transform(&there, [0.0; 2]);
    for target in [
        Target::Pose(end, KEEP, Route::Line),
        Target::Pose(end, KEEP, Route::Joint),
    ] {
        let slow = plan(&model, &from, &target, &tool, &teaching()).unwrap();
        let fast = plan(&model, &from, &target, &tool, &Limits::FULL).unwrap();
        assert!(top_speed(&model, &slow, &tool) <= 250.0 + 1e-3);
        assert!(slow.duration() >= seconds(2.0), "{:?}", slow.duration());
        assert!(
            slow.duration() < seconds(2.6),
            "the cap is not needlessly low: {:?}",
            slow.duration()
        );
        assert!(top_speed(&model, &fast, &tool) > 300.0 && fast.duration() < slow.duration());
    }
}

// clause: PRM-SPD-01
#[test]
fn no_joint_motion_breaks_the_cap() {
    let model = ArmModel::tv800();
    let postures = [
        [-150.0, -60.0, 20.0, 0.0, 30.0, 0.0, 0.0, 0.0],
        [150.0, 90.0, 5.0, 170.0, -80.0, 200.0, 0.0, 0.0],
        [0.0, 60.0, -90.0, -300.0, 120.0, -300.0, 0.0, 0.0],
    ];
    let tool = Transform::from_coords([0.0, 0.0, -200.0, 0.0, 0.0, 0.0]);
    for from in postures {
        for to in postures {
            let motion = plan(&model, &from, &Target::Joints(to), &tool, &teaching()).unwrap();
            if from != to {
                assert!(top_speed(&model, &motion, &tool) <= 250.0);
            }
        }
    }
    let scara = scara();
    let target = Target::Joints([120.0, -100.0, 100.0, 90.0, 30.0, 0.0, 0.0, 0.0]);
    let motion = planned(&scara, &scara.ready, &target, &teaching());
    assert!(top_speed(&scara, &motion, &Transform::IDENTITY) <= 250.0);
}

#[test]
fn durations_are_those_of_the_trapezoid() {
    let model = ArmModel::tv800();
    let far = planned(
        &model,
        &model.ready,
        &Target::Axis {
            axis: 0,
            value: 100.0,
        },
        &Limits::FULL,
    );
    // Axis 1: 240 degrees/s, 960 degrees/s²: 0.25 s up, 0.25 s down, 40 degrees at speed.
    assert_eq!(far.duration(), Duration::from_micros(666_667));
    let short = planned(
        &model,
        &model.ready,
        &Target::Axis { axis: 0, value: 15.0 },
        &Limits::FULL,
    );
    assert_eq!(short.duration(), seconds(0.25));
    let slow = Limits {
        speed: 0.5,
        override_part: 1.0,
        accel: 0.5,
        decel: 0.25,
        tool_speed_cap: None,
        ..Limits::FULL
    };
    let slow = planned(
        &model,
        &model.ready,
        &Target::Axis {
            axis: 0,
            value: 100.0,
        },
        &slow,
    );
    // 120 degrees/s, 480 up, 240 down: 0.25 s and 0.5 s, 15 and 30 degrees; 55 degrees at speed.
    assert_eq!(slow.duration(), Duration::from_micros(1_208_334));
    let scara = scara();
    let line = Target::Pose(down(300.0, 50.0, 0.0), KEEP, Route::Line);
    let limits = Limits {
        speed: 0.1,
        ..Limits::FULL
    };
    let line = planned(&scara, &posture(&scara, 300.0, -50.0, 0.0), &line, &limits);
    // 100 mm at 250 mm/s, 10 m/s².
    assert!(
        (line.duration().as_secs_f64() - (0.4 + 0.025)).abs() < 2e-6,
        "{:?}",
        line.duration()
    );
    let nothing = planned(&model, &model.ready, &Target::Joints(model.ready), &Limits::FULL);
    assert_eq!(nothing.duration(), Duration::ZERO);
    assert!((nothing.percent_at(Duration::ZERO) - 100.0).abs() < 1e-12);
}

#[test]
fn slowest_axis_leads_and_all_arrive_together() {
    let model = ArmModel::tv800();
    let to = [100.0, 20.0, 100.0, 40.0, 60.0, -90.0, 0.0, 0.0];
    let motion = planned(&model, &model.ready, &Target::Joints(to), &Limits::FULL);
    assert_eq!(motion.duration(), Duration::from_micros(666_667));
    let half = motion.joints_at(motion.duration() / 2);
    for (joint, (from, to)) in half.iter().zip(model.ready.iter().zip(to)) {
        assert!((joint - f64::midpoint(*from, to)).abs() < 1e-3);
    }
    assert_eq!(motion.joints_at(motion.duration()), to);
    assert_eq!(motion.end(), to);
}

#[test]
fn a_line_is_a_line_and_turns_evenly() {
    let model = ArmModel::tv800();
    let from = posture(&model, 350.0, -200.0, 150.0);
    let (a, b) = ([350.0, -200.0, 150.0], [500.0, 200.0, 350.0]);
    let end = Pose {
        xyz: b,
        abc: [40.0, 0.0, 0.0],
        uv: [0.0; 2],
    };
    let motion = planned(
        &model,
        &from,
        &Target::Pose(end, KEEP, Route::Line),
        &Limits::FULL,
    );
    let length = distance(a, b);
    for index in 0..=997 {
        let t = motion.duration() * index / 997;
        let pose = model.forward(&motion.joints_at(t)).0;
        let part = motion.percent_at(t) / 100.0;
        assert!(distance(pose.xyz, a) + distance(pose.xyz, b) - length < 1e-6);
        assert!(
            (distance(pose.xyz, a) - part * length).abs() < 1e-6,
            "TCP exactly where the profile says"
        );
        assert!(
            (pose.abc[0] - 40.0 * part).abs() < 1e-6 && pose.abc[1].abs() < 1e-6,
            "{pose:?}"
        );
    }
    assert_close(&motion.end(), &model.inverse(&end, KEEP, &from).unwrap());
}

#[test]
fn an_arc_keeps_its_radius_and_passes_the_via_point() {
    let model = ArmModel::tv800();
    let from = posture(&model, 400.0, -100.0, 250.0);
    let arc = Target::Pose(
        down(400.0, 100.0, 250.0),
        KEEP,
        Route::Arc(down(500.0, 0.0, 250.0)),
    );
    let motion = planned(&model, &from, &arc, &Limits::FULL);
    let mut closest = f64::MAX;
    for index in 0..=1000 {
        let at = point(&model, &motion, motion.duration() * index / 1000);
        assert!((distance(at, [400.0, 0.0, 250.0]) - 100.0).abs() < 1e-6 && (at[2] - 250.0).abs() < 1e-6);
        closest = closest.min(distance(at, [500.0, 0.0, 250.0]));
    }
    assert!(closest < 1.0, "{closest}");
    assert!(distance(point(&model, &motion, motion.duration()), [400.0, 100.0, 250.0]) < 1e-6);
    // The long way round: three quarters of the circle.
    let long = Target::Pose(down(300.0, 0.0, 250.0), KEEP, Route::Arc(down(500.0, 0.0, 250.0)));
    let long = planned(&model, &from, &long, &Limits::FULL);
    assert!(distance(point(&model, &long, long.duration()), [300.0, 0.0, 250.0]) < 1e-6);
    let flat = Target::Pose(
        down(400.0, 100.0, 250.0),
        KEEP,
        Route::Arc(down(400.0, 0.0, 250.0)),
    );
    assert_eq!(
        plan(&model, &from, &flat, &Transform::IDENTITY, &Limits::FULL),
        Err(MotionError::NoArc)
    );
}

#[test]
fn the_answer_does_not_depend_on_what_was_asked_before() {
    let model = ArmModel::tv800();
    let from = posture(&model, 350.0, -200.0, 150.0);
    let end = Pose {
        xyz: [450.0, 200.0, 250.0],
        abc: [0.0, 30.0, 170.0],
        uv: [0.0; 2],
    };
    let motion = planned(
        &model,
        &from,
        &Target::Pose(end, KEEP, Route::Line),
        &Limits::FULL,
    );
    let (mut asked, mut once) = (motion.clone(), motion);
    for index in 0..500 {
        let _ = asked.joints_at(asked.duration() * index / 500);
    }
    let at = once.duration() / 3;
    asked.hold(at);
    once.hold(at);
    assert_eq!(asked, once);
    let resumed = once.duration();
    once.resume(resumed);
    let way = once.duration() - resumed;
    let mut last = once.joints_at(resumed);
    for index in 0..=5000 {
        let joints = once.joints_at(resumed + way * index / 5000);
        for (joint, last) in joints.iter().zip(last) {
            assert!(
                (joint - last).abs() < 1.0,
                "joints never jump: {joint} from {last}"
            );
        }
        last = joints;
    }
}

// clause: DATA-04
#[test]
fn paths_that_cannot_be_gone_are_refused_before_the_start() {
    let model = ArmModel::tv800();
    let no_tool = Transform::IDENTITY;
    let go = |from: &Joints, target: Target| plan(&model, from, &target, &no_tool, &Limits::FULL);
    let from = posture(&model, 400.0, -100.0, 250.0);
    let end = down(400.0, 100.0, 250.0);
    assert!(matches!(
        go(&from, Target::Pose(down(1500.0, 0.0, 0.0), KEEP, Route::Line)),
        Err(MotionError::Unreachable(_))
    ));
    // Both ends are in reach, the middle is inside the foot.
    let left = model
        .inverse(&down(0.0, -400.0, 250.0), KEEP, &model.ready)
        .unwrap();
    assert!(matches!(
        go(&left, Target::Pose(down(1.0, 400.0, 250.0), KEEP, Route::Line)),
        Err(MotionError::OnPath { .. } | MotionError::Singular { .. })
    ));
    assert_eq!(
        go(&from, Target::Pose(end, [0, 2, 0, 0, 0], Route::Line)),
        Err(MotionError::Configuration {
            place: 2,
            reached: 1,
            wanted: 2
        })
    );
    assert_eq!(
        go(&from, Target::Pose(end, [0, 0, 0, 2, 0], Route::Line)),
        Err(MotionError::Configuration {
            place: 4,
            reached: 1,
            wanted: 2
        })
    );
}

#[test]
fn targets_that_mean_nothing_to_the_arm_are_refused() {
    let model = ArmModel::tv800();
    let from = model.ready;
    let go = |from: &Joints, target: Target| plan(&model, from, &target, &Transform::IDENTITY, &Limits::FULL);
    let end = down(400.0, 100.0, 250.0);
    assert_eq!(
        go(&from, Target::Axis { axis: 6, value: 1.0 }),
        Err(MotionError::NoSuchAxis { axis: 7, axes: 6 })
    );
    assert!(
        go(
            &from,
            Target::Axis {
                axis: usize::MAX,
                value: 1.0
            }
        )
        .is_err()
    );
    assert!(
        go(
            &from,
            Target::Axis {
                axis: 1,
                value: 179.1
            }
        )
        .is_err()
    );
    assert!(
        go(
            &from,
            Target::Axis {
                axis: 1,
                value: f64::NAN
            }
        )
        .is_err()
    );
    assert!(go(&from, Target::Joints([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0])).is_err());
    assert!(
        go(
            &from,
            Target::Pose(end, KEEP, Route::Arc(down(f64::NAN, 0.0, 0.0)))
        )
        .is_err()
    );
}

#[test]
fn scara_lines_keep_the_configuration_and_carry_t() {
    let model = scara();
    let from = model
        .inverse(&down(300.0, -100.0, 0.0), [2, 0, 0, 0, 0], &model.ready)
        .unwrap();
    let end = Pose {
        xyz: [250.0, 150.0, -20.0],
        abc: [0.0, 0.0, 90.0],
        uv: [30.0, 0.0],
    };
    let motion = planned(
        &model,
        &from,
        &Target::Pose(end, KEEP, Route::Line),
        &Limits::FULL,
    );
    let (pose, digits) = model.forward(&motion.end());
    assert_eq!(digits, [2, 0, 0, 0, 0]);
    assert!(distance(pose.xyz, end.xyz) < 1e-6 && (pose.abc[2] - 90.0).abs() < 1e-6);
    let half = motion.joints_at(motion.duration() / 2);
    assert!((half[4] - 15.0).abs() < 1e-3, "{half:?}");
}

#[test]
fn limits_out_of_range_are_taken_as_the_nearest_in_range() {
    let model = ArmModel::tv800();
    let target = Target::Axis { axis: 0, value: 1.0 };
    let wild = Limits {
        speed: 7.0,
        override_part: 1.0,
        accel: f64::INFINITY,
        decel: 1.5,
        tool_speed_cap: None,
        ..Limits::FULL
    };
    let full = planned(&model, &model.ready, &target, &Limits::FULL).duration();
    assert_eq!(planned(&model, &model.ready, &target, &wild).duration(), full);
    let none = Limits {
        speed: f64::NAN,
        override_part: 1.0,
        accel: 0.0,
        decel: -1.0,
        tool_speed_cap: Some(0.0),
        ..Limits::FULL
    };
    let crawling = planned(&model, &model.ready, &target, &none);
    assert!(crawling.duration() > full && crawling.duration() < seconds(3600.0));
}

#[test]
fn a_path_over_axis_1_or_beyond_a_limit_is_refused() {
    let model = ArmModel::tv800();
    let over = |from: &Joints, end: Pose| {
        plan(
            &model,
            from,
            &Target::Pose(end, KEEP, Route::Line),
            &Transform::IDENTITY,
            &Limits::FULL,
        )
    };
    let from = posture(&model, 0.0, -300.0, 600.0);
    assert!(matches!(
        over(&from, down(0.0, 300.0, 600.0)),
        Err(MotionError::Singular {
            axis: 1,
            posture: Singularity::Shoulder,
            ..
        })
    ));
    // Forearm and tool point straight down on the way: axis 5 would pass 0, which NFLIP does not allow.
    let found = over(&posture(&model, 437.0, 0.0, 123.0), down(237.0, 0.0, 123.0)).unwrap_err();
    assert!(
        matches!(
            found,
            MotionError::Singular {
                axis: 4,
                posture: Singularity::Wrist,
                ..
            }
        ),
        "{found:?}"
    );
    let said = std::string::ToString::to_string(&found);
    assert!(
        said.contains("singular posture of the wrist (axes 4 and 6 in line); axis 4 would have to jump"),
        "{said}"
    );
    // Both ends are within the limits; between them axis 2 would have to fold further than it can.
    let scara = scara();
    let target = Target::Pose(down(100.0, 250.0, 0.0), KEEP, Route::Line);
    let found = plan(
        &scara,
        &posture(&scara, 100.0, -250.0, 0.0),
        &target,
        &Transform::IDENTITY,
        &Limits::FULL,
    );
    assert!(
        matches!(
            found,
            Err(MotionError::OnPath {
                reason: Unreachable::Limit { axis: 2, .. },
                ..
            })
        ),
        "{found:?}"
    );
}

#[test]
fn no_axis_is_faster_than_it_can_on_a_line() {
    let model = ArmModel::tv800();
    let from = posture(&model, 300.0, -250.0, 300.0);
    let motion = planned(
        &model,
        &from,
        &Target::Pose(down(300.0, 250.0, 300.0), KEEP, Route::Line),
        &Limits::FULL,
    );
    let step = motion.duration() / 500;
    for index in 0..500 {
        let (first, second) = (
            motion.joints_at(step * index),
            motion.joints_at(step * (index + 1)),
        );
        for (axis, (first, second)) in model.axes.iter().zip(first.iter().zip(second)) {
            assert!((second - first).abs() / step.as_secs_f64() <= axis.max_speed * 1.001);
        }
    }
}

/// The tool turns by exactly half a turn about an axis that is none of the frame's.
#[test]
fn a_line_with_half_a_turn_about_any_axis_ends_as_it_is_to() {
    let model = ArmModel::tv800();
    let at = |y: f64, abc: [f64; 3]| Pose {
        xyz: [400.0, y, 350.0],
        abc,
        uv: [0.0; 2],
    };
    let mut turned = 0;
    for (start, end) in [
        ([0.0, -45.0, 0.0], [0.0, -45.0, 180.0]),
        ([0.0, -30.0, 20.0], [0.0, -30.0, -160.0]),
        ([20.0, 0.0, 0.0], [20.0, 0.0, 180.0]),
    ] {
        let from = model.inverse(&at(0.0, start), KEEP, &model.ready).unwrap();
        let to = at(20.0, end);
        let target = Target::Pose(to, KEEP, Route::Line);
        let motion = planned(&model, &from, &target, &Limits::FULL);
        let found = model.forward(&motion.joints_at(motion.duration())).0;
        for (found, expected) in found
            .transform()
            .rotation
            .iter()
            .flatten()
            .zip(to.transform().rotation.iter().flatten())
        {
            assert!(
                (found - expected).abs() < 1e-6,
                "{start:?} to {end:?}: {found} for {expected}"
            );
        }
        turned += 1;
    }
    assert_eq!(turned, 3);
}
