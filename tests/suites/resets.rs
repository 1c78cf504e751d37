//! RS,STP and RS,CYC in both dialects and on both kinds of arm: where the program stands afterwards, and what its variables
//! hold.
//!
//! The other resets are in the transcripts, resets by the system inputs in `signals.rs`, files that were downloaded again in
//! `variables.rs`.

use crate::extensions::text;
use ts3100_controller::model::ArmModel;
use ts3100_controller::options::CycleWithoutLabel;
use ts3100_controller::{Config, Dialect, PanelAction, Port};
use ts3100_tests::Robot;

/// Both dialects on both kinds of arm.
fn configs() -> impl Iterator<Item = Config> {
    let dialects = [Dialect::Field, Dialect::Manual].into_iter();
    dialects.flat_map(|dialect| {
        [ArmModel::tv800(), ArmModel::thl400()].map(|model| Config {
            model,
            ..Config::new(dialect)
        })
    })
}

/// A host on IP0, servo on.
fn robot_of(config: Config) -> Robot {
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

/// The last item of SU; the manual dialect has a blank in it.
fn status(robot: &mut Robot) -> String {
    let su = text(robot, "SU");
    su.rsplit_once(':').unwrap().1.replace([' ', '\r'], "")
}

fn number(robot: &mut Robot, name: &str) -> String {
    text(robot, &format!("MR,{name} 0")).trim().to_string()
}

/// Runs for so long, and forgets what was sent to the host unasked.
fn run_for(robot: &mut Robot, millis: u64) {
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(millis);
    robot.received(Port::Ip0);
}

/// Stops the program after its present statement.
fn stop(robot: &mut Robot) {
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(1_000);
    robot.received(Port::Ip0);
}

/// Rising edge of CYC_RST.
fn cycle_reset_by_signal(robot: &mut Robot) {
    robot.panel(PanelAction::InputLine { line: 252, on: true });
    robot.panel(PanelAction::InputLine { line: 252, on: false });
}

/// N counts how often step 1 was executed, M what follows the pause.
fn counting(label: &str) -> String {
    format!(
        "GLOBAL\nN = 0\nM = 0\nEND\nPROGRAM TEST\nN = N + 1\nDELAY 1.0\n{label}M = M + 1\nDELAY 1.0\nEND\n"
    )
}

/// A program that SP has stopped in its first pause.
fn stopped(config: Config, label: &str) -> Robot {
    let mut robot = robot_of(config);
    robot.load("TEST", &counting(label));
    run_for(&mut robot, 200);
    stop(&mut robot);
    assert_eq!(status(&mut robot), "stop(continue)");
    robot
}

// clause: T19 CMD-RS-06
#[test]
fn rs_cyc_without_a_label_acts_as_rs_stp_or_is_refused() {
    for preset in configs() {
        let by_default = preset.options.cycle_without_label;
        for rule in [by_default, CycleWithoutLabel::AsStep, CycleWithoutLabel::Ng] {
            let mut config = preset.clone();
            config.options.cycle_without_label = rule;
            let (answer, place, again) = match rule {
                CycleWithoutLabel::AsStep => (b"OK\r", "stop(reset)", ["2", "0"]),
                CycleWithoutLabel::Ng => (b"NG\r", "stop(continue)", ["1", "1"]),
            };
            let mut robot = stopped(config.clone(), "");
            assert_eq!(robot.ask(Port::Ip0, "RS,CYC"), answer, "{config:?}");
            assert_eq!(status(&mut robot), place, "{config:?}");
            assert_eq!(number(&mut robot, "N"), "1", "variables stay");
            run_for(&mut robot, 200);
            assert_eq!(
                ["N", "M"].map(|name| number(&mut robot, name)),
                again,
                "{config:?}"
            );
            assert_eq!(robot.ask(Port::Ip0, "RS,CYC"), b"NG\r", "while it runs");

            let mut robot = stopped(config.clone(), "");
            cycle_reset_by_signal(&mut robot);
            assert_eq!(status(&mut robot), place, "by CYC_RST, {config:?}");

            let mut robot = stopped(config.clone(), "RCYCLE:\n");
            assert_eq!(robot.ask(Port::Ip0, "RS,CYC"), b"OK\r", "with the label");
            assert_eq!(status(&mut robot), "stop(continue)", "{config:?}");
            run_for(&mut robot, 200);
            assert_eq!(["N", "M"].map(|name| number(&mut robot, name)), ["1", "1"]);
        }
    }
}

// clause: T19 CMD-RS-06
#[test]
fn rs_cyc_without_a_file_acts_as_rs_stp_or_is_refused() {
    for config in configs() {
        let mut robot = robot_of(config.clone());
        let answer = match config.options.cycle_without_label {
            CycleWithoutLabel::AsStep => b"OK\r",
            CycleWithoutLabel::Ng => b"NG\r",
        };
        assert_eq!(robot.ask(Port::Ip0, "RS,STP"), b"OK\r");
        assert_eq!(robot.ask(Port::Ip0, "RS,CYC"), answer, "{config:?}");
        assert_eq!(status(&mut robot), "stop(reset)");
    }
}

// clause: T19 CMD-RS-06
#[test]
fn rs_cyc_acts_as_rs_stp_in_the_field_dialect_alone() {
    let rules: Vec<_> = configs()
        .map(|config| config.options.cycle_without_label)
        .collect();
    let (field, manual) = (CycleWithoutLabel::AsStep, CycleWithoutLabel::Ng);
    assert_eq!(rules, [field, field, manual, manual]);
}

/// In a second run R is the N that the first one has assigned. DATA, GLOBAL and a condition change beside it. The label
/// is where RS,CYC continues.
const REMEMBERING: &str = "GLOBAL\nF = 0\nG = 1\nR = 7\nEND\nPROGRAM TEST\nIF F == 1 THEN GOTO RCYCLE\nN = 5\nWORK = W\n\
    G = 2\nD.X = 9.0\nF = 1\nSUB\nG = 9\nRCYCLE:\nR = N\nEND\n\
    PROGRAM SUB\nON DIN(9) DO G = 8\nFOR I = 1 TO 3\nINPUT TP, K\nNEXT I\nEND\nDATA\nPOINT D = 1,2,3\nTRANS W = 10\nEND\n";

// clause: T10 L60 L61 S46 CMD-RS-04 CMD-RS-05
#[test]
fn variables_survive_rs_stp_and_rs_cyc_unless_the_option_says_otherwise() {
    for preset in configs() {
        assert!(!preset.options.reset_locals, "both dialects keep them");
        for reset_locals in [false, true] {
            for (command, place) in [("RS,STP", "stop(reset)"), ("RS,CYC", "stop(continue)")] {
                let mut config = preset.clone();
                config.options.reset_locals = reset_locals;
                let case = format!("{command}, {config:?}");
                let mut robot = robot_of(config);
                robot.load("TEST", REMEMBERING);
                run_for(&mut robot, 200);
                assert_eq!(
                    status(&mut robot),
                    "running",
                    "an INPUT in a loop of a subprogram"
                );
                stop(&mut robot);
                robot.command(Port::Ip0, command);
                assert_eq!(status(&mut robot), place, "{case}");
                // The call is over: the main program goes on, not the loop. So are the monitor and the INPUT.
                run_for(&mut robot, 200);
                let (rest, alarms) = match reset_locals {
                    true => ("7", vec!["2-102".to_string()]),
                    false => ("5", Vec::new()),
                };
                assert_eq!(number(&mut robot, "R"), rest, "{case}");
                assert_eq!(robot.alarms(), alarms, "{case}");
                robot.panel(PanelAction::InputLine { line: 9, on: true });
                assert_eq!(number(&mut robot, "G"), "2", "GLOBAL stays, {case}");
                let datum = text(&mut robot, "MR,D 4");
                assert!(datum.trim_start().starts_with('9'), "DATA stays: {datum}");
                assert_eq!(robot.seat.controller.work_name(), "W", "conditions stay, {case}");
            }
        }
    }
}

// clause: T10
#[test]
fn rs_prg_and_sl_reset_variables_with_every_value_of_the_option() {
    for reset_locals in [false, true] {
        for command in ["RS,PRG", "SL,TEST"] {
            let mut config = Config::new(Dialect::Field);
            config.options.reset_locals = reset_locals;
            let mut robot = stopped(config, "");
            assert_eq!(number(&mut robot, "N"), "1");
            robot.command(Port::Ip0, command);
            assert_eq!(number(&mut robot, "N"), "0", "{command}");
        }
    }
}

// clause: T10 T19
#[test]
fn rs_cyc_that_acts_as_rs_stp_resets_variables_as_that_does() {
    for (reset_locals, rest) in [(false, "5"), (true, "7")] {
        let mut config = Config::new(Dialect::Field);
        config.options.reset_locals = reset_locals;
        let mut robot = robot_of(config);
        robot.load("TEST", &REMEMBERING.replace("RCYCLE", "AGAIN"));
        run_for(&mut robot, 200);
        stop(&mut robot);
        robot.command(Port::Ip0, "RS,CYC");
        assert_eq!(status(&mut robot), "stop(reset)");
        run_for(&mut robot, 200);
        assert_eq!(number(&mut robot, "R"), rest);
    }
}

// clause: T10
#[test]
fn a_cycle_that_ends_keeps_variables_with_every_value_of_the_option() {
    for reset_locals in [false, true] {
        let mut config = Config::new(Dialect::Field);
        config.options.reset_locals = reset_locals;
        let mut robot = robot_of(config);
        robot.load(
            "TEST",
            "GLOBAL\nF = 0\nR = 7\nEND\nPROGRAM TEST\nIF F == 1 THEN GOTO L1\nN = 5\nF = 1\nGOTO L2\nL1: R = N\nL2:\nEND\n",
        );
        for rest in ["7", "5"] {
            run_for(&mut robot, 200);
            assert_eq!(number(&mut robot, "R"), rest);
        }
    }
}
