//! Tests of replaying recordings: equal, different, missing and surplus answers, in bytes and in time.

mod epochs;
mod kept;
mod lines;

use super::*;
use crate::transcript::{Observer, Record, RecordKind, Side};
use ts3100_controller::Bytes;
use ts3100_controller::options::{Config, Dialect};
use ts3100_controller::{Controller, Input, Output, PanelAction, Port};
use ts3100_driver::tcp::SecondConnection;

const PICK: &str = "PROGRAM PICK\nN = 0\nASK:\nPRINT IP1, \"REQ\", CR\nINPUT IP1, N\nDELAY 2\n\
    PRINT IP1, \"DONE\", N, CR\nGOTO ASK\nEND\n";
const SECOND: Duration = Duration::from_secs(1);

/// What the recorded robot and the emulator are started with.
#[derive(Clone)]
struct Settings {
    controller: Config,
    program: String,
    second: SecondConnection,
    servo_on: bool,
}

impl Settings {
    fn candidate(&self) -> Candidate {
        let mut controller = Controller::new(self.controller.clone(), Vec::new()).unwrap();
        controller.put_file("PICK", self.program.as_bytes()).unwrap();
        controller.select(Time::ZERO, "PICK").unwrap();
        let (second, servo_on) = (self.second, self.servo_on);
        Candidate {
            controller,
            second,
            servo_on,
        }
    }
}

fn with(program: &str) -> Settings {
    Settings {
        controller: Config::new(Dialect::Field),
        program: program.to_owned(),
        second: SecondConnection::default(),
        servo_on: false,
    }
}

/// A controller that is recorded: it stands for a real one.
struct Real {
    controller: Controller,
    observer: Observer,
    now: Time,
    /// How long each answer takes, which a host waits for.
    delay: Duration,
    /// What the delays add up to.
    late: Duration,
    recording: Recording,
}

impl Real {
    fn new(settings: &Settings) -> Real {
        let mut controller = settings.candidate().controller;
        while controller.poll_output().is_some() {}
        Real {
            controller,
            observer: Observer::default(),
            now: Time::ZERO,
            delay: Duration::ZERO,
            late: Duration::ZERO,
            recording: Recording::default(),
        }
    }

    fn note(&mut self, what: Option<RecordKind>) {
        if let Some(what) = what {
            if matches!(what, RecordKind::FromRobot { .. }) {
                self.late += self.delay;
            }
            let at = self.now + self.late;
            self.recording.records.push(Record { at, kind: what });
            self.recording.lines.push(self.recording.records.len());
        }
    }

    fn feed(&mut self, input: Input, by: Side) {
        let what = self.observer.input(&input, by);
        self.note(what);
        let _refusal_is_an_event = self.controller.handle(self.now, input);
        while let Some(output) = self.controller.poll_output() {
            let what = self.observer.output(&output);
            self.note(what);
            if output == Output::PowerCycled {
                for port in [Port::Ip0, Port::Ip1] {
                    self.feed(Input::Disconnected { port }, Side::Robot);
                }
            }
        }
    }

    fn pass(&mut self, duration: Duration) {
        let to = self.now + duration;
        while let Some(due) = self.controller.poll_deadline().filter(|due| *due <= to) {
            self.now = due;
            self.feed(Input::Tick, Side::Robot);
        }
        self.now = to;
    }

    fn connect(&mut self, port: Port) {
        let peer = "192.0.2.2:5000".to_owned();
        self.feed(Input::Connected { port, peer }, Side::Host);
    }

    fn send(&mut self, port: Port, bytes: &[u8]) {
        let bytes = bytes.to_vec();
        self.feed(Input::received(port, bytes), Side::Host);
        self.pass(Duration::from_millis(60));
    }

    fn texts(&mut self, messages: &[&str]) {
        for message in messages {
            self.send(Port::Ip0, format!("\x02{message}\r\x03").as_bytes());
        }
    }

    fn panel(&mut self, panel: PanelAction) {
        self.feed(Input::by_hand(panel), Side::Host);
    }
}

