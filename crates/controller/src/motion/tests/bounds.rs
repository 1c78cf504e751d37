//! What a motion never exceeds: speed and acceleration of the axes and of the tool point, bends and corners included;
//! and the axes that have less torque or none. Measured along the way, and beside the closed form.

use super::{KEEP, distance, down, planned, point, posture, scara, seconds, top_speed};
use crate::model::{ArmModel, Joints};
use crate::motion::{Gate, Limits, Motion, MotionError, Pose, Route, Target, Transform, plan};
use crate::prelude::*;
use core::time::Duration;
use std::f64::consts::PI;

const NO_TOOL: Transform = Transform::IDENTITY;
/// Between two looks at an acceleration.
const LOOK: Duration = Duration::from_micros(500);

/// Seconds of a trapezoid of so many mm.
fn trapezoid(way: f64, speed: f64, accel: f64) -> f64 {
    let speed = speed.min((way * accel).sqrt());
    way / speed + speed / accel
}

#[track_caller]
fn lasts(motion: &Motion, expected: f64) {
    let found = motion.duration().as_secs_f64();
    assert!((found - expected).abs() < 2e-6, "{found} is not {expected}");
}

/// Half a circle about (400, 0) at this height.
fn half_circle(radius: f64) -> (Pose, Target) {
    let at = |x: f64, y: f64| down(400.0 + x, y, 250.0);
    let target = Target::Pose(at(0.0, radius), KEEP, Route::Arc(at(radius, 0.0)));
    (at(0.0, -radius), target)
}

/// Second differences of something per second², at every look but the outermost.
fn accelerations<const N: usize>(
    motion: &Motion,
    from: Duration,
    of: impl Fn(Duration) -> [f64; N],
) -> Vec<[f64; N]> {
    let looks = |time: Duration| (time.as_micros() / LOOK.as_micros()) as u32;
    let step = LOOK.as_secs_f64();
    // What was before is not known to a motion blended under way.
    (looks(from) + 2..looks(motion.duration()))
        .map(|look| {
            let (before, here, after) = (of(LOOK * (look - 1)), of(LOOK * look), of(LOOK * (look + 1)));
            let mut accel = here;
            for ((accel, before), after) in accel.iter_mut().zip(before).zip(after) {
                *accel = (before - 2.0 * *accel + after) / (step * step);
            }
            accel
        })
        .collect()
}

fn length(vector: [f64; 3]) -> f64 {
    distance(vector, [0.0; 3])
}

/// Most any axis accelerates, as a part of what it can.
fn axis_use(model: &ArmModel, motion: &Motion) -> f64 {
    let used = |accel: &Joints| {
        let axes = model.axes.iter().zip(accel);
        axes.map(|(axis, accel)| accel.abs() / axis.max_accel)
            .fold(0.0, f64::max)
    };
    accelerations(motion, Duration::ZERO, |at| motion.joints_at(at))
        .iter()
        .map(used)
        .fold(0.0, f64::max)
}

#[test]
fn an_arc_is_no_faster_than_its_radius_allows() {
    // Axis 2 of the SCARA as quick as axis 1, so that nothing but the radius holds the arc back.
    let mut scara = super::scara();
    scara.axes[1].max_accel = scara.axes[0].max_accel;
    for model in [ArmModel::tv800(), scara] {
        let (start, target) = if model.axes.len() == 6 {
            half_circle(20.0)
        } else {
            let arc = Target::Pose(down(250.0, 20.0, 0.0), KEEP, Route::Arc(down(270.0, 0.0, 0.0)));
            (down(250.0, -20.0, 0.0), arc)
        };
        let from = model.inverse(&start, KEEP, &model.ready).unwrap();
        for accel in [0.5, 0.1] {
            let limits = Limits {
                accel,
                decel: accel,
                ..Limits::FULL
            };
            let motion = planned(&model, &from, &target, &limits);
            let most = model.max_tool_accel * accel;
            lasts(&motion, trapezoid(20.0 * PI, (most * 20.0).sqrt(), most));
            let top = top_speed(&model, &motion, &NO_TOOL);
            assert!((top * top / 20.0 / most - 1.0).abs() < 0.01, "{top}");
            // Slow enough, the radius does not matter.
            let slow = Limits {
                speed: 0.05,
                ..limits
            };
            let slow = planned(&model, &from, &target, &slow);
            lasts(&slow, trapezoid(20.0 * PI, model.max_tool_speed * 0.05, most));
        }
    }
}

