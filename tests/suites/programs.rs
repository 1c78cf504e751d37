//! Walks `fixtures/scol/run`: every program runs in a whole controller under virtual time, and what it prints, which
//! outputs it switches, its alarms, how long it takes and where the arm is at the end are as expected.
//!
//! A program says in comments what happens outside: `' arm: scara` or `scara-4`, `' mode: continuous`, `' limit: 5000`, and
//! `' @1200 ...` at that millisecond after the start: `din 3 on`, `ip1 1,2.5`, `key 7`, `host SP`, `start`, `stop`,
//! `hold`. Nothing of the language is repeated here.

use crate::extensions::{scara_of as small_robot, six_axis};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;
use ts3100_controller::model::ArmModel;
use ts3100_controller::{Event, Output, PanelAction, Port};
use ts3100_tests::{Robot, notation};

/// A program that has not ended by then is left alone, in milliseconds.
const LIMIT: u64 = 60_000;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/scol/run")
}

/// Where it is written what a program brings about.
fn golden(program: &Path) -> PathBuf {
    let name = program.with_extension("txt");
    folder().join("../../golden/run").join(name.file_name().unwrap())
}

pub fn programs() -> Vec<(PathBuf, String)> {
    let mut list: Vec<(PathBuf, String)> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "scol"))
        .map(|path| (path.clone(), std::fs::read_to_string(path).unwrap()))
        .collect();
    list.sort();
    list
}

fn directive<'a>(source: &'a str, name: &str) -> Option<&'a str> {
    let key = format!("' {name}: ");
    source.lines().find_map(|line| line.strip_prefix(&key))
}

/// What happens outside: milliseconds after the start, and what.
fn script(source: &str) -> Vec<(u64, String)> {
    let happens = |line: &str| {
        let (at, what) = line.strip_prefix("' @")?.split_once(' ')?;
        Some((at.parse().unwrap(), what.to_string()))
    };
    source.lines().filter_map(happens).collect()
}

/// What a program has brought about, line by line.
struct Log {
    text: String,
    lit: Vec<u16>,
    start: u64,
}

impl Log {
    fn line(&mut self, robot: &Robot, what: &str) {
        let micros = robot.now().as_micros() - self.start;
        writeln!(
            self.text,
            "{}.{:06} {what}",
            micros / 1_000_000,
            micros % 1_000_000
        )
        .unwrap();
    }

    /// Everything new since the last look.
    fn look(&mut self, robot: &mut Robot) {
        for output in std::mem::take(&mut robot.outputs) {
            match output {
                Output::Pendant(text) => {
                    self.line(robot, &format!("TP {}", notation::write(text.as_bytes())));
                }
                Output::Event(Event::Alarm { number, text }) => {
                    self.line(robot, &format!("ALARM {number} {text}"));
                }
                Output::Event(Event::Status { status, line }) => {
                    self.line(robot, &format!("{} line {line}", status.as_str().to_uppercase()));
                }
                _ => {}
            }
        }
        for port in [Port::Ip1, Port::Ip2, Port::Com1] {
            let bytes = robot.received(port);
            if !bytes.is_empty() {
                self.line(robot, &format!("{port} {}", notation::write(&bytes)));
            }
        }
        let lit = outputs(&status(robot));
        let on = lit.iter().filter(|line| !self.lit.contains(line));
        let off = self.lit.iter().filter(|line| !lit.contains(line));
        let changes: Vec<String> = on
            .map(|line| format!("+{line}"))
            .chain(off.map(|line| format!("-{line}")))
            .collect();
        if !changes.is_empty() {
            self.line(robot, &format!("DOUT {}", changes.join(" ")));
        }
        self.lit = lit;
    }
}

