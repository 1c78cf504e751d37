//! A recording of a real robot: what its traffic tells. There is no controller to ask, so arm, lines and positions follow SF,
//! mode and file follow SU, and the rest is not known.

use crate::lanes::Place;
use crate::run::{Entry, Places};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;
use ts3100_control::journal::{Journal, JournalWriter};
use ts3100_control::recorded::{alarm_document, arm_document, state_document};
use ts3100_controller::output::Verdict;
use ts3100_controller::{Bytes, Controller, Event, Input, Output, Port, Time};
use ts3100_driver::driver::request::Still;
use ts3100_driver::seat::{Side, Subscriber as _};
use ts3100_proto::command::COMMANDS;
use ts3100_proto::dissect::dissect;
use ts3100_proto::reply::Reply;
use ts3100_proto::status::sf::{SfLayout, SystemStatus, alarm_from_word};
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::status::{ExecutionStatus, MasterMode};
use ts3100_proto::text::{CR, Decoded, EOF, ETX, Framing, Reading, STX, TextDecoder, TextOptions};
use ts3100_recording::answers::{self, Answer, RecordedEvent, parse_reply};
use ts3100_recording::transcript::{PeerId, RecordKind, Recording, Side as End};

/// Keys of the state of which the traffic tells nothing.
pub const UNKNOWN: [&str; 13] = [
    "key_switch",
    "control_right",
    "safety_open",
    "battery_low",
    "tasks",
    "hands",
    "channels",
    "files",
    "variables",
    "faults",
    "parameters",
    "pendant",
    "ether_pages",
];
/// Keys that SF tells.
const OF_TOTAL: [&str; 14] = [
    "servo",
    "emergency_stop",
    "feed_hold",
    "status",
    "line",
    "executed_line",
    "analysed_line",
    "power_on_minutes",
    "run_minutes",
    "inputs",
    "outputs",
    "alarms",
    "guide",
    "arm",
];
/// Keys that SU tells.
const OF_STATUS: [&str; 5] = [
    "master_mode",
    "run_mode",
    "file",
    "override_percent",
    "machine_lock",
];
/// Most bytes of a status that came in several texts.
const MAX_BODY: usize = 1_024;

/// What a status has told.
#[derive(Debug, Clone)]
enum Told {
    Total(Box<SystemStatus>, Vec<u16>, Vec<u16>),
    Status(StatusBody),
}

/// What the traffic of a real robot tells.
pub struct Observed {
    /// A controller of the same model, for what is shown of every robot.
    template: Controller,
    /// Each with the number of its event.
    told: Vec<(u64, Told)>,
}

/// A port on its way through a recording.
#[derive(Default)]
struct Peer {
    decoder: TextDecoder,
    /// A status whose end has not come yet.
    body: Vec<u8>,
}

/// Reads the whole recording.
pub(crate) fn observe(
    recording: &Recording,
    template: Controller,
    journal: &Arc<Journal>,
) -> (Observed, Places) {
    let options = template.config().options.text;
    let mut reader = Reader {
        writer: JournalWriter::new(Arc::clone(journal)),
        journal: Arc::clone(journal),
        places: Places::default(),
        peers: BTreeMap::new(),
        options,
        mode: None,
        told: Vec::new(),
    };
    for event in answers::events(recording, options) {
        // Every record up to this line has happened.
        let records = recording.lines.partition_point(|line| *line <= event.file_line);
        reader.take(&event, records);
    }
    let count = reader.places.records_of.len() as u64;
    reader.places.event_of.resize(recording.records.len(), count);
    (
        Observed {
            template,
            told: reader.told,
        },
        reader.places,
    )
}

struct Reader {
    writer: JournalWriter,
    journal: Arc<Journal>,
    places: Places,
    peers: BTreeMap<PeerId, Peer>,
    options: TextOptions,
    /// The mode that a status has told last.
    mode: Option<MasterMode>,
    told: Vec<(u64, Told)>,
}

impl Reader {
    fn take(&mut self, event: &RecordedEvent, records: usize) {
        let at = event.at;
        match &event.event {
            answers::Event::Input(RecordKind::Connected { line, peer }) => {
                self.peers.insert(*line, self.new_peer());
                let (port, peer) = (line.port, peer.clone());
                self.writer
                    .input(at, &Input::Connected { port, peer }, Side::Host);
            }
            answers::Event::Input(RecordKind::FromHost { line, bytes }) => self.host(at, *line, bytes),
            answers::Event::Input(RecordKind::Ended {
                line, by: End::Host, ..
            }) => {
                let port = line.port;
                self.writer.input(at, &Input::Disconnected { port }, Side::Host);
            }
            answers::Event::Input(_) => {}
            answers::Event::Answer(line, answer) => self.answer(at, *line, answer),
            answers::Event::Ended(line, _) => {
                let (port, how) = (line.port, ts3100_controller::output::DisconnectMode::Close);
                self.writer.output(at, &Output::Disconnect { port, how });
            }
        }
        self.note(records);
    }

