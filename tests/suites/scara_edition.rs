//! What the SCARA edition of the communication manual (STE 80722) states beyond the six-axis edition, for SCARA arms.
//!
//! Its commands (SM, IO, WD ...) are in `extensions.rs`.

use ts3100_controller::model::ArmModel;
use ts3100_controller::{Config, Dialect, KeySwitch, PanelAction, Port};
use ts3100_tests::Robot;

fn scara(dialect: Dialect) -> Robot {
    let mut config = Config::new(dialect);
    config.model = ArmModel::thl400();
    config.options.serial_pacing = false;
    let mut robot = Robot::with(config);
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

// clause: S6 S10 S11 S12 S13 S14 T5 S46-ERR S66 S67 S68 S69 S79 S81 K2-K4
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
        for command in [
            "HO,1 8 165",
            "MD,0",
            "MD,1",
            "RT,2",
            "SC,3",
            "JG,1 +",
            "JG,1 !",
            "RS,ERR",
        ] {
            assert_eq!(robot.ask(Port::Ip0, command), b"OK\r", "{command}");
        }
        // The library sends it, and its manual names it; the command list does not.
        let served = robot.ask(Port::Ip0, "MD,2") == b"OK\r";
        assert_eq!(served, dialect == Dialect::Field);
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

// clause: T4 T5 S72 S83
#[test]
fn ps_and_zc_answer_a_file_and_take_no_operand() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        let position = robot.file(Port::Ip0, "PS");
        assert_eq!(position, robot.seat.controller.current_position().encode());
        assert_eq!(position.iter().filter(|byte| **byte == b',').count(), 19);
        assert_eq!(
            robot.file(Port::Ip0, "ZC"),
            b"0,0",
            "function invalid, value 0, no CR"
        );
        for wrong in ["PS,1", "ZC,1"] {
            assert_eq!(robot.ask(Port::Ip0, wrong), b"NG\r", "{wrong}");
        }
        // ZC is about the third axis of a SCARA.
        let mut six = Robot::with(Config::new(dialect));
        six.connect(Port::Ip0);
        assert_eq!(six.ask(Port::Ip0, "ZC"), b"NG\r");
        let served = six.ask(Port::Ip0, "PS") != b"NG\r";
        assert_eq!(served, dialect == Dialect::Field);
    }
}

const POINTS: &str = "GLOBAL\nDIM TABLE(2) AS POINT\nN = 1\nEND\nPROGRAM P\nWAIT DIN(7)\nEND\nDATA\n\
                      POINT A1=250,100,-30,20,0/LEFTY\nPOINT LOW=240,-60,-10,0,0/LEFTY\nEND\n";

fn with_points(dialect: Dialect) -> Robot {
    let mut robot = scara(dialect);
    robot.load("P", POINTS);
    robot
}

fn world(robot: &mut Robot) -> Vec<f64> {
    let position = String::from_utf8(robot.file(Port::Ip0, "PR,1")).unwrap();
    position.split(',').map(|item| item.parse().unwrap()).collect()
}

fn close_to(found: &[f64], expected: [f64; 4]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 0.002, "{found}, {expected} expected");
    }
}

// clause: T4 T27 S71
#[test]
fn mp_moves_to_a_position_as_do_move_or_at_the_present_height() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = with_points(dialect);
        robot.command(Port::Ip0, "MP,0 A1");
        let status = robot.seat.controller.status();
        assert_eq!(
            status,
            ts3100_proto::status::ExecutionStatus::Running,
            "RUN is shown"
        );
        assert_eq!(robot.ask(Port::Ip0, "MP,0 LOW"), b"NG\r", "one is under way");
        robot.advance_ms(10_000);
        close_to(&world(&mut robot), [250.0, 100.0, -30.0, 20.0]);
        robot.command(Port::Ip0, "MP,1 LOW");
        robot.advance_ms(10_000);
        close_to(&world(&mut robot), [240.0, -60.0, -30.0, 0.0]);
        robot.command(Port::Ip0, "MP,1 POINT(260,50,-1,5,0,1)");
        robot.advance_ms(10_000);
        close_to(&world(&mut robot), [260.0, 50.0, -30.0, 5.0]);
        robot.command(Port::Ip0, "MP,0 POINT(260,50,-1,5,0,1)");
        robot.advance_ms(10_000);
        close_to(&world(&mut robot), [260.0, 50.0, -1.0, 5.0]);
        let refused = [
            "MP",
            "MP,0",
            "MP,2 A1",
            "MP,0,A1",
            "MP,0 NOWHERE",
            "MP,0 A1 WITH SPEED=5",
            "MP,0 A1+A1",
            "MP,0 N",
            "MP,0 POINT(260,50",
            "MP,0 POINT(260,50,-1)) ",
            "MP,0 260",
        ];
        for command in refused {
            assert_eq!(robot.ask(Port::Ip0, command), b"NG\r", "{command}");
        }
        robot.panel(PanelAction::Servo(false));
        assert_eq!(robot.ask(Port::Ip0, "MP,0 A1"), b"NG\r", "servo power is off");
    }
}

