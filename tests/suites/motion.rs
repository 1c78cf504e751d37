//! Motion as a host sees it: it takes time, it can be stopped, held and overridden, and DO answers before it ends.
//!
//! The closed forms have unit tests in `ts3100-controller`; independence of polling is in `polling_independence.rs`.

use ts3100_controller::{Config, ControlRight, Dialect, KeySwitch, PanelAction, Port};
use ts3100_tests::{Robot, frame};

pub const TRIP: &str = "PROGRAM TRIP\nMOVE HOME\nPRINT IP1, \"1\"\nMOVES FAR WITH SPEED=20\nPRINT IP1, \"2\"\nMOVE HOME\n\
    PRINT IP1, \"3\"\nEND\nDATA\nPOINT HOME=400,-200,200,0,0,0,0,0/\nPOINT FAR=400,200,200,0,0,0,0,0/\nEND\n";
const WORLD: usize = 148;
pub const HOME: [f32; 3] = [400.0, -200.0, 200.0];
pub const FAR: [f32; 3] = [400.0, 200.0, 200.0];

pub fn position(robot: &mut Robot) -> [f32; 3] {
    let body = robot.total(Port::Ip0);
    let float = |at: usize| f32::from_be_bytes(body[at..at + 4].try_into().unwrap());
    [float(WORLD), float(WORLD + 4), float(WORLD + 8)]
}

pub fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt()
}

pub fn motion_status(robot: &mut Robot) -> u8 {
    robot.total(Port::Ip0)[2]
}

/// On the way from HOME to FAR.
fn under_way() -> Robot {
    let mut robot = Robot::ready(TRIP);
    robot.command(Port::Ip0, "RN");
    for _ in 0..2_000 {
        robot.advance_ms(10);
        if robot.received(Port::Ip1) == b"1" {
            robot.advance_ms(200);
            return robot;
        }
    }
    panic!("HOME is not reached within 20 s");
}

pub fn until(robot: &mut Robot, what: &str, mut condition: impl FnMut(&mut Robot) -> bool) {
    for _ in 0..3_000 {
        if condition(robot) {
            return;
        }
        robot.advance_ms(10);
    }
    panic!("{what}: not within 30 s");
}

// clause: CMD-SU-02 SF-42 SF-06 CMD-RN-01
#[test]
fn positions_change_while_it_moves_and_stay_on_the_line() {
    let mut robot = under_way();
    let mut last = position(&mut robot);
    for _ in 0..20 {
        robot.advance_ms(20);
        let here = position(&mut robot);
        assert_eq!(motion_status(&mut robot), 1);
        assert!(here[1] > last[1] && here[1] < FAR[1], "{here:?} after {last:?}");
        assert!(
            (here[0] - 400.0).abs() < 0.01 && (here[2] - 200.0).abs() < 0.01,
            "{here:?} is off the line"
        );
        last = here;
    }
}

// clause: CMD-SP-01 CMD-SP-02 CMD-SP-03 CMD-RN-02 CMD-SP-09
#[test]
fn sp_completes_the_step_and_rn_goes_on_behind_it() {
    let mut robot = under_way();
    robot.command(Port::Ip0, "SP");
    until(&mut robot, "the step ends", |robot| motion_status(robot) == 3);
    assert!(distance(position(&mut robot), FAR) < 0.01);
    robot.advance_ms(5_000);
    assert_eq!(robot.received(Port::Ip1), b"");
    assert_eq!(
        robot.received(Port::Ip0),
        b"",
        "no SP for a stop that the host requested"
    );
    robot.command(Port::Ip0, "RN");
    until(&mut robot, "the end", |robot| motion_status(robot) == 0);
    assert_eq!(robot.received(Port::Ip1), b"23");
    assert!(distance(position(&mut robot), HOME) < 0.01);
}

