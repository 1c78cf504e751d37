//! Robots that are joined by wires: an output of one is an input of another, in virtual time.
//!
//! They take their steps together. Before anything happens at a moment, everything that was due earlier at any of them
//! has happened, the earliest first, and each change of an output has reached its input. So an exchange of signals takes
//! the same course in real time, scaled, stepped or automatic time, and the same seed gives the same bytes. Their clocks
//! pass alike; only the moments they count from differ, after a reset or a snapshot of one of them.
//!
//! Start with [`Wired::run`].

use super::Driver;
use super::request::Request;
use super::run_loop::{WakeTimer, Work, clock_check};
use crate::cell::Side;
use crate::clock::{CATCH_UP_SLICE, Clock, Wake};
use std::collections::BTreeMap;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, oneshot};
use tokio::task::coop::unconstrained;
use tokio::task::yield_now;
use tracing::{Instrument as _, Span, debug, warn};
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::{Controller, Time};

/// Most changes that follow from each other at one moment; lines that go on changing each other wait for the next one.
const MAX_CHANGES_AT_ONCE: usize = 256;
/// Changes of outside lines that may be queued.
const OUTSIDE_QUEUE: usize = 64;

/// One end of a wire.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum WireEnd {
    /// An output of a robot where a wire begins, an input where it ends.
    Line {
        /// Number of the robot, from 0.
        robot: usize,
        /// Number of the line.
        line: u16,
    },
    /// A line of the world around the robots: a test sets it where a wire begins, and reads it where one ends.
    Outside(String),
}

impl WireEnd {
    /// The number of its robot; `None` outside.
    pub fn robot(&self) -> Option<usize> {
        match self {
            WireEnd::Line { robot, .. } => Some(*robot),
            WireEnd::Outside(_) => None,
        }
    }
}

/// A wire: its end shows the level of its beginning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wire {
    /// Where the level comes from.
    pub from: WireEnd,
    /// What shows it.
    pub to: WireEnd,
}

/// What an outside line is set to, and who waits for it.
type OutsideChange = (String, bool, oneshot::Sender<()>);

/// Reads the levels of wires, and sets outside lines, from other tasks.
#[derive(Debug, Clone)]
pub struct WireHandle {
    wires: Arc<[Wire]>,
    levels: Arc<Mutex<Vec<bool>>>,
    changes: mpsc::Sender<OutsideChange>,
}

impl WireHandle {
    /// The level of each wire.
    pub fn levels(&self) -> Vec<bool> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<bool>> {
        self.levels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a wire begins at this outside line.
    pub fn can_set(&self, name: &str) -> bool {
        let begins = |wire: &Wire| matches!(&wire.from, WireEnd::Outside(known) if known == name);
        self.wires.iter().any(begins)
    }

    /// Sets an outside line. Everything that follows from it at once has happened when this returns; false if the robots
    /// have ended.
    pub async fn set(&self, name: &str, on: bool) -> bool {
        let (done, is_done) = oneshot::channel();
        let sent = self.changes.send((name.to_owned(), on, done)).await;
        sent.is_ok() && is_done.await.is_ok()
    }
}

/// One unit of work.
enum Step {
    /// Of one robot.
    Of(usize, Work),
    /// An outside line changes.
    Outside(OutsideChange),
    /// Time jumps.
    Jump,
    /// The wake time has come.
    Tick,
    ClockCheck,
}

/// Robots and the wires between them.
pub struct Wired {
    /// Each with the span of its lines in the log.
    robots: Vec<(Box<Driver>, Span)>,
    /// The wires and their levels, as other tasks see them.
    shared: WireHandle,
    outside: BTreeMap<String, bool>,
    /// Waits until the line that it has set has its effect.
    setter: Option<oneshot::Sender<()>>,
    changes: mpsc::Receiver<OutsideChange>,
    /// The driver that is polled first next time.
    first: usize,
    /// How far time jumps, as soon as nothing has arrived anywhere.
    jump: Option<Duration>,
    /// A step that waits until nothing is being stored.
    kept: Option<Step>,
    /// How many writes it has waited for.
    writes_awaited: u32,
    /// Where time stands while requests are served alone.
    standstill: Option<Instant>,
    last_yield: Instant,
    has_warned: bool,
}

impl Wired {
    /// Joins robots that have not run yet, each with the span of its lines in the log. The numbers of the wires' ends are
    /// places in `robots`.
    pub fn new(mut robots: Vec<(Box<Driver>, Span)>, wires: Vec<Wire>) -> (Wired, WireHandle) {
        for (driver, _) in &mut robots {
            driver.edge.shares_time = true;
        }
        for wire in &wires {
            if let WireEnd::Line { robot, line } = &wire.to
                && let Some((driver, _)) = robots.get_mut(*robot)
            {
                driver.cell.join_wire(*line);
            }
        }
        let (sender, changes) = mpsc::channel(OUTSIDE_QUEUE);
        let handle = WireHandle {
            levels: Arc::new(Mutex::new(vec![false; wires.len()])),
            wires: wires.into(),
            changes: sender,
        };
        let wired = Wired {
            robots,
            shared: handle.clone(),
            outside: BTreeMap::new(),
            setter: None,
            changes,
            first: 0,
            jump: None,
            kept: None,
            writes_awaited: 0,
            standstill: None,
            last_yield: Instant::now(),
            has_warned: false,
        };
        (wired, handle)
    }

