//! A task: a machine with its state, and the statements left in its scan.
//!
//! How tasks take turns is in `scheduler`.

use super::scol_inputs::ScolInputs;
use super::step::Step;
use crate::alarm::AlarmCode;
use crate::limits::{SCAN, STATEMENTS_PER_SCAN};
use crate::options::WaitAfterStop;
use crate::port::Port;
use crate::prelude::*;
use crate::snapshot_error::{SnapshotError, check};
use crate::time::Time;
use crate::told::{StatementDetail, StatementEffect};
use alloc::sync::Arc;
use core::fmt::Display;
use core::time::Duration;
use scol_mini::{
    Answer, Arm, Channel, Fault, Jump, Machine, Memory, MonitorAction, Number, Pause, Program, Recipient,
};

/// A task at a moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskView {
    /// 1 the main program, 0 the statement of DO.
    pub id: u16,
    /// Current file line.
    pub line: u32,
    /// The name of the state of the task, or of its handler while one acts.
    pub state: &'static str,
    /// The channel from which it waits for values.
    pub reads: Option<Channel>,
    /// Its open calls, outermost first, then those of its handler: name of the program and file line.
    pub calls: Vec<(String, u32)>,
}

/// State of a task. Every change goes through [`Task::enter`].
///
/// ```text
///             statement asks                        motion ends, time is over, values are there
///   Ready -------------------> Moving, Delaying, Reading ------------------------------> Ready
///   | ^ ^                        ^   ^
///   | | |   statement done again |   | it begins
///   | | +--- Holding, Resting ---+   +--- Queued: a MOVE after a motion with PASS
///   | +----- Pausing: next scan
///   +-------> Watching: WAIT is false; Ready when it is true
/// ```
/// A stop lets a motion, a DELAY and their waits end, and ends the others (CMD-SP-03); BREAK ends all but a motion that can be
/// taken up again.
///
/// No state is left for another waiting one: the machine holds one request, and its answer or its end (`Ready`) comes first.
/// The exceptions are one statement each: a queued motion that begins, and an INPUT that has some of its values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum TaskState {
    /// The next statement may run.
    Ready,
    /// The statements of this scan are used up.
    Pausing {
        /// The next scan.
        until: Time,
    },
    /// A motion statement waits for the feed hold to end before it begins.
    Holding,
    /// A motion is under way.
    Moving {
        /// Time before the end of the motion at which the statement ends.
        lead: Duration,
    },
    /// A motion has been put after the one under way (PASS); the statement becomes `Moving` when it begins.
    Queued {
        /// As of `Moving`.
        lead: Duration,
        /// The statement ends when the motion begins: PASS reads the motion after it, NOWAIT does not wait for its end.
        passing: bool,
    },
    /// The statement waits for the arm to rest before it begins.
    Resting,
    /// DELAY.
    Delaying {
        /// Its end.
        until: Time,
    },
    /// INPUT waits for values.
    Reading {
        channel: Channel,
        /// How many values it takes.
        wanted: usize,
        /// Those it has.
        got: Vec<Number>,
    },
    /// WAIT: its condition was false.
    Watching {
        /// When to look again; `None` when only something from outside can change it.
        again: Option<Time>,
    },
}

impl TaskState {
    /// Whether the statement has asked for something and waits for the answer.
    pub(crate) fn needs_answer(&self) -> bool {
        // Resting may follow a statement that is over: BREAK, and END after a motion with NOWAIT.
        !matches!(
            self,
            TaskState::Ready | TaskState::Pausing { .. } | TaskState::Resting | TaskState::Watching { .. }
        )
    }

    /// Whether this state can become `next`. A statement that waits ends, or is broken off, before another one begins:
    /// only a queued motion begins, and INPUT continues to wait for its missing values.
    fn may_become(&self, next: &TaskState) -> bool {
        match (self, next) {
            // Nothing has been asked for: the next statement, or the same WAIT, may ask for anything.
            (TaskState::Ready | TaskState::Pausing { .. } | TaskState::Watching { .. }, _)
            // The statement is over, or broken off by a stop.
            | (_, TaskState::Ready)
            | (TaskState::Queued { .. }, TaskState::Moving { .. })
            | (TaskState::Reading { .. }, TaskState::Reading { .. }) => true,
            (
                TaskState::Holding
                | TaskState::Moving { .. }
                | TaskState::Queued { .. }
                | TaskState::Resting
                | TaskState::Delaying { .. }
                | TaskState::Reading { .. },
                _,
            ) => false,
        }
    }

