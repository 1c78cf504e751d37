//! A whole run as one document, from which a page shows every moment without the program: events, states and motions, each as
//! the difference from what came before.
//!
//! The page's side of it is `embedded.js`.

use crate::course::{Courses, Motions};
use crate::key::MomentKey;
use crate::patch::{common, patch};
use crate::run::{Run, RunInfo};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, HashMap};
use ts3100_control::event::NumberedEvent;
use ts3100_control::recorded::{document, state_document};
use ts3100_controller::Time;
use ts3100_driver::driver::request::Still;
use ts3100_proto::escape::hex_byte;
use ts3100_recording::replay::Playback;

/// Values of the state that a motion tells while it is under way.
const OF_MOTION: [&str; 5] = ["joints", "world", "work", "percent", "position_file"];
/// Keys of a finding that its rule tells.
const OF_RULE: [&str; 3] = ["severity", "source", "remedy"];
/// Fewest common bytes for which a piece is told by another one.
const FEWEST_COMMON: usize = 8;

/// The whole run.
#[derive(Serialize)]
pub struct Data<'a> {
    info: RunInfo<'a>,
    /// As of `/trace/lanes`, with items by their distance to the one before; see [`short_lanes`].
    lanes: Value,
    arm: Value,
    /// What the rules of findings say, by their names.
    rules: Map<String, Value>,
    events: Vec<Value>,
    /// `[events, time, patch]`, both since the state before.
    states: Vec<Value>,
    #[serde(flatten)]
    motions: Motions,
    /// `[event, name, text]`; without text it was erased, or is binary.
    files: Vec<Value>,
    /// The bytes of all events that are told by no other ones, in order. They come after the document.
    #[serde(skip)]
    pub bytes: Vec<u8>,
}

/// The run as one document. It has to be complete.
pub fn data(run: &Run) -> Option<Data<'_>> {
    let (mut rules, mut bytes) = (Map::new(), Vec::new());
    let events = events(run, &mut rules, &mut bytes);
    let arm = run.arm(MomentKey::default()).ok()?;
    let (states, motions, files) = match run.start() {
        Some(playback) => states(run, playback),
        None => (observed(run), Motions::default(), Vec::new()),
    };
    Some(Data {
        info: run.info(),
        lanes: short_lanes(run),
        arm,
        rules,
        events,
        states,
        motions,
        files,
        bytes,
    })
}

/// The lanes with items as `[event, t, level, label, end event, end t]`: the event as the distance to that of the item before,
/// times as those since their event, and of a span its end event as the distance to its event. Nearly all are the same.
fn short_lanes(run: &Run) -> Value {
    let times: Vec<i64> = run.events().iter().map(|event| micros(event.t)).collect();
    let since = |event: i64, at: i64| {
        let known = usize::try_from(event - 1).ok().and_then(|place| times.get(place));
        at - known.copied().unwrap_or_default()
    };
    let mut lanes = document(&run.lanes());
    for lane in lanes.as_array_mut().into_iter().flatten() {
        let mut last = 0;
        for item in lane["items"].as_array_mut().into_iter().flatten() {
            let number = |place: usize| item.get(place).and_then(Value::as_i64);
            let (event, at) = (number(0).unwrap_or_default(), number(1).unwrap_or_default());
            let end = number(4).zip(number(5));
            item[0] = json!(event - last);
            item[1] = json!(since(event, at));
            if let Some((end_event, end_at)) = end {
                item[4] = json!(end_event - event);
                item[5] = json!(since(end_event, end_at));
            }
            last = event;
        }
    }
    lanes
}

fn micros(at: Time) -> i64 {
    i64::try_from(at.as_micros()).unwrap_or(i64::MAX)
}

/// The events without their numbers: `d` is the time since the one before, where there is some, and `b` the bytes: how many of
/// the bytes after the document, or by those of the event so many places `back`: `[back, before, after]` has so many others
/// around them, `[back, place, length, 0]` is a part of them, and `[back, begin, end, others, 0]` has so many first and last
/// bytes of them around so many others.
fn events(run: &Run, rules: &mut Map<String, Value>, others: &mut Vec<u8>) -> Vec<Value> {
    let mut last = Time::ZERO;
    // The last piece of each kind on each port, and the last of all.
    let mut pieces: HashMap<String, (usize, Vec<u8>)> = HashMap::new();
    let mut newest: Option<(usize, Vec<u8>)> = None;
    let all = run.events();
    let form = |(place, found): (usize, &NumberedEvent)| {
        let Value::Object(mut event) = document(found) else {
            return Value::Null;
        };
        for key in ["seq", "t", "text", "bytes"] {
            if key != "text" || event.contains_key("hex") {
                event.shift_remove(key);
            }
        }
        if let Some(Value::String(hex)) = event.shift_remove("hex") {
            let bytes = from_hex(&hex);
            let kind = format!(
                "{} {} {}",
                event["event"],
                event.get("port").unwrap_or(&Value::Null),
                bytes.len().min(16)
            );
            let told = newest
                .as_ref()
                .and_then(|(old, piece)| within(place - old, piece, &bytes, others));
            let told = told.or_else(|| {
                let (old, piece) = pieces.get(&kind)?;
                around(place - old, piece, &bytes, others)
            });
            let told = told.unwrap_or_else(|| {
                others.extend_from_slice(&bytes);
                json!(bytes.len())
            });
            event.insert("b".to_owned(), told);
            newest = Some((place, bytes.clone()));
            pieces.insert(kind, (place, bytes));
        }
        if let Some(Value::String(rule)) = event.get("rule").cloned() {
            let known = rules.entry(rule).or_insert_with(|| {
                let told = OF_RULE
                    .iter()
                    .filter_map(|key| Some(((*key).to_owned(), event.get(*key)?.clone())));
                Value::Object(told.collect())
            });
            for key in OF_RULE {
                // A fault that has caused it makes it a note.
                if known.get(key) == event.get(key) {
                    event.shift_remove(key);
                }
            }
        }
        let passed = micros(found.t) - micros(last);
        last = found.t;
        if passed != 0 {
            event.insert("d".to_owned(), json!(passed));
        }
        Value::Object(event)
    };
    all.iter().enumerate().map(form).collect()
}

