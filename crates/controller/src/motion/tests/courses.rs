//! Motions of all joints together: each axis has a trapezoid of its own, the slowest leads (T21, T27.15).

use super::{planned, seconds};
use crate::model::{ArmModel, Axis, Joints};
use crate::motion::{Limits, Target};
use crate::prelude::*;

/// The trapezoid of one axis written out: where it is after `time`, and how long it takes.
struct Trapezoid {
    way: f64,
    speed: f64,
    up: f64,
    down: f64,
}

impl Trapezoid {
    fn new(axis: &Axis, way: f64, limits: &Limits) -> Trapezoid {
        let (up, down) = (axis.max_accel * limits.accel, axis.max_accel * limits.decel);
        let peak = (2.0 * way * up * down / (up + down)).sqrt();
        let speed = peak.min(axis.max_speed * limits.speed);
        Trapezoid { way, speed, up, down }
    }

    fn time(&self) -> f64 {
        let ramps = self.speed * self.speed * (1.0 / self.up + 1.0 / self.down) / 2.0;
        self.speed / self.up + self.speed / self.down + (self.way - ramps).max(0.0) / self.speed
    }

    fn at(&self, time: f64) -> f64 {
        let (gathers, left) = (self.speed / self.up, self.time() - time);
        if time < gathers {
            0.5 * self.up * time * time
        } else if left < self.speed / self.down {
            self.way - 0.5 * self.down * left * left
        } else {
            0.5 * self.up * gathers * gathers + self.speed * (time - gathers)
        }
    }
}

/// Motions of several axes, and their conditions.
fn cases() -> Vec<(ArmModel, Joints, Joints, Limits)> {
    let mut cases = Vec::new();
    let tv800 = ArmModel::tv800();
    let mut uneven = ArmModel::thl400();
    // One axis slow to gather speed, one slow at speed.
    uneven.axes[0].max_accel = 900.0;
    uneven.axes[1].max_speed = 120.0;
    let moves = [
        (tv800.clone(), [100.0, 20.0, 100.0, 40.0, 60.0, -90.0, 0.0, 0.0]),
        (tv800, [-3.0, 90.0, 129.0, 300.0, -60.0, 5.0, 0.0, 0.0]),
        (uneven.clone(), [60.0, -20.0, 100.0, 30.0, 10.0, 0.0, 0.0, 0.0]),
        (uneven.clone(), [40.0, 100.0, -100.0, -300.0, 0.0, 0.0, 0.0, 0.0]),
        (uneven, [-32.0, 0.0, 3.0, -40.0, 90.0, 0.0, 0.0, 0.0]),
    ];
    for (model, to) in moves {
        for (speed, accel, decel) in [(1.0, 1.0, 1.0), (0.3, 1.0, 0.4), (0.7, 0.1, 1.0)] {
            let limits = Limits {
                speed,
                accel,
                decel,
                ..Limits::FULL
            };
            cases.push((model.clone(), model.ready, to, limits));
        }
    }
    cases
}

fn trapezoids(model: &ArmModel, from: &Joints, to: &Joints, limits: &Limits) -> Vec<Trapezoid> {
    let ways = from.iter().zip(to).map(|(from, to)| (to - from).abs());
    let axes = model.axes.iter().zip(ways);
    axes.map(|(axis, way)| Trapezoid::new(axis, way, limits))
        .collect()
}

// clause: T21
#[test]
fn the_axis_that_takes_longest_sets_the_time_and_the_others_are_stretched_to_it() {
    for (model, from, to, limits) in cases() {
        let motion = planned(&model, &from, &Target::Joints(to), &limits);
        let axes = trapezoids(&model, &from, &to, &limits);
        let moving = || axes.iter().filter(|axis| axis.way > 0.0);
        let longest = moving().map(Trapezoid::time).fold(0.0, f64::max);
        let found = motion.duration().as_secs_f64();
        assert!((found - longest).abs() < 2e-6, "{found} is not {longest}");
        for step in 0..=200 {
            let time = longest * f64::from(step) / 200.0;
            let joints = motion.joints_at(seconds(time));
            for (index, axis) in axes.iter().enumerate().filter(|(_, axis)| axis.way > 0.0) {
                let own = axis.at(time * axis.time() / longest);
                let gone = (joints[index] - from[index]).abs();
                assert!((gone - own).abs() < 1e-2, "axis {index} at {time}: {gone}, {own}");
            }
        }
        assert_eq!(motion.end(), to);
    }
}

// clause: T21 T27
#[test]
fn the_override_is_a_factor_on_the_time() {
    for (model, from, to, limits) in cases() {
        let full = planned(&model, &from, &Target::Joints(to), &limits);
        for override_part in [0.5, 0.2, 0.01] {
            let limits = Limits {
                override_part,
                ..limits
            };
            let slow = planned(&model, &from, &Target::Joints(to), &limits);
            let (slow_time, full_time) = (slow.duration().as_secs_f64(), full.duration().as_secs_f64());
            assert!((slow_time * override_part - full_time).abs() < 2e-6);
            for step in 0..=50 {
                let time = full_time * f64::from(step) / 50.0;
                let (slow, full) = (
                    slow.joints_at(seconds(time / override_part)),
                    full.joints_at(seconds(time)),
                );
                for (slow, full) in slow.iter().zip(full) {
                    assert!((slow - full).abs() < 1e-2, "{slow}, {full}");
                }
            }
        }
    }
}

// clause: T21
#[test]
fn a_lower_override_slows_the_motion_under_way_at_its_own_deceleration() {
    let model = ArmModel::tv800();
    let to = [100.0, 10.0, 130.0, 0.0, 40.0, 0.0, 0.0, 0.0];
    let changed = |at: f64, override_part: f64| {
        let mut motion = planned(&model, &model.ready, &Target::Joints(to), &Limits::FULL);
        let slow = Limits {
            override_part,
            ..Limits::FULL
        };
        motion.set_limits(seconds(at), &slow);
        assert_eq!(motion.end(), to);
        motion.duration().as_secs_f64()
    };
    // 32.4 degrees gone; 0.2 s from 240 to 48 degrees/s (28.8), 1.25 s to rest (30), 8.8 degrees at 48.
    let expected = 0.26 + 0.2 + 8.8 / 48.0 + 1.25;
    let found = changed(0.26, 0.2);
    assert!((found - expected).abs() < 2e-6, "{found} is not {expected}");
    // 42 degrees gone: there is no room for 24 degrees/s and the ramp from there, so it is slowed further.
    let low = ((2.0 * 960.0 * 58.0 - 240.0_f64.powi(2)) / (1.0 / 0.01 - 1.0)).sqrt();
    assert!(low < 24.0);
    let expected = 0.3 + (240.0 - low) / 960.0 + low / 9.6;
    let found = changed(0.3, 0.1);
    assert!((found - expected).abs() < 2e-6, "{found} is not {expected}");
}
