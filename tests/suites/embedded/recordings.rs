//! Transcripts of running emulators: the same inputs give the same bytes in every form, and what was done is in
//! the file at once.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use ts3100_controller::{Action, PanelAction, Port};
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::config::Settings;
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::diff::{Tolerance, diff};
use ts3100_emulator::embed::Emulator;
use ts3100_emulator::transcript::{LinkRecord, PeerId, RecordKind, Recording, Side};
use ts3100_tests::testing::eventually;

const LONG: Duration = Duration::from_secs(30);

/// A directory removed on drop.
struct TempDir(PathBuf);

impl TempDir {
    fn new() -> TempDir {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("ts3100-transcript-{}-{count}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        TempDir(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for TempDir {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn dial(robot: &Emulator, port: Port) -> TcpStream {
    let stream = TcpStream::connect(robot.address(port).unwrap()).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    stream.set_nodelay(true).unwrap();
    stream
}

fn exchange(host: &mut TcpStream, bytes: &[u8], expected: &[u8]) {
    host.write_all(bytes).unwrap();
    let mut found = vec![0; expected.len()];
    host.read_exact(&mut found).unwrap();
    assert_eq!(
        found.escape_ascii().to_string(),
        expected.escape_ascii().to_string()
    );
}

/// A host that talks to an emulator in stepped time; its transcripts in all forms.
fn talk() -> [Vec<u8>; 3] {
    let directory = TempDir::new();
    let names = ["a.txt", "a.jsonl", "a.pcapng"].map(|name| directory.path(name));
    let mut builder = Emulator::builder()
        .time(TimeMode::Stepped)
        .file("PICK", "PROGRAM PICK\nPRINT IP1, \"REQ\", CR\nEND\n")
        .select("PICK");
    for name in &names {
        builder = builder.transcript(name).unwrap();
    }
    let robot = builder.start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
    let mut program = dial(&robot, Port::Ip1);
    // What goes over different connections has no order unless it is waited for.
    eventually("the connection is in the file", || {
        let text = std::fs::read_to_string(&names[0]).unwrap();
        text.contains("! connect IP1").then_some(())
    });
    exchange(&mut host, b"RN\r\x03", b"OK\r\x03");
    exchange(&mut program, b"", b"REQ\r");
    robot.panel(PanelAction::EmergencyStop(true)).unwrap();
    drop(robot);
    names.map(|name| std::fs::read(name).unwrap())
}

#[test]
fn the_same_inputs_give_the_same_bytes_in_every_form() {
    let [text, json, capture] = talk();
    assert!(!text.is_empty() && !json.is_empty() && !capture.is_empty());
    let again = talk();
    assert_eq!(String::from_utf8(text), String::from_utf8(again[0].clone()));
    assert_eq!(String::from_utf8(json), String::from_utf8(again[1].clone()));
    assert!(capture == again[2], "the captures differ");
}

#[test]
fn what_was_done_is_in_the_file_at_once_and_the_controllers_ends_are_its_own() {
    let directory = TempDir::new();
    let name = directory.path("robot.jsonl");
    let robot = Emulator::builder().transcript(&name).unwrap().start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::EmergencyStop(true)).unwrap();
    // The emulator is still running.
    let recording = Recording::read(name.as_ref()).unwrap();
    let line = PeerId::first(Port::Ip0);
    let whats: Vec<RecordKind> = recording
        .records
        .iter()
        .map(|record| record.kind.clone())
        .collect();
    assert_eq!(
        whats,
        [
            RecordKind::Connected {
                line,
                peer: "127.0.0.1".to_owned()
            },
            RecordKind::FromHost {
                line,
                bytes: b"\x02SO\r\x03".to_vec()
            },
            RecordKind::FromRobot {
                line,
                bytes: b"\x02OK\r\x03".to_vec()
            },
            RecordKind::Action(Action::Panel(PanelAction::EmergencyStop(true))),
        ]
    );
    assert!(recording.header.origin.starts_with("observed, ts3100 serve "));
    assert_eq!(recording.header.files[0].0, "DEMO");
    robot.panel(PanelAction::PowerCycle).unwrap();
    drop(robot);
    let recording = Recording::read(name.as_ref()).unwrap();
    let ended = recording.records.iter().find_map(|record| match record.kind {
        RecordKind::Ended { by, .. } => Some(by),
        _ => None,
    });
    assert_eq!(ended, Some(Side::Robot));
}

#[test]
fn a_transcript_that_cannot_be_written_stops_the_start() {
    let started = Emulator::builder()
        .transcript("/nowhere-at-all/a.txt")
        .unwrap()
        .start();
    let error = started.err().unwrap().to_string();
    assert!(
        error.starts_with("cannot write the transcript /nowhere-at-all/a.txt: "),
        "{error}"
    );
    assert!(Emulator::builder().transcript("a.pcap").is_err());
}

#[test]
fn a_recording_in_real_time_is_the_same_to_the_microsecond_when_played() {
    let directory = TempDir::new();
    let name = directory.path("robot.txt");
    let program = "PROGRAM PICK\nSPEED = 100\nLOOP:\nMOVE POINT(450, 0, 250)\nPRINT IP1, \"A\", CR\n\
        DELAY 0.013\nMOVE POINT(400, 30, 260)\nPRINT IP1, \"B\", CR\nGOTO LOOP\nEND\n";
    let robot = Emulator::builder()
        .file("PICK", program)
        .select("PICK")
        .servo_on(true)
        .transcript(&name)
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot, Port::Ip0);
    let mut program = dial(&robot, Port::Ip1);
    exchange(&mut host, b"\x02RN\r\x03", b"\x02OK\r\x03");
    let mut status = [0; 282];
    for _ in 0..200 {
        host.write_all(b"\x02SF\r\x03").unwrap();
        host.read_exact(&mut status).unwrap();
        host.write_all(b"\x02OK\r\x03").unwrap();
    }
    exchange(&mut program, b"", b"A\rB\r");
    for _ in 0..200 {
        host.write_all(b"\x02SF\r\x03").unwrap();
        host.read_exact(&mut status).unwrap();
        host.write_all(b"\x02OK\r\x03").unwrap();
    }
    drop(robot);
    let recording = Recording::read(name.as_ref()).unwrap();
    let mut settings = Settings::new(Config::new(Dialect::Field));
    settings.files.clone_from(&recording.header.files);
    settings.select.clone_from(&recording.header.select);
    settings.controller.calendar = recording.header.calendar.unwrap_or(settings.controller.calendar);
    let exact = Tolerance {
        time: Duration::ZERO,
        ..Tolerance::default()
    };
    let report = diff(&recording, &settings, &exact).unwrap();
    assert!(report.answers > 400);
    assert_eq!(report.differences, []);
}

