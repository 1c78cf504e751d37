//! Motion times of the SCARA arm, compared with those of a real one (decision T21).
//!
//! `fixtures/measured/thl400-motion-times.txt` has the 90 motions and says where they come from. Some milliseconds of
//! communication are in the times.

use crate::extensions::scara_of;
use std::collections::BTreeMap;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Event, Output, Port};
use ts3100_proto::status::ExecutionStatus;
use ts3100_tests::Robot;

/// The override at which all times fit, percent.
const OVERRIDE: u8 = 20;
/// By how much a time may differ from the measured one, and how much they do on average.
const WORST: f64 = 0.08;
const MEAN: f64 = 0.02;
/// Longer than any of the motions.
const LONGEST_MS: u64 = 3_000;

/// The motions measured: from, to, and the mean time in ms.
struct Measured {
    points: BTreeMap<&'static str, [i32; 3]>,
    times: Vec<(&'static str, &'static str, f64)>,
}

fn measured() -> Measured {
    let text = include_str!("../../fixtures/measured/thl400-motion-times.txt");
    let (mut points, mut times) = (BTreeMap::new(), Vec::new());
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        match line.split(' ').collect::<Vec<_>>().as_slice() {
            ["point", name, place @ ..] => {
                let place: Vec<i32> = place.iter().map(|number| number.parse().unwrap()).collect();
                points.insert(*name, place.try_into().unwrap());
            }
            ["time", from, to, repeated @ ..] => {
                let sum: f64 = repeated.iter().map(|time| time.parse::<f64>().unwrap()).sum();
                times.push((*from, *to, sum / 3.0));
            }
            other => panic!("{other:?}"),
        }
    }
    Measured { points, times }
}

fn move_to(name: &str) -> String {
    let [x, y, z] = measured().points[name];
    format!("DO,MOVE POINT({x}, {y}, {z}, 0, 0, LEFTY)")
}

/// Whether the status went from running to stopped since `seen` outputs.
fn has_ended(robot: &Robot, seen: usize) -> bool {
    let ended = |output: &Output| matches!(output, Output::Event(Event::Status { status, .. }) if *status != ExecutionStatus::Running);
    robot.outputs.iter().skip(seen).any(ended)
}

fn arrive(robot: &mut Robot, name: &str) -> f64 {
    let seen = robot.outputs.len();
    let start = robot.now();
    robot.command(Port::Ip0, &move_to(name));
    for _ in 0..LONGEST_MS {
        robot.advance_ms(1);
        if has_ended(robot, seen) {
            return robot.now().since(start).as_secs_f64() * 1_000.0;
        }
    }
    panic!("{name} is not reached within {LONGEST_MS} ms");
}

// clause: T21 T27
#[test]
fn the_scara_moves_as_long_as_the_real_one() {
    let Measured { times, .. } = measured();
    assert_eq!(times.len(), 90);
    for model in [ArmModel::thl400(), ArmModel::thl400_four_axes()] {
        let mut robot = scara_of(model.clone());
        robot.command(Port::Ip0, &format!("EC,OVRD {OVERRIDE}"));
        // The model was fitted to the even rows.
        let mut errors = [Vec::new(), Vec::new()];
        for (row, (from, to, measured)) in (1..).zip(&times) {
            arrive(&mut robot, from);
            let time = arrive(&mut robot, to);
            let error = (time / measured - 1.0).abs();
            assert!(
                error <= WORST,
                "{} {from}>{to}: {time:.0} ms, measured {measured:.0} ms",
                model.name
            );
            errors[row % 2].push(error);
        }
        for errors in errors {
            assert_eq!(errors.len(), 45);
            let mean = errors.iter().sum::<f64>() / 45.0;
            assert!(mean <= MEAN, "{}: {mean}", model.name);
        }
        assert_eq!(robot.alarms(), Vec::<String>::new());
    }
}

/// The point of the data set that needs axis 1 at -175.4 degrees.
#[test]
fn a_point_measured_on_a_real_arm_is_in_reach() {
    for model in [ArmModel::thl400(), ArmModel::thl400_four_axes()] {
        let mut robot = scara_of(model);
        arrive(&mut robot, "E4");
        assert_eq!(robot.alarms(), Vec::<String>::new());
        let axis = crate::extensions::values(&mut robot, "PR,0")[0];
        assert!((axis + 175.4).abs() < 0.05, "{axis}");
    }
}
