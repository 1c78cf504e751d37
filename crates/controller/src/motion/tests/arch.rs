//! Arch motion: where it goes, how long it takes, what is refused, and what changes it under way.

use super::{KEEP, assert_close, down, planned, point, posture, scara, seconds, top_speed};
use crate::model::{ArmModel, Joints};
use crate::motion::{Gate, Limits, MotionError, Route, Target, Transform, Unreachable, plan};
use core::time::Duration;

const GATE: Gate = Gate {
    single_axis_1: 10.0,
    retreat: 50.0,
    single_axis_2: 5.0,
};

fn arch(gate: Gate) -> Target {
    Target::Pose(down(250.0, 150.0, -40.0), KEEP, Route::Arch(gate))
}

fn thl400() -> (ArmModel, Joints) {
    let model = scara();
    let from = posture(&model, 250.0, -150.0, -60.0);
    (model, from)
}

#[test]
fn an_arch_rises_crosses_at_the_gate_and_comes_straight_down() {
    for (model, z) in [(scara(), -60.0), (ArmModel::tv800(), 240.0)] {
        let from = posture(&model, 350.0, -100.0, z);
        let end = down(300.0, 150.0, z + 20.0);
        let target = Target::Pose(end, KEEP, Route::Arch(GATE));
        let motion = planned(&model, &from, &target, &Limits::FULL);
        let top = z + 20.0 + 50.0;
        let mut highest = f64::MIN;
        for step in 0..=2000 {
            let [x, y, height] = point(&model, &motion, motion.duration() * step / 2000);
            let gone = (350.0 - x) / 50.0;
            assert!(
                (y - (-100.0 + 250.0 * gone)).abs() < 1e-6,
                "the way across is straight"
            );
            if height < z + 10.0 - 1e-6 {
                assert!(gone.abs() < 1e-9, "{height}: it rises straight up, {gone} gone");
            }
            // On the way down below the last 5 mm it is over the target.
            if gone > 0.5 && height < z + 25.0 - 1e-6 {
                assert!((gone - 1.0).abs() < 1e-9, "{height}: {gone} gone");
            }
            assert!(height <= top + 1e-6);
            highest = highest.max(height);
        }
        assert!((highest - top).abs() < 1e-3, "{highest}");
        assert_close(&motion.end(), &model.inverse(&end, KEEP, &from).unwrap());
    }
}

#[test]
fn the_time_of_an_arch_is_that_of_its_three_profiles() {
    let (model, from) = thl400();
    let slow = Limits {
        speed: 0.1,
        ..Limits::FULL
    };
    let motion = planned(&model, &from, &arch(GATE), &slow);
    // A tenth of the tool's 2500 mm/s; axis 3 has 3360 mm/s² for it: 9.3 mm of ramp, of which the descent sees 5.
    let (speed, accel) = (250.0, 3360.0_f64);
    let rise = speed / accel / 2.0 + 10.0 / speed;
    let descent = (2.0 * 5.0 / accel).sqrt();
    let top = posture(&model, 250.0, -150.0, 10.0);
    let line = Target::Pose(down(250.0, 150.0, 10.0), KEEP, Route::Line);
    let across = planned(&model, &top, &line, &slow).duration().as_secs_f64();
    let expected = rise + across + descent;
    let found = motion.duration().as_secs_f64();
    assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
    // Half the override takes twice the time: all of it is a function of time.
    let half = Limits {
        override_part: 0.5,
        ..slow
    };
    let half = planned(&model, &from, &arch(GATE), &half)
        .duration()
        .as_secs_f64();
    assert!((half - 2.0 * found).abs() < 1e-5, "{half} {found}");
}

#[test]
fn an_arch_obeys_cap_and_axis_speeds_and_lasts_no_longer_than_it_must() {
    let (model, from) = thl400();
    let teaching = Limits {
        tool_speed_cap: Some(250.0),
        ..Limits::FULL
    };
    let capped = planned(&model, &from, &arch(GATE), &teaching);
    let top = top_speed(&model, &capped, &Transform::IDENTITY);
    assert!(top <= 250.0 + 1e-3 && top > 150.0, "{top}");
    let full = planned(&model, &from, &arch(GATE), &Limits::FULL);
    let step = full.duration() / 1000;
    for index in 0..1000 {
        let (a, b) = (full.joints_at(step * index), full.joints_at(step * (index + 1)));
        for (axis, (a, b)) in model.axes.iter().zip(a.iter().zip(b)) {
            assert!((b - a).abs() / step.as_secs_f64() <= axis.max_speed * 1.01);
        }
    }
    // Overlapping, it is quicker than its three lines one after the other.
    let sharp = planned(
        &model,
        &from,
        &arch(Gate {
            single_axis_1: 70.0,
            retreat: 50.0,
            single_axis_2: 50.0,
        }),
        &Limits::FULL,
    );
    assert!(full.duration() < sharp.duration());
}

