//! A recorded run that is open: its events and lanes, what changed a value, what a recording of a real robot tells, and the run as
//! one HTML file. That a moment is the same however it is reached is tested in `replay`.

use serde_json::Value;
use std::sync::Arc;
use ts3100_control::event::JournalEvent;
use ts3100_controller::{Time, Watched};
use ts3100_emulator::recorded::candidate;
use ts3100_recording::transcript::{PeerId, Record, RecordKind, Recording, text};
use ts3100_view::html;
use ts3100_view::key::MomentKey;
use ts3100_view::list;
use ts3100_view::run::Run;
use ts3100_view::summary::Summary;
use ts3100_view::why::Question;

/// A program that moves, switches an output twice at one moment, counts and prints.
const PICK: &str = "GLOBAL\n  N = 0\nEND\nPROGRAM PICK\n  SPEED = 30\nAGAIN:\n  MOVE POINT(380, 100, 260)\n  MOVES POINT(380, -100, 300)\n  \
    DOUT(5)\n  DOUT(-5)\n  N = N + 1\n  N = N + 10\n  DELAY 0.3\n  GOTO AGAIN\nEND\n";

/// A recording of a host that starts the program and asks SF at 10 Hz for so many seconds, without the answers.
fn polling(seconds: u32) -> Recording {
    let mut written = String::from("origin: written by the test, ours\nfile PICK\n");
    for line in PICK.lines() {
        written += &format!("| {line}\n");
    }
    written += "! servo on\n! connect IP0\n@+100ms\n> IP0 SL,PICK<CR>\n@+100ms\n> IP0 RN<CR>\n";
    for _ in 0..10 * seconds {
        written += "@+50ms\n> IP0 SF<CR>\n@+50ms\n> IP0 OK<CR>\n";
    }
    text::read(&written).unwrap()
}

fn opened(recording: Recording) -> Arc<Run> {
    let emulator = candidate(&recording.header).unwrap();
    let (run, opening) = Run::open("run.txt", recording, emulator);
    opening.finish();
    run
}

/// What went over the wires of a run, as a tap in front of a real robot would have it.
fn tapped(run: &Run) -> Recording {
    let mut recording = Recording::default();
    recording.header.origin = "observed, ts3100 tap 0.1.0 in front of 192.168.0.124".to_owned();
    let events = run.events();
    let kinds = events.into_iter().filter_map(|event| {
        let kind = if let JournalEvent::Connected { port, peer } = event.event {
            RecordKind::Connected {
                line: PeerId::first(port),
                peer,
            }
        } else if let JournalEvent::Received { port, data } = event.event {
            RecordKind::FromHost {
                line: PeerId::first(port),
                bytes: data,
            }
        } else if let JournalEvent::Sent { port, data } = event.event {
            RecordKind::FromRobot {
                line: PeerId::first(port),
                bytes: data,
            }
        } else {
            return None;
        };
        Some(Record { at: event.t, kind })
    });
    recording.records = kinds.collect();
    recording.lines = (2..recording.records.len() + 2).collect();
    recording
}

fn at(micros: u64) -> MomentKey {
    let at = Some(Time::from_micros(micros));
    MomentKey { event: None, at }
}

fn changes(run: &Run, of: &str) -> Vec<(String, String)> {
    let answer = run.ask(&Question::Changes(of.parse::<Watched>().unwrap()));
    let found = answer.found.iter();
    found
        .map(|found| (found.value.clone(), found.cause.clone()))
        .collect()
}

