//! PRINT and INPUT on the wire: the fields of twelve characters, what INPUT accepts, BUFFRESET, and the example programs
//! of section 4.2 of the manual, reworded.
//!
//! The syntax of both statements is tested in `scol-mini`; faults of channels are in `faults.rs`.

use ts3100_controller::model::ArmModel;
use ts3100_controller::options::{NoPeer, Reconnect};
use ts3100_controller::{Config, Controller, Dialect, PanelAction, Port};
use ts3100_tests::{Robot, frame, notation};

/// A program of these lines that runs at once; what it prints on COM1 or IP1 can be read.
fn run(lines: &str) -> Robot {
    let mut robot = Robot::ready(&format!("PROGRAM TEST\n{lines}\nEND\n"));
    robot.connect(Port::Com1);
    robot.connect(Port::Ip2);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(200);
    robot
}

fn printed(lines: &str) -> String {
    notation::write(&run(lines).received(Port::Com1))
}

fn status(robot: &mut Robot) -> String {
    let text = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
    text.rsplit_once("STATUS:")
        .map(|(_, status)| status.to_string())
        .unwrap()
}

// clause: PRT-03 PRT-04 PRT-05 PRT-06 PRT-07 PRT-08 PRT-09 PRT-10 PRT-11 PRT-12 PRT-13 PRT-15
#[test]
fn print_to_the_byte() {
    for (lines, expected) in [
        (r#"PRINT COM1, "a,B 1","x""#, "a,B 1x"),
        ("N = 7\nPRINT COM1, N", "           7"),
        ("N = 1234567890\nPRINT COM1, N", "  1234567890"),
        ("N = -5\nPRINT COM1, N", "          -5"),
        ("X = 1.5\nPRINT COM1, X", "       1.500"),
        ("PRINT COM1, 1234.5", "    1234.500"),
        ("PRINT COM1, -12.25, 12.25", "     -12.250      12.250"),
        (r#"PRINT COM1, "REQ""#, "REQ"),
        (r#"PRINT COM1, "REQ", CR"#, "REQ<CR>"),
        (
            r#"PRINT COM1, "INPUT DATA =", -1000.0/3, CR"#,
            "INPUT DATA =    -333.333<CR>",
        ),
        ("PRINT COM1, 2.0/3, 1.0", "       0.667       1.000"),
        ("PRINT COM1, 12345.678", "   12345.678"),
        ("PRINT COM1, 1000000000.0", "************"),
        ("N = 3\nX = 3.0\nPRINT COM1, N, X", "           3       3.000"),
        ("N = 3\nPRINT COM1, N * 2 + 1", "           7"),
        ("X = 2.0\nPRINT COM1, -X / 4", "      -0.500"),
        ("PRINT COM1, 0.0005, -0.0005", "       0.001      -0.001"),
    ] {
        assert_eq!(printed(lines), expected, "{lines}");
    }
}

// clause: PRT-01 PRT-02 PRT-09
#[test]
fn each_channel_has_its_own_output() {
    let mut robot =
        run("PRINT COM1, \"C\"\nPRINT IP1, \"A\", 1, \"B\", CR\nPRINT IP2, 1, CR\nPRINT \"SHOWN\", CR");
    assert_eq!(robot.received(Port::Com1), b"C");
    assert_eq!(robot.received(Port::Ip1), b"A           1B\r");
    assert_eq!(robot.received(Port::Ip2), b"           1\r");
}

// clause: INP-01 INP-03 INP-04 INP-05 INP-07 INP-15 INP-16 INP-17 NPC-01
#[test]
fn input_takes_what_the_manual_says() {
    let ask = "A = 0\nB = 0\nX = 0.0\nINPUT COM1, A, X\nPRINT COM1, A, X, CR\nINPUT COM1, B\nPRINT COM1, B";
    let waiting = run(ask);
    let after = |segments: &[&str]| {
        let mut robot = waiting.clone();
        for segment in segments {
            robot.raw(Port::Com1, segment.as_bytes());
            robot.advance_ms(50);
        }
        notation::write(&robot.received(Port::Com1))
    };
    assert_eq!(after(&[]), "");
    assert_eq!(after(&["12"]), "");
    assert_eq!(after(&["12,3.25\r"]), "          12       3.250<CR>");
    assert_eq!(after(&["-12,", "3", ".2", "5\r"]), "         -12       3.250<CR>");
    assert_eq!(after(&["12\r"]), "");
    assert_eq!(after(&["12\r", "3\r"]), "          12       3.000<CR>");
    assert_eq!(after(&["2.7,1\r"]), "           2       1.000<CR>");
    assert_eq!(after(&[" 1 , 2 \r\n"]), "           1       2.000<CR>");
    assert_eq!(
        after(&["1,2,\r", "7\r"]),
        "           1       2.000<CR>           7"
    );
    assert_eq!(
        after(&["1,2,", "\r", "7\r"]),
        "           1       2.000<CR>           7"
    );
    assert_eq!(
        after(&["1,2\r", "\n", "7\r"]),
        "           1       2.000<CR>           7"
    );
    assert_eq!(after(&["1,2,3\r"]), "           1       2.000<CR>           3");
}

// clause: INP-06 BUF-01 BUF-02 BUF-03 BUF-04
#[test]
fn surplus_is_kept_until_buffreset() {
    let body = |reset: &str| format!("A = 0\nB = 0\nINPUT COM1, A\n{reset}\nINPUT COM1, B\nPRINT COM1, A, B");
    let surplus = |reset: &str| {
        let mut robot = run(&body(reset));
        robot.raw(Port::Com1, b"1,2,3\r");
        robot.advance_ms(50);
        let first = robot.received(Port::Com1);
        robot.raw(Port::Com1, b"9\r");
        robot.advance_ms(50);
        notation::write(&[first, b"|".to_vec(), robot.received(Port::Com1)].concat())
    };
    assert_eq!(surplus("REMARK keep"), "           1           2|");
    assert_eq!(surplus("PRINT COM1, \"BUFFRESET\""), "|           1           9");
    assert_eq!(surplus("PRINT IP1, \"BUFFRESET\""), "           1           2|");
    assert_eq!(surplus("PRINT TP, \"BUFFRESET\""), "           1           2|");
    assert_eq!(
        surplus("PRINT COM1, \"BUFFRESET\", CR"),
        "BUFFRESET<CR>           1           2|"
    );
}

// clause: INP-08 INP-13
#[test]
fn data_before_the_input_is_kept_to_256_bytes() {
    let mut robot = run("N = 0\nDELAY 5.0\nAGAIN:\nINPUT COM1, N\nPRINT COM1, N\nGOTO AGAIN");
    robot.raw(Port::Com1, "1,".repeat(150).as_bytes());
    robot.advance_ms(10_000);
    assert_eq!(robot.received(Port::Com1).len(), 12 * 128);
}

// clause: INP-08 SEQ-04
#[test]
fn a_start_from_step_one_clears_what_came_before() {
    let mut robot = Robot::ready("PROGRAM TEST\nN = 0\nINPUT IP1, N\nPRINT IP1, N\nEND\n");
    robot.raw(Port::Ip1, b"5\r");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Ip1), b"");
    robot.raw(Port::Ip1, b"6\r");
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Ip1), b"           6");
}

