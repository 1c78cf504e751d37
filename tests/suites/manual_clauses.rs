//! Clauses of the manual that need the whole controller for their proof: examples of the manual by the bytes they send and
//! the positions they reach, bytes of SF, parameter files on real ports.
//!
//! `docs/clauses.tsv` lists which tests prove which clause.

use crate::extensions::{text, values, word};
use ts3100_controller::{Dialect, PanelAction, Port};
use ts3100_tests::{Robot, frame};

/// Eleven positions, that differ in X: P1 at 301 mm and so on.
fn positions() -> String {
    let points = [1, 2, 3, 4, 5, 11, 12, 13, 21, 22, 23];
    let lines = points.map(|number| format!("POINT A{number}={},0,300/\n", 300 + number));
    format!("DATA\n{}END\n", lines.concat())
}

fn moves(names: &[u16]) -> String {
    names.iter().map(|name| format!("MOVE A{name}\n")).collect()
}

// clause: RAM-12 CMD-EC-03
#[test]
fn subprograms_are_called_by_their_names() {
    let program = format!(
        "PROGRAM TEST\n{}SUB1\n{}SUB2\n{}END\nPROGRAM SUB1\n{}END\nPROGRAM SUB2\n{}END\n{}",
        moves(&[1, 2, 3]),
        moves(&[3, 2, 4, 5]),
        moves(&[5, 4, 1]),
        moves(&[11, 12, 13]),
        moves(&[21, 22, 23]),
        positions()
    );
    let mut robot = Robot::ready(&program);
    robot.command(Port::Ip0, "EC,MODE SEGMENT");
    let mut order = Vec::new();
    for _ in 0..16 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(10_000);
        assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
        order.push((robot.float(Port::Ip0, 148) - 300.0).round());
    }
    let expected = [1, 2, 3, 11, 12, 13, 3, 2, 4, 5, 21, 22, 23, 5, 4, 1];
    assert_eq!(order, expected.map(|place: i16| f32::from(place)));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(1_000);
    assert!(
        text(&mut robot, "SU").ends_with("stop(reset)"),
        "that was all of it"
    );
}

// clause: RAM-11 SF-09 SF-10
#[test]
fn the_lines_of_sf_go_on_by_one_a_statement() {
    let mut robot = Robot::ready("' A remark.\nPROGRAM T\nA = 1\nA = 2\n\nDELAY 1.0\nA = 3\nEND\n");
    robot.command(Port::Ip0, "EC,MODE STEP");
    let mut lines = Vec::new();
    for _ in 0..4 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(2_000);
        robot.received(Port::Ip0);
        let sf = robot.total(Port::Ip0);
        assert!(
            word(&sf, 26) >= word(&sf, 24),
            "analysis is never after execution"
        );
        lines.push(word(&sf, 24));
    }
    assert_eq!(lines, [4, 6, 7, 8]);
}

// clause: SF-03 SF-17 SF-42
#[test]
fn words_and_floats_have_their_high_byte_first() {
    let mut robot = Robot::ready("PROGRAM T\nEND\n");
    robot.command(Port::Ip0, "DO,MOVEA 1,1.0");
    robot.advance_ms(2_000);
    let sf = robot.total(Port::Ip0);
    assert_eq!(sf[116..120], [0x3F, 0x80, 0, 0]);
    assert_eq!(sf[40..42], [0, 3]);
    robot.advance_ms(300 * 60_000);
    assert_eq!(robot.total(Port::Ip0)[44..48], [0, 0, 1, 44], "300 minutes");
}

