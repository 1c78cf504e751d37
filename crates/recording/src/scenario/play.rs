//! Runs a scenario: which conditions have occurred, which actions are due, and the verdicts of the expectations.
//!
//! It observes every input and output of the driver. Time is virtual, so the same run gives the same results. When a
//! snapshot or a reset replaces the controller, the controller's time jumps while the scenario's time continues.

use super::condition::{ScenarioAction, ScenarioCondition};
use super::results::{EntryResult as Entry, ScenarioOutcome, Verdict};
use super::{Expectation, ExpectationKind, Scenario, Step, StepTrigger};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tracing::info;
use ts3100_controller::input::Input;
use ts3100_controller::output::Output;
use ts3100_controller::{Controller, Time};
use ts3100_driver::cell::{ActionSource, Cell, Notice, Side, Subscriber};

/// Most scheduled actions: a bound for a frequent condition with a long `after`.
const MAX_SCHEDULED: usize = 10_000;

/// Most actions at one virtual time: steps that trigger each other would never end.
const MAX_ACTIONS_AT_TIME: u32 = 1_000;

/// Progress of a step.
#[derive(Debug)]
struct StepState {
    step: Step,
    condition: ConditionState,
    runs: u32,
}

/// A condition and its last state.
#[derive(Debug)]
struct ConditionState {
    condition: ScenarioCondition,
    /// Whether the state was true at the last observation.
    was_true: bool,
}

impl ConditionState {
    fn new(condition: ScenarioCondition) -> ConditionState {
        ConditionState {
            condition,
            was_true: false,
        }
    }

    /// Whether the condition occurs now. A state occurs when it becomes true.
    fn occurs(&mut self, observation: &Observation<'_>) -> bool {
        match observation {
            Observation::Input(input) => self.condition.matches_input(input),
            Observation::Output(output) => self.condition.matches_output(output),
            Observation::Settled(controller) => {
                let Some(holds) = self.condition.holds(controller) else {
                    return false;
                };
                let comes = holds && !self.was_true;
                self.was_true = holds;
                comes
            }
        }
    }
}