#[test]
fn heights_that_do_not_fit_and_gates_out_of_reach_are_refused() {
    let (model, from) = thl400();
    let go = |gate: Gate| plan(&model, &from, &arch(gate), &Transform::IDENTITY, &Limits::FULL);
    let name_of = |found: Result<_, MotionError>| match found {
        Err(MotionError::Gate { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        name_of(go(Gate {
            single_axis_1: 70.1,
            ..GATE
        })),
        "single-axis 1"
    );
    assert_eq!(
        name_of(go(Gate {
            single_axis_2: 50.1,
            ..GATE
        })),
        "single-axis 2"
    );
    assert_eq!(
        name_of(go(Gate {
            retreat: -1.0,
            ..GATE
        })),
        "retreat"
    );
    assert_eq!(
        name_of(go(Gate {
            single_axis_1: f64::NAN,
            ..GATE
        })),
        "single-axis 1"
    );
    assert!(matches!(
        go(Gate {
            retreat: 200.0,
            ..GATE
        }),
        Err(MotionError::OnPath {
            reason: Unreachable::Limit { axis: 3, .. },
            ..
        })
    ));
    let other = Target::Pose(down(250.0, 150.0, -40.0), [2, 0, 0, 0, 0], Route::Arch(GATE));
    assert_eq!(
        plan(&model, &from, &other, &Transform::IDENTITY, &Limits::FULL),
        Err(MotionError::Configuration {
            place: 1,
            reached: 1,
            wanted: 2
        })
    );
}

#[test]
fn an_arch_on_the_spot_goes_up_and_down_and_one_without_a_way_is_over_at_once() {
    let (model, from) = thl400();
    let spot = |height: f64| {
        Target::Pose(
            down(250.0, -150.0, -60.0),
            KEEP,
            Route::Arch(Gate {
                single_axis_1: 0.0,
                retreat: height,
                single_axis_2: 0.0,
            }),
        )
    };
    let motion = planned(&model, &from, &spot(30.0), &Limits::FULL);
    let middle = point(&model, &motion, motion.duration() / 2);
    assert!((middle[2] + 30.0).abs() < 1e-3, "{middle:?}");
    assert_close(&motion.end(), &from);
    assert_eq!(
        planned(&model, &from, &spot(0.0), &Limits::FULL).duration(),
        Duration::ZERO
    );
}

// clause: CMD-FD-01 CMD-FD-02 CMD-EC-04
#[test]
fn hold_override_and_stop_keep_an_arch_on_its_path() {
    let (model, from) = thl400();
    let plain = planned(&model, &from, &arch(GATE), &Limits::FULL);
    for parts in [0.1, 0.3, 0.5, 0.9] {
        let at = plain.duration().mul_f64(parts);
        let mut held = plain.clone();
        held.hold(at);
        assert!(held.is_held());
        let rest = held.duration();
        let place = held.percent_at(rest);
        let there = plain.duration().mul_f64(place / 100.0);
        let (a, b) = (point(&model, &held, rest), point(&model, &plain, there));
        assert!(super::distance(a, b) < 0.01, "{a:?} is not {b:?}");
        held.resume(rest + seconds(2.0));
        assert!(held.duration() >= rest + seconds(2.0));
        assert_eq!(held.end(), plain.end());
        let mut slowed = plain.clone();
        slowed.set_limits(
            at,
            &Limits {
                override_part: 0.2,
                ..Limits::FULL
            },
        );
        assert!(slowed.duration() > plain.duration());
        assert_eq!(slowed.end(), plain.end());
        let mut stopped = plain.clone();
        stopped.stop(at);
        let end = stopped.duration();
        assert_eq!(stopped.joints_at(end), stopped.joints_at(end + seconds(9.0)));
    }
}

#[test]
fn where_two_lines_overlap_no_axis_is_faster_than_it_can() {
    let mut model = ArmModel::tv800();
    for axis in &mut model.axes {
        axis.max_speed /= 4.0;
    }
    let from = posture(&model, 400.0, 0.0, 150.0);
    let target = Target::Pose(
        down(700.0, 0.0, 150.0),
        KEEP,
        Route::Arch(Gate {
            single_axis_1: 0.0,
            retreat: 150.0,
            single_axis_2: 0.0,
        }),
    );
    let motion = planned(&model, &from, &target, &Limits::FULL);
    let step = motion.duration() / 1000;
    let mut fastest: f64 = 0.0;
    for index in 0..1000 {
        let (a, b) = (
            motion.joints_at(step * index),
            motion.joints_at(step * (index + 1)),
        );
        for (axis, (a, b)) in model.axes.iter().zip(a.iter().zip(b)) {
            fastest = fastest.max((b - a).abs() / step.as_secs_f64() / axis.max_speed);
        }
    }
    assert!(
        fastest <= 1.0 && fastest > 0.8,
        "{fastest} of what an axis can do"
    );
}
