//! Every named option (`--set NAME=VALUE`) by what a host sees of it: one row and dialogue each, with an answer for each
//! value. An option without a row fails, so does a row whose answers are all the same. What an option is for, and the
//! rest of its behaviour, is in the suites of its subject.

mod delays;
mod programs;
mod sockets;
mod texts;

use crate::extensions::text;
use std::collections::BTreeSet;
use std::time::Duration;
use texts::{
    answer_of_host_at_once, command_without_etx, first_text_of_sf, second_text_after_10_ms,
    text_and_one_byte, text_while_the_robot_sends,
};
use ts3100_controller::{Config, ControlRight, Dialect, HostEnd, HostSettings, Input, PanelAction, Port};
use ts3100_emulator::config::{LinkOptions, OPTIONS, set_option};
use ts3100_proto::parameter::Parity;
use ts3100_tests::{Robot, frame, notation};

/// An option, the dialogue that shows it, and the answer of each value. The first value is the default's: without the
/// option the answer is the same.
struct Row {
    option: &'static str,
    dialogue: fn(&mut Robot) -> String,
    answers: &'static [(&'static str, &'static str)],
}

const fn row(
    option: &'static str,
    dialogue: fn(&mut Robot) -> String,
    answers: &'static [(&'static str, &'static str)],
) -> Row {
    Row {
        option,
        dialogue,
        answers,
    }
}

