//! Clauses proven by what a host sends and receives, where the crates have unit tests only, and what a snapshot has to
//! restore for the wire to go on.
//!
//! `manual_clauses.rs` has the examples of the manual.

use super::extensions::text;
use ts3100_controller::faults::FaultAction;
use ts3100_controller::{Config, Controller, Dialect, Event, Output, PanelAction, Port};
use ts3100_tests::{Robot, frame};

fn field() -> Robot {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    let mut robot = Robot::with(config);
    for port in [Port::Ip0, Port::Ip1, Port::Com1] {
        robot.connect(port);
    }
    robot.panel(PanelAction::Servo(true));
    robot
}

fn download(robot: &mut Robot, name: &str, content: &str) {
    robot.command(Port::Ip0, &format!("DL,{name}"));
    for block in [b"FL,", content.as_bytes(), b"\x1A"].concat().chunks(253) {
        robot.send(Port::Ip0, block);
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    }
}

/// Downloads, selects and starts.
fn run(robot: &mut Robot, content: &str) {
    download(robot, "TEST", content);
    robot.command(Port::Ip0, "SL,TEST");
    robot.command(Port::Ip0, "RN");
}

fn status(robot: &mut Robot) -> String {
    text(robot, "SU").rsplit_once("STATUS:").unwrap().1.to_string()
}

fn variable(robot: &mut Robot, name: &str) -> String {
    text(robot, &format!("MR,{name} 0")).trim().to_string()
}

/// A block of eight floats of SF.
fn block(robot: &mut Robot, offset: usize) -> [f32; 8] {
    let body = robot.total(Port::Ip0);
    std::array::from_fn(|index| {
        let at = offset + 4 * index;
        f32::from_be_bytes(body[at..at + 4].try_into().unwrap())
    })
}

fn near(found: &[f32], expected: &[f32]) {
    let same = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.01);
    assert!(same, "{found:?}, {expected:?} expected");
}

const JOINTS: usize = 116;
const WORLD: usize = 148;
const WORK: usize = 180;

// clause: INP-12
#[test]
fn an_input_that_do_executes_waits_for_its_data() {
    let mut robot = field();
    download(&mut robot, "TEST", "GLOBAL\nN = 7\nEND\nPROGRAM T\nEND\n");
    robot.command(Port::Ip0, "SL,TEST");
    robot.command(Port::Ip0, "DO,INPUT COM1,N");
    robot.advance_ms(60_000);
    assert_eq!(variable(&mut robot, "N"), "7");
    assert_eq!(robot.total(Port::Ip0)[2], 1, "it waits");
    robot.raw(Port::Com1, b"4");
    robot.advance_ms(1_000);
    assert_eq!(variable(&mut robot, "N"), "7", "the record has no end yet");
    robot.raw(Port::Com1, b"\r");
    robot.advance_ms(1_000);
    assert_eq!(variable(&mut robot, "N"), "4");
    assert_eq!(robot.total(Port::Ip0)[2], 0);
}

/// Changes a value of ETHERNET.PAR as a host does, and turns the power off and on.
fn edit(robot: &mut Robot, section: &str, from: &str, to: &str) {
    let content = text(robot, "UL,ETHERNET.PAR");
    let at = content.find(&format!("[{section}]")).unwrap();
    let (before, rest) = content.split_at(at);
    let changed = format!("{before}{}", rest.replacen(from, to, 1));
    assert_ne!(changed, content);
    download(robot, "ETHERNET.PAR", &changed);
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
    assert_eq!(text(robot, "UL,ETHERNET.PAR"), changed);
}

/// All that a host and the pendant see but for the file itself: SF, SU, the alarms, CA, the display.
fn seen(robot: &mut Robot) -> (Vec<u8>, String, String, String, Vec<String>) {
    let pages = robot.seat.controller.ethernet_pages().into_iter();
    let lines = pages.flat_map(|page| page.lines).collect();
    (
        robot.total(Port::Ip0),
        text(robot, "SU"),
        text(robot, "EU"),
        text(robot, "CA"),
        lines,
    )
}

