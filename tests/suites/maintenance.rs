//! The maintenance information of MN and RM (S29, S74, S75): every number is counted in virtual time and survives a power
//! cycle and a snapshot.
//!
//! The layout of the answer has unit tests in `ts3100-proto`.

use crate::extensions::{scara, scara_of, six_axis};
use ts3100_controller::action::Action;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect, Input, PanelAction, Port};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::mn::{MN_AXES, MaintenanceItem};
use ts3100_proto::status::position::CurrentPosition;
use ts3100_tests::{Robot, round_trip};

/// Half a unit of the only decimal.
const ROUNDING: f64 = 0.05 + 1e-9;

/// The values of an item.
fn item(robot: &mut Robot, number: u8) -> Vec<f64> {
    let read = MaintenanceItem::decode(&robot.file(Port::Ip0, &format!("MN,{number}"))).unwrap();
    assert_eq!(read.number, number);
    read.values
}

/// All items but 5, which reading clears; item n at place n.
fn maintenance(robot: &mut Robot) -> Vec<Vec<f64>> {
    let read = |number| match number {
        0 | 5 => Vec::new(),
        number => item(robot, number),
    };
    (0..=17).map(read).collect()
}

fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= ROUNDING,
        "{what}: {found}, {expected} expected"
    );
}

/// A statement, and time for it.
fn order(robot: &mut Robot, statement: &str) {
    robot.command(Port::Ip0, &format!("DO,{statement}"));
    robot.advance_ms(60_000);
}

// clause: S29 S74 S75 T3
#[test]
fn a_scara_serves_it_in_both_dialects_and_six_axes_with_extensions() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        for (model, scara) in [(ArmModel::thl400(), true), (ArmModel::tv800(), false)] {
            let mut robot = Robot::with(Config {
                model,
                ..Config::new(dialect)
            });
            robot.connect(Port::Ip0);
            if scara || dialect == Dialect::Field {
                for number in 1..=17 {
                    let count = if (10..=16).contains(&number) { 1 } else { MN_AXES };
                    assert_eq!(item(&mut robot, number).len(), count, "{number}");
                }
                robot.command(Port::Ip0, "RM,1");
                robot.command(Port::Ip0, "RM,16");
            } else {
                assert_eq!(robot.ask(Port::Ip0, "MN,1"), b"NG\r");
                assert_eq!(robot.ask(Port::Ip0, "RM,1"), b"NG\r");
            }
            for refused in ["MN", "MN,0", "MN,18", "MN,1 2", "RM", "RM,0", "RM,17", "RM,18"] {
                assert_eq!(robot.ask(Port::Ip0, refused), b"NG\r", "{refused}");
            }
        }
    }
}

/// Axis 1 of the six-axis arm: 240 degrees/s, 960 degrees/s². From 0 to 100 degrees and back: 0.25 s of full
/// acceleration four times, and 2/3 s each way.
// clause: S29 S74 T3
#[test]
fn ways_and_torques_are_those_of_the_motions() {
    let mut robot = six_axis();
    for number in (1..=9).chain([17]) {
        assert_eq!(item(&mut robot, number), [0.0; MN_AXES], "{number}");
    }
    order(&mut robot, "MOVEA 1, 100");
    order(&mut robot, "MOVEA 1, 0");
    let read = maintenance(&mut robot);
    close(read[1][0], 200.0 / 360.0, "revolutions");
    close(read[2][0], 200.0, "degrees");
    close(read[3][0], 100.0, "percent times seconds: 1 s at 100 %");
    close(read[4][0], 0.0, "above 100 %");
    close(read[17][0], 100.0, "peak");
    // Twice 0.5 s at 100 %: the second within the last minute or so, both within the last quarter of an hour.
    let load = |seconds: f64, window: f64| 100.0 * (seconds / window).sqrt();
    close(read[6][0], 0.0, "3 s");
    close(read[8][0], load(1.0, 900.0), "15 min");
    close(read[9][0], load(1.0, 7_200.0), "2 h");
    for values in read.iter().filter(|values| values.len() == MN_AXES) {
        assert_eq!(values[1..], [0.0; 5], "the other axes stood");
    }
    close(read[13][0], 4.0 / 3.0 / 60.0, "motion time");
    // At half the acceleration the way is over before the full speed is reached.
    order(&mut robot, "MOVEA 1, 100 WITH ACCEL=50, DECEL=50");
    let after = maintenance(&mut robot);
    close(
        after[3][0],
        100.0 + 100.0 * (100.0_f64 / 480.0).sqrt(),
        "50 % all the way",
    );
    close(after[17][0], 100.0, "the highest stays");
}