/// What a condition is tested against.
enum Observation<'a> {
    Input(&'a Input),
    Output(&'a Output),
    Settled(&'a Controller),
}

/// Progress of an expectation.
#[derive(Debug)]
struct ExpectationState {
    expectation: Expectation,
    what: ConditionState,
    after: Option<ConditionState>,
    until: Option<ConditionState>,
    /// Time from which it counts.
    since: Option<Time>,
    occurrences: u32,
    verdict: Option<Verdict>,
    /// Time of the verdict.
    verdict_time: Option<Time>,
}

#[derive(Debug)]
struct PlayState {
    name: String,
    started: Option<Time>,
    start_actions: Vec<ScenarioAction>,
    steps: Vec<StepState>,
    expectations: Vec<ExpectationState>,
    /// Scheduled actions with their times, in order.
    scheduled: VecDeque<(Time, ScenarioAction)>,
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
    #[must_use]
    pub fn new(scenario: Scenario) -> Play {
        let steps = scenario.steps.into_iter().map(|step| {
            // The condition of a step with a time is never looked at.
            let condition = match &step.trigger {
                StepTrigger::When(condition, _) => condition.clone(),
                StepTrigger::At(_) => ScenarioCondition::AlarmsReset,
            };
            let (condition, begun) = (ConditionState::new(condition), 0);
            StepState {
                step,
                condition,
                runs: begun,
            }
        });
        let expected = scenario
            .expectations
            .into_iter()
            .map(|expectation| ExpectationState {
                what: ConditionState::new(expectation.condition.clone()),
                after: expectation.after.clone().map(ConditionState::new),
                until: match &expectation.kind {
                    ExpectationKind::Never { until } => until.clone().map(ConditionState::new),
                    ExpectationKind::Occurs { .. } => None,
                },
                expectation,
                since: None,
                occurrences: 0,
                verdict: None,
                verdict_time: None,
            });
        Play(Arc::new(Mutex::new(PlayState {
            name: scenario.name,
            started: None,
            start_actions: scenario.start.actions,
            steps: steps.collect(),
            expectations: expected.collect(),
            scheduled: VecDeque::new(),
            actions_at_time: (Time::ZERO, 0),
            runaway: None,
            time_offset: 0,
        })))
    }

    /// A panic in another thread cannot leave the state inconsistent, so a poisoned lock is usable.
    fn state(&self) -> MutexGuard<'_, PlayState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts the scenario: it sees everything that happens in the cell from now on, and plans inputs.
    pub fn start(&self, cell: &mut Cell) {
        self.begin(&cell.controller);
        cell.subscribe(Box::new(self.clone()));
        cell.plan(Box::new(self.clone()));
    }

    fn begin(&self, controller: &Controller) {
        let state = &mut *self.state();
        let now = controller.now();
        state.started = Some(now);
        for action in std::mem::take(&mut state.start_actions) {
            state.scheduled.push_back((now, action));
        }
        for step in &state.steps {
            if let StepTrigger::At(time) = step.step.trigger {
                state.scheduled.extend(
                    step.step
                        .actions
                        .iter()
                        .map(|action| (now + time, action.clone())),
                );
            }
        }
        state.sort();
        for expected in &mut state.expectations {
            expected.since = expected.after.is_none().then_some(now);
        }
        for condition in state.conditions() {
            condition.was_true = condition.condition.holds(controller) == Some(true);
        }
    }

    /// Another controller replaces the one whose time was `before`. States that are already true in it do not
    /// occur.
    fn controller_replaced(&self, before: Time, controller: &Controller) {
        let state = &mut *self.state();
        let jump = i128::from(before.as_micros()) - i128::from(controller.now().as_micros());
        let jump = i64::try_from(jump).unwrap_or_default();
        state.time_offset = state.time_offset.saturating_add(jump);
        for condition in state.conditions() {
            condition.was_true = condition.condition.holds(controller) == Some(true);
        }
    }

    /// The outcome if the scenario ends now.
    #[must_use]
    pub fn outcome(&self, now: Time) -> ScenarioOutcome {
        let state = self.state();
        let now = state.scenario_time(now);
        let begun = state.started.unwrap_or(now);
        let expectations = state.expectations.iter().map(|expected| Entry {
            name: expected.expectation.name.clone(),
            line: expected.expectation.line,
            time: expected.verdict_time.unwrap_or(now).since(begun),
            verdict: expected
                .verdict
                .clone()
                .unwrap_or_else(|| expected.verdict_at_end(begun, now)),
        });
        let steps = state.steps.iter().filter_map(|step| {
            let StepTrigger::When(condition, _) = &step.step.trigger else {
                return None;
            };
            Some(Entry {
                name: format!("do when {condition}"),
                line: step.step.line,
                time: now.since(begun),
                verdict: match step.runs {
                    0 => Verdict::Skipped("its condition never came".to_owned()),
                    _ => Verdict::Held,
                },
            })
        });
        let runaway = state.runaway.map(|at| Entry {
            name: "do".to_owned(),
            line: 0,
            time: at.since(begun),
            verdict: Verdict::Failed(format!(
                "more than {MAX_ACTIONS_AT_TIME} actions at {at}: steps bring each other about"
            )),
        });
        let mut entries: Vec<Entry> = expectations.chain(steps).chain(runaway).collect();
        entries.sort_by_key(|entry| entry.line);
        ScenarioOutcome {
            name: state.name.clone(),
            time: now.since(begun),
            entries,
        }
    }
}

impl ActionSource for Play {
    fn deadline(&self) -> Option<Time> {
        let state = self.state();
        state
            .scheduled
            .front()
            .map(|(due, _)| state.controller_time(*due))
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, Input)> {
        let state = &mut *self.state();
        let now = state.scenario_time(now);
        if state.actions_at_time.0 != now {
            state.actions_at_time = (now, 0);
        }
        state.actions_at_time.1 += 1;
        if state.actions_at_time.1 > MAX_ACTIONS_AT_TIME && !state.scheduled.is_empty() {
            state.runaway = Some(now);
            state.scheduled.clear();
            state.steps.clear();
        }
        let is_due = state.scheduled.front().is_some_and(|(due, _)| *due <= now);
        let (due, action) = is_due.then(|| state.scheduled.pop_front()).flatten()?;
        info!(event = "scenario", "scenario: {}", action.words);
        Some((state.controller_time(due), action.input))
    }
}

impl Subscriber for Play {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        self.state().observe(at, &Observation::Input(input));
    }

    fn output(&mut self, at: Time, output: &Output) {
        self.state().observe(at, &Observation::Output(output));
    }

    fn settled(&mut self, at: Time, controller: &Controller) {
        self.state().observe(at, &Observation::Settled(controller));
    }

    fn notice(&mut self, at: Time, notice: Notice<'_>) {
        if let Notice::Restored(controller) | Notice::Reset { controller, .. } = notice {
            self.controller_replaced(at, controller);
        }
    }
}

impl PlayState {
    fn conditions(&mut self) -> impl Iterator<Item = &mut ConditionState> {
        let steps = self.steps.iter_mut().map(|step| &mut step.condition);
        let expected = self.expectations.iter_mut().flat_map(|expected| {
            let ExpectationState {
                what, after, until, ..
            } = expected;
            std::iter::once(what).chain(after).chain(until)
        });
        steps.chain(expected)
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
        self.scheduled.make_contiguous().sort_by_key(|(due, _)| *due);
    }

    fn observe(&mut self, at: Time, observation: &Observation<'_>) {
        if self.started.is_none() {
            return;
        }
        let at = self.scenario_time(at);
        let mut added = false;
        for step in &mut self.steps {
            let StepTrigger::When(_, after) = step.step.trigger else {
                continue;
            };
            if !step.condition.occurs(observation) || (step.step.times > 0 && step.runs >= step.step.times) {
                continue;
            }
            if self.scheduled.len() + step.step.actions.len() > MAX_SCHEDULED {
                continue;
            }
            step.runs = step.runs.saturating_add(1);
            let due = at + after;
            self.scheduled
                .extend(step.step.actions.iter().map(|action| (due, action.clone())));
            added = true;
        }
        if added {
            self.sort();
        }
        for expected in &mut self.expectations {
            expected.observe(at, observation);
        }
    }
}

impl ExpectationState {
    fn observe(&mut self, at: Time, observation: &Observation<'_>) {
        let comes = self.what.occurs(observation);
        let ends = self.until.as_mut().is_some_and(|until| until.occurs(observation));
        let begins = self.after.as_mut().is_some_and(|after| after.occurs(observation));
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
                        Verdict::Failed(format!("expected within {most}, came after {came}"))
                    };
                    self.decide(at, late.map_or(Verdict::Held, words));
                }
            }
            ExpectationKind::Never { .. } if comes => {
                let words = format!("expected never, came at {at}");
                self.decide(at, Verdict::Failed(words));
            }
            ExpectationKind::Never { .. } if ends => self.decide(at, Verdict::Held),
            ExpectationKind::Never { .. } => {}
        }
    }

    fn decide(&mut self, at: Time, verdict: Verdict) {
        self.verdict = Some(verdict);
        self.verdict_time = Some(at);
    }

    /// The verdict if nothing else happens.
    fn verdict_at_end(&self, begun: Time, now: Time) -> Verdict {
        let ExpectationKind::Occurs { times, within } = &self.expectation.kind else {
            return Verdict::Held;
        };
        let ended = format!("the run ended after {}", seconds(now.since(begun)));
        let limit = within.map_or(String::new(), |within| format!(" within {}", seconds(within)));
        Verdict::Failed(match (&self.expectation.after, self.since) {
            (Some(after), None) => format!("expected{limit} after `{after}`, which never came; {ended}"),
            _ => format!(
                "expected {times} times{limit}, came {} times; {ended}",
                self.occurrences
            ),
        })
    }
}

fn seconds(duration: Duration) -> String {
    format!("{:.6} s", duration.as_secs_f64())
}
