//! ACCEL and DECEL from 1 to 100000 percent (T15): what is accepted where, how the arm moves, and what is told of it.
//!
//! How a motion follows its acceleration is in `motion.rs`; SPEED, which ends at 100, is beside them in `BOUNDS`.

use ts3100_controller::Port;
use ts3100_controller::findings::rules;
use ts3100_tests::Robot;
use ts3100_tests::round_trip::round_trip;

/// Values on both sides of each bound.
const BOUNDS: &[(&str, &str, bool)] = &[
    ("ACCEL", "0.999", false),
    ("ACCEL", "1", true),
    ("ACCEL", "150.000", true),
    ("ACCEL", "100000", true),
    ("ACCEL", "100000.1", false),
    ("DECEL", "0.5", false),
    ("DECEL", "1", true),
    ("DECEL", "100000", true),
    ("DECEL", "100001", false),
    ("SPEED", "100", true),
    ("SPEED", "100.1", false),
];

/// Alarms of a program of one statement.
fn alarms_of(statement: &str) -> Vec<String> {
    let mut robot = Robot::ready(&format!("PROGRAM T\n{statement}\nEND\n"));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(20_000);
    robot.alarms()
}

// clause: T15 L72 K5
#[test]
fn accel_and_decel_are_1_to_100000_in_with_as_a_condition_and_in_do() {
    for (name, value, fits) in BOUNDS {
        let expected: &[&str] = if *fits { &[] } else { &["2-104"] };
        assert_eq!(
            alarms_of(&format!("{name} = {value}")),
            expected,
            "{name} {value}"
        );
        let with = format!("MOVEA 1, 5 WITH {name}={value}");
        assert_eq!(alarms_of(&with), expected, "{with}");
        for statement in [format!("{name}={value}"), with] {
            let mut robot = Robot::ready("PROGRAM T\nEND\n");
            robot.command(Port::Ip0, &format!("DO,{statement}"));
            robot.advance_ms(20_000);
            assert_eq!(robot.alarms(), expected, "DO,{statement}");
        }
    }
}

/// How long a motion takes, in ms, behind a preparation.
fn time_of(before: &str, with: &str) -> u32 {
    let mut robot = Robot::ready(&format!(
        "PROGRAM T\n{before}\nMOVEA 1, 40 WITH {with}\nEND\nDATA\nPAYLOAD HEAVY={{2,0}}\nEND\n"
    ));
    robot.command(Port::Ip0, "RN");
    let mut millis = 0;
    while robot.seat.controller.is_arm_moving() {
        robot.advance_ms(1);
        millis += 1;
    }
    assert!(millis > 100 && robot.alarms().is_empty(), "{before} {with}");
    millis
}

// clause: T15 L72
#[test]
fn above_100_the_arm_moves_as_with_100() {
    for before in ["", "PAYLOAD=HEAVY"] {
        let full = time_of(before, "ACCEL=100, DECEL=100");
        assert!(
            time_of(before, "ACCEL=99, DECEL=100") > full,
            "{before}: 100 is not slower"
        );
        assert!(
            time_of(before, "ACCEL=100, DECEL=99") > full,
            "{before}: 100 is not slower"
        );
        for with in ["ACCEL=150", "DECEL=150", "ACCEL=100000, DECEL=100000"] {
            assert_eq!(time_of(before, with), full, "{before} {with}");
        }
    }
}

/// Findings of a program that has ended.
fn findings_of(body: &str) -> u64 {
    let mut robot = Robot::ready(&format!("PROGRAM T\n{body}\nEND\n"));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(60_000);
    assert_eq!(robot.alarms(), [""; 0], "{body}");
    robot.findings.count(&rules::ACCEL_OVER_FULL)
}

// clause: T15 T27
#[test]
fn each_statement_executed_with_more_than_100_is_one_finding() {
    for (body, expected) in [
        ("ACCEL = 100\nDECEL = 100\nMOVEA 1, 5 WITH ACCEL=100", 0),
        ("ACCEL = 100.5", 1),
        ("ACCEL = 150\nDECEL = 150", 2),
        ("MOVEA 1, 5 WITH ACCEL=150, DECEL=200", 1),
        // The statement that set it was told of.
        ("ACCEL = 150\nMOVEA 1, 5\nMOVEA 1, 10", 1),
        ("FOR I = 1 TO 3\nMOVEA 1, I WITH ACCEL=150\nNEXT I", 3),
        ("FOR I = 1 TO 3\nDECEL = 150\nNEXT I", 3),
    ] {
        assert_eq!(findings_of(body), expected, "{body}");
    }
    let mut robot = Robot::ready("PROGRAM T\nEND\n");
    robot.command(Port::Ip0, "DO,ACCEL=150");
    robot.advance_ms(1_000);
    robot.command(Port::Ip0, "DO,MOVEA 1,5 WITH ACCEL=150.000");
    robot.advance_ms(1_000);
    assert_eq!(robot.findings.count(&rules::ACCEL_OVER_FULL), 2);
}

// clause: T15
#[test]
fn a_snapshot_keeps_an_acceleration_above_100() {
    let mut robot =
        Robot::ready("GLOBAL\nX = 0.0\nEND\nPROGRAM T\nACCEL = 100000\nDELAY 1\nX = ACCEL\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(500);
    robot.seat.controller = round_trip(&robot.seat.controller);
    robot.advance_ms(1_000);
    assert_eq!(robot.ask(Port::Ip0, "MR,X 1"), b"FL,100000.000\r\x1A");
}