/// A day with a bit of everything, recorded with answers that take `delay`.
fn day(settings: &Settings, delay: Duration) -> Recording {
    let mut real = Real::new(settings);
    real.delay = delay;
    real.connect(Port::Ip0);
    real.connect(Port::Ip1);
    real.texts(&[
        "SU", "OK", "SF", "OK", "VR", "OK", "CA", "OK", "SO", "SL,NOPE", "RN",
    ]);
    real.send(Port::Ip1, b"7\r");
    for _ in 0..20 {
        real.texts(&["SU", "OK", "SF", "OK"]);
    }
    real.pass(SECOND);
    real.send(Port::Ip1, b"8\r\n");
    real.panel(PanelAction::EmergencyStop(true));
    real.pass(SECOND);
    real.panel(PanelAction::EmergencyStop(false));
    real.texts(&["EU", "OK", "UL,PICK", "OK", "DL,NEW"]);
    real.send(Port::Ip0, b"\x02FL,PROGRAM NEW\nEND\n\x1A\x03");
    real.send(Port::Ip0, b"SO\r\x03SU\r\x03");
    real.send(Port::Ip0, b"OK\r\x03");
    real.panel(PanelAction::PowerCycle);
    real.pass(SECOND);
    real.connect(Port::Ip0);
    real.texts(&["CA", "OK"]);
    real.feed(Input::Disconnected { port: Port::Ip0 }, Side::Host);
    real.recording
}

fn compared(recording: &Recording, settings: &Settings, tolerance: &Tolerance) -> Report {
    diff(recording, settings.candidate(), tolerance)
}

fn none(report: &Report) {
    assert_eq!(report.differences, [], "{report:?}");
}

fn ignoring(words: &[&str]) -> Tolerance {
    let words: Vec<String> = words.iter().map(ToString::to_string).collect();
    let mut tolerance = Tolerance::default();
    tolerance.ignore.add(&words).unwrap();
    tolerance
}

/// The answers of a recording to one command, as places.
fn answers_to(recording: &Recording, command: &[u8]) -> Vec<usize> {
    let mut question = false;
    let mut found = Vec::new();
    for (index, record) in recording.records.iter().enumerate() {
        match &record.kind {
            RecordKind::FromHost { bytes, .. } => question = bytes.starts_with(&[b"\x02", command].concat()),
            RecordKind::FromRobot { line, .. } if question && line.port == Port::Ip0 => found.push(index),
            _ => {}
        }
    }
    found
}

fn bytes_mut(recording: &mut Recording, index: usize) -> &mut Bytes {
    match &mut recording.records[index].kind {
        RecordKind::FromRobot { bytes, .. } | RecordKind::FromHost { bytes, .. } => bytes,
        other => panic!("{other:?}"),
    }
}

fn change_bytes(recording: &mut Recording, index: usize, change: impl FnOnce(&mut [u8])) {
    let bytes = bytes_mut(recording, index);
    let mut changed = bytes.to_vec();
    change(&mut changed);
    *bytes = changed.into();
}

/// Replaces in an answer of the recording, and gives the only difference.
fn doctored(command: &str, from: &str, to: &str) -> Difference {
    let settings = with(PICK);
    let mut recording = day(&settings, Duration::ZERO);
    let index = answers_to(&recording, command.as_bytes())[0];
    let bytes = bytes_mut(&mut recording, index);
    let text: String = bytes.iter().copied().map(char::from).collect();
    assert!(text.contains(from), "{text:?}");
    *bytes = text
        .replacen(from, to, 1)
        .chars()
        .map(|char| char as u8)
        .collect();
    let report = compared(&recording, &settings, &Tolerance::default());
    assert_eq!(report.differences.len(), 1, "{report:?}");
    assert_eq!(report.differences[0].file_line, index + 1);
    report.differences[0].clone()
}

