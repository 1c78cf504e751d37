//! Configuration before power-on: parameter files, the model, and the options of the dialect.
//!
//! Each option alone is in `options.rs`.

use std::time::Duration;
use ts3100_controller::findings::rules;
use ts3100_controller::options::UnsolicitedSp;
use ts3100_controller::{Config, ControllerType, Dialect, Input, KeySwitch, Options, PanelAction, Port};
use ts3100_proto::parameter::OpenMode;
use ts3100_proto::text::{Checksum, StxRule, TextOptions};
use ts3100_tests::{Robot, frame};

fn idle(dialect: Dialect) -> Robot {
    let mut robot = Robot::new(dialect);
    robot.connect(Port::Ip0);
    robot
}

/// Changes a parameter file as a host does, by UL and DL, and turns the power off and on.
fn edit(robot: &mut Robot, name: &str, change: impl Fn(String) -> String) {
    let text = String::from_utf8(robot.file(Port::Ip0, &format!("UL,{name}"))).unwrap();
    let changed = change(text.clone());
    assert_ne!(text, changed, "the edit of {name} finds its place");
    robot.command(Port::Ip0, &format!("DL,{name}"));
    for block in [b"FL,", changed.as_bytes(), b"\x1A"].concat().chunks(253) {
        robot.send(Port::Ip0, block);
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    }
}

fn power_cycle(robot: &mut Robot) {
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Ip0);
}

/// Replaces the value line after a section's tag.
fn value(text: &str, section: &str, key: &str, new: &str) -> String {
    let start = text.find(&format!("[{section}]")).expect("the section is there");
    let at = start + text[start..].find(key).expect("the key is there");
    let equals = at + text[at..].find('=').expect("a value is there");
    let end = equals + text[equals..].find(['\n', '\r']).unwrap_or(text.len() - equals);
    format!("{}= {new}{}", &text[..equals], &text[end..])
}

fn modes(robot: &Robot) -> [OpenMode; 4] {
    robot
        .seat
        .controller
        .network()
        .channels
        .map(|channel| channel.mode)
}

fn ports(robot: &Robot) -> [u16; 4] {
    robot
        .seat
        .controller
        .network()
        .channels
        .map(|channel| channel.own_port)
}

// clause: PAR-E00-01 PAR-E05-01 PAR-FILE-01 PAR-E01-01 PAR-E02-01 PAR-E04-01 PAR-E07-01 PAR-U06-01 PAR-U06-02
#[test]
fn the_factory_files() {
    use OpenMode::{NotUsed, Server};
    let mut robot = idle(Dialect::Field);
    assert_eq!(modes(&robot), [Server; 4]);
    assert_eq!(ports(&robot), [1000, 1001, 1002, 1003]);
    let text = String::from_utf8(robot.file(Port::Ip0, "UL,ETHERNET.PAR")).unwrap();
    for section in 0..=10 {
        assert_eq!(text.matches(&format!("[E{section:02}]")).count(), 1, "{text}");
    }
    for value in [
        "192.168.0.124",
        "255.255.255.0",
        "192.168.0.1",
        "\"NO1-TS3K\"",
        "192.168.0.153",
    ] {
        assert!(text.contains(value), "{value} in {text}");
    }
    assert!(text.trim_end().ends_with("[END]"));
    assert!(!text.contains('\r'), "LF in the field dialect");
    let text = String::from_utf8(robot.file(Port::Ip0, "UL,USER.PAR")).unwrap();
    assert_eq!(text.matches("= 9600 8 0 1").count(), 2, "{text}");

    let mut robot = idle(Dialect::Manual);
    assert_eq!(modes(&robot), [Server, NotUsed, NotUsed, NotUsed]);
    let text = String::from_utf8(robot.file(Port::Ip0, "UL,ETHERNET.PAR")).unwrap();
    assert!(
        !text.contains('\n') && text.contains('\r'),
        "CR in the manual dialect"
    );
}

