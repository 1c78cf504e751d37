//! A scenario being played: what has happened since it began, what is to be done next, what of the expectations has
//! come. It sees what the hub sees; time is the controller's, so the same run gives the same results. When the
//! controller becomes another one (a snapshot, a reset), its time jumps and the scenario's goes on.

use super::results::{Outcome, Result as Entry, Verdict};
use super::words::{ScenarioAction, ScenarioCondition};
use super::{Expectation, Occasion, Scenario, Step, Wanted};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tracing::info;
use ts3100_controller::input::Input;
use ts3100_controller::output::Output;
use ts3100_controller::{Controller, Time};

/// Most steps that wait for their time: a condition that comes all the time, with a long `after`.
const MAX_WAITING: usize = 10_000;

/// Most actions at one moment: steps that bring each other about would never end it.
const MAX_AT_ONCE: u32 = 1_000;

/// What has become of a step.
#[derive(Debug)]
struct Stage {
    step: Step,
    watch: Watch,
    begun: u32,
}

/// A condition being watched.
#[derive(Debug)]
struct Watch {
    condition: ScenarioCondition,
    /// Whether a state held when it was last looked at.
    held: bool,
}

impl Watch {
    fn new(condition: ScenarioCondition) -> Watch {
        Watch {
            condition,
            held: false,
        }
    }

    /// Whether it has come; what is a state comes when it begins to hold.
    fn comes(&mut self, moment: &Moment<'_>) -> bool {
        match moment {
            Moment::Input(input) => self.condition.is_input(input),
            Moment::Output(output) => self.condition.is_output(output),
            Moment::Settled(controller) => {
                let Some(holds) = self.condition.holds(controller) else {
                    return false;
                };
                let comes = holds && !self.held;
                self.held = holds;
                comes
            }
        }
    }
}

