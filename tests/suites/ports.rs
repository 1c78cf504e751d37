//! The ports apart from exchanges: serial lines as [U06] sets them, the Ethernet display, kinds of file, lengths, and the
//! code table.
//!
//! Timing and line errors of serial lines are in `serial.rs`, real sockets in `network.rs`.

use crate::extensions::{text, word};
use std::time::Duration;
use ts3100_controller::model::ArmModel;
use ts3100_controller::pendant_pages::PAGES;
use ts3100_controller::{Config, ControlRight, Dialect, Input, PanelAction, Port};
use ts3100_proto::parameter::Parity;
use ts3100_tests::{Robot, frame, unframe};

/// A robot with these contents of a parameter file, powered off and on.
fn with_parameters(dialect: Dialect, name: &str, change: &[(&str, &str)]) -> Robot {
    let mut robot = Robot::new(dialect);
    robot.connect(Port::Ip0);
    let mut content = String::from_utf8(robot.file(Port::Ip0, &format!("UL,{name}"))).unwrap();
    for (from, to) in change {
        assert!(content.contains(from), "{from:?} in {content}");
        content = content.replacen(from, to, 1);
    }
    robot.seat.controller.put_file(name, content.as_bytes()).unwrap();
    robot.panel(PanelAction::PowerCycle);
    for port in [Port::Ip0, Port::Host, Port::Com1] {
        robot.connect(port);
    }
    robot
}

fn with_lines(com1: &str, host: &str) -> Robot {
    let change = [
        ("{COM1} = 9600 8 0 1", format!("{{COM1}} = {com1}")),
        ("{HOST} = 9600 8 0 1", format!("{{HOST}} = {host}")),
    ];
    let change: Vec<(&str, &str)> = change.iter().map(|(from, to)| (*from, to.as_str())).collect();
    with_parameters(Dialect::Field, "USER.PAR", &change)
}

/// The SCARA's HOST at the two speeds that the six-axis controller does not have.
// clause: S2
#[test]
fn host_of_a_scara_controller_is_served_at_300_and_600_bit_s() {
    let set = |model: ArmModel, port: &str, speed: u32| {
        let mut robot = Robot::with(Config {
            model,
            ..Config::new(Dialect::Field)
        });
        robot.set_serial_line(port, &format!("{speed} 8 0 1"));
        robot.panel(PanelAction::PowerCycle);
        robot
    };
    for speed in [300, 600] {
        let mut robot = set(ArmModel::thl400(), "HOST", speed);
        robot.panel(PanelAction::ControlRight(ControlRight::Rs232c));
        robot.connect(Port::Host);
        robot.raw(Port::Host, &frame(b"SO\r"));
        // Five characters there, five back, ten bits each.
        let expected = Duration::from_secs(100) / speed;
        robot.advance(expected * 98 / 100);
        assert!(robot.received(Port::Host).len() < 5, "{speed}");
        robot.advance(expected * 4 / 100);
        assert!(robot.received(Port::Host).ends_with(b"\x03"), "{speed}");
        assert_eq!(robot.alarms(), Vec::<String>::new());
        assert_eq!(
            set(ArmModel::thl400(), "COM1", speed).alarms(),
            ["1-101"],
            "HOST only"
        );
        assert_eq!(set(ArmModel::tv800(), "HOST", speed).alarms(), ["1-101"]);
    }
}