// clause: PAR-E08-01 PAR-E09-01
#[test]
fn the_reserved_parameters_change_their_file_and_nothing_else() {
    for (section, from, to) in [("E08", "NO1-TS3K", "SECRET-8"), ("E09", "= 0", "= 1")] {
        let mut robot = field();
        robot.panel(PanelAction::PowerCycle);
        robot.connect(Port::Ip0);
        let before = seen(&mut robot);
        assert!(before.4.iter().any(|line| line.contains("192.168.0.124")));
        edit(&mut robot, section, from, to);
        assert_eq!(seen(&mut robot), before, "{section}");
    }
}

/// The listing of 4.2.2 reads `INPUT X,Y,...`, without the channel that its heading names.
const LISTING: &str = "PROGRAM ABSOLUT\nX = 0.0\nY = 0.0\nZ = 0.0\nA = 0.0\nB = 0.0\nC = 0.0\nU = 0.0\nV = 0.0\n\
    PRINT COM1,\"REQ\"\nINPUT X,Y,Z,A,B,C,U,V,SUM\nIF SUM==X+Y+Z+A+B+C+U+V+1 THEN GOTO ACTION\n\
    PRINT COM1,\"NG\"\nGOTO FIN\nACTION:\nPRINT COM1,\"OK\"\nP1=POINT(X,Y,Z,A,B,C,U,V,00000)\nMOVE P1\nFIN:\nEND\n";

// clause: EXAMPLE-06
#[test]
fn the_listing_without_a_channel_waits_for_the_pendant_and_with_it_for_com1() {
    let record = "400,0,200,0,0,0,0,0,601\r";
    let arrived = |robot: &mut Robot| {
        robot.advance_ms(10_000);
        near(&block(robot, WORLD)[..3], &[400.0, 0.0, 200.0]);
        assert_eq!(status(robot), "stop(reset)");
        assert_eq!(robot.received(Port::Com1), b"OK");
    };
    let mut robot = field();
    run(&mut robot, LISTING);
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Com1), b"REQ");
    robot.raw(Port::Com1, record.as_bytes());
    robot.advance_ms(60_000);
    assert_eq!(
        (status(&mut robot).as_str(), robot.received(Port::Com1)),
        ("running", Vec::new())
    );
    robot.panel(PanelAction::Keys(record.to_string()));
    arrived(&mut robot);

    let mut robot = field();
    run(&mut robot, &LISTING.replace("INPUT X", "INPUT COM1,X"));
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Com1), b"REQ");
    robot.panel(PanelAction::Keys(record.to_string()));
    robot.advance_ms(60_000);
    assert_eq!(
        (status(&mut robot).as_str(), robot.received(Port::Com1)),
        ("running", Vec::new())
    );
    robot.raw(Port::Com1, record.as_bytes());
    arrived(&mut robot);
}

// clause: SF-43
#[test]
fn sf_has_degrees_for_joints_millimetres_and_degrees_for_positions_and_nothing_of_axes_7_and_8() {
    let mut robot = field();
    let (joints, world) = (block(&mut robot, JOINTS), block(&mut robot, WORLD));
    let radius = world[0];
    near(&world[1..6], &[0.0, world[2], 0.0, 0.0, 0.0]);
    robot.command(Port::Ip0, "DO,MOVEA 1, 30");
    robot.advance_ms(5_000);
    let turned = block(&mut robot, JOINTS);
    assert!((turned[0] - 30.0).abs() < 0.001, "{turned:?}");
    near(&turned[1..], &joints[1..]);
    let (x, y) = (radius * 0.866_025_4, radius * 0.5);
    let expected = [x, y, world[2], 0.0, 0.0, 30.0, 0.0, 0.0];
    near(&block(&mut robot, WORLD), &expected);
    near(&block(&mut robot, WORK), &expected);
    robot.command(Port::Ip0, "DO,MOVE POINT(400,-100,200,0,0,45)");
    robot.advance_ms(5_000);
    for offset in [WORLD, WORK] {
        near(
            &block(&mut robot, offset),
            &[400.0, -100.0, 200.0, 0.0, 0.0, 45.0, 0.0, 0.0],
        );
    }
    let body = robot.total(Port::Ip0);
    for unused in [140, 172, 204] {
        assert_eq!(body[unused..unused + 8], [0; 8], "{unused}");
    }
}

