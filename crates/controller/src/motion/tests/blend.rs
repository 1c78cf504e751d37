//! PASS: consecutive motions that overlap.

use super::{KEEP, distance, down, planned, point, posture, seconds, teaching, top_speed};
use crate::model::{ArmModel, Joints};
use crate::motion::{Gate, Limits, Motion, Route, Target, Transform};
use crate::prelude::*;
use core::time::Duration;

const NO_TOOL: Transform = Transform::IDENTITY;

fn turn(value: f64) -> Target {
    Target::Axis { axis: 0, value }
}

fn blended(model: &ArmModel, first: &Motion, at: f64, next: &Motion, pass: f64) -> Motion {
    first.blend(model, seconds(at), next, pass, &NO_TOOL).unwrap()
}

/// Axis 1 of the six-axis arm by 60 degrees twice: 0.25 s up to 240 degrees/s, 0.25 s down.
fn two_turns(limits: &Limits) -> (ArmModel, Motion, Motion) {
    let model = ArmModel::tv800();
    let first = planned(&model, &model.ready, &turn(60.0), limits);
    let next = planned(&model, &first.end(), &turn(120.0), limits);
    (model, first, next)
}

fn corner(model: &ArmModel, limits: &Limits) -> (Motion, Motion) {
    let from = posture(model, 400.0, -150.0, 300.0);
    let first = planned(
        model,
        &from,
        &Target::Pose(down(400.0, 100.0, 300.0), KEEP, Route::Line),
        limits,
    );
    let next = planned(
        model,
        &first.end(),
        &Target::Pose(down(500.0, 100.0, 300.0), KEEP, Route::Line),
        limits,
    );
    (first, next)
}

#[test]
fn the_whole_lasts_as_long_as_both_less_what_overlaps() {
    let (model, first, next) = two_turns(&Limits::FULL);
    for (pass, overlap) in [(100.0, 0.25), (50.0, 0.125), (20.0, 0.05), (250.0, 0.25)] {
        let whole = blended(&model, &first, 0.0, &next, pass);
        let found = whole.duration().as_secs_f64();
        assert!((found - (1.0 - overlap)).abs() < 2e-6, "{pass}: {found}");
        assert_eq!(whole.end(), next.end());
        assert_eq!(whole.joints_at(whole.duration()), next.end());
    }
    // All of a ramp overlapped: axis 1 goes through at its speed.
    let whole = blended(&model, &first, 0.0, &next, 100.0);
    for step in 0..=20 {
        let at = 0.25 + 0.25 * f64::from(step) / 20.0;
        let joint = whole.joints_at(seconds(at))[0];
        assert!(
            (joint - (30.0 + 240.0 * (at - 0.25))).abs() < 1e-3,
            "{joint} at {at}"
        );
    }
    // Different ramps: the shorter one counts.
    let slow = Limits {
        accel: 0.5,
        ..Limits::FULL
    };
    let next = planned(&model, &first.end(), &turn(120.0), &slow);
    let expected = first.duration().as_secs_f64() + next.duration().as_secs_f64() - 0.25;
    let whole = blended(&model, &first, 0.0, &next, 100.0);
    assert!((whole.duration().as_secs_f64() - expected).abs() < 3e-6);
}

#[test]
fn outside_the_overlap_lines_are_lines_and_the_corner_is_rounded() {
    let model = ArmModel::tv800();
    let (first, next) = corner(&model, &Limits::FULL);
    let (mut nearest, mut parts) = (Vec::new(), Vec::new());
    for pass in [10.0, 50.0, 100.0] {
        let whole = blended(&model, &first, 0.0, &next, pass);
        let begins = whole.last_begins().unwrap();
        let (mut closest, mut rounded) = (f64::MAX, 0.0);
        for step in 0..=1000 {
            let at = whole.duration() * step / 1000;
            let here = point(&model, &whole, at);
            closest = closest.min(distance(here, [400.0, 100.0, 300.0]));
            if at < begins {
                assert!((here[0] - 400.0).abs() < 1e-6, "{here:?} is off the first line");
            } else if (here[1] - 100.0).abs() >= 1e-6 {
                assert!(rounded >= 0.0, "{here:?} is off the second line again");
                rounded = (at - begins).as_secs_f64();
            } else {
                rounded = -rounded.abs();
            }
        }
        parts.push(rounded.abs() / pass);
        nearest.push(closest);
        assert_eq!(whole.end(), next.end());
    }
    // What overlaps is in proportion to PASS.
    assert!(
        parts.iter().all(|part| (part - parts[2]).abs() < 1e-4),
        "{parts:?}"
    );
    assert!(nearest.is_sorted() && nearest[2] > 5.0, "{nearest:?}");
}

