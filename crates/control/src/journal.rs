//! Keeps what happened for later readers: the last events by number, the findings, the counters and the transcript.
//!
//! The driver writes, the calls of the control interface read. Everything is bounded; the oldest entries are
//! dropped first.

use super::event::{JournalEvent, NumberedEvent};
use super::metrics::Metrics;
use std::collections::BTreeMap;
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;
use ts3100_controller::{Controller, Input, Output, Time};
use ts3100_driver::seat::{Notice, Side, Subscriber};
use ts3100_recording::byte_log::ByteLog;
use ts3100_recording::transcript::{Format, TranscriptBuffer};

/// Most events kept of a robot; the oldest are dropped first.
pub const KEPT_EVENTS: usize = 4_096;
/// Most findings kept; the oldest are dropped first.
pub const KEPT_FINDINGS: usize = 1_024;

/// An event as it is kept: its bytes are beside it in the log.
type Entry = (Time, JournalEvent);

/// The event of an entry with its number and its bytes.
fn numbered(seq: u64, (t, mut event): Entry, bytes: Vec<u8>) -> NumberedEvent {
    if let Some(place) = event.bytes_mut() {
        *place = bytes.into();
    }
    NumberedEvent { seq, t, event }
}

#[derive(Default)]
struct JournalState {
    events: ByteLog<Entry>,
    /// Findings that are no longer among the events, with their numbers.
    findings: ByteLog<(u64, Entry)>,
    /// Findings up to this number are forgotten.
    forgotten: u64,
    /// Number of events since the start, including dropped ones.
    count: u64,
    metrics: Metrics,
}

impl JournalState {
    /// The number of the first event that is kept.
    fn first(&self) -> u64 {
        self.count + 1 - self.events.len() as u64
    }

    fn push(&mut self, kept: usize, at: Time, mut event: JournalEvent) -> u64 {
        let seq = self.first();
        let is_full = self.events.len() >= kept;
        if is_full && let Some((oldest, bytes)) = self.events.first() {
            if seq > self.forgotten && oldest.1.finding().is_some() {
                if self.findings.len() >= kept.min(KEPT_FINDINGS) {
                    self.findings.pop();
                }
                self.findings.push((seq, oldest.clone()), bytes);
            }
            self.events.pop();
        }
        let bytes = event.bytes_mut().map(mem::take).unwrap_or_default();
        self.events.push((at, event), &bytes);
        self.count += 1;
        self.count
    }
}

/// A copy of an entry with its bytes.
fn owned<T: Clone>((entry, bytes): (&T, &[u8])) -> (T, Vec<u8>) {
    (entry.clone(), bytes.to_vec())
}

/// The journal of one robot.
pub struct Journal {
    state: Mutex<JournalState>,
    /// Most events that are kept.
    kept: usize,
    changed: watch::Sender<u64>,
    /// Number of inputs that may have changed the state.
    touched: watch::Sender<u64>,
    transcript: Arc<TranscriptBuffer>,
}

/// Events starting at a number.
#[derive(Debug, Clone, PartialEq)]
pub struct EventBatch {
    /// The events in order.
    pub events: Vec<NumberedEvent>,
    /// Number of requested events that are no longer kept.
    pub missed: u64,
    /// The number to ask for next.
    pub next: u64,
}

impl Journal {
    /// A journal of at most `kept` events that also serves this transcript, which the driver writes.
    pub fn new(kept: usize, transcript: Arc<TranscriptBuffer>) -> Journal {
        Journal {
            state: Mutex::default(),
            kept,
            changed: watch::Sender::new(0),
            touched: watch::Sender::new(0),
            transcript,
        }
    }

    /// The journal as it was when the event of this number was its last.
    #[must_use]
    pub fn as_of(&self, last: u64) -> Journal {
        let past = Journal::new(KEPT_EVENTS, Arc::default());
        let state = self.lock();
        let kept = last
            .min(state.count)
            .saturating_sub(KEPT_EVENTS as u64)
            .max(state.first() - 1);
        let mut begun = JournalState {
            count: kept,
            ..JournalState::default()
        };
        let events = (state.first()..=last).zip(state.events.iter_from(0));
        for (seq, (entry, bytes)) in events {
            if matches!(entry.1, JournalEvent::Reset) {
                begun.findings = ByteLog::default();
                begun.forgotten = seq;
            } else if seq <= kept && entry.1.finding().is_some() {
                begun.findings.push((seq, entry.clone()), bytes);
            }
            if seq > kept {
                begun.events.push(entry.clone(), bytes);
                begun.count += 1;
            }
        }
        drop(state);
        *past.lock() = begun;
        past
    }

    /// The kept transcript in this format, up to the present.
    pub fn transcript(&self, format: Format, now: Time) -> Vec<u8> {
        self.transcript.to_bytes_until(format, now)
    }