// clause: PAR-FILE-03 PAR-FILE-04 PAR-E05-01 PAR-E00-01 RAM-14
#[test]
fn parameters_act_after_a_power_cycle() {
    let mut robot = idle(Dialect::Field);
    edit(&mut robot, "ETHERNET.PAR", |text| {
        let text = value(&text, "E05", "{IP0", "2000");
        let open = text.find("[E00]").unwrap();
        let equals = open + text[open..].find('=').unwrap();
        let end = equals + text[equals..].find('\n').unwrap();
        format!("{}= 1 2 0 1{}", &text[..equals], &text[end..])
    });
    assert_eq!(ports(&robot), [1000, 1001, 1002, 1003]);
    power_cycle(&mut robot);
    assert_eq!(ports(&robot), [2000, 1001, 1002, 1003]);
    assert_eq!(
        modes(&robot),
        [
            OpenMode::Server,
            OpenMode::Client,
            OpenMode::NotUsed,
            OpenMode::Server
        ]
    );
    let client = robot.seat.controller.network().channels[1];
    assert_eq!(
        (client.peer_address, client.peer_port),
        ([192, 168, 0, 151], 1001)
    );
    assert_eq!(robot.file(Port::Ip0, "EU"), b"0\r");
}

// clause: PAR-E05-02 PAR-E00-03 PAR-E00-02
#[test]
fn impossible_parameters_are_reported_and_the_rest_works() {
    let mut robot = idle(Dialect::Field);
    edit(&mut robot, "ETHERNET.PAR", |text| {
        value(&text, "E05", "{IP2", "1001")
    });
    power_cycle(&mut robot);
    assert_eq!(
        modes(&robot)[..3],
        [OpenMode::Server, OpenMode::Server, OpenMode::NotUsed]
    );
    assert!(robot.file(Port::Ip0, "EU").starts_with(b"1\r"));

    let mut robot = idle(Dialect::Field);
    edit(&mut robot, "ETHERNET.PAR", |text| {
        let open = text.find("[E00]").unwrap();
        let equals = open + text[open..].find('=').unwrap();
        let end = equals + text[equals..].find('\n').unwrap();
        format!("{}= 2 0 0 0{}", &text[..equals], &text[end..])
    });
    power_cycle(&mut robot);
    assert_eq!(modes(&robot)[0], OpenMode::Server);
    assert!(robot.file(Port::Ip0, "EU").starts_with(b"1\r"));
}

// clause: PAR-U06-06 PAR-FILE-03
#[test]
fn a_broken_parameter_file_keeps_the_last_good_values() {
    let mut robot = idle(Dialect::Field);
    for broken in ["", "[E05] {IP0} = banana", "[[[[{{{{====", "[END]"] {
        robot
            .seat
            .controller
            .put_file("ETHERNET.PAR", broken.as_bytes())
            .unwrap();
        power_cycle(&mut robot);
        assert_eq!(ports(&robot), [1000, 1001, 1002, 1003], "{broken}");
        assert_eq!(modes(&robot), [OpenMode::Server; 4], "{broken}");
    }
    assert!(
        !robot.file(Port::Ip0, "EU").starts_with(b"0\r"),
        "it was reported"
    );
}

// clause: PAR-E10-01 PAR-E10-02 PAR-E10-03
#[test]
fn a_lost_peer_raises_the_alarm_that_e10_asks_for() {
    for (level, range) in [(8_u16, 0..368_u16), (4, 368..512), (2, 512..736), (1, 736..896)] {
        let mut robot = idle(Dialect::Field);
        edit(&mut robot, "ETHERNET.PAR", |text| {
            let at = text.find("[E10]").unwrap();
            let equals = at + text[at..].find('=').unwrap();
            let end = equals + text[equals..].find('\n').unwrap();
            format!("{}= 0 {level} 0 0{}", &text[..equals], &text[end..])
        });
        power_cycle(&mut robot);
        robot.load("TEST", "PROGRAM T\nDELAY 60.0\nEND\n");
        robot.command(Port::Ip0, "SO");
        robot.connect(Port::Ip1);
        robot.disconnect(Port::Ip1);
        assert_eq!(robot.total(Port::Ip0)[4..6], [0xFF, 0xFF], "not while stopped");
        robot.connect(Port::Ip1);
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(100);
        robot.disconnect(Port::Ip1);
        robot.received(Port::Ip0);
        let body = robot.total(Port::Ip0);
        let word = u16::from_be_bytes([body[4], body[5]]);
        assert!(range.contains(&word), "level {level}: {word}");
        assert_eq!(
            (body[0] == 0, body[2] == 2),
            (level == 8, level >= 4),
            "level {level}: {:?}",
            &body[..3]
        );
    }
}