#[test]
fn neither_axis_speeds_nor_the_cap_are_exceeded() {
    let model = ArmModel::tv800();
    let (first, next) = corner(&model, &teaching());
    let whole = blended(&model, &first, 0.0, &next, 100.0);
    let top = top_speed(&model, &whole, &NO_TOOL);
    assert!(top <= 250.0 + 1e-3 && top > 150.0, "{top}");

    let far = Target::Pose(down(450.0, -200.0, 250.0), KEEP, Route::Joint);
    let from = posture(&model, 350.0, 250.0, 350.0);
    let first = planned(&model, &from, &far, &Limits::FULL);
    let back = Target::Pose(down(500.0, 100.0, 400.0), KEEP, Route::Joint);
    let next = planned(&model, &first.end(), &back, &Limits::FULL);
    let whole = blended(&model, &first, 0.0, &next, 100.0);
    let step = whole.duration() / 1000;
    for index in 0..1000 {
        let (a, b) = (whole.joints_at(step * index), whole.joints_at(step * (index + 1)));
        for (axis, (a, b)) in model.axes.iter().zip(a.iter().zip(b)) {
            assert!((b - a).abs() / step.as_secs_f64() <= axis.max_speed * 1.001);
        }
    }
}

fn speed(motion: &Motion, at: Duration) -> Joints {
    let step = Duration::from_micros(100);
    let (a, b) = (motion.joints_at(at), motion.joints_at(at + step));
    let mut speeds = b;
    for (speed, a) in speeds.iter_mut().zip(a) {
        *speed = (*speed - a) / step.as_secs_f64();
    }
    speeds
}

#[test]
fn a_motion_under_way_goes_on_without_a_jump_whatever_the_override() {
    let model = ArmModel::tv800();
    for (override_part, tool_speed_cap) in [(1.0, None), (0.3, None), (0.05, None), (1.0, Some(250.0))] {
        let limits = Limits {
            override_part,
            tool_speed_cap,
            ..Limits::FULL
        };
        let (first, next) = corner(&model, &limits);
        for part in [0.0, 0.2, 0.5, 0.8, 0.97] {
            let at = first.duration().mul_f64(part);
            let Some(whole) = first.blend(&model, at, &next, 60.0, &NO_TOOL) else {
                assert!(part >= 0.5, "there is room for a longer ramp after {part}");
                continue;
            };
            let (old, new) = (first.joints_at(at), whole.joints_at(at));
            let (was, is) = (speed(&first, at), speed(&whole, at));
            for index in 0..6 {
                assert!((old[index] - new[index]).abs() < 1e-6);
                assert!(
                    (was[index] - is[index]).abs() < 0.5,
                    "{} is not {}",
                    is[index],
                    was[index]
                );
            }
            assert_eq!(whole.end(), next.end());
        }
    }
}

#[test]
fn when_the_next_became_known_does_not_matter_nor_who_asked() {
    let (model, first, next) = two_turns(&Limits::FULL);
    let early = blended(&model, &first, 0.0, &next, 70.0);
    let late = blended(&model, &first, 0.2, &next, 70.0);
    let asked = early.clone();
    for step in 0..500 {
        let at = early.duration() * (step * 7919 % 500) / 500;
        let one = asked.joints_at(at);
        assert_eq!(one, early.joints_at(at));
        if at > seconds(0.2) {
            assert!((one[0] - late.joints_at(at)[0]).abs() < 1e-6);
        }
    }
    assert_eq!(asked, early);
    // Known too late for all of it: what is left of the braking overlaps.
    let last = blended(&model, &first, 0.45, &next, 100.0);
    assert!((last.duration().as_secs_f64() - 0.95).abs() < 2e-6);
}