    /// When it ends by itself.
    fn until(&self) -> Option<Time> {
        if let TaskState::Pausing { until }
        | TaskState::Delaying { until }
        | TaskState::Watching { again: Some(until) } = self
        {
            return Some(*until);
        }
        None
    }

    /// Time before the end of its motion at which the statement ends.
    pub(crate) fn lead(&self) -> Option<Duration> {
        if let TaskState::Moving { lead } = self {
            return Some(*lead);
        }
        None
    }

    /// The channel from which an INPUT waits for values.
    pub(crate) fn channel(&self) -> Option<Channel> {
        if let TaskState::Reading { channel, .. } = self {
            return Some(*channel);
        }
        None
    }

    /// Whether the statement waits for its motion.
    pub(crate) fn is_motion(&self) -> bool {
        matches!(self, TaskState::Moving { .. } | TaskState::Queued { .. })
    }
}

/// A machine and its state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// The interpreter.
    machine: Machine,
    state: TaskState,
    /// Statements left in the present scan.
    budget: u32,
    /// When the present scan began.
    scan_at: Time,
    /// Action of a monitor under way; the task continues after it.
    handler: Option<Box<Task>>,
    /// When the monitors are to be looked at again, if time alone can change them.
    look_at: Option<Time>,
    /// Its motion stays at the present height of the tool point (MP,1).
    pub(crate) keeps_height: bool,
    /// The values that the last statement got from the answer to its request, until it is told with the next one.
    #[serde(skip)]
    received: Vec<StatementEffect>,
}

impl Task {
    /// A task at its first statement.
    pub(crate) fn new(machine: Machine, now: Time) -> Task {
        Task {
            machine,
            state: TaskState::Ready,
            budget: STATEMENTS_PER_SCAN,
            scan_at: now,
            handler: None,
            look_at: None,
            keeps_height: false,
            received: Vec::new(),
        }
    }

    /// Ends a waiting INPUT with the values received so far (INP-09, INP-10); false if none waits.
    pub(crate) fn end_reading(&mut self, memory: &mut Memory) -> bool {
        let TaskState::Reading { got, .. } = &self.state else {
            return false;
        };
        // A value the variable cannot hold is lost with the INPUT.
        let answer = Answer::Cancelled(got.clone());
        if self.machine.answer(memory, answer).is_err() {
            self.machine.skip();
        }
        self.enter(TaskState::Ready);
        true
    }

    /// An INPUT that waits at this port, in the task or in the action of its monitor, has all its values: those that
    /// came, then zeros. The task continues at its next turn.
    pub(crate) fn release_input(&mut self, port: Port) {
        if let Some(handler) = &mut self.handler {
            handler.release_input(port);
        }
        if let TaskState::Reading { channel, wanted, got } = &mut self.state
            && Port::from_channel(*channel) == Some(port)
        {
            got.resize(*wanted, Number::Integer(0));
        }
    }

    /// The next cycle: to the label `RCYCLE`, or to step 1.
    pub(crate) fn begin_cycle(&mut self) {
        if !self.machine.go_to_rcycle() {
            self.machine.restart();
        }
        self.enter(TaskState::Ready);
        self.handler = None;
    }

    /// To the label `RCYCLE`; false (and nothing done) without one.
    pub(crate) fn go_to_rcycle(&mut self) -> bool {
        let found = self.machine.go_to_rcycle();
        if found {
            self.enter(TaskState::Ready);
            self.handler = None;
        }
        found
    }

    /// The task for display; none is active while its program does not run.
    pub(crate) fn view(&self, runs: bool) -> TaskView {
        let acting = self.acting();
        let state = match &acting.state {
            TaskState::Ready => "ready",
            TaskState::Pausing { .. } => "running",
            TaskState::Holding => "held",
            TaskState::Moving { .. } => "moving",
            TaskState::Queued { .. } => "queued",
            TaskState::Resting => "resting",
            TaskState::Delaying { .. } => "delay",
            TaskState::Reading { .. } => "input",
            TaskState::Watching { .. } => "wait",
        };
        TaskView {
            id: self.id(),
            line: acting.machine.line(),
            state: if runs { state } else { "stopped" },
            reads: acting.state.channel().filter(|_| runs),
            calls: self
                .parts()
                .flat_map(|part| part.machine.calls())
                .map(|(name, line)| (String::from(name), line))
                .collect(),
        }
    }