/// The target is worked out in the frames in effect; then its height in the world is the present one.
// clause: T4 T27
#[test]
fn mp_1_keeps_the_world_height_of_the_tool_point_in_every_frame() {
    let mut robot = with_points(Dialect::Field);
    robot.command(Port::Ip0, "MP,0 A1");
    robot.advance_ms(10_000);
    robot.command(Port::Ip0, "ZS,2 T 0.0 0.0 -15.0 0.0");
    robot.command(Port::Ip0, "ZS,1 W 10.0 0.0 -25.0 0.0");
    let before = world(&mut robot);
    close_to(&before, [250.0, 100.0, -45.0, 20.0]);
    robot.command(Port::Ip0, "MP,1 LOW");
    robot.advance_ms(10_000);
    close_to(&world(&mut robot), [250.0, -60.0, -45.0, 0.0]);
}

// clause: T4
#[test]
fn a_target_of_mp_that_is_out_of_reach_is_accepted_and_raises_an_alarm() {
    let mut robot = with_points(Dialect::Field);
    let before = robot.seat.controller.current_position();
    robot.command(Port::Ip0, "MP,0 POINT(900,0,0,0,0,1)");
    robot.advance_ms(1_000);
    assert_eq!(robot.alarms().len(), 1);
    assert_eq!(robot.seat.controller.current_position().joints, before.joints);
}

fn mode(robot: &mut Robot, port: Port) -> String {
    let status = String::from_utf8(robot.file(port, "SU")).unwrap();
    let end = status.find('/').unwrap();
    status["MODE:".len()..end].to_owned()
}

// clause: T4 T27 S84
#[test]
fn em_gives_the_control_right_away_until_the_power_goes_off() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        robot.connect(Port::Host);
        let serial = match dialect {
            Dialect::Field => "external(host)",
            Dialect::Manual => "external (rs232c)",
        };
        for wrong in ["EM", "EM,3", "EM,1 1"] {
            assert_eq!(robot.ask(Port::Ip0, wrong), b"NG\r", "{wrong}");
        }
        robot.command(Port::Ip0, "EM,1");
        assert!(mode(&mut robot, Port::Ip0).eq_ignore_ascii_case(serial));
        // Valid for the port that has the right only: it cannot be taken back.
        assert_eq!(robot.ask(Port::Ip0, "EM,2"), b"NG\r");
        assert_eq!(robot.ask(Port::Ip0, "DO,DOUT(1)"), b"NG\r");
        robot.command(Port::Host, "DO,DOUT(1)");
        robot.command(Port::Host, "RS,PRG");
        assert!(
            mode(&mut robot, Port::Ip0).eq_ignore_ascii_case(serial),
            "RS leaves it"
        );
        robot.panel(PanelAction::Key(ts3100_controller::KeySwitch::Teaching));
        robot.panel(PanelAction::Key(ts3100_controller::KeySwitch::Ext));
        assert!(
            mode(&mut robot, Port::Ip0).eq_ignore_ascii_case(serial),
            "the key leaves it"
        );
        let restored = ts3100_tests::round_trip::round_trip(&robot.seat.controller);
        robot = Robot::from_controller(restored);
        robot.panel(PanelAction::PowerCycle);
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::Servo(true));
        robot.command(Port::Ip0, "EM,0");
        assert!(mode(&mut robot, Port::Ip0).contains("sig"));
        let right = PanelAction::ControlRight(ts3100_controller::ControlRight::Rs232c);
        robot.panel(right);
        robot.panel(PanelAction::PowerCycle);
        robot.connect(Port::Ip0);
        assert!(
            mode(&mut robot, Port::Ip0).eq_ignore_ascii_case(serial),
            "the panel's lasts"
        );
    }
}

