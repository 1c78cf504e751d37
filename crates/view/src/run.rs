//! A recorded run that is open: its events by number, its moments, its lanes.
//!
//! It can be used at once; [`Opening`] plays it meanwhile from its start, and makes the copies from which a moment is near.

use crate::key::{KeyError, MomentKey, short_seconds};
use crate::lanes::{Lanes, Place};
use crate::robot::{self, Observed};
use crate::why::{Answer, Answers, Question};
use serde::Serialize;
use serde_json::Value;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Semaphore;
use ts3100_control::DriverHandle;
use ts3100_control::event::NumberedEvent;
use ts3100_control::journal::{Journal, JournalWriter};
use ts3100_control::recorded::{NoMoment, arm_document, state_document};
use ts3100_controller::{Controller, Time};
use ts3100_driver::driver::request::Still;
use ts3100_recording::diff::Candidate;
use ts3100_recording::replay::{Comparison, Departure, Keyframes, Moment, Playback, Step};
use ts3100_recording::transcript::{self, Header, RecordKind, Recording};

/// Most events of a run that are kept; the oldest are forgotten first.
pub const MAX_EVENTS: usize = 2_000_000;
/// Streams of events at a time.
const MAX_STREAMS: usize = 32;
/// Steps that are played between two looks at who waits.
const PORTION: usize = 256;

/// A recorded run.
pub struct Run {
    name: String,
    recording: Arc<Recording>,
    journal: Arc<Journal>,
    streams: Arc<Semaphore>,
    epochs: Vec<Epoch>,
    opened: Mutex<Opened>,
    answers: Answers,
}

/// A moment by its last event and its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    pub event: u64,
    pub at: Time,
}

/// Where a moment comes from.
enum Source {
    /// The recording is played to an emulator.
    Emulator(Keyframes<Playback>),
    /// A real robot was recorded.
    Robot(Box<Observed>),
}

/// What opening has found so far.
struct Opened {
    source: Source,
    places: Places,
    departure: Option<Departure>,
    complete: bool,
    /// The most steps that a moment took.
    most_steps: u64,
}

/// The places of events and records among each other, and the lanes.
#[derive(Default)]
pub(crate) struct Places {
    /// Of each event, how many records had happened by then.
    pub(crate) records_of: Vec<u32>,
    /// Of each record that was played, the number of the last event by then.
    pub(crate) event_of: Vec<u64>,
    pub(crate) lanes: Lanes,
}

/// A part of a run in which time continues: a reset or a restored snapshot begins another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Epoch {
    /// Records before it.
    #[serde(skip)]
    pub records: usize,
    /// The number of its first event.
    pub event: u64,
    /// Virtual time at its beginning.
    pub begins: Time,
    /// Virtual time at its end.
    pub ends: Time,
}

/// What there is to say about a run as a whole.
#[derive(Debug, Clone, Serialize)]
pub struct RunInfo<'a> {
    /// Name of the file.
    name: &'a str,
    /// Who has recorded it.
    origin: &'a str,
    /// `emulator`: every moment is known. `robot`: what its traffic tells is known.
    kind: &'static str,
    /// Keys of the state that are not known.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    unknown: &'static [&'static str],
    /// Number of events so far.
    events: u64,
    /// Whether the timeline is whole.
    complete: bool,
    /// Records that were played, and how many there are.
    played: usize,
    records: usize,
    epochs: Vec<Epoch>,
    /// Where the recording does not come out again as it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    departure: Option<String>,
}

impl Run {
    /// Opens a recording with the emulator that it describes. Play the second part to its end, in a thread of its own.
    pub fn open(name: &str, recording: Recording, candidate: Candidate) -> (Arc<Run>, Opening) {
        let recording = Arc::new(recording);
        let mut playback = Playback::new(Arc::clone(&recording), candidate);
        let keyframes = Keyframes::new(playback.clone());
        let journal = Arc::new(Journal::new(MAX_EVENTS, Arc::default()));
        playback.subscribe(Box::new(JournalWriter::new(Arc::clone(&journal))));
        let comparison = Comparison::new(&mut playback);
        let source = Source::Emulator(keyframes);
        let run = Run::new(name, recording, journal, source, Places::default());
        let opening = Opening {
            run: Arc::clone(&run),
            playback,
            comparison,
        };
        (run, opening)
    }

    /// Opens a recording of a real robot. `template` is a controller of the same model.
    pub fn open_robot(name: &str, recording: Recording, template: Controller) -> Arc<Run> {
        let journal = Arc::new(Journal::new(MAX_EVENTS, Arc::default()));
        let (observed, places) = robot::observe(&recording, template, &journal);
        let source = Source::Robot(Box::new(observed));
        Run::new(name, Arc::new(recording), journal, source, places)
    }