// clause: CMD-EC-04 CMD-BR-02 SU-08
#[test]
fn break_stops_between_the_points_and_rn_repeats_the_move() {
    for stop in ["EC,BREAK", "BR"] {
        let mut robot = under_way();
        robot.command(Port::Ip0, stop);
        robot.advance_ms(1_000);
        let rest = position(&mut robot);
        assert!(
            distance(rest, FAR) > 1.0 && distance(rest, HOME) > 1.0,
            "{stop}: {rest:?}"
        );
        assert_eq!(motion_status(&mut robot), 2, "{stop}");
        robot.advance_ms(5_000);
        assert_eq!(position(&mut robot), rest, "{stop}");
        assert_eq!(robot.received(Port::Ip0), b"", "{stop}: no SP");
        if stop == "BR" {
            assert_eq!(robot.ask(Port::Ip0, "RN"), b"NG\r");
            robot.command(Port::Ip0, "SO");
        }
        robot.command(Port::Ip0, "RN");
        until(&mut robot, "FAR", |robot| {
            robot.unread().iter().any(|(port, _)| *port == Port::Ip1)
        });
        assert_eq!(robot.received(Port::Ip1), b"2", "{stop}");
        assert!(distance(position(&mut robot), FAR) < 3.0, "{stop}");
    }
}

// clause: CMD-FD-01 CMD-FD-02 CMD-FD-03 SF-13 CMD-DO-03
#[test]
fn feed_hold_stops_the_arm_and_lets_it_go_on() {
    let mut robot = under_way();
    robot.command(Port::Ip0, "FD");
    robot.advance_ms(1_000);
    let rest = position(&mut robot);
    robot.advance_ms(2_000);
    assert_eq!(position(&mut robot), rest);
    let body = robot.total(Port::Ip0);
    assert_eq!((body[2], &body[32..34]), (1, [0, 1].as_slice()));
    assert!(distance(rest, FAR) > 1.0);
    assert_eq!(robot.ask(Port::Ip0, "DO,DOUT(1)"), b"NG\r");
    robot.command(Port::Ip0, "FD");
    until(&mut robot, "FAR", |robot| robot.received(Port::Ip1) == b"2");
    assert_eq!(robot.total(Port::Ip0)[32..34], [0, 0]);
    assert_eq!(robot.received(Port::Ip0), b"");
}

// clause: CMD-FD-03
#[test]
fn sp_during_feed_hold_stops_and_releases() {
    let mut robot = under_way();
    robot.command(Port::Ip0, "FD");
    robot.advance_ms(1_000);
    let rest = position(&mut robot);
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(1_000);
    let body = robot.total(Port::Ip0);
    assert_eq!((body[2], &body[32..34]), (2, [0, 0].as_slice()));
    assert_eq!(position(&mut robot), rest);
}

// clause: CMD-DO-01 CMD-DO-02 CMD-DO-04
#[test]
fn do_answers_before_the_motion_ends() {
    let mut robot = Robot::ready("PROGRAM NONE\nEND\n");
    robot.command(Port::Ip0, "DO,MOVE POINT(400,-200,200)");
    until(&mut robot, "HOME", |robot| motion_status(robot) != 1);
    robot.command(Port::Ip0, "DO,MOVE POINT(400,200,200) WITH SPEED=50");
    let mut polls = 0;
    loop {
        let here = position(&mut robot);
        if motion_status(&mut robot) != 1 {
            assert!(distance(here, FAR) < 0.01, "{here:?} at rest");
            break;
        }
        assert_eq!(robot.ask(Port::Ip0, "DO,MOVE POINT(400,0,200)"), b"NG\r");
        assert_eq!(robot.ask(Port::Ip0, "RN"), b"NG\r");
        robot.advance_ms(20);
        polls += 1;
        assert!(polls < 3_000, "the motion never ends");
    }
    assert!(polls > 10, "the motion takes its time: {polls} polls");
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip0), b"", "the end of a DO sends no SP");
}

// clause: CMD-DO-02
#[test]
fn a_do_of_no_length_shows_run_for_200_ms() {
    let far = "DO,MOVE POINT(2000.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0)";
    for statement in [
        "DO,DOUT(1)",
        "DO,MOVE HERE",
        "DO,SPEED=50",
        far,
        "DO,PRINT IP2, 1",
    ] {
        let mut robot = Robot::ready("PROGRAM NONE\nEND\n");
        robot.command(Port::Ip0, statement);
        assert_eq!(motion_status(&mut robot), 1, "{statement}");
        robot.advance_ms(190);
        assert_eq!(motion_status(&mut robot), 1, "{statement}");
        robot.advance_ms(20);
        assert_eq!(motion_status(&mut robot), 0, "{statement}");
    }
}

