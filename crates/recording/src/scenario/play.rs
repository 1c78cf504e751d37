//! Runs a scenario: which conditions have occurred, which actions are due, and the verdicts of the expectations.
//!
//! It observes every input and output of the driver. Time is virtual, so the same run gives the same results. When a
//! snapshot or a reset replaces the controller, the controller's time jumps while the scenario's time continues.

use super::action::ScenarioAction;
use super::progress::{EntryProgress, EntryState, ScenarioProgress};
use super::results::{EntryResult as Entry, ScenarioOutcome, Verdict};
use super::{Expectation, ExpectationKind, Scenario, Step, StepTrigger};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tracing::info;
use ts3100_controller::{Condition, ConditionWatch, Controller, Input, Output, Time};
use ts3100_driver::seat::{ActionSource, Notice, PlannedAction, Seat, Side, Subscriber};

/// Most scheduled actions: a bound for a frequent condition with a long `after`.
const MAX_SCHEDULED: usize = 10_000;

/// Most actions at one virtual time: steps that trigger each other would never end.
const MAX_ACTIONS_AT_TIME: u32 = 1_000;

/// Progress of a step.
#[derive(Debug, Clone)]
struct StepState {
    step: Step,
    /// The condition that it waits for; none of a step at a time after the start.
    condition: Option<ConditionWatch>,
    runs: u32,
    /// When it is done for the last of them.
    last_due: Option<Time>,
    /// It has been done at least once.
    is_done: bool,
}

/// An action that is to be done.
#[derive(Debug, Clone)]
struct Scheduled {
    due: Time,
    action: ScenarioAction,
    /// Index of its step; none of an action of the start.
    step: Option<usize>,
}

/// Progress of an expectation.
#[derive(Debug, Clone)]
struct ExpectationState {
    expectation: Expectation,
    what: ConditionWatch,
    after: Option<ConditionWatch>,
    until: Option<ConditionWatch>,
    /// Time from which it counts.
    since: Option<Time>,
    occurrences: u32,
    /// The verdict and its time.
    verdict: Option<(Time, Verdict)>,
}

#[derive(Debug, Clone)]
struct PlayState {
    name: String,
    /// Name of the file, without directories.
    file: String,
    started: Option<Time>,
    /// Actions at the start.
    first: Vec<ScenarioAction>,
    /// How many actions of the start are not done yet. Until they are, nothing happens: they make the state to begin with.
    unprepared: usize,
    steps: Vec<StepState>,
    expectations: Vec<ExpectationState>,
    /// Scheduled actions, in the order of their times.
    scheduled: VecDeque<Scheduled>,
    /// Line of the action that is being done.
    acting: Option<usize>,
    /// Time of the last action, and the number of actions at that time.
    actions_at_time: (Time, u32),
    /// Time at which there were too many actions.
    runaway: Option<Time>,
    /// How many microseconds the scenario's time is ahead of the controller's. All times here are the scenario's.
    time_offset: i64,
}

/// A scenario being played; clones are the same.
#[derive(Debug, Clone)]
pub struct Play(Arc<Mutex<PlayState>>);

impl Play {
    /// A scenario that has not started.
    pub fn new(scenario: Scenario) -> Play {
        let steps = scenario.steps.into_iter().map(|step| StepState {
            condition: match &step.trigger {
                StepTrigger::At(_) => None,
                StepTrigger::When(condition, _) => Some(ConditionWatch::new(condition.clone())),
            },
            step,
            runs: 0,
            last_due: None,
            is_done: false,
        });
        let expected = scenario
            .expectations
            .into_iter()
            .map(|expectation| ExpectationState {
                what: ConditionWatch::new(expectation.condition.clone()),
                after: expectation.after.clone().map(ConditionWatch::new),
                until: match &expectation.kind {
                    ExpectationKind::Never { until } => until.clone().map(ConditionWatch::new),
                    ExpectationKind::Occurs { .. } => None,
                },
                expectation,
                since: None,
                occurrences: 0,
                verdict: None,
            });
        let file = scenario.file.file_name().unwrap_or_default();
        Play(Arc::new(Mutex::new(PlayState {
            name: scenario.name,
            file: file.to_string_lossy().into_owned(),
            started: None,
            unprepared: scenario.start.actions.len(),
            first: scenario.start.actions,
            steps: steps.collect(),
            expectations: expected.collect(),
            scheduled: VecDeque::new(),
            acting: None,
            actions_at_time: (Time::ZERO, 0),
            runaway: None,
            time_offset: 0,
        })))
    }