const ROWS: &[Row] = &[
    row(
        "alarm.out_of_reach",
        |robot| {
            robot.command(Port::Ip0, "DO,MOVE POINT(9000,0,0)");
            let servo = robot.total(Port::Ip0)[0];
            format!("servo {servo}, alarms {}", robot.alarms().join(" "))
        },
        &[
            ("8-035", "servo 0, alarms 8-035"),
            ("4-101", "servo 1, alarms 4-101"),
        ],
    ),
    row(
        "channel.no_peer",
        programs::input_without_peer,
        &[
            ("alarm", "stop(continue), alarms 2-046"),
            ("silent", "running, alarms; then N = 5"),
        ],
    ),
    row(
        "ac.date",
        |robot| {
            robot.panel(PanelAction::EmergencyStop(true));
            ask(robot, "AC")
        },
        &[
            (
                "yyyy",
                "FL,1,008-014,Emergency Stop SW ON,2014-02-06 00:00:00<CR><EOF>",
            ),
            (
                "yy",
                "FL,1,008-014,Emergency Stop SW ON,14-02-06 00:00:00<CR><EOF>",
            ),
        ],
    ),
    row(
        "channel.no_peer",
        programs::input_without_peer,
        &[
            ("alarm", "stop(continue), alarms 2-046"),
            ("silent", "running, alarms; then N = 5"),
        ],
    ),
    row(
        "channel.no_peer",
        programs::print_without_peer,
        &[
            ("alarm", "stop(continue), alarms 2-046"),
            ("silent", "stop(reset), alarms"),
        ],
    ),
    row(
        "channel.reconnect",
        programs::input_whose_peer_connects_again,
        &[("keep", "nothing, running"), ("release", "N = 0, stop(reset)")],
    ),
    row(
        "dl.command_ends",
        command_in_a_download,
        &[("true", "FL"), ("false", "OK<CR>")],
    ),
    row(
        "do.min_run",
        |robot| run_of_a_short_do(robot, "DO,MOVEI 1, 0"),
        &[
            ("200ms", "199 ms: 1, 201 ms: 0, 299 ms: 0, 301 ms: 0"),
            ("300ms", "199 ms: 1, 201 ms: 1, 299 ms: 1, 301 ms: 0"),
            ("0s", "199 ms: 0, 201 ms: 0, 299 ms: 0, 301 ms: 0"),
        ],
    ),
    row(
        "do.min_run",
        |robot| run_of_a_short_do(robot, "DO,SPEED = 50"),
        &[
            ("200ms", "199 ms: 1, 201 ms: 0, 299 ms: 0, 301 ms: 0"),
            ("300ms", "199 ms: 1, 201 ms: 1, 299 ms: 1, 301 ms: 0"),
            ("0s", "199 ms: 0, 201 ms: 0, 299 ms: 0, 301 ms: 0"),
        ],
    ),
    row(
        "drive.capacity",
        download_of_20_kb,
        &[("1048576", "OK<CR>"), ("10000", "NG<CR>")],
    ),
    row(
        "drive.open_mode",
        open_modes_of_a_fresh_drive,
        &[("1 1 1 1", "1 1 1 1"), ("1 0 2 0", "1 0 2 0")],
    ),
    row(
        "extensions",
        |robot| ask(robot, "MD,1"),
        &[("true", "OK<CR>"), ("false", "NG<CR>")],
    ),
    row(
        "input.malformed",
        input_of_12abc,
        &[
            ("alarm", "nothing, alarms 2-046"),
            ("leading-number", "12, alarms"),
        ],
    ),
    row(
        "io.field_bus",
        |robot| ask(robot, "IW,301 1"),
        &[("absent", "NG<CR>"), ("present", "OK<CR>")],
    ),
    row(
        "parameter.line_end",
        line_end_of_a_fresh_file,
        &[("lf", "LF"), ("cr", "CR")],
    ),
    row(
        "reply.delay",
        delays::time_of_an_answer,
        &[
            ("0", "at once"),
            ("30", "after 30 ms"),
            ("10 10 40 40 40", "between 10 and 40 ms"),
        ],
    ),
    row(
        "rs.cycle_without_label",
        |robot| ask(robot, "RS,CYC"),
        &[("as-step", "OK<CR>"), ("ng", "NG<CR>")],
    ),
    row(
        "scol.data_copy",
        datum_after_a_subprogram_changed_it,
        &[("false", "9.000"), ("true", "1.000")],
    ),
    row(
        "scol.din_unknown",
        |robot| printed(robot, "PRINT IP1, DIN(170), CR"),
        &[("alarm", "nothing, alarms 2-104"), ("zero", "0, alarms")],
    ),
    row(
        "scol.din_unknown",
        |robot| printed(robot, "ON DIN(170) DO DOUT(1)\nDELAY 0.05"),
        &[("alarm", "nothing, alarms 2-104"), ("zero", "nothing, alarms")],
    ),
    row(
        "scol.equal_within",
        |robot| printed(robot, "PRINT IP1, 1.0 == 1.25, CR"),
        &[("0", "0, alarms"), ("0.5", "1, alarms")],
    ),
    row(
        "scol.int_division",
        |robot| printed(robot, "PRINT IP1, 7/2, CR"),
        &[("truncate", "3, alarms"), ("real", "3.500, alarms")],
    ),
    row(
        "scol.reset_locals",
        programs::variable_after_rs_stp,
        &[("false", "5, alarms"), ("true", "nothing, alarms 2-102")],
    ),
    row(
        "scol.sticky_work",
        second_point_behind_work,
        &[("false", "400.000"), ("true", "500.000")],
    ),
    row(
        "serial.bad_character",
        text_with_wrong_parity,
        &[("drop", "silence"), ("keep", "<STX>OK<CR><ETX>")],
    ),
    row(
        "serial.pacing",
        answer_of_host_at_once,
        &[("true", "silence"), ("false", "<STX>OK<CR><ETX>")],
    ),
    row(
        "serial.while_sending",
        text_while_the_robot_sends,
        &[("lost", "1 answer"), ("kept", "2 answers")],
    ),
    row(
        "servo.interval",
        third_servo_on,
        &[("0s", "servo 1, after 8 s 1"), ("7s", "servo 0, after 8 s 1")],
    ),
    row(
        "sf.split",
        first_text_of_sf,
        &[("one", "282 bytes"), ("several", "255 bytes")],
    ),
    row(
        "sig.low_speed",
        low_speed,
        &[
            ("10", "LSPEED:10%, slow: 5.0 s"),
            ("50", "LSPEED:50%, slow: 1.0 s"),
        ],
    ),
    row(
        "sig.strobe",
        run_without_strobe,
        &[("free", "running"), ("required", "stop(reset)")],
    ),
    row(
        "sp.unsolicited",
        told_of_stops,
        &[
            ("auto", "yes, after an extension no"),
            ("true", "yes, after an extension yes"),
            ("false", "no, after an extension no"),
        ],
    ),
    row(
        "strict_50ms",
        second_text_after_10_ms,
        &[("false", "<STX>OK<CR><ETX>"), ("true", "silence")],
    ),
    row(
        "su.layout",
        |robot| {
            text(robot, "SU")
                .split("OVRD")
                .next()
                .unwrap_or_default()
                .replace('\r', "<CR>")
        },
        &[
            ("one-record", "MODE:external(ethernet)/cycle FILE: "),
            ("six-records", "MODE:external (ethernet)/cycle<CR>FILE:<CR>"),
        ],
    ),
    row(
        "text.checksum",
        text_and_one_byte,
        &[
            ("none", "<STX>OK<CR><ETX>, then silence"),
            ("sum", "silence, then <STX>OK<CR><ETX><AA>"),
        ],
    ),
    row(
        "text.end",
        command_without_etx,
        &[
            ("detect", "silence, after 250 ms OK<CR><ETX>"),
            ("etx", "silence, after 250 ms silence"),
            ("cr", "OK<CR><ETX>, after 250 ms silence"),
        ],
    ),
    row(
        "text.require_cr",
        |robot| received(robot, Port::Ip0, b"\x02SP\x03"),
        &[("false", "<STX>OK<CR><ETX>"), ("true", "<STX>NG<CR><ETX>")],
    ),
    row(
        "text.stx",
        |robot| received(robot, Port::Ip0, b"SP\r\x03"),
        &[("detect", "OK<CR><ETX>"), ("required", "silence")],
    ),
    row(
        "vr.layout",
        |robot| text(robot, "VR").chars().skip(10).take(2).collect(),
        &[("blanks", " 2"), ("packed", "20")],
    ),
    row(
        "wait.after_stop",
        programs::start_after_a_stop_in_wait,
        &[("next", "PAST, stop(reset)"), ("again", "nothing, running")],
    ),
];