// clause: CMD-DO-02
#[test]
fn a_do_that_is_over_refuses_nothing_while_run_shows() {
    let mut robot = Robot::ready("PROGRAM LONG\nDELAY 1.0\nEND\n");
    for command in [
        "DO,SPEED=50",
        "DO,DOUT(1)",
        "EC,MODE STEP",
        "RS,PRG",
        "DO,DOUT(2)",
        "SL,TEST",
        "RN",
    ] {
        robot.command(Port::Ip0, command);
        assert_eq!(
            motion_status(&mut robot),
            u8::from(!matches!(command, "RS,PRG" | "SL,TEST")),
            "{command}"
        );
    }
}

// clause: PRM-SPD-01 PRM-SPD-02
#[test]
fn teaching_is_slow() {
    let seconds = |key: KeySwitch| {
        let mut robot = Robot::with(Config {
            key,
            control_right: ControlRight::Ether,
            ..Config::new(Dialect::Field)
        });
        robot.load(
            "TEST",
            "PROGRAM T\nMOVE A\nPRINT IP1, \"1\"\nMOVES B\nPRINT IP1, \"2\"\nEND\nDATA\n\
            POINT A=400,-250,200,0,0,0,0,0/\nPOINT B=400,250,200,0,0,0,0,0/\nEND\n",
        );
        robot.connect(Port::Ip0);
        robot.connect(Port::Ip1);
        robot.panel(PanelAction::Servo(true));
        robot.panel(PanelAction::Start);
        until(&mut robot, "A", |robot| robot.received(Port::Ip1) == b"1");
        let start = robot.now();
        let mut last = position(&mut robot);
        until(&mut robot, "B", |robot| {
            robot.received(Port::Ip1) == b"2" || {
                let clone = &mut robot.clone();
                clone.advance_ms(10);
                let step = distance(position(clone), position(robot));
                assert!(
                    key != KeySwitch::Teaching || step <= 2.5 + 0.001,
                    "{step} mm in 10 ms"
                );
                false
            }
        });
        last[1] = position(&mut robot)[1];
        assert!((last[1] - 250.0).abs() < 0.01);
        robot.now().since(start).as_secs_f64()
    };
    let teaching = seconds(KeySwitch::Teaching);
    let external = seconds(KeySwitch::Internal);
    assert!(teaching >= 2.0, "500 mm in {teaching} s");
    assert!(external < teaching, "{external} s against {teaching} s");
}

// clause: CMD-EC-02 SU-06
#[test]
fn the_override_slows_every_motion() {
    let seconds = |percent: &str| {
        let mut robot = Robot::ready(TRIP);
        robot.command(Port::Ip0, &format!("EC,OVRD {percent}"));
        robot.command(Port::Ip0, "RN");
        until(&mut robot, "HOME", |robot| robot.received(Port::Ip1) == b"1");
        let start = robot.now();
        until(&mut robot, "FAR", |robot| robot.received(Port::Ip1) == b"2");
        robot.now().since(start).as_secs_f64()
    };
    let (full, half) = (seconds("100"), seconds("50"));
    assert!(half > 1.5 * full && half < 2.5 * full, "{full} s and {half} s");
}

// clause: SF-05 CMD-SO-02 CMD-SP-05 CMD-RN-05 I15 L35
#[test]
fn the_emergency_stop_ends_everything_and_tells_the_host() {
    let mut robot = under_way();
    robot.panel(PanelAction::EmergencyStop(true));
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    robot.advance_ms(1_000);
    let body = robot.total(Port::Ip0);
    assert_eq!(body[..3], [0, 1, 2], "servo off, emergency stop on, stop (retry)");
    assert_eq!(body[4..6], [0, 13], "8-014");
    assert_eq!(robot.ask(Port::Ip0, "SO"), b"NG\r");
    robot.panel(PanelAction::EmergencyStop(false));
    robot.panel(PanelAction::AlarmReset);
    robot.command(Port::Ip0, "SO");
    let body = robot.total(Port::Ip0);
    assert_eq!(body[..2], [1, 0]);
    assert_eq!(body[4..24], [0xFF; 20], "none of the ten");
    robot.command(Port::Ip0, "RN");
    until(&mut robot, "FAR", |robot| robot.received(Port::Ip1) == b"2");
}

