//! Hosts of the findings suite that exchange data with a program on IP1 and COM1, and operations at the panel.
//!
//! Hosts of the protocol are in `cases.rs`.

use super::cases::{Case, commands, download};
use ts3100_controller::findings::rules;
use ts3100_controller::{ControlRight, Input, PanelAction, Port};
use ts3100_tests::Robot;

const READS: &str = "PROGRAM TEST\nINPUT IP1, A\nEND\n";
const PRINTS: &str = "PROGRAM TEST\nPRINT IP1, 1, CR\nDELAY 1\nEND\n";

/// A PRINT of 201 bytes and 12 for each number.
fn prints_long(numbers: usize) -> String {
    let text = "X".repeat(200);
    format!(
        "PROGRAM TEST\nPRINT IP1, \"{text}\"{}, CR\nEND\n",
        ", 1".repeat(numbers)
    )
}

fn signal(robot: &mut Robot, servo: bool) {
    robot.panel(PanelAction::ControlRight(ControlRight::Sig));
    robot.panel(PanelAction::Servo(servo));
    robot.panel(PanelAction::InputLine { line: 255, on: true });
}

fn loaded(robot: &mut Robot, program: &str) {
    *robot = Robot::ready(program);
}

fn power_cycle(robot: &mut Robot, program: &str) {
    download(robot, "TEST", program);
    robot.panel(PanelAction::PowerCycle);
}

pub const CHANNELS: &[Case] = &[
    (
        &rules::DATA_BEFORE_INPUT,
        |r| r.raw(Port::Ip1, b"1,2\r"),
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b"1,2\r");
        },
    ),
    (
        &rules::DATA_CLEARED,
        |r| {
            r.raw(Port::Ip1, b"1,2\r");
            commands(r, &["RN"]);
        },
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b"1,2\r");
        },
    ),
    (
        &rules::INPUT_OVERFLOW,
        |r| r.raw(Port::Ip1, &[b'1'; 257]),
        |r| r.raw(Port::Ip1, &[b'1'; 256]),
    ),
    (
        &rules::PRINT_CUT,
        |r| {
            loaded(r, &prints_long(5));
            commands(r, &["RN"]);
        },
        |r| {
            loaded(r, &prints_long(4));
            commands(r, &["RN"]);
        },
    ),
    (
        &rules::INPUT_NOT_A_NUMBER,
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b"1,X\r");
        },
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b"1,2\r");
        },
    ),
    (
        &rules::INPUT_EMPTY,
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b",2\r");
        },
        |r| {
            commands(r, &["RN"]);
            r.raw(Port::Ip1, b"0,2\r");
        },
    ),
    (
        &rules::INPUT_LINE_FEED,
        |r| r.raw(Port::Ip1, b"1,2\r\n"),
        |r| r.raw(Port::Ip1, b"1,2\r"),
    ),
    (
        &rules::HALF_VALUE,
        |r| {
            r.raw(Port::Ip1, b"1,2");
            r.disconnect(Port::Ip1);
        },
        |r| {
            r.raw(Port::Ip1, b"1,2\r\n");
            r.disconnect(Port::Ip1);
        },
    ),
    (
        &rules::PEER_LEFT,
        |r| {
            commands(r, &["RN"]);
            r.disconnect(Port::Ip1);
        },
        |r| {
            commands(r, &["RN", "SP"]);
            r.disconnect(Port::Ip1);
        },
    ),
    (
        &rules::PRINT_WITHOUT_PEER,
        |r| {
            loaded(r, PRINTS);
            r.disconnect(Port::Ip1);
            commands(r, &["RN"]);
        },
        |r| {
            loaded(r, PRINTS);
            commands(r, &["RN"]);
        },
    ),
    (
        &rules::INPUT_WITHOUT_PEER,
        |r| {
            loaded(r, READS);
            r.disconnect(Port::Ip1);
            commands(r, &["RN"]);
        },
        |r| {
            loaded(r, READS);
            commands(r, &["RN"]);
        },
    ),
    (
        &rules::PROTOCOL_ON_CHANNEL,
        |r| r.send(Port::Ip1, b"SU\r"),
        |r| commands(r, &["SU"]),
    ),
    (
        &rules::DATA_TO_IP3,
        |r| {
            r.connect(Port::Ip3);
            r.raw(Port::Ip3, b"1\r");
        },
        |r| r.connect(Port::Ip3),
    ),
];

pub const RIG: &[Case] = &[
    (
        &rules::ACCEL_OVER_FULL,
        |r| commands(r, &["DO,ACCEL=101"]),
        |r| commands(r, &["DO,ACCEL=100"]),
    ),
    (
        &rules::PANEL_REFUSED,
        |r| {
            r.panel(PanelAction::Servo(false));
            r.panel(PanelAction::Start);
        },
        |r| r.panel(PanelAction::Start),
    ),
    (&rules::SIGNAL_REFUSED, |r| signal(r, false), |r| signal(r, true)),
    (
        &rules::NO_SUCH_LINE,
        |r| r.panel(PanelAction::InputLine { line: 65, on: true }),
        |r| r.panel(PanelAction::InputLine { line: 64, on: true }),
    ),
    (
        &rules::WIRE_LOOP,
        |r| {
            r.put(Input::WireLoop {
                wires: "a.dout.1 to b.din.1, b.dout.1 to a.din.1".to_owned(),
            });
        },
        |r| r.put(Input::Tick),
    ),
    (
        &rules::SELECTION_LOST,
        |r| power_cycle(r, "PROGRAM TEST\rGOTO NOWHERE\rEND\r"),
        |r| power_cycle(r, "PROGRAM TEST\rEND\r"),
    ),
];