// clause: DATA-09
#[test]
fn work_makes_the_position_on_the_next_line_relative_and_no_other() {
    let mut robot = field();
    let program = "PROGRAM T\nMOVE A11\nSTOP\nMOVE A12\nEND\nDATA\nTRANS W1=400,200,50,0,0,0\nWORK W1\n\
        POINT A11=50,0,60,0,0,0,0,0/\nPOINT A12=400,200,150,0,0,0,0,0/\nEND\n";
    run(&mut robot, program);
    robot.advance_ms(5_000);
    near(&block(&mut robot, WORLD)[..3], &[450.0, 200.0, 110.0]);
    near(&block(&mut robot, WORK)[..3], &[50.0, 0.0, 60.0]);
    assert_eq!(robot.total(Port::Ip0)[212..215], *b"W1\0");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(5_000);
    for offset in [WORLD, WORK] {
        near(&block(&mut robot, offset)[..3], &[400.0, 200.0, 150.0]);
    }
    assert_eq!(robot.total(Port::Ip0)[212..214], [0, 0]);
}

/// The example of 5.4.1 (3), with the names HAND1 and HAND2 that the print splits, and the `=` of A2 that it has as a
/// minus sign.
const EXAMPLE: &str = "GLOBAL\nA = 10\nEND\nPROGRAM SAMPLE\nSPEED = 20\nMOVE A1\nMOVE A2\nMOVE A3\nSUB1\nMOVE A3\nMOVE A2\n\
    MOVE A4\nMOVE A5\nSUB2\nMOVE A5\nMOVE A4\nMOVE A1\nEND\nPROGRAM SUB1\nPAYLOAD = HAND1\nMOVE A11\nMOVE A12\nMOVE A13\n\
    FREELOAD\nEND\nPROGRAM SUB2\nPAYLOAD = HAND2\nMOVE A21\nMOVE A22\nMOVE A23\nFREELOAD\nEND\nDATA\n\
    POINT A1=400,0,200,0,0,0,0,0/\nPOINT A2=400,200,200,0,0,0,0,0/\nPOINT A3=400,200,50,0,0,0,0,0/\n\
    POINT A4=400,-200,200,0,0,0,0,0/\nPOINT A5=400,-200,50,0,0,0,0,0/\nTRANS W1=400,200,50,90,0,0\n\
    TRANS W2=400,-200,50,0,0,0\nPAYLOAD HAND1=3,100\nPAYLOAD HAND2=5,0\nWORK W1\nPOINT A11=50,0,60,-45,0,0,0,0/\n\
    WORK W1\nPOINT A12=0,50,70,0,0,0,0,0/\nWORK W1\nPOINT A13=-50,0,60,45,0,0,0,0/\nWORK W2\n\
    POINT A21=-80,0,60,30,0,0,0,0/\nWORK W2\nPOINT A22=0,30,70,0,0,0,0,0/\nWORK W2\nPOINT A23=-80,0,60,-30,0,0,0,0/\nEND\n";