// clause: S74 T3 T27
#[test]
fn load_factors_are_of_the_last_time() {
    let mut robot = six_axis();
    // 0.25 s of acceleration and as much of deceleration at 100 %.
    robot.command(Port::Ip0, "DO,MOVEA 1, 100");
    robot.advance_ms(1_000);
    let load = |window: f64| 100.0 * (0.5 / window).sqrt();
    for (number, window) in [(6, 3.0), (7, 60.0), (8, 900.0), (9, 7_200.0)] {
        close(item(&mut robot, number)[0], load(window), "just now");
    }
    robot.advance_ms(3_000);
    close(item(&mut robot, 6)[0], 0.0, "more than 3 s ago");
    close(item(&mut robot, 7)[0], load(60.0), "within a minute");
    robot.advance_ms(60_000);
    close(item(&mut robot, 7)[0], 0.0, "more than a minute ago");
    close(item(&mut robot, 8)[0], load(900.0), "within a quarter of an hour");
    robot.advance_ms(900_000);
    close(item(&mut robot, 8)[0], 0.0, "more than a quarter of an hour ago");
    robot.command(Port::Ip0, "RM,9");
    close(item(&mut robot, 9)[0], 0.0, "reset");
}

// clause: S74 T3 T27
#[test]
fn reading_item_5_clears_the_peak_and_reading_17_does_not() {
    let mut robot = six_axis();
    order(&mut robot, "MOVEA 1, 100");
    for _ in 0..2 {
        close(item(&mut robot, 17)[0], 100.0, "17 stays");
    }
    close(item(&mut robot, 5)[0], 100.0, "5 shows it");
    close(item(&mut robot, 5)[0], 0.0, "and has cleared it");
    close(item(&mut robot, 17)[0], 0.0, "17 is the same value");
    order(&mut robot, "MOVEA 1, 0 WITH ACCEL=50, DECEL=50");
    close(item(&mut robot, 17)[0], 50.0, "the highest since");
    robot.command(Port::Ip0, "RM,5");
    close(item(&mut robot, 17)[0], 0.0, "RM,5");
}

// clause: S75 T3 T27
#[test]
fn a_reset_clears_one_item_and_no_other_while_a_program_runs_too() {
    let mut prepared = Robot::ready("PROGRAM T\nMOVEA 1, 100\nDELAY 1000.0\nEND\n");
    prepared.advance_ms(6 * 60_000);
    prepared.command(Port::Ip0, "BR");
    prepared.command(Port::Ip0, "SO");
    prepared.command(Port::Ip0, "RN");
    prepared.advance_ms(900);
    let before = maintenance(&mut prepared);
    for number in 1..=16 {
        let mut robot = prepared.clone();
        robot.command(Port::Ip0, &format!("RM,{number}"));
        let after = maintenance(&mut robot);
        for other in (1..=17).filter(|other| *other != 5) {
            // 5 and 17 show one value.
            let cleared = other == number || (other, number) == (17, 5);
            let expected = match cleared {
                true => vec![0.0; before[other].len()],
                false => before[other].clone(),
            };
            assert_eq!(after[other], expected, "item {other} after RM,{number}");
        }
    }
    // It counts on from there.
    let mut robot = prepared.clone();
    for number in [2, 11] {
        robot.command(Port::Ip0, &format!("RM,{number}"));
    }
    robot.command(Port::Ip0, "SP");
    robot.command(Port::Ip0, "EC,BREAK");
    robot = Robot::from_controller(round_trip::round_trip(&robot.seat.controller));
    order(&mut robot, "MOVEA 1, 70");
    close(item(&mut robot, 2)[0], 30.0, "way since the reset");
    close(item(&mut robot, 11)[0], 1.0, "energised since the reset");
}

// clause: S29
#[test]
fn an_axis_that_slides_moves_and_does_not_turn() {
    for model in [ArmModel::thl400(), ArmModel::thl400_four_axes()] {
        let ramps = 2.0 * model.axes[2].max_speed / model.axes[2].max_accel;
        let mut robot = scara_of(model);
        order(&mut robot, "MOVEA 3, 100");
        let read = maintenance(&mut robot);
        close(read[2][2], 100.0, "mm");
        assert_eq!(read[1][2], 0.0, "{read:?}");
        // All the torque while it gathers speed and while it brakes.
        close(read[3][2], ramps * 100.0, "torque over time");
    }
}