// clause: SER-01 SER-02 PAR-U06-03
#[test]
fn the_serial_lines_are_as_u06_sets_them() {
    for speed in [1200, 2400, 4800, 9600, 19_200, 38_400, 115_200] {
        for length in [7, 8] {
            for (code, parity) in [(0, Parity::None), (1, Parity::Odd), (2, Parity::Even)] {
                for stop in [1, 2] {
                    let line = format!("{speed} {length} {code} {stop}");
                    let mut robot = with_lines(&line, &line);
                    let found = |port| {
                        let line = robot.seat.controller.serial_line(port).unwrap();
                        (line.speed, line.length, line.parity, line.stop)
                    };
                    assert_eq!(found(Port::Host), (speed, length, parity, stop));
                    if speed == 115_200 {
                        assert_eq!(
                            found(Port::Com1),
                            (9_600, 8, Parity::None, 1),
                            "HOST alone is so fast"
                        );
                        assert_eq!(robot.alarms(), ["1-101"]);
                    } else {
                        assert_eq!(found(Port::Com1), (speed, length, parity, stop));
                        assert!(robot.alarms().is_empty());
                    }
                    assert!(robot.ask(Port::Host, "SU").starts_with(b"FL,MODE:"));
                }
            }
        }
    }
    let robot = Robot::new(Dialect::Field);
    assert!(
        Port::ETHERNET
            .iter()
            .all(|port| robot.seat.controller.serial_line(*port).is_none())
    );
}

// clause: SER-10 PAR-U06-03
#[test]
fn seven_bits_cost_sf_its_top_bits() {
    let body = |length: &str| {
        let mut robot = with_lines("9600 8 0 1", &format!("9600 {length} 2 1"));
        robot.send(Port::Host, b"SF\r");
        robot.received(Port::Host)
    };
    let (eight, seven) = (body("8"), body("7"));
    assert!(eight.iter().any(|byte| *byte >= 0x80));
    let masked: Vec<u8> = eight.iter().map(|byte| byte & 0x7F).collect();
    assert_eq!(seven, masked);
    // In the other direction too: a text whose top bits are set by the line is the text.
    let mut robot = with_lines("9600 8 0 1", "9600 7 2 1");
    let text: Vec<u8> = frame(b"SO\r").iter().map(|byte| byte | 0x80).collect();
    robot.raw(Port::Host, &text);
    assert_eq!(
        robot.received(Port::Host),
        frame(b"NG\r"),
        "SO belongs to the control right"
    );
    assert_eq!(
        robot.ask(Port::Ip0, "SO"),
        b"OK\r",
        "the other ports are untouched"
    );
}

// clause: SER-04 FRM-02
#[test]
fn a_transfer_of_host_is_255_bytes_at_most() {
    let mut robot = with_lines("9600 8 0 1", "115200 8 0 1");
    robot.panel(PanelAction::ControlRight(ControlRight::Rs232c));
    let mut fill = b"DO,N = 1".to_vec();
    fill.resize(252, b' ');
    fill.push(b'\r');
    robot.panel(PanelAction::Servo(true));
    robot
        .seat
        .controller
        .put_file("T", b"GLOBAL\nN = 0\nEND\nPROGRAM T\nEND\n")
        .unwrap();
    assert_eq!(robot.ask(Port::Host, "SL,T"), b"OK\r");
    robot.send(Port::Host, &fill);
    assert_eq!(
        robot.received(Port::Host),
        frame(b"OK\r"),
        "253 data bytes are served"
    );
    fill.insert(8, b' ');
    robot.advance_ms(1_000);
    robot.send(Port::Host, &fill);
    assert_eq!(robot.received(Port::Host), frame(b"NG\r"), "254 are not");

    let program = format!("PROGRAM LONG\n{}END\n", "PRINT IP1, \"A\", CR\n".repeat(100));
    let mut robot = Robot::new(Dialect::Manual);
    robot.connect(Port::Host);
    robot
        .seat
        .controller
        .put_file("LONG", program.as_bytes())
        .unwrap();
    for _ in 0..60 {
        robot.panel(PanelAction::EmergencyStop(true));
        robot.panel(PanelAction::EmergencyStop(false));
    }
    for command in ["UL,LONG", "UL,ETHERNET.PAR", "EU", "SF", "SU", "CA", "VR"] {
        robot.send(Port::Host, &[command.as_bytes(), b"\r"].concat());
        let mut content = Vec::new();
        while !content.ends_with(b"\x1A") {
            let bytes = robot.received(Port::Host);
            assert!(
                (3..=255).contains(&bytes.len()),
                "{command}: {} bytes",
                bytes.len()
            );
            content.extend(unframe(&bytes).unwrap());
            robot.send(Port::Host, b"OK\r");
        }
    }
}

