//! Motions that overlap (PASS).
//!
//! How two motions overlap has unit tests in `ts3100-controller`; stops of a single motion are in `motion.rs`.

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