// clause: SER-05 NPC-02
#[test]
fn an_input_waits_as_long_as_it_takes() {
    let mut robot = run("N = 0\nINPUT COM1, N\nPRINT COM1, N");
    robot.advance_ms(3_600_000);
    assert_eq!(status(&mut robot), "running");
    assert_eq!(robot.received(Port::Com1), b"");
    robot.raw(Port::Com1, b"5\r");
    assert_eq!(robot.received(Port::Com1), b"           5");
}

// clause: INP-09 INP-10 CMD-RN-02 CMD-SP-09
#[test]
fn a_cancelled_input_leaves_zeros() {
    let mut robot = run("M = 1\nN = 7\nINPUT COM1, M, N\nPRINT COM1, M, N");
    robot.raw(Port::Com1, b"5\r");
    robot.command(Port::Ip0, "SP");
    assert_eq!(status(&mut robot), "stop(continue)");
    assert_eq!(robot.received(Port::Com1), b"");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Com1), b"           5           0");
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"), "the end of the cycle");
}

// clause: PRT-14
#[test]
fn a_channel_without_a_peer() {
    for (dialect, alarms, expected) in [
        (Dialect::Field, vec!["2-046"], false),
        (Dialect::Manual, vec![], true),
    ] {
        let mut robot = Robot::new(dialect);
        robot.load("TEST", "PROGRAM TEST\nPRINT IP1, \"A\", CR\nDOUT(1)\nEND\n");
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::Servo(true));
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(200);
        robot.received(Port::Ip0);
        assert_eq!(robot.alarms(), alarms);
        robot.send(Port::Ip0, b"SF\r");
        let body = robot.received(Port::Ip0);
        assert_eq!(body[4 + 85] & 1 == 1, expected, "Dout1 in {dialect:?}");
    }
}