    /// A panic in another thread cannot leave the state inconsistent, so a poisoned lock is usable.
    fn state(&self) -> MutexGuard<'_, PlayState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts the scenario: it sees everything that happens to the controller from now on, and plans inputs.
    pub fn start(&self, seat: &mut Seat) {
        self.begin(&seat.controller);
        seat.subscribe(Box::new(self.clone()));
        seat.plan(Box::new(self.clone()));
    }

    /// A scenario that continues from here as this one does, but by itself, in a copy of its seat.
    #[must_use]
    pub fn fork(&self, seat: &mut Seat) -> Play {
        let fork = Play(Arc::new(Mutex::new(self.state().clone())));
        if self.state().started.is_some() {
            seat.subscribe(Box::new(fork.clone()));
            seat.plan(Box::new(fork.clone()));
        }
        fork
    }

    fn begin(&self, controller: &Controller) {
        let state = &mut *self.state();
        let now = controller.now();
        state.started = Some(now);
        let first = std::mem::take(&mut state.first).into_iter();
        state.scheduled.extend(first.map(|action| Scheduled {
            due: now,
            action,
            step: None,
        }));
        for (index, step) in state.steps.iter_mut().enumerate() {
            if let StepTrigger::At(time) = step.step.trigger {
                state.scheduled.extend(step.schedule(index, now + time));
            }
        }
        state.sort();
        for expected in &mut state.expectations {
            expected.since = expected.after.is_none().then_some(now);
        }
        state.note_states(controller);
    }

    /// Another controller replaces the one whose time was `before`. States that are already true in it do not
    /// occur.
    fn controller_replaced(&self, before: Time, controller: &Controller) {
        let state = &mut *self.state();
        let jump = i128::from(before.as_micros()) - i128::from(controller.now().as_micros());
        let jump = i64::try_from(jump).unwrap_or_default();
        state.time_offset = state.time_offset.saturating_add(jump);
        state.note_states(controller);
    }

    /// The outcome if the scenario ends now.
    pub fn outcome(&self, now: Time) -> ScenarioOutcome {
        let state = self.state();
        let now = state.scenario_time(now);
        let begun = state.started.unwrap_or(now);
        let expectations = state.expectations.iter().map(|expected| {
            let verdict = expected.verdict.clone();
            let (at, verdict) = verdict.unwrap_or_else(|| (now, expected.verdict_at_end(begun, now)));
            Entry {
                name: expected.expectation.name.clone(),
                line: expected.expectation.line,
                time: at.since(begun),
                verdict,
            }
        });
        // The limit of actions has ended all steps, and its own entry says so.
        let steps = state.steps.iter().filter(|_| state.runaway.is_none());
        // A time comes by itself: a step at one is worth a line only if the run was shorter.
        let steps = steps.filter(|step| step.condition.is_some() || !step.is_done);
        let steps = steps.map(|step| Entry {
            name: step.name(),
            line: step.step.line,
            time: now.since(begun),
            verdict: step.verdict_at_end(now.since(begun)),
        });
        let runaway = state.runaway.map(|at| Entry {
            name: "do".to_owned(),
            line: 0,
            time: at.since(begun),
            verdict: Verdict::Failed(runaway_words(at)),
        });
        let mut entries: Vec<Entry> = expectations.chain(steps).chain(runaway).collect();
        entries.sort_by_key(|entry| entry.line);
        ScenarioOutcome {
            name: state.name.clone(),
            time: now.since(begun),
            entries,
        }
    }

