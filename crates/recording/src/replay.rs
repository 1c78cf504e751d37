//! A recorded run of the emulator, played again to any moment of it, forwards and backwards.
//!
//! The transcript is the only truth: a moment is had by playing from the start, or from the nearest [`Keyframes`], a copy of
//! the run on its way. The core is deterministic, so each way leads to the same state, byte for byte. What a recording of a
//! real robot says is not known here.
//!
//! Start with [`Playback`].

use crate::player::{Candidate, Player, Sent};
use crate::transcript::{PeerId, RecordKind, Recording};
use std::fmt;
use std::sync::Arc;
use ts3100_controller::inspection::Inspection;
use ts3100_controller::{Bytes, Controller, Time, Watched};
use ts3100_driver::seat::Subscriber;
use ts3100_proto::escape::Escaped;

/// Most copies of a run. Where more would be made, every second is dropped and they are made half as often.
pub const MAX_KEYFRAMES: usize = 512;
/// Steps between two copies at first.
pub const KEYFRAME_STEPS: u64 = 64;

/// A moment of a recording: this many of its records have happened, and it is this late. Time alone does not tell a moment,
/// because much happens at one time, and a reset begins another count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment {
    /// Records that have happened.
    pub records: usize,
    /// Virtual time, not before that of the last of them.
    pub at: Time,
}

/// A run on its way through its recording. A copy has no subscribers.
#[derive(Clone)]
pub struct Playback {
    recording: Arc<Recording>,
    player: Player,
    /// Records that have been played.
    records: usize,
    /// Deadlines and records that have been played.
    steps: u64,
}

impl Playback {
    /// At the start of a recording, with the emulator that its header describes.
    pub fn new(recording: Arc<Recording>, candidate: Candidate) -> Playback {
        let player = Player::new(candidate, &recording);
        Playback {
            recording,
            player,
            records: 0,
            steps: 0,
        }
    }

    /// Adds a subscriber, which sees everything from now on.
    pub fn subscribe(&mut self, subscriber: Box<dyn Subscriber>) {
        self.player.subscribe(subscriber);
    }

    /// Tells the subscribers every statement from now on, with the value of what is watched.
    pub fn watch(&mut self, watched: Option<&Watched>) {
        self.player.watch(watched);
    }

    /// Looks at every statement from now on; a run that an inspection has halted is for looking only.
    pub fn inspect(&mut self, inspection: Inspection) {
        self.player.inspect(inspection);
    }

    /// Takes what has looked at the statements.
    pub fn take_inspection(&mut self) -> Option<Inspection> {
        self.player.take_inspection()
    }

    /// The controller as it is now.
    pub fn controller(&self) -> &Controller {
        self.player.controller()
    }

    /// The present moment.
    pub fn moment(&self) -> Moment {
        let (records, at) = (self.records, self.player.now());
        Moment { records, at }
    }

    /// How many deadlines and records have been played since the start of the recording.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Plays the next thing that happens: something that is due, or a record. Returns the place of the record, and
    /// [`None`] at the end of the recording.
    pub fn step(&mut self) -> Option<Step> {
        let record = self.recording.records.get(self.records)?;
        self.steps += 1;
        self.player.forget_events();
        if let Some(due) = self.player.deadline().filter(|due| *due <= record.at) {
            self.player.advance_to(due);
            return Some(Step::Due);
        }
        let place = self.records;
        self.player.advance_to(record.at);
        self.player.play(&record.kind);
        self.records += 1;
        Some(Step::Record(place))
    }

    /// Plays until a moment, which is not before the present one.
    pub fn play_to(&mut self, moment: Moment) {
        while self.records < moment.records && self.step().is_some() {}
        while let Some(due) = self.player.deadline().filter(|due| *due <= moment.at) {
            self.steps += 1;
            self.player.forget_events();
            self.player.advance_to(due);
        }
        self.player.stand_at(moment.at);
    }
}

/// The last thing that a run has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Something that was due.
    Due,
    /// The record at this place.
    Record(usize),
}

/// Copies of a run on its way.
pub struct Keyframes<R> {
    /// In order, the first at the start, each with the number of steps before it.
    frames: Vec<(u64, R)>,
    /// Steps between two of them.
    interval: u64,
}

impl<R: Clone> Keyframes<R> {
    /// The start of a run alone.
    pub fn new(start: R) -> Keyframes<R> {
        Keyframes {
            frames: vec![(0, start)],
            interval: KEYFRAME_STEPS,
        }
    }