/// A robot whose program waits in this INPUT, with or without a peer on IP1.
fn waiting(config: Config, lines: &str, has_peer: bool) -> Robot {
    let mut robot = Robot::with(config);
    robot.load("TEST", &format!("PROGRAM TEST\n{lines}\nEND\n"));
    robot.connect(Port::Ip0);
    robot.connect(Port::Com1);
    robot.connect(Port::Ip2);
    if has_peer {
        robot.connect(Port::Ip1);
    }
    robot.panel(PanelAction::Servo(true));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    robot
}

fn connect_again(robot: &mut Robot, port: Port) {
    robot.disconnect(port);
    robot.connect(port);
    robot.advance_ms(100);
}

/// The field dialect with an INPUT that a new peer ends, and that waits without one.
fn releasing() -> Config {
    let mut config = Config::new(Dialect::Field);
    config.options.reconnect = Reconnect::Release;
    config.options.no_peer = NoPeer::Silent;
    config.options.serial_pacing = false;
    config
}

fn waits(robot: &Robot) -> bool {
    robot.seat.controller.waits_for().is_some()
}

// clause: T25 T27 INP-10
#[test]
fn a_new_peer_ends_a_waiting_input_only_where_the_option_says_so() {
    for dialect in [Dialect::Field, Dialect::Manual] {
        for model in [ArmModel::tv800(), ArmModel::thl400()] {
            let preset = Config {
                model,
                ..Config::new(dialect)
            };
            assert_eq!(preset.options.reconnect, Reconnect::Keep, "in both dialects");
            for (rule, printed, later) in [
                (Reconnect::Keep, "", "           5           6"),
                (Reconnect::Release, "           5           0", ""),
            ] {
                let mut config = preset.clone();
                config.options.reconnect = rule;
                let lines = "M = 1\nN = 7\nINPUT IP1, M, N\nPRINT IP1, M, N";
                let mut robot = waiting(config, lines, true);
                // The 8 is not complete: it is dropped with its sender, and never a value.
                robot.raw(Port::Ip1, b"5,8");
                robot.disconnect(Port::Ip1);
                robot.advance_ms(100);
                assert!(waits(&robot), "a peer that leaves ends nothing");
                robot.connect(Port::Ip1);
                robot.advance_ms(100);
                assert_eq!(
                    robot.received(Port::Ip1),
                    printed.as_bytes(),
                    "{dialect:?} {rule:?}"
                );
                assert_eq!(waits(&robot), rule == Reconnect::Keep);
                robot.raw(Port::Ip1, b"6\r");
                robot.advance_ms(100);
                assert_eq!(
                    robot.received(Port::Ip1),
                    later.as_bytes(),
                    "{dialect:?} {rule:?}"
                );
                assert!(robot.alarms().is_empty());
            }
        }
    }
}

