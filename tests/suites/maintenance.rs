//! The maintenance information of MN (S29): every number is counted in virtual time and survives a power cycle and a
//! snapshot.
//!
//! The layout of the answer has unit tests in `ts3100-proto`.

use crate::extensions::{scara, scara_of, six_axis};
use ts3100_controller::action::Action;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect, Input, PanelAction, Port};
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::mn::Maintenance;
use ts3100_proto::status::position::CurrentPosition;
use ts3100_tests::{Robot, round_trip};

/// Half a unit of the only decimal.
const ROUNDING: f64 = 0.05 + 1e-9;

fn maintenance(robot: &mut Robot) -> Maintenance {
    Maintenance::decode(&robot.file(Port::Ip0, "MN")).unwrap()
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

// clause: S29
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
                maintenance(&mut robot);
            } else {
                assert_eq!(robot.ask(Port::Ip0, "MN"), b"NG\r");
            }
        }
    }
}

/// Axis 1 of the six-axis arm: 240 degrees/s, 960 degrees/s². From 0 to 100 degrees and back: 0.25 s of full
/// acceleration four times, and 2/3 s each way.
// clause: S29
#[test]
fn ways_and_torques_are_those_of_the_motions() {
    let mut robot = six_axis();
    let before = maintenance(&mut robot);
    assert_eq!(before.axes, Maintenance::default().axes);
    order(&mut robot, "MOVEA 1, 100");
    order(&mut robot, "MOVEA 1, 0");
    let read = maintenance(&mut robot);
    for (first, half) in [(0, 5), (1, 6), (2, 7), (3, 8), (4, 9)] {
        assert_eq!(read.axes[first], read.axes[half], "nothing came before the power");
    }
    close(read.axes[0][0], 200.0 / 360.0, "revolutions");
    close(read.axes[1][0], 200.0, "degrees");
    close(read.axes[2][0], 100.0, "percent times seconds: 1 s at 100 %");
    close(read.axes[3][0], 100.0, "peak");
    close(
        read.axes[4][0],
        100.0 * (1.0_f64 / (4.0 / 3.0)).sqrt(),
        "effective",
    );
    for item in read.axes {
        assert_eq!(item[1..], [0.0; 5], "the other axes stood");
    }
    close(read.information[3], 4.0 / 3.0 / 60.0, "motion time");
    // At half the acceleration the way is over before the full speed is reached.
    order(&mut robot, "MOVEA 1, 100 WITH ACCEL=50, DECEL=50");
    let after = maintenance(&mut robot);
    close(
        after.axes[2][0],
        100.0 + 100.0 * (100.0_f64 / 480.0).sqrt(),
        "50 % all the way",
    );
    close(after.axes[3][0], 100.0, "the highest stays");
}

// clause: S29
#[test]
fn an_axis_that_slides_moves_and_does_not_turn() {
    for model in [ArmModel::thl400(), ArmModel::thl400_four_axes()] {
        let mut robot = scara_of(model);
        order(&mut robot, "MOVEA 3, 100");
        let read = maintenance(&mut robot);
        close(read.axes[1][2], 100.0, "mm");
        assert!(
            read.axes[0][2] == 0.0 && read.axes[2][2] > 10.0,
            "{:?}",
            read.axes
        );
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
            "PROGRAM T\nPASS = 50\nMOVE A\nMOVES B\nMOVE C\nMOVEJ A, POINT(20,30,20)\nEND\nDATA\n\
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
    close(read.axes[1][2], 120.0 + 100.0 + jogged, "axis 3");
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
    let of_axis = maintenance(&mut robot).axes[1][0];
    close(of_axis, 90.0, "before the power went off");
    robot.put(Input::Action(Action::PowerOff));
    robot.advance_ms(30 * 60_000);
    robot.put(Input::Action(Action::PowerOn));
    robot.connect(Port::Ip0);
    robot = Robot::from_controller(round_trip::round_trip(&robot.cell.controller));
    let read = maintenance(&mut robot);
    let [total, energised, off, motion, fault, servo_offs, servo] = read.information;
    close(total, 60.0, "total");
    close(energised, 30.0, "energising");
    close(off, 30.0, "power off");
    close(motion, (90.0 / 240.0 + 0.25) / 60.0, "motion");
    close(fault, 12.0, "fault");
    close(servo_offs, 2.0, "BR and the power");
    close(servo, 12.0, "servo on");
    close(read.axes[1][0], 90.0, "in total");
    close(read.axes[6][0], 0.0, "since the power came on");
    robot.command(Port::Ip0, "SO");
    order(&mut robot, "MOVEA 1, 0");
    let read = maintenance(&mut robot);
    close(read.axes[1][0], 180.0, "in total");
    close(read.axes[6][0], 90.0, "since the power came on");
}

#[test]
fn a_locked_machine_wears_nothing() {
    let mut robot = six_axis();
    robot.panel(PanelAction::MachineLock(true));
    order(&mut robot, "MOVEA 1, 100");
    let read = maintenance(&mut robot);
    assert_eq!(read.axes, Maintenance::default().axes);
    close(read.information[3], 0.0, "motion time");
}

/// The torque is that of the acceleration: 100 % in a ramp, 50 % with half of it, none at speed and at rest.
// clause: S28
#[test]
fn the_current_position_file_shows_joints_line_and_torques_of_the_motion() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 1.0\nMOVEA 1, 100.9 WITH DECEL=50\nDELAY 9.0\nEND\n");
    let at_rest = robot.cell.controller.current_position();
    assert_eq!(at_rest.joints, [0, 10, 130, 0, 40, 0]);
    robot.command(Port::Ip0, "RN");
    let mut shown = |ms: u64| {
        robot.advance_ms(ms);
        let position = robot.cell.controller.current_position();
        assert_eq!(CurrentPosition::decode(&position.encode()), Ok(position));
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