/// The user outputs that are on (SF-33 to SF-37).
fn outputs(status: &[u8]) -> Vec<u16> {
    const FIRST: usize = 84;
    let ranges = [(1, 64, 0), (101, 164, 4), (201, 208, 8)];
    let mut lit = Vec::new();
    for (first, last, word) in ranges {
        for line in first..=last {
            let bit = usize::from(line - first);
            let at = FIRST + 2 * (word + bit / 16);
            let value = u16::from_be_bytes([status[at], status[at + 1]]);
            if value >> (bit % 16) & 1 == 1 {
                lit.push(line);
            }
        }
    }
    lit
}

fn pose(robot: &Robot, scara: bool) -> String {
    let (at, count) = if scara { (140, 5) } else { (148, 6) };
    let status = status(robot);
    let coordinates: Vec<String> = (0..count)
        .map(|index| {
            let at = at + 4 * index;
            let value = f32::from_be_bytes(status[at..at + 4].try_into().unwrap());
            format!("{:.3}", if value.abs() < 0.0005 { 0.0 } else { value })
        })
        .collect();
    coordinates.join(" ")
}

fn act(robot: &mut Robot, what: &str) {
    let (word, rest) = what.split_once(' ').unwrap_or((what, ""));
    let record = [rest.as_bytes(), b"\r"].concat();
    match word {
        "din" => {
            let (line, state) = rest.split_once(' ').unwrap();
            let (line, on) = (line.parse().unwrap(), state == "on");
            robot.panel(PanelAction::InputLine { line, on });
        }
        "ip1" => robot.raw(Port::Ip1, &record),
        "ip2" => robot.raw(Port::Ip2, &record),
        "com1" => robot.raw(Port::Com1, &record),
        "key" => robot.panel(PanelAction::Keys(format!("{rest}\r"))),
        "host" => robot.command(Port::Ip0, rest),
        "start" => robot.panel(PanelAction::Start),
        "stop" => robot.panel(PanelAction::Stop),
        "hold" => robot.panel(PanelAction::PressFeedHold),
        other => panic!("{other} is no directive"),
    }
}

/// The body of SF, requested from a copy so that the program is not disturbed.
fn status(robot: &Robot) -> Vec<u8> {
    let text = robot.clone().ask(Port::Ip0, "SF");
    text.strip_prefix(b"FL,").unwrap().to_vec()
}

fn runs(robot: &Robot) -> bool {
    status(robot)[2] == 1
}

pub fn play(source: &str) -> String {
    let arm = directive(source, "arm");
    let small = arm.is_some();
    let mut robot = match arm {
        None => six_axis(),
        Some("scara-4") => small_robot(ArmModel::thl400_four_axes()),
        Some(_) => small_robot(ArmModel::thl400()),
    };
    for port in [Port::Ip1, Port::Ip2, Port::Com1] {
        robot.connect(port);
    }
    robot.load("TEST", source);
    if let Some(mode) = directive(source, "mode") {
        robot.command(Port::Ip0, &format!("EC,MODE {mode}"));
    }
    robot.outputs.clear();
    let mut log = Log {
        text: String::new(),
        lit: Vec::new(),
        start: robot.now().as_micros(),
    };
    let limit = directive(source, "limit").map_or(LIMIT, |limit| limit.parse().unwrap());
    let mut script = script(source).into_iter().peekable();
    robot.panel(PanelAction::Start);
    log.look(&mut robot);
    loop {
        let now = robot.now().as_micros() - log.start;
        if let Some((_, what)) = script.next_if(|(at, _)| *at * 1_000 <= now) {
            act(&mut robot, &what);
            log.look(&mut robot);
            continue;
        }
        let next = script.peek().map_or(limit * 1_000, |(at, _)| *at * 1_000);
        if now >= limit * 1_000 || (next == limit * 1_000 && !runs(&robot)) {
            break;
        }
        let due = robot.seat.controller.poll_deadline().map_or(u64::MAX, |due| {
            (due.as_micros().saturating_sub(log.start)).max(now + 1)
        });
        robot.advance(Duration::from_micros(due.min(next).min(limit * 1_000) - now));
        log.look(&mut robot);
    }
    let place = pose(&robot, small);
    log.line(&robot, &format!("POSE {place}"));
    log.text
}