// clause: T25 T27
#[test]
fn the_first_peer_of_a_channel_ends_no_input() {
    let mut robot = waiting(releasing(), "INPUT IP1, N\nINPUT IP1, N", false);
    let line = |robot: &Robot| robot.seat.controller.line();
    assert_eq!(line(&robot), 2);
    robot.connect(Port::Ip1);
    robot.advance_ms(100);
    assert_eq!(line(&robot), 2, "the first since power-on");
    // Without Disconnected: a second connection that replaces the first.
    robot.connect(Port::Ip1);
    robot.advance_ms(100);
    assert_eq!(
        line(&robot),
        3,
        "the second; the next INPUT has just begun and waits"
    );
    assert!(waits(&robot));
    robot.disconnect(Port::Ip1);
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot.command(Port::Ip0, "RN");
    robot.connect(Port::Ip1);
    robot.advance_ms(100);
    assert_eq!(line(&robot), 2, "power-on forgets the peers");
    connect_again(&mut robot, Port::Ip1);
    assert_eq!(line(&robot), 3);
}

// clause: T25
#[test]
fn a_new_peer_ends_no_input_of_another_channel_or_of_a_serial_line() {
    let mut robot = waiting(releasing(), "INPUT IP1, N", true);
    for port in [Port::Ip0, Port::Ip2, Port::Com1] {
        connect_again(&mut robot, port);
        assert!(waits(&robot), "{port}");
    }
    for channel in ["COM1", "TP"] {
        let mut robot = waiting(releasing(), &format!("INPUT {channel}, N"), true);
        for port in [Port::Ip1, Port::Com1] {
            connect_again(&mut robot, port);
            assert!(waits(&robot), "{channel}, {port}");
        }
    }
}

// clause: T25
#[test]
fn a_new_peer_ends_inputs_of_tasks_of_monitors_and_of_do() {
    let program = "GLOBAL\nA = 7\nB = 7\nEND\nPROGRAM TEST\nTASK(\"OTHER\")\nON DIN(5) DO INPUT IP1, A\nDELAY 9\nEND\n\
        PROGRAM OTHER\nINPUT IP1, B\nEND\n";
    let mut robot = Robot::with(releasing());
    robot.load("TEST", program);
    for port in [Port::Ip0, Port::Ip1] {
        robot.connect(port);
    }
    robot.panel(PanelAction::Servo(true));
    robot.command(Port::Ip0, "RN");
    robot.panel(PanelAction::InputLine { line: 5, on: true });
    robot.advance_ms(100);
    connect_again(&mut robot, Port::Ip1);
    for name in ["A", "B"] {
        assert_eq!(robot.file(Port::Ip0, &format!("MR,{name} 0")), b"0\r", "{name}");
    }
    robot.command(Port::Ip0, "EC,BREAK");
    robot.command(Port::Ip0, "RS,PRG");
    robot.command(Port::Ip0, "DO,INPUT IP1, A");
    robot.advance_ms(1_000);
    assert!(waits(&robot));
    connect_again(&mut robot, Port::Ip1);
    assert!(!waits(&robot));
    assert_eq!(robot.file(Port::Ip0, "MR,A 0"), b"0\r");
}

// clause: T25
#[test]
fn an_input_that_a_new_peer_ends_is_a_step_of_the_program() {
    let mut robot = waiting(releasing(), "DELAY 0.2\nINPUT IP1, N\nDELAY 9", true);
    robot.advance_ms(200);
    assert!(waits(&robot));
    connect_again(&mut robot, Port::Ip1);
    assert_eq!(status(&mut robot), "running", "DELAY follows");
    robot.command(Port::Ip0, "EC,BREAK");
    robot.advance_ms(100);
    robot.received(Port::Ip0);
    robot.command(Port::Ip0, "RS,STP");
    robot.command(Port::Ip0, "EC,MODE STEP");
    for _ in 0..2 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(300);
        robot.received(Port::Ip0);
    }
    assert!(waits(&robot));
    connect_again(&mut robot, Port::Ip1);
    robot.received(Port::Ip0);
    assert_eq!(
        status(&mut robot),
        "stop(continue)",
        "each step stops in STEP mode"
    );
}