    /// The state is consistent between any two statements, so a poisoned lock can be used.
    fn lock(&self) -> MutexGuard<'_, JournalState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push(&self, at: Time, event: JournalEvent, count: impl FnOnce(&mut Metrics)) {
        let mut state = self.lock();
        count(&mut state.metrics);
        let seq = state.push(self.kept, at, event);
        // A reader that comes later begins with what is kept by then.
        if self.changed.receiver_count() > 0 {
            self.changed.send_replace(seq);
        }
    }

    pub(super) fn note(&self, at: Time, event: JournalEvent) {
        self.push(at, event, |_| {});
    }

    /// Returns at most `most` events with numbers from `from` on.
    pub fn events_from(&self, from: u64, most: usize) -> EventBatch {
        let state = self.lock();
        let begin = from.max(1).max(state.first());
        let skipped = usize::try_from(begin - state.first()).unwrap_or(usize::MAX);
        let entries = state.events.iter_from(skipped).take(most);
        let entries: Vec<_> = entries.map(owned).collect();
        drop(state);
        let events = (begin..).zip(entries);
        let events = events.map(|(seq, (entry, bytes))| numbered(seq, entry, bytes));
        let events: Vec<_> = events.collect();
        let next = events.last().map_or(begin, |last| last.seq + 1);
        EventBatch {
            events,
            missed: begin - from.max(1).min(begin),
            next,
        }
    }

    /// The number the next event will have.
    pub fn next_number(&self) -> u64 {
        self.lock().count + 1
    }

    /// A receiver that changes with every event.
    pub fn watch(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// A receiver that changes when the state may have changed.
    pub fn watch_state(&self) -> watch::Receiver<u64> {
        self.touched.subscribe()
    }

    /// Tells those who watch the state that it may have changed.
    pub(super) fn touch(&self) {
        if self.touched.receiver_count() > 0 {
            self.touched.send_modify(|count| *count += 1);
        }
    }

    /// The findings kept with their numbers and bytes, oldest first.
    fn kept_findings(&self) -> Vec<((u64, Entry), Vec<u8>)> {
        let state = self.lock();
        let of_events = (state.first()..).zip(state.events.iter_from(0));
        let of_events =
            of_events.filter(|(seq, (entry, _))| *seq > state.forgotten && entry.1.finding().is_some());
        let of_events = of_events.map(|(seq, (entry, bytes))| ((seq, entry.clone()), bytes.to_vec()));
        let mut findings: Vec<_> = state.findings.iter_from(0).map(owned).chain(of_events).collect();
        let surplus = findings.len().saturating_sub(self.kept.min(KEPT_FINDINGS));
        findings.drain(..surplus);
        findings
    }

    fn forget_findings(&self) {
        let mut state = self.lock();
        state.findings = ByteLog::default();
        state.forgotten = state.count;
    }

    /// The findings kept, oldest first.
    pub fn findings(&self) -> Vec<NumberedEvent> {
        let findings = self.kept_findings().into_iter();
        findings
            .map(|((seq, entry), bytes)| numbered(seq, entry, bytes))
            .collect()
    }

    /// Number of times that hosts broke each rule, of the findings kept.
    pub fn findings_by_rule(&self) -> BTreeMap<String, u64> {
        let mut counts = BTreeMap::new();
        let findings = self.kept_findings().into_iter();
        for ((_, (_, event)), _) in findings {
            if let Some(finding) = event.finding().filter(|finding| finding.caused_by.is_none()) {
                *counts.entry(finding.rule.id.to_owned()).or_default() += 1;
            }
        }
        counts
    }

    /// The counters as they are now.
    pub fn metrics(&self) -> Metrics {
        self.lock().metrics.clone()
    }
}

/// Writes the journal of a controller.
pub struct JournalWriter {
    journal: Arc<Journal>,
    /// When the controller does something by itself.
    deadline: Option<Time>,
    /// Whether the input under way is more than the passing of time.
    is_action: bool,
}

impl JournalWriter {
    pub fn new(journal: Arc<Journal>) -> JournalWriter {
        JournalWriter {
            journal,
            deadline: None,
            is_action: false,
        }
    }
}