#[test]
fn each_change_has_its_cause_although_many_happen_at_one_moment() {
    let run = opened(polling(3));
    let outputs = changes(&run, "dout.5");
    let expected = [("on", "PICK line 9: DOUT(5)"), ("off", "PICK line 10: DOUT(-5)")];
    assert_eq!(
        outputs[..2],
        expected.map(|(value, cause)| (value.to_owned(), cause.to_owned()))
    );
    let counts = changes(&run, "N");
    let causes: Vec<&str> = counts.iter().map(|(_, cause)| cause.as_str()).collect();
    assert_eq!(
        causes[..3],
        [
            "the host on IP0: <STX>SL,PICK<CR><ETX>",
            "PICK line 11: N = N + 1",
            "PICK line 12: N = N + 10"
        ]
    );
    let values: Vec<&str> = counts.iter().map(|(value, _)| value.as_str()).collect();
    assert_eq!(values[..5], ["0", "1", "11", "12", "22"]);
    assert_eq!(
        changes(&run, "servo"),
        [("on".to_owned(), "at the controller: servo on".to_owned())]
    );
    let hits = run.ask(&Question::Hits {
        file: "pick".to_owned(),
        line: 12,
        value: Some("N".parse().unwrap()),
    });
    let seen: Vec<&str> = hits.found.iter().map(|hit| hit.value.as_str()).collect();
    assert_eq!(seen[..2], ["1", "12"]);
    // Each is at its moment: there the value is the new one, or is still to be so.
    for hit in &hits.found {
        let key = MomentKey {
            event: Some(hit.event),
            at: Some(hit.at),
        };
        let state = run.state(key).unwrap();
        let variables = state["variables"].as_array().unwrap();
        let count = variables.iter().find(|variable| variable["name"] == "N").unwrap();
        let before: i64 = hit.value.parse().unwrap();
        assert_eq!(
            count["value"][0].as_i64().unwrap_or_default(),
            before + 10,
            "{count}"
        );
    }
}

#[test]
fn a_cause_has_the_words_of_the_file_as_it_was_then() {
    let program = |line: &str| format!("GLOBAL<LF>  N = 0<LF>END<LF>PROGRAM COUNT<LF>  {line}<LF>END<LF>");
    let run = |line: &str| {
        format!(
            "! file put COUNT {}\n> IP0 SL,COUNT<CR>\n@+100ms\n> IP0 RN<CR>\n@+1s\n",
            program(line)
        )
    };
    let written = format!(
        "origin: written by the test, ours\n! servo on\n! connect IP0\n@+100ms\n{}{}",
        run("N = N + 1"),
        run("N = N + 5")
    );
    let causes: Vec<String> = changes(&opened(text::read(&written).unwrap()), "N")
        .into_iter()
        .map(|(_, cause)| cause)
        .filter(|cause| cause.starts_with("COUNT"))
        .collect();
    assert_eq!(causes, ["COUNT line 5: N = N + 1", "COUNT line 5: N = N + 5"]);
}

#[test]
fn a_key_is_the_state_after_its_event_and_before_the_next() {
    let run = opened(polling(2));
    let state = |key: MomentKey| run.state(key).unwrap();
    let servo = |key| state(key)["servo"].as_bool().unwrap();
    assert!(servo(at(0)), "all that happened by then");
    let selected = run.events();
    let selected = selected.iter().find(|event| {
        matches!(
            &event.event,
            JournalEvent::Controller(ts3100_controller::Event::Selected(_))
        )
    });
    let seq = selected.unwrap().seq;
    assert_eq!(
        state(MomentKey {
            event: Some(seq),
            at: None
        })["file"],
        "PICK"
    );
    assert_eq!(
        state(MomentKey {
            event: Some(seq - 1),
            at: None
        })["file"],
        "PICK",
        "in the same step"
    );
    let before = MomentKey {
        event: Some(2),
        at: Some(Time::from_micros(99_999)),
    };
    assert_eq!(state(before)["file"], "");
    let far = MomentKey {
        event: Some(seq),
        at: Some(Time::from_micros(9_000_000)),
    };
    assert!(
        run.moment(far).unwrap().at < Time::from_micros(300_000),
        "not after the next event"
    );
    assert!(
        run.moment(MomentKey {
            event: Some(999_999),
            at: None
        })
        .is_err()
    );
}