    /// Keeps a copy of a run that has taken this number of steps, if it is time for one.
    pub fn note(&mut self, steps: u64, run: &R) {
        let last = self.frames.last().map_or(0, |(steps, _)| *steps);
        if steps < last + self.interval {
            return;
        }
        self.frames.push((steps, run.clone()));
        if self.frames.len() > MAX_KEYFRAMES {
            let mut place = 0;
            self.frames.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.interval *= 2;
        }
    }

    /// The last copy for which this holds, as it does for all before it, with its steps.
    pub fn last(&self, holds: impl Fn(&R) -> bool) -> Option<(u64, &R)> {
        let after = self.frames.partition_point(|(_, frame)| holds(frame));
        let (steps, frame) = self.frames.get(after.checked_sub(1)?)?;
        Some((*steps, frame))
    }

    /// Forgets the copies after this number of steps: the run continues another way.
    pub fn forget_after(&mut self, steps: u64) {
        self.frames.retain(|(of, _)| *of <= steps);
    }

    /// Steps between two copies: a moment takes no more, as far as the run has been noted.
    pub fn interval(&self) -> u64 {
        self.interval
    }
}

impl Keyframes<Playback> {
    /// The last copy that is not after a moment: from there it is played.
    pub fn near(&self, moment: Moment) -> Option<Playback> {
        self.last(|frame| frame.moment() <= moment)
            .map(|(_, frame)| frame.clone())
    }
}

/// Where a recording does not come out again as it was: then it is of another version of the emulator, or was changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Departure {
    /// Line of the file, or its end.
    pub file_line: Option<usize>,
    pub at: Time,
    /// The recorded bytes; none where the run sends more than the recording has.
    pub recorded: Option<(PeerId, Bytes)>,
    /// The bytes that the run has sent; none where it has sent nothing.
    pub replayed: Option<(PeerId, Bytes)>,
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.file_line {
            Some(line) => write!(f, "line {line}")?,
            None => f.write_str("after the last line")?,
        }
        let side = |side: &Option<(PeerId, Bytes)>| match side {
            Some((line, bytes)) => format!("{line} {}", Escaped::for_reading(bytes)),
            None => "nothing".to_owned(),
        };
        let (recorded, replayed) = (side(&self.recorded), side(&self.replayed));
        write!(f, ", at {} s: recorded {recorded}; replayed {replayed}", self.at)
    }
}

/// Compares the bytes that a run sends with those of its recording, each piece at its time.
pub struct Comparison {
    recording: Arc<Recording>,
    /// Place of the next record that is not compared yet.
    next: usize,
    departure: Option<Departure>,
}

impl Comparison {
    /// Compares a run from its start.
    pub fn new(run: &mut Playback) -> Comparison {
        run.player.keep_sent();
        Comparison {
            recording: Arc::clone(&run.recording),
            next: 0,
            departure: None,
        }
    }

    /// Compares what the run has sent since the last call. Call it after each step.
    pub fn note(&mut self, run: &mut Playback) {
        for sent in run.player.take_sent() {
            self.compare(&sent);
        }
        // A record of bytes that was passed has to have been sent.
        if let Some((place, at, recorded)) = self.next_recorded()
            && place < run.records
        {
            self.depart(Departure {
                file_line: self.recording.lines.get(place).copied(),
                at,
                recorded: Some(recorded),
                replayed: None,
            });
        }
    }

    /// The first place where the run was another.
    pub fn departure(&self) -> Option<&Departure> {
        self.departure.as_ref()
    }

    fn compare(&mut self, sent: &Sent) {
        let next = self.next_recorded();
        let replayed = (sent.line, sent.bytes.clone());
        if let Some((place, at, recorded)) = &next
            && *at == sent.at
            && *recorded == replayed
        {
            self.next = place + 1;
            return;
        }
        let place = next.as_ref().map(|(place, ..)| *place);
        self.depart(Departure {
            file_line: place.and_then(|place| self.recording.lines.get(place).copied()),
            at: sent.at,
            recorded: next.map(|(.., recorded)| recorded),
            replayed: Some(replayed),
        });
    }

    /// The next bytes of the controller in the recording: place, time, line and bytes.
    fn next_recorded(&mut self) -> Option<(usize, Time, (PeerId, Bytes))> {
        if self.departure.is_some() {
            return None;
        }
        loop {
            let record = self.recording.records.get(self.next)?;
            if let RecordKind::FromRobot { line, bytes } = &record.kind {
                return Some((self.next, record.at, (*line, bytes.clone())));
            }
            self.next += 1;
        }
    }

    fn depart(&mut self, departure: Departure) {
        self.departure.get_or_insert(departure);
    }
}
