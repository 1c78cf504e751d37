//! Tables 5.3 and 5.4 of both editions of the manual, walked on the wire: every command in five modes on two ports, on both
//! kinds of arm in both dialects, with the robot stopped and with a program running.
//!
//! The tables of [`ts3100_simulation::manual`] were typed from the manuals a second time; the product's own copy is compared with them
//! as well.

use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, ControlRight, Dialect, KeySwitch, PanelAction, Port};
use ts3100_proto::permission::{Edition, Permission, PermissionTable, ProtocolPort};
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_simulation::manual::{MANUAL, tables};
use ts3100_tests::{Robot, notation};

/// The words SU has for the five columns.
const MODES: [&str; 5] = [
    "teaching",
    "internal",
    "external(sig)",
    "external(host)",
    "external(ethernet)",
];

const PROGRAM: &str = "GLOBAL\nA = 10\nEND\nPROGRAM TEST\nWAIT DIN(7)\nGOTO HERE1\nHERE1:\nEND\n";

/// Text sent for a command, and the beginning of its affirmative answer.
pub fn example(letters: &str) -> (&'static str, &'static str) {
    match letters {
        "RN" => ("RN", "OK<CR>"),
        "SP" => ("SP", "OK<CR>"),
        "BR" => ("BR", "OK<CR>"),
        "SO" => ("SO", "OK<CR>"),
        "RS" => ("RS,STP", "OK<CR>"),
        "SL" => ("SL,TEST", "OK<CR>"),
        "UL" => ("UL,TEST", "FL,"),
        "DL" => ("DL,NEW", "OK<CR>"),
        "CA" => ("CA", "FL,"),
        "SU" => ("SU", "FL,"),
        "ER" => ("ER,OLD", "OK<CR>"),
        "EU" => ("EU", "FL,"),
        "EC" => ("EC,OVRD 50", "OK<CR>"),
        "MW" => ("MW,0 A 0 5", "OK<CR>"),
        "FD" => ("FD", "OK<CR>"),
        "SF" => ("SF", "FL,"),
        "MR" => ("MR,A 0", "FL,"),
        "IW" => ("IW,1 1", "OK<CR>"),
        "VR" => ("VR", "FL,"),
        "DO" => ("DO,DOUT(1)", "OK<CR>"),
        "SM" => ("SM,1", "FL,"),
        "AC" => ("AC", "FL,"),
        "AH" => ("AH", "FL,"),
        "IO" => ("IO,1", "FL,"),
        "PR" => ("PR,0", "FL,"),
        "VL" => ("VL,1", "FL,"),
        "MN" => ("MN,1", "FL,"),
        "PS" => ("PS", "FL,"),
        "RM" => ("RM,1", "OK<CR>"),
        "ZC" => ("ZC", "FL,"),
        "EM" => ("EM,2", "OK<CR>"),
        "WD" => ("WD,700 0", "OK<CR>"),
        "HI" => ("HI,1 8", "FL,"),
        "HO" => ("HO,1 8 165", "OK<CR>"),
        "MD" => ("MD,1", "OK<CR>"),
        "RT" => ("RT,2", "OK<CR>"),
        "SC" => ("SC,3", "OK<CR>"),
        "JG" => ("JG,1 +", "OK<CR>"),
        "RS,ERR" => ("RS,ERR", "OK<CR>"),
        other => panic!("no example for {other}"),
    }
}

pub fn prepare(column: usize, running: bool) -> Robot {
    let robot = prepare_with(Config::new(Dialect::Field), column, running);
    let status = String::from_utf8(robot.clone().file(Port::Ip0, "SU")).unwrap();
    assert!(
        status.starts_with(&format!("MODE:{}/", MODES[column])),
        "{status}"
    );
    assert_eq!(status.ends_with("STATUS:running"), running, "{status}");
    robot
}

fn prepare_with(mut config: Config, column: usize, running: bool) -> Robot {
    config.options.serial_pacing = false;
    let mut robot = Robot::with(config);
    robot.load("TEST", PROGRAM);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
        .seat
        .controller
        .put_file("OLD", b"PROGRAM OLD\nEND\n")
        .unwrap();
    robot.connect(Port::Host);
    let key = [KeySwitch::Teaching, KeySwitch::Internal]
        .get(column)
        .copied()
        .unwrap_or(KeySwitch::Ext);
    robot.panel(PanelAction::Key(key));
    let rights = [ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];
    if let Some(right) = column.checked_sub(2).map(|place| rights[place]) {
        robot.panel(PanelAction::ControlRight(right));
    }
    if running {
        robot.panel(PanelAction::Start);
    }
    assert_eq!(
        robot.seat.controller.status() == ExecutionStatus::Running,
        running
    );
    robot
}

/// What the command pages forbid besides the table while a program runs.
fn refused_while_running(letters: &str) -> bool {
    matches!(letters, "RN" | "RS" | "SL" | "DO" | "RS,ERR" | "JG" | "MP" | "EM")
}