// clause: SU-09
#[test]
fn under_machine_lock_the_arm_stands_and_the_program_runs() {
    let mut robot = Robot::ready(TRIP);
    robot.panel(PanelAction::MachineLock(true));
    let before = position(&mut robot);
    let status = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
    assert!(status.contains("MACHINE:lock"), "{status}");
    robot.command(Port::Ip0, "RN");
    until(&mut robot, "the end", |robot| motion_status(robot) == 0);
    assert_eq!(robot.received(Port::Ip1), b"123");
    assert_eq!(position(&mut robot), before);
}

// clause: SU-09
#[test]
fn under_machine_lock_an_interrupted_motion_is_not_taken_up() {
    let mut robot = under_way();
    robot.command(Port::Ip0, "BR");
    robot.advance_ms(1_000);
    robot.panel(PanelAction::MachineLock(true));
    robot.command(Port::Ip0, "SO");
    let before = position(&mut robot);
    robot.command(Port::Ip0, "RN");
    until(&mut robot, "the end", |robot| {
        assert_eq!(position(robot), before);
        motion_status(robot) == 0
    });
    assert_eq!(robot.received(Port::Ip1), b"23");
}

#[test]
fn a_direct_motion_that_is_broken_off_ends_when_the_arm_rests() {
    let mut robot = Robot::ready("PROGRAM T\nEND\n");
    robot.command(Port::Ip0, "DO,MOVEA 1, 60");
    robot.advance_ms(300);
    robot.command(Port::Ip0, "EC,BREAK");
    let busy = |robot: &mut Robot| {
        let status = String::from_utf8(robot.file(Port::Ip0, "SM,1")).unwrap();
        status.ends_with("DS1")
    };
    let mut slowing = 0;
    while robot.seat.controller.is_arm_moving() {
        assert!(busy(&mut robot), "after {slowing} ms");
        robot.advance_ms(1);
        slowing += 1;
    }
    assert!(slowing > 10, "{slowing} ms");
    robot.advance_ms(1);
    assert!(!busy(&mut robot));
}

// clause: CMD-SP-07 CMD-SP-10 SEQ-02
#[test]
fn the_unsolicited_sp_never_lands_inside_an_exchange() {
    let mut robot = Robot::ready("PROGRAM SHORT\nDELAY 1.0\nEND\n");
    robot.connect(Port::Host);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(900);
    assert!(robot.ask(Port::Ip0, "SU").ends_with(b"STATUS:running\x1A"));
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Ip0), b"");
    assert_eq!(
        robot.received(Port::Host),
        frame(b"SP\r"),
        "the other port gets SP at once"
    );
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(900);
    robot.raw(Port::Ip0, b"\x02S");
    robot.advance_ms(500);
    assert_eq!(robot.received(Port::Ip0), b"", "not inside a text either");
    robot.raw(Port::Ip0, b"U\r\x03");
    let answer = robot.received(Port::Ip0);
    assert!(answer.starts_with(b"\x02FL,MODE:"), "{answer:02x?}");
    robot.send(Port::Ip0, b"OK\r");
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

// clause: SEQ-01
#[test]
fn the_same_run_whatever_the_polling() {
    let trace = |step: u64| {
        let mut robot = Robot::ready(TRIP);
        robot.command(Port::Ip0, "RN");
        for _ in 0..(2_000 / step) {
            robot.advance_ms(step);
        }
        (
            robot.total(Port::Ip0),
            robot.received(Port::Ip1),
            robot.received(Port::Ip0),
        )
    };
    let once = trace(2_000);
    assert_eq!(trace(1), once);
    assert_eq!(trace(50), once);
}

/// The alarms of one DO, sent a second after a MOVE to HOME, and whether the arm stayed there.
fn refused(statements: &[&str]) -> (Vec<String>, bool) {
    let mut robot = Robot::ready("PROGRAM NONE\nEND\n");
    robot.command(Port::Ip0, "DO,MOVE POINT(400,-200,200)");
    robot.advance_ms(5_000);
    for statement in statements {
        robot.command(Port::Ip0, &format!("DO,{statement}"));
        robot.advance_ms(5_000);
    }
    let alarms = robot.alarms();
    robot.command(Port::Ip0, "RS,ERR");
    robot.command(Port::Ip0, "SO");
    // The flange: SF shows the tool point.
    robot.command(Port::Ip0, "DO,TOOL=TRANS(0,0,0)");
    let stayed = distance(position(&mut robot), HOME) < 0.01;
    (alarms, stayed)
}