#[test]
fn speed_override_and_model_make_the_speed_of_a_line() {
    let model = ArmModel::tv800();
    let from = posture(&model, 500.0, -100.0, 250.0);
    let target = Target::Pose(down(500.0, 100.0, 250.0), KEEP, Route::Line);
    for (speed, override_part) in [(0.5, 1.0), (0.5, 0.4), (1.0, 0.1)] {
        let limits = Limits {
            speed,
            override_part,
            ..Limits::FULL
        };
        let motion = planned(&model, &from, &target, &limits);
        let expected = 2000.0 * speed * override_part;
        let top = top_speed(&model, &motion, &NO_TOOL);
        assert!((top / expected - 1.0).abs() < 1e-3, "{top} is not {expected}");
        lasts(&motion, trapezoid(200.0, expected, 8000.0));
    }
}

#[test]
fn near_a_singular_posture_a_line_goes_slower_and_no_axis_is_asked_for_too_much() {
    let model = ArmModel::tv800();
    for past in [30.0, 60.0, 120.0, 240.0] {
        // The wrist centre passes axis 1 at this distance, the tool held to the front.
        let from = posture(&model, past, -250.0, 600.0);
        let target = Target::Pose(down(past, 250.0, 600.0), KEEP, Route::Line);
        let motion = planned(&model, &from, &target, &Limits::FULL);
        let step = motion.duration() / 2000;
        for index in 0..2000 {
            let (a, b) = (
                motion.joints_at(step * index),
                motion.joints_at(step * (index + 1)),
            );
            for (axis, (a, b)) in model.axes.iter().zip(a.iter().zip(b)) {
                let speed = (b - a).abs() / step.as_secs_f64();
                assert!(speed <= axis.max_speed * 1.001, "{speed} past {past}");
            }
        }
        assert!(motion.duration() > seconds(trapezoid(500.0, 2000.0, 8000.0)));
        // A ramp and a bend may each ask for all there is.
        let used = axis_use(&model, &motion);
        assert!(used < 2.0, "{used} past {past}");
    }
    // Past axis 1 of a SCARA it is the bend that counts: with short ramps elsewhere, all there is is used.
    let model = scara();
    let from = posture(&model, 125.0, -300.0, 0.0);
    let target = Target::Pose(down(125.0, 300.0, 0.0), KEEP, Route::Line);
    let limits = Limits {
        accel: 0.25,
        decel: 0.25,
        ..Limits::FULL
    };
    let used = axis_use(&model, &planned(&model, &from, &target, &limits));
    assert!(used < 1.05 && used > 0.8, "{used}");
}

#[test]
fn round_a_corner_the_tool_has_no_more_acceleration_than_the_model() {
    let model = ArmModel::tv800();
    let from = posture(&model, 450.0, -120.0, 250.0);
    let limits = Limits {
        speed: 0.3,
        ..Limits::FULL
    };
    let first = planned(
        &model,
        &from,
        &Target::Pose(down(450.0, 0.0, 250.0), KEEP, Route::Line),
        &limits,
    );
    for turn in [0.0_f64, 30.0, 60.0, 90.0, 135.0, 170.0] {
        let (sin, cos) = turn.to_radians().sin_cos();
        let to = down(450.0 + 120.0 * sin, 120.0 * cos, 250.0);
        let next = planned(
            &model,
            &first.end(),
            &Target::Pose(to, KEEP, Route::Line),
            &limits,
        );
        for pass in [30.0, 100.0] {
            let whole = first
                .blend(&model, Duration::ZERO, &next, pass, &NO_TOOL)
                .unwrap();
            let most = accelerations(&whole, Duration::ZERO, |at| point(&model, &whole, at))
                .into_iter()
                .map(length)
                .fold(0.0, f64::max);
            assert!(most < 8000.0 * 1.05, "{most} mm/s² round {turn} degrees");
            assert!(axis_use(&model, &whole) < 1.05, "round {turn} degrees");
        }
    }
}

