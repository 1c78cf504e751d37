//! The same answers from recorded traffic: a recording of a host at work answers fewer questions, without disturbing
//! the robot.
//!
//! One [`Passive`] for each connection; [`Observation`] joins them. A question with two different answers stays
//! unknown.

use crate::catalogue;
use crate::forms;
use crate::probe::Verdict;
use crate::report::{Answer, Report};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use ts3100_proto::command::Command;
use ts3100_proto::reply::STOP;
use ts3100_proto::status::ExecutionStatus;
use ts3100_proto::status::sm::QuickStatus;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{
    CR, Checksum, Decoded, EOF, EndRule, Framing, HOST_DELAY, Reading, STX, StxRule, Text, TextDecoder,
    TextOptions,
};

/// If no SP follows a stop within this time, the controller sends none.
const STOP_NOTICE: Duration = Duration::from_secs(1);

/// What all connections of a recording show.
#[derive(Debug, Default)]
pub struct Observation {
    heard: BTreeMap<&'static str, BTreeSet<String>>,
    versions: Vec<String>,
    arm: String,
    /// SP was sent to a host with STX; to another host.
    told: [bool; 2],
    /// The end of a program was not told to a host with STX; to another host.
    untold: [bool; 2],
    refused: BTreeSet<String>,
}

impl Observation {
    fn note(&mut self, probe: &'static str, heard: impl Into<String>) {
        self.heard.entry(probe).or_default().insert(heard.into());
    }

    /// The report.
    #[must_use]
    pub fn report(mut self) -> Report {
        let stop = match (self.told, self.untold) {
            ([_, true], [_, false]) => Some("to every host"),
            ([true, false], [false, true]) => Some("not to a host without STX"),
            ([false, false], [true, _]) => Some("never"),
            _ => None,
        };
        if let Some(stop) = stop {
            self.note("unsolicited-stop", stop);
        }
        if ["SM", "HI"].iter().all(|letters| self.refused.contains(*letters)) {
            self.note("extensions", "NG");
        }
        let answers = catalogue::probes().filter_map(|probe| {
            let heard = Vec::from_iter(self.heard.remove(probe.id)?);
            Some(match heard.as_slice() {
                [one] => Answer::heard(probe, one.clone()),
                several => {
                    let note = format!("several different answers: {}", several.join("; "));
                    Answer::without(probe, Verdict::Unknown, note)
                }
            })
        });
        Report {
            answers: answers.collect(),
            versions: self.versions,
            arm: self.arm,
            ..Report::default()
        }
    }
}

/// A command of the host that waits for its answer.
struct Open {
    text: Text,
    at: Duration,
    /// It came sooner after a text of the controller than the manual allows.
    is_early: bool,
}

/// One connection, as a recording shows it.
pub struct Passive<'a> {
    observation: &'a mut Observation,
    host: TextDecoder,
    /// When the host sent last.
    asked: Duration,
    open: Option<Open>,
    /// Bytes that the controller has sent since, with their first and last moment.
    answer: Vec<u8>,
    answered: Option<(Duration, Duration)>,
    /// When the controller sent last.
    last: Option<Duration>,
    /// The host has sent a text without STX or an extension.
    is_other: bool,
    is_running: bool,
    /// The program has ended, and the host has not asked for it.
    ended: Option<Duration>,
    has_stopped: bool,
}