/// Everything that reaches a controller besides bytes and actions: two snapshots restored, a second peer, a connection
/// that is dropped, a reset. The recording as text and as JSON lines.
fn restored_and_reset(directory: &TempDir) -> [String; 2] {
    let names = ["edge.txt", "edge.jsonl"].map(|name| directory.path(name));
    let mut builder = Emulator::builder()
        .time(TimeMode::Stepped)
        .control(ControlSettings::free())
        .file("PICK", "PROGRAM PICK\nPRINT IP1, \"REQ\", CR\nEND\n")
        .select("PICK");
    for name in &names {
        builder = builder.transcript(name).unwrap();
    }
    let robot = builder.start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    exchange(&mut host, b"\x02BR\r\x03", b"\x02OK\r\x03");
    robot.snapshot("off").unwrap();
    post(&robot, "/clock/advance", "{\"seconds\":5}");
    exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.snapshot("on").unwrap();
    robot.restore("off").unwrap();
    post(&robot, "/clock/advance", "{\"seconds\":1}");
    exchange(&mut host, b"\x02RN\r\x03", b"\x02NG\r\x03");
    robot.restore("on").unwrap();
    exchange(&mut host, b"\x02RN\r\x03", b"\x02OK\r\x03");
    // Refused, for the first one stays.
    let second = dial(&robot, Port::Ip0);
    assert_eq!((&second).read(&mut [0]).unwrap(), 0);
    post(&robot, "/channels/IP0/drop", "{}");
    post(&robot, "/reset", "{}");
    let mut host = dial(&robot, Port::Ip0);
    exchange(&mut host, b"\x02RN\r\x03", b"\x02NG\r\x03");
    drop(robot);
    names
}