/// What there is to look at.
enum Moment<'a> {
    Input(&'a Input),
    Output(&'a Output),
    Settled(&'a Controller),
}

/// An expectation being watched.
#[derive(Debug)]
struct Expected {
    expectation: Expectation,
    what: Watch,
    after: Option<Watch>,
    until: Option<Watch>,
    /// Since when it counts.
    since: Option<Time>,
    came: u32,
    verdict: Option<Verdict>,
    /// When the verdict fell.
    at: Option<Time>,
}

#[derive(Debug)]
struct State {
    name: String,
    begun: Option<Time>,
    first: Vec<ScenarioAction>,
    stages: Vec<Stage>,
    expected: Vec<Expected>,
    /// What is to be done, and when, in order.
    waiting: VecDeque<(Time, ScenarioAction)>,
    /// Actions at the last moment that had one.
    at_once: (Time, u32),
    /// When there were too many.
    runaway: Option<Time>,
    /// How many microseconds the scenario's time is ahead of the controller's. All times here are the scenario's.
    ahead: i64,
}

/// A scenario being played; clones are the same.
#[derive(Debug, Clone)]
pub struct Play(Arc<Mutex<State>>);

impl Play {
    /// Nothing has happened yet.
    #[must_use]
    pub fn new(scenario: Scenario) -> Play {
        let stages = scenario.steps.into_iter().map(|step| {
            // The condition of a step with a time is never looked at.
            let condition = match &step.on {
                Occasion::When(condition, _) => condition.clone(),
                Occasion::At(_) => ScenarioCondition::AlarmsReset,
            };
            let (watch, begun) = (Watch::new(condition), 0);
            Stage { step, watch, begun }
        });
        let expected = scenario.expectations.into_iter().map(|expectation| Expected {
            what: Watch::new(expectation.what.clone()),
            after: expectation.after.clone().map(Watch::new),
            until: match &expectation.wanted {
                Wanted::Never { until } => until.clone().map(Watch::new),
                Wanted::Comes { .. } => None,
            },
            expectation,
            since: None,
            came: 0,
            verdict: None,
            at: None,
        });
        Play(Arc::new(Mutex::new(State {
            name: scenario.name,
            begun: None,
            first: scenario.start.actions,
            stages: stages.collect(),
            expected: expected.collect(),
            waiting: VecDeque::new(),
            at_once: (Time::ZERO, 0),
            runaway: None,
            ahead: 0,
        })))
    }

    /// The state is whole between any two statements, so a panic elsewhere does not matter.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// It begins with this controller.
    pub(crate) fn begin(&self, controller: &Controller) {
        let state = &mut *self.state();
        let now = controller.now();
        state.begun = Some(now);
        for action in std::mem::take(&mut state.first) {
            state.waiting.push_back((now, action));
        }
        for stage in &state.stages {
            if let Occasion::At(time) = stage.step.on {
                state.waiting.extend(
                    stage
                        .step
                        .actions
                        .iter()
                        .map(|action| (now + time, action.clone())),
                );
            }
        }
        state.sort();
        for expected in &mut state.expected {
            expected.since = expected.after.is_none().then_some(now);
        }
        for watch in state.watches() {
            watch.held = watch.condition.holds(controller) == Some(true);
        }
    }

    /// The controller, whose time was `before`, is this one from now on. What already holds in it has not come.
    pub(crate) fn go_on(&self, before: Time, controller: &Controller) {
        let state = &mut *self.state();
        let jump = i128::from(before.as_micros()) - i128::from(controller.now().as_micros());
        let jump = i64::try_from(jump).unwrap_or_default();
        state.ahead = state.ahead.saturating_add(jump);
        for watch in state.watches() {
            watch.held = watch.condition.holds(controller) == Some(true);
        }
    }

    /// When the next action is due.
    #[must_use]
    pub(crate) fn deadline(&self) -> Option<Time> {
        let state = self.state();
        state.waiting.front().map(|(due, _)| state.theirs(*due))
    }

    /// The next action that is due at `now`.
    pub(crate) fn due(&self, now: Time) -> Option<(Time, Input)> {
        let state = &mut *self.state();
        let now = state.ours(now);
        if state.at_once.0 != now {
            state.at_once = (now, 0);
        }
        state.at_once.1 += 1;
        if state.at_once.1 > MAX_AT_ONCE && !state.waiting.is_empty() {
            state.runaway = Some(now);
            state.waiting.clear();
            state.stages.clear();
        }
        let is_due = state.waiting.front().is_some_and(|(due, _)| *due <= now);
        let (due, action) = is_due.then(|| state.waiting.pop_front()).flatten()?;
        info!(event = "scenario", "scenario: {}", action.words);
        Some((state.theirs(due), action.input))
    }

    /// An input of the controller.
    pub(crate) fn input(&self, at: Time, input: &Input) {
        self.state().look(at, &Moment::Input(input));
    }

    /// An output of the controller.
    pub(crate) fn output(&self, at: Time, output: &Output) {
        self.state().look(at, &Moment::Output(output));
    }

    /// The controller has nothing more to do at this moment.
    pub(crate) fn settled(&self, at: Time, controller: &Controller) {
        self.state().look(at, &Moment::Settled(controller));
    }

    /// What came of it, if it ends now.
    #[must_use]
    pub fn end(&self, now: Time) -> Outcome {
        let state = self.state();
        let now = state.ours(now);
        let begun = state.begun.unwrap_or(now);
        let mut entries: Vec<(usize, Entry)> = Vec::new();
        for expected in &state.expected {
            let verdict = expected
                .verdict
                .clone()
                .unwrap_or_else(|| expected.at_end(begun, now));
            let time = expected.at.unwrap_or(now).since(begun);
            let name = expected.expectation.name.clone();
            let line = expected.expectation.line;
            entries.push((
                line,
                Entry {
                    name,
                    line,
                    time,
                    verdict,
                },
            ));
        }
        for stage in &state.stages {
            let Occasion::When(condition, _) = &stage.step.on else {
                continue;
            };
            let verdict = if stage.begun > 0 {
                Verdict::Held
            } else {
                Verdict::Skipped("its condition never came".to_owned())
            };
            let (line, time) = (stage.step.line, now.since(begun));
            let name = format!("do when {condition}");
            entries.push((
                line,
                Entry {
                    name,
                    line,
                    time,
                    verdict,
                },
            ));
        }
        if let Some(at) = state.runaway {
            let words = format!("more than {MAX_AT_ONCE} actions at {at}: steps bring each other about");
            let (name, time) = ("do".to_owned(), at.since(begun));
            let verdict = Verdict::Failed(words);
            entries.push((
                0,
                Entry {
                    name,
                    line: 0,
                    time,
                    verdict,
                },
            ));
        }
        entries.sort_by_key(|(line, _)| *line);
        Outcome {
            name: state.name.clone(),
            time: now.since(begun),
            entries: entries.into_iter().map(|(_, entry)| entry).collect(),
        }
    }
}

impl State {
    fn watches(&mut self) -> impl Iterator<Item = &mut Watch> {
        let stages = self.stages.iter_mut().map(|stage| &mut stage.watch);
        let expected = self.expected.iter_mut().flat_map(|expected| {
            let Expected {
                what, after, until, ..
            } = expected;
            std::iter::once(what).chain(after).chain(until)
        });
        stages.chain(expected)
    }

    /// A time of the controller as one of the scenario.
    fn ours(&self, theirs: Time) -> Time {
        Time::from_micros(theirs.as_micros().saturating_add_signed(self.ahead))
    }

    /// A time of the scenario as one of the controller.
    fn theirs(&self, ours: Time) -> Time {
        Time::from_micros(
            ours.as_micros()
                .saturating_add_signed(self.ahead.saturating_neg()),
        )
    }

    /// In the order of their times; of the same time in the order of the file.
    fn sort(&mut self) {
        self.waiting.make_contiguous().sort_by_key(|(due, _)| *due);
    }

    fn look(&mut self, at: Time, moment: &Moment<'_>) {
        if self.begun.is_none() {
            return;
        }
        let at = self.ours(at);
        let mut added = false;
        for stage in &mut self.stages {
            let Occasion::When(_, after) = stage.step.on else {
                continue;
            };
            if !stage.watch.comes(moment) || (stage.step.times > 0 && stage.begun >= stage.step.times) {
                continue;
            }
            if self.waiting.len() + stage.step.actions.len() > MAX_WAITING {
                continue;
            }
            stage.begun = stage.begun.saturating_add(1);
            let due = at + after;
            self.waiting
                .extend(stage.step.actions.iter().map(|action| (due, action.clone())));
            added = true;
        }
        if added {
            self.sort();
        }
        for expected in &mut self.expected {
            expected.look(at, moment);
        }
    }
}

impl Expected {
    fn look(&mut self, at: Time, moment: &Moment<'_>) {
        let comes = self.what.comes(moment);
        let ends = self.until.as_mut().is_some_and(|until| until.comes(moment));
        let begins = self.after.as_mut().is_some_and(|after| after.comes(moment));
        if self.verdict.is_some() {
            return;
        }
        let Some(since) = self.since else {
            // What begins it is not what it is about, even if it is the same.
            self.since = begins.then_some(at);
            return;
        };
        match &self.expectation.wanted {
            Wanted::Comes { times, within } => {
                self.came += u32::from(comes);
                let passed = at.since(since);
                if self.came >= *times {
                    let late = within.filter(|within| passed > *within);
                    let words = |within| {
                        let (came, most) = (seconds(passed), seconds(within));
                        Verdict::Failed(format!("expected within {most}, came after {came}"))
                    };
                    self.decide(at, late.map_or(Verdict::Held, words));
                }
            }
            Wanted::Never { .. } if comes => {
                let words = format!("expected never, came at {at}");
                self.decide(at, Verdict::Failed(words));
            }
            Wanted::Never { .. } if ends => self.decide(at, Verdict::Held),
            Wanted::Never { .. } => {}
        }
    }

    fn decide(&mut self, at: Time, verdict: Verdict) {
        self.verdict = Some(verdict);
        self.at = Some(at);
    }

    /// The verdict when nothing more happens.
    fn at_end(&self, begun: Time, now: Time) -> Verdict {
        let Wanted::Comes { times, within } = &self.expectation.wanted else {
            return Verdict::Held;
        };
        let ended = format!("the run ended after {}", seconds(now.since(begun)));
        let limit = within.map_or(String::new(), |within| format!(" within {}", seconds(within)));
        Verdict::Failed(match (&self.expectation.after, self.since) {
            (Some(after), None) => format!("expected{limit} after `{after}`, which never came; {ended}"),
            _ => format!("expected {times} times{limit}, came {} times; {ended}", self.came),
        })
    }
}

fn seconds(duration: Duration) -> String {
    format!("{:.6} s", duration.as_secs_f64())
}