/// Options of the edge: real sockets show them, in `sockets`.
const ON_SOCKETS: [&str; 4] = [
    "auto.silence",
    "channel.redial",
    "channel.second",
    "drive.when_full",
];

fn robot_with(option: Option<(&str, &str)>) -> Robot {
    let (mut config, mut links) = (Config::new(Dialect::Field), LinkOptions::default());
    if let Some((key, value)) = option {
        set_option(&mut config.options, &mut links, key, value).unwrap();
    }
    let mut robot = Robot::with(config);
    robot.connect(Port::Ip0);
    robot.panel(PanelAction::Servo(true));
    robot
}

#[test]
fn each_value_of_each_option_has_its_own_answer_on_the_wire() {
    let mut wrong = Vec::new();
    for Row {
        option,
        dialogue,
        answers,
    } in ROWS
    {
        let different: BTreeSet<&str> = answers.iter().map(|(_, answer)| *answer).collect();
        assert!(
            different.len() > 1,
            "{option}: the dialogue tells no values apart"
        );
        let default = (None, answers[0].1);
        let set = answers
            .iter()
            .map(|(value, answer)| (Some((*option, *value)), *answer));
        for (setting, expected) in std::iter::once(default).chain(set) {
            let found = dialogue(&mut robot_with(setting));
            if found != expected {
                wrong.push(format!(
                    "{option} {setting:?}: expected {expected}, found {found}"
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_option_has_a_row() {
    let known: BTreeSet<&str> = OPTIONS.iter().map(|row| row.key).collect();
    let mut shown: BTreeSet<&str> = ROWS.iter().map(|row| row.option).collect();
    shown.extend(ON_SOCKETS);
    assert_eq!(
        shown, known,
        "give a new option a row with a dialogue that tells its values apart"
    );
}

/// What the port sends after these bytes.
fn received(robot: &mut Robot, port: Port, bytes: &[u8]) -> String {
    robot.raw(port, bytes);
    shown(&robot.received(port))
}

fn shown(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        "silence".to_string()
    } else {
        notation::write(bytes)
    }
}

fn ask(robot: &mut Robot, command: &str) -> String {
    notation::write(&robot.ask(Port::Ip0, command))
}

/// The last item of SU.
fn status(robot: &mut Robot) -> String {
    let content = text(robot, "SU");
    content.rsplit_once("STATUS:").unwrap().1.to_string()
}

fn alarms(robot: &Robot) -> String {
    [vec!["alarms".to_string()], robot.alarms()].concat().join(" ")
}

/// SF's motion status.
fn moves(robot: &mut Robot) -> u8 {
    robot.total(Port::Ip0)[2]
}

fn run(robot: &mut Robot, program: &str) {
    robot.load("TEST", program);
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
}

/// What the program's one statement prints on IP1, and the alarms.
fn printed(robot: &mut Robot, statement: &str) -> String {
    robot.connect(Port::Ip1);
    run(robot, &format!("PROGRAM T\n{statement}\nEND\n"));
    let bytes = robot.received(Port::Ip1);
    let shown = String::from_utf8(bytes).unwrap().trim().to_string();
    let shown = if shown.is_empty() {
        "nothing".to_string()
    } else {
        shown
    };
    format!("{shown}, {}", alarms(robot))
}

fn command_in_a_download(robot: &mut Robot) -> String {
    robot.command(Port::Ip0, "DL,OTHER");
    robot.send(Port::Ip0, b"FL,PROGRAM O\n");
    assert_eq!(robot.received(Port::Ip0), frame(b"OK\r"));
    let answer = ask(robot, "CA");
    answer.split(',').next().unwrap().to_string()
}

fn run_of_a_short_do(robot: &mut Robot, command: &str) -> String {
    robot.command(Port::Ip0, command);
    let (start, mut shown) = (robot.now(), Vec::new());
    for at in [199, 201, 299, 301] {
        robot.advance(Duration::from_millis(at) - robot.now().since(start));
        shown.push(format!("{at} ms: {}", moves(robot)));
    }
    shown.join(", ")
}

fn download_of_20_kb(robot: &mut Robot) -> String {
    robot.command(Port::Ip0, "DL,BIG");
    let content = [b"FL,".as_slice(), &b"REMARK X\n".repeat(20_000 / 9), b"\x1A"].concat();
    let mut answer = Vec::new();
    for block in content.chunks(253) {
        robot.send(Port::Ip0, block);
        answer = robot.received(Port::Ip0);
    }
    notation::write(&ts3100_tests::unframe(&answer).unwrap())
}

fn open_modes_of_a_fresh_drive(robot: &mut Robot) -> String {
    let content = text(robot, "UL,ETHERNET.PAR");
    let value = content.split("[E00]").nth(1).unwrap().split('=').nth(1).unwrap();
    value.lines().next().unwrap().trim().to_string()
}

fn input_of_12abc(robot: &mut Robot) -> String {
    robot.connect(Port::Ip1);
    run(robot, "PROGRAM T\nINPUT IP1, N\nPRINT IP1, N, CR\nEND\n");
    robot.raw(Port::Ip1, b"12abc\r");
    robot.advance_ms(100);
    let shown = String::from_utf8(robot.received(Port::Ip1))
        .unwrap()
        .trim()
        .to_string();
    let shown = if shown.is_empty() {
        "nothing".to_string()
    } else {
        shown
    };
    format!("{shown}, {}", alarms(robot))
}

fn line_end_of_a_fresh_file(robot: &mut Robot) -> String {
    let content = text(robot, "UL,USER.PAR");
    let ends = [('\n', "LF"), ('\r', "CR")];
    let found = ends.iter().filter(|(end, _)| content.contains(*end));
    found.map(|(_, name)| *name).collect::<Vec<_>>().join(" ")
}

fn datum_after_a_subprogram_changed_it(robot: &mut Robot) -> String {
    robot.connect(Port::Ip1);
    run(
        robot,
        "PROGRAM T\nCHANGE\nPRINT IP1, P.X, CR\nEND\nPROGRAM CHANGE\nP.X = 9\nEND\nDATA\nPOINT P=1/\nEND\n",
    );
    String::from_utf8(robot.received(Port::Ip1))
        .unwrap()
        .trim()
        .to_string()
}

fn second_point_behind_work(robot: &mut Robot) -> String {
    run(
        robot,
        "PROGRAM T\nMOVE B\nEND\nDATA\nTRANS W=100\nWORK W\nPOINT A=0/\nPOINT B=400,0,200/\nEND\n",
    );
    robot.advance_ms(5_000);
    format!("{:.3}", robot.float(Port::Ip0, 148))
}

/// HOST set to even parity, and a host that sends with odd.
fn text_with_wrong_parity(robot: &mut Robot) -> String {
    robot.set_serial_line("HOST", "9600 8 2 1");
    robot.panel(PanelAction::PowerCycle);
    robot.connect(Port::Host);
    let host = HostSettings {
        speed: Some(9_600),
        length: Some(8),
        parity: Some(Parity::Odd),
        stop: Some(1),
    };
    robot.put(Input::SerialOpened {
        port: Port::Host,
        host: HostEnd::Modelled(host),
    });
    robot.raw(Port::Host, &frame(b"SP\r"));
    robot.advance_ms(1_000);
    shown(&robot.received(Port::Host))
}

fn with_host(robot: &mut Robot) {
    robot.panel(PanelAction::ControlRight(ControlRight::Rs232c));
    robot.connect(Port::Host);
}

fn third_servo_on(robot: &mut Robot) -> String {
    for _ in 0..2 {
        robot.command(Port::Ip0, "BR");
        robot.panel(PanelAction::Servo(false));
        robot.command(Port::Ip0, "SO");
    }
    let at_once = robot.total(Port::Ip0)[0];
    robot.advance_ms(8_000);
    format!("servo {at_once}, after 8 s {}", robot.total(Port::Ip0)[0])
}

/// A turn of 60 degrees with LOW_SPD on.
fn low_speed(robot: &mut Robot) -> String {
    robot.panel(PanelAction::InputLine { line: 259, on: true });
    let content = text(robot, "SU");
    let shown = content
        .split(' ')
        .find(|item| item.starts_with("LSPEED"))
        .unwrap()
        .to_string();
    robot.command(Port::Ip0, "DO,MOVEA 1, 60");
    let start = robot.now();
    while moves(robot) == 1 {
        robot.advance_ms(20);
    }
    format!("{shown}, slow: {:.1} s", robot.now().since(start).as_secs_f64())
}

fn run_without_strobe(robot: &mut Robot) -> String {
    robot.panel(PanelAction::ControlRight(ControlRight::Sig));
    robot.load("TEST", "PROGRAM T\nDELAY 10\nEND\n");
    robot.panel(PanelAction::InputLine { line: 255, on: true });
    robot.advance_ms(100);
    status(robot)
}

fn told_of_stops(robot: &mut Robot) -> String {
    robot.load("TEST", "PROGRAM T\nDELAY 0.1\nEND\n");
    let mut stop_comes = || {
        robot.command(Port::Ip0, "RN");
        robot.advance_ms(1_000);
        let stop_comes = robot.received(Port::Ip0) == frame(b"SP\r");
        robot.file(Port::Ip0, "SM,1");
        if stop_comes { "yes" } else { "no" }
    };
    let (first, second) = (stop_comes(), stop_comes());
    format!("{first}, after an extension {second}")
}