// clause: PRT-13 PRT-15 INP-01 CMD-RN-01 SF-24 CMD-SP-03
#[test]
fn programs_run_as_expected() {
    let mut wrong = Vec::new();
    for (path, source) in programs() {
        let expected = std::fs::read_to_string(golden(&path)).unwrap_or_default();
        let found = play(&source);
        if found != expected {
            wrong.push(format!("{}: expected\n{expected}found\n{found}", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "writes fixtures/golden/run anew; review the difference"]
fn bless_programs() {
    for (path, source) in programs() {
        std::fs::write(golden(&path), play(&source)).unwrap();
    }
}

/// Execution line, analysis line, execution task, analysis task of SF.
fn lines(robot: &Robot) -> [u16; 4] {
    let body = status(robot);
    [24, 26, 28, 30].map(|at| u16::from_be_bytes([body[at], body[at + 1]]))
}

const POINTS: &str = "DATA\nPOINT A=400,-200,200/\nPOINT B=400,200,200/\nEND\n";

// clause: SF-24
#[test]
fn the_analysis_line_runs_ahead_of_the_motion() {
    let mut robot = Robot::ready(&format!(
        "PROGRAM M\nENABLE NOWAIT\nMOVE A WITH SPEED=10\nDISABLE NOWAIT\nMOVE B\nMOVE A\nSTOP\nEND\n{POINTS}"
    ));
    robot.command(Port::Ip0, "RN");
    assert_eq!(
        lines(&robot),
        [3, 5, 1, 1],
        "line 5 waits for the motion of line 3"
    );
    while lines(&robot)[0] == 3 {
        robot.advance_ms(10);
    }
    assert_eq!(
        lines(&robot),
        [5, 6, 1, 1],
        "a MOVE after a MOVE is read before its time"
    );
    while lines(&robot)[0] == 5 {
        robot.advance_ms(10);
    }
    assert_eq!(
        lines(&robot),
        [6, 6, 1, 1],
        "STOP is not read before the motion has ended"
    );
}

// clause: SF-24
#[test]
fn the_task_that_moves_and_the_task_that_is_read_are_told_apart() {
    let mut robot = Robot::ready(&format!(
        "PROGRAM M\nI=TASK(\"MOVER\")\nWAIT MOTION<100\nDELAY 0.05\nDELAY 5\nEND\nPROGRAM MOVER\nMOVE A\n\
         MOVE B WITH SPEED=10\nEND\n{POINTS}"
    ));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(100);
    assert_eq!(lines(&robot), [8, 5, 2, 1]);
}

// clause: CMD-DO-01 CMD-DO-02 L75
#[test]
fn gain_by_do_is_ok_and_read_by_a_program() {
    let mut robot = Robot::ready("PROGRAM M\nPRINT IP1, GAIN(4), GAIN(5), CR\nEND\n");
    robot.command(Port::Ip0, "DO,GAIN={1,1,1,1,0}");
    robot.advance_ms(300);
    robot.command(Port::Ip0, "RN");
    assert_eq!(robot.received(Port::Ip1), b"       1.000       0.000\r");
}

// clause: CMD-EC-04 CMD-BR-02
#[test]
fn break_stops_all_tasks_and_rn_goes_on_with_all() {
    let mut robot = Robot::ready(&format!(
        "PROGRAM M\nI=TASK(\"SIDE\")\nMOVE B WITH SPEED=10\nPRINT IP1,\"M\"\nWAIT DIN(1)\nEND\nPROGRAM SIDE\n\
         DELAY 1\nPRINT IP1,\"S\"\nEND\n{POINTS}"
    ));
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(500);
    robot.command(Port::Ip0, "EC,BREAK");
    robot.advance_ms(5_000);
    assert_eq!(robot.received(Port::Ip1), b"");
    assert_eq!(status(&robot)[2], 2, "stop (retry)");
    robot.command(Port::Ip0, "RN");
    robot.advance_ms(20_000);
    assert_eq!(robot.received(Port::Ip1), b"MS");
}
