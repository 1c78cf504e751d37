//! Tests of the transcript in memory: it replays from its first record, wherever the older ones were cut off.

use super::*;
use crate::replay::Playback;
use crate::transcript::{Format, Header, TranscriptBuffer, TranscriptSink, json, text};
use std::sync::{Arc, Mutex};
use ts3100_controller::Event;
use ts3100_driver::seat::{Effects, Seat, Subscriber};

/// Moves and prints without end.
const BUSY: &str = "PROGRAM PICK\nSPEED = 40\nLOOP:\nMOVE POINT(450, 0, 250)\nPRINT IP1, \"A\", CR\nDELAY 0.013\n\
    MOVE POINT(400, 30, 260)\nPRINT COM1, \"LONGER THAN WHAT A SERIAL LINE SENDS AT ONCE\", CR\nGOTO LOOP\nEND\n";
/// Records that the buffer holds at most: some copies of the controller fit.
const SOME: usize = 160;
/// The same: a single copy fits, and another one is due after three records.
const FEW: usize = 24;

/// The connections of a controller: those that it closes end. This one has a peer on IP0 at least.
struct Links;

impl Effects for Links {
    fn perform(&mut self, _at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        match output {
            Output::Disconnect { port, .. } => vec![Input::Disconnected { port }],
            Output::PowerCycled => vec![Input::Disconnected { port: Port::Ip0 }],
            _ => Vec::new(),
        }
    }
}

/// A robot whose transcript is kept in memory.
struct Kept {
    seat: Seat,
    now: Time,
    buffer: Arc<TranscriptBuffer>,
    most: usize,
    settings: Settings,
    /// The remark of the transcript that was replayed last.
    last_cut: String,
    /// Answers that have been compared.
    answers: usize,
}

impl Kept {
    fn new(settings: &Settings, most: usize) -> Kept {
        let mut controller = settings.candidate().controller;
        while controller.poll_output().is_some() {}
        let sink = TranscriptSink::create(Header::default(), &[], Some(most), None).unwrap();
        let buffer = sink.buffer();
        let mut seat = Seat::new(controller);
        seat.subscribe(Box::new(sink));
        Kept {
            seat,
            now: Time::ZERO,
            buffer,
            most,
            settings: settings.clone(),
            last_cut: String::new(),
            answers: 0,
        }
    }

    fn feed(&mut self, input: Input) {
        self.seat.feed(self.now, input, Side::Host, &mut Links).unwrap();
        if self.most == FEW && self.is_cut() {
            self.replay();
        }
    }

    fn connect(&mut self, port: Port) {
        let peer = "192.0.2.2:5000".to_owned();
        self.feed(Input::Connected { port, peer });
    }

    fn send(&mut self, port: Port, bytes: &[u8]) {
        self.feed(Input::received(port, bytes.to_vec()));
    }

    /// Lets time pass, each deadline at its own time.
    fn pass(&mut self, duration: Duration) {
        let to = self.now + duration;
        while let Some(due) = self.seat.deadline().filter(|due| *due <= to) {
            self.now = due.max(self.now);
            self.feed(Input::Tick);
        }
        self.now = to;
    }

    /// Asks for the whole status and acknowledges it.
    fn poll(&mut self) {
        self.send(Port::Ip0, b"\x02SF\r\x03");
        self.pass(Duration::from_micros(61_357));
        self.send(Port::Ip0, b"\x02OK\r\x03");
        self.pass(Duration::from_micros(38_111));
    }

    fn is_cut(&self) -> bool {
        let text = self.buffer.to_bytes(Format::Text);
        String::from_utf8(text).unwrap().contains("! begin ")
    }

    /// Replays the kept transcript if it begins later than the one that was replayed last.
    fn replay_if_cut(&mut self) {
        let text = String::from_utf8(self.buffer.to_bytes(Format::Text)).unwrap();
        let remark = text
            .lines()
            .find(|line| line.starts_with("# "))
            .unwrap_or_default();
        if self.last_cut != remark {
            self.last_cut = remark.to_owned();
            self.replay();
        }
    }

    /// Replays the kept transcript to a controller as it was started: nothing may differ, to the microsecond.
    fn replay(&mut self) {
        let exact = Tolerance {
            time: Duration::ZERO,
            ..Tolerance::default()
        };
        let kept = |format| String::from_utf8(self.buffer.to_bytes(format)).unwrap();
        let kept = [
            text::read(&origin(&kept(Format::Text))),
            json::read(&origin(&kept(Format::Json))),
        ];
        for recording in kept {
            let recording = recording.unwrap();
            let report = compared(&recording, &self.settings, &exact);
            none(&report);
            assert_eq!(report.shifted, 0);
            self.answers += report.answers;
        }
    }
}