// clause: GEN-05
#[test]
fn the_tsl3100_has_no_internal_position() {
    for (controller, word) in [
        (ControllerType::Ts3100, "internal"),
        (ControllerType::Tsl3100, "external(ethernet)"),
        (ControllerType::Tsl3000e, "external(ethernet)"),
    ] {
        let mut robot = Robot::with(Config {
            controller,
            ..Config::new(Dialect::Field)
        });
        robot.connect(Port::Ip0);
        robot.panel(PanelAction::Key(KeySwitch::Internal));
        let text = String::from_utf8(robot.file(Port::Ip0, "SU")).unwrap();
        assert!(text.starts_with(&format!("MODE:{word}/")), "{text}");
    }
}

// clause: CMD-RN-03 CMD-RN-04
#[test]
fn the_operation_mode_at_power_on_and_on_turning_the_key() {
    let mut robot = idle(Dialect::Field);
    robot.command(Port::Ip0, "EC,MODE CONT");
    robot.panel(PanelAction::Key(KeySwitch::Internal));
    robot.panel(PanelAction::Key(KeySwitch::Ext));
    assert!(
        robot
            .file(Port::Ip0, "SU")
            .starts_with(b"MODE:external(ethernet)/continuous")
    );
    power_cycle(&mut robot);
    assert!(
        robot
            .file(Port::Ip0, "SU")
            .starts_with(b"MODE:external(ethernet)/cycle")
    );
}

fn with_options(change: impl Fn(&mut Options)) -> Robot {
    let mut config = Config::new(Dialect::Field);
    change(&mut config.options);
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot
}

