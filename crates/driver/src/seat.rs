//! A controller, its subscribers, and the one loop that feeds it: an input, everything that was due before, and all
//! outputs. There is no clock and no socket here; the owner supplies the time and carries the outputs out.
//!
//! The daemon, `ts3100 run`, `diff`, tests and fuzzers use the same [`Seat`]. Start with [`Seat::feed`].

use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, VecDeque};
use ts3100_controller::action::{Action, IoKind};
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::{
    Accepted, ActionError, Bytes, Controller, Event, Input, Output, PanelAction, PersistError, Port, Time,
};
use ts3100_proto::calendar::CalendarTime;

/// One of the two sides of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    Host,
    /// The controller.
    Robot,
}

impl Side {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Side {
        match self {
            Side::Host => Side::Robot,
            Side::Robot => Side::Host,
        }
    }
}

/// Something that the owner of a controller has done to its connections, its files or its state.
#[derive(Debug, Clone, Copy)]
pub enum Notice<'a> {
    /// The connection of this port was closed from outside.
    Dropped(Port),
    /// A change of a file could not be stored.
    NotPersisted {
        /// Name of the file.
        name: &'a str,
        reason: &'a str,
    },
    /// Whether findings about the host's timing are reported from now on; they are at first.
    TimedFindings(bool),
    /// This controller is about to take over, with its time.
    Restored(&'a Controller),
    /// This controller in its initial state is about to take over.
    Reset {
        controller: &'a Controller,
        /// Its date, where that is wall-clock time.
        calendar: Option<CalendarTime>,
    },
}

/// Sees everything that happens to a controller, in order. Times are virtual.
pub trait Subscriber: Send {
    /// An input that is about to be handled, and the side that caused it.
    fn input(&mut self, _at: Time, _input: &Input, _by: Side) {}
    /// An output that is about to be carried out.
    fn output(&mut self, _at: Time, _output: &Output) {}
    /// An input and all its outputs have been handled. Inputs that follow from them may be waiting, such as the end of a
    /// connection that an output has closed.
    fn settled(&mut self, _at: Time, _controller: &Controller) {}
    /// An input and all that follows from it have been handled: no input waits, and no change of a file.
    fn all_settled(&mut self, _controller: &Controller) {}
    /// The owner has done something around the controller.
    fn notice(&mut self, _at: Time, _notice: Notice<'_>) {}
    /// Nothing more follows immediately: write the collected data.
    fn flush(&mut self) {}
    /// Whether it needs an event for each statement; these are frequent.
    fn wants_statements(&self) -> bool {
        false
    }
}

/// A planned action.
#[derive(Debug, Clone, PartialEq)]
pub enum PlannedAction {
    /// An input of the controller.
    Input(Input),
    /// The connection of this port is closed from outside.
    Drop(Port),
}

/// Plans actions, as a scenario does.
pub trait ActionSource: Send {
    /// Time of the next action.
    fn deadline(&self) -> Option<Time>;
    /// Takes the next action that is due at `now`, with its time.
    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)>;
}

/// The world around a controller.
pub trait Effects {
    /// An input that is about to be handled at `at`, and the controller before it.
    fn input(&mut self, _at: Time, _input: &Input, _controller: &Controller) {}

    /// Stores a change of a file, which the controller makes afterwards; without content the file is erased. Returns why
    /// it is not stored, after which the controller does not make the change, or `None` while it is being stored: then
    /// the owner feeds [`Input::Persisted`] later.
    fn persist(
        &mut self,
        _at: Time,
        _name: &str,
        _content: Option<Bytes>,
    ) -> Option<Result<(), PersistError>> {
        Some(Ok(()))
    }

    /// Whether something is being stored: no output follows before the owner has fed [`Input::Persisted`].
    fn is_storing(&self) -> bool {
        false
    }

    /// Carries out an output. Returns the inputs that result from it at once.
    fn perform(&mut self, at: Time, output: Output, controller: &Controller) -> Vec<Input>;

    /// Whether overdue work, done up to the time `reached`, has taken so long that its rest has to wait.
    fn is_late(&mut self, _reached: Time) -> bool {
        false
    }