// clause: DATA-01
#[test]
fn tool_and_frames_count_for_reach_and_for_the_path() {
    let reached = |statements: &[&str]| assert_eq!(refused(statements), (vec![], false), "{statements:?}");
    let out = |statements: &[&str]| {
        let (alarms, stayed) = refused(statements);
        assert_eq!(alarms, ["8-035"], "{statements:?}");
        assert!(stayed, "{statements:?}");
    };
    let far = "MOVE POINT(900,0,300)";
    for (place, line) in [("MOVE", "MOVES"), ("MOVES", "MOVE")] {
        out(&[&far.replace("MOVE", place)]);
        // A tool that sticks out 200 mm to the front reaches there, one that points back does not reach 700.
        reached(&["TOOL=TRANS(200,0,0)", &far.replace("MOVE", line)]);
        reached(&[&format!("{place} POINT(600,0,300)")]);
        out(&["TOOL=TRANS(-300,0,0)", &format!("{place} POINT(600,0,300)")]);
        // The same place in frames that lie elsewhere.
        out(&["BASE=TRANS(300,0,0)", &format!("{place} POINT(600,0,300)")]);
        out(&["WORK=TRANS(0,0,800)", &format!("{place} POINT(600,0,300)")]);
        reached(&["BASE=TRANS(-300,0,0)", &format!("{place} POINT(900,0,300)")]);
    }
}

#[test]
fn a_singular_posture_has_an_alarm_of_its_own() {
    let (alarms, _) = refused(&["MOVE POINT(437,0,123)", "MOVES POINT(237,0,123)"]);
    assert_eq!(alarms, ["8-034"]);
}

/// Fastest the tool point is from now to the end of the motion, mm/s.
fn fastest(robot: &mut Robot) -> f32 {
    let mut top: f32 = 0.0;
    let mut last = position(robot);
    while motion_status(robot) == 1 {
        robot.advance_ms(10);
        let here = position(robot);
        top = top.max(distance(here, last) / 0.01);
        last = here;
    }
    top
}

// clause: PRM-SPD-01 CMD-EC-02
#[test]
fn turning_the_key_to_teaching_slows_what_is_under_way_to_250() {
    let mut robot = Robot::ready("PROGRAM NONE\nEND\n");
    robot.command(Port::Ip0, "DO,MOVE POINT(450,-250,200)");
    robot.advance_ms(2_000);
    robot.command(Port::Ip0, "DO,MOVES POINT(450,250,200) WITH SPEED=20");
    robot.advance_ms(300);
    let mut free = robot.clone();
    assert!((fastest(&mut free) - 400.0).abs() < 1.0, "20 % of 2000 mm/s");
    robot.panel(PanelAction::Key(KeySwitch::Teaching));
    robot.advance_ms(100);
    let top = fastest(&mut robot);
    assert!((top - 250.0).abs() < 1.0, "{top} mm/s in TEACHING");
    // In step operation, SPEED and override count below the cap.
    for (speed, percent, expected) in [(10, 50, 100.0), (50, 100, 250.0), (10, 100, 200.0)] {
        let program = format!(
            "PROGRAM T\nMOVE A\nMOVES B WITH SPEED={speed}\nEND\nDATA\nPOINT A=450,-250,200/\nPOINT B=450,250,200/\nEND\n"
        );
        let mut robot = Robot::ready(&program);
        robot.command(Port::Ip0, "EC,MODE STEP");
        robot.command(Port::Ip0, &format!("EC,OVRD {percent}"));
        robot.panel(PanelAction::Key(KeySwitch::Teaching));
        robot.panel(PanelAction::Start);
        assert!(fastest(&mut robot) <= 250.5, "the way to A");
        robot.panel(PanelAction::Start);
        let top = fastest(&mut robot);
        assert!((top - expected).abs() < 1.0, "{speed} % at {percent} %: {top}");
    }
}