/// Found by `ts3100 simulate`: a rounding before its beginning, the arm was at the end of the motion before.
#[test]
fn a_motion_added_at_rest_on_the_way_leaves_the_arm_where_it_is() {
    let model = ArmModel::tv800();
    let (first, next) = corner(&model, &Limits::FULL);
    let whole = blended(&model, &first, 0.0, &next, 80.0);
    // Back again: both ramps together ask for more than the arm has, so the last motion is planned anew.
    let back = Target::Pose(down(400.0, 100.0, 300.0), KEEP, Route::Line);
    let back = planned(&model, &next.end(), &back, &Limits::FULL);
    let begins = whole.last_begins().unwrap();
    let mut added = 0;
    for step in 0..200 {
        let mut held = whole.clone();
        held.hold(begins + Duration::from_micros(137 * step));
        let at = held.duration() + seconds(1.0);
        held.resume(at);
        if let Some(longer) = held.blend(&model, at, &back, 50.0, &NO_TOOL) {
            let (here, there) = (held.joints_at(at), longer.joints_at(at));
            let gap = here.iter().zip(there).map(|(here, there)| (here - there).abs());
            assert!(gap.fold(0.0, f64::max) < 1e-6, "step {step}: {here:?}, {there:?}");
            added += 1;
        }
    }
    assert!(added > 20, "{added}");
}

