//! Motions that overlap (PASS), and what becomes of them at a stop.
//!
//! How two motions overlap has unit tests in `ts3100-controller`; stops of a single motion are in `motion.rs`.

use crate::motion::{FAR, TRIP, distance, motion_status, position, until};
use ts3100_controller::Port;
use ts3100_tests::Robot;

#[test]
fn with_pass_the_frames_of_a_motion_hold_from_its_beginning_to_its_end() {
    let mut robot = Robot::ready(
        "PROGRAM P\nSPEED = 20\nPASS = 100\nMOVES A WITH WORK=W1, TOOL=T1\nMOVES B\nMOVES A WITH WORK=W2\nMOVES C\n\
         MOVES B WITH BASE=B1\nEND\nDATA\nTRANS W1=0,0,10\nTRANS W2=0,0,20\nTRANS T1=0,0,-10\nTRANS B1=0,5\n\
         POINT A=400,-200,200/\nPOINT B=400,200,200/\nWORK W1\nPOINT C=450,0,250/\nEND\n",
    );
    let shown = |robot: &Robot| {
        let controller = &robot.cell.controller;
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
        if look % 40 == 30 {
            robot.command(Port::Ip0, "FD");
        } else if look % 40 == 36 {
            robot.command(Port::Ip0, "FD");
        }
        if !robot.cell.controller.is_arm_moving() {
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
    for behind in ["MOVES TOP", "MOVEJ TOP, POINT(20,30,20)", "MOVEA 1, 0"] {
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
        robot.cell.controller.steps().0 == 6
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