    /// Runs until `stop` completes, closes all ports and returns the final controllers.
    pub async fn run(mut self, stop: impl Future<Output = ()>) -> Vec<Controller> {
        self.hold();
        self.carry(Duration::ZERO);
        self.release();
        self.serve(stop).await;
        self.hold();
        self.catch_up();
        self.release();
        let mut controllers = Vec::new();
        for (driver, _) in self.robots {
            controllers.push(driver.finish().await);
        }
        controllers
    }

    async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let (mut stop, mut timer) = (pin!(stop), WakeTimer::default());
        loop {
            let wake = self.wake();
            let clock = self.robots.first().map(|(driver, _)| &driver.edge.clock);
            let beats = clock.and_then(Clock::gap_check_interval);
            let fine = clock.is_some_and(Clock::needs_fine_timer);
            let step = tokio::select! {
                biased;
                () = &mut stop => return,
                step = unconstrained(poll_fn(|context| self.poll_step(context))) => step,
                () = timer.sleep(wake, fine) => Step::Tick,
                () = clock_check(beats) => Step::ClockCheck,
            };
            if !self.is_exclusive() {
                self.standstill = None;
            } else if let Step::Of(_, Work::Request(Request::StandStill(moment, _))) = &step {
                self.standstill = Some(*moment);
            }
            self.hold();
            self.drivers().for_each(Driver::skip_gap);
            if let (Step::Tick, Wake::JumpAfter(_)) = (&step, wake)
                && let Some(distance) = self.jump_distance()
            {
                // What has arrived anywhere is handled before. Where time passes during a silence it has come nearer.
                self.jump = Some(distance);
                for driver in self.drivers() {
                    let at = driver.edge.clock.now() + distance;
                    driver.rotation.hold(Work::Jump(at));
                }
            } else {
                self.catch_up_and_perform(step).await;
            }
            self.release();
            if self.last_yield.elapsed() > super::run_loop::MAX_TIME_WITHOUT_YIELD {
                yield_now().await;
                self.last_yield = Instant::now();
            }
        }
    }

    fn drivers(&mut self) -> impl Iterator<Item = &mut Driver> {
        self.robots.iter_mut().map(|(driver, _)| &mut **driver)
    }

    /// Wall-clock time stands still while a step is taken.
    fn hold(&mut self) {
        let moment = self.standstill.unwrap_or_else(Instant::now);
        for driver in self.drivers() {
            driver.edge.clock.hold(Some(moment));
            driver.edge.begin();
        }
    }

    /// Wall-clock time passes again.
    fn release(&mut self) {
        self.share_silence();
        for driver in self.drivers() {
            driver.edge.clock.hold(None);
        }
    }

    /// Whatever arrives or leaves at one robot ends the silence of all, which is as long as that of any has to be.
    fn share_silence(&mut self) {
        let silences = self.drivers().map(|driver| driver.edge.clock.silence());
        let of_all = silences.reduce(|(one, short), (other, long)| (one.max(other), short.max(long)));
        if let Some((last_activity, silence)) = of_all {
            for driver in self.drivers() {
                driver.edge.clock.set_silence(last_activity, silence);
            }
        }
    }

    fn is_storing(&self) -> bool {
        self.robots.iter().any(|(driver, _)| driver.edge.write.is_some())
    }

    /// Whether a robot serves requests alone.
    fn is_exclusive(&self) -> bool {
        self.robots.iter().any(|(driver, _)| driver.exclusive.is_some())
    }