    fn new(
        name: &str,
        recording: Arc<Recording>,
        journal: Arc<Journal>,
        source: Source,
        places: Places,
    ) -> Arc<Run> {
        Arc::new(Run {
            name: name.to_owned(),
            epochs: epochs(&recording),
            recording,
            journal,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
            opened: Mutex::new(Opened {
                complete: matches!(source, Source::Robot(_)),
                source,
                places,
                departure: None,
                most_steps: 0,
            }),
            answers: Answers::default(),
        })
    }

    /// Whether a real robot was recorded, of which only the traffic is known.
    pub fn is_of_robot(&self) -> bool {
        matches!(self.opened().source, Source::Robot(_))
    }

    /// The state is consistent between any two statements, so a poisoned lock can be used.
    fn opened(&self) -> MutexGuard<'_, Opened> {
        self.opened.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The events, the findings among them, by number.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The state before the first record, as the recording says it.
    pub fn header(&self) -> &Header {
        &self.recording.header
    }

    /// The lanes so far.
    pub fn lanes(&self) -> Lanes {
        self.opened().places.lanes.clone()
    }

    /// The most steps from a copy to a moment, in the part that has been played.
    pub fn keyframe_interval(&self) -> u64 {
        match &self.opened().source {
            Source::Emulator(keyframes) => keyframes.interval(),
            Source::Robot(_) => 0,
        }
    }

    /// The most steps that a moment took so far.
    pub fn most_steps(&self) -> u64 {
        self.opened().most_steps
    }

    /// Where the recording does not come out again as it was.
    pub fn departure(&self) -> Option<Departure> {
        self.opened().departure.clone()
    }

    /// Whether all of it has been played.
    pub fn is_complete(&self) -> bool {
        self.opened().complete
    }

    /// The answer to a question about the whole run; it takes as long as playing all of it.
    pub fn ask(&self, question: &Question) -> Arc<Answer> {
        self.answers.get(self, question)
    }

