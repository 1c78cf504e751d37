//! Motions changed under way: feed hold, BREAK, a new override.

use super::{KEEP, distance, down, planned, point, posture, seconds};
use crate::model::ArmModel;
use crate::motion::{Limits, Route, Target};
use core::time::Duration;

// clause: CMD-FD-01 CMD-FD-02
#[test]
fn feed_hold_rests_on_the_path_and_resume_reaches_the_same_end() {
    let model = ArmModel::tv800();
    let from = posture(&model, 400.0, -250.0, 300.0);
    for target in [
        Target::Pose(down(400.0, 250.0, 300.0), KEEP, Route::Line),
        Target::Pose(down(500.0, 100.0, 200.0), KEEP, Route::Joint),
    ] {
        let plain = planned(&model, &from, &target, &Limits::FULL);
        let mut motion = plain.clone();
        let at = plain.duration() / 3;
        motion.hold(at);
        let rest = motion.duration();
        assert!(motion.is_held() && rest > at && rest < plain.duration());
        assert!(
            distance(point(&model, &motion, at), point(&model, &plain, at)) < 1e-9,
            "no jump"
        );
        let resting = motion.joints_at(rest);
        assert_eq!(resting, motion.joints_at(rest + seconds(3600.0)));
        let percent = motion.percent_at(rest);
        assert!(percent > plain.percent_at(at) && percent < 100.0);

        motion.resume(rest + seconds(5.0));
        assert!(!motion.is_held());
        assert_eq!(motion.joints_at(rest + seconds(5.0)), resting);
        assert!(motion.duration() > rest + seconds(5.0));
        assert_eq!(motion.joints_at(motion.duration()), plain.end());
        assert_eq!(motion.end(), plain.end());
    }
}

#[test]
fn hold_released_while_still_slowing_goes_on_from_that_speed() {
    let model = ArmModel::tv800();
    let plain = planned(
        &model,
        &model.ready,
        &Target::Axis {
            axis: 0,
            value: 100.0,
        },
        &Limits::FULL,
    );
    let mut motion = plain.clone();
    motion.hold(seconds(0.25));
    motion.resume(seconds(0.35));
    // Down from 240 to 144 degrees/s and up again costs 0.2 s at 192 instead of 240: 0.04 s.
    assert_eq!(motion.duration(), Duration::from_micros(706_667));
    assert_eq!(motion.end(), plain.end());
}

// clause: CMD-EC-04 CMD-BR-02
#[test]
fn stop_ends_where_the_arm_rests_and_for_good() {
    let model = ArmModel::tv800();
    let from = posture(&model, 400.0, -250.0, 300.0);
    let target = Target::Pose(down(400.0, 250.0, 300.0), KEEP, Route::Line);
    let gentle = Limits {
        decel: 0.1,
        ..Limits::FULL
    };
    let mut motion = planned(&model, &from, &target, &gentle);
    let mut held = motion.clone();
    let at = motion.duration() / 3;
    held.hold(at);
    motion.stop(at);
    assert!(
        motion.duration() > at && motion.duration() < held.duration(),
        "full deceleration, not that of the motion"
    );
    let end = motion.end();
    assert_eq!(motion.joints_at(motion.duration()), end);
    let pose = model.forward(&end).0;
    assert!(pose.xyz[1] > -250.0 && pose.xyz[1] < 250.0 && (pose.xyz[0] - 400.0).abs() < 1e-6);
    let stopped = motion.clone();
    motion.resume(seconds(10.0));
    motion.set_limits(seconds(10.0), &Limits::FULL);
    motion.hold(seconds(10.0));
    motion.stop(seconds(10.0));
    assert_eq!(motion, stopped);

    assert!(held.is_held());
    let rest = held.duration() + seconds(1.0);
    held.stop(rest);
    assert_eq!(held.duration(), rest, "at rest already: it ends at once");
    assert!(!held.is_held());
}

#[test]
fn new_limits_take_over_from_the_present_place_and_speed() {
    let model = ArmModel::tv800();
    let target = Target::Axis {
        axis: 0,
        value: 100.0,
    };
    let plain = planned(&model, &model.ready, &target, &Limits::FULL);
    let mut motion = plain.clone();
    let half = Limits {
        speed: 0.5,
        ..Limits::FULL
    };
    motion.set_limits(seconds(0.3), &half);
    // 42 degrees gone at 240; 0.125 s down to 120 (22.5), 28 at 120, 0.125 s to rest (7.5).
    let expected = 0.3 + 0.125 + 28.0 / 120.0 + 0.125;
    assert!(
        (motion.duration().as_secs_f64() - expected).abs() < 2e-6,
        "{:?}",
        motion.duration()
    );
    assert_eq!(motion.end(), plain.end());
    // A held motion takes them when it goes on.
    let mut held = plain.clone();
    held.hold(seconds(0.3));
    held.set_limits(seconds(2.0), &half);
    assert!(held.is_held());
    held.resume(seconds(3.0));
    assert!((held.duration().as_secs_f64() - (3.0 + 0.25 / 2.0 * 2.0 + (28.0 - 15.0) / 120.0)).abs() < 2e-6);
}
