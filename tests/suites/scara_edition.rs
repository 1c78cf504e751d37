//! What the SCARA edition of the communication manual (STE 80722) states beyond the six-axis edition, for SCARA arms.
//!
//! Its commands (SM, IO, WD ...) are in `extensions.rs`.

use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect, PanelAction, Port};
use ts3100_tests::Robot;

fn scara(dialect: Dialect) -> Robot {
    let mut robot = Robot::with(Config {
        model: ArmModel::thl400(),
        ..Config::new(dialect)
    });
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

/// What the SCARA edition of the manual prints, with operands it refuses.
const PRINTED: [(&str, &[&str]); 8] = [
    ("SM,1", &["SM", "SM,0", "SM,2"]),
    ("IO,1", &["IO", "IO,0", "IO,2"]),
    ("WD,700 2", &["WD,700 4", "WD,100000 2", "WD,-1 2"]),
    ("PR,5", &["PR,6"]),
    ("VL,1", &["VL,2"]),
    (
        "HI,1 32",
        &["HI,1 33", "HI,1 0", "HI,65 1", "HI,365 1", "HI,465 1"],
    ),
    ("AC", &["AC,1"]),
    ("AH", &["AH,1"]),
];

// clause: S6 S10 S11 S12 S13 S14
#[test]
fn on_a_scara_the_commands_of_its_manual_are_served_in_both_dialects() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        for (command, wrong) in PRINTED {
            let answer = robot.ask(Port::Ip0, command);
            assert!(answer == b"OK\r" || answer.starts_with(b"FL,"), "{command}");
            robot.send(Port::Ip0, b"OK\r");
            assert_eq!(robot.received(Port::Ip0), b"", "{command}: one text");
            for command in wrong {
                assert_eq!(robot.ask(Port::Ip0, command), b"NG\r", "{command}");
            }
        }
        for command in ["HO,1 8 165", "MD,1", "RT,2", "SC,3", "JG,1 +", "RS,ERR"] {
            let served = robot.ask(Port::Ip0, command) == b"OK\r";
            assert_eq!(served, dialect == Dialect::Field, "{command}");
        }
    }
}

// clause: S4 S23
#[test]
fn sf_of_a_scara_fills_one_text_in_both_dialects() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        robot.raw(Port::Ip0, b"\x02SF\r\x03");
        let text = robot.received(Port::Ip0);
        assert_eq!(text.len(), 255, "from STX through ETX");
        assert!(text.starts_with(b"\x02FL,") && text.ends_with(b"\x00\x00\x03"));
        robot.send(Port::Ip0, b"OK\r");
        assert_eq!(robot.received(Port::Ip0), b"");
        assert_eq!(robot.total(Port::Ip0), text[4..254]);
    }
}

/// Of the last 0.001 % of this motion the arm needs more than a scan.
#[test]
fn motion_is_100_when_the_arm_has_arrived_and_not_before() {
    for wait in ["MOTION >= 100", "MOTION == 100", "REMAIN <= 0"] {
        let mut robot = scara(Dialect::Field);
        robot.connect(Port::Ip1);
        let program = format!(
            "PROGRAM T\nENABLE NOWAIT\nMOVEA 1, 100.0 WITH DECEL=1\nWAIT {wait}\nPRINT IP1, REMAINT, MOTION, REMAIN\nEND\n"
        );
        robot.load("TEST", &program);
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(60_000);
        let printed = String::from_utf8(robot.received(Port::Ip1)).unwrap();
        let numbers: Vec<&str> = printed.split_whitespace().collect();
        assert_eq!(numbers, ["0.000", "100.000", "0.000"], "{wait}");
    }
}