// clause: PRM-LEG-01 PRM-LEG-02 PRM-LEG-03 PRM-LEG-06 PRM-LEG-07 CMD-LST-01 GEN-01 CMD-RS-02 CMD-DO-04 CMD-SL-02
// clause: PRM-HOST-RN PRM-HOST-SP PRM-HOST-BR PRM-HOST-SO PRM-HOST-RS PRM-HOST-SL PRM-HOST-UL PRM-HOST-DL
// clause: PRM-HOST-CA PRM-HOST-SU PRM-HOST-ER PRM-HOST-EU PRM-HOST-EC PRM-HOST-MW PRM-HOST-FD PRM-HOST-SF
// clause: PRM-HOST-MR PRM-HOST-IW PRM-HOST-VR PRM-HOST-DO PRM-IP0-RN PRM-IP0-SP PRM-IP0-BR PRM-IP0-SO PRM-IP0-RS PRM-IP0-SL PRM-IP0-UL PRM-IP0-DL
// clause: PRM-IP0-CA PRM-IP0-SU PRM-IP0-ER PRM-IP0-EU PRM-IP0-EC PRM-IP0-MW PRM-IP0-FD PRM-IP0-SF
// clause: PRM-IP0-MR PRM-IP0-IW PRM-IP0-VR PRM-IP0-DO T2 T5 S86-RN S86-RS S86-SL S86-WD S86-HI S86-rest S87 S47 S77 S82 S48-S64
#[test]
fn every_command_in_every_mode_on_both_ports() {
    let mut failures = Vec::new();
    for is_scara in [false, true] {
        for dialect in [Dialect::Field, Dialect::Manual] {
            for column in 0..MODES.len() {
                for running in [false, true] {
                    failures.extend(wrong_answers(is_scara, dialect, column, running));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}\n{}", failures.len(), failures.join("\n"));
}

fn wrong_answers(is_scara: bool, dialect: Dialect, column: usize, running: bool) -> Vec<String> {
    let mut config = Config::new(dialect);
    if is_scara {
        config.model = ArmModel::thl400();
    }
    let prepared = prepare_with(config, column, running);
    let mut failures = Vec::new();
    for (letters, host, ip0) in tables(is_scara, dialect) {
        for (port, row) in [(Port::Host, host), (Port::Ip0, ip0)] {
            let cell = row.split(' ').nth(column).unwrap();
            // A program that runs already is not started once more; whether a valid cell then says OK or NG no manual states.
            if (letters, cell, running) == ("RN", "O", true) {
                continue;
            }
            let valid = cell == "O" || cell == "S" && !running;
            let (text, yes) = match letters {
                "ZS" if is_scara => ("ZS,1 WK1 1.000 2.000 3.000 4.000", "OK<CR>"),
                "MP" if is_scara => ("MP,0 POINT(250,100,-30,20,0,1)", "OK<CR>"),
                "MP" => ("MP,0 POINT(400,0,300,0,0,0,0,0)", "OK<CR>"),
                "ZS" => ("ZS,1 WK1 1.000 2.000 3.000 4.000 5.000 6.000", "OK<CR>"),
                letters => example(letters),
            };
            let expected = if valid && !(running && refused_while_running(letters)) {
                yes
            } else {
                "NG<CR>"
            };
            let answer = notation::write(&prepared.clone().ask(port, text));
            if !answer.starts_with(expected) {
                let state = if running { "running" } else { "stopped" };
                let mode = MODES[column];
                failures.push(format!(
                    "{dialect:?}, SCARA {is_scara}: {port} {text} in {mode}, {state}, {cell}: {expected} expected, {answer}"
                ));
            }
        }
    }
    failures
}

// clause: PRM-LEG-03
#[test]
fn a_refused_command_has_no_effect() {
    for column in 0..4 {
        let mut robot = prepare(column, false);
        robot.panel(PanelAction::Servo(false));
        let before = robot.clone().total(Port::Ip0);
        for command in [
            "SO",
            "RN",
            "RS,SEL",
            "SL,OLD",
            "EC,OVRD 50",
            "EC,MODE STEP",
            "IW,1 1",
            "DO,DOUT(1)",
        ] {
            assert_eq!(robot.ask(Port::Ip0, command), b"NG\r", "{command}");
        }
        assert_eq!(robot.total(Port::Ip0), before);
        let status = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
        assert!(status.contains("/cycle FILE:TEST OVRD:100%"), "{status}");
    }
}

// clause: PRM-LEG-01 PRM-LEG-05
#[test]
fn the_products_copy_of_the_tables_is_the_manuals() {
    let table = PermissionTable::of(Edition::SixAxisPrint);
    let columns = [
        MasterMode::Teaching,
        MasterMode::Internal,
        MasterMode::ExtSig,
        MasterMode::ExtRs232c,
        MasterMode::ExtEther,
    ];
    for (letters, host, ip0) in MANUAL {
        for (port, row) in [(ProtocolPort::Host, host), (ProtocolPort::Ip0, ip0)] {
            for (cell, mode) in row.split(' ').zip(columns) {
                let expected = match cell {
                    "O" => Permission::Valid,
                    "S" => Permission::WhenStopped,
                    _ => Permission::Invalid,
                };
                assert_eq!(
                    table.get(port, letters, mode),
                    Some(expected),
                    "{port:?} {letters} {mode:?}"
                );
            }
        }
    }
    for letters in ["FL", "OK", "NG"] {
        assert_eq!(
            table.get(ProtocolPort::Ip0, letters, MasterMode::ExtEther),
            None,
            "{letters}"
        );
    }
}

// clause: GEN-02 NPC-02
#[test]
fn the_simple_protocol_is_not_spoken_on_other_ports() {
    let mut robot = Robot::new(Dialect::Field);
    for port in [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3] {
        robot.connect(port);
        robot.send(port, b"SU\r");
        robot.send(port, b"SO\r");
        robot.advance_ms(2_000);
        assert_eq!(robot.received(port), b"", "{port}");
    }
    for port in [Port::Host, Port::Ip0] {
        robot.connect(port);
        assert!(robot.ask(port, "SU").starts_with(b"FL,MODE:"), "{port}");
    }
}
