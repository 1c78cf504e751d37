//! The serial lines HOST and COM1 at bit level: how long characters take, what mismatched settings make of them, what is
//! lost on a half-duplex line. The settings themselves ([U06]) are in `ports.rs`; real ports are tried by `cable.py`.

mod departed;

use std::time::Duration;
use ts3100_controller::{
    Config, ControlRight, Dialect, Event, HostEnd, HostSettings, Input, Options, Output, PanelAction, Port,
    Time,
};
use ts3100_proto::parameter::Parity;
use ts3100_tests::{Robot, frame};

/// A field-dialect robot with paced lines, [U06] set so on both, a host on HOST, COM1 and IP0.
fn paced(u06: &str, change: impl Fn(&mut Options)) -> Robot {
    let mut config = Config::new(Dialect::Field);
    change(&mut config.options);
    let mut robot = Robot::with(config);
    for port in ["COM1", "HOST"] {
        robot.set_serial_line(port, u06);
    }
    robot.panel(PanelAction::PowerCycle);
    robot.panel(PanelAction::ControlRight(ControlRight::Rs232c));
    for port in [Port::Host, Port::Com1, Port::Ip0] {
        robot.connect(port);
    }
    robot
}

fn usual() -> Robot {
    paced("9600 8 0 1", |_| {})
}

fn opened(robot: &mut Robot, port: Port, settings: HostSettings) {
    let host = HostEnd::Modelled(settings);
    robot.put(Input::SerialOpened { port, host });
}

/// Time until `count` bytes have come out of a port.
fn time_for(robot: &mut Robot, port: Port, count: usize) -> Duration {
    let start = robot.now();
    let mut got = 0;
    loop {
        got += robot.received(port).len();
        if got >= count {
            return robot.now().since(start);
        }
        assert!(
            robot.now().since(start) < Duration::from_secs(3_600),
            "{got} of {count}"
        );
        robot.advance(Duration::from_micros(500));
    }
}

fn within(found: Duration, expected: f64) {
    let ratio = found.as_secs_f64() / expected;
    assert!((0.98..=1.02).contains(&ratio), "{found:?}, {expected} s expected");
}

fn findings(robot: &Robot, rule: &str) -> Vec<String> {
    let message = |output: &Output| match output {
        Output::Event(Event::Finding(found)) if found.rule.id == rule => Some(found.message.to_string()),
        _ => None,
    };
    robot.outputs.iter().filter_map(message).collect()
}

fn dropped(robot: &Robot, reason: &str) -> usize {
    let bytes = |output: &Output| match output {
        Output::Event(Event::Dropped {
            bytes, reason: found, ..
        }) if *found == reason => Some(*bytes),
        _ => None,
    };
    robot.outputs.iter().filter_map(bytes).sum()
}

/// Prints so many lines of 100 bytes on COM1.
fn printer(lines: u32) -> String {
    let text = "x".repeat(99);
    format!("PROGRAM P\nFOR K = 1 TO {lines}\nPRINT COM1, \"{text}\", CR\nNEXT K\nEND\n")
}

// clause: SER-01 SER-02
#[test]
fn ten_thousand_bytes_take_what_the_line_takes_in_both_directions() {
    for (u06, expected) in [
        ("9600 8 0 1", 10.4167),
        ("9600 8 2 2", 12.5),
        ("38400 7 0 1", 2.34375),
    ] {
        let mut robot = paced(u06, |_| {});
        robot.load("P", &printer(100));
        robot.panel(PanelAction::Servo(true));
        robot.panel(PanelAction::Start);
        within(time_for(&mut robot, Port::Com1, 10_000), expected);

        // 10,000 bytes to the robot; the answer to the last text comes after them.
        let start = robot.now();
        let mut rest = vec![b'x'; 9_995];
        rest.extend(frame(b"CA\r"));
        let mut rest = rest.as_slice();
        while !rest.is_empty() {
            let room = robot
                .seat
                .controller
                .line_room(Port::Host)
                .unwrap()
                .min(rest.len());
            robot.raw(Port::Host, &rest[..room]);
            rest = &rest[room..];
            robot.advance_ms(10);
        }
        while robot
            .outputs
            .iter()
            .all(|output| !matches!(output, Output::Event(Event::TextIn { .. })))
        {
            robot.advance(Duration::from_micros(500));
        }
        within(robot.now().since(start), expected);
    }
}