    /// An input and its consequences have been handled, except those that wait for a write. Returns whether all
    /// subscribers see statements from now on; `None` changes nothing.
    fn settled(&mut self, _controller: &Controller) -> Option<bool> {
        None
    }
}

/// A controller without surroundings: every change of a file is kept, outputs are dropped.
impl Effects for () {
    fn perform(&mut self, _at: Time, _output: Output, _controller: &Controller) -> Vec<Input> {
        Vec::new()
    }
}

/// Subscribers and plan of a controller.
#[derive(Default)]
struct Audience {
    subscribers: Vec<Box<dyn Subscriber>>,
    actions: Option<Box<dyn ActionSource>>,
}

impl Clone for Audience {
    /// Returns an empty audience: a copy has no listeners.
    fn clone(&self) -> Audience {
        Audience::default()
    }
}

/// A controller with its subscribers; a copy has none.
#[derive(Clone)]
pub struct Seat {
    /// The controller. It changes only by [`Seat::feed`] and by being replaced.
    pub controller: Controller,
    audience: Audience,
    /// Findings about the host's timing are reported.
    timed_findings: bool,
    /// Statements are of interest to all subscribers.
    statements_awaited: bool,
    /// Digital inputs at which wires end: nothing else drives them.
    wired_inputs: BTreeSet<u16>,
    /// Inputs that have not been handled yet, each with the side that caused it.
    inputs: VecDeque<(Input, Side, Source)>,
    /// The step that waits until something is stored; every input waits for it.
    waiting: Option<Step>,
}

/// Origin of an input.
#[derive(Clone, Copy)]
enum Source {
    /// It was due before the input that is next.
    Due,
    /// It was handed to [`Seat::feed`].
    Fed,
    /// It follows from another.
    Follows,
}

/// An input that has been handled, with its result, and its outputs as far as they are carried out.
#[derive(Clone)]
struct Step {
    at: Time,
    source: Source,
    result: Result<Accepted, ActionError>,
    /// Name of the file whose change is being stored.
    file: Option<String>,
}

impl Seat {
    /// A seat with this controller and no subscriber.
    pub fn new(controller: Controller) -> Seat {
        Seat {
            controller,
            audience: Audience::default(),
            timed_findings: true,
            statements_awaited: false,
            wired_inputs: BTreeSet::new(),
            inputs: VecDeque::new(),
            waiting: None,
        }
    }

    /// Adds a subscriber; it sees everything from now on.
    pub fn subscribe(&mut self, subscriber: Box<dyn Subscriber>) {
        self.audience.subscribers.push(subscriber);
        self.await_statements(self.statements_awaited);
    }

    /// Sets the source of planned inputs.
    pub fn plan(&mut self, actions: Box<dyn ActionSource>) {
        self.audience.actions = Some(actions);
    }

    /// Sets whether findings about the host's timing are reported; they are wrong while virtual time runs slower than
    /// the host's clock. Subscribers are told of a change, so that a replay reports the same findings.
    pub fn report_timed_findings(&mut self, on: bool) {
        if std::mem::replace(&mut self.timed_findings, on) != on {
            self.notify(self.controller.now(), Notice::TimedFindings(on));
        }
    }

    /// Sets whether every subscriber sees the events of statements, and not only those that want them.
    pub fn await_statements(&mut self, on: bool) {
        self.statements_awaited = on;
        let mut subscribers = self.audience.subscribers.iter();
        let traced = on || subscribers.any(|subscriber| subscriber.wants_statements());
        self.controller.trace(traced);
    }

    /// Replaces the controller. The subscribers see its statements as they saw those of the one before, and so does an
    /// inspection.
    pub fn replace(&mut self, controller: Controller) {
        let inspection = self.controller.take_inspection();
        self.controller = controller;
        if let Some(inspection) = inspection {
            self.controller.inspect(inspection);
        }
        self.await_statements(self.statements_awaited);
    }