    /// What there is to say about the run as a whole.
    pub fn info(&self) -> RunInfo<'_> {
        let opened = self.opened();
        let played = opened.places.event_of.len();
        let mut epochs = self.epochs.clone();
        for epoch in &mut epochs {
            let before = epoch
                .records
                .checked_sub(1)
                .map(|last| opened.places.event_of.get(last));
            epoch.event = before.map_or(1, |before| before.map_or(0, |event| event + 1));
        }
        // Those that have not been played are not known yet.
        epochs.retain(|epoch| epoch.event > 0);
        RunInfo {
            name: &self.name,
            origin: &self.recording.header.origin,
            kind: match opened.source {
                Source::Emulator(_) => "emulator",
                Source::Robot(_) => "robot",
            },
            unknown: match opened.source {
                Source::Emulator(_) => &[],
                Source::Robot(_) => &robot::UNKNOWN,
            },
            events: self.journal.next_number() - 1,
            complete: opened.complete,
            played,
            records: self.recording.records.len(),
            epochs,
            departure: opened.departure.as_ref().map(ToString::to_string),
        }
    }

    /// The last moment of the recording.
    pub fn end(&self) -> Moment {
        let records = self.recording.records.len();
        let at = self.epochs.last().map_or(Time::ZERO, |epoch| epoch.ends);
        Moment { records, at }
    }

    /// The moment that a key names.
    ///
    /// # Errors
    /// There is no such event.
    pub fn moment(&self, key: MomentKey) -> Result<Moment, NoMoment> {
        let MomentKey { event, at } = key;
        let Some(event) = event.filter(|event| *event > 0) else {
            return Ok(self.moment_at(at.unwrap_or(Time::ZERO)));
        };
        let place = usize::try_from(event - 1).unwrap_or(usize::MAX);
        let opened = self.opened();
        let Some(records) = opened.places.records_of.get(place) else {
            let known = opened.places.records_of.len();
            let more = if opened.complete { "" } else { " so far" };
            return Err(NoMoment(format!(
                "event {event}: the run has {known} events{more}"
            )));
        };
        let mut records = *records as usize;
        let begun = self.time_of(event);
        let mut at = at.unwrap_or(begun).min(self.ends(records)).max(begun);
        // What has happened since without an event belongs to it; what has one ends it.
        while let Some(record) = self.recording.records.get(records) {
            let is_silent = opened
                .places
                .event_of
                .get(records)
                .is_some_and(|last| *last <= event);
            if record.at > at {
                break;
            }
            if !is_silent || record.kind.new_time().is_some() {
                at = at.min(record.at);
                break;
            }
            records += 1;
        }
        Ok(Moment { records, at })
    }

    /// When the part of the run ends in which so many records have happened.
    fn ends(&self, records: usize) -> Time {
        let after = self.epochs.partition_point(|epoch| epoch.records <= records);
        let epoch = after.checked_sub(1).and_then(|place| self.epochs.get(place));
        epoch.map_or(Time::ZERO, |epoch| epoch.ends)
    }

    /// The moment at this time, in the first part of the run that has it.
    fn moment_at(&self, at: Time) -> Moment {
        let has = |epoch: &&Epoch| epoch.begins <= at && at <= epoch.ends;
        let epoch = self.epochs.iter().find(has).or(self.epochs.last());
        let Some(epoch) = epoch else {
            return Moment {
                records: 0,
                at: Time::ZERO,
            };
        };
        let at = at.max(epoch.begins).min(epoch.ends);
        let rest = self.recording.records.iter().skip(epoch.records);
        let passed = rest.take_while(|record| record.at <= at);
        let mut records = epoch.records;
        for record in passed {
            if record.kind.new_time().is_some() {
                break;
            }
            records += 1;
        }
        Moment { records, at }
    }

    /// The run at a moment, and the number of the last event by then; `None` of a real robot.
    pub fn seek(&self, moment: Moment) -> Option<(Playback, u64)> {
        let mut playback = match &self.opened().source {
            Source::Emulator(keyframes) => keyframes.near(moment)?,
            Source::Robot(_) => return None,
        };
        let before = playback.steps();
        playback.play_to(moment);
        let steps = playback.steps() - before;
        let mut opened = self.opened();
        opened.most_steps = opened.most_steps.max(steps);
        let last = self.last_event(&opened, playback.moment());
        Some((playback, last))
    }

    /// Of each event, how many records had happened by then.
    pub(crate) fn records_of_events(&self) -> Vec<u32> {
        self.opened().places.records_of.clone()
    }

    /// The run at its start; `None` of a real robot.
    pub(crate) fn start(&self) -> Option<Playback> {
        let (records, at) = (0, Time::ZERO);
        match &self.opened().source {
            Source::Emulator(keyframes) => keyframes.near(Moment { records, at }),
            Source::Robot(_) => None,
        }
    }

    /// The events after which the traffic of a real robot tells something.
    pub(crate) fn observations(&self) -> Vec<u64> {
        match &self.opened().source {
            Source::Emulator(_) => Vec::new(),
            Source::Robot(observed) => observed.changes().collect(),
        }
    }

    pub(crate) fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Every event so far.
    pub fn events(&self) -> Vec<NumberedEvent> {
        self.journal.events_from(1, usize::MAX).events
    }

    /// Virtual time of an event; that of the start where there is none of this number.
    pub(crate) fn time_of(&self, event: u64) -> Time {
        let found = self.journal.events_from(event, 1).events;
        found.first().map_or(Time::ZERO, |found| found.t)
    }

    /// The number of the last event that had happened at a moment.
    pub(crate) fn event_at(&self, moment: Moment) -> u64 {
        self.last_event(&self.opened(), moment)
    }

    /// The number of the last event that had happened at each of these moments.
    pub(crate) fn events_at(&self, moments: impl Iterator<Item = Moment>) -> Vec<u64> {
        let opened = self.opened();
        moments.map(|moment| self.last_event(&opened, moment)).collect()
    }

    /// The number of the last event that had happened at a moment.
    fn last_event(&self, opened: &Opened, moment: Moment) -> u64 {
        let after = opened
            .places
            .records_of
            .partition_point(|records| *records as usize <= moment.records);
        // Of those without a record in between, the ones that were due by then.
        let first = opened
            .places
            .records_of
            .partition_point(|records| (*records as usize) < moment.records);
        let count = after - first;
        let events = self.journal.events_from(first as u64 + 1, count).events;
        let due = events.iter().filter(|event| event.t <= moment.at).count();
        (first + due) as u64
    }

    /// The document of `/state` at a moment.
    ///
    /// # Errors
    /// There is no such moment.
    pub fn state(&self, key: MomentKey) -> Result<Value, NoMoment> {
        let (still, entry) = self.still(key)?;
        let findings = self.journal.as_of(entry.event).findings_by_rule();
        Ok(match &self.opened().source {
            Source::Emulator(_) => state_document(&still, findings),
            Source::Robot(observed) => observed.state(entry, findings),
        })
    }

    /// The document of `/arm` at a moment.
    ///
    /// # Errors
    /// There is no such moment.
    pub fn arm(&self, key: MomentKey) -> Result<Value, NoMoment> {
        let (still, entry) = self.still(key)?;
        Ok(match &self.opened().source {
            Source::Emulator(_) => arm_document(&still),
            Source::Robot(observed) => observed.arm(entry.event),
        })
    }

    /// The controller at a moment, of a real robot one of its model, and the last event by then.
    fn still(&self, key: MomentKey) -> Result<(Still, Entry), NoMoment> {
        let moment = self.moment(key)?;
        let opened = self.opened();
        if let Source::Robot(observed) = &opened.source {
            let last = self.last_event(&opened, moment);
            let event = key.event.unwrap_or(last);
            let still = Still(observed.template().clone());
            return Ok((still, Entry { event, at: moment.at }));
        }
        drop(opened);
        let found = self.seek(moment);
        let (playback, event) = found.ok_or_else(|| NoMoment("the run has no beginning".to_owned()))?;
        let still = Still(playback.controller().clone());
        Ok((still, Entry { event, at: moment.at }))
    }

    /// A moment in the address of the page: `t=12.4&e=118`.
    ///
    /// # Errors
    /// There is no such moment.
    pub fn fragment(&self, key: MomentKey) -> Result<String, NoMoment> {
        let moment = self.moment(key)?;
        let event = self.event_at(moment);
        Ok(format!("t={}&e={event}", short_seconds(moment.at)))
    }

    /// The way to a moment for the calls of the control interface; without a key the end.
    ///
    /// # Errors
    /// There is no such moment.
    pub fn handle(&self, key: Option<&str>) -> Result<DriverHandle, NoMoment> {
        let key = match key.map(str::parse) {
            Some(Ok(key)) => key,
            Some(Err(error)) => return Err(NoMoment(KeyError::to_string(&error))),
            None => self.last_key(),
        };
        let (still, entry) = self.still(key)?;
        let journal = Arc::new(self.journal.as_of(entry.event));
        Ok(DriverHandle::recorded(still, journal, Arc::clone(&self.streams)))
    }

    /// The end of the run so far.
    fn last_key(&self) -> MomentKey {
        let event = self.journal.next_number() - 1;
        let at = Some(self.end().at);
        MomentKey {
            event: Some(event),
            at,
        }
    }
}

