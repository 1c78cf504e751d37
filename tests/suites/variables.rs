//! MR and MW: every type, their counts and their errors, the flag that writes the file, and line ends and names of user
//! files.
//!
//! The grammar of both commands is tested in `ts3100-proto`.

use ts3100_controller::options::CycleWithoutLabel;
use ts3100_controller::{Config, Controller, Dialect, PanelAction, Port};
use ts3100_tests::Robot;

const PROGRAM: &str = "GLOBAL
A = 10
X = 1.5
BIG = -2147483648
ABCDEFGHIJ = 3
DIM TBL(3) AS INTEGER
DIM GRID(2,3) AS REAL
END
PROGRAM TEST
LOCAL1 = 5
INPUT IP1, A
PRINT IP1, A, CR
INPUT IP1, LOCAL1
END
DATA
POINT P1=1,2,3,4,5,6,7,8/12111
POINT P2=1,,3/
TRANS W1=400,200,50,90
PAYLOAD H1={3,100}
PAYLOAD H2=5,0
END
";

fn robot() -> Robot {
    Robot::ready(PROGRAM)
}

pub fn read(robot: &mut Robot, operands: &str) -> String {
    let answer = robot.ask(Port::Ip0, &format!("MR,{operands}"));
    if answer == b"NG\r" {
        return "NG".to_string();
    }
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), b"");
    let text = String::from_utf8(answer).unwrap();
    let values = text
        .strip_prefix("FL,")
        .and_then(|text| text.strip_suffix("\r\x1A"));
    values
        .unwrap_or_else(|| panic!("FL, values CR EOF expected, {text:?} found"))
        .to_string()
}

// clause: CMD-MR-01 CMD-MR-02 CMD-MR-03 CMD-MR-04 CMD-MR-05 CMD-MR-06 MR-01 MR-02 MR-03 MR-04 MR-05
// clause: DATA-01 DATA-02 DATA-03 DATA-05 DATA-06 DATA-07 DATA-08 RAM-07 RAM-09 S15 L41 L47
#[test]
fn mr_of_every_type() {
    let mut robot = robot();
    for (operands, expected) in [
        ("A 0", "10"),
        ("a 0", "10"),
        ("A -1", "10"),
        ("X 1", "1.500"),
        ("BIG 0", "-2147483648"),
        ("ABCDEFGHIJ 0", "3"),
        ("H1 2", "3.000 100.000 0.000 0.000 0.000 0.000 0.000"),
        ("H2 2", "5.000 0.000 0.000 0.000 0.000 0.000 0.000"),
        ("W1 3", "400.000 200.000 50.000 90.000 0.000 0.000"),
        (
            "P1 4",
            "1.000 2.000 3.000 4.000 5.000 6.000 7.000 8.000 12111.000",
        ),
        (
            "P1 -1",
            "1.000 2.000 3.000 4.000 5.000 6.000 7.000 8.000 12111.000",
        ),
        ("P2 4", "1.000 0.000 3.000 0.000 0.000 0.000 0.000 0.000 0.000"),
        ("A 4", "NG"),
        ("A 5", "NG"),
        ("A 10", "NG"),
        ("A -2", "NG"),
        ("A", "NG"),
        ("A 0 0", "NG"),
        ("NOVAR 0", "NG"),
        ("LOCAL1 0", "NG"),
        ("ABCDEFGHIJK 0", "NG"),
        ("A(1) 5", "NG"),
        ("TBL(9) 5", "NG"),
        ("TBL(1,1) 5", "NG"),
        ("TBL 5", "NG"),
    ] {
        assert_eq!(read(&mut robot, operands), expected, "MR,{operands}");
    }
}

