//! A SCARA arm without axis T, end to end: its positions, what SF and PR show, and what it refuses.
//!
//! The arm with axis T is in `scara_edition.rs` and `extensions.rs`.

use crate::extensions::{scara_of, values};
use ts3100_controller::Port;
use ts3100_controller::model::ArmModel;
use ts3100_tests::Robot;

const JOINTS: usize = 116;

fn four_axes() -> Robot {
    let mut robot = scara_of(ArmModel::thl400_four_axes());
    robot.load(
        "TEST",
        "PROGRAM T\nMOVE A\nEND\nDATA\nPOINT A=250,100,20,30,0/LEFTY\nPOINT B=250,100,20,30,5/LEFTY\nEND\n",
    );
    robot
}

/// The six joint values of SF, requested from a copy.
fn joints(robot: &Robot) -> [f32; 6] {
    let body = robot.clone().total(Port::Ip0);
    assert_eq!(body.len(), 250);
    [0, 1, 2, 3, 4, 5].map(|axis| {
        let at = JOINTS + 4 * axis;
        f32::from_be_bytes(body[at..at + 4].try_into().unwrap())
    })
}

fn order(robot: &mut Robot, statement: &str) {
    robot.command(Port::Ip0, &format!("DO,{statement}"));
    robot.advance_ms(5_000);
}

// clause: SF-42 DATA-01
#[test]
fn its_positions_are_reached_and_shown_with_a_t_of_0() {
    let mut robot = four_axes();
    order(&mut robot, "MOVE A");
    assert_eq!(robot.alarms(), Vec::<String>::new());
    for statement in [
        "MOVES POINT(300,50,10,45,0,1)",
        "MOVE POINT(300,50,10,45,0,LEFTY)",
    ] {
        order(&mut robot, statement);
        let joints = joints(&robot);
        assert_eq!(joints[4..], [0.0, 0.0], "{joints:?}");
        assert!(
            (joints[0] + joints[1] + joints[3] - 45.0).abs() < 1e-3,
            "{joints:?}"
        );
        let world = values(&mut robot, "PR,2");
        for (found, expected) in world.iter().zip([300.0, 50.0, 10.0, 45.0, 0.0]) {
            assert!((found - expected).abs() < 1e-3, "{world:?}");
        }
    }
    assert_eq!(robot.alarms(), Vec::<String>::new());
}

// clause: DATA-01
#[test]
fn what_needs_a_fifth_axis_is_refused_with_words_and_the_arm_stays() {
    for statement in [
        "MOVE B",
        "MOVES B",
        "MOVE POINT(250,100,20,30,5)",
        "MOVEA 5,10",
        "MOVEI 5,0",
    ] {
        let mut robot = four_axes();
        order(&mut robot, "MOVE A");
        let before = joints(&robot);
        order(&mut robot, statement);
        assert_eq!(robot.alarms(), ["8-035"], "{statement}");
        assert_eq!(joints(&robot), before, "{statement}");
    }
    let mut robot = four_axes();
    assert_eq!(robot.ask(Port::Ip0, "JG,5 +"), b"NG\r");
    assert_eq!(robot.ask(Port::Ip0, "JG,4 +"), b"OK\r");
}