// clause: T25
#[test]
fn a_snapshot_remembers_that_a_channel_had_a_peer() {
    let restored = |robot: &Robot| {
        Robot::from_controller(Controller::restore(robot.seat.controller.snapshot()).unwrap())
    };
    for had_peer in [false, true] {
        let mut robot = waiting(releasing(), "INPUT IP1, N", had_peer);
        robot.disconnect(Port::Ip1);
        let mut robot = restored(&robot);
        robot.connect(Port::Ip1);
        robot.advance_ms(100);
        assert_eq!(waits(&robot), !had_peer);
    }
}

// clause: INP-14 INP-03
#[test]
fn a_datum_that_is_no_number() {
    let mut robot = run("N = 3\nINPUT COM1, N\nPRINT COM1, N");
    robot.raw(Port::Com1, b"ABC\r");
    robot.advance_ms(100);
    assert_eq!(robot.alarms(), ["2-046"]);
    assert_eq!(robot.received(Port::Com1), b"");
    assert!(status(&mut robot).starts_with("stop("));

    let mut robot = Robot::new(Dialect::Manual);
    robot.load("TEST", "PROGRAM TEST\nN = 3\nINPUT COM1, N\nPRINT COM1, N\nEND\n");
    robot.connect(Port::Com1);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot.command(Port::Ip0, "RN");
    robot.raw(Port::Com1, b"ABC\r");
    robot.advance_ms(100);
    assert_eq!(robot.alarms(), Vec::<String>::new());
    assert_eq!(robot.received(Port::Com1), b"           0");
}

const REPEATER: &str = "PROGRAM REPEATER
BEGIN:
N = 0
PRINT COM1, \"REQ\"
INPUT COM1, N
IF N == 0 THEN GOTO BEGIN
FOR K = 1 TO N
MOVE PA
MOVE PB
NEXT K
PRINT COM1, \"END\"
END
DATA
POINT PA=400,0,200,0,0,0,0,0/
POINT PB=400,50,200,0,0,0,0,0/
END
";

fn ready(program: &str) -> Robot {
    let mut robot = Robot::ready(program);
    robot.connect(Port::Com1);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    robot
}

// clause: EXAMPLE-01 EXAMPLE-02 S93
#[test]
fn example_repeat() {
    let mut robot = ready(REPEATER);
    assert_eq!(robot.received(Port::Com1), b"REQ");
    robot.raw(Port::Com1, b"3\r");
    robot.advance_ms(50);
    let start = robot.float(Port::Ip0, 152);
    let mut turns = 0;
    let mut rising = true;
    let mut last = start;
    for _ in 0..6_000 {
        robot.advance_ms(10);
        let y = robot.float(Port::Ip0, 152);
        if rising && y > 49.9 && last <= 49.9 {
            turns += 1;
            rising = false;
        }
        rising |= y < 0.1;
        last = y;
        if robot.unread().iter().any(|(port, _)| *port == Port::Com1) {
            break;
        }
    }
    assert_eq!(turns, 3, "three times to PB");
    assert_eq!(robot.received(Port::Com1), b"END");

    let mut robot = ready(REPEATER);
    robot.command(Port::Ip0, "SP");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Com1), b"REQREQ");
    robot.raw(Port::Com1, b"0\r");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Com1), b"REQ");
}

// clause: EXAMPLE-03 EXAMPLE-04 EXAMPLE-09 S93
#[test]
fn example_select() {
    let program = "PROGRAM CHOOSE\nCHOOSE:\nK = 0\nPRINT COM1, \"STR\"\nINPUT COM1, K\nGOTO(K) L1, L2, L3\n\
        PRINT COM1, \"NG\"\nGOTO FIN\nL1:\nPRINT COM1, \"T1\"\nGOTO FIN\nL2: PRINT COM1, \"T2\"\nGOTO FIN\n\
        L3:\nPRINT COM1, \"T3\"\nFIN:\nEND\n";
    for (answer, expected) in [
        ("1", "T1"),
        ("2", "T2"),
        ("3", "T3"),
        ("7", "NG"),
        ("0", "NG"),
        ("-1", "NG"),
    ] {
        let mut robot = ready(program);
        assert_eq!(robot.received(Port::Com1), b"STR");
        robot.raw(Port::Com1, format!("{answer}\r").as_bytes());
        robot.advance_ms(50);
        assert_eq!(robot.received(Port::Com1), expected.as_bytes(), "{answer}");
        assert_eq!(status(&mut robot), "stop(reset)");
    }
    let mut robot = ready(program);
    robot.received(Port::Com1);
    robot.command(Port::Ip0, "SP");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Com1), b"NG");
}

