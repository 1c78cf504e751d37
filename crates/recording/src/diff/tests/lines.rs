//! Tests of the comparison that are about lines and connections, and of recordings of anything at all.

use super::*;
use std::collections::BTreeMap;

#[test]
fn how_the_wire_cut_the_answers_does_not_matter() {
    let settings = with(PICK);
    let clean = day(&settings, Duration::ZERO);
    let mut split = Recording::default();
    for (record, line) in clean.records.iter().zip(&clean.lines) {
        match &record.kind {
            RecordKind::FromRobot { line: on, bytes } => {
                for piece in bytes.chunks(3) {
                    let what = RecordKind::FromRobot {
                        line: *on,
                        bytes: piece.to_vec().into(),
                    };
                    split.records.push(Record {
                        at: record.at,
                        kind: what,
                    });
                    split.lines.push(*line);
                }
            }
            _ => {
                split.records.push(record.clone());
                split.lines.push(*line);
            }
        }
    }
    none(&compared(&split, &settings, &Tolerance::default()));
}

fn come(line: PeerId) -> RecordKind {
    let peer = String::new();
    RecordKind::Connected { line, peer }
}

fn ended(line: PeerId, by: Side) -> RecordKind {
    let how = EndReason::Closed;
    RecordKind::Ended { line, by, how }
}

fn host(line: PeerId, bytes: &[u8]) -> RecordKind {
    let bytes = bytes.to_vec().into();
    RecordKind::FromHost { line, bytes }
}

fn robot(line: PeerId, bytes: &[u8]) -> RecordKind {
    let bytes = bytes.to_vec().into();
    RecordKind::FromRobot { line, bytes }
}

/// One of these each millisecond.
fn recording(kinds: Vec<RecordKind>) -> Recording {
    let lines = (1..=kinds.len()).collect();
    let records = (1..).map(Time::from_millis).zip(kinds);
    Recording {
        records: records.map(|(at, kind)| Record { at, kind }).collect(),
        lines,
        ..Recording::default()
    }
}

/// How many differences are about the end of a connection.
fn count_ends(report: &Report) -> usize {
    let ends = report.differences.iter();
    ends.filter(|found| matches!(found.kind, DifferenceKind::Ended { .. }))
        .count()
}

#[test]
fn a_second_host_is_compared_too() {
    let settings = with(PICK);
    let first = PeerId::first(Port::Ip0);
    let second = PeerId {
        port: Port::Ip0,
        peer: 2,
    };
    let refused = recording(vec![
        come(first),
        come(second),
        host(second, b"\x02SO\r\x03"),
        ended(second, Side::Robot),
        host(first, b"\x02SO\r\x03"),
        robot(first, b"\x02OK\r\x03"),
    ]);
    none(&compared(&refused, &settings, &Tolerance::default()));
    let replaced = recording(vec![
        come(first),
        come(second),
        ended(first, Side::Robot),
        host(second, b"\x02SO\r\x03"),
        robot(second, b"\x02OK\r\x03"),
    ]);
    let mut replacing = settings.clone();
    replacing.second = SecondConnection::Replace;
    none(&compared(&replaced, &replacing, &Tolerance::default()));
    let report = compared(&replaced, &settings, &Tolerance::default());
    assert!(count_ends(&report) >= 1, "{report:?}");
    // One that comes while the other is about to leave is served.
    let handed_over = recording(vec![
        come(first),
        come(second),
        host(second, b"\x02SO\r\x03"),
        ended(first, Side::Host),
        robot(second, b"\x02OK\r\x03"),
    ]);
    none(&compared(&handed_over, &settings, &Tolerance::default()));
}

#[test]
fn an_end_by_the_robot_counts_again_after_the_host_has_come_back() {
    let line = PeerId::first(Port::Ip0);
    let ends = |kinds| count_ends(&compared(&recording(kinds), &with(PICK), &Tolerance::default()));
    let served = || [host(line, b"\x02SO\r\x03"), robot(line, b"\x02OK\r\x03")];
    let left = || [come(line), ended(line, Side::Host)];
    // The robot's own end of a connection that the host has ended says nothing.
    assert_eq!(
        ends([left().to_vec(), vec![ended(line, Side::Robot)]].concat()),
        0
    );
    let mut again = left().to_vec();
    again.push(come(line));
    again.extend(served());
    assert_eq!(ends(again.clone()), 0);
    again.push(ended(line, Side::Robot));
    assert_eq!(ends(again), 1, "the emulator leaves it open");
}

#[test]
fn the_cable_of_a_serial_port_stays_in_when_the_power_is_cycled() {
    let settings = with(PICK);
    let mut real = Real::new(&settings);
    real.connect(Port::Host);
    real.connect(Port::Ip0);
    real.send(Port::Host, b"\x02SU\r\x03");
    real.pass(SECOND);
    real.send(Port::Host, b"\x02OK\r\x03");
    real.panel(PanelAction::PowerCycle);
    let (port, peer) = (Port::Host, "serial".to_owned());
    real.feed(Input::Connected { port, peer }, Side::Robot);
    real.send(Port::Host, b"\x02SU\r\x03");
    real.pass(SECOND);
    let answers = real.recording.records.iter().filter(
        |record| matches!(&record.kind, RecordKind::FromRobot { line, .. } if line.port == Port::Host),
    );
    assert!(answers.count() >= 2);
    // The recorder of these tests ends IP1 as well, which was not there.
    real.recording
        .records
        .retain(|record| !matches!(&record.kind, RecordKind::Ended { line, .. } if line.port == Port::Ip1));
    real.recording.lines.truncate(real.recording.records.len());
    none(&compared(&real.recording, &settings, &Tolerance::default()));
}