    pub(crate) fn state(&self) -> &TaskState {
        &self.state
    }

    /// Changes the state: the only way to do so.
    pub(crate) fn enter(&mut self, next: TaskState) {
        debug_assert!(
            self.state.may_become(&next),
            "task {}: {:?} cannot become {next:?}",
            self.id(),
            self.state
        );
        self.state = next;
    }

    /// Lets the statement under way wait in this state.
    pub(crate) fn wait(&mut self, state: TaskState) -> Step {
        self.enter(state);
        Step::Blocked
    }

    /// The interpreter, to ask it.
    pub(crate) fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The interpreter, for what somebody changes in a program that has stopped.
    pub(crate) fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// File line of the statement under way or next.
    pub(crate) fn line(&self) -> u32 {
        self.machine.line()
    }

    /// Whether the next instruction begins a statement. A WAIT that looks again has begun already.
    pub(crate) fn begins_statement(&self) -> bool {
        self.machine.begins_statement() && !matches!(self.state, TaskState::Watching { .. })
    }

    /// Whether statements are left in the scan; otherwise it pauses until the next one.
    pub(crate) fn has_budget(&mut self, now: Time) -> bool {
        // A task that was blocked begins a new scan when it goes on: only one that never waits has to pause.
        if self.scan_at < now {
            self.budget = STATEMENTS_PER_SCAN;
            self.scan_at = now;
        }
        if self.budget == 0 {
            self.enter(TaskState::Pausing { until: now + SCAN });
        }
        self.budget > 0
    }

    /// The instant of which a WAIT sees the inputs. It looks once a scan at inputs that change by time alone, however often the
    /// task is asked in between: otherwise the polling of a host would decide when the WAIT ends.
    pub(crate) fn sees(&self, now: Time) -> Time {
        if let TaskState::Watching { again: Some(again) } = self.state
            && again > now
        {
            return again - SCAN;
        }
        now
    }

    /// Executes one statement, or as many as are left in the scan; a WAIT that is still false was counted before.
    pub(crate) fn run(&mut self, memory: &mut Memory, inputs: &ScolInputs, single: bool) -> Pause {
        let given = match (&self.state, single) {
            (TaskState::Watching { .. }, _) => 0,
            (_, true) => 1,
            (_, false) => self.budget,
        };
        let mut fuel = given;
        let pause = self.machine.run(memory, inputs, &mut fuel);
        self.ran(pause, given - fuel, inputs)
    }

    /// Takes note of what the machine did.
    fn ran(&mut self, pause: Pause, used: u32, inputs: &ScolInputs) -> Pause {
        self.budget = self.budget.saturating_sub(used);
        self.enter(match &pause {
            Pause::Waiting => TaskState::Watching {
                again: inputs.next_look(),
            },
            Pause::Fuel | Pause::Ended | Pause::Fault(_) | Pause::Request(_) => TaskState::Ready,
        });
        pause
    }

    /// Executes one statement as [`Task::run`] does, and returns what is told of it.
    pub(crate) fn run_told(
        &mut self,
        memory: &mut Memory,
        inputs: &ScolInputs,
        arm: Arm,
    ) -> (Pause, Box<StatementDetail>) {
        let received = core::mem::take(&mut self.received);
        let (mut fuel, mut effects) = (1, Vec::new());
        let pause = self.machine.run_told(memory, inputs, &mut fuel, &mut effects);
        let effects = effects
            .into_iter()
            .map(|effect| StatementEffect::new(effect, arm));
        let effects = effects.collect();
        let detail = Box::new(StatementDetail { received, effects });
        (self.ran(pause, 1 - fuel, inputs), detail)
    }