    /// The next unit of work. While a robot stores something, the others wait for it: what it does next may reach them.
    /// While one serves requests alone, the others serve nothing but requests.
    fn poll_step(&mut self, context: &mut Context<'_>) -> Poll<Step> {
        let (storing, exclusive) = (self.is_storing(), self.is_exclusive());
        let count = self.robots.len();
        if let Some(step) = self.kept.take_if(|_| !storing) {
            return Poll::Ready(step);
        }
        if !storing
            && !exclusive
            && let Poll::Ready(Some(change)) = self.changes.poll_recv(context)
        {
            self.jump = None;
            return Poll::Ready(Step::Outside(change));
        }
        let mut drained = 0;
        for turn in 0..count {
            let index = (self.first + turn) % count;
            let Some((driver, _)) = self.robots.get_mut(index) else {
                continue;
            };
            if storing && driver.edge.write.is_none() {
                continue;
            }
            let polled = if storing || !exclusive || driver.exclusive.is_some() {
                driver.poll_work(context)
            } else {
                driver.poll_request(context)
            };
            match polled {
                Poll::Ready(Work::Jump(_)) => drained += 1,
                Poll::Ready(work) => {
                    self.first = index + 1;
                    self.jump = None;
                    return Poll::Ready(Step::Of(index, work));
                }
                Poll::Pending => {}
            }
        }
        if self.jump.is_some() && drained == count {
            return Poll::Ready(Step::Jump);
        }
        Poll::Pending
    }

    /// Does what was due before a step, and the step; it is kept if something has to be stored before it.
    async fn catch_up_and_perform(&mut self, step: Step) {
        let storing = self.is_storing();
        if !storing
            && self.writes_awaited > 1
            && let Some((late, _)) = self.overdue()
        {
            // Where more has to be stored than the disk can do, a step would wait for ever.
            self.note_lag(late);
        }
        self.catch_up();
        if self.is_storing() && !storing {
            self.kept = Some(step);
            self.writes_awaited += 1;
            return;
        }
        self.perform(step).await;
        let storing = self.is_storing();
        // Everything that follows from an outside line at once has happened.
        if let Some(done) = self.setter.take_if(|_| !storing) {
            // Fails only when nobody waits for it.
            let _ = done.send(());
        }
        if self.kept.is_none() {
            self.writes_awaited = 0;
        }
    }

    async fn perform(&mut self, step: Step) {
        match step {
            Step::Of(index, work) => {
                for driver in self.drivers() {
                    driver.rotation.forget_jump();
                }
                let replaces = matches!(work, Work::Request(Request::Snapshot(..)));
                if let Some((driver, span)) = self.robots.get_mut(index) {
                    driver.perform(work).instrument(span.clone()).await;
                }
                self.align(index);
                // Of several robots that are replaced together, none sees what another was before.
                if !(replaces && self.is_exclusive()) {
                    self.carry(self.lateness());
                }
            }
            Step::Outside((name, on, done)) => {
                self.outside.insert(name, on);
                self.setter = Some(done);
                self.carry(Duration::ZERO);
            }
            Step::Jump => {
                let distance = self.jump.take().unwrap_or_default();
                for driver in self.drivers() {
                    let at = driver.edge.clock.now() + distance;
                    driver.edge.clock.jump(at);
                }
                self.catch_up();
                self.tick();
            }
            Step::Tick => self.tick(),
            Step::ClockCheck => {}
        }
    }

    /// Every robot does what is due now. If one stores something first, the others wait for it.
    fn tick(&mut self) {
        for index in 0..self.robots.len() {
            if !self.is_storing() {
                self.step(index, Duration::ZERO, Input::Tick);
                self.carry(Duration::ZERO);
            }
        }
    }

    /// How long ago the moment is that the robots have reached: time passes while one of them stores something.
    fn lateness(&self) -> Duration {
        let robots = self.robots.iter();
        let late = robots.map(|(driver, _)| driver.edge.clock.now().since(driver.cell.controller.now()));
        late.min().unwrap_or_default()
    }

    /// Time passes for all as it does for one of them.
    fn align(&mut self, index: usize) {
        let mode = self.robots.get(index).map(|(driver, _)| driver.edge.clock.mode());
        for driver in self.drivers() {
            if let Some(mode) = mode.filter(|mode| *mode != driver.edge.clock.mode()) {
                driver.edge.clock.set_mode(mode);
                driver.judge_pace();
            }
        }
    }

    /// What was due before now first: for how long, and the robot.
    fn overdue(&self) -> Option<(Duration, usize)> {
        let overdue = self.robots.iter().enumerate().filter_map(|(index, (driver, _))| {
            let late = driver.edge.clock.now().since(driver.cell.deadline()?);
            (!late.is_zero()).then_some((late, index))
        });
        // Of those that are due at one moment the first robot comes first.
        overdue.max_by_key(|(late, index)| (*late, std::cmp::Reverse(*index)))
    }