// clause: SER-02
#[test]
fn a_file_takes_the_time_of_its_bytes_and_of_the_hosts_answers() {
    let mut robot = usual();
    let program = format!(
        "PROGRAM BULK\n{}END\n",
        "DELAY 1.0 ' filler of some length\n".repeat(282)
    );
    robot
        .seat
        .controller
        .put_file("BULK", program.as_bytes())
        .unwrap();
    let start = robot.now();
    robot.send(Port::Host, b"UL,BULK\r");
    let (mut sent, mut got) = (frame(b"UL,BULK\r").len(), 0);
    loop {
        let text = received(&mut robot);
        got += text.len();
        robot.send(Port::Host, b"OK\r");
        sent += 5;
        if text.ends_with(b"\x1A\x03") {
            break;
        }
    }
    assert!(program.len() > 9_000 && got > program.len(), "{got} bytes");
    let expected = f64::from(u32::try_from(sent - 5 + got).unwrap()) * 10.0 / 9_600.0;
    within(robot.now().since(start), expected);
}

/// The next text on HOST, which takes its time.
fn received(robot: &mut Robot) -> Vec<u8> {
    let mut text = Vec::new();
    while text.last() != Some(&0x03) {
        robot.advance(Duration::from_micros(100));
        text.extend(robot.received(Port::Host));
        assert!(robot.now() < Time::from_millis(100_000), "{text:02x?}");
    }
    text
}

#[test]
fn without_pacing_nothing_takes_time() {
    let mut robot = paced("9600 8 0 1", |options| options.serial_pacing = false);
    robot.load("P", &printer(100));
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    let found = time_for(&mut robot, Port::Com1, 10_000);
    assert!(found < Duration::from_millis(100), "{found:?}");
    robot.raw(Port::Host, &[b'x'; 10_000]);
    robot.send(Port::Host, b"CA\r");
    assert!(robot.received(Port::Host).starts_with(b"\x02FL,"));
}

// clause: SER-06
#[test]
fn ten_seconds_between_characters_count_from_the_end_of_one_to_the_end_of_the_next() {
    for (gap, answered) in [(9_990, true), (10_010, false)] {
        let mut robot = paced("1200 8 0 1", |_| {});
        robot.raw(Port::Host, b"\x02S");
        robot.advance_ms(17 + gap - 9);
        robot.raw(Port::Host, b"U\r\x03");
        robot.advance_ms(3_000);
        let answer = robot.received(Port::Host);
        assert_eq!(
            answer.starts_with(b"\x02FL,"),
            answered,
            "{gap} ms: {answer:02x?}"
        );
    }
}

// clause: SER-08
#[test]
fn the_wait_for_the_hosts_answer_begins_when_the_text_is_out() {
    let mut robot = paced("1200 8 0 1", |_| {});
    robot.send(Port::Host, b"SF\r");
    robot.advance_ms(42);
    let begun = robot.now();
    time_for(&mut robot, Port::Host, 282);
    assert!(robot.now().since(begun) > Duration::from_millis(2_000));
    robot.advance_ms(9_900);
    robot.send(Port::Host, b"OK\r");
    robot.advance_ms(1_000);
    assert!(
        findings(&robot, "unexpected-answer").is_empty(),
        "the exchange was still open"
    );
}

fn settings(speed: u32, length: u8, parity: Parity, stop: u8) -> HostSettings {
    HostSettings {
        speed: Some(speed),
        length: Some(length),
        parity: Some(parity),
        stop: Some(stop),
    }
}

/// A robot whose HOST has these settings of [U06] and a host with others, and the answer to one CA.
fn mismatched(u06: &str, host: HostSettings) -> (Robot, Vec<u8>) {
    let mut robot = paced(u06, |_| {});
    opened(&mut robot, Port::Host, host);
    robot.send(Port::Host, b"CA\r");
    robot.advance_ms(2_000);
    let answer = robot.received(Port::Host);
    (robot, answer)
}

#[test]
fn a_wrong_speed_gets_no_answer_that_can_be_read_and_a_reason() {
    for speed in [1_200, 4_800, 19_200, 38_400] {
        let (robot, answer) = mismatched("9600 8 0 1", settings(speed, 8, Parity::None, 1));
        assert!(!answer.starts_with(b"\x02"), "{speed}: {answer:02x?}");
        let found = findings(&robot, "line-settings");
        assert_eq!(found.len(), 1, "{speed}");
        assert!(
            found[0].starts_with(&format!(
                "speed: [U06] says 9600 bps, the host opened the port with {speed} bps; the bytes arrive garbled"
            )),
            "{found:?}"
        );
    }
}