/// A header with an origin.
fn origin(kept: &str) -> String {
    let text = kept.replacen("origin: \n", "origin: a test\n", 1);
    text.replacen(r#""origin":"""#, r#""origin":"a test""#, 1)
}

fn busy() -> Settings {
    Settings {
        servo_on: true,
        ..with(BUSY)
    }
}

#[test]
fn the_transcript_in_memory_replays_from_wherever_it_begins() {
    let settings = busy();
    let mut kept = Kept::new(&settings, SOME);
    kept.feed(Input::by_hand(PanelAction::Servo(true)));
    for port in [Port::Host, Port::Com1, Port::Ip0, Port::Ip1] {
        kept.connect(port);
    }
    // A download over the serial line, a few characters with each poll, so that every cut is in the middle of it.
    for text in [b"\x02DL,NEW\r\x03".as_slice(), b"\x02FL,PROGRAM NEW\n\x03"] {
        kept.send(Port::Host, text);
        kept.pass(SECOND);
    }
    kept.send(Port::Ip0, b"\x02RN\r\x03");
    let texts = [b"\x02X = 1234567890\n\x03".as_slice(); 40];
    for piece in texts.iter().flat_map(|text| text.chunks(7)) {
        kept.send(Port::Host, piece);
        kept.poll();
        kept.replay_if_cut();
    }
    assert!(kept.is_cut() && kept.answers > 1_000);
    // The file is stored only while no program runs.
    kept.send(Port::Ip0, b"\x02BR\r\x03");
    kept.pass(SECOND);
    kept.send(Port::Host, b"\x02END\n\x1a\x03");
    kept.pass(SECOND);
    assert!(kept.seat.controller.files().any(|(name, _)| name == "NEW"));
    let text = String::from_utf8(kept.buffer.to_bytes(Format::Text)).unwrap();
    assert!(text.contains("< IP1 A<CR>"), "{text}");
    kept.replay();
}

fn with_faults_and_peers_that_come_and_go(most: usize, turns: u32) {
    let settings = busy();
    let mut kept = Kept::new(&settings, most);
    kept.feed(Input::by_hand(PanelAction::Servo(true)));
    for port in [Port::Host, Port::Com1, Port::Ip0, Port::Ip1] {
        kept.connect(port);
    }
    for fault in [
        "faults arm split-bytes:channel=IP0,times=0,probability=0.3,size=90",
        "faults arm reset-mid-text:channel=IP0,times=0,probability=0.1",
    ] {
        let action = fault.parse::<ts3100_controller::Action>().unwrap();
        kept.feed(Input::by_owner(action));
    }
    kept.send(Port::Ip0, b"\x02RN\r\x03");
    kept.pass(SECOND);
    for turn in 0..turns {
        if kept.seat.controller.peer(Port::Ip0).is_none() {
            kept.connect(Port::Ip0);
        }
        kept.send(Port::Ip0, b"\x02SF\r\x03");
        kept.pass(Duration::from_micros(61_357));
        if kept.seat.controller.peer(Port::Ip0).is_some() {
            kept.send(Port::Ip0, b"\x02OK\r\x03");
        }
        if turn.is_multiple_of(5) {
            // The peer stays until the line has carried its last byte; nothing is printed for it any more.
            kept.send(Port::Com1, &[b'7'; 60]);
            kept.feed(Input::Disconnected { port: Port::Com1 });
            kept.feed(Input::SerialErrors {
                port: Port::Host,
                bytes: b"SU".to_vec(),
            });
            for _ in 0..4 {
                kept.pass(Duration::from_micros(11_500));
                kept.send(Port::Host, b"U");
            }
            kept.send(Port::Host, b"\r\x03");
            kept.connect(Port::Com1);
        }
        kept.pass(Duration::from_micros(38_111));
        kept.replay_if_cut();
    }
    assert!(kept.is_cut() && kept.answers > 100);
}

#[test]
fn the_transcript_in_memory_replays_with_faults_and_peers_that_come_and_go() {
    with_faults_and_peers_that_come_and_go(SOME, 120);
}

#[test]
fn the_transcript_in_memory_can_begin_before_every_input() {
    with_faults_and_peers_that_come_and_go(FEW, 15);
}

/// Rules of the findings, in order.
#[derive(Clone, Default)]
struct Findings(Arc<Mutex<Vec<&'static str>>>);

impl Findings {
    fn take(&self) -> Vec<&'static str> {
        std::mem::take(&mut self.0.lock().unwrap())
    }
}

impl Subscriber for Findings {
    fn output(&mut self, _at: Time, output: &Output) {
        if let Output::Event(Event::Finding(finding)) = output {
            self.0.lock().unwrap().push(finding.rule.id);
        }
    }
}

#[test]
fn a_replay_reports_the_findings_about_timing_that_the_run_reported() {
    let settings = with(PICK);
    let mut kept = Kept::new(&settings, SOME);
    let live = Findings::default();
    kept.seat.subscribe(Box::new(live.clone()));
    kept.connect(Port::Ip0);
    let mut expected = Vec::new();
    for (is_timed, cut) in [(false, false), (true, false), (false, true)] {
        kept.seat.report_timed_findings(is_timed);
        for _ in 0..if cut { SOME } else { 1 } {
            // A pause after the reply that is too short.
            for _ in 0..2 {
                kept.send(Port::Ip0, b"\x02SO\r\x03");
                kept.pass(Duration::from_millis(10));
            }
        }
        let found = live.take();
        assert_eq!(found.contains(&"command-early"), is_timed, "{found:?}");
        expected = if cut {
            Vec::new()
        } else {
            [expected, found].concat()
        };
        assert_eq!(kept.is_cut(), cut);
        let text = String::from_utf8(kept.buffer.to_bytes(Format::Text)).unwrap();
        let recording = Arc::new(text::read(&origin(&text)).unwrap());
        let replayed = Findings::default();
        let mut playback = Playback::new(recording, settings.candidate());
        playback.subscribe(Box::new(replayed.clone()));
        while playback.step().is_some() {}
        assert_eq!(replayed.take(), expected, "{text}");
    }
}

#[test]
fn the_transcript_in_memory_never_begins_between_a_close_and_its_record() {
    for before in 0..4 {
        let mut kept = Kept::new(&busy(), FEW);
        kept.connect(Port::Ip0);
        for _ in 0..before {
            kept.send(Port::Ip0, b"\x02");
        }
        // Its connections end because of it, and are recorded after it.
        kept.feed(Input::by_hand(PanelAction::PowerCycle));
        kept.pass(SECOND);
        kept.replay();
    }
}