// clause: SF-31 SF-32
#[test]
fn each_system_input_has_its_bit_and_the_others_stay() {
    for line in 249..=264 {
        let mut robot = Robot::new(Dialect::Field);
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::InputLine { line, on: true });
        let sf = robot.total(Port::Ip0);
        let inputs: Vec<u16> = (0..16).map(|place| word(&sf, 52 + 2 * place)).collect();
        let mut expected = [0; 16];
        expected[11] = 1 << (line - 249);
        assert_eq!(inputs, expected, "Din{line}");
        robot.panel(PanelAction::InputLine { line, on: false });
        assert_eq!(
            word(&robot.total(Port::Ip0), 74),
            0,
            "Din{line} while active only"
        );
    }
}

fn edit(robot: &mut Robot, from: &str, to: &str) {
    let content = String::from_utf8(robot.file(Port::Ip0, "UL,ETHERNET.PAR")).unwrap();
    assert!(content.contains(from), "{from:?} in {content}");
    robot.command(Port::Ip0, "DL,ETHERNET.PAR");
    for block in [b"FL,", content.replacen(from, to, 1).as_bytes(), b"\x1A"]
        .concat()
        .chunks(253)
    {
        robot.send(Port::Ip0, block);
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    }
}

// clause: PAR-E05-02 UI-ETHER-05
#[test]
fn of_two_channels_with_one_port_the_display_shows_one_closed() {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    edit(&mut robot, "{IP2} = 1002", "{IP2} = 1001");
    let states = |robot: &Robot| {
        let rows = robot.seat.controller.ethernet_pages()[2].lines.clone();
        [1, 2].map(|place: usize| rows[place].split_whitespace().last().unwrap().to_string())
    };
    assert_eq!(states(&robot), ["LISTEN", "LISTEN"], "before the power cycle");
    robot.panel(PanelAction::PowerCycle);
    assert_eq!(states(&robot), ["LISTEN", "CLOSED"]);
}

// clause: PAR-FILE-02
#[test]
fn headings_and_comments_of_a_parameter_file_mean_nothing() {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    let plain = String::from_utf8(robot.file(Port::Ip0, "UL,ETHERNET.PAR")).unwrap();
    let before = *robot.seat.controller.network();
    let other = plain
        .replace("Open mode of IP0 IP1 IP2 IP3", "OPEN MODE OF THE CHANNELS")
        .replace("IP address of the controller", "{another comment} MY ADDRESS")
        .replace("Own ports, each number once", "");
    assert_ne!(plain, other);
    robot
        .seat
        .controller
        .put_file("ETHERNET.PAR", other.as_bytes())
        .unwrap();
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
    assert_eq!(*robot.seat.controller.network(), before);
    assert_eq!(robot.file(Port::Ip0, "EU"), b"0\r");
    robot
        .seat
        .controller
        .put_file(
            "ETHERNET.PAR",
            plain.replace("{IP1} = 1001", "{IP1} = 4001").as_bytes(),
        )
        .unwrap();
    robot.panel(PanelAction::PowerCycle);
    assert_eq!(
        robot.seat.controller.network().channels[1].own_port,
        4001,
        "the value after = means something"
    );
}

// clause: CMD-SP-03 CMD-SP-04
#[test]
fn sp_in_mid_motion_lets_it_end_at_its_target() {
    let mut robot = Robot::ready(&format!(
        "PROGRAM T\nMOVE A1\nMOVE A23 WITH SPEED=2\nMOVE A1\nEND\n{}",
        positions()
    ));
    robot.command(Port::Ip0, "RN");
    for _ in 0..200 {
        robot.advance_ms(10);
        if values(&mut robot, "PR,1")[0] > 302.0 && values(&mut robot, "VL,1")[0] > 0.0 {
            break;
        }
    }
    let start = robot.now();
    robot.command(Port::Ip0, "SP");
    assert_eq!(robot.now(), start, "OK does not wait for the motion");
    assert!(text(&mut robot, "SU").ends_with("running"));
    robot.advance_ms(20_000);
    assert!((values(&mut robot, "PR,1")[0] - 323.0).abs() < 0.0011);
    assert!(text(&mut robot, "SU").ends_with("stop(continue)"));
}