fn only_part(difference: &Difference) -> (String, String, String) {
    match &difference.kind {
        DifferenceKind::Bytes { parts, .. } if parts.len() == 1 => (
            parts[0].key.clone(),
            parts[0].recorded.clone().unwrap(),
            parts[0].emulated.clone().unwrap(),
        ),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_recording_of_our_own_has_no_difference() {
    let settings = with(PICK);
    let recording = day(&settings, Duration::ZERO);
    let report = compared(&recording, &settings, &Tolerance::default());
    none(&report);
    assert!(report.answers > 50 && report.inputs > 100, "{report:?}");
}

#[test]
fn delays_of_answers_do_not_add_up() {
    let settings = with(PICK);
    let recording = day(&settings, Duration::from_millis(40));
    let tolerance = ignoring(&["sf.execution-line", "sf.analysis-line"]);
    let report = compared(&recording, &settings, &tolerance);
    none(&report);
    let strict = Tolerance {
        time: Duration::from_millis(30),
        ..ignoring(&["sf.execution-line", "sf.analysis-line"])
    };
    let report = compared(&recording, &settings, &strict);
    assert!(report.differences.len() > 50);
    for difference in &report.differences {
        assert!(
            matches!(difference.kind, DifferenceKind::Time { .. }),
            "{difference:?}"
        );
    }
}

#[test]
fn doctored_bytes_are_told_with_their_meaning_and_nothing_else_is() {
    let difference = doctored("SU", "OVRD:100%", "OVRD:099%");
    assert_eq!(
        (difference.line, difference.question.as_str()),
        (PeerId::first(Port::Ip0), "SU")
    );
    let expected = ["su.ovrd", "`OVRD:099%`", "`OVRD:100%`"].map(str::to_owned);
    assert_eq!(only_part(&difference), expected.clone().into());
    let expected = ["sf.servo", "1 (on)", "0 (off)"].map(str::to_owned);
    assert_eq!(only_part(&doctored("SF", "FL,\0", "FL,\x01")), expected.into());
    let key = |difference: &Difference| only_part(difference).0;
    assert_eq!(key(&doctored("CA", "PICK 1", "PICK 2")), "ca.PICK");
    assert_eq!(key(&doctored("VR", "2014", "2013")), "vr.1");
    assert_eq!(key(&doctored("EU", " 14-02-06", " 15-02-06")), "eu.1.date");
    assert_eq!(key(&doctored("UL", "DELAY 2", "DELAY 3")), "ul.6");
    assert_eq!(key(&doctored("SO", "OK", "NG")), "reply");
    assert_eq!(key(&doctored("SO", "\r", "\n")), "reply");
    let refused = doctored("SL", "NG", "OK");
    let DifferenceKind::Bytes { reason, .. } = &refused.kind else {
        panic!("{refused:?}");
    };
    let reason = reason.as_deref().unwrap();
    assert!(
        reason.starts_with("SL refused: ") && reason.contains("NOPE"),
        "{reason}"
    );
}

#[test]
fn every_byte_doctored_is_found() {
    let settings = with(PICK);
    let recording = day(&settings, Duration::ZERO);
    let mut tried = 0;
    for command in ["SU", "SF", "EU", "SO"] {
        let index = answers_to(&recording, command.as_bytes())[0];
        let length = bytes_mut(&mut recording.clone(), index).len();
        for at in (0..length).step_by(7) {
            let mut doctored = recording.clone();
            change_bytes(&mut doctored, index, |bytes| bytes[at] ^= 0x10);
            let report = compared(&doctored, &settings, &Tolerance::default());
            let places: Vec<usize> = report.differences.iter().map(|found| found.file_line).collect();
            assert!(places.contains(&(index + 1)), "{command} byte {at}: {report:?}");
            tried += 1;
        }
    }
    assert!(tried > 50);
}

#[test]
fn what_must_differ_can_be_left_out() {
    let settings = with(PICK);
    let mut recording = day(&settings, Duration::ZERO);
    let sf = answers_to(&recording, b"SF")[0];
    // STX and `FL,` stand in front of offset 0: power ON time, joint 1, joint 2.
    change_bytes(&mut recording, sf, |bytes| {
        bytes[4 + 47] = 9;
        bytes[4 + 116..4 + 120].copy_from_slice(&0.5_f32.to_be_bytes());
    });
    let eu = answers_to(&recording, b"EU")[0];
    let text = String::from_utf8(bytes_mut(&mut recording, eu).to_vec()).unwrap();
    *bytes_mut(&mut recording, eu) = text.replace("14-02-06", "26-11-21").into_bytes().into();
    let vr = answers_to(&recording, b"VR")[0];
    change_bytes(&mut recording, vr, |bytes| bytes[5] = b'X');
    let count = |words: &[&str]| {
        compared(&recording, &settings, &ignoring(words))
            .differences
            .len()
    };
    assert_eq!(count(&[]), 3);
    assert_eq!(count(&["clock"]), 2);
    assert_eq!(count(&["clock", "versions"]), 1);
    let report = compared(
        &recording,
        &settings,
        &ignoring(&["clock", "versions", "positions"]),
    );
    none(&report);
    assert!(report.ignored >= 4, "{report:?}");
    for (value, expected) in [(0.4, 1), (0.5, 0)] {
        let tolerance = Tolerance {
            value,
            ..ignoring(&["clock", "versions"])
        };
        assert_eq!(
            compared(&recording, &settings, &tolerance).differences.len(),
            expected
        );
    }
}

#[test]
fn coordinates_of_each_system_may_differ_by_the_tolerance() {
    let settings = with(PICK);
    let clean = day(&settings, Duration::ZERO);
    let sf = answers_to(&clean, b"SF")[0];
    for key in ["sf.joint.3", "sf.world.3", "sf.work.3"] {
        let mut recording = clean.clone();
        let parts = ts3100_proto::dissect::dissect("SF", bytes_mut(&mut recording, sf));
        let part = parts.into_iter().find(|part| part.key == key).unwrap();
        change_bytes(&mut recording, sf, |bytes| {
            let place = &mut bytes[part.range];
            let value = f32::from_be_bytes(place.try_into().unwrap());
            place.copy_from_slice(&(value + 0.5).to_be_bytes());
        });
        for (value, expected) in [(0.45, 1), (0.55, 0)] {
            let tolerance = Tolerance {
                value,
                ..Tolerance::default()
            };
            let report = compared(&recording, &settings, &tolerance);
            assert_eq!(report.differences.len(), expected, "{key}: {report:?}");
        }
    }
}

#[test]
fn a_slower_robot_shifts_what_follows_and_is_told_once() {
    let slow = with(&PICK.replace("DELAY 2", "DELAY 5"));
    let mut real = Real::new(&slow);
    real.connect(Port::Ip0);
    real.connect(Port::Ip1);
    real.texts(&["SO", "RN"]);
    for _ in 0..3 {
        real.send(Port::Ip1, b"7\r");
        real.pass(SECOND * 5);
    }
    real.texts(&["SU", "OK"]);
    let report = compared(&real.recording, &with(PICK), &Tolerance::default());
    assert_eq!(report.differences.len(), 3, "{report:?}");
    for difference in &report.differences {
        let DifferenceKind::Time {
            recorded,
            recorded_after,
            emulated_after,
        } = &difference.kind
        else {
            panic!("{difference:?}");
        };
        assert!(recorded.starts_with(b"DONE"));
        assert_eq!((recorded_after.as_secs(), emulated_after.as_secs()), (5, 2));
    }
    none(&compared(&real.recording, &with(PICK), &ignoring(&["time"])));
    // The other way round: the emulator is waited for, and the host does not run ahead of it.
    let mut real = Real::new(&with(PICK));
    real.connect(Port::Ip0);
    real.connect(Port::Ip1);
    real.texts(&["SO", "RN"]);
    for _ in 0..3 {
        real.send(Port::Ip1, b"7\r");
        real.pass(SECOND * 2);
    }
    let report = compared(&real.recording, &slow, &Tolerance::default());
    assert_eq!(report.differences.len(), 3, "{report:?}");
    let impatient = Tolerance {
        answer_timeout: SECOND,
        ..Tolerance::default()
    };
    let report = compared(&real.recording, &slow, &impatient);
    assert!(
        matches!(report.differences[0].kind, DifferenceKind::Missing { .. }),
        "{report:?}"
    );
}

#[test]
fn missing_and_surplus_answers_are_told_without_upsetting_the_rest() {
    let settings = with(PICK);
    let clean = day(&settings, Duration::ZERO);
    let at = answers_to(&clean, b"CA")[0];
    let mut fewer = clean.clone();
    fewer.records.remove(at);
    fewer.lines.remove(at);
    let report = compared(&fewer, &settings, &Tolerance::default());
    assert_eq!(report.differences.len(), 1, "{report:?}");
    let DifferenceKind::Surplus { emulated, .. } = &report.differences[0].kind else {
        panic!("{report:?}");
    };
    assert!(emulated.starts_with(b"\x02FL,ETHERNET.PAR"));
    let mut more = clean.clone();
    let mut sp = clean.records[at].clone();
    sp.kind = RecordKind::FromRobot {
        line: PeerId::first(Port::Ip0),
        bytes: b"\x02SP\r\x03"[..].into(),
    };
    more.records.insert(at, sp);
    more.lines.insert(at, 4_711);
    let report = compared(&more, &settings, &Tolerance::default());
    let [
        Difference {
            file_line: 4_711,
            kind: DifferenceKind::Missing { recorded, .. },
            ..
        },
    ] = report.differences.as_slice()
    else {
        panic!("{report:?}");
    };
    assert_eq!(recorded, b"\x02SP\r\x03");
    none(&compared(&more, &settings, &ignoring(&["sp"])));
}

#[test]
fn what_is_missing_or_surplus_does_not_hide_the_difference_behind_it() {
    let settings = with(PICK);
    let clean = day(&settings, Duration::ZERO);
    // An SP that the emulator does not send, in front of an answer that differs.
    let mut recording = clean.clone();
    let at = answers_to(&recording, b"SO")[0];
    *bytes_mut(&mut recording, at) = b"\x02NG\r\x03"[..].into();
    let mut sp = recording.records[at].clone();
    sp.kind = RecordKind::FromRobot {
        line: PeerId::first(Port::Ip0),
        bytes: b"\x02SP\r\x03"[..].into(),
    };
    recording.records.insert(at, sp);
    recording.lines.insert(at, at);
    let report = compared(&recording, &settings, &Tolerance::default());
    let [first, second] = report.differences.as_slice() else {
        panic!("{report:?}");
    };
    assert!(matches!(first.kind, DifferenceKind::Missing { .. }), "{first:?}");
    assert_eq!(only_part(second).0, "reply");
    // An answer that only the emulator gives, and the next one differs.
    let mut recording = clean;
    *bytes_mut(&mut recording, at) = b"\x02NG\r\x03"[..].into();
    let ca = answers_to(&recording, b"CA")[0];
    recording.records.remove(ca);
    recording.lines.remove(ca);
    let report = compared(&recording, &settings, &Tolerance::default());
    let [first, second] = report.differences.as_slice() else {
        panic!("{report:?}");
    };
    assert!(matches!(first.kind, DifferenceKind::Surplus { .. }), "{first:?}");
    assert_eq!(only_part(second).0, "reply");
}

#[test]
fn a_program_that_prints_more_or_less_is_told() {
    let prints = |words: &[&str]| {
        let lines: Vec<String> = words
            .iter()
            .map(|word| format!("PRINT IP1, \"{word}\", CR\n"))
            .collect();
        with(&format!("PROGRAM PICK\n{}END\n", lines.concat()))
    };
    let recorded = |settings: &Settings| {
        let mut real = Real::new(settings);
        real.connect(Port::Ip0);
        real.connect(Port::Ip1);
        real.texts(&["SO", "RN"]);
        real.recording
    };
    let kinds = |report: &Report| -> Vec<&'static str> {
        let kind = |difference: &Difference| match difference.kind {
            DifferenceKind::Missing { .. } => "missing",
            DifferenceKind::Surplus { .. } => "surplus",
            DifferenceKind::Bytes { .. } => "bytes",
            _ => "other",
        };
        report.differences.iter().map(kind).collect()
    };
    let three = recorded(&prints(&["A", "B", "C"]));
    let of = |words: &[&str]| kinds(&compared(&three, &prints(words), &Tolerance::default()));
    assert!(of(&["A", "B", "C"]).is_empty());
    assert_eq!(of(&["A", "C"]), ["missing"]);
    assert_eq!(of(&["A", "X", "B", "C"]), ["surplus"]);
    assert_eq!(of(&["A", "X", "C"]), ["bytes"]);
}