    /// Line of the action whose effects are under way; none while no action is being done.
    pub fn acting_line(&self) -> Option<usize> {
        self.state().acting
    }

    /// How far the scenario is at `now`, a time of the controller.
    pub fn progress(&self, now: Time) -> ScenarioProgress {
        let state = self.state();
        let now = state.scenario_time(now);
        let begun = state.started.unwrap_or(now);
        let expectations = state.expectations.iter();
        let expectations = expectations.map(|expected| expected.progress(begun, now));
        let until = state.runaway.unwrap_or(now);
        let steps = state.steps.iter().map(|step| step.progress(begun, until));
        let runaway = state.runaway.map(|at| EntryProgress {
            name: "do".to_owned(),
            line: 0,
            state: EntryState::Failed,
            time: Some(at.since(begun)),
            message: Some(runaway_words(at)),
        });
        let entries = expectations.chain(steps).chain(runaway);
        ScenarioProgress::new(state.file.clone(), entries.collect())
    }
}

fn runaway_words(at: Time) -> String {
    format!(
        "stopped after {MAX_ACTIONS_AT_TIME} actions at {at} s, the most at one time: do its steps trigger each other endlessly?"
    )
}

impl ActionSource for Play {
    fn deadline(&self) -> Option<Time> {
        let state = self.state();
        state
            .scheduled
            .front()
            .map(|next| state.controller_time(next.due))
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let state = &mut *self.state();
        let now = state.scenario_time(now);
        let due = state.scheduled.front().map(|next| next.due)?;
        if due > now {
            return None;
        }
        if state.actions_at_time.0 != due {
            state.actions_at_time = (due, 0);
        }
        state.actions_at_time.1 += 1;
        if state.actions_at_time.1 > MAX_ACTIONS_AT_TIME {
            state.runaway = Some(due);
            state.scheduled.clear();
            state.steps.retain(|step| step.condition.is_none());
        }
        let Scheduled { action, step, .. } = state.scheduled.pop_front()?;
        if let Some(step) = step.and_then(|index| state.steps.get_mut(index)) {
            step.is_done = true;
        }
        state.acting = Some(action.line);
        info!(event = "scenario", "scenario: {}", action.words);
        Some((state.controller_time(due), action.action))
    }
}

impl Subscriber for Play {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        self.state().observe(at, |watch| watch.input(input));
    }

    fn output(&mut self, at: Time, output: &Output) {
        self.state().observe(at, |watch| watch.output(output));
    }

    fn settled(&mut self, at: Time, controller: &Controller) {
        let state = &mut *self.state();
        state.observe(at, |watch| watch.settled(controller));
        state.acting = None;
        // The actions of the start are first; no other input is handled between them.
        state.unprepared = state.unprepared.saturating_sub(1);
    }

    fn notice(&mut self, at: Time, notice: Notice<'_>) {
        if let Notice::Restored(controller) | Notice::Reset { controller, .. } = notice {
            self.controller_replaced(at, controller);
        }
    }

    fn wants_statements(&self) -> bool {
        let is_line = |watch: &mut ConditionWatch| matches!(watch.condition(), Condition::Statement(_));
        self.state().conditions().any(is_line)
    }
}

impl PlayState {
    fn conditions(&mut self) -> impl Iterator<Item = &mut ConditionWatch> {
        let steps = self.steps.iter_mut().filter_map(|step| step.condition.as_mut());
        let expected = self.expectations.iter_mut().flat_map(|expected| {
            let ExpectationState {
                what, after, until, ..
            } = expected;
            std::iter::once(what).chain(after).chain(until)
        });
        steps.chain(expected)
    }

    /// A condition that is true already does not occur.
    fn note_states(&mut self, controller: &Controller) {
        self.conditions().for_each(|condition| {
            condition.settled(controller);
        });
    }

    /// Converts a time of the controller to scenario time.
    fn scenario_time(&self, theirs: Time) -> Time {
        Time::from_micros(theirs.as_micros().saturating_add_signed(self.time_offset))
    }

