//! Dialogues of options that show in a running program.

use super::{alarms, run, status};
use ts3100_controller::Port;
use ts3100_tests::Robot;

pub(super) fn input_without_peer(robot: &mut Robot) -> String {
    robot.connect(Port::Ip2);
    run(robot, "PROGRAM T\nINPUT IP1, N\nPRINT IP2, N, CR\nEND\n");
    let found = format!("{}, {}", status(robot), alarms(robot));
    robot.connect(Port::Ip1);
    robot.raw(Port::Ip1, b"5\r");
    robot.advance_ms(100);
    let shown = String::from_utf8(robot.received(Port::Ip2)).unwrap();
    match shown.trim() {
        "" => found,
        number => format!("{found}; then N = {number}"),
    }
}

pub(super) fn input_whose_peer_connects_again(robot: &mut Robot) -> String {
    robot.connect(Port::Ip1);
    run(robot, "PROGRAM T\nN = 7\nINPUT IP1, N\nPRINT IP1, N, CR\nEND\n");
    robot.disconnect(Port::Ip1);
    robot.connect(Port::Ip1);
    robot.advance_ms(100);
    robot.received(Port::Ip0);
    let shown = String::from_utf8(robot.received(Port::Ip1)).unwrap();
    let shown = match shown.trim() {
        "" => "nothing".to_string(),
        number => format!("N = {number}"),
    };
    format!("{shown}, {}", status(robot))
}

pub(super) fn print_without_peer(robot: &mut Robot) -> String {
    run(robot, "PROGRAM T\nPRINT IP1, 1, CR\nEND\n");
    format!("{}, {}", status(robot), alarms(robot))
}

/// The second run prints what the first one has assigned.
pub(super) fn variable_after_rs_stp(robot: &mut Robot) -> String {
    robot.connect(Port::Ip1);
    run(
        robot,
        "GLOBAL\nF = 0\nEND\nPROGRAM T\nIF F == 1 THEN GOTO L1\nN = 5\nF = 1\nGOTO L2\nL1: PRINT IP1, N, CR\nL2:\nEND\n",
    );
    robot.received(Port::Ip0);
    robot.command(Port::Ip0, "RS,STP");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    let shown = String::from_utf8(robot.received(Port::Ip1)).unwrap();
    let shown = match shown.trim() {
        "" => "nothing",
        number => number,
    };
    format!("{shown}, {}", alarms(robot))
}

pub(super) fn start_after_a_stop_in_wait(robot: &mut Robot) -> String {
    robot.connect(Port::Ip1);
    run(robot, "PROGRAM T\nWAIT DIN(5)\nPRINT IP1, \"PAST\"\nEND\n");
    robot.command(Port::Ip0, "SP");
    robot.advance_ms(100);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    let shown = String::from_utf8(robot.received(Port::Ip1)).unwrap();
    let shown = if shown.is_empty() {
        "nothing".to_string()
    } else {
        shown
    };
    format!("{shown}, {}", status(robot))
}