    /// The values that these variables got are told with the next statement.
    pub(crate) fn note_received(&mut self, memory: &Memory, recipients: &[Recipient], arm: Arm) {
        if self.machine.pending().is_none() {
            let received = self.machine.received(memory, recipients);
            self.received = received.map(|effect| StatementEffect::new(effect, arm)).collect();
        }
    }

    /// Answers the request of the statement under way.
    pub(crate) fn answer(&mut self, memory: &mut Memory, answer: Answer, motion: bool) -> Step {
        self.enter(TaskState::Ready);
        match self.machine.answer(memory, answer) {
            Ok(()) => Step::Done { motion },
            Err(fault) => self.fail(&fault),
        }
    }

    /// A statement that cannot be executed is given up; its alarm of level 2 stops the program after it.
    pub(crate) fn fail(&mut self, fault: &Fault) -> Step {
        self.machine.skip();
        Step::fault(fault)
    }

    /// The same, with a reason of the robot.
    pub(crate) fn give_up(&mut self, code: AlarmCode, reason: impl Display) -> Step {
        let step = self.alarm(code, reason);
        self.machine.skip();
        step
    }

    /// The current statement has a fault and stays current.
    pub(crate) fn alarm(&self, code: AlarmCode, reason: impl Display) -> Step {
        let line = self.line();
        Step::Alarm {
            code,
            line: Some(line),
            detail: format!("line {line}: {reason}"),
        }
    }

    /// Ends the present step for a stop, if that is possible now; returns whether the task is between steps, or waits
    /// for an arm that is `paused`.
    pub(crate) fn end_step(&mut self, memory: &mut Memory, wait: WaitAfterStop, paused: bool) -> bool {
        if let Some(handler) = &mut self.handler
            && !handler.end_step(memory, wait, paused)
        {
            return false;
        }
        self.end_reading(memory);
        match &self.state {
            // These end with the motion, so the stop waits for it, unless PAUSE holds the arm
            // (`Executor::waits_for_resume`).
            TaskState::Moving { .. } | TaskState::Queued { .. } | TaskState::Resting | TaskState::Holding => {
                return paused;
            }
            // SP lets a DELAY end (CMD-SP-03, sp.txt).
            TaskState::Delaying { .. } => return false,
            TaskState::Watching { .. } if wait == WaitAfterStop::Next => self.machine.skip(),
            TaskState::Watching { .. }
            | TaskState::Ready
            | TaskState::Pausing { .. }
            | TaskState::Reading { .. } => {}
        }
        self.enter(TaskState::Ready);
        true
    }

    /// The current statement will be repeated, except an INPUT, which has ended: true. One that waits for its motion
    /// continues to wait if the motion can be resumed.
    pub(crate) fn abort_step(&mut self, memory: &mut Memory, keeps_motion: bool) -> bool {
        if let Some(handler) = &mut self.handler {
            handler.abort_step(memory, keeps_motion);
        }
        let reading = self.end_reading(memory);
        if !(self.state.is_motion() && keeps_motion) {
            self.enter(TaskState::Ready);
        }
        reading
    }

    /// Restarts the motion that was cut short: that of the current statement, or of the statement before it if the
    /// current one has not begun to move.
    pub(crate) fn redo_motion(&mut self) {
        if !matches!(self.state, TaskState::Moving { .. }) {
            self.machine.redo_motion_before();
        }
        self.enter(TaskState::Ready);
        if let Some(handler) = &mut self.handler {
            handler.redo_motion();
        }
    }

    /// Drops the motion that could restart: all motions have ended.
    pub(crate) fn end_motion(&mut self) {
        self.machine.end_motion_before();
        if let Some(handler) = &mut self.handler {
            handler.end_motion();
        }
    }

    /// Continues in a program with the same steps.
    pub(crate) fn relocate(&mut self, program: &Arc<Program>) {
        self.machine.relocate(program);
        if let Some(handler) = &mut self.handler {
            handler.relocate(program);
        }
    }

    /// Takes the handler out, to carry it forward. While it acts, or the task is to stop, the monitors are not looked at, so
    /// their time is dropped: it would stay due for ever.
    pub(crate) fn take_handler(&mut self, stopping: bool) -> Option<Box<Task>> {
        let handler = self.handler.take();
        if stopping || handler.is_some() {
            self.look_at = None;
        }
        handler
    }