impl<'a> Passive<'a> {
    /// A connection that has just begun.
    pub fn new(observation: &'a mut Observation) -> Passive<'a> {
        Passive {
            observation,
            host: decoder(),
            asked: Duration::ZERO,
            open: None,
            answer: Vec::new(),
            answered: None,
            last: None,
            is_other: false,
            is_running: false,
            ended: None,
            has_stopped: false,
        }
    }

    /// Bytes of the host.
    pub fn host(&mut self, at: Duration, bytes: &[u8]) {
        self.close();
        self.host.push(bytes);
        self.asked = at;
        while let Some(decoded) = self.host.next_as(Reading::Command) {
            self.take_request(decoded);
        }
    }

    /// A text of the host.
    fn take_request(&mut self, decoded: Decoded) {
        let Decoded::Text(text) = decoded else { return };
        let at = self.asked;
        // Of several at once it is not known which one is answered; OK and NG are not.
        let is_done = |open: &Open| matches!(open.text.data.as_ref(), b"OK\r" | b"NG\r");
        let is_first = self.open.as_ref().is_none_or(is_done);
        let is_early = self.last.is_some_and(|last| at < last + HOST_DELAY);
        self.open = is_first.then_some(Open { text, at, is_early });
    }

    /// Bytes of the controller.
    pub fn robot(&mut self, at: Duration, bytes: &[u8]) {
        // The controller answers a text whose CR came last: its host sends no ETX.
        if let Some(decoded) = self.host.end_at_cr() {
            self.take_request(decoded);
        }
        self.answered = Some((self.answered.map_or(at, |(begin, _)| begin), at));
        self.answer.extend_from_slice(bytes);
        self.last = Some(at);
    }

    /// The connection begins again.
    pub fn reconnected(&mut self) {
        self.close();
        self.host = decoder();
        (self.open, self.last, self.ended) = (None, None, None);
        (self.is_other, self.is_running, self.has_stopped) = (false, false, false);
    }

    /// Nothing more comes on this connection.
    pub fn finish(mut self) {
        self.close();
    }

    /// Takes the exchange that is over.
    fn close(&mut self) {
        let answer = std::mem::take(&mut self.answer);
        let answered = self.answered.take();
        let open = self.open.take();
        let Some((begin, _)) = answered else {
            self.open = open;
            return;
        };
        let letters = open.as_ref().map(|open| letters(&open.text)).unwrap_or_default();
        match letters.as_str() {
            "SF" => return self.total_status(&answer),
            "IO" => return,
            _ => {}
        }
        let mut decoder = decoder();
        decoder.push(&answer);
        let mut texts = Vec::new();
        while let Some(decoded) = decoder.next() {
            if let Decoded::Text(text) = decoded {
                texts.push(text);
            }
        }
        if texts.iter().any(|text| text.data == STOP) {
            texts.retain(|text| text.data != STOP);
            self.ended = None;
            if let Some(told) = self.observation.told.get_mut(usize::from(self.is_other)) {
                *told = true;
            }
        }
        if let (Some(open), [answer]) = (open, texts.as_slice()) {
            self.exchange(&open, &letters, answer, begin);
        }
    }

    fn total_status(&mut self, answer: &[u8]) {
        let form = forms::total_status(answer, answer.first() == Some(&STX));
        if form != forms::OTHER {
            self.observation.note("total-status-texts", form);
            self.observation.arm = forms::arm(form);
        }
    }

    fn exchange(&mut self, open: &Open, letters: &str, answer: &Text, answered: Duration) {
        let data = &open.text.data;
        let Ok(command) = Command::parse(data.strip_suffix(&[CR]).unwrap_or(data)) else {
            return;
        };
        let is_refused = answer.data.as_ref() == b"NG\r";
        let content = answer.data.strip_prefix(b"FL,".as_slice());
        let content = content.and_then(|data| data.strip_suffix(&[EOF]));
        if is_refused {
            self.observation.refused.insert(letters.to_owned());
        } else {
            self.forms(open, letters, answer);
        }
        if open.text.framing == Framing::Bare || command.is_extension() {
            self.is_other = true;
        }
        if let Some(content) = content {
            self.content(letters, &open.text, content, answered);
        }
        if matches!(letters, "SP" | "BR" | "EC" | "RS" | "SL" | "DO") && !is_refused {
            self.has_stopped = true;
        }
        if letters == "RN" && !is_refused {
            (self.is_running, self.has_stopped, self.ended) = (true, false, None);
        }
        if self.ended.is_some_and(|ended| open.at > ended + STOP_NOTICE) {
            self.ended = None;
            if let Some(untold) = self.observation.untold.get_mut(usize::from(self.is_other)) {
                *untold = true;
            }
        }
    }

    /// Evidence from the form of a command that was served.
    fn forms(&mut self, open: &Open, letters: &str, answer: &Text) {
        let data = &open.text.data;
        if open.text.framing == Framing::Bare {
            let heard = match answer.framing {
                Framing::Bare => "answer without STX",
                Framing::Stx => "answer",
            };
            self.observation.note("stx", heard);
        }
        if !data.ends_with(&[CR]) {
            self.observation.note("cr", "answer");
        }
        if data.first().is_some_and(u8::is_ascii_lowercase) {
            self.observation.note("lower-case", "answer");
        }
        // An OK that came early may have been ignored, and the command served instead of it.
        if open.is_early {
            self.observation.note("pause", "answer");
        }
        if letters == "SM" {
            match self.observation.arm.as_str() {
                "" => {}
                "SCARA" => self.observation.note("extensions", "served on a SCARA arm"),
                _ => self.observation.note("extensions", "served"),
            }
        }
    }

    fn content(&mut self, letters: &str, asked: &Text, content: &[u8], at: Duration) {
        let name = asked.data.to_ascii_uppercase();
        match letters {
            "SU" => {
                self.observation.note("status-form", forms::status(content));
                if let Ok(status) = StatusBody::decode(content) {
                    self.follow(status.execution, at);
                }
            }
            "VR" => {
                self.observation.note("versions-form", forms::versions(content));
                self.observation.versions = forms::version_records(content);
            }
            "EU" => self.observation.note("history-form", forms::history(content)),
            "CA" => self.observation.note("directory-form", forms::directory(content)),
            "SM" if QuickStatus::decode(content).is_ok() => {
                self.observation.note("quick-status-form", "14 items");
            }
            "UL" if name.starts_with(b"UL,USER.PAR") => {
                self.observation
                    .note("parameter-line-end", forms::line_end(content));
            }
            "UL" if name.starts_with(b"UL,ETHERNET.PAR") => {
                if let Some(mode) = forms::open_mode(content) {
                    self.observation.note("open-mode", mode);
                }
            }
            _ => {}
        }
    }

    /// Notices that a program has ended by itself.
    fn follow(&mut self, execution: ExecutionStatus, at: Duration) {
        let runs = execution == ExecutionStatus::Running;
        if self.is_running && !runs && !self.has_stopped {
            self.ended = Some(at);
        }
        self.is_running = runs;
    }
}

fn letters(text: &Text) -> String {
    let letters = text.data.get(..2).unwrap_or_default();
    String::from_utf8_lossy(letters).to_ascii_uppercase()
}

fn decoder() -> TextDecoder {
    TextDecoder::new(TextOptions {
        stx: StxRule::Detect,
        end: EndRule::Detect,
        checksum: Checksum::None,
    })
}