#[test]
fn a_wrong_parity_costs_every_character_and_a_reason() {
    let (robot, answer) = mismatched("9600 8 2 1", settings(9_600, 8, Parity::Odd, 1));
    assert_eq!(answer, b"");
    assert_eq!(dropped(&robot, "parity error"), 5);
    let found = findings(&robot, "line-settings");
    assert!(
        found[0].starts_with("parity: [U06] says even parity, the host opened the port with odd parity"),
        "{found:?}"
    );
    assert!(found[0].contains("set {HOST} = 9600 8 1 1"), "{found:?}");
    // The other reading: the robot takes the data bits all the same, and so does the host.
    let mut robot = paced("9600 8 2 1", |options| {
        options.bad_character = ts3100_controller::options::BadCharacter::Keep;
    });
    opened(&mut robot, Port::Host, settings(9_600, 8, Parity::Odd, 1));
    robot.send(Port::Host, b"CA\r");
    robot.advance_ms(2_000);
    assert!(robot.received(Port::Host).starts_with(b"\x02FL,"));
}

// clause: SER-10
#[test]
fn eight_bits_without_parity_on_a_line_of_seven_with_parity() {
    let (robot, answer) = mismatched("9600 7 2 1", settings(9_600, 8, Parity::None, 1));
    // STX, C and CR have an odd number of ones, A and ETX an even one.
    assert_eq!(dropped(&robot, "parity error"), 3, "STX, C and CR");
    let refusal = [b'N', b'G', b'\r' | 0x80, 0x03];
    assert_eq!(
        answer, refusal,
        "A and ETX are a text without CR; the parity is seen as the top bit"
    );
    assert_eq!(findings(&robot, "line-settings").len(), 1);

    // From the robot the parity is seen as the top bit: the program's PRINT.
    let mut robot = paced("9600 7 2 1", |_| {});
    opened(&mut robot, Port::Com1, settings(9_600, 8, Parity::None, 1));
    robot.load("P", "PROGRAM P\nPRINT COM1, \"ABC\", CR\nEND\n");
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    robot.advance_ms(1_000);
    assert_eq!(
        robot.received(Port::Com1),
        [b'A', b'B', b'C' | 0x80, b'\r' | 0x80]
    );
    let found = findings(&robot, "line-settings");
    assert!(
        found[0].contains("character length: [U06] says 7 bits"),
        "{found:?}"
    );
    assert!(found[0].contains("{COM1} = 9600 8 0 1"), "{found:?}");
}

#[test]
fn what_is_not_known_matches_and_the_finding_comes_once_for_each_settings() {
    let mut robot = usual();
    let unknown = HostSettings {
        speed: Some(9_600),
        ..HostSettings::default()
    };
    opened(&mut robot, Port::Host, unknown);
    robot.send(Port::Host, b"CA\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,"));
    robot.send(Port::Host, b"OK\r");
    robot.advance_ms(100);
    let other = settings(4_800, 8, Parity::None, 1);
    opened(&mut robot, Port::Host, other);
    robot.advance_ms(1_000);
    assert!(
        findings(&robot, "line-settings").is_empty(),
        "nothing was sent with them"
    );
    for _ in 0..3 {
        robot.send(Port::Host, b"CA\r");
        robot.advance_ms(1_000);
    }
    assert_eq!(findings(&robot, "line-settings").len(), 1);
    // With the right settings all is well again.
    opened(&mut robot, Port::Host, settings(9_600, 8, Parity::None, 1));
    robot.received(Port::Host);
    robot.advance_ms(11_000);
    robot.send(Port::Host, b"CA\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,"));
}

// clause: SER-02
#[test]
fn host_is_half_duplex() {
    let two = [frame(b"CA\r"), frame(b"VR\r")].concat();
    let mut robot = usual();
    robot.raw(Port::Host, &two);
    assert!(received(&mut robot).starts_with(b"\x02FL,ETHERNET.PAR"));
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Host), b"", "VR came while the robot sent");
    assert_eq!(dropped(&robot, "the robot was sending"), 5);
    assert!(!findings(&robot, "half-duplex").is_empty());
    // The other reading.
    let mut robot = paced("9600 8 0 1", |options| {
        options.while_sending = ts3100_controller::options::WhileSending::Kept;
    });
    robot.raw(Port::Host, &two);
    received(&mut robot);
    assert!(received(&mut robot).starts_with(b"\x02FL,TS3100"));
    // COM1 is full-duplex.
    let mut robot = usual();
    let program = format!(
        "GLOBAL\nN = 0\nEND\nPROGRAM P\nPRINT COM1, \"{}\"\nINPUT COM1, N\nPRINT COM1, N, CR\nEND\n",
        "x".repeat(100)
    );
    robot.load("P", &program);
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    robot.raw(Port::Com1, b"7\r");
    robot.advance_ms(1_000);
    assert!(robot.received(Port::Com1).ends_with(b"xx           7\r"));
}