    /// Takes the action of a monitor, to begin or continue it.
    pub(crate) fn put_handler(&mut self, handler: Box<Task>) {
        self.handler = Some(handler);
    }

    /// The action of a monitor, while one is under way.
    pub(crate) fn handler_mut(&mut self) -> Option<&mut Task> {
        self.handler.as_deref_mut()
    }

    /// The action of a monitor has ended.
    pub(crate) fn end_handler(&mut self, handler: &Task) -> Step {
        match self.machine.end_handler(&handler.machine) {
            Ok(()) => Step::DONE,
            Err(fault) => Step::monitor_fault(&fault),
        }
    }

    /// The instant of which the monitors see the inputs, as in `sees()`. They look between statements, at each change, and once
    /// a scan while time alone can change their inputs. `None` without monitors.
    pub(crate) fn monitors_see(&mut self, now: Time) -> Option<Time> {
        let due = self.look_at.take();
        let due = due.filter(|due| *due > now && self.state != TaskState::Ready);
        let seen = due.map_or(now, |due| due - SCAN);
        self.machine.has_monitors().then_some(seen)
    }

    /// Asks the monitors for an action.
    pub(crate) fn check_monitors(
        &mut self,
        memory: &mut Memory,
        inputs: &ScolInputs,
    ) -> Result<Option<MonitorAction>, Fault> {
        let found = self.machine.check_monitors(memory, inputs);
        self.look_at = inputs.next_look();
        found
    }

    /// A monitor jumps. An INPUT ends as at a stop: missing values are 0.
    pub(crate) fn jump(&mut self, memory: &mut Memory, jump: Jump) {
        self.end_reading(memory);
        self.machine.jump(jump);
        self.enter(TaskState::Ready);
    }

    /// ID of the task: 1 the main program, 0 the statement of DO.
    pub(crate) fn id(&self) -> u16 {
        self.machine.task_id()
    }

    /// The handler while it has something to do, otherwise the task itself.
    pub(crate) fn acting(&self) -> &Task {
        match self.handler.as_deref() {
            Some(handler) if handler.state != TaskState::Ready => handler,
            _ => self,
        }
    }

    /// The task, and the handler in front of it.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &Task> {
        core::iter::once(self).chain(self.handler.as_deref())
    }

    /// Whether the task cannot continue at this instant: the statements of its scan are used up, and it has no
    /// monitors.
    pub(crate) fn sleeps(&self, now: Time) -> bool {
        let watched = self.look_at.is_some() || self.machine.has_monitors();
        self.handler.is_none()
            && !watched
            && matches!(self.state, TaskState::Pausing { until } if until > now)
    }

    /// The time at which the task can continue without an event. Its monitors are not evaluated while it is to stop or
    /// its handler acts.
    pub(crate) fn deadline(&self, stopping: bool) -> Option<Time> {
        let own = self.acting().state.until();
        let look_at = self.look_at.filter(|_| !stopping && self.handler.is_none());
        own.into_iter().chain(look_at).min()
    }
}

impl Task {
    /// Gives a task that was read back its program, and validates it.
    pub(crate) fn relink(&mut self, place: &str, program: &Arc<Program>) -> Result<(), SnapshotError> {
        self.machine
            .relink(Arc::clone(program))
            .map_err(|reason| SnapshotError::program(&format!("{place}.machine"), reason))?;
        if let Some(handler) = &mut self.handler {
            let place = format!("{place}.handler");
            let (nested, expected) = (handler.handler.is_some(), "none: a handler has none");
            check(!nested, &format!("{place}.handler"), expected, "one")?;
            handler.relink(&place, program)?;
        }
        let (budget, expected) = (self.budget, format!("at most {STATEMENTS_PER_SCAN}"));
        let fits = budget <= STATEMENTS_PER_SCAN;
        check(fits, &format!("{place}.budget"), &expected, budget)?;
        let place = format!("{place}.state");
        if let TaskState::Reading { wanted, got, .. } = &self.state {
            let expected = format!("at most {wanted} values");
            check(got.len() <= *wanted, &place, &expected, got.len())?;
        }
        let asked = !self.state.needs_answer() || self.machine.pending().is_some();
        check(asked, &place, "a statement that waits for its answer", "none")
    }
}
