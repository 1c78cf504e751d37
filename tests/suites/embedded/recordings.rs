//! Transcripts of running emulators: the same inputs give the same bytes in every form, and what was done is in
//! the file at once.

use std::io::{Read, Write as _};
use std::time::Duration;
use ts3100_controller::{Action, PanelAction, Port};
use ts3100_controller::{Config, Dialect};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::config::Settings;
use ts3100_emulator::diff::{Tolerance, diff};
use ts3100_emulator::embed::Emulator;
use ts3100_emulator::loading::candidate;
use ts3100_emulator::transcript::{LinkRecord, PeerId, RecordKind, Recording, Side};
use ts3100_tests::bench::{self, Bench};
use ts3100_tests::host::{Host, dial};
use ts3100_tests::testing::{TempDir, eventually};
use ts3100_tests::transcript::{Cut, Transcript};

/// A host that talks to an emulator in stepped time; its transcripts in all forms.
fn talk() -> [Vec<u8>; 3] {
    let directory = TempDir::new("transcript");
    let names = ["a.txt", "a.jsonl", "a.pcapng"].map(|name| directory.file(name, ""));
    let mut builder = Emulator::builder()
        .time(TimeMode::Stepped)
        .file("PICK", "PROGRAM PICK\nPRINT IP1, \"REQ\", CR\nEND\n")
        .select("PICK");
    for name in &names {
        builder = builder.transcript(name).unwrap();
    }
    let robot = builder.start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    let mut program = dial(&robot, Port::Ip1);
    // What goes over different connections has no order unless it is waited for.
    eventually("the connection is in the file", || {
        let text = std::fs::read_to_string(&names[0]).unwrap();
        text.contains("! connect IP1").then_some(())
    });
    host.exchange(b"RN\r\x03", b"OK\r\x03");
    program.exchange(b"", b"REQ\r");
    robot.panel(PanelAction::EmergencyStop(true)).unwrap();
    drop(robot);
    names.map(|name| std::fs::read(name).unwrap())
}

#[test]
fn the_same_inputs_give_the_same_bytes_in_every_form() {
    let [text, json, capture] = talk();
    assert!(!text.is_empty() && !json.is_empty() && !capture.is_empty());
    let in_stepped_time = "\n! timed-findings off\n! connect IP0 127.0.0.1\n";
    assert!(String::from_utf8_lossy(&text).contains(in_stepped_time));
    let again = talk();
    assert_eq!(String::from_utf8(text), String::from_utf8(again[0].clone()));
    assert_eq!(String::from_utf8(json), String::from_utf8(again[1].clone()));
    assert!(capture == again[2], "the captures differ");
}

#[test]
fn what_was_done_is_in_the_file_at_once_and_the_controllers_ends_are_its_own() {
    let directory = TempDir::new("transcript");
    let name = directory.file("robot.jsonl", "");
    let robot = Emulator::builder().transcript(&name).unwrap().start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
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
                bytes: b"\x02SO\r\x03".to_vec().into()
            },
            RecordKind::FromRobot {
                line,
                bytes: b"\x02OK\r\x03".to_vec().into()
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
    let directory = TempDir::new("transcript");
    let name = directory.file("robot.txt", "");
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
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    for _ in 0..200 {
        host.sf();
    }
    program.exchange(b"", b"A\rB\r");
    for _ in 0..200 {
        host.sf();
    }
    drop(robot);
    let recording = Recording::read(name.as_ref()).unwrap();
    let exact = Tolerance {
        time: Duration::ZERO,
        ..Tolerance::default()
    };
    let report = compared(&recording, &exact);
    assert!(report.answers > 400);
    assert_eq!(report.differences, []);
}

/// Everything that reaches a controller besides bytes and actions: two snapshots restored, a second peer, a connection
/// that is dropped, a reset. The recording as text and as JSON lines.
fn restored_and_reset(directory: &TempDir) -> [String; 2] {
    let names = ["edge.txt", "edge.jsonl"].map(|name| directory.file(name, ""));
    let mut builder = bench::builder()
        .file("PICK", "PROGRAM PICK\nPRINT IP1, \"REQ\", CR\nEND\n")
        .select("PICK");
    for name in &names {
        builder = builder.transcript(name).unwrap();
    }
    let bench = Bench::start(builder);
    let robot = &bench.emulator;
    let mut host = dial(robot, Port::Ip0);
    host.exchange(b"\x02BR\r\x03", b"\x02OK\r\x03");
    robot.take_snapshot("off").unwrap();
    bench.post("/clock/advance", r#"{"seconds":5}"#);
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.take_snapshot("on").unwrap();
    robot.restore_snapshot("off").unwrap();
    bench.post("/clock/advance", r#"{"seconds":1}"#);
    host.exchange(b"\x02RN\r\x03", b"\x02NG\r\x03");
    robot.restore_snapshot("on").unwrap();
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    // Refused, for the first one stays.
    let second = dial(robot, Port::Ip0);
    assert_eq!((&second).read(&mut [0]).unwrap(), 0);
    bench.post("/channels/IP0/drop", "{}");
    bench.post("/reset", "{}");
    let mut host = dial(robot, Port::Ip0);
    host.exchange(b"\x02RN\r\x03", b"\x02NG\r\x03");
    drop(bench);
    names
}

/// A recording beside a new controller with its files, program and calendar.
fn compared(recording: &Recording, tolerance: &Tolerance) -> ts3100_emulator::diff::Report {
    recording.has_beginning("the recording".as_ref()).unwrap();
    let mut settings = Settings::new(Config::new(Dialect::Field));
    settings.contents.clone_from(&recording.header.files);
    settings.files.select.clone_from(&recording.header.select);
    settings.controller.calendar = recording.header.calendar.unwrap_or(settings.controller.calendar);
    diff(recording, candidate(&settings).unwrap(), tolerance)
}

#[test]
fn snapshots_resets_and_second_peers_are_recorded_and_played_again() {
    let directory = TempDir::new("transcript");
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
        let report = compared(&recording, &Tolerance::default());
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
            assert_ne!(
                compared(&without, &Tolerance::default()).differences,
                [],
                "{name}"
            );
        }
    }
}

