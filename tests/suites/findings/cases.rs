//! Hosts of the findings suite that use the protocol: for each rule one that breaks it, and one that does the same work
//! and keeps it.
//!
//! Hosts of channels are in `channels.rs`; the table is in `findings.rs`.

use super::channels::{CHANNELS, RIG};
use ts3100_controller::findings::{Rule, rules};
use ts3100_controller::options::Options;
use ts3100_controller::{
    Config, ControlRight, Dialect, HostEnd, HostSettings, Input, KeySwitch, PanelAction, Port,
};
use ts3100_proto::message::split_message;
use ts3100_proto::text::Checksum;
use ts3100_tests::Robot;

pub const PROGRAM: &str = "GLOBAL\nA = 10\nEND\nPROGRAM TEST\nINPUT IP1, A, B\nPRINT IP1, A, CR\nEND\n";

/// A rule, a host that breaks it, and one that keeps it.
pub type Case = (&'static Rule, fn(&mut Robot), fn(&mut Robot));

/// A text after the pause the manual asks for.
fn say(robot: &mut Robot, data: impl AsRef<[u8]>) {
    robot.advance_ms(60);
    robot.send(Port::Ip0, data.as_ref());
}

pub fn commands(robot: &mut Robot, commands: &[&str]) {
    for command in commands {
        say(robot, format!("{command}\r"));
    }
}

/// A download in one text.
pub fn download(robot: &mut Robot, name: &str, content: impl AsRef<[u8]>) {
    say(robot, format!("DL,{name}\r"));
    say(robot, [b"FL,", content.as_ref(), b"\x1a"].concat());
}

fn with(change: impl FnOnce(&mut Options)) -> Robot {
    let mut config = Config::new(Dialect::Field);
    change(&mut config.options);
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot
}

fn summed(robot: &mut Robot, error: u8) {
    *robot = with(|options| options.text.checksum = Checksum::Sum);
    let sum = b"SO\r\x03"
        .iter()
        .fold(error, |sum, byte| sum.wrapping_add(*byte));
    robot.raw(Port::Ip0, &[b"\x02SO\r\x03", [sum].as_slice()].concat());
}

fn small_drive(robot: &mut Robot, size: usize) {
    *robot = with(|options| options.drive_capacity = 60);
    download(robot, "NEW", vec![b'A'; size]);
}

fn user_par(robot: &mut Robot, from: &str, to: &str) {
    let text = String::from_utf8(robot.file(Port::Ip0, "UL,USER.PAR")).unwrap();
    assert!(text.contains(from), "{text}");
    download(robot, "USER.PAR", text.replacen(from, to, 1));
}

fn keys(robot: &mut Robot, key: KeySwitch) {
    robot.panel(PanelAction::Key(key));
    commands(robot, &["RS,PRG"]);
}

fn host_line(robot: &mut Robot, settings: HostSettings) {
    *robot = with(|options| options.serial_pacing = true);
    robot.panel(PanelAction::ControlRight(ControlRight::Rs232c));
    robot.connect(Port::Host);
    let host = HostEnd::Modelled(settings);
    robot.put(Input::SerialOpened {
        port: Port::Host,
        host,
    });
}

/// Two texts on HOST, the second so many milliseconds after the first.
fn on_host(robot: &mut Robot, pause: u64) {
    host_line(robot, HostSettings::default());
    for _ in 0..2 {
        robot.send(Port::Host, b"SO\r");
        robot.advance_ms(pause);
    }
    robot.advance_ms(1_000);
}

fn at_speed(robot: &mut Robot, speed: u32) {
    let speed = Some(speed);
    host_line(
        robot,
        HostSettings {
            speed,
            ..HostSettings::default()
        },
    );
    robot.send(Port::Host, b"SO\r");
    robot.advance_ms(1_000);
}

fn second(robot: &mut Robot, kept: bool) {
    let peer = "10.0.0.2:4711".to_string();
    robot.put(Input::SecondPeer {
        port: Port::Ip0,
        peer,
        kept,
    });
}

const PACE_AND_TEXTS: &[Case] = &[
    (
        &rules::ANSWER_EARLY,
        |r| {
            say(r, "SU\r");
            r.advance_ms(49);
            r.send(Port::Ip0, b"OK\r");
        },
        |r| {
            say(r, "SU\r");
            r.advance_ms(50);
            r.send(Port::Ip0, b"OK\r");
        },
    ),
    (
        &rules::COMMAND_EARLY,
        |r| {
            say(r, "SO\r");
            r.advance_ms(49);
            r.send(Port::Ip0, b"SU\r");
        },
        |r| {
            say(r, "SO\r");
            r.advance_ms(50);
            r.send(Port::Ip0, b"SU\r");
        },
    ),
    (
        &rules::COMMAND_BEFORE_ANSWER,
        |r| r.raw(Port::Ip0, b"\x02SO\r\x03\x02FD\r\x03"),
        |r| commands(r, &["SO", "FD"]),
    ),
    (
        &rules::POLL_FAST,
        |r| {
            for text in ["SU\r", "OK\r", "SU\r", "OK\r"] {
                r.advance_ms(49);
                r.send(Port::Ip0, text.as_bytes());
            }
        },
        |r| commands(r, &["SU", "OK", "SU", "OK"]),
    ),
    (
        &rules::NO_STX,
        |r| r.raw(Port::Ip0, b"SO\r\x03"),
        |r| commands(r, &["SO"]),
    ),
    (
        &rules::NO_ETX,
        |r| {
            r.raw(Port::Ip0, b"SO\r");
            r.advance_ms(250);
        },
        |r| {
            r.raw(Port::Ip0, b"SO\r\x03");
            r.advance_ms(250);
        },
    ),
    (
        &rules::BYTES_OUTSIDE,
        |r| r.raw(Port::Ip0, b"\x02S\x02SO\r\x03"),
        |r| r.raw(Port::Ip0, b"\x02SO\r\x03"),
    ),
    (
        &rules::TEXT_OVER_LONG,
        |r| say(r, [&[b'A'; 253], b"\r".as_slice()].concat()),
        |r| say(r, [&[b'A'; 252], b"\r".as_slice()].concat()),
    ),
    (
        &rules::TEXT_UNFINISHED,
        |r| {
            r.raw(Port::Ip0, b"\x02S");
            r.advance_ms(10_001);
            r.raw(Port::Ip0, b"O\r\x03");
        },
        |r| {
            r.raw(Port::Ip0, b"\x02S");
            r.advance_ms(9_999);
            r.raw(Port::Ip0, b"O\r\x03");
        },
    ),
    (&rules::BAD_CHECKSUM, |r| summed(r, 1), |r| summed(r, 0)),
    (&rules::NO_CR, |r| say(r, "SO"), |r| say(r, "SO\r")),
    (
        &rules::MESSAGE_TOO_LONG,
        |r| split_message(&[b'A'; 1025]).iter().for_each(|text| say(r, text)),
        |r| split_message(&[b'A'; 1024]).iter().for_each(|text| say(r, text)),
    ),
    (
        &rules::LOWER_CASE,
        |r| commands(r, &["so"]),
        |r| commands(r, &["SO"]),
    ),
    (
        &rules::BLANK_AFTER_COMMA,
        |r| commands(r, &["RS, PRG"]),
        |r| commands(r, &["RS,PRG"]),
    ),
    (
        &rules::BLANK_AT_END,
        |r| commands(r, &["SO "]),
        |r| commands(r, &["SO"]),
    ),
    (
        &rules::COMMA_FOR_BLANK,
        |r| commands(r, &["IW,1,1"]),
        |r| commands(r, &["IW,1 1", "MR,T(1,2) 0"]),
    ),
    (
        &rules::ODD_CHARACTER,
        |r| commands(r, &["DO,PRINT TP,\"#\""]),
        |r| commands(r, &["DO,PRINT TP,\"%\""]),
    ),
    (
        &rules::ABBREVIATED,
        |r| commands(r, &["EC,MODE CYC"]),
        |r| commands(r, &["EC,MODE cycle", "EC,MODE CONT"]),
    ),
];

const COMMANDS: &[Case] = &[
    (
        &rules::UNKNOWN_COMMAND,
        |r| commands(r, &["XX"]),
        |r| commands(r, &["SO"]),
    ),
    (
        &rules::MALFORMED_COMMAND,
        |r| commands(r, &["EC,OVRD 101"]),
        |r| commands(r, &["EC,OVRD 100"]),
    ),
    (
        &rules::EXTENSION_COMMAND,
        |r| commands(r, &["SM,1", "OK"]),
        |r| commands(r, &["SU", "OK"]),
    ),
    (
        &rules::MODE_FORBIDS,
        |r| keys(r, KeySwitch::Teaching),
        |r| keys(r, KeySwitch::Ext),
    ),
    (
        &rules::START_SERVO_OFF,
        |r| commands(r, &["BR", "RN"]),
        |r| commands(r, &["BR", "SO", "RN"]),
    ),
    (
        &rules::PROGRAM_ERRORS,
        |r| {
            download(r, "NEW", "PROGRAM NEW\rGOTO NOWHERE\rEND\r");
            commands(r, &["SL,NEW"]);
        },
        |r| {
            download(r, "NEW", "PROGRAM NEW\rEND\r");
            commands(r, &["SL,NEW"]);
        },
    ),
    (
        &rules::REFUSED_BY_STATE,
        |r| commands(r, &["ER,NEW"]),
        |r| {
            download(r, "NEW", "PROGRAM NEW\rEND\r");
            commands(r, &["ER,NEW"]);
        },
    ),
    (
        &rules::REPEATED_REFUSAL,
        |r| commands(r, &["ER,NEW", "ER,NEW", "ER,NEW"]),
        |r| commands(r, &["ER,NEW", "ER,NEW", "CA", "OK", "ER,NEW", "ER,OLD"]),
    ),
    (
        &rules::SERVO_OFF_RUNNING,
        |r| commands(r, &["RN", "BR"]),
        |r| commands(r, &["RN", "SP", "BR"]),
    ),
    (
        &rules::WRITE_WHILE_RUNNING,
        |r| commands(r, &["RN", "MW,0 A 0 5"]),
        |r| commands(r, &["MW,0 A 0 5", "RN"]),
    ),
];

const EXCHANGES: &[Case] = &[
    (
        &rules::COMMAND_IN_EXCHANGE,
        |r| commands(r, &["SU", "SF"]),
        |r| commands(r, &["SU", "OK", "SF"]),
    ),
    (
        &rules::UNEXPECTED_ANSWER,
        |r| commands(r, &["SO", "OK"]),
        |r| commands(r, &["SU", "OK"]),
    ),
    (
        &rules::ANSWER_MISSING,
        |r| {
            commands(r, &["SF"]);
            r.advance_ms(10_001);
        },
        |r| {
            commands(r, &["SF"]);
            r.advance_ms(9_900);
            commands(r, &["OK"]);
            r.advance_ms(10_001);
        },
    ),
    (
        &rules::DOWNLOAD_ABANDONED,
        |r| {
            commands(r, &["DL,NEW"]);
            r.advance_ms(10_001);
        },
        |r| {
            commands(r, &["DL,NEW", "NG"]);
            r.advance_ms(10_001);
        },
    ),
    (
        &rules::LEFT_IN_EXCHANGE,
        |r| {
            commands(r, &["SU"]);
            r.disconnect(Port::Ip0);
        },
        |r| {
            commands(r, &["SU", "OK"]);
            r.disconnect(Port::Ip0);
        },
    ),
    (
        &rules::FILE_WITHOUT_DOWNLOAD,
        |r| say(r, "FL,PROGRAM NEW\rEND\r\x1a\r"),
        |r| download(r, "NEW", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::FILE_BAD_LINE,
        |r| download(r, "NEW", "PROGRAM NEW\r\tEND\r"),
        |r| download(r, "NEW", "PROGRAM NEW\r END\r"),
    ),
    (
        &rules::FILE_MALFORMED,
        |r| {
            commands(r, &["DL,NEW"]);
            say(r, "PROGRAM NEW\rEND\r\x1a");
        },
        |r| download(r, "NEW", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::FILE_TOO_LARGE,
        |r| small_drive(r, 61),
        |r| small_drive(r, 60),
    ),
    (
        &rules::FILE_LINE_ENDS,
        |r| download(r, "NEW", "PROGRAM NEW\r\nEND\r\n"),
        |r| download(r, "NEW", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::CR_AFTER_EOF,
        |r| {
            commands(r, &["DL,NEW"]);
            say(r, "FL,PROGRAM NEW\rEND\r\x1a\r");
        },
        |r| download(r, "NEW", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::SELECTED_OVERWRITTEN,
        |r| download(r, "TEST", "PROGRAM TEST\rEND\r"),
        |r| {
            commands(r, &["RS,SEL"]);
            download(r, "TEST", "PROGRAM TEST\rEND\r");
            commands(r, &["SL,TEST"]);
        },
    ),
    (
        &rules::LONG_FILE_NAME,
        |r| download(r, "NEWPROGRAM", "PROGRAM NEW\rEND\r"),
        |r| download(r, "NEWPROGR.SCL", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::PARAMETER_PENDING,
        |r| user_par(r, "= 9600", "= 9600"),
        |r| download(r, "NEW", "PROGRAM NEW\rEND\r"),
    ),
    (
        &rules::PARAMETER_BROKEN,
        |r| user_par(r, "= 9600", "= 9601"),
        |r| user_par(r, "= 9600", "= 19200"),
    ),
    (
        &rules::WATCHDOG_LATE,
        |r| {
            commands(r, &["WD,700 2"]);
            r.advance_ms(701);
        },
        |r| {
            commands(r, &["WD,700 2"]);
            r.advance_ms(600);
            commands(r, &["SM,1", "OK"]);
            r.advance_ms(600);
        },
    ),
    (
        &rules::LEFT_JOGGING,
        |r| {
            commands(r, &["MD,0", "SC,0", "JG,1 +"]);
            r.disconnect(Port::Ip0);
        },
        |r| {
            commands(r, &["MD,0", "SC,0", "JG,1 +", "JG,1 !"]);
            r.advance_ms(1_000);
            r.disconnect(Port::Ip0);
        },
    ),
    (
        &rules::SECOND_CONNECTION,
        |r| second(r, false),
        |r| {
            r.disconnect(Port::Ip0);
            r.connect(Port::Ip0);
        },
    ),
    (
        &rules::ANSWERS_UNREAD,
        |r| {
            commands(r, &["SU"]);
            r.put(Input::Backlogged { port: Port::Ip0 });
        },
        |r| commands(r, &["SU", "OK"]),
    ),
    (&rules::HALF_DUPLEX, |r| on_host(r, 8), |r| on_host(r, 100)),
    (
        &rules::LINE_SETTINGS,
        |r| at_speed(r, 19_200),
        |r| at_speed(r, 9_600),
    ),
    (
        &rules::LINE_GARBLED,
        |r| {
            r.put(Input::SerialErrors {
                port: Port::Host,
                bytes: vec![0x41; 3],
            });
        },
        |r| at_speed(r, 9_600),
    ),
    (
        &rules::LINE_OVERFLOW,
        |r| {
            host_line(r, HostSettings::default());
            r.raw(Port::Host, &[b' '; 5_000]);
        },
        |r| at_speed(r, 9_600),
    ),
];

/// All of them, in the order of the table of rules.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    let tables = [PACE_AND_TEXTS, COMMANDS, EXCHANGES, CHANNELS, RIG];
    tables.into_iter().flatten()
}