/// What is cut short, held, taken up, jogged and run through counts as far as it went, whoever asks in between.
#[test]
fn every_kind_of_motion_counts_once() {
    let run = |polled: bool| {
        let mut robot = scara();
        let pass = |robot: &mut Robot, ms: u64| {
            for _ in 0..ms / 10 {
                robot.advance_ms(10);
                if polled {
                    maintenance(robot);
                }
            }
        };
        robot.load(
            "TEST",
            "PROGRAM T\nPASS = 50\nMOVE A\nMOVES B\nMOVE C\nMOVEJ A, POINT(30,20,20)\nEND\nDATA\n\
             POINT A=250,100,20,30,0/LEFTY\nPOINT B=250,-100,60,0,0/LEFTY\nPOINT C=200,50,90,0,0/LEFTY\nEND\n",
        );
        robot.command(Port::Ip0, "EC,OVRD 30");
        robot.command(Port::Ip0, "RN");
        pass(&mut robot, 150);
        robot.command(Port::Ip0, "FD");
        pass(&mut robot, 1_000);
        robot.command(Port::Ip0, "FD");
        pass(&mut robot, 200);
        robot.command(Port::Ip0, "EC,BREAK");
        pass(&mut robot, 1_000);
        robot.command(Port::Ip0, "EC,OVRD 60");
        robot.command(Port::Ip0, "RN");
        pass(&mut robot, 10_000);
        robot.command(Port::Ip0, "JG,3 +");
        pass(&mut robot, 100);
        robot.command(Port::Ip0, "JG,3 !");
        pass(&mut robot, 1_000);
        robot
    };
    let (mut alone, mut watched) = (run(false), run(true));
    let read = maintenance(&mut alone);
    assert_eq!(read, maintenance(&mut watched), "it does not depend on who asks");
    // Axis 3 goes from 0 over 20 and 60 to 90, up to 120, down to 20; then as far as it was jogged.
    let joints = crate::extensions::values(&mut alone, "PR,0");
    let jogged = joints[2] - 20.0;
    assert!(jogged > 1.0, "{joints:?}");
    close(read[2][2], 120.0 + 100.0 + jogged, "axis 3");
}

// clause: S29
#[test]
fn times_and_counts_are_those_of_the_states_and_survive_a_power_cycle() {
    let mut robot = six_axis();
    robot.advance_ms(6 * 60_000);
    robot.command(Port::Ip0, "BR");
    robot.advance_ms(6 * 60_000);
    robot.panel(PanelAction::EmergencyStop(true));
    robot.advance_ms(12 * 60_000);
    robot.panel(PanelAction::EmergencyStop(false));
    robot.panel(PanelAction::AlarmReset);
    robot.command(Port::Ip0, "SO");
    order(&mut robot, "MOVEA 1, 90");
    robot.advance_ms(5 * 60_000);
    close(item(&mut robot, 2)[0], 90.0, "before the power went off");
    assert!(item(&mut robot, 9)[0] > 0.0);
    robot.put(Input::by_owner(Action::PowerOff));
    robot.advance_ms(30 * 60_000);
    robot.put(Input::by_owner(Action::PowerOn));
    robot.connect(Port::Ip0);
    robot = Robot::from_controller(round_trip::round_trip(&robot.seat.controller));
    let read = maintenance(&mut robot);
    close(read[10][0], 60.0, "total");
    close(read[11][0], 30.0, "energising");
    close(read[12][0], 30.0, "power off");
    close(read[13][0], (90.0 / 240.0 + 0.25) / 60.0, "motion");
    close(read[14][0], 12.0, "fault");
    close(read[15][0], 2.0, "BR and the power");
    close(read[16][0], 12.0, "servo on");
    close(read[2][0], 90.0, "in total");
    close(read[9][0], 0.0, "no torque before the power came on");
    robot.command(Port::Ip0, "SO");
    order(&mut robot, "MOVEA 1, 0");
    close(item(&mut robot, 2)[0], 180.0, "in total");
    assert!(item(&mut robot, 9)[0] > 0.0);
}

#[test]
fn a_locked_machine_wears_nothing() {
    let mut robot = six_axis();
    robot.panel(PanelAction::MachineLock(true));
    order(&mut robot, "MOVEA 1, 100");
    let read = maintenance(&mut robot);
    for number in (1..=9).filter(|number| *number != 5).chain([17]) {
        assert_eq!(read[number], [0.0; MN_AXES], "{number}");
    }
    close(read[13][0], 0.0, "motion time");
}

/// The torque is that of the acceleration: 100 % in a ramp, 50 % with half of it, none at speed and at rest.
// clause: S28 S72 T4
#[test]
fn the_current_position_file_shows_joints_line_and_torques_of_the_motion() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 1.0\nMOVEA 1, 100.9 WITH DECEL=50\nDELAY 9.0\nEND\n");
    let at_rest = robot.seat.controller.current_position();
    assert_eq!(at_rest.joints, [0, 10, 130, 0, 40, 0]);
    robot.command(Port::Ip0, "RN");
    let mut shown = |ms: u64| {
        robot.advance_ms(ms);
        let position = CurrentPosition::decode(&robot.file(Port::Ip0, "PS")).unwrap();
        assert_eq!(position, robot.seat.controller.current_position());
        assert_eq!(position.measured, position.joints);
        assert_eq!(position.torques[1..], [0; 5]);
        (
            position.status,
            position.line,
            position.joints[0],
            position.torques[0],
        )
    };
    let running = ExecutionStatus::Running;
    // 0.25 s up to 240 degrees/s, 30 degrees; the last 60 in 0.5 s, from 0.295 s on.
    assert_eq!(shown(1_100), (running, 3, 4, 100));
    assert_eq!(shown(170), (running, 3, 34, 0));
    assert_eq!(shown(100), (running, 3, 57, 50));
    assert_eq!(shown(2_000), (running, 4, 100, 0), "the integer part");
}