#[test]
fn a_run_that_begins_with_a_snapshot_is_played_from_it() {
    let directory = TempDir::new("transcript");
    let (snapshot, name) = (directory.file("ready.json", ""), directory.file("day.txt", ""));
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
    host.exchange(b"\x02SL,DEMO\r\x03", b"\x02OK\r\x03");
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    drop(robot);
    let recording = Recording::read(name.as_ref()).unwrap();
    assert!(matches!(
        recording.records[0].kind,
        RecordKind::Link(LinkRecord::Restored { .. })
    ));
    assert_eq!(compared(&recording, &Tolerance::default()).differences, []);
}

/// More than the control interface keeps, with a program that moves and prints and a download that is under way.
#[test]
fn what_the_control_interface_keeps_replays_when_its_beginning_is_gone() {
    let directory = TempDir::new("transcript");
    let program = "PROGRAM PICK\nSPEED = 100\nLOOP:\nMOVE POINT(450, 0, 250)\nPRINT IP1, \"A\", CR\n\
        DELAY 0.013\nMOVE POINT(400, 30, 260)\nPRINT IP1, \"B\", CR\nGOTO LOOP\nEND\n";
    let bench = Bench::start(
        bench::builder()
            .file("PICK", program)
            .select("PICK")
            .servo_on(true),
    );
    let mut host = bench.host();
    let _program = bench.dial(Port::Ip1);
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    let before = bench.call_text("GET", "/transcript", "").1;
    assert!(before.contains("RN<CR>") && !before.contains("! begin "));
    // Half of a text, which ends after all that is no longer kept.
    host.write_all(b"\x02S").unwrap();
    let file = serde_json::json!({ "text": "' a line of a long file\n".repeat(2_500) }).to_string();
    for _ in 0..150 {
        bench.put("/files/LONG", &file);
        bench.post("/clock/advance", r#"{"seconds":0.0517}"#);
    }
    host.write_all(b"U\r\x03").unwrap();
    host.text();
    host.write_all(b"\x02OK\r\x03").unwrap();
    for _ in 0..50 {
        host.sf();
        bench.post("/clock/advance", r#"{"seconds":0.0517}"#);
    }
    for (format, name) in [("text", "kept.txt"), ("jsonl", "kept.jsonl")] {
        let kept = bench
            .call_text("GET", &format!("/transcript?format={format}"), "")
            .1;
        assert!(kept.contains("records before this one are no longer kept"));
        assert!(!kept.contains("RN<CR>") && kept.len() < 12 * 1024 * 1024);
        let recording = Recording::read(directory.file(name, &kept).as_ref()).unwrap();
        let exact = Tolerance {
            time: Duration::ZERO,
            ..Tolerance::default()
        };
        let report = compared(&recording, &exact);
        assert_eq!(report.differences, [], "{name}");
        assert!(report.answers > 60, "{name}: {}", report.answers);
    }
}

/// The text that `--transcript` writes runs in the runner of the hand-written ones, against a new controller.
#[test]
fn a_recording_runs_as_a_hand_written_transcript_does() {
    let directory = TempDir::new("transcript");
    let path = directory.file("a.txt", "");
    let robot = Emulator::builder()
        .time(TimeMode::Auto)
        .file(
            "PICK",
            "PROGRAM PICK\nN = 0\nPRINT IP1, \"REQ\", CR\nINPUT IP1, N\nDELAY 1.5\nPRINT IP1, N, CR\nEND\n",
        )
        .select("PICK")
        .transcript(&path)
        .unwrap()
        .start()
        .unwrap();
    let (mut host, mut program) = (dial(&robot, Port::Ip0), dial(&robot, Port::Ip1));
    robot.panel(PanelAction::Servo(true)).unwrap();
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    program.exchange(b"", b"REQ\r");
    program.exchange(b"7\r", b"           7\r");
    host.exchange(b"", b"\x02SP\r\x03");
    host.exchange(b"SL,ABSENT\r\x03", b"NG\r\x03");
    drop(robot);
    let text = std::fs::read_to_string(&path).unwrap();
    let transcript = Transcript::read(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    transcript
        .run(Cut::Whole)
        .unwrap_or_else(|error| panic!("{error}\n{text}"));
    let doctored = text.replace("<: IP0 NG<CR><ETX>", "<: IP0 OK<CR><ETX>");
    assert_ne!(doctored, text);
    assert!(Transcript::read(&doctored).unwrap().run(Cut::Whole).is_err());
}