// clause: CMD-LST-03 CMD-LST-02
#[test]
fn each_kind_of_file_comes_by_fl() {
    let program = "GLOBAL\nA = 10\nEND\nPROGRAM TEST\nEND\n";
    let mut robot = Robot::ready(program);
    for (command, beginning) in [
        ("UL,TEST", "GLOBAL\nA = 10\n"),
        ("UL,USER.PAR", "[U06]"),
        ("UL,ETHERNET.PAR", "[E00]"),
        ("CA", "ETHERNET.PAR "),
        ("SU", "MODE:external(ethernet)/cycle FILE:TEST "),
        ("EU", "0\r"),
        ("SF", "\u{1}\0\0"),
        ("VR", "TS3100     "),
        ("MR,A 0", "10\r"),
    ] {
        let content = robot.file(Port::Ip0, command);
        assert!(
            content.starts_with(beginning.as_bytes()),
            "{command}: {content:02x?}"
        );
    }
}

// clause: FL-06
#[test]
fn fields_keep_to_their_lengths() {
    let mut robot = Robot::ready("GLOBAL\nA = 10\nEND\nPROGRAM TEST\nEND\n");
    for name in ["A", "ABCDEFGH.SCL", "B12345678901"] {
        robot
            .seat
            .controller
            .put_file(name, &vec![b'\n'; 20_000])
            .unwrap();
    }
    for record in text(&mut robot, "CA").split_terminator('\r') {
        let (name, size) = record.split_once(' ').unwrap();
        assert!(
            (1..=12).contains(&name.len()) && (1..=5).contains(&size.len()),
            "{record}"
        );
    }
    robot.advance_ms(3_600_000);
    robot.panel(PanelAction::EmergencyStop(true));
    for record in text(&mut robot, "EU").split_terminator('\r').skip(1) {
        assert_eq!(record.len(), "008-014 14-02-06 01:00:00".len(), "{record}");
    }
    assert_eq!(robot.total(Port::Ip0).len(), 276);
    let mut robot = Robot::new(Dialect::Manual);
    robot.connect(Port::Ip0);
    assert_eq!(robot.file(Port::Ip0, "VR").len() % 30, 0);
    assert_eq!(robot.total(Port::Ip0).len(), 276);
}

// clause: ASCII-01
#[test]
fn codes_have_the_characters_of_the_table() {
    let mut robot = Robot::ready("PROGRAM TEST\nPRINT IP1, \"a\\b{|}~\", CR\nEND\n");
    robot.raw(
        Port::Ip0,
        &[0x02, b'S', b'L', b',', 0x20, b'T', b'E', b'S', b'T', 0x0D, 0x03],
    );
    assert_eq!(robot.received(Port::Ip0), [0x02, b'O', b'K', 0x0D, 0x03]);
    robot.raw(
        Port::Ip0,
        &[0x02, b'U', b'L', b',', b'T', b'E', b'S', b'T', 0x0D, 0x03],
    );
    let found = robot.received(Port::Ip0);
    assert_eq!(found.first(), Some(&0x02));
    assert!(found.ends_with(&[b'E', b'N', b'D', 0x0A, 0x1A, 0x03]));
    assert!(
        found
            .windows(8)
            .any(|bytes| bytes == [b'"', b'a', 0x5C, b'b', 0x7B, 0x7C, 0x7D, 0x7E])
    );
    robot.raw(Port::Ip0, &[0x02, b'O', b'K', 0x0D, 0x03]);
    robot.command(Port::Ip0, "RN");
    assert_eq!(
        robot.received(Port::Ip1),
        [b'a', 0x5C, b'b', 0x7B, 0x7C, 0x7D, 0x7E, 0x0D]
    );
}

