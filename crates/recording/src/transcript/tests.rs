//! Tests of the transcript formats: what is written reads back, and invalid input is rejected with its line.

use super::*;
use crate::every_event::{bless, compare, inputs, moment, outputs};
use ts3100_controller::{Config, Controller, Dialect, Input, Output, PanelAction};
use ts3100_driver::seat::{Notice, Subscriber as _};
use ts3100_proto::calendar::CalendarTime;

fn sample_header() -> Header {
    Header {
        origin: "observed, a test".to_owned(),
        calendar: Some(CalendarTime {
            year: 2026,
            month: 11,
            day: 21,
            hour: 10,
            minute: 0,
            second: 59,
        }),
        flags: vec!["dialect=manual".to_owned(), "set=text.stx=required".to_owned()],
        files: vec![
            ("A".to_owned(), b"PROGRAM A\n\n  X = 1 \nEND\n".to_vec()),
            ("B".to_owned(), b"PROGRAM B\rEND\r".to_vec()),
            ("C".to_owned(), b"one\ntab\there\nlast without end ".to_vec()),
            ("D".to_owned(), Vec::new()),
        ],
        select: Some("A".to_owned()),
    }
}

/// A recording with everything a transcript can hold.
pub(super) fn sample() -> (Header, Vec<Record>) {
    let ip0 = PeerId::first(Port::Ip0);
    let second = PeerId {
        port: Port::Ip0,
        peer: 2,
    };
    let ip1 = PeerId::first(Port::Ip1);
    let every: Vec<u8> = (0..=255).collect();
    let host = |line, bytes: &[u8]| RecordKind::FromHost {
        line,
        bytes: bytes.to_vec().into(),
    };
    let robot = |line, bytes: &[u8]| RecordKind::FromRobot {
        line,
        bytes: bytes.to_vec().into(),
    };
    let ended = |line, by, how| RecordKind::Ended { line, by, how };
    let whats = [
        RecordKind::Action(Action::Panel(PanelAction::Servo(true))),
        RecordKind::Connected {
            line: ip0,
            peer: "192.0.2.7".to_owned(),
        },
        host(ip0, b"\x02SO\r\x03"),
        robot(ip0, b"\x02OK\r\x03"),
        host(ip0, b"\x02SO\r\x03\x02SU\r\x03"),
        host(ip0, b"SO\r\x03"),
        host(ip0, b"\x02"),
        robot(ip0, b"\x02FL,\x02\x03\x00\xFF\x1A\x03"),
        host(ip0, &every),
        RecordKind::Connected {
            line: ip1,
            peer: String::new(),
        },
        robot(ip1, b"nothing"),
        robot(ip1, b"REQ \r"),
        robot(ip1, b"blank "),
        host(ip1, b"7,<8>\r\n"),
        RecordKind::Connected {
            line: second,
            peer: "::1".to_owned(),
        },
        ended(second, Side::Robot, EndReason::Refused),
        ended(ip1, Side::Host, EndReason::Reset),
        ended(ip0, Side::Host, EndReason::Closed),
        ended(ip0, Side::Robot, EndReason::Closed),
    ];
    let mut at = Time::ZERO;
    let pauses = [0_u64, 1, 999, 1_000, 1_000_000, 250_000, 1_234_567];
    let records = whats
        .into_iter()
        .zip(pauses.into_iter().cycle())
        .map(|(what, pause)| {
            at = at + std::time::Duration::from_micros(pause);
            Record { at, kind: what }
        });
    (sample_header(), records.collect())
}

fn written(format: Format, header: &Header, records: &[Record]) -> String {
    let (mut writer, mut out) = (format.writer(Duration::ZERO), Vec::new());
    writer.header(header, &mut out);
    records.iter().for_each(|record| writer.record(record, &mut out));
    String::from_utf8(out).unwrap()
}

fn as_text(header: &Header, records: &[Record]) -> String {
    written(Format::Text, header, records)
}

fn as_json(header: &Header, records: &[Record]) -> String {
    written(Format::Json, header, records)
}

#[test]
fn text_and_json_read_back_what_was_recorded() {
    let (header, records) = sample();
    for read in [
        text::read(&as_text(&header, &records)),
        json::read(&as_json(&header, &records)),
    ] {
        let read = read.unwrap();
        assert_eq!(read.header, header);
        assert_eq!(read.records, records);
        assert_eq!(read.lines.len(), records.len());
    }
}