// clause: EXAMPLE-05 S93
#[test]
fn example_position_with_check_value() {
    let program = "PROGRAM DIRECT\nX = 0.0\nY = 0.0\nZ = 0.0\nA = 0.0\nB = 0.0\nC = 0.0\nU = 0.0\nV = 0.0\n\
        SUM = 0.0\nPRINT COM1, \"REQ\"\nINPUT COM1, X, Y, Z, A, B, C, U, V, SUM\n\
        IF SUM == X + Y + Z + A + B + C + U + V + 1 THEN GOTO GOOD\nPRINT COM1, \"NG\"\nGOTO FIN\n\
        GOOD:\nPRINT COM1, \"OK\"\nMOVE POINT(X, Y, Z, A, B, C, U, V, 00000)\nFIN:\nEND\n";
    let mut robot = ready(program);
    robot.raw(Port::Com1, b"400,0,200,0,0,0,0,0,601\r");
    robot.advance_ms(10_000);
    assert_eq!(robot.received(Port::Com1), b"REQOK");
    for (offset, expected) in [
        (148, 400.0),
        (152, 0.0),
        (156, 200.0),
        (180, 400.0),
        (184, 0.0),
        (188, 200.0),
    ] {
        let found = robot.float(Port::Ip0, offset);
        assert!((found - expected).abs() < 0.001, "{offset}: {found}");
    }
    let mut robot = ready(program);
    let before = robot.float(Port::Ip0, 148);
    robot.raw(Port::Com1, b"400,0,200,0,0,0,0,0,600\r");
    robot.advance_ms(10_000);
    assert_eq!(robot.received(Port::Com1), b"REQNG");
    assert_eq!(robot.float(Port::Ip0, 148).to_bits(), before.to_bits());
}

// clause: EXAMPLE-07 EXAMPLE-08 EXAMPLE-10 S93
#[test]
fn example_relative_correction() {
    let program = "PROGRAM SHIFTED\nX = 0.0\nY = 0.0\nSUM = 0.0\nMOVE P1\nPRINT COM1, \"REQ\"\nINPUT COM1, X, Y, SUM\n\
        IF SUM == X + Y + 1 THEN GOTO GOOD\nPRINT COM1, \"NG\"\nGOTO FIN\nGOOD:\nPRINT COM1, \"OK\"\n\
        MOVE P1 + POINT(X, Y)\nFIN:\nEND\nDATA\nPOINT P1=400,0,200,0,0,0,0,0/\nEND\n";
    for (answer, word, x, y) in [
        ("10,20,31", "OK", 410.0, 20.0),
        ("10,20,30", "NG", 400.0, 0.0),
        ("10.5,20.25,31.75", "OK", 410.5, 20.25),
    ] {
        let mut robot = ready(program);
        robot.advance_ms(10_000);
        robot.raw(Port::Com1, format!("{answer}\r").as_bytes());
        robot.advance_ms(10_000);
        assert_eq!(robot.received(Port::Com1), format!("REQ{word}").as_bytes());
        for (offset, expected) in [
            (148, x),
            (152, y),
            (156, 200.0),
            (160, 0.0),
            (164, 0.0),
            (168, 0.0),
        ] {
            let found = robot.float(Port::Ip0, offset);
            assert!((found - expected).abs() < 0.001, "{answer} at {offset}: {found}");
        }
    }
}