// clause: CMD-MW-01 CMD-MW-03 CMD-MW-04 CMD-MW-05 CMD-MW-06 CMD-MR-03 K2-K4
#[test]
fn mw_of_every_type() {
    let mut robot = robot();
    for (operands, name, expected) in [
        ("0 A 0 25", "A 0", "25"),
        ("0 X 1 -3.142", "X 1", "-3.142"),
        (
            "0 H1 2 1 2 3 4 5 6 7",
            "H1 2",
            "1.000 2.000 3.000 4.000 5.000 6.000 7.000",
        ),
        (
            "0 W1 3 1.5 2 3 4 5 6",
            "W1 3",
            "1.500 2.000 3.000 4.000 5.000 6.000",
        ),
        (
            "0 P1 4 8 7 6 5 4 3 2 1 11211",
            "P1 4",
            "8.000 7.000 6.000 5.000 4.000 3.000 2.000 1.000 11211.000",
        ),
        ("0 TBL(2) 5 9", "TBL(2) 5", "9"),
        ("0 GRID(1,3) 6 2.5", "GRID(1,3) 6", "2.500"),
    ] {
        robot.command(Port::Ip0, &format!("MW,{operands}"));
        assert_eq!(read(&mut robot, name), expected, "MW,{operands}");
    }
    for operands in [
        "2 A 0 1",
        "0 A 0",
        "0 A 0 1 2",
        "0 X 1 1e308",
        "0 X 1 -3.5e38",
        "0 A 0 X",
        "0 NOVAR 0 1",
        "0 LOCAL1 0 1",
        "0 P1 4 1 2 3 4 5 6 7 8",
        "0 P1 4 1 2 3 4 5 6 7 8 33333",
        "0 P1 4 1 2 3 4 5 6 7 3.5e38 11211",
        "0 W1 3 1 2 3 4 5 -1e200",
        "0 H1 2 3.5e38 2 3 4 5 6 7",
        "0 W1 3 1 2 3 4 5",
        "0 H1 2 1 2 3 4 5 6",
        "0 A 4 1 2 3 4 5 6 7 8 9",
        "0 ABCDEFGHIJK 0 1",
        "0 TBL(9) 5 1",
        "A 0 1",
        "",
    ] {
        assert_eq!(
            robot.ask(Port::Ip0, &format!("MW,{operands}")),
            b"NG\r",
            "MW,{operands}"
        );
    }
    assert_eq!(read(&mut robot, "A 0"), "25");
    assert_eq!(
        read(&mut robot, "P1 4"),
        "8.000 7.000 6.000 5.000 4.000 3.000 2.000 1.000 11211.000"
    );
}

// clause: CMD-MW-06
#[test]
fn what_mw_cannot_store_is_not_written_into_the_file_either() {
    let source = "GLOBAL\nB\nEND\nPROGRAM TEST\nB = 2\nEND\n";
    let mut robot = Robot::ready(source);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    robot.received(Port::Ip0);
    assert_eq!(
        robot.ask(Port::Ip0, "MW,1 B 1 2.5"),
        b"NG\r",
        "B is an integer by now"
    );
    assert_eq!(robot.file(Port::Ip0, "UL,TEST"), source.as_bytes());
    robot.command(Port::Ip0, "MW,1 B 0 3");
}

// clause: CMD-MW-02 CMD-MW-05 CMD-RS-03 CMD-RS-04 L48
#[test]
fn the_flag_of_mw_decides_about_the_file() {
    let mut robot = robot();
    robot.command(Port::Ip0, "MW,0 A 0 77");
    assert_eq!(robot.file(Port::Ip0, "UL,TEST"), PROGRAM.as_bytes());
    robot.command(Port::Ip0, "RS,STP");
    assert_eq!(read(&mut robot, "A 0"), "77");
    robot.command(Port::Ip0, "RS,PRG");
    assert_eq!(read(&mut robot, "A 0"), "10");
    robot.command(Port::Ip0, "MW,1 A 0 25");
    let expected = PROGRAM.replace("A = 10", "A = 25");
    assert_eq!(
        String::from_utf8(robot.file(Port::Ip0, "UL,TEST")).unwrap(),
        expected
    );
    assert_eq!(read(&mut robot, "A 0"), "25");
    robot.command(Port::Ip0, "RS,PRG");
    assert_eq!(read(&mut robot, "A 0"), "25");
    robot.command(Port::Ip0, "MW,1 P1 4 8 7 6 5 4 3 2 1 11211");
    robot.command(Port::Ip0, "SL,TEST");
    assert_eq!(read(&mut robot, "A 0"), "25");
    assert_eq!(
        read(&mut robot, "P1 4"),
        "8.000 7.000 6.000 5.000 4.000 3.000 2.000 1.000 11211.000"
    );
    let file = String::from_utf8(robot.file(Port::Ip0, "UL,TEST")).unwrap();
    assert_eq!(file.lines().count(), PROGRAM.lines().count());
    assert!(file.contains("/11211\n"), "{file}");
}