impl Subscriber for JournalWriter {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        // Every query lets time pass: that alone is no change, unless something was due.
        self.is_action |= !matches!(input, Input::Tick) || self.deadline.is_some_and(|due| due <= at);
        if let Some(event) = JournalEvent::from_input(input) {
            self.journal.push(at, event, |metrics| metrics.count_input(input));
        }
    }

    fn output(&mut self, at: Time, output: &Output) {
        let event = JournalEvent::from(output);
        let at = event.finding().map_or(at, |finding| finding.at);
        self.journal
            .push(at, event, |metrics| metrics.count_output(output));
    }

    fn settled(&mut self, _at: Time, controller: &Controller) {
        let watched = self.journal.touched.receiver_count() > 0;
        self.deadline = controller.poll_deadline().filter(|_| watched);
        if mem::take(&mut self.is_action) {
            self.journal.touch();
        }
    }

    fn notice(&mut self, _at: Time, notice: Notice<'_>) {
        self.journal.touch();
        match notice {
            Notice::Restored(next) => self.journal.note(next.now(), JournalEvent::Restored),
            Notice::Reset { .. } => {
                // Events and counters go on.
                self.journal.forget_findings();
                self.journal.note(Time::ZERO, JournalEvent::Reset);
            }
            Notice::Dropped(_) | Notice::NotPersisted { .. } | Notice::TimedFindings(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::{Config, Controller, Dialect, Port};

    fn journal() -> Arc<Journal> {
        Arc::new(Journal::new(KEPT_EVENTS, Arc::default()))
    }

    #[test]
    fn passing_time_is_no_change_of_the_state() {
        let journal = journal();
        let mut seat =
            ts3100_driver::seat::Seat::new(Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap());
        seat.subscribe(Box::new(JournalWriter::new(Arc::clone(&journal))));
        let mut watch = journal.watch_state();
        let second = Time::ZERO + std::time::Duration::from_secs(1);
        seat.feed(second, Input::Tick, Side::Host, &mut ()).unwrap();
        assert!(!watch.has_changed().unwrap());
        let port = Port::Ip0;
        let peer = String::from("test");
        seat.feed(second, Input::Connected { port, peer }, Side::Host, &mut ())
            .unwrap();
        assert!(watch.has_changed().unwrap());
        watch.borrow_and_update();
        seat.feed(second, Input::Tick, Side::Host, &mut ()).unwrap();
        assert!(!watch.has_changed().unwrap());
    }

    #[test]
    fn what_is_forgotten_is_counted() {
        let journal = journal();
        assert_eq!(journal.events_from(1, 10).next, 1);
        for _ in 0..KEPT_EVENTS + 3 {
            JournalWriter::new(Arc::clone(&journal)).output(Time::ZERO, &Output::PowerOff);
        }
        let extract = journal.events_from(2, 2);
        assert_eq!((extract.missed, extract.next), (2, 6));
        assert_eq!(extract.events[0].seq, 4);
        let rest = journal.events_from(extract.next, usize::MAX);
        assert_eq!(
            (rest.missed, rest.events.len(), rest.next),
            (0, KEPT_EVENTS - 2, journal.next_number())
        );
        let ahead = journal.events_from(1_000_000, 5);
        assert_eq!((ahead.events.len(), ahead.missed, ahead.next), (0, 0, 1_000_000));
    }

    #[test]
    fn findings_stay_longer_than_other_events_until_a_reset() {
        let journal = journal();
        let mut writer = JournalWriter::new(Arc::clone(&journal));
        let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        robot.feed(
            Time::ZERO,
            Input::Connected {
                port: Port::Ip0,
                peer: "host".into(),
            },
        );
        // Each has a finding, the missing CR.
        let mut hasty = |writer: &mut JournalWriter, count: usize| {
            for _ in 0..count {
                let outputs = robot.feed(Time::ZERO, Input::received(Port::Ip0, b"\x02SU\x03".to_vec()));
                outputs
                    .iter()
                    .for_each(|output| writer.output(Time::ZERO, output));
            }
        };
        hasty(&mut writer, 1);
        let first = journal.findings();
        assert!(!first.is_empty());
        for _ in 0..KEPT_EVENTS {
            writer.output(Time::ZERO, &Output::PowerOff);
        }
        assert_eq!(journal.findings(), first, "no longer among the events");
        hasty(&mut writer, KEPT_FINDINGS + 1);
        assert_eq!(journal.findings().len(), KEPT_FINDINGS);
        let by_rule = journal.findings_by_rule();
        assert_eq!(by_rule.values().sum::<u64>(), KEPT_FINDINGS as u64);
        assert!(journal.findings().is_sorted_by_key(|finding| finding.seq));
        let (controller, calendar) = (
            &Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap(),
            None,
        );
        writer.notice(Time::ZERO, Notice::Reset { controller, calendar });
        assert_eq!(journal.findings(), []);
        // The events of before the reset are kept, their findings stay forgotten when they leave.
        for _ in 0..KEPT_EVENTS {
            writer.output(Time::ZERO, &Output::PowerOff);
        }
        assert_eq!(journal.findings().len(), 0);
        hasty(&mut writer, 1);
        assert!(!journal.findings().is_empty());
    }
}