/// Plays a run from its start to its end.
pub struct Opening {
    run: Arc<Run>,
    playback: Playback,
    comparison: Comparison,
}

impl Opening {
    /// Plays a portion; whether there is more.
    pub fn advance(&mut self) -> bool {
        let run = Arc::clone(&self.run);
        let mut opened = run.opened();
        if opened.places.event_of.is_empty() && self.playback.steps() == 0 {
            self.note(&mut opened, None);
        }
        for _ in 0..PORTION {
            let Some(step) = self.playback.step() else {
                opened.complete = true;
                break;
            };
            self.note(&mut opened, Some(step));
            if let Source::Emulator(keyframes) = &mut opened.source {
                keyframes.note(self.playback.steps(), &self.playback);
            }
        }
        !opened.complete
    }

    /// Plays all of it.
    pub fn finish(mut self) {
        while self.advance() {}
    }

    fn note(&mut self, opened: &mut Opened, step: Option<Step>) {
        let moment = self.playback.moment();
        let known = opened.places.records_of.len() as u64;
        let records = u32::try_from(moment.records).unwrap_or(u32::MAX);
        for found in self.run.journal.events_from(known + 1, usize::MAX).events {
            opened.places.records_of.push(records);
            let place = Place {
                event: found.seq,
                at: found.t,
            };
            opened.places.lanes.event(place, &found.event);
        }
        let event = opened.places.records_of.len() as u64;
        let place = Place { event, at: moment.at };
        if let Some(Step::Record(record)) = step {
            opened.places.event_of.push(event);
            if let Some(RecordKind::Action(action)) =
                self.run.recording.records.get(record).map(|record| &record.kind)
            {
                opened.places.lanes.action(place, &action.to_string());
            }
        }
        opened.places.lanes.state(place, self.playback.controller());
        self.comparison.note(&mut self.playback);
        opened.departure = opened
            .departure
            .take()
            .or_else(|| self.comparison.departure().cloned());
    }
}

/// The parts of a recording in which time continues. One that begins in the middle has its first record before them.
fn epochs(recording: &Recording) -> Vec<Epoch> {
    let parts = recording.epochs().filter(|part| {
        let [only] = part.records else { return true };
        part.first > 0 || only.kind.new_time().is_none()
    });
    let epoch = |part: transcript::Epoch<'_>| Epoch {
        records: part.first,
        event: 0,
        begins: part.begins_at,
        ends: part
            .records
            .last()
            .map_or(part.begins_at, |last| last.at.max(part.begins_at)),
    };
    let mut epochs: Vec<Epoch> = parts.map(epoch).collect();
    // Nothing follows the last one.
    if let Some(begins) = recording.records.last().and_then(|record| record.kind.new_time()) {
        epochs.push(Epoch {
            records: recording.records.len(),
            event: 0,
            begins,
            ends: begins,
        });
    }
    epochs
}