// clause: CMD-MW-06
#[test]
fn mw_acts_at_once_while_a_program_runs() {
    let mut robot =
        Robot::ready("GLOBAL\nA = 1\nEND\nPROGRAM TEST\nAGAIN:\nPRINT IP1, A\nDELAY 1.0\nGOTO AGAIN\nEND\n");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Ip1), b"           1");
    robot.command(Port::Ip0, "MW,0 A 0 5");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip1), b"           5");
    robot.command(Port::Ip0, "MW,1 A 0 6");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip1), b"           6");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(1_500);
    assert!(
        robot
            .file(Port::Ip0, "UL,TEST")
            .starts_with(b"GLOBAL\nA = 6\nEND\n")
    );
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_500);
    let printed = String::from_utf8(robot.received(Port::Ip1)).unwrap();
    assert!(printed.starts_with("           6"), "{printed:?}");
}

// clause: CMD-MW-02 SF-24
#[test]
fn a_line_that_mw_adds_to_the_file_moves_the_lines_of_the_program_that_runs() {
    let source = "GLOBAL\nDIM T(3) AS INTEGER\nEND\nPROGRAM TEST\nI = TASK(\"SIDE\")\nMOVE A WITH SPEED=5\nEND\n\
        PROGRAM SIDE\nWAIT DIN(1)\nEND\nDATA\nPOINT A=400,-200,200/\nEND\n";
    let mut robot = Robot::ready(source);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    let lines = |robot: &mut Robot| {
        let body = robot.total(Port::Ip0);
        [24, 26].map(|at| u16::from_be_bytes([body[at], body[at + 1]]))
    };
    assert_eq!(lines(&mut robot), [6, 6]);
    robot.command(Port::Ip0, "MW,1 T(2) 5 9");
    assert_eq!(lines(&mut robot), [7, 7], "the MOVE is on line 7 now");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(60_000);
    let file = String::from_utf8(robot.file(Port::Ip0, "UL,TEST")).unwrap();
    assert!(
        file.starts_with("GLOBAL\nDIM T(3) AS INTEGER\nT(2) = 9\nEND\n"),
        "{file}"
    );
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_000);
    let status = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
    assert!(
        status.ends_with("stop(reset)"),
        "it has gone on to its end: {status}"
    );
}

// clause: CMD-MW-02 SF-24
#[test]
fn a_motion_that_nobody_waits_for_is_on_its_line_of_the_rewritten_file() {
    let source = "GLOBAL\nDIM T(3) AS INTEGER\nEND\nPROGRAM TEST\nENABLE NOWAIT\nMOVE A WITH SPEED=5\nWAIT DIN(1)\nEND\n\
        DATA\nPOINT A=400,-200,200/\nEND\n";
    let mut robot = Robot::ready(source);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    let executed = |robot: &mut Robot| robot.total(Port::Ip0)[25];
    assert_eq!(executed(&mut robot), 6);
    robot.command(Port::Ip0, "MW,1 T(2) 5 9");
    assert_eq!(executed(&mut robot), 7);
}