    /// Gives the events since the last call their places.
    fn note(&mut self, records: usize) {
        let known = self.places.records_of.len() as u64;
        for found in self.journal.events_from(known + 1, usize::MAX).events {
            self.places
                .records_of
                .push(u32::try_from(records).unwrap_or(u32::MAX));
            let place = Place {
                event: found.seq,
                at: found.t,
            };
            self.places.lanes.event(place, &found.event);
        }
        let count = self.places.records_of.len() as u64;
        if self.places.event_of.len() < records {
            self.places.event_of.resize(records, count);
        }
        if let Some(last) = self.places.event_of.last_mut() {
            *last = count;
        }
    }

    fn new_peer(&self) -> Peer {
        Peer {
            decoder: TextDecoder::new(self.options),
            body: Vec::new(),
        }
    }

    fn host(&mut self, at: Time, line: PeerId, bytes: &Bytes) {
        let (port, bytes) = (line.port, bytes.clone());
        self.writer.input(
            at,
            &Input::Received {
                port,
                bytes: bytes.clone(),
            },
            Side::Host,
        );
        if port.protocol().is_none() {
            return;
        }
        let new = self.new_peer();
        let peer = self.peers.entry(line).or_insert(new);
        peer.decoder.push(&bytes);
        while let Some(decoded) = peer.decoder.next_as(Reading::Command) {
            if let Decoded::Text(text) = decoded {
                let (framing, data, terminator) = (text.framing, text.data, text.terminator);
                let event = Event::TextIn {
                    port,
                    framing,
                    data,
                    terminator,
                };
                self.writer.output(at, &Output::Event(event));
            }
        }
    }

    fn answer(&mut self, at: Time, line: PeerId, answer: &Answer) {
        let (port, bytes) = (line.port, Bytes::from(answer.bytes.clone()));
        if port.protocol().is_some() {
            let reply = parse_reply(&answer.bytes);
            if let Some(event) = self.outcome(port, &answer.letters, reply.as_ref()) {
                self.writer.output(at, &Output::Event(event));
            }
            let (framing, data) = match answer.bytes.as_slice() {
                [STX, data @ .., ETX] => (Framing::Stx, data),
                [data @ .., ETX] => (Framing::Bare, data),
                data => (Framing::Bare, data),
            };
            let data = Bytes::copy_from_slice(data);
            self.writer
                .output(at, &Output::Event(Event::TextOut { port, framing, data }));
            if let Some(Reply::Fl(body)) = reply {
                self.status(at, line, &answer.letters, &body);
            }
        }
        self.writer.output(at, &Output::Send { port, bytes });
    }

    /// What the answer says about its command. A command that was served has the mode that a status told before.
    fn outcome(&self, port: Port, letters: &str, reply: Option<&Reply>) -> Option<Event> {
        let row = COMMANDS.iter().find(|row| row.letters == letters)?.letters;
        match reply? {
            Reply::Ng => Some(Event::Refused {
                port,
                command: letters.to_owned(),
                reason: "the robot answered NG".to_owned(),
            }),
            Reply::Ok | Reply::Fl(_) => Some(Event::Answered {
                port,
                row,
                mode: self.mode?,
                verdict: Verdict::Served,
            }),
            Reply::Sp => None,
        }
    }

    fn status(&mut self, at: Time, line: PeerId, letters: &str, body: &[u8]) {
        let new = self.new_peer();
        let peer = self.peers.entry(line).or_insert(new);
        if peer.body.len() + body.len() > MAX_BODY {
            peer.body.clear();
        }
        peer.body.extend_from_slice(body);
        let Some((&EOF, content)) = peer.body.split_last() else {
            return;
        };
        let content = content.to_vec();
        peer.body.clear();
        let told = match letters {
            "SF" => total(&content),
            "SU" => StatusBody::decode(content.strip_suffix(&[CR]).unwrap_or(&content))
                .ok()
                .map(Told::Status),
            _ => None,
        };
        let Some(told) = told else { return };
        let event = self.journal.next_number();
        let place = Place { event, at };
        match &told {
            Told::Total(status, inputs, outputs) => {
                let alarm = alarm_words(status).into_iter().next().unwrap_or_default();
                self.places
                    .lanes
                    .observed(place, &mode_word(status), &alarm, (inputs, outputs));
                let runs = status.execution == ExecutionStatus::Running;
                self.places
                    .lanes
                    .observed_line(place, runs.then_some(status.execution_line));
            }
            Told::Status(status) => self.mode = Some(status.master_mode),
        }
        self.told.push((event, told));
    }
}