    /// What was due before now happens, the earliest first.
    fn catch_up(&mut self) {
        let begun = Instant::now();
        while !self.is_storing() {
            let Some((late, index)) = self.overdue() else {
                break;
            };
            self.step(index, late, Input::Tick);
            self.carry(late);
            if begun.elapsed() > CATCH_UP_SLICE {
                self.note_lag(late);
                break;
            }
        }
        self.update_idle();
    }

    /// The machine is too slow: time goes on from the moment that was reached.
    fn note_lag(&mut self, late: Duration) {
        let mut is_noticeable = false;
        for driver in self.drivers() {
            let reached = before(driver.edge.clock.now(), late);
            is_noticeable |= driver.edge.clock.note_lag(reached);
        }
        if is_noticeable {
            warn!(
                "this machine cannot keep up with the robots joined by wires: virtual time lags (`behind` of /clock)"
            );
        }
    }

    /// Hands an input to a robot, so long before now.
    fn step(&mut self, index: usize, late: Duration, input: Input) {
        if let Some((driver, span)) = self.robots.get_mut(index) {
            let at = before(driver.edge.clock.now(), late);
            // A refusal is an event.
            let _ = span.in_scope(|| driver.cell.feed(at, input, Side::Robot, &mut driver.edge));
        }
    }

    /// Each wire carries its level, and what that brings about, so long before now.
    fn carry(&mut self, late: Duration) {
        let mut changes = 0;
        let mut carried = true;
        while std::mem::take(&mut carried) && !self.is_storing() {
            for index in 0..self.shared.wires.len() {
                let Some((input, on)) = self.change_of(index) else {
                    continue;
                };
                if changes >= MAX_CHANGES_AT_ONCE {
                    if !std::mem::replace(&mut self.has_warned, true) {
                        warn!(
                            "wired lines go on changing each other without any time between; the rest waits"
                        );
                    }
                    return;
                }
                changes += 1;
                carried = true;
                if let Some((robot, line)) = input {
                    debug!(
                        "wire: input {line} of robot {robot} {}",
                        if on { "on" } else { "off" }
                    );
                    self.step(robot, late, Input::Panel(PanelAction::InputLine { line, on }));
                }
            }
        }
        self.update_idle();
    }

    /// Brings the level of a wire up to date. Returns the input that has to follow it, where there is one.
    fn change_of(&mut self, index: usize) -> Option<(Option<(usize, u16)>, bool)> {
        let wire = self.shared.wires.get(index)?;
        let on = match &wire.from {
            WireEnd::Line { robot, line } => {
                let controller = &self.robots.get(*robot)?.0.cell.controller;
                controller.state().powered && controller.signals().output(*line)
            }
            WireEnd::Outside(name) => self.outside.get(name).copied().unwrap_or(false),
        };
        let was = std::mem::replace(self.shared.lock().get_mut(index)?, on);
        match &wire.to {
            WireEnd::Line { robot, line } => {
                let signals = self.robots.get(*robot)?.0.cell.controller.signals();
                // A forced input shows what it is forced to, and the wire as soon as it is released.
                (signals.driven_input(*line) != on).then_some((Some((*robot, *line)), on))
            }
            WireEnd::Outside(name) => {
                self.outside.insert(name.clone(), on);
                (was != on).then_some((None, on))
            }
        }
    }

    /// Automatic time stands still between two jumps while nobody is at any robot.
    fn update_idle(&mut self) {
        let idle = self
            .drivers()
            .all(|driver| driver.edge.is_idle(&driver.cell.controller));
        for driver in self.drivers() {
            driver.edge.clock.set_idle(idle);
        }
    }

    /// When to wake if no input arrives.
    pub(super) fn wake(&self) -> Wake {
        if self.is_storing() || self.is_exclusive() {
            return Wake::Never;
        }
        let mut robots = self.robots.iter();
        let silent = robots.all(|(driver, _)| driver.cell.controller.host_is_silent());
        let wakes = self.robots.iter().map(|(driver, _)| driver.wake(silent));
        wakes.fold(Wake::Never, Wake::min)
    }

    /// How far time jumps after [`Wake::JumpAfter`]: to what is due next at any robot.
    fn jump_distance(&self) -> Option<Duration> {
        let distance = |driver: &Driver| Some(driver.jump_target()?.since(driver.edge.clock.now()));
        self.robots
            .iter()
            .filter_map(|(driver, _)| distance(driver))
            .min()
    }
}

fn before(now: Time, late: Duration) -> Time {
    let late = u64::try_from(late.as_micros()).unwrap_or(u64::MAX);
    Time::from_micros(now.as_micros().saturating_sub(late))
}

#[cfg(test)]
mod tests;
