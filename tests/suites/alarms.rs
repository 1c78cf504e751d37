//! The numbers of alarms (decision T8): which number a cause has, on both kinds of arm and in both dialects, and that
//! faults and conditions name the number that replaces an old one. `control`, `binary` and the tests of scenarios do the
//! same for the other places.
//!
//! What an alarm of each level does is in `motion` and `status`; the page of alarms is compared in `docs`.

use std::str::FromStr;
use ts3100_controller::alarm::ALARMS;
use ts3100_controller::faults::{Fault, FaultAction};
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::OutOfReach;
use ts3100_controller::{Action, Condition, Config, Dialect, Input, KeySwitch, Options, PanelAction, Port};
use ts3100_proto::status::AlarmLevel;
use ts3100_proto::status::sf::alarm_word;
use ts3100_tests::{Robot, unframe};

const DIALECTS: [Dialect; 2] = [Dialect::Field, Dialect::Manual];

/// Both kinds of arm, and the SCARA without axis T.
fn arms() -> [ArmModel; 3] {
    [
        ArmModel::tv800(),
        ArmModel::thl400(),
        ArmModel::thl400_four_axes(),
    ]
}

/// A controller with a host on IP0 and servo on.
fn robot(dialect: Dialect, model: ArmModel, change: impl FnOnce(&mut Options)) -> Robot {
    let mut config = Config {
        model,
        ..Config::new(dialect)
    };
    change(&mut config.options);
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

fn field(model: ArmModel) -> Robot {
    robot(Dialect::Field, model, |_| {})
}

/// Servo power and motion status of SF.
fn servo_and_status(robot: &mut Robot) -> [u8; 2] {
    let body = robot.total(Port::Ip0);
    [body[0], body[2]]
}

/// The alarms of one statement of DO.
fn alarms_of(mut robot: Robot, statement: &str) -> Vec<String> {
    robot.command(Port::Ip0, &format!("DO,{statement}"));
    robot.advance_ms(10_000);
    robot.alarms()
}

/// Raises an alarm as a test does.
fn raise(robot: &mut Robot, number: &str) {
    let (number, detail) = (number.to_owned(), String::new());
    robot.feed(Input::by_owner(Action::RaiseAlarm { number, detail }));
}

// clause: T8 T27 I17-035
#[test]
fn a_target_out_of_reach_turns_servo_power_off_and_a_do_leaves_the_status() {
    for dialect in DIALECTS {
        for model in arms() {
            for (reading, number, servo) in [
                (None, "8-035", 0),
                (Some(OutOfReach::Level8), "8-035", 0),
                (Some(OutOfReach::Level4), "4-101", 1),
            ] {
                let case = format!("{dialect:?} {} {reading:?}", model.name);
                let mut robot = robot(dialect, model.clone(), |options| {
                    options.out_of_reach = reading.unwrap_or(options.out_of_reach);
                });
                robot.load(
                    "TEST",
                    "PROGRAM TEST\nDELAY 0.5\nMOVE POINT(9000,0,0)\nDELAY 1\nEND\n",
                );
                robot.command(Port::Ip0, "DO,MOVE POINT(9000,0,0)");
                robot.advance_ms(1_000);
                assert_eq!(robot.alarms(), [number], "{case}");
                assert_eq!(servo_and_status(&mut robot), [servo, 0], "{case}: stop (reset)");
                let answer: &[u8] = if servo == 0 { b"NG\r" } else { b"OK\r" };
                assert_eq!(robot.ask(Port::Ip0, "SO"), answer, "{case}");
                robot.panel(PanelAction::AlarmReset);
                robot.command(Port::Ip0, "SO");
                robot.command(Port::Ip0, "RN");
                robot.advance_ms(1_000);
                assert_eq!(robot.alarms(), [number, number], "{case}");
                assert_eq!(servo_and_status(&mut robot), [servo, 2], "{case}: stop (retry)");
            }
        }
    }
}

// clause: T8 I17-034
#[test]
fn a_singular_posture_has_the_number_of_its_option() {
    for dialect in DIALECTS {
        for (reading, number) in [(OutOfReach::Level8, "8-034"), (OutOfReach::Level4, "4-103")] {
            let mut robot = robot(dialect, ArmModel::tv800(), |options| {
                options.out_of_reach = reading;
            });
            robot.command(Port::Ip0, "DO,MOVE POINT(437,0,123)");
            robot.advance_ms(5_000);
            assert!(robot.alarms().is_empty());
            assert_eq!(
                alarms_of(robot, "MOVES POINT(237,0,123)"),
                [number],
                "{dialect:?}"
            );
        }
    }
}

// clause: T8 T27
#[test]
fn an_axis_limit_and_an_axis_that_the_arm_lacks_are_out_of_reach() {
    let none: [&str; 0] = [];
    for (model, statement, expected) in [
        (ArmModel::tv800(), "MOVEA 1, 190", &none[..]),
        (ArmModel::tv800(), "MOVEA 1, 190.1", &["8-035"]),
        (ArmModel::thl400(), "MOVEA 3, 150", &none),
        (ArmModel::thl400(), "MOVEA 3, 150.1", &["8-035"]),
        (ArmModel::tv800(), "MOVEA 7, 0", &["8-035"]),
        (ArmModel::tv800(), "MOVE POINT(400,0,300,0,0,0,0,0)", &none),
        (ArmModel::tv800(), "MOVE POINT(400,0,300,0,0,0,1,0)", &["8-035"]),
        (ArmModel::tv800(), "MOVE POINT(400,0,300,0,0,0,0,1)", &["8-035"]),
        (ArmModel::thl400(), "MOVE POINT(250,100,20,30,5)", &none),
        (ArmModel::thl400_four_axes(), "MOVE POINT(250,100,20,30,0)", &none),
        (
            ArmModel::thl400_four_axes(),
            "MOVE POINT(250,100,20,30,5)",
            &["8-035"],
        ),
    ] {
        let name = model.name.clone();
        assert_eq!(
            alarms_of(field(model), statement),
            expected,
            "{name}: {statement}"
        );
    }
}

// clause: T8 T27
#[test]
fn an_arch_is_checked_for_its_distances_before_its_reach() {
    let end = "MOVEJ POINT(250,100,0,0,0)";
    for (distances, expected) in [
        ("POINT(20,20,20)", &[][..]),
        // Axis 3 goes to 150 mm.
        ("POINT(200,200,200)", &["8-035"]),
        ("POINT(20,-1,20)", &["2-104"]),
        ("POINT(200,200,-1)", &["2-104"]),
    ] {
        let found = alarms_of(field(ArmModel::thl400()), &format!("{end} {distances}"));
        assert_eq!(found, expected, "{distances}");
    }
}

// clause: T27
#[test]
fn a_jog_that_comes_to_a_limit_raises_no_alarm() {
    for model in arms() {
        let mut robot = field(model);
        robot.command(Port::Ip0, "RT,2");
        robot.command(Port::Ip0, "JG,1 +");
        robot.advance_ms(60_000);
        assert!(robot.alarms().is_empty());
        assert_eq!(servo_and_status(&mut robot)[0], 1);
    }
}

// clause: T8 I17-rest I17-561
#[test]
fn every_number_of_the_table_is_raised_by_hand_and_by_a_fault() {
    for row in ALARMS {
        let number = row.number();
        let mut by_hand = field(ArmModel::tv800());
        raise(&mut by_hand, &number);
        let mut by_fault = field(ArmModel::tv800());
        let fault = format!("alarm:command=CA,number={number}").parse().unwrap();
        by_fault.feed(FaultAction::Arm(Box::new(fault)).into());
        by_fault.file(Port::Ip0, "CA");
        let word = alarm_word(row.level, row.code).unwrap();
        for robot in [&mut by_hand, &mut by_fault] {
            assert_eq!(robot.alarms(), [number.as_str()]);
            let body = robot.total(Port::Ip0);
            assert_eq!(body[4..6], word.to_be_bytes(), "{number}");
            assert_eq!(body[0], u8::from(row.level != AlarmLevel::L8), "{number}");
        }
    }
}

// clause: T8 T27
#[test]
fn faults_and_conditions_name_the_number_that_replaces_an_old_one() {
    for (old, new) in [("8-027", "8-014"), ("8-203", "8-017"), ("8-204", "8-026")] {
        let expected = format!("expected {new}, which replaces {old}, found `{old}`");
        let mut robot = field(ArmModel::tv800());
        raise(&mut robot, old);
        assert!(robot.alarms().is_empty());
        for (place, message) in [
            (
                "a fault",
                Fault::from_str(&format!("alarm:number={old}"))
                    .unwrap_err()
                    .to_string(),
            ),
            (
                "a condition",
                Condition::from_str(&format!("alarm {old}"))
                    .unwrap_err()
                    .to_string(),
            ),
        ] {
            assert!(message.contains(&expected), "{place}: {message}");
        }
    }
}

// clause: I14 T8
#[test]
fn an_open_safety_switch_is_shown_by_ac_until_it_is_closed_and_reset() {
    for model in arms() {
        let mut robot = field(model);
        robot.panel(PanelAction::SafetySwitch(true));
        assert_eq!(servo_and_status(&mut robot)[0], 0);
        let shown = "1,008-017,Safety SW ON,";
        let list = |robot: &mut Robot| String::from_utf8(robot.file(Port::Ip0, "AC")).unwrap();
        assert!(list(&mut robot).starts_with(shown));
        robot.command(Port::Ip0, "RS,ERR");
        assert!(list(&mut robot).starts_with(shown), "its cause lasts");
        robot.panel(PanelAction::SafetySwitch(false));
        assert!(list(&mut robot).starts_with(shown), "until it is reset");
        robot.command(Port::Ip0, "RS,ERR");
        assert_eq!(list(&mut robot), "0");
        robot.command(Port::Ip0, "SO");
    }
}

// clause: T27
#[test]
fn in_teaching_the_panel_resets_the_alarm_of_the_safety_switch() {
    let mut robot = field(ArmModel::tv800());
    robot.panel(PanelAction::Key(KeySwitch::Teaching));
    robot.panel(PanelAction::SafetySwitch(true));
    robot.panel(PanelAction::SafetySwitch(false));
    let word = |robot: &mut Robot| robot.total(Port::Ip0)[4..6].to_vec();
    assert_eq!(robot.ask(Port::Ip0, "RS,ERR"), b"NG\r");
    assert_eq!(word(&mut robot), [0, 16], "8-017");
    robot.panel(PanelAction::AlarmReset);
    assert_eq!(word(&mut robot), [0xFF, 0xFF]);
}

// clause: L35 I15
#[test]
fn the_emergency_stop_is_8_014_on_both_kinds_of_arm() {
    for dialect in DIALECTS {
        for model in arms() {
            let mut robot = robot(dialect, model, |_| {});
            robot.panel(PanelAction::EmergencyStop(true));
            assert_eq!(robot.alarms(), ["8-014"]);
            robot.received(Port::Ip0);
            robot.send(Port::Ip0, b"EU\r");
            let answer = unframe(&robot.received(Port::Ip0)).unwrap();
            assert!(answer.starts_with(b"FL,1\r008-014 "), "{answer:02x?}");
        }
    }
}