#[test]
fn a_short_motion_between_two_corners_brakes_when_the_one_before_rests() {
    let model = ArmModel::tv800();
    let from = posture(&model, 450.0, -100.0, 250.0);
    let line = |from: &Joints, x: f64, y: f64| {
        planned(
            &model,
            from,
            &Target::Pose(down(x, y, 250.0), KEEP, Route::Line),
            &Limits::FULL,
        )
    };
    for short in [40.0, 100.0, 200.0] {
        let first = line(&from, 450.0, 0.0);
        let middle = line(&first.end(), 450.0, short);
        let last = line(&middle.end(), 450.0, short - 150.0);
        let two = first
            .blend(&model, Duration::ZERO, &middle, 100.0, &NO_TOOL)
            .unwrap();
        let at = two.last_begins().unwrap();
        let whole = two.blend(&model, at, &last, 100.0, &NO_TOOL).unwrap();
        let most = accelerations(&whole, at, |look| point(&model, &whole, look))
            .into_iter()
            .map(length)
            .fold(0.0, f64::max);
        assert!(most < 8000.0 * 1.05, "{most} mm/s² on {short} mm");
        assert_eq!(whole.end(), last.end());
        let alone = first.duration() + middle.duration() + last.duration();
        assert!(whole.duration() < alone, "{:?} {alone:?}", whole.duration());
    }
}

#[test]
fn an_axis_that_turns_back_brakes_and_gathers_speed_with_what_it_has() {
    let model = ArmModel::tv800();
    let turn =
        |from: &Joints, value: f64| planned(&model, from, &Target::Axis { axis: 0, value }, &Limits::FULL);
    let out = turn(&model.ready, 90.0);
    let back = turn(&out.end(), 0.0);
    let whole = out.blend(&model, Duration::ZERO, &back, 100.0, &NO_TOOL).unwrap();
    let used = axis_use(&model, &whole);
    assert!(used < 1.001 && used > 0.99, "{used}");
    // Both ramps at the corner take twice as long, 0.5 s: one of them is overlapped.
    lasts(&whole, (0.25 + 0.5 + (90.0 - 30.0 - 60.0) / 240.0) * 2.0 - 0.5);
    // Half the acceleration on both sides is no more than the axis has: nothing changes.
    let limits = Limits {
        accel: 0.5,
        decel: 0.5,
        ..Limits::FULL
    };
    let turn = |from: &Joints, value: f64| planned(&model, from, &Target::Axis { axis: 0, value }, &limits);
    let out = turn(&model.ready, 150.0);
    let back = turn(&out.end(), 0.0);
    let whole = out.blend(&model, Duration::ZERO, &back, 100.0, &NO_TOOL).unwrap();
    lasts(&whole, (0.5 + 0.5 + (150.0 - 120.0) / 240.0) * 2.0 - 0.5);
}