    /// Converts a scenario time to a time of the controller.
    fn controller_time(&self, ours: Time) -> Time {
        Time::from_micros(
            ours.as_micros()
                .saturating_add_signed(self.time_offset.saturating_neg()),
        )
    }

    /// Sorts by time; at the same time the order of the file is kept.
    fn sort(&mut self) {
        self.scheduled.make_contiguous().sort_by_key(|next| next.due);
    }

    /// Handles an event; `occurs` says whether a condition waits for it.
    fn observe(&mut self, at: Time, occurs: impl Fn(&mut ConditionWatch) -> bool) {
        if self.started.is_none() {
            return;
        }
        if self.unprepared > 0 {
            self.conditions().for_each(|condition| {
                occurs(condition);
            });
            return;
        }
        let at = self.scenario_time(at);
        let mut added = false;
        for (index, step) in self.steps.iter_mut().enumerate() {
            let (Some(condition), StepTrigger::When(_, after)) = (&mut step.condition, &step.step.trigger)
            else {
                continue;
            };
            if !occurs(condition) || (step.step.times > 0 && step.runs >= step.step.times) {
                continue;
            }
            if self.scheduled.len() + step.step.actions.len() > MAX_SCHEDULED {
                continue;
            }
            let due = at + *after;
            self.scheduled.extend(step.schedule(index, due));
            added = true;
        }
        if added {
            self.sort();
        }
        for expected in &mut self.expectations {
            expected.observe(at, &occurs);
        }
    }
}

impl StepState {
    /// Its actions with the time at which they are to be done once more.
    fn schedule(&mut self, index: usize, due: Time) -> impl Iterator<Item = Scheduled> {
        self.runs = self.runs.saturating_add(1);
        self.last_due = Some(due);
        let actions = self.step.actions.iter();
        actions.map(move |action| Scheduled {
            due,
            action: action.clone(),
            step: Some(index),
        })
    }

    /// The verdict if the run ends now, this long after its beginning.
    fn verdict_at_end(&self, passed: Duration) -> Verdict {
        if self.is_done {
            return Verdict::Held;
        }
        let ended = format!("the run ended after {}", seconds(passed));
        let why = match &self.step.trigger {
            StepTrigger::At(_) => format!("{ended}, before its time"),
            StepTrigger::When(..) if self.runs == 0 => format!("its condition never happened; {ended}"),
            StepTrigger::When(_, after) => {
                format!(
                    "{ended}, before the {} after its condition had passed",
                    seconds(*after)
                )
            }
        };
        let reason = format!("`{}` was not done: {why}", self.words());
        // Every time that its condition happens can be no time.
        match self.step.times {
            0 => Verdict::Skipped(reason),
            _ => Verdict::Undone(reason),
        }
    }

    /// Its actions, as they were written.
    fn words(&self) -> String {
        let words = self.step.actions.iter().map(|action| action.words.as_str());
        words.collect::<Vec<_>>().join(", ")
    }

    fn name(&self) -> String {
        match &self.step.trigger {
            StepTrigger::At(time) => format!("do at {}", seconds(*time)),
            StepTrigger::When(condition, _) => format!("do when {condition}"),
        }
    }

    /// At `now`, or at the time at which all steps were given up.
    fn progress(&self, begun: Time, now: Time) -> EntryProgress {
        let done = self.last_due.filter(|due| *due <= now);
        EntryProgress {
            name: self.name(),
            line: self.step.line,
            state: done.map_or(EntryState::Waiting, |_| EntryState::Passed),
            time: done.map(|due| due.since(begun)),
            message: Some(self.words()),
        }
    }
}

impl ExpectationState {
    fn progress(&self, begun: Time, now: Time) -> EntryProgress {
        let (state, at, message) = match &self.verdict {
            Some((at, Verdict::Failed(reason))) => (EntryState::Failed, Some(*at), Some(reason.clone())),
            Some((at, Verdict::Held | Verdict::Undone(_) | Verdict::Skipped(_))) => {
                (EntryState::Passed, Some(*at), None)
            }
            None => match self.expired(now) {
                Some(at) => (EntryState::Failed, Some(at), Some(self.unmet())),
                None => (EntryState::Waiting, None, self.waits_for()),
            },
        };
        EntryProgress {
            name: self.expectation.name.clone(),
            line: self.expectation.line,
            state,
            time: at.map(|at| at.since(begun)),
            message,
        }
    }