#[test]
fn a_recording_that_was_changed_says_where_it_departs() {
    let run = opened(polling(1));
    let mut recording = polling(1);
    recording.records = tapped(&run).records;
    recording.records.insert(0, polling(1).records[0].clone());
    recording.lines = (1..=recording.records.len()).collect();
    assert_eq!(opened(recording.clone()).departure(), None);
    let place = recording
        .records
        .iter()
        .rposition(|record| matches!(record.kind, RecordKind::FromRobot { .. }))
        .unwrap();
    let RecordKind::FromRobot { bytes, .. } = &mut recording.records[place].kind else {
        unreachable!();
    };
    let mut changed = bytes.to_vec();
    changed[4] ^= 1;
    *bytes = changed.into();
    let departure = opened(recording.clone()).departure().unwrap();
    assert_eq!(departure.file_line, Some(place + 1));
    recording.records.remove(place);
    recording.lines.pop();
    let departure = opened(recording).departure().unwrap();
    assert_eq!(departure.recorded, None, "it sends more than the recording has");
}

#[test]
fn a_recording_of_a_real_robot_follows_its_status() {
    let emulated = opened(polling(3));
    let recording = tapped(&emulated);
    let template = candidate(&recording.header).unwrap().controller;
    let run = Run::open_robot("tap.txt", recording, template);
    assert!(run.is_of_robot() && run.is_complete());
    let first = run.state(at(50_000)).unwrap();
    let unknown =
        |state: &Value| -> Vec<String> { serde_json::from_value(state["unknown"].clone()).unwrap() };
    assert!(unknown(&first).contains(&"arm".to_owned()));
    assert_eq!(first["outputs"]["on"], serde_json::json!([]));
    // Right after an answer to SF both know the same.
    let known = emulated.state(at(1_250_000)).unwrap();
    let observed = run.state(at(1_250_000)).unwrap();
    assert!(!unknown(&observed).contains(&"arm".to_owned()));
    for key in [
        "executed_line",
        "servo",
        "status",
        "inputs",
        "outputs",
        "emergency_stop",
    ] {
        assert_eq!(observed[key], known[key], "{key}");
    }
    for key in ["joints", "world"] {
        let values =
            |state: &Value| -> Vec<f64> { serde_json::from_value(state["arm"][key].clone()).unwrap() };
        for (observed, known) in values(&observed).iter().zip(values(&known)) {
            assert!((observed - known).abs() < 1e-3, "{key}: {observed} and {known}");
        }
    }
    let arm = run.arm(at(1_250_000)).unwrap();
    assert_eq!(arm["joints"], observed["arm"]["joints"]);
    let lanes = serde_json::to_value(run.lanes()).unwrap();
    let ids: Vec<&str> = lanes
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|lane| lane["id"].as_str())
        .collect();
    assert!(
        ["ip0", "panel", "task1"].iter().all(|id| ids.contains(id)),
        "{ids:?}"
    );
    assert!(html::page(&run).unwrap().contains("in front of 192.168.0.124"));
}

/// The data of a page: the document, and how many characters it takes.
fn data(page: &str) -> (Value, usize) {
    use base64::Engine as _;
    use std::io::Read as _;
    let (_, rest) = page.split_once("id=\"trace\">").unwrap();
    let (encoded, _) = rest.split_once('<').unwrap();
    let compressed = base64::engine::general_purpose::STANDARD.decode(encoded).unwrap();
    let mut raw = Vec::new();
    flate2::read::GzDecoder::new(compressed.as_slice())
        .read_to_end(&mut raw)
        .unwrap();
    let end = raw.iter().position(|byte| *byte == b'\n').unwrap();
    (serde_json::from_slice(&raw[..end]).unwrap(), encoded.len())
}