#[test]
fn a_text_is_in_the_notation_of_the_hand_written_ones() {
    let (header, records) = sample();
    let text = as_text(&header, &records);
    let expected = "origin: observed, a test
clauses: none
calendar: 2026-11-21 10:00:59
flag: dialect=manual
flag: set=text.stx=required
file A
| PROGRAM A
|
|   X = 1 
| END
file B
|: PROGRAM B<CR>END<CR>
file C
| one
|: tab<09>here<LF>
|: last without end<20>
file D
select A
! servo on
@+1us
! connect IP0 192.0.2.7
@+999us
> IP0 SO<CR>
@+1ms
< IP0 OK<CR>
@+1s
>: IP0 <STX>SO<CR><ETX><STX>SU<CR><ETX>
@+250ms
>: IP0 SO<CR><ETX>
@+1234567us
>: IP0 <STX>
< IP0 FL,<STX><ETX><00><FF><EOF>
";
    assert!(text.starts_with(expected), "{text}");
    for line in [
        "<: IP1 nothing\n",
        "< IP1 REQ <CR>\n",
        "< IP1 blank<20>\n",
        "> IP1 7,<3C>8><CR><LF>\n",
        "! connect IP1\n",
        "! connect IP0#2 ::1\n",
        "! closed IP0#2 refused\n",
        "! disconnect IP1 reset\n",
        "! disconnect IP0\n",
        "! closed IP0\n",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
}

#[test]
fn what_does_not_hold_is_refused_with_its_line() {
    for line in [
        "> IP9 SO",
        "> IP0#0 SO",
        "> IP0#x SO",
        "? IP0 SO",
        "> IP0 <XYZ>",
        "< IP0 <*3>",
        "< IP0 nothing",
        "@+5",
        "@+xms",
        "@+99999999999999999s",
        "! dance",
        "! closed IP0 maybe",
        ">> IP0 2g",
        "| x",
        "calendar: today",
        "calendar: 2026-13-01 00:00:00",
        "servo: maybe",
    ] {
        let (number, reason) = text::read(&format!("origin: assumed\n\n{line}\n")).unwrap_err();
        assert_eq!(number, 3, "{line}: {reason}");
    }
    let lines = "origin: assumed\nflag: vary=7\n! connect IP0 host\n> IP0 SU<CR>\n";
    let [plain, several] = ["\n", "\r\r\r\n"].map(|end| text::read(&lines.replace('\n', end)).unwrap());
    assert_eq!(
        (plain.header, plain.records),
        (several.header, several.records),
        "each line ends with CR CR CR LF"
    );
    assert!(
        text::read("clauses: none\n")
            .unwrap_err()
            .1
            .to_string()
            .contains("origin")
    );
    let start = as_json(&sample().0, &[]);
    for line in [
        "",
        "[]",
        "{}",
        r#"{"t_us":-1,"event":"action","action":"program start"}"#,
        r#"{"t_us":1,"event":"dance"}"#,
        r#"{"t_us":1,"event":"from-host","line":"IP0","hex":"2g"}"#,
        r#"{"t_us":1,"event":"from-host","line":"IP9","hex":"20"}"#,
        r#"{"t_us":1,"event":"ended","line":"IP0","by":"nobody","how":"closed"}"#,
        r#"{"t_us":1,"event":"ended","line":"IP0","by":"host","how":"somehow"}"#,
    ] {
        let (number, reason) = json::read(&format!("{start}{line}\n")).unwrap_err();
        assert_eq!(number, 2, "{line}: {reason}");
    }
    let back = format!(
        "{start}{}\n{}\n",
        r#"{"t_us":5,"event":"action","action":"program start"}"#,
        r#"{"t_us":4,"event":"action","action":"program start"}"#
    );
    assert!(json::read(&back).unwrap_err().1.to_string().contains("or later"));
    assert!(json::read("").is_err());
    assert!(json::read(r#"{"format":"other","version":1,"origin":"x"}"#).is_err());
}

#[test]
fn a_name_tells_the_form() {
    let format = |name: &str| name.parse::<TranscriptFile>().map(|file| file.format);
    assert_eq!(format("a.txt"), Ok(Format::Text));
    assert_eq!(format("dir.x/a"), Ok(Format::Text));
    assert_eq!(format("a.JSONL"), Ok(Format::Json));
    assert_eq!(format("a.b.pcapng"), Ok(Format::Pcapng));
    for name in ["a.pcap", "a.json", ""] {
        assert!(format(name).unwrap_err().to_string().contains(".jsonl"), "{name}");
    }
    assert_eq!(without_port("127.0.0.1:4711"), "127.0.0.1");
    assert_eq!(without_port("[::1]:4711"), "::1");
    assert_eq!(without_port("a test"), "a test");
}

#[test]
fn a_transcript_that_cannot_be_written_is_said_and_given_up() {
    let missing: TranscriptFile = "/nowhere-at-all/x.txt".parse().unwrap();
    let error = Recorder::create(&[missing], &Header::default(), std::time::Duration::ZERO)
        .err()
        .unwrap();
    assert!(error.to_string().contains("/nowhere-at-all/x.txt"), "{error}");
    #[cfg(target_os = "linux")]
    {
        let full = TranscriptFile {
            path: PathBuf::from("/dev/full"),
            format: Format::Json,
        };
        assert!(Recorder::create(&[full], &Header::default(), std::time::Duration::ZERO).is_err());
    }
}

#[test]
fn what_nobody_is_there_to_receive_is_not_in_a_transcript() {
    let mut observer = Observer::default();
    let port = Port::Ip1;
    let print = Output::Send {
        port,
        bytes: b"REQ\r".to_vec().into(),
    };
    assert_eq!(observer.output(&print), None);
    let peer = "127.0.0.1:5000".to_owned();
    observer.input(&Input::Connected { port, peer }, Side::Host);
    assert!(observer.output(&print).is_some());
    assert_eq!(observer.output(&Output::PowerCycled), None);
    let gone = observer.input(&Input::Disconnected { port }, Side::Robot);
    assert!(matches!(gone, Some(RecordKind::Ended { by: Side::Robot, .. })));
    assert_eq!(observer.output(&print), None);
}

#[test]
fn what_is_kept_begins_anew_with_a_reset() {
    let controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
    let calendar = None;
    let servo = |on| Input::by_hand(PanelAction::Servo(on));
    for (restored, is_timed) in [(None, true), (Some(&controller), true), (None, false)] {
        let mut sink = TranscriptSink::create(sample_header(), &[], Some(100), restored).unwrap();
        if !is_timed {
            sink.notice(Time::ZERO, Notice::TimedFindings(false));
        }
        sink.input(Time::from_millis(10), &servo(true), Side::Host);
        let controller = &controller;
        sink.notice(Time::from_millis(20), Notice::Reset { controller, calendar });
        sink.input(Time::from_millis(7), &servo(false), Side::Host);
        let text = String::from_utf8(sink.buffer().to_bytes(Format::Text)).unwrap();
        let recording = text::read(&text).unwrap();
        let kinds: Vec<String> = recording
            .records
            .iter()
            .map(|record| match &record.kind {
                RecordKind::Link(LinkRecord::Restored { .. }) => "restored".to_owned(),
                RecordKind::Action(action) => action.to_string(),
                other => format!("{other:?}"),
            })
            .collect();
        let expected: &[&str] = match (restored, is_timed) {
            (None, true) => &["servo off"],
            (Some(_), _) => &["restored", "servo off"],
            (None, false) => &["Link(TimedFindings { on: false })", "servo off"],
        };
        assert_eq!(kinds, expected);
        assert!(recording.records[0].at <= Time::from_millis(7), "{text}");
    }
}

/// Records of the edge, one of which moves time back.
fn moved() -> Vec<Record> {
    let at = Time::from_millis;
    let record = |at, what| Record { at, kind: what };
    let servo = |on| RecordKind::Action(Action::Panel(PanelAction::Servo(on)));
    vec![
        record(at(5_000), servo(true)),
        record(
            at(6_000),
            RecordKind::Link(LinkRecord::Restored {
                at: at(40),
                snapshot: "{\"state\":[1,18446744073709551615,0.1]}".to_owned(),
            }),
        ),
        record(at(40), servo(false)),
        record(
            at(41),
            RecordKind::Link(LinkRecord::Backlogged { port: Port::Ip1 }),
        ),
        record(at(50), RecordKind::Link(LinkRecord::Reset { calendar: None })),
        record(at(0), servo(true)),
        record(at(7), servo(false)),
    ]
}

#[test]
fn times_go_on_from_where_a_snapshot_or_a_reset_says() {
    let records = moved();
    let header = sample_header();
    for read in [
        text::read(&as_text(&header, &records)),
        json::read(&as_json(&header, &records)),
    ] {
        assert_eq!(read.unwrap().records, records);
    }
    // Without the word for it a time that goes back is none.
    let without: Vec<Record> = records
        .into_iter()
        .filter(|record| !matches!(record.kind, RecordKind::Link(LinkRecord::Restored { .. })))
        .collect();
    assert!(json::read(&as_json(&header, &without)).is_err());
}

#[test]
fn a_snapshot_that_cannot_be_restored_is_named_with_its_line() {
    let directory = crate::testing::TempDir::new("transcript-edge");
    let path = directory.path().join("a.txt");
    std::fs::write(&path, as_text(&sample_header(), &moved())).unwrap();
    let error = Recording::read(&path).unwrap_err().to_string();
    assert!(
        error.contains("a.txt:") && error.contains("this is not a snapshot"),
        "{error}"
    );
}

#[test]
fn epochs_are_the_parts_in_which_time_only_advances() {
    let epochs = |records: Vec<Record>| {
        let recording = Recording {
            records,
            ..Recording::default()
        };
        let epochs = recording.epochs();
        let epochs = epochs.map(|epoch| (epoch.begins_at.as_micros(), epoch.first, epoch.records.len()));
        epochs.collect::<Vec<_>>()
    };
    assert_eq!(epochs(moved()), [(0, 0, 2), (40_000, 2, 3), (0, 5, 2)]);
    assert_eq!(epochs(moved()[..2].to_vec()), [(0, 0, 2)]);
    assert_eq!(epochs(moved()[..1].to_vec()), [(0, 0, 1)]);
    assert_eq!(epochs(Vec::new()), []);
}

#[test]
fn a_recording_that_begins_in_the_middle_is_told_by_its_line() {
    let gone = "# 12 records before this one are no longer kept\n";
    let begin = "! begin 5us IP1 {}\n";
    for (origin, lines, expected) in [
        ("written by hand", "> IP0 SU<CR>\n", Ok(())),
        (
            "observed",
            &*format!("# 12 records\n{begin}> IP0 SU<CR>\n"),
            Ok(()),
        ),
        (
            "observed",
            &format!("{gone}> IP0 SU<CR>\n"),
            Err("a.txt:2: cannot use a recording that begins in the middle of a run: the"),
        ),
        ("observed, ts3100 serve 0.1.0", gone, Err("a.txt:2: ")),
        (
            "observed, ts3100 serve 0.1.0",
            &format!("{gone}{begin}< IP1 A<CR>\n"),
            Ok(()),
        ),
        (
            "observed, ts3100 serve 0.1.0",
            &format!("{begin}> IP0 SU<CR>\n"),
            Err("a.txt:3: cannot use a recording that begins in the middle of a run: IP0"),
        ),
        (
            "observed, ts3100 serve 0.1.0",
            "! servo on\n< IP0 SP<CR>\n",
            Err("a.txt:3: "),
        ),
        (
            "observed, ts3100 serve 0.1.0",
            "! connect IP0\n! disconnect IP0\n< IP0 SP<CR>\n",
            Ok(()),
        ),
        (
            "observed, ts3100 tap 0.1.0 in front of a",
            "! connect IP0\n> IP0#2 SU<CR>\n",
            Err("a.txt:3: "),
        ),
    ] {
        let recording = text::read(&format!("origin: {origin}\n{lines}")).unwrap();
        let json = json::read(&as_json(&recording.header, &recording.records)).unwrap();
        let path = Path::new("a.txt");
        let found = recording.has_beginning(path).map_err(|error| error.to_string());
        match (&found, expected) {
            (Ok(()), Ok(())) => {}
            (Err(error), Err(expected)) if error.starts_with(expected) => {}
            _ => panic!("{lines}: {found:?}"),
        }
        assert_eq!(json.has_beginning(path).is_ok(), found.is_ok(), "{lines}");
    }
}

/// The transcript of every event.
fn of_every_event() -> String {
    let mut sink = TranscriptSink::create(sample_header(), &[], Some(MAX_BUFFERED_RECORDS), None).unwrap();
    let mut inputs = inputs();
    let disconnected = inputs.pop().unwrap();
    for (place, input) in inputs.iter().enumerate() {
        sink.input(moment(place), input, Side::Host);
    }
    for (place, output) in outputs().iter().enumerate() {
        sink.output(moment(inputs.len() + place), output);
    }
    sink.input(moment(100), &disconnected, Side::Host);
    String::from_utf8(sink.buffer().to_bytes(Format::Json)).unwrap()
}

const GOLDEN: &str = "transcript.jsonl";

#[test]
fn every_event_that_a_peer_sees_is_a_record() {
    compare(GOLDEN, &of_every_event());
}

#[test]
#[ignore = "writes fixtures/golden/events anew; review the difference"]
fn bless_transcript() {
    bless(GOLDEN, &of_every_event());
}