// clause: CMD-SP-07 SER-02
#[test]
fn an_unsolicited_sp_waits_until_the_line_is_free() {
    let mut robot = paced("9600 8 0 1", |options| {
        options.text.stx = ts3100_proto::text::StxRule::Required;
    });
    robot.load("P", "PROGRAM P\nDELAY 0.1\nEND\n");
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    robot.advance_ms(99);
    // Four characters are on their way when the program ends, the last one's end is the 5th ms.
    robot.raw(Port::Host, b"xxxx");
    robot.advance_ms(3);
    assert_eq!(dropped(&robot, "the robot was sending"), 0);
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Host), frame(b"SP\r"));
    assert_eq!(
        dropped(&robot, "the robot was sending"),
        0,
        "no character was lost to it"
    );
}

#[test]
fn what_a_host_has_sent_still_arrives_when_it_hangs_up() {
    let mut robot = usual();
    robot.send(Port::Host, b"SO\r");
    // Half of the text has come, half is on its way.
    robot.advance_ms(3);
    robot.disconnect(Port::Host);
    robot.advance_ms(100);
    let servo = Output::Event(Event::Servo(true));
    assert!(robot.outputs.contains(&servo));
    assert_eq!(robot.seat.controller.peer(Port::Host), None);
    // The next host is there before the line is free, and hears nothing of the former one's answer.
    let mut robot = usual();
    robot.send(Port::Host, b"CA\r");
    robot.advance_ms(20);
    assert!(robot.received(Port::Host).starts_with(b"\x02FL,"));
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    robot.advance_ms(1_000);
    assert_eq!(robot.received(Port::Host), b"");
    robot.send(Port::Host, b"SU\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
}

#[test]
fn a_host_that_comes_while_its_predecessors_bytes_are_on_the_line_stays() {
    let mut robot = usual();
    robot.send(Port::Host, b"SO\r");
    robot.advance_ms(3);
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    robot.advance_ms(100);
    assert_eq!(robot.seat.controller.peer(Port::Host), Some("suite"));
    assert!(robot.outputs.contains(&Output::Event(Event::Servo(true))));
    assert_eq!(
        robot.received(Port::Host),
        b"",
        "the answer was for the former host"
    );
    robot.send(Port::Host, b"SU\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
    robot.send(Port::Host, b"OK\r");
    // Its bytes may follow those of the first directly, and its port may be set otherwise.
    robot.advance_ms(100);
    robot.send(Port::Host, b"SF\r");
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    opened(&mut robot, Port::Host, settings(9_600, 8, Parity::None, 1));
    robot.send(Port::Host, b"VR\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,TS3100"));
    assert!(
        findings(&robot, "command-in-exchange").is_empty(),
        "SF is forgotten"
    );
    // One that has gone again by then leaves its bytes as well.
    robot.send(Port::Host, b"OK\r");
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    robot.send(Port::Host, b"SP\r");
    robot.disconnect(Port::Host);
    robot.advance_ms(100);
    assert_eq!(robot.seat.controller.peer(Port::Host), None);
    assert_eq!(robot.received(Port::Host), b"");
}

#[test]
fn a_host_hears_nothing_of_its_predecessors_answers_but_all_that_is_printed() {
    let mut robot = usual();
    robot.raw(Port::Host, &[frame(b"CA\r"), vec![b'x'; 200]].concat());
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Host), b"", "CA was the former host's");

    let mut robot = usual();
    robot.load("P", "PROGRAM P\nPRINT COM1, \"FOR THE NEXT ONE\", CR\nEND\n");
    robot.panel(PanelAction::Servo(true));
    robot.raw(Port::Com1, &[b'1'; 10]);
    robot.disconnect(Port::Com1);
    robot.connect(Port::Com1);
    robot.panel(PanelAction::Start);
    robot.advance_ms(100);
    assert_eq!(robot.received(Port::Com1), b"FOR THE NEXT ONE\r");
}

/// A host has sent two commands and gone, the next one is there, and its port was purged while the first character passed.
fn purged() -> Robot {
    let mut robot = usual();
    robot.raw(Port::Host, &[frame(b"SO\r"), frame(b"XX\r")].concat());
    robot.disconnect(Port::Host);
    robot.connect(Port::Host);
    robot.advance_ms(3);
    robot.put(Input::SerialPurged { port: Port::Host });
    robot
}