fn post(robot: &Emulator, path: &str, body: &str) {
    let address = robot.control().unwrap();
    let mut stream = TcpStream::connect(address).unwrap();
    let length = body.len();
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\n\
         Content-Length: {length}\r\n\r\n"
    );
    stream.write_all(format!("{head}{body}").as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 20"), "{path}: {answer}");
}

fn compared(recording: &Recording) -> ts3100_emulator::diff::Report {
    let mut settings = Settings::new(Config::new(Dialect::Field));
    settings.files.clone_from(&recording.header.files);
    settings.select.clone_from(&recording.header.select);
    diff(recording, &settings, &Tolerance::default()).unwrap()
}

#[test]
fn snapshots_resets_and_second_peers_are_recorded_and_played_again() {
    let directory = TempDir::new();
    for name in restored_and_reset(&directory) {
        let recording = Recording::read(name.as_ref()).unwrap();
        let edges = |kind: fn(&LinkRecord) -> bool| {
            let records = recording.records.iter();
            records
                .filter(|record| matches!(&record.kind, RecordKind::Link(edge) if kind(edge)))
                .count()
        };
        assert_eq!(
            edges(|edge| matches!(edge, LinkRecord::Restored { .. })),
            2,
            "{name}"
        );
        assert_eq!(
            edges(|edge| matches!(edge, LinkRecord::SecondPeer { replaces: false, .. })),
            1,
            "{name}"
        );
        assert_eq!(
            edges(|edge| matches!(edge, LinkRecord::Reset { .. })),
            1,
            "{name}"
        );
        let report = compared(&recording);
        assert_eq!(report.differences, [], "{name}");
        assert!(report.answers >= 5, "{name}");
        // Each of them counts: without it the rest comes out otherwise.
        for kind in [
            (|edge| matches!(edge, LinkRecord::Restored { .. })) as fn(&LinkRecord) -> bool,
            |edge| matches!(edge, LinkRecord::Reset { .. }),
            |edge| matches!(edge, LinkRecord::Dropped { .. }),
        ] {
            let mut without = recording.clone();
            let kept: Vec<bool> = without
                .records
                .iter()
                .map(|record| !matches!(&record.kind, RecordKind::Link(edge) if kind(edge)))
                .collect();
            let mut keep = kept.iter();
            without.records.retain(|_| *keep.next().unwrap());
            let mut keep = kept.iter();
            without.lines.retain(|_| *keep.next().unwrap());
            assert_ne!(compared(&without).differences, [], "{name}");
        }
    }
}

#[test]
fn a_run_that_begins_with_a_snapshot_is_played_from_it() {
    let directory = TempDir::new();
    let (snapshot, name) = (directory.path("ready.json"), directory.path("day.txt"));
    let robot = Emulator::builder()
        .time(TimeMode::Stepped)
        .servo_on(true)
        .start()
        .unwrap();
    robot.write_snapshot(snapshot.as_ref()).unwrap();
    drop(robot);
    let robot = Emulator::builder()
        .time(TimeMode::Stepped)
        .restore(&snapshot)
        .transcript(&name)
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot, Port::Ip0);
    exchange(&mut host, b"\x02SL,DEMO\r\x03", b"\x02OK\r\x03");
    exchange(&mut host, b"\x02RN\r\x03", b"\x02OK\r\x03");
    drop(robot);
    let recording = Recording::read(name.as_ref()).unwrap();
    assert!(matches!(
        recording.records[0].kind,
        RecordKind::Link(LinkRecord::Restored { .. })
    ));
    assert_eq!(compared(&recording).differences, []);
}