// clause: CMD-MW-02
#[test]
fn a_program_goes_on_in_the_file_that_says_of_what_kind_a_variable_is() {
    let source = "GLOBAL\nB\nEND\nPROGRAM TEST\nDELAY 1\nC = B\nPRINT IP1, 0.5 + 0.25, C.X\nEND\n";
    let mut robot = Robot::ready(source);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    robot.command(Port::Ip0, "MW,1 B 4 400 0 200 0 0 0 0 0 0");
    let controller = &robot.seat.controller;
    assert_eq!(&Controller::restore(controller.snapshot()).unwrap(), controller);
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip1), b"       0.750     400.000");
}

// clause: DATA-04 DATA-11 DATA-12 DATA-13 CMD-SL-02
#[test]
fn files_that_do_not_load_are_refused_by_sl() {
    for line in [
        "POINT P=1,2,3,4,5,6,7,8,9/",
        "POINT P=1,2,3,4,5,6,7,8/32111",
        "WORK NOPE\nPOINT P=1,2,3/",
        "POINT ABCDEFGHIJK=1,2,3/",
        "POINT P 400,0,200/",
    ] {
        let mut robot = Robot::new(Dialect::Field);
        robot.connect(Port::Ip0);
        robot
            .seat
            .controller
            .put_file("GOOD", b"PROGRAM G\nEND\n")
            .unwrap();
        robot
            .seat
            .controller
            .put_file("BAD", format!("PROGRAM B\nEND\nDATA\n{line}\nEND\n").as_bytes())
            .unwrap();
        robot.command(Port::Ip0, "SL,GOOD");
        assert_eq!(robot.ask(Port::Ip0, "SL,BAD"), b"NG\r", "{line}");
        let status = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
        assert!(status.contains("FILE:GOOD "), "{line}: {status}");
    }
}

// clause: CMD-DL-07
#[test]
fn a_download_of_the_selected_file_acts_on_the_next_start() {
    let mut robot = Robot::ready("PROGRAM TEST\nPRINT IP1, \"OLD\"\nEND\n");
    robot.command(Port::Ip0, "DL,TEST");
    robot.send(Port::Ip0, b"FL,PROGRAM TEST\nPRINT IP1, \"NEW\"\nEND\n\x1A");
    assert_eq!(robot.received(Port::Ip0), b"\x02OK\r\x03");
    let status = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
    assert!(
        status.contains("FILE:TEST") && status.ends_with("stop(reset)"),
        "{status}"
    );
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Ip1), b"NEW");
}

// clause: CMD-RS-05 CMD-RS-06 T19
#[test]
fn rs_cyc_finds_the_label_of_the_file_as_it_was_downloaded_again() {
    let program = |label: &str| format!("PROGRAM TEST\nPRINT IP1, \"X\"\n{label}\nPRINT IP1, \"Y\"\nEND\n");
    for (label, rule, answer, printed) in [
        ("RCYCLE:", CycleWithoutLabel::Ng, b"OK\r", b"Y".as_slice()),
        ("OTHER:", CycleWithoutLabel::Ng, b"NG\r", b"XY"),
        ("OTHER:", CycleWithoutLabel::AsStep, b"OK\r", b"XY"),
    ] {
        let mut config = Config::new(Dialect::Field);
        config.options.cycle_without_label = rule;
        let mut robot = Robot::with(config);
        robot.load("TEST", "PROGRAM TEST\nRCYCLE:\nPRINT IP1, \"OLD\"\nEND\n");
        robot.connect(Port::Ip0);
        robot.connect(Port::Ip1);
        robot.panel(PanelAction::Servo(true));
        let stored = robot.seat.controller.put_file("TEST", program(label).as_bytes());
        stored.unwrap();
        assert_eq!(robot.ask(Port::Ip0, "RS,CYC"), answer, "{label}");
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(100);
        assert_eq!(robot.received(Port::Ip1), printed, "{label}");
    }
}