    /// Lets a wire drive this digital input, with inputs of [`Side::Robot`]; other drivers have no effect.
    pub(crate) fn join_wire(&mut self, line: u16) {
        self.wired_inputs.insert(line);
    }

    /// The input; nothing but time where it would drive the end of a wire and is not of the wire.
    fn beside_wires(&self, input: Input, by: Side) -> Input {
        if let Input::Action {
            action:
                Action::Panel(PanelAction::InputLine { line, .. })
                | Action::Pulse {
                    side: IoKind::Input,
                    line,
                    ..
                },
            ..
        } = &input
            && by == Side::Host
            && self.wired_inputs.contains(line)
        {
            return Input::Tick;
        }
        input
    }

    /// Whether something is being stored: every input waits until the owner has fed [`Input::Persisted`].
    pub fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// Earliest deadline of the controller and of the planned inputs.
    pub fn deadline(&self) -> Option<Time> {
        let actions = self.audience.actions.as_ref();
        let planned = actions.and_then(|actions| actions.deadline());
        self.controller.poll_deadline().into_iter().chain(planned).min()
    }

    /// Tells every subscriber.
    pub fn notify(&mut self, at: Time, notice: Notice<'_>) {
        for subscriber in &mut self.audience.subscribers {
            subscriber.notice(at, notice);
        }
    }

    /// Tells every subscriber that no immediate consequence is left.
    pub fn flush(&mut self) {
        for subscriber in &mut self.audience.subscribers {
            subscriber.flush();
        }
    }

    /// Handles an input at `now` and every input that results from it. What was due before is handled first, each item
    /// at its own time.
    ///
    /// While a change of a file is being stored, every input waits; [`Input::Persisted`] continues them, and its result
    /// is that of the input that was fed.
    ///
    /// # Errors
    /// Why `input`, an action, had no effect. The refusals of other actions that come with it are events.
    pub fn feed(
        &mut self,
        mut now: Time,
        input: Input,
        by: Side,
        effects: &mut impl Effects,
    ) -> Result<Accepted, ActionError> {
        let mut fed = Ok(Accepted::Pending);
        let mut resumed = None;
        match (self.beside_wires(input, by), self.waiting.take()) {
            (Input::Persisted(answer), Some(mut step)) => {
                self.answer(&mut step, answer);
                resumed = Some(step);
            }
            (input, None) => self.inputs.push_back((input, by, Source::Fed)),
            (input, waiting) => {
                self.inputs.push_back((input, by, Source::Follows));
                self.waiting = waiting;
                return fed;
            }
        }
        loop {
            let step = if let Some(step) = resumed.take() {
                step
            } else if let Some((at, input, by, source)) = self.next_input(now, effects) {
                for subscriber in &mut self.audience.subscribers {
                    subscriber.input(at, &input, by);
                }
                effects.input(at, &input, &self.controller);
                Step {
                    at,
                    source,
                    result: self.controller.handle(at, input),
                    file: None,
                }
            } else {
                break;
            };
            let source = step.source;
            match (self.put_out(step, effects), source) {
                (None, _) => break,
                (Some(result), Source::Fed) => fed = result,
                // What is due after the time that was reached has to wait.
                (Some(_), Source::Due) if effects.is_late(self.controller.now()) => {
                    now = self.controller.now();
                }
                (Some(_), Source::Due | Source::Follows) => {}
            }
        }
        if !self.is_waiting() {
            for subscriber in &mut self.audience.subscribers {
                subscriber.all_settled(&self.controller);
            }
        }
        self.flush();
        if let Some(on) = effects.settled(&self.controller) {
            self.await_statements(on);
        }
        fed
    }