// clause: FRM-14 FRM-15
#[test]
fn with_a_checksum_every_text_has_one_byte_more() {
    let mut robot = with_options(|options| {
        options.text = TextOptions {
            stx: StxRule::Required,
            checksum: Checksum::Sum,
            ..TextOptions::default()
        };
    });
    robot.raw(Port::Ip0, b"\x02SU\r\x03\xB8");
    let answer = robot.received(Port::Ip0);
    assert!(answer.starts_with(b"\x02FL,MODE:"));
    let (sum, text) = answer.split_last().unwrap();
    let expected = text[1..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    assert_eq!((text.last(), *sum), (Some(&3), expected));
    robot.raw(Port::Ip0, b"\x02OK\r\x03\xAA");
    robot.raw(Port::Ip0, b"\x02SU\r\x03\xB9");
    assert_eq!(robot.received(Port::Ip0), b"\x02NG\r\x03\xA5");
}

// clause: TRN-04 TRN-05
#[test]
fn an_answer_within_50_ms_is_ignored_with_strict_50ms() {
    for (strict, answered) in [(false, true), (true, false)] {
        let mut robot = with_options(|options| options.strict_50ms = strict);
        robot.send(Port::Ip0, b"SP\r");
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
        robot.advance_ms(10);
        robot.send(Port::Ip0, b"SP\r");
        assert_eq!(!robot.received(Port::Ip0).is_empty(), answered, "strict {strict}");
        robot.advance_ms(60);
        robot.send(Port::Ip0, b"SP\r");
        assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"), "strict {strict}");
    }
}

/// The 50 ms begin when the robot's answer has left; until then nobody has heard it.
// clause: TRN-04
#[test]
fn a_text_before_the_answer_has_left_is_not_ignored_with_strict_50ms() {
    let mut robot = with_options(|options| {
        options.strict_50ms = true;
        options.reply_delay = [Duration::from_millis(100); 5];
    });
    for _ in 0..2 {
        robot.send(Port::Ip0, b"SP\r");
        robot.advance_ms(10);
    }
    robot.advance_ms(500);
    assert_eq!(
        robot.received(Port::Ip0),
        [frame(b"OK\r"), frame(b"OK\r")].concat()
    );
    assert_eq!(robot.findings.count(&rules::ANSWER_EARLY), 0);
}

/// PRINT and an unsolicited SP answer nothing, so option `reply.delay` does not hold them back.
#[test]
fn reply_delay_delays_answers_only() {
    let mut robot = with_options(|options| options.reply_delay = [Duration::from_millis(300); 5]);
    robot.connect(Port::Ip1);
    robot.load("TEST", "PROGRAM T\nDELAY 1\nPRINT IP1, \"A\", CR\nEND\n");
    for (command, answer) in [(b"SO\r", b"OK\r"), (b"RN\r", b"OK\r")] {
        robot.send(Port::Ip0, command);
        robot.advance_ms(250);
        assert!(robot.received(Port::Ip0).is_empty());
        robot.advance_ms(100);
        assert_eq!(robot.received(Port::Ip0), frame(answer));
    }
    robot.advance_ms(750);
    assert_eq!(robot.received(Port::Ip1), b"A\r");
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

// clause: RAM-15
#[test]
fn a_full_drive_refuses_and_keeps_what_it_has() {
    let mut robot = with_options(|options| options.drive_capacity = 20_000);
    let before = robot.file(Port::Ip0, "CA");
    robot.command(Port::Ip0, "DL,BIG");
    let mut answer = Vec::new();
    for number in 0..100 {
        let head: &[u8] = if number == 0 { b"FL," } else { b"" };
        robot.send(
            Port::Ip0,
            &[head, "' a line of a file that is too big\n".repeat(7).as_bytes()].concat(),
        );
        answer = robot.received(Port::Ip0);
        if answer != frame(b"OK\r") {
            break;
        }
    }
    if answer == frame(b"OK\r") {
        robot.send(Port::Ip0, b"\x1A");
        answer = robot.received(Port::Ip0);
    }
    assert_eq!(answer, frame(b"NG\r"));
    assert_eq!(robot.file(Port::Ip0, "CA"), before);
}

// clause: CMD-SP-05
#[test]
fn who_is_told_of_stops_is_an_option() {
    use UnsolicitedSp::{Always, Auto, Never};
    // The host connects, sends this first, and runs a program.
    for (rule, first, expects_sp) in [
        (Auto, b"\x02SO\r\x03".as_slice(), true),
        (Auto, b"\x02SM,1\r\x03\x02OK\r\x03", false),
        (Auto, b"\x02HI,1 8\r\x03\x02OK\r\x03", false),
        (Auto, b"\x02RS,ERR\r\x03", false),
        (Auto, b"SU\r\x03OK\r\x03", false),
        (Always, b"\x02SM,1\r\x03\x02OK\r\x03", true),
        (Always, b"SU\r\x03OK\r\x03\x02SO\r\x03", true),
        (Never, b"\x02SO\r\x03", false),
    ] {
        let mut robot = with_options(|options| options.unsolicited_sp = rule);
        robot.load("TEST", "PROGRAM T\nDELAY 0.1\nEND\n");
        robot.raw(Port::Ip0, first);
        robot.received(Port::Ip0);
        robot.command(Port::Ip0, "SO");
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(200);
        let expected = if expects_sp { frame(b"SP\r") } else { Vec::new() };
        assert_eq!(
            robot.received(Port::Ip0),
            expected,
            "{rule:?} {}",
            first.escape_ascii()
        );
    }
}

// clause: CMD-SP-05
#[test]
fn a_new_peer_is_told_of_stops_again() {
    let mut robot = Robot::ready("PROGRAM T\nDELAY 0.1\nEND\n");
    robot.file(Port::Ip0, "SM,1");
    robot.feed(Input::Disconnected { port: Port::Ip0 });
    robot.connect(Port::Ip0);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(200);
    assert_eq!(robot.received(Port::Ip0), frame(b"SP\r"));
}

// clause: CMD-SP-05
#[test]
fn a_host_that_stays_when_a_snapshot_is_restored_is_told_of_stops_as_before() {
    for (rule, expected) in [
        (UnsolicitedSp::Auto, b"".as_slice()),
        (UnsolicitedSp::Always, b"SP\r\x03"),
    ] {
        let mut robot = with_options(|options| options.unsolicited_sp = rule);
        robot.load("TEST", "PROGRAM T\nDELAY 0.1\nEND\n");
        robot.command(Port::Ip0, "SO");
        let mut next = robot.seat.controller.clone();
        robot.raw(Port::Ip0, b"SU\r\x03OK\r\x03");
        robot.received(Port::Ip0);
        next.adopt_peers(&robot.seat.controller);
        robot.seat.controller = next;
        robot.panel(PanelAction::Start);
        robot.advance_ms(200);
        assert_eq!(robot.received(Port::Ip0), expected, "{rule:?}");
    }
}