#[test]
fn a_purge_forgets_what_is_not_on_the_line_and_holds_nobody_up() {
    let mut robot = purged();
    robot.advance_ms(100);
    assert!(!robot.outputs.contains(&Output::Event(Event::Servo(true))));
    robot.advance_ms(11_000);
    robot.send(Port::Host, b"SU\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
}

#[test]
fn after_a_purge_the_next_host_is_answered() {
    let mut robot = purged();
    robot.send(Port::Host, b"SU\r");
    robot.advance_ms(1_000);
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
}

#[test]
fn the_line_takes_no_more_than_it_says() {
    let mut robot = usual();
    let room = robot.seat.controller.line_room(Port::Com1).unwrap();
    robot.raw(Port::Com1, &vec![b'1'; room]);
    assert_eq!(robot.seat.controller.line_room(Port::Com1), Some(0));
    assert!(findings(&robot, "line-overflow").is_empty());
    robot.raw(Port::Com1, b"2");
    assert_eq!(findings(&robot, "line-overflow").len(), 1);
    robot.advance_ms(100);
    assert_eq!(robot.seat.controller.line_room(Port::Com1), Some(96));
    assert_eq!(robot.seat.controller.line_room(Port::Ip0), None);
}

#[test]
fn print_waits_for_room_and_a_stop_ends_the_wait() {
    let mut robot = usual();
    robot.load("P", &printer(50));
    robot.panel(PanelAction::Servo(true));
    robot.panel(PanelAction::Start);
    robot.advance_ms(500);
    assert!(
        robot.seat.controller.program_runs(),
        "5,000 bytes are not out in 0.5 s"
    );
    robot.panel(PanelAction::Stop);
    robot.advance_ms(1);
    assert!(!robot.seat.controller.program_runs());
    let before = robot.received(Port::Com1).len();
    robot.advance_ms(2_000);
    assert!((480..=1_600).contains(&(before + robot.received(Port::Com1).len())));
    robot.panel(PanelAction::Start);
    robot.advance_ms(10_000);
    assert!(!robot.seat.controller.program_runs());
}

#[test]
fn a_real_cable_does_its_own_physics() {
    let mut robot = usual();
    robot.put(Input::SerialOpened {
        port: Port::Host,
        host: HostEnd::Wire,
    });
    robot.send(Port::Host, b"CA\r");
    assert!(robot.received(Port::Host).starts_with(b"\x02FL,"));
    robot.put(Input::SerialErrors {
        port: Port::Host,
        bytes: b"SU\r".to_vec(),
    });
    let found = findings(&robot, "line-garbled");
    assert!(
        found[0].contains("9600 bps, 8 bits, no parity, 1 stop bit"),
        "{found:?}"
    );
    assert_eq!(dropped(&robot, "parity or framing error"), 3);
    let mut robot = paced("9600 8 0 1", |options| {
        options.bad_character = ts3100_controller::options::BadCharacter::Keep;
    });
    robot.put(Input::SerialErrors {
        port: Port::Host,
        bytes: frame(b"CA\r"),
    });
    assert!(received(&mut robot).starts_with(b"\x02FL,"));
}

#[test]
fn power_off_clears_the_line() {
    let mut robot = usual();
    robot.send(Port::Host, b"CA\r");
    robot.advance_ms(10);
    robot.received(Port::Host);
    robot.panel(PanelAction::PowerCycle);
    robot.advance_ms(2_000);
    assert_eq!(robot.received(Port::Host), b"");
    robot.connect(Port::Host);
    robot.send(Port::Host, b"SU\r");
    assert!(received(&mut robot).starts_with(b"\x02FL,MODE:"));
}

// clause: TRN-11
#[test]
fn both_protocol_ports_at_once_on_a_line_that_takes_time() {
    let mut robot = usual();
    robot.send(Port::Host, b"DL,BOTH\r");
    robot.advance_ms(50);
    assert_eq!(robot.received(Port::Host), frame(b"OK\r"));
    robot.send(Port::Host, b"FL,PROGRAM BOTH\rEND\r\x1A");
    assert_eq!(robot.ask(Port::Ip0, "DL,BOTH"), b"NG\r", "HOST is receiving it");
    assert!(
        robot.file(Port::Ip0, "SU").starts_with(b"MODE:"),
        "the other port serves on"
    );
    assert_eq!(received(&mut robot), frame(b"OK\r"));
    assert_eq!(robot.file(Port::Ip0, "UL,BOTH"), b"PROGRAM BOTH\rEND\r");
}