// clause: CMD-FD-01 CMD-FD-02 CMD-EC-04
#[test]
fn hold_override_and_break_across_a_blend_are_exact() {
    let model = ArmModel::tv800();
    let (first, next) = corner(&model, &Limits::FULL);
    let whole = blended(&model, &first, 0.0, &next, 80.0);
    let total = whole.duration().as_secs_f64();
    let begins = whole.last_begins().unwrap();
    for at in [
        begins / 2,
        begins,
        begins + seconds(0.03),
        whole.duration().mul_f64(0.8),
    ] {
        // Feed hold: a quarter of a second to rest, in which an eighth of the time passes (or the end comes).
        let mut held = whole.clone();
        held.hold(at);
        assert!(held.is_held());
        let rest = held.duration();
        let gone = at.as_secs_f64() + 0.125;
        if gone < total {
            assert!((rest - at).as_secs_f64() - 0.25 < 2e-6);
            let (a, b) = (point(&model, &held, rest), point(&model, &whole, seconds(gone)));
            assert!(distance(a, b) < 0.01, "{a:?} is not {b:?}: it rests on its path");
        }
        assert_eq!(held.joints_at(rest), held.joints_at(rest + seconds(60.0)));
        held.resume(rest + seconds(1.0));
        if gone < total {
            let ramp = total - gone;
            // Up again over a quarter of a second if there is room, then the rest at full rate.
            let expected = if ramp >= 0.125 {
                0.25 + ramp - 0.125
            } else {
                (2.0 * ramp * 0.25).sqrt()
            };
            let found = (held.duration() - rest).as_secs_f64() - 1.0;
            assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
        assert_eq!(held.joints_at(held.duration()), next.end());

        // BREAK: it rests where feed hold would, for good.
        let mut broken = whole.clone();
        broken.stop(at);
        assert_eq!(broken.duration(), rest);
        assert_eq!(broken.end(), broken.joints_at(rest + seconds(5.0)));
        broken.resume(rest + seconds(1.0));
        assert_eq!(broken.duration(), rest);

        // Override 50 from `at` on: an eighth of a second down to it, the rest takes twice as long.
        let mut slowed = whole.clone();
        let half = Limits {
            override_part: 0.5,
            ..Limits::FULL
        };
        slowed.set_limits(at, &half);
        let left = total - at.as_secs_f64();
        if left > 0.1 {
            let expected = at.as_secs_f64() + 0.125 + (left - 0.75 * 0.125) / 0.5;
            let found = slowed.duration().as_secs_f64();
            assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
        assert_eq!(slowed.end(), next.end());
    }
}

#[test]
fn a_third_motion_follows_and_the_percentage_is_that_of_the_one_begun_last() {
    let (model, first, second) = two_turns(&Limits::FULL);
    let third = planned(&model, &second.end(), &turn(180.0), &Limits::FULL);
    let fourth = planned(&model, &third.end(), &turn(120.0), &Limits::FULL);
    let two = blended(&model, &first, 0.1, &second, 100.0);
    assert_eq!(two.last_begins(), Some(seconds(0.25)));
    let three = blended(&model, &two, 0.3, &third, 100.0);
    assert_eq!(three.last_begins(), Some(seconds(0.5)));
    assert!((three.duration().as_secs_f64() - 1.0).abs() < 2e-6);
    // Axis 1 passes both points at its speed.
    for (at, joint) in [(0.3, 42.0), (0.5, 90.0), (0.7, 138.0)] {
        let found = three.joints_at(seconds(at))[0];
        assert!((found - joint).abs() < 1e-3, "{found} at {at}");
    }
    assert!((three.percent_at(seconds(0.625)) - 12.5).abs() < 0.01);
    assert_eq!(two.elapsed_at(seconds(0.2)), seconds(0.2));
    assert_eq!(three.elapsed_at(seconds(0.4)), seconds(0.15));
    assert_eq!(three.elapsed_at(seconds(0.625)), seconds(0.125));
    let mut slowed = three.clone();
    slowed.set_limits(
        seconds(0.625),
        &Limits {
            override_part: 0.5,
            ..Limits::FULL
        },
    );
    assert_eq!(slowed.elapsed_at(seconds(0.725)), seconds(0.225));
    assert!(
        three
            .blend(&model, seconds(0.3), &fourth, 50.0, &NO_TOOL)
            .is_none(),
        "the first is still under way"
    );
    let four = three
        .blend(&model, seconds(0.6), &fourth, 50.0, &NO_TOOL)
        .unwrap();
    assert_eq!(four.end(), fourth.end());
    assert!((four.percent_at(four.duration()) - 100.0).abs() < 1e-9);
}

#[test]
fn what_cannot_be_blended_is_left_to_follow() {
    let (model, first, next) = two_turns(&Limits::FULL);
    let none = |first: &Motion, at: f64, next: &Motion, pass: f64| {
        assert!(first.blend(&model, seconds(at), next, pass, &NO_TOOL).is_none());
    };
    none(&first, 0.1, &next, 0.0);
    none(&first, 0.1, &next, f64::NAN);
    none(&first, 0.6, &next, 50.0);
    let elsewhere = planned(&model, &model.ready, &turn(120.0), &Limits::FULL);
    none(&first, 0.1, &elsewhere, 50.0);
    let still = planned(&model, &first.end(), &turn(60.0), &Limits::FULL);
    none(&first, 0.1, &still, 50.0);
    let mut held = first.clone();
    held.hold(seconds(0.1));
    none(&held, 0.12, &next, 50.0);
    let mut broken = first.clone();
    broken.stop(seconds(0.1));
    none(&broken, 0.12, &next, 50.0);
    let [x, y, z] = model.forward(&first.end()).0.xyz;
    let gate = Gate {
        single_axis_1: 5.0,
        retreat: 20.0,
        single_axis_2: 5.0,
    };
    let end = crate::motion::Pose {
        xyz: [x, y - 50.0, z],
        ..model.forward(&first.end()).0
    };
    let arch = Target::Pose(end, KEEP, Route::Arch(gate));
    let arch = planned(&model, &first.end(), &arch, &Limits::FULL);
    none(&first, 0.1, &arch, 50.0);
    // There and back again at the limit of an axis: the sum stays between.
    let back = planned(&model, &first.end(), &turn(0.0), &Limits::FULL);
    let turned = first.blend(&model, seconds(0.1), &back, 100.0, &NO_TOOL).unwrap();
    let highest = (0..=200)
        .map(|step| turned.joints_at(turned.duration() * step / 200)[0])
        .fold(0.0, f64::max);
    assert!(highest < 60.0 && highest > 30.0, "{highest}");
}