// clause: INP-02
#[test]
fn input_without_a_channel_reads_the_pendant() {
    let mut robot = Robot::ready("GLOBAL\nN = 0\nEND\nPROGRAM T\nN = 0\nINPUT N\nPRINT IP1, N, CR\nEND\n");
    robot.connect(Port::Com1);
    robot.command(Port::Ip0, "RN");
    for port in [Port::Com1, Port::Ip1] {
        robot.raw(port, b"5\r");
    }
    robot.advance_ms(60_000);
    assert!(text(&mut robot, "SU").ends_with("running"), "still waiting");
    robot.panel(PanelAction::Keys("6".to_string()));
    robot.advance_ms(1_000);
    assert!(
        text(&mut robot, "SU").ends_with("running"),
        "the key Enter is missing"
    );
    robot.panel(PanelAction::Keys("\r".to_string()));
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Ip1), b"           6\r");
}

// clause: SEQ-03
#[test]
fn a_program_downloaded_at_each_cycle_is_the_one_that_runs() {
    let mut robot = Robot::ready("PROGRAM TEST\nPRINT IP1, \"0\", CR\nEND\n");
    for cycle in 0..10 {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(100);
        assert_eq!(robot.received(Port::Ip1), format!("{cycle}\r").as_bytes());
        robot.advance_ms(100);
        assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"), "the end of the cycle");
        robot.command(Port::Ip0, "DL,TEST");
        let program = format!("FL,PROGRAM TEST\nPRINT IP1, \"{}\", CR\nEND\n\x1A", cycle + 1);
        robot.send(Port::Ip0, program.as_bytes());
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
        robot.command(Port::Ip0, "SL,TEST");
    }
}

fn page(robot: &Robot, number: usize) -> Vec<String> {
    robot.seat.controller.ethernet_pages()[number - 1].lines.clone()
}

/// Words of a row: blanks between them do not count.
fn words(row: &str) -> Vec<&str> {
    row.split_whitespace().collect()
}

// clause: UI-ETHER-01 UI-ETHER-02
#[test]
fn the_display_has_three_pages_in_a_row() {
    let robot = Robot::new(Dialect::Field);
    let pages = robot.seat.controller.ethernet_pages();
    assert_eq!(PAGES, 3);
    let headings: Vec<&str> = pages.iter().map(|page| page.heading.as_str()).collect();
    assert_eq!(
        headings,
        [
            "ETHERNET STATUS [1/3]",
            "ETHERNET STATUS [2/3]",
            "ETHERNET STATUS [3/3]"
        ]
    );
}

// clause: UI-ETHER-03 PAR-E01-01 PAR-E03-01
#[test]
fn page_1_shows_the_controllers_own_addresses() {
    let hexadecimal = |text: &str| text.len() == 6 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let robot = Robot::new(Dialect::Field);
    let lines = page(&robot, 1);
    assert_eq!(words(&lines[0]), ["IP", "ADDRESS", "192.168.0.124"]);
    assert_eq!(words(&lines[1]), ["SUBNET", "MASK", "255.255.255.0"]);
    let mac = words(&lines[2]);
    let (front, back) = mac[2].split_once(':').unwrap();
    assert!(
        mac[..2] == ["MAC", "ADDRESS"] && hexadecimal(front) && hexadecimal(back),
        "{mac:?}"
    );
    let firmware = words(&lines[3]);
    assert!(firmware[0] == "FIRMWARE" && firmware.len() > 1, "{firmware:?}");
    assert_eq!(lines.len(), 4);

    let change = [
        ("= 192.168.0.124", "= 10.9.9.9"),
        ("= 255.255.255.0", "= 255.0.0.0"),
    ];
    let robot = with_parameters(Dialect::Field, "ETHERNET.PAR", &change);
    let lines = page(&robot, 1);
    assert!(
        lines[0].ends_with(" 10.9.9.9") && lines[1].ends_with(" 255.0.0.0"),
        "{lines:?}"
    );
}