#[test]
fn bytes_injected_without_a_peer_are_no_connection() {
    let settings = with("PROGRAM PICK\nINPUT IP1, N\nDOUT(5)\nDELAY 60\nEND\n");
    let mut silent = settings.clone();
    silent.controller.options.no_peer = ts3100_controller::options::NoPeer::Silent;
    for (settings, peer) in [(&settings, false), (&silent, false), (&settings, true)] {
        let mut real = Real::new(settings);
        real.connect(Port::Ip0);
        if peer {
            real.connect(Port::Ip1);
        }
        real.texts(&["SO", "RN"]);
        real.send(Port::Ip1, b"7\r");
        real.texts(&["SF", "OK"]);
        real.feed(Input::by_hand(PanelAction::PowerCycle), Side::Host);
        if !peer {
            // The recorder of these tests ends IP1 as well, which was not there.
            real.recording.records.pop();
            real.recording.lines.pop();
        }
        none(&compared(&real.recording, settings, &Tolerance::default()));
    }
}

#[test]
fn recordings_of_anything_at_all_are_survived() {
    let settings = with(PICK);
    let clean = day(&settings, Duration::ZERO);
    let counts: BTreeMap<usize, usize> = (0..40)
        .map(|seed| {
            let mut recording = clean.clone();
            // A simple generator: which records go, double, or change places.
            let mut state = 0x9E37_79B9_u64.wrapping_mul(seed as u64 + 1);
            for _ in 0..20 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let count = recording.records.len() as u64;
                let index = usize::try_from((state >> 33) % count).unwrap();
                match state >> 62 {
                    0 => {
                        recording.records.remove(index);
                        recording.lines.remove(index);
                    }
                    1 => recording.records.insert(index, recording.records[index].clone()),
                    _ => {
                        let other = usize::try_from((state >> 20) % count).unwrap();
                        let what = recording.records[index].kind.clone();
                        recording.records[index].kind = recording.records[other].kind.clone();
                        recording.records[other].kind = what;
                    }
                }
                recording.lines = (1..=recording.records.len()).collect();
            }
            (
                seed,
                compared(&recording, &settings, &Tolerance::default())
                    .differences
                    .len(),
            )
        })
        .collect();
    assert!(
        counts.values().filter(|count| **count > 0).count() > 30,
        "{counts:?}"
    );
}

/// A status of a program under way, asked `early` before or behind the moment at which it was asked.
fn asked_off_its_moment(pause: Duration, shift: impl Fn(Time) -> Time) -> Recording {
    let mut real = Real::new(&with("PROGRAM PICK\nDELAY 1\nDOUT(5)\nDELAY 9\nEND\n"));
    real.connect(Port::Ip0);
    real.texts(&["SO", "RN"]);
    real.pass(pause);
    let from = real.recording.records.len();
    real.texts(&["SF", "OK"]);
    let mut recording = real.recording;
    for record in recording.records.iter_mut().skip(from) {
        record.at = shift(record.at);
    }
    recording
}

#[test]
fn what_moves_may_be_seen_a_moment_earlier_or_later() {
    let settings = with("PROGRAM PICK\nDELAY 1\nDOUT(5)\nDELAY 9\nEND\n");
    let off = Duration::from_millis(80);
    let early = asked_off_its_moment(Duration::from_millis(900), |at| at + off);
    let late = asked_off_its_moment(Duration::from_millis(1_000), |at| {
        Time::from_micros(at.as_micros() - 80_000)
    });
    let clock = || ignoring(&["clock"]);
    for recording in [early, late] {
        let report = compared(&recording, &settings, &clock());
        assert_eq!((report.differences.as_slice(), report.shifted), (&[][..], 1));
        // Beyond the tolerance of time it is another answer.
        let strict = Tolerance {
            time: Duration::from_millis(10),
            ..clock()
        };
        let report = compared(&recording, &settings, &strict);
        assert_eq!((report.differences.len(), report.shifted), (1, 0), "{report:?}");
    }
}

#[test]
fn a_missing_answer_says_what_became_of_the_question() {
    let mut real = Real::new(&with(PICK));
    real.connect(Port::Ip0);
    real.send(Port::Ip0, b"SO\r\x03");
    let mut strict = with(PICK);
    strict.controller.options.text.stx = ts3100_proto::text::StxRule::Required;
    let report = compared(&real.recording, &strict, &Tolerance::default());
    let [
        Difference {
            kind: DifferenceKind::Missing {
                reason: Some(reason), ..
            },
            ..
        },
    ] = report.differences.as_slice()
    else {
        panic!("{report:?}");
    };
    assert!(reason.contains("belong to no text"), "{reason}");
}
