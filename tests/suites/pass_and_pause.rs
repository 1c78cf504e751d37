//! Motions that overlap (PASS) or are held by a statement (PAUSE), and what becomes of them at a stop.
//!
//! How two motions overlap has unit tests in `ts3100-controller`; stops of a single motion are in `motion.rs`.

use crate::motion::{FAR, HOME, TRIP, distance, motion_status, position, until};
use ts3100_controller::{Action, Input, KeySwitch, PanelAction, Port};
use ts3100_tests::Robot;

#[test]
fn with_pass_the_frames_of_a_motion_hold_from_its_beginning_to_its_end() {
    let mut robot = Robot::ready(
        "PROGRAM P\nSPEED = 20\nPASS = 100\nMOVES A WITH WORK=W1, TOOL=T1\nMOVES B\nMOVES A WITH WORK=W2\nMOVES C\n\
         MOVES B WITH BASE=B1\nEND\nDATA\nTRANS W1=0,0,10\nTRANS W2=0,0,20\nTRANS T1=0,0,-10\nTRANS B1=0,5\n\
         POINT A=400,-200,200/\nPOINT B=400,200,200/\nWORK W1\nPOINT C=450,0,250/\nEND\n",
    );
    let shown = |robot: &Robot| {
        let controller = &robot.seat.controller;
        let frames = controller.frames();
        let name = |frame: scol_mini::Frame| frame.name.unwrap_or_default();
        let names = [controller.work_name(), name(frames.tool), name(frames.base)];
        (controller.steps().0, names.join(" "))
    };
    robot.command(Port::Ip0, "RN");
    let mut seen = Vec::new();
    for look in 0..2_000 {
        robot.advance_ms(10);
        // What is held keeps its frames too.
        if [30, 36].contains(&(look % 40)) {
            robot.command(Port::Ip0, "FD");
        }
        if !robot.seat.controller.is_arm_moving() {
            break;
        }
        let now = shown(&robot);
        if seen.last() != Some(&now) {
            seen.push(now);
        }
    }
    let expected = [(4, "W1 T1 "), (5, "  "), (6, "W2  "), (7, "W1  "), (8, "  B1")];
    let seen: Vec<(u32, &str)> = seen.iter().map(|(line, names)| (*line, names.as_str())).collect();
    assert_eq!(seen, expected);
    assert_eq!(shown(&robot).1, "  ", "at rest");
}

/// How near to the point the arm comes until the program stops, mm.
fn nearest(robot: &mut Robot, point: [f32; 3]) -> f32 {
    let mut least = f32::MAX;
    until(robot, "the program stops", |robot| {
        least = least.min(distance(position(robot), point));
        motion_status(robot) != 1
    });
    least
}

// clause: CMD-EC-04 CMD-RN-01
#[test]
fn with_pass_rn_begins_the_motion_anew_that_was_cut_short() {
    const TOP: [f32; 3] = [400.0, 0.0, 350.0];
    for behind in ["MOVES TOP", "MOVEJ TOP, POINT(30,20,20)", "MOVEA 1, 0"] {
        let program = TRIP.replace("PRINT IP1, \"2\"", &format!("{behind}\nMOVES HOME WITH SPEED=20"));
        let program = program.replace("POINT HOME", "POINT TOP=400,0,350/\nPOINT HOME");
        let mut robot = Robot::ready(&program.replace("TRIP\n", "TRIP\nPASS = 10\n"));
        robot.command(Port::Ip0, "RN");
        until(&mut robot, "HOME", |robot| robot.received(Port::Ip1) == b"1");
        robot.advance_ms(200);
        robot.command(Port::Ip0, "EC,BREAK");
        robot.advance_ms(1_000);
        let mut goes_on = robot.clone();
        goes_on.command(Port::Ip0, "RN");
        assert!(
            nearest(&mut goes_on, FAR) < 10.0,
            "{behind}: from where it was cut short"
        );
        robot.command(Port::Ip0, "DO,MOVE POINT(450,0,250)");
        robot.advance_ms(3_000);
        robot.command(Port::Ip0, "RN");
        assert!(nearest(&mut robot, FAR) < 10.0, "{behind}: from elsewhere");
        assert_eq!(robot.received(Port::Ip1), b"3", "{behind}");
    }
    // The first of the two is over: the second begins anew.
    let program = TRIP.replace(
        "PRINT IP1, \"2\"\nMOVE HOME",
        "MOVES TOP WITH SPEED=20\nMOVE HOME",
    );
    let program = program.replace("POINT HOME", "POINT TOP=400,0,350/\nPOINT HOME");
    let mut robot = Robot::ready(&program.replace("TRIP\n", "TRIP\nPASS = 10\n"));
    robot.command(Port::Ip0, "RN");
    until(&mut robot, "the way to TOP", |robot| {
        robot.seat.controller.steps().0 == 6
    });
    robot.advance_ms(300);
    robot.command(Port::Ip0, "EC,BREAK");
    robot.advance_ms(1_000);
    robot.command(Port::Ip0, "DO,MOVE POINT(450,-100,250)");
    robot.advance_ms(3_000);
    robot.command(Port::Ip0, "RN");
    let mut other = robot.clone();
    assert!(nearest(&mut robot, TOP) < 10.0);
    assert!(nearest(&mut other, FAR) > 50.0);
}