#[test]
fn torque_bounds_the_acceleration_of_its_axis() {
    let model = ArmModel::tv800();
    let turn = |axis: usize, torque: f64, accel: f64| {
        let mut limits = Limits {
            accel,
            decel: accel,
            ..Limits::FULL
        };
        limits.torque[0] = torque;
        let value = model.ready[axis] + 100.0;
        let to = Target::Axis { axis, value };
        planned(&model, &model.ready, &to, &limits)
    };
    // Axis 1: 240 degrees/s, 960 degrees/s².
    lasts(&turn(0, 1.0, 1.0), trapezoid(100.0, 240.0, 960.0));
    lasts(&turn(0, 0.5, 1.0), trapezoid(100.0, 240.0, 480.0));
    lasts(&turn(0, 0.5, 0.8), trapezoid(100.0, 240.0, 480.0));
    lasts(&turn(0, 0.5, 0.2), trapezoid(100.0, 240.0, 192.0));
    lasts(&turn(3, 0.5, 1.0), trapezoid(100.0, 375.0, 1500.0));
    // Given up, it brakes with the torque it has: from 192 degrees/s at 480, 0.4 s.
    let mut broken = turn(0, 0.5, 1.0);
    broken.stop(seconds(0.4));
    lasts(&broken, 0.8);
    // A line asks its axes for no more either.
    let from = posture(&model, 300.0, -150.0, 250.0);
    let line = Target::Pose(down(300.0, 150.0, 250.0), KEEP, Route::Line);
    let mut limits = Limits::FULL;
    limits.torque[0] = 0.2;
    let (weak, strong) = (
        planned(&model, &from, &line, &limits),
        planned(&model, &from, &line, &Limits::FULL),
    );
    assert!(weak.duration() > strong.duration().mul_f64(1.5));
    let axis_1 = |at| [weak.joints_at(at)[0]];
    let most = accelerations(&weak, Duration::ZERO, axis_1).into_iter().flatten();
    assert!(most.fold(0.0, |most: f64, accel| most.max(accel.abs())) < 2.0 * 192.0);
}

#[test]
fn a_free_axis_refuses_the_motion_that_needs_it_and_no_other() {
    let model = ArmModel::tv800();
    let mut limits = Limits::FULL;
    limits.torque[4] = 0.0;
    let from = posture(&model, 400.0, -100.0, 250.0);
    let go = |target: Target| plan(&model, &from, &target, &NO_TOOL, &limits).map(|_| ());
    let free = Err(MotionError::Free { axis: 5 });
    assert_eq!(go(Target::Axis { axis: 0, value: 10.0 }), Ok(()));
    assert_eq!(go(Target::Axis { axis: 4, value: 10.0 }), free);
    assert_eq!(
        go(Target::Pose(down(500.0, -100.0, 250.0), KEEP, Route::Joint)),
        free
    );
    assert_eq!(
        go(Target::Pose(down(500.0, -100.0, 250.0), KEEP, Route::Line)),
        free
    );
    assert_eq!(go(Target::Joints(from)), Ok(()));
    let message = MotionError::Free { axis: 5 }.to_string();
    assert!(
        message.starts_with("axis 5 has to move: expected servo gain"),
        "{message}"
    );
}

#[test]
fn a_path_that_leaves_reach_or_limits_on_the_way_is_refused_before_it_begins() {
    let model = scara();
    let refused = |start: [f64; 3], target: Target| {
        let from = posture(&model, start[0], start[1], start[2]);
        let found = plan(&model, &from, &target, &NO_TOOL, &Limits::FULL);
        assert!(
            matches!(found, Err(MotionError::OnPath { percent, .. }) if percent > 1.0 && percent < 99.0),
            "{target:?}: {found:?}"
        );
    };
    // Both ends are in reach; the middle is nearer to axis 1 than axis 2 can fold.
    refused(
        [100.0, -200.0, 0.0],
        Target::Pose(down(100.0, 200.0, 0.0), KEEP, Route::Line),
    );
    // Farther out than the arm is long.
    let arc = Target::Pose(down(370.0, 80.0, 0.0), KEEP, Route::Arc(down(420.0, 0.0, 0.0)));
    refused([370.0, -80.0, 0.0], arc);
    // The way across lies above what axis 3 reaches.
    let gate = Gate {
        single_axis_1: 5.0,
        retreat: 60.0,
        single_axis_2: 5.0,
    };
    let (end, config) = (down(250.0, 100.0, 100.0), KEEP);
    refused(
        [250.0, -100.0, 100.0],
        Target::Pose(end, config, Route::Arch(gate)),
    );
}