/// Bytes by the last ones before them: a text is the middle of what came in, and what goes out has a text inside.
fn within(back: usize, old: &[u8], new: &[u8], others: &mut Vec<u8>) -> Option<Value> {
    if new.len() >= old.len() {
        let place = new.windows(old.len().max(1)).position(|part| part == old)?;
        let (before, rest) = new.split_at_checked(place)?;
        let after = rest.get(old.len()..)?;
        others.extend_from_slice(before);
        others.extend_from_slice(after);
        return Some(json!([back, before.len(), after.len()]));
    }
    let place = old.windows(new.len().max(1)).position(|part| part == new)?;
    Some(json!([back, place, new.len(), 0]))
}

/// Bytes by some of their kind that have the same begin and end.
fn around(back: usize, old: &[u8], new: &[u8], others: &mut Vec<u8>) -> Option<Value> {
    let (begin, end) = common(old, new);
    if begin + end < FEWEST_COMMON {
        return None;
    }
    let middle = new.get(begin..new.len() - end)?;
    others.extend_from_slice(middle);
    Some(json!([back, begin, end, middle.len(), 0]))
}

fn from_hex(hex: &str) -> Vec<u8> {
    let digits = hex.as_bytes().chunks(2);
    let byte = |pair: &[u8]| hex_byte(std::str::from_utf8(pair).ok()?);
    digits.filter_map(byte).collect()
}

/// The states of a real robot: each time a status tells something.
fn observed(run: &Run) -> Vec<Value> {
    let (mut last, mut at, mut event, mut states) = (Value::Null, Time::ZERO, 0, Vec::new());
    for next in std::iter::once(0).chain(run.observations()) {
        let time = run.time_of(next);
        let Ok(mut state) = run.state(MomentKey {
            event: Some(next),
            at: None,
        }) else {
            continue;
        };
        without_moment(&mut state);
        if let Some(change) = patch(&last, &state) {
            states.push(json!([next - event, micros(time) - micros(at), change]));
            (last, at, event) = (state, time, next);
        }
    }
    states
}

/// The page knows the moment, and counts the findings among the events.
fn without_moment(state: &mut Value) {
    if let Some(state) = state.as_object_mut() {
        for key in ["t", "time_mode", "findings"] {
            state.shift_remove(key);
        }
    }
}

/// States, motions and files of a run.
fn states(run: &Run, mut playback: Playback) -> (Vec<Value>, Motions, Vec<Value>) {
    let mut writer = StateWriter {
        records: run.records_of_events(),
        events: run.events(),
        taken: 0,
        last: Value::Null,
        at: Time::ZERO,
        event: 0,
        states: Vec::new(),
        courses: Courses::default(),
        drive: BTreeMap::new(),
        files: Vec::new(),
    };
    writer.note(&playback);
    while playback.step().is_some() {
        writer.note(&playback);
    }
    (writer.states, writer.courses.finish(), writer.files)
}

struct StateWriter {
    events: Vec<NumberedEvent>,
    /// Of each, how many records had happened by then.
    records: Vec<u32>,
    /// How many of them have happened.
    taken: usize,
    last: Value,
    /// When the last state was, and after which event.
    at: Time,
    event: u64,
    states: Vec<Value>,
    courses: Courses,
    drive: BTreeMap<String, Vec<u8>>,
    files: Vec<Value>,
}

impl StateWriter {
    fn note(&mut self, playback: &Playback) {
        let moment = playback.moment();
        while let (Some(records), Some(event)) = (self.records.get(self.taken), self.events.get(self.taken))
            && (*records as usize) <= moment.records
            && ((*records as usize) < moment.records || event.t <= moment.at)
        {
            self.taken += 1;
        }
        let event = self.taken as u64;
        let controller = playback.controller();
        let mut state = state_document(&Still(controller.clone()), BTreeMap::new());
        let moves = self.courses.step(event, moment.at, controller);
        without_moment(&mut state);
        if moves && let Some(old) = self.last.get("arm").cloned() {
            for key in OF_MOTION {
                if let Some(value) = old.get(key) {
                    state["arm"][key] = value.clone();
                }
            }
        }
        if let Some(change) = patch(&self.last, &state) {
            let passed = micros(moment.at) - micros(self.at);
            self.states.push(json!([event - self.event, passed, change]));
            (self.last, self.at, self.event) = (state, moment.at, event);
        }
        self.note_files(event, controller);
    }

    fn note_files(&mut self, event: u64, controller: &ts3100_controller::Controller) {
        let is_same = controller.files().eq(self
            .drive
            .iter()
            .map(|(name, content)| (name.as_str(), content.as_slice())));
        if is_same {
            return;
        }
        for (name, content) in controller.files() {
            if self.drive.get(name).map(Vec::as_slice) != Some(content) {
                let text = std::str::from_utf8(content).ok();
                self.files.push(json!([event, name, text]));
            }
        }
        for name in self.drive.keys() {
            if controller.files().all(|(other, _)| other != name) {
                self.files.push(json!([event, name, Value::Null]));
            }
        }
        self.drive = controller
            .files()
            .map(|(name, content)| (name.to_owned(), content.to_vec()))
            .collect();
    }
}