/// PAUSE holds the way to FAR, and this follows it.
fn paused(next: &str) -> Robot {
    let program = TRIP.replace("MOVES FAR", "ENABLE NOWAIT\nMOVES FAR");
    let held = format!("WAIT MOTION >= 20\nPAUSE\n{next}\nWAIT MOTION >= 100\nPRINT IP1, \"2\"");
    let mut robot = Robot::ready(&program.replace("PRINT IP1, \"2\"", &held));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(3_000);
    assert_eq!(robot.received(Port::Ip1), b"1", "{next}");
    robot
}

// clause: CMD-SP-03 CMD-RN-02
#[test]
fn while_pause_holds_a_motion_a_stop_stops_and_a_start_goes_on_with_it() {
    type Act = fn(&mut Robot);
    let stop: Act = |robot| robot.panel(PanelAction::Stop);
    let alarm: Act = |robot| {
        let (number, detail) = ("2-046".to_string(), String::new());
        robot.feed(Input::by_owner(Action::RaiseAlarm { number, detail }));
    };
    let signal: Act = |robot| robot.panel(PanelAction::InputLine { line: 257, on: true });
    let key: Act = |robot| {
        robot.panel(PanelAction::Key(KeySwitch::Teaching));
        robot.panel(PanelAction::Key(KeySwitch::Ext));
    };
    let sp: Act = |robot| robot.command(Port::Ip0, "SP");
    let nothing: Act = |_| {};
    for (what, next, act) in [
        ("STOP at the panel", "MOVE HOME", stop),
        ("STOP at the panel", "WAIT DIN(1)", stop),
        ("STOP at the panel", "OPEN1", stop),
        ("an alarm", "WAIT MOTION >= 100", alarm),
        ("the signal STOP", "OPEN1", signal),
        ("the key", "MOVE HOME", key),
        ("SP", "MOVE HOME", sp),
        ("SP", "WAIT DIN(1)", sp),
        ("the statement STOP", "STOP", nothing),
        ("a fault", "A = 1 / 0", nothing),
    ] {
        let mut robot = paused(next);
        act(&mut robot);
        robot.advance_ms(500);
        let rest = position(&mut robot);
        assert!(
            distance(rest, FAR) > 1.0 && distance(rest, HOME) > 1.0,
            "{what}: {rest:?}"
        );
        assert_eq!(motion_status(&mut robot), 2, "{what} during {next}");
        robot.advance_ms(5_000);
        assert_eq!(position(&mut robot), rest, "{what} during {next}");
        robot.panel(PanelAction::InputLine { line: 1, on: true });
        robot.panel(PanelAction::Start);
        assert!(nearest(&mut robot, FAR) < 1.0, "{what} during {next}");
        assert_eq!(robot.received(Port::Ip1), b"23", "{what} during {next}");
    }
}

#[test]
fn delay_counts_while_pause_holds_the_motion() {
    let mut robot = paused("DELAY 4.0\nRESUME");
    let held = position(&mut robot);
    assert_eq!(motion_status(&mut robot), 1);
    robot.advance_ms(1_000);
    assert_eq!(position(&mut robot), held);
    assert!(nearest(&mut robot, FAR) < 1.0);
    assert_eq!(robot.received(Port::Ip1), b"23");
    // One that waited for the motion goes on waiting.
    let waits = "I = TASK(\"HOLD\")\nENABLE NOWAIT\nMOVES FAR WITH SPEED=20\nDELAY 0.5\nPRINT IP1, HERE.Y\nEND\n\
        PROGRAM HOLD\nWAIT MOTION < 100\nWAIT MOTION >= 20\nPAUSE\nDELAY 4\nRESUME\nEND\nDATA";
    let (head, data) = TRIP.split_once("DATA").unwrap();
    let moves = head.find("PRINT").unwrap();
    let mut robot = Robot::ready(&format!("{}{waits}{data}", &head[..moves]));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(4_000);
    assert!(distance(position(&mut robot), FAR) > 1.0);
    until(&mut robot, "the end", |robot| motion_status(robot) == 0);
    assert_eq!(robot.received(Port::Ip1), b"     200.000");
}