// clause: T4 T27
#[test]
fn em_needs_a_stopped_robot() {
    let mut robot = with_points(Dialect::Field);
    robot.command(Port::Ip0, "RN");
    assert_eq!(robot.ask(Port::Ip0, "EM,0"), b"NG\r", "a program runs");
    robot.command(Port::Ip0, "EC,BREAK");
    robot.advance_ms(1_000);
    let mut stopped = robot.clone();
    stopped.command(Port::Ip0, "EM,0");
    robot.command(Port::Ip0, "JG,1 +");
    assert_eq!(robot.ask(Port::Ip0, "EM,0"), b"NG\r", "a jog");
    robot.command(Port::Ip0, "JG,1 !");
    robot.advance_ms(1_000);
    robot.command(Port::Ip0, "FD");
    assert_eq!(robot.ask(Port::Ip0, "EM,0"), b"NG\r", "feed hold");
}

// clause: T20
#[test]
fn the_hand_axis_turns_as_a_joint_in_every_system() {
    for system in 0..=3 {
        let mut robot = scara(Dialect::Field);
        let joints = |robot: &mut Robot| {
            let position = String::from_utf8(robot.file(Port::Ip0, "PR,0")).unwrap();
            position
                .split(',')
                .map(|item| item.parse().unwrap())
                .collect::<Vec<f64>>()
        };
        let before = joints(&mut robot);
        for command in ["MD,1", "RT,2", &format!("SC,{system}"), "JG,5 +"] {
            robot.command(Port::Ip0, command);
        }
        robot.advance_ms(5_000);
        let after = joints(&mut robot);
        assert!(
            (after[4] - before[4] - 10.0).abs() < 0.002,
            "SC,{system}: {after:?}"
        );
        assert_eq!(after[..4], before[..4], "SC,{system}");
    }
}

// clause: T12 L54 K1 S79
#[test]
fn ho_takes_1_to_32_lines_with_the_first_as_its_lowest_bit() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        robot.command(Port::Ip0, "HO,33 32 4294967295");
        robot.command(Port::Ip0, "HO,1 32 2147483653");
        let on: Vec<u16> = (1..=64)
            .filter(|line| robot.seat.controller.signals().output(*line))
            .collect();
        let expected: Vec<u16> = [1, 3, 32].into_iter().chain(33..=64).collect();
        assert_eq!(on, expected);
        for wrong in [
            "HO,1 33 0",
            "HO,1 0 0",
            "HO,1 32 4294967296",
            "HO,1 17 131072",
            "HO,1 8 -1",
        ] {
            assert_eq!(robot.ask(Port::Ip0, wrong), b"NG\r", "{wrong}");
        }
        robot.command(Port::Ip0, "HO,1 17 131071");
        robot.command(Port::Ip0, "HO,64 1 0");
        assert!(robot.seat.controller.signals().output(17) && !robot.seat.controller.signals().output(64));
    }
}

/// The items of SU as one line, without blanks and CR.
fn state(robot: &mut Robot) -> String {
    let su = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
    su.replace([' ', '\r'], "")
}

/// Power on, look, servo on, select, start; the robot stops by itself when the cycle is complete.
// clause: S42 S44 S45 S98 S99
#[test]
fn a_day_of_external_operation_on_a_scara() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        let program = b"PROGRAM TEST\nDOUT(1)\nDELAY 1.0\nDOUT(2)\nDELAY 1.0\nEND\n";
        robot.seat.controller.put_file("TEST", program).unwrap();
        robot.panel(PanelAction::Servo(false));
        assert!(state(&mut robot).contains("/cycle"), "{dialect:?}: at power-on");
        robot.command(Port::Ip0, "SL,TEST");
        assert_eq!(robot.ask(Port::Ip0, "RN"), b"NG\r", "servo power is off");
        robot.command(Port::Ip0, "SO");
        assert_eq!(
            robot.total(Port::Ip0)[..2],
            [1, 0],
            "servo power, no emergency stop"
        );
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(200);
        assert_eq!(robot.total(Port::Ip0)[85] & 3, 1);
        robot.command(Port::Ip0, "SP");
        robot.advance_ms(1_000);
        assert!(state(&mut robot).ends_with("STATUS:stop(continue)"));
        assert_eq!(robot.total(Port::Ip0)[85] & 3, 1);
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(100);
        assert_eq!(
            robot.total(Port::Ip0)[85] & 3,
            3,
            "the step after the one that SP ended"
        );
        robot.advance_ms(2_000);
        assert_eq!(
            robot.received(Port::Ip0),
            b"\x02SP\r\x03",
            "at the end of the cycle"
        );
        assert!(state(&mut robot).ends_with("STATUS:stop(reset)"));
        robot.command(Port::Ip0, "BR");
        assert_eq!(robot.total(Port::Ip0)[0], 0);
        robot.command(Port::Ip0, "EC,MODE STEP");
        for key in [KeySwitch::Internal, KeySwitch::Ext] {
            robot.panel(PanelAction::Key(key));
        }
        assert!(
            state(&mut robot).contains("/step"),
            "changing over keeps the mode"
        );
    }
}