/// Value of a cubic curve between two knots, as the page evaluates it.
fn curve(course: &Value, since: f64) -> Vec<f64> {
    let knots = course.as_array().unwrap();
    let time = |knot: &Value| knot[0].as_f64().unwrap();
    let after = knots.iter().position(|knot| time(knot) >= since).unwrap().max(1);
    let (from, to) = (&knots[after - 1], &knots[after]);
    let span = time(to) - time(from);
    let part = (since - time(from)) / span;
    let numbers = |values: &Value| -> Vec<f64> { serde_json::from_value(values.clone()).unwrap() };
    let (begin, end) = (numbers(&from[1]), numbers(&to[1]));
    let (leaving, coming) = (numbers(&from[2]), numbers(&to[2]));
    let (square, cube) = (part * part, part * part * part);
    let seconds = span / 1e6;
    let value = |place: usize| {
        (2.0 * cube - 3.0 * square + 1.0) * begin[place]
            + (cube - 2.0 * square + part) * seconds * leaving[place]
            + (3.0 * square - 2.0 * cube) * end[place]
            + (cube - square) * seconds * coming[place]
    };
    (0..begin.len()).map(value).collect()
}

#[test]
fn the_page_of_one_file_is_small_and_loads_nothing() {
    let run = opened(polling(30));
    let page = html::page(&run).unwrap();
    let (document, length) = data(&page);
    assert!(length <= 30_000, "{length} bytes for 30 s");
    let code = page.len() - length;
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    std::io::Write::write_all(
        &mut encoder,
        page.replace(&page[page.find("id=\"trace\">").unwrap()..][..length], "")
            .as_bytes(),
    )
    .unwrap();
    let compressed = encoder.finish().unwrap().len();
    assert!(compressed <= 100_000, "{compressed} bytes of {code}");
    for loads in ["src=\"", "import(\"", "import \"", "@import", "url("] {
        assert!(!page.replace("$import(", "").contains(loads), "{loads}");
    }
    // It stands without a script.
    let (summary, _) = page.split_once("id=\"trace\">").unwrap();
    for told in ["302 commands", "no findings", "Last texts"] {
        assert!(summary.contains(told), "{told}");
    }
    // Motions that come again are one course, which is the motion.
    let (courses, motions) = (&document["courses"], document["motions"].as_array().unwrap());
    assert!(
        courses.as_array().unwrap().len() <= 4 && motions.len() >= 40,
        "{} motions",
        motions.len()
    );
    for motion in motions.iter().step_by(7) {
        let number = |place: usize| motion[place].as_u64().unwrap();
        let (begin, end) = (number(1), number(2));
        for part in 1..8 {
            let moment = begin + (end - begin) * part / 8;
            let state = run.state(at(moment)).unwrap();
            let curve = curve(
                &courses[usize::try_from(number(3)).unwrap()],
                (moment - begin) as f64,
            );
            let joints: Vec<f64> = serde_json::from_value(state["arm"]["joints"].clone()).unwrap();
            let world: Vec<f64> = serde_json::from_value(state["arm"]["world"].clone()).unwrap();
            for (curve, found) in curve.iter().zip(joints.iter().chain(&world)) {
                assert!((curve - found).abs() < 0.15, "at {moment}: {curve} and {found}");
            }
        }
    }
}

#[test]
fn a_run_is_told_in_lines_and_in_a_summary() {
    let mut recording = polling(1);
    let nonsense = text::read("origin: ours\n> IP0 SL,NOPE<CR>\n")
        .unwrap()
        .records
        .remove(0);
    let after = recording.records.last().unwrap().at;
    recording.records.push(Record {
        at: Time::from_micros(after.as_micros() + 100_000),
        ..nonsense
    });
    recording.lines.push(0);
    let run = opened(recording);
    let lines = list::lines(&run, false);
    assert!(lines.is_sorted_by_key(|line| line.event));
    assert!(
        lines
            .iter()
            .any(|line| line.kind == "panel" && line.text == "servo on")
    );
    let errors = list::lines(&run, true);
    let kinds: Vec<&str> = errors.iter().map(|line| line.kind).collect();
    assert_eq!(kinds, ["finding", "ng"], "{errors:?}");
    let summary = Summary::new(&run).to_text();
    for told in [
        "1 NG",
        "First NG",
        "SL: a program is running; stop it first",
        "Remedy: ",
        "> IP0 <STX>SL,NOPE<CR><ETX>",
    ] {
        assert!(summary.contains(told), "{summary}");
    }
}