/// The total status with the numbers of the lines that are on.
fn total(content: &[u8]) -> Option<Told> {
    let layout = [SfLayout::Eight, SfLayout::Six]
        .into_iter()
        .find(|layout| layout.len() == content.len())?;
    let status = SystemStatus::decode(content, layout).ok()?;
    let text = [&[STX], b"FL,".as_slice(), content, &[EOF, ETX]].concat();
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for field in dissect("SF", &text) {
        let lines = match field.key.as_str() {
            key if key.starts_with("sf.input") => &mut inputs,
            key if key.starts_with("sf.output") => &mut outputs,
            _ => continue,
        };
        let words = field.value.split(|letter: char| !letter.is_ascii_alphanumeric());
        let numbers = words.filter_map(|word| word.strip_prefix("Din").or(word.strip_prefix("Dout")));
        lines.extend(numbers.filter_map(|number| number.parse::<u16>().ok()));
    }
    Some(Told::Total(Box::new(status), inputs, outputs))
}

fn mode_word(status: &SystemStatus) -> String {
    let mode = ["TEACHING", "INTERNAL", "EXT (SIG)", "EXT"];
    let mut words = vec![
        *mode
            .get(usize::from(status.master_mode))
            .unwrap_or(&"unknown mode"),
    ];
    words.extend(status.servo.then_some("servo on"));
    words.extend(status.emergency_stop.then_some("EMERGENCY STOP"));
    words.extend(status.feed_hold.then_some("feed hold"));
    words.join(", ")
}

/// The active alarms as `level-code`, the first also where there is none.
fn alarm_words(status: &SystemStatus) -> Vec<String> {
    let numbers = status.alarms.iter().filter_map(|word| alarm_from_word(*word));
    numbers
        .map(|(level, code)| format!("{}-{code:03}", level.number()))
        .collect()
}

impl Observed {
    /// A controller of the same model, which has seen nothing.
    pub fn template(&self) -> &Controller {
        &self.template
    }

    /// The events after which a status has told something.
    pub fn changes(&self) -> impl Iterator<Item = u64> {
        self.told.iter().map(|(event, _)| *event)
    }

    /// The last SF and the last SU until an event.
    fn last(&self, event: u64) -> (Option<&Told>, Option<&Told>) {
        let until = self.told.partition_point(|(of, _)| *of <= event);
        let told = self.told.get(..until).unwrap_or_default().iter().rev();
        let mut total = told.clone().map(|(_, told)| told);
        let mut status = told.map(|(_, told)| told);
        (
            total.find(|told| matches!(told, Told::Total(..))),
            status.find(|told| matches!(told, Told::Status(_))),
        )
    }

    /// The document of `/state` after an event: what was told by then, over what is the same for every robot.
    pub fn state(&self, entry: Entry, findings: BTreeMap<String, u64>) -> Value {
        let mut state = state_document(&Still(self.template.clone()), findings);
        state["t"] = json!(entry.at.as_seconds());
        let (total, status) = self.last(entry.event);
        let mut unknown = UNKNOWN.to_vec();
        if total.is_none() {
            unknown.extend(OF_TOTAL);
            state["inputs"]["on"] = json!([]);
            state["outputs"]["on"] = json!([]);
        }
        if status.is_none() {
            unknown.extend(OF_STATUS);
        }
        state["unknown"] = json!(unknown);
        if let Some(Told::Status(status)) = status {
            state["master_mode"] = json!(status.master_mode.as_str());
            state["run_mode"] = json!(status.run_mode.as_str());
            state["file"] = json!(status.file);
            state["override_percent"] = json!(status.override_percent);
            state["machine_lock"] = json!(status.machine_lock);
            state["status"] = json!(status.execution.as_str());
        }
        if let Some(Told::Total(status, inputs, outputs)) = total {
            state["servo"] = json!(status.servo);
            state["emergency_stop"] = json!(status.emergency_stop);
            state["feed_hold"] = json!(status.feed_hold);
            state["status"] = json!(status.execution.as_str());
            state["line"] = json!(status.execution_line);
            state["executed_line"] = json!(status.execution_line);
            state["analysed_line"] = json!(status.analysis_line);
            state["power_on_minutes"] = json!(status.power_on_minutes);
            state["run_minutes"] = json!(status.run_minutes);
            state["inputs"]["on"] = json!(inputs);
            state["outputs"]["on"] = json!(outputs);
            let alarms = alarm_words(status);
            state["alarms"] = alarms
                .iter()
                .filter_map(|number| alarm_document(number))
                .collect();
            self.place_arm(&mut state["arm"], status);
        }
        state
    }

    /// The document of `/arm` after an event.
    pub fn arm(&self, event: u64) -> Value {
        let mut arm = arm_document(&Still(self.template.clone()));
        if let (Some(Told::Total(status, ..)), _) = self.last(event) {
            self.place_arm(&mut arm, status);
            arm["tool_point"] = json!(status.world.get(..3));
            arm["path"] = json!([]);
        }
        arm
    }

    fn place_arm(&self, arm: &mut Value, status: &SystemStatus) {
        for (key, values) in [
            ("joints", &status.joint),
            ("world", &status.world),
            ("work", &status.work),
        ] {
            let count = arm[key].as_array().map_or(0, Vec::len);
            arm[key] = values.iter().take(count).map(|value| json!(value)).collect();
        }
        arm["moving"] = json!(false);
        if arm.get("position_file").is_some() {
            arm["position_file"] = json!("");
        }
    }
}