// clause: S100 S46
#[test]
fn rs_sig_turns_outputs_1_to_24_off_on_a_scara() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        robot.command(Port::Ip0, "IW,1 1 24 1 25 1 101 1");
        robot.command(Port::Ip0, "RS,SIG");
        let body = robot.total(Port::Ip0);
        // Lowest byte last: outputs 1-16, 17-32, 101-116.
        assert_eq!((&body[84..88], &body[92..94]), (&[0, 0, 1, 0][..], &[0, 1][..]));
    }
}

// clause: S70
#[test]
fn zs_sets_the_work_and_the_tool_coordinate_on_a_scara() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        let mut robot = scara(dialect);
        robot.command(Port::Ip0, "ZS,1 W1 10.0 20.0 0.0 0.0");
        robot.command(Port::Ip0, "ZS,2 T1 0.0 0.0 5.0 0.0");
        let frames = robot.seat.controller.frames();
        assert_eq!(robot.seat.controller.work_name(), "W1");
        assert_eq!(frames.tool.name.as_deref(), Some("T1"));
        for wrong in [
            "ZS,0 W1 1.0 2.0 3.0 4.0",
            "ZS,3 W1 1.0 2.0 3.0 4.0",
            "ZS,1 W1 1.0 2.0",
        ] {
            assert_eq!(robot.ask(Port::Ip0, wrong), b"NG\r", "{wrong}");
        }
    }
}

/// A form program of the maker's library: look, reset an alarm, servo on, watchdog, positions, moves. Its source port is
/// in `network.rs`.
// clause: J1-J5
#[test]
fn a_form_program_of_the_library_moves_a_scara() {
    let mut robot = scara(Dialect::Field);
    robot.panel(PanelAction::EmergencyStop(true));
    robot.panel(PanelAction::EmergencyStop(false));
    robot.total(Port::Ip0);
    robot.command(Port::Ip0, "RS,ERR");
    robot.advance_ms(500);
    assert_eq!(robot.total(Port::Ip0)[..2], [0, 0], "no emergency stop");
    robot.command(Port::Ip0, "SO");
    robot.advance_ms(500);
    assert_eq!(robot.total(Port::Ip0)[0], 1);
    robot.command(Port::Ip0, "WD,3000 0");
    let position = |robot: &mut Robot| -> Vec<f64> {
        let content = String::from_utf8(robot.file(Port::Ip0, "PR,4")).unwrap();
        let items = content.split(',').take(4);
        items.map(|item| item.trim().parse().unwrap()).collect()
    };
    for (kind, target) in [
        ("MOVE", [250.0, -100.0, -40.0, 45.0]),
        ("MOVES", [250.0, 100.0, -20.0, 30.0]),
    ] {
        let [x, y, z, c] = target;
        robot.command(
            Port::Ip0,
            &format!("DO,{kind} POINT({x:.3},{y:.3},{z:.3},{c:.3},0.000,FREE) with SPEED=40.000,ACCEL=60.000,DECEL=60.000"),
        );
        let is_near = |robot: &mut Robot| {
            let distances = position(robot)
                .into_iter()
                .zip(target)
                .map(|(now, then)| (now - then).abs());
            distances
                .zip([5.0, 5.0, 5.0, 0.4])
                .all(|(distance, most)| distance <= most)
        };
        let mut looks = 0;
        while !is_near(&mut robot) {
            robot.file(Port::Ip0, "SM,1");
            robot.advance_ms(10);
            looks += 1;
            assert!(looks < 1_000, "{kind}: within 10 s");
        }
        assert!(looks > 5, "{kind} takes its time");
        robot.advance_ms(1_000);
    }
    for axis in 1..=4 {
        robot.command(
            Port::Ip0,
            &format!("DO,MOVEA {axis},0.000 with SPEED=40.000,ACCEL=60.000,DECEL=60.000"),
        );
        robot.advance_ms(8_000);
        let content = String::from_utf8(robot.file(Port::Ip0, "PR,3")).unwrap();
        let joint: f64 = content.split(',').nth(axis - 1).unwrap().trim().parse().unwrap();
        assert!(joint.abs() < 0.01, "axis {axis}: {content}");
    }
    assert_eq!(
        robot.alarms(),
        ["8-014"],
        "the first; level 0 of the watchdog is no alarm"
    );
}