// clause: RAM-04 RAM-13
#[test]
fn the_example_of_a_user_file_comes_back_as_it_was_sent_and_runs_to_its_end() {
    let mut robot = field();
    download(&mut robot, "TEST", EXAMPLE);
    assert_eq!(robot.file(Port::Ip0, "UL,TEST"), EXAMPLE.as_bytes());
    robot.command(Port::Ip0, "SL,TEST");
    robot.command(Port::Ip0, "RN");
    let mut lines = Vec::new();
    for _ in 0..6_000 {
        let body = robot.total(Port::Ip0);
        if body[2] != 1 {
            break;
        }
        lines.push(super::extensions::word(&body, 24));
        robot.advance_ms(10);
    }
    lines.dedup();
    assert_eq!(robot.alarms(), Vec::<String>::new());
    assert_eq!(status(&mut robot), "stop(reset)");
    let moves = [6, 7, 8, 21, 22, 23, 10, 11, 12, 13, 28, 29, 30, 15, 16, 17];
    assert_eq!(lines, moves, "each MOVE in its turn");
    near(&block(&mut robot, WORLD)[..3], &[400.0, 0.0, 200.0]);
    assert_eq!(robot.file(Port::Ip0, "UL,TEST"), EXAMPLE.as_bytes());
}

// clause: FRM-12
#[test]
fn blanks_colons_and_underscores_are_characters_of_texts_and_files() {
    let content = "PROGRAM T_1\nSTART:\n  N = 2 \n  PRINT IP1, \"A: b_c ; ~\", N, CR\nEND\n";
    let mut robot = field();
    run(&mut robot, content);
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Ip1), b"A: b_c ; ~           2\r");
    robot.received(Port::Ip0);
    assert_eq!(robot.file(Port::Ip0, "UL,TEST"), content.as_bytes());
    robot.command(Port::Ip0, "DO,PRINT IP1, \"D_O: 1\", CR");
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Ip1), b"D_O: 1\r");
}

// clause: CMD-RS-05
#[test]
fn rs_cyc_forgets_the_motion_that_was_interrupted() {
    let mut robot = field();
    run(
        &mut robot,
        "PROGRAM T\nDELAY 0.1\nRCYCLE:\nMOVEI 1, 60 WITH SPEED=10\nEND\n",
    );
    robot.advance_ms(1_100);
    robot.command(Port::Ip0, "EC,BREAK");
    robot.advance_ms(500);
    let stopped = block(&mut robot, JOINTS)[0];
    assert!((20.0..30.0).contains(&stopped), "{stopped}");
    assert_eq!(status(&mut robot), "stop(retry)");
    robot.command(Port::Ip0, "RS,CYC");
    assert_eq!(status(&mut robot), "stop(continue)");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(5_000);
    let ended = block(&mut robot, JOINTS)[0];
    assert!(
        (ended - stopped - 60.0).abs() < 0.001,
        "{stopped} to {ended}: the whole motion, not its rest"
    );
}

/// Written down and read back.
fn restored(robot: &Robot) -> Robot {
    Robot::from_controller(Controller::restore(robot.seat.controller.snapshot()).unwrap())
}

#[test]
fn a_snapshot_restores_typed_keys() {
    let mut robot = field();
    run(
        &mut robot,
        "PROGRAM T\nN = 0\nDELAY 1\nINPUT TP, N\nPRINT IP1, N, CR\nEND\n",
    );
    robot.panel(PanelAction::Keys("12\r".to_string()));
    let mut robot = restored(&robot);
    robot.advance_ms(2_000);
    assert_eq!(robot.received(Port::Ip1), b"          12\r");
}

#[test]
fn a_snapshot_restores_queued_texts() {
    let mut robot = field();
    let late = "late-reply:command=SP,delay=1500".parse().unwrap();
    robot.feed(FaultAction::Arm(Box::new(late)).into());
    robot.send(Port::Ip0, b"SP\r");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip0), b"");
    let mut robot = restored(&robot);
    robot.advance_ms(499);
    assert_eq!(robot.received(Port::Ip0), b"");
    robot.advance_ms(1);
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
}

#[test]
fn a_snapshot_restores_tracing() {
    for traced in [false, true] {
        let mut robot = field();
        run(&mut robot, "PROGRAM T\nDELAY 1\nN = 1\nEND\n");
        robot.seat.controller.trace(traced);
        let mut robot = restored(&robot);
        robot.advance_ms(2_000);
        let is_trace = |output: &Output| matches!(output, Output::Event(Event::Statement { line: 3, .. }));
        assert_eq!(robot.outputs.iter().any(is_trace), traced);
    }
}