// clause: UI-ETHER-04
#[test]
fn page_2_shows_ports_and_peers() {
    let mut robot = Robot::new(Dialect::Manual);
    let unused = |row: &str| {
        row.split_whitespace()
            .skip(1)
            .all(|word| word.bytes().all(|byte| byte == b'0' || byte == b'.'))
    };
    let lines = page(&robot, 2);
    assert_eq!(words(&lines[0]), ["IP0", "01000", "00000", "0.0.0.0"]);
    assert!(lines[1..].iter().all(|row| unused(row)), "{lines:?}");
    robot.connect(Port::Ip0);
    assert_eq!(robot.seat.controller.peer(Port::Ip0), Some("suite"));
    let mut robot = robot.seat.controller;
    let peer = "192.168.0.150:54321".to_string();
    robot.feed(
        robot.now(),
        Input::Connected {
            port: Port::Ip0,
            peer,
        },
    );
    let row = robot.ethernet_pages()[1].lines[0].clone();
    assert_eq!(words(&row), ["IP0", "01000", "54321", "192.168.0.150"]);
    robot.feed(robot.now(), Input::Disconnected { port: Port::Ip0 });
    let row = robot.ethernet_pages()[1].lines[0].clone();
    assert_eq!(words(&row), ["IP0", "01000", "00000", "0.0.0.0"]);
}

// clause: UI-ETHER-05 UI-ETHER-06 UI-ETHER-07 ETH-03
#[test]
fn page_3_shows_application_mode_and_state() {
    let mut robot = with_parameters(Dialect::Manual, "ETHERNET.PAR", &[("= 1 0 0 0", "= 1 2 0 0")]);
    robot.disconnect(Port::Ip0);
    let rows = |robot: &Robot| {
        page(robot, 3)
            .iter()
            .map(|row| words(row).join(" "))
            .collect::<Vec<_>>()
    };
    let mut expected = [
        "IP0 HOST TCP/S LISTEN",
        "IP1 SCOL TCP/C SYN SENT",
        "IP2 SCOL TCP/S CLOSED",
        "IP3 SYSTEM TCP/S CLOSED",
    ];
    assert_eq!(rows(&robot), expected);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip1);
    expected[0] = "IP0 HOST TCP/S ESTABLISHED";
    expected[1] = "IP1 SCOL TCP/C ESTABLISHED";
    assert_eq!(rows(&robot), expected);
    robot.disconnect(Port::Ip0);
    expected[0] = "IP0 HOST TCP/S LISTEN";
    assert_eq!(rows(&robot), expected);
}

// clause: GEN-04 S95
#[test]
fn ip3_keeps_silent() {
    let mut robot = Robot::new(Dialect::Field);
    robot.connect(Port::Ip0);
    robot.connect(Port::Ip3);
    assert!(page(&robot, 3)[3].contains("SYSTEM") && page(&robot, 3)[3].ends_with("ESTABLISHED"));
    let before = robot.total(Port::Ip0);
    for bytes in [b"\x02SO\r\x03".as_slice(), b"SU\r\x03", &[0xFF; 400], b"1,2,3\r"] {
        robot.raw(Port::Ip3, bytes);
        robot.advance_ms(20_000);
    }
    assert_eq!(robot.received(Port::Ip3), b"");
    assert_eq!(robot.total(Port::Ip0)[..44], before[..44]);
    assert_eq!(word(&robot.total(Port::Ip0), 4), 0xFFFF);
    assert!(page(&robot, 3)[3].ends_with("ESTABLISHED"));
}

#[test]
fn a_peer_that_has_left_is_not_there_after_a_snapshot_is_restored() {
    for port in [Port::Host, Port::Com1] {
        let mut robot = Robot::with(Config::new(Dialect::Field));
        robot.connect(port);
        let snapshot = robot.seat.controller.clone();
        robot.raw(port, b"1,2,3,4\r");
        robot.disconnect(port);
        let mut next = snapshot.clone();
        next.adopt_peers(&robot.seat.controller);
        assert_eq!(next.peer(port), None, "bytes of it were on the line");
        robot.feed(Input::Connected {
            port,
            peer: "next".to_owned(),
        });
        let mut next = snapshot;
        next.adopt_peers(&robot.seat.controller);
        assert_eq!(next.peer(port), Some("next"));
    }
}