    /// The next input with its time: first those due before `now`, then those fed, then their consequences.
    fn next_input(&mut self, now: Time, effects: &mut impl Effects) -> Option<(Time, Input, Side, Source)> {
        // The controller has nothing overdue after an input; what it has put out can make planned inputs due.
        while !self.inputs.is_empty() || self.audience.actions.is_some() {
            // At one moment a plan comes before the controller's own deadline.
            let due = self.controller.poll_deadline().filter(|due| *due < now);
            let actions = self.audience.actions.as_mut();
            let planned = actions.and_then(|actions| actions.take_due(due.unwrap_or(now)));
            let (at, planned) = match (planned, due) {
                (Some(planned), _) => planned,
                (None, Some(due)) => (due, PlannedAction::Input(Input::Tick)),
                (None, None) => {
                    let (input, by, source) = self.inputs.pop_front()?;
                    return Some((now, input, by, source));
                }
            };
            let at = at.max(self.controller.now());
            match planned {
                // The refusal of a planned action is an event; no caller waits for its result.
                PlannedAction::Input(input) => {
                    let by = self.inputs.front().map_or(Side::Robot, |(_, by, _)| *by);
                    let input = self.beside_wires(input, Side::Host);
                    return Some((at, input, by, Source::Due));
                }
                PlannedAction::Drop(port) => self.drop_peer(at, port, effects),
            }
        }
        None
    }

    /// Closes the connection of a port from outside, if it has one.
    fn drop_peer(&mut self, at: Time, port: Port, effects: &mut impl Effects) {
        if self.controller.peer(port).is_none() {
            return;
        }
        self.notify(at, Notice::Dropped(port));
        let how = DisconnectMode::Close;
        let close = Output::Disconnect { port, how };
        self.perform(at, close, effects);
    }

    /// Carries an output out. The inputs that result from it come from the robot's side.
    fn perform(&mut self, at: Time, output: Output, effects: &mut impl Effects) {
        let inputs = effects.perform(at, output, &self.controller).into_iter();
        let inputs = inputs.map(|input| (input, Side::Robot, Source::Follows));
        self.inputs.extend(inputs);
    }

    /// Carries out the outputs of the controller. Returns the result of the step, or `None` if it waits until something
    /// is stored.
    fn put_out(
        &mut self,
        mut step: Step,
        effects: &mut impl Effects,
    ) -> Option<Result<Accepted, ActionError>> {
        let at = step.at;
        while let Some(output) = self.controller.poll_output() {
            if let Output::Persist { name, content } = output {
                let answer = effects.persist(at, &name, content);
                step.file = Some(name);
                let Some(answer) = answer else {
                    // No output that follows is carried out before the disk has it: an OK promises that the file is
                    // stored.
                    self.waiting = Some(step);
                    return None;
                };
                self.answer(&mut step, answer);
                continue;
            }
            if !self.timed_findings && is_timed_finding(&output) {
                continue;
            }
            let statement = matches!(output, Output::Event(Event::Statement { .. }));
            for subscriber in &mut self.audience.subscribers {
                if !statement || self.statements_awaited || subscriber.wants_statements() {
                    subscriber.output(at, &output);
                }
            }
            // Whatever a peer has received is in the recordings, even if the process is killed at once.
            if matches!(output, Output::Send { .. }) {
                self.flush();
            }
            self.perform(at, output, effects);
            // The output has begun a write by itself: the history of an alarm. An answer that reports the alarm waits
            // for it.
            if effects.is_storing() {
                self.waiting = Some(step);
                return None;
            }
        }
        for subscriber in &mut self.audience.subscribers {
            subscriber.settled(at, &self.controller);
        }
        Some(step.result)
    }

    /// Hands the answer to a change of a file to the controller. An action that waited for it has its result now.
    fn answer(&mut self, step: &mut Step, answer: Result<(), PersistError>) {
        // Without a name it was the error history, which the controller does not wait for.
        let Some(name) = step.file.take() else {
            return;
        };
        if let Err(reason) = &answer {
            let (name, reason) = (&name, &reason.to_string());
            self.notify(step.at, Notice::NotPersisted { name, reason });
        }
        let answered = self.controller.handle(step.at, Input::Persisted(answer));
        if step.result == Ok(Accepted::Pending) {
            step.result = answered;
        }
    }
}

/// Whether the output is a finding about the host's timing.
fn is_timed_finding(output: &Output) -> bool {
    matches!(output, Output::Event(Event::Finding(finding)) if finding.rule.timed)
}
