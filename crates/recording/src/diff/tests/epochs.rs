//! Tests of recordings in which time begins again, by a reset or a restored snapshot.

use super::*;
use crate::transcript::{LinkRecord, PeerId, text};

fn written(lines: &str) -> Recording {
    text::read(&format!("origin: written by hand, ours\n{lines}")).unwrap()
}

#[test]
fn a_file_that_is_not_stored_after_a_reset_was_stored_before_it() {
    let download = |answer: &str| {
        format!(
            "! connect IP0\n@+1s\n> IP0 DL,A<CR>\n< IP0 OK<CR>\n@+100ms\n> IP0 FL,END<LF><EOF>\n{answer}<CR>\n"
        )
    };
    let (kept, lost) = ("< IP0 OK", "! unkept A the disk is full\n< IP0 NG");
    // Both at the same time of their epoch.
    for (first, second) in [(kept, lost), (lost, kept), (lost, lost)] {
        let recording = written(&format!("{}! reset\n{}", download(first), download(second)));
        // Asked at another moment, the emulator would store it.
        let exact = Tolerance {
            time: Duration::ZERO,
            ..Tolerance::default()
        };
        none(&compared(&recording, &with(PICK), &exact));
    }
}

#[test]
fn what_is_sent_before_a_reset_and_not_recorded_is_surplus() {
    let settings = Settings {
        servo_on: true,
        ..with("PROGRAM PICK\nDELAY 100\nEND\n")
    };
    let run = "! connect IP0\n> IP0 RN<CR>\n< IP0 OK<CR>\n@+150s\n";
    let recording = written(&format!("{run}! reset\n@+5s\n! servo on\n"));
    let report = compared(&recording, &settings, &Tolerance::default());
    let [only] = report.differences.as_slice() else {
        panic!("{report:?}");
    };
    let DifferenceKind::Surplus { emulated, .. } = &only.kind else {
        panic!("{report:?}");
    };
    assert_eq!((emulated.as_slice(), only.file_line), (&b"\x02SP\r\x03"[..], 6));
}

#[test]
fn a_second_peer_waits_as_long_when_a_snapshot_moves_time_back() {
    let settings = with(PICK);
    let second = PeerId {
        port: Port::Ip0,
        peer: 2,
    };
    let first = PeerId::first(Port::Ip0);
    let peer = String::new;
    let bytes = |line, bytes: &[u8]| RecordKind::FromHost {
        line,
        bytes: bytes.to_vec().into(),
    };
    let restored = LinkRecord::from_restored(&settings.candidate().controller);
    let ended = RecordKind::Ended {
        line: second,
        by: Side::Robot,
        how: EndReason::Closed,
    };
    let kinds = [
        (
            100_000,
            RecordKind::Connected {
                line: first,
                peer: peer(),
            },
        ),
        (
            100_000,
            RecordKind::Connected {
                line: second,
                peer: peer(),
            },
        ),
        (100_010, RecordKind::Link(restored)),
        (40, ended),
        (500, bytes(first, b"\x02BR\r\x03")),
        (
            500,
            RecordKind::FromRobot {
                line: first,
                bytes: b"\x02OK\r\x03"[..].into(),
            },
        ),
    ];
    let records = kinds.map(|(at, kind)| Record {
        at: Time::from_millis(at),
        kind,
    });
    let recording = Recording {
        lines: (1..=records.len()).collect(),
        records: records.into(),
        ..Recording::default()
    };
    none(&compared(&recording, &settings, &Tolerance::default()));
}