    /// The time after which it comes too late, if that has passed.
    fn expired(&self, now: Time) -> Option<Time> {
        let ExpectationKind::Occurs { within, .. } = self.expectation.kind else {
            return None;
        };
        let end = self.since? + within?;
        (end < now).then_some(end)
    }

    /// Progress of its wait; `None` while there is none.
    fn waits_for(&self) -> Option<String> {
        match (&self.expectation.kind, &self.expectation.after) {
            (_, Some(after)) if self.since.is_none() => Some(format!("begins after `{after}`")),
            (ExpectationKind::Occurs { times, .. }, _) if self.occurrences > 0 => {
                Some(format!("happened {} of {times} times", self.occurrences))
            }
            _ => None,
        }
    }

    fn observe(&mut self, at: Time, occurs: &impl Fn(&mut ConditionWatch) -> bool) {
        let comes = occurs(&mut self.what);
        let ends = self.until.as_mut().is_some_and(occurs);
        let begins = self.after.as_mut().is_some_and(occurs);
        if self.verdict.is_some() {
            return;
        }
        let Some(since) = self.since else {
            // The event that starts the expectation does not count for it, even if the condition is the same.
            self.since = begins.then_some(at);
            return;
        };
        match &self.expectation.kind {
            ExpectationKind::Occurs { times, within } => {
                self.occurrences += u32::from(comes);
                let passed = at.since(since);
                if self.occurrences >= *times {
                    let late = within.filter(|within| passed > *within);
                    let words = |within| {
                        let (came, most) = (seconds(passed), seconds(within));
                        Verdict::Failed(format!("expected within {most}, happened after {came}"))
                    };
                    self.verdict = Some((at, late.map_or(Verdict::Held, words)));
                }
            }
            ExpectationKind::Never { .. } if comes => {
                let words = format!("expected never, happened at {}", seconds(at.since(Time::ZERO)));
                self.verdict = Some((at, Verdict::Failed(words)));
            }
            ExpectationKind::Never { .. } if ends => self.verdict = Some((at, Verdict::Held)),
            ExpectationKind::Never { .. } => {}
        }
    }

    /// The verdict if nothing else happens.
    fn verdict_at_end(&self, begun: Time, now: Time) -> Verdict {
        let ended = format!("the run ended after {}", seconds(now.since(begun)));
        if matches!(self.expectation.kind, ExpectationKind::Never { .. }) {
            return match (&self.expectation.after, self.since) {
                (Some(after), None) => Verdict::Undone(format!(
                    "nothing was checked: it begins after `{after}`, which never happened; {ended}"
                )),
                _ => Verdict::Held,
            };
        }
        Verdict::Failed(format!("{}; {ended}", self.unmet()))
    }

    /// Expectations that have not come true.
    fn unmet(&self) -> String {
        let ExpectationKind::Occurs { times, within } = &self.expectation.kind else {
            return String::new();
        };
        let limit = within.map_or(String::new(), |within| format!(" within {}", seconds(within)));
        match (&self.expectation.after, self.since) {
            (Some(after), None) => format!("expected{limit} after `{after}`, which never happened"),
            _ => {
                let expected = count(u64::from(*times));
                let found = match u64::from(self.occurrences) {
                    0 => "but never happened".to_owned(),
                    number => format!("happened {}", count(number)),
                };
                format!("expected {expected}{limit}, {found}")
            }
        }
    }
}

/// `once`, or how many times.
fn count(number: u64) -> String {
    if number == 1 {
        "once".to_owned()
    } else {
        format!("{number} times")
    }
}

/// Seconds to the millisecond, as people read them: `1.507 s`.
fn seconds(duration: Duration) -> String {
    let rounded = (duration.as_secs_f64() * 1e3).round() / 1e3;
    format!("{rounded} s")
}
