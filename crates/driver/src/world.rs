//! A world: robots that share one time, and the wires between them. There is no clock and no socket here; the owner
//! supplies the time and carries the outputs out, each at the edge of its robot.
//!
//! This is a simulation of discrete events with delta cycles, as hardware description languages have it. Before anything
//! happens at a moment, everything that was due earlier at any robot has happened, the earliest first, and of several
//! robots due at one moment the first in order. After each event the wires settle in rounds (delta cycles) that take no
//! time: a round compares all wires first, and then feeds every input that has to change. So an exchange of signals takes
//! the same course in real time, scaled, stepped or automatic time, and the same seed gives the same bytes. Nothing is
//! rounded to a common step (quantum), which would be faster and change the order.
//!
//! One robot is a world of one. Time passes alike for all robots of a world; only the moments they count from differ,
//! after a reset or a snapshot of one of them. Start with [`World::feed`].

use crate::seat::{Effects, Seat, Side};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::{Index, IndexMut};
use tracing::{Span, debug};
use ts3100_controller::{Accepted, ActionError, Input, PanelAction, Time};

/// Most rounds in which wires settle at one moment. Further changes wait for the next event.
const MAX_ROUNDS: usize = 256;
/// A wire that changes so often at one moment is in a loop: a handshake that takes no time changes each wire twice.
const MAX_CHANGES: usize = 16;

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
    /// Origin of the level.
    pub from: WireEnd,
    /// End that shows it.
    pub to: WireEnd,
    /// Name of the wire in messages.
    pub name: String,
}

/// A robot of a world.
pub struct Robot<E> {
    /// The controller with its subscribers.
    pub seat: Seat,
    /// Carries its outputs out.
    pub edge: E,
    /// Names the robot in the lines of the log.
    pub span: Span,
    /// Microseconds by which its time is ahead of the world's: each reset and each snapshot begins another count.
    ahead: i64,
}

impl<E> Robot<E> {
    /// Returns the robot's own time at a moment of the world.
    pub fn time_at(&self, moment: Time) -> Time {
        shifted(moment, self.ahead)
    }

    /// The moment of the world at which its own time is this.
    pub fn moment_of(&self, time: Time) -> Time {
        shifted(time, self.ahead.saturating_neg())
    }

    /// Lets its own time be this at a moment of the world.
    pub fn set_time(&mut self, moment: Time, time: Time) {
        let ahead = i128::from(time.as_micros()) - i128::from(moment.as_micros());
        // A snapshot may say any time. One that is beyond the range has no distance to any other.
        self.ahead = i64::try_from(ahead).unwrap_or(i64::MAX);
    }

    /// The moment at which it has something due.
    pub fn deadline(&self) -> Option<Time> {
        self.seat.deadline().map(|due| self.moment_of(due))
    }
}

fn shifted(time: Time, by: i64) -> Time {
    Time::from_micros(time.as_micros().saturating_add_signed(by))
}

/// Something from outside that waits.
enum Waiting {
    /// An input of the robot of this number.
    Input(usize, Input, Side),
    /// The level of an outside line.
    Outside(String, bool),
}

/// Robots of one time with the wires between them, each with an edge `E` that carries its outputs out.
pub struct World<E> {
    robots: Vec<Robot<E>>,
    wires: Vec<Wire>,
    /// The outside lines that have been set.
    outside: BTreeMap<String, bool>,
    /// The wires carry nothing.
    is_cut: bool,
    /// Wires that have been reported as a loop.
    loops: BTreeSet<usize>,
    /// Inputs and levels that wait until nothing is being stored.
    waiting: VecDeque<Waiting>,
    /// A write under way belongs to an input whose result was not known when it was fed, not to something due.
    is_awaited: bool,
    /// The moment that has been reached.
    now: Time,
    /// The time after which due work has to wait.
    late: Option<Time>,
}

impl<E> Index<usize> for World<E> {
    type Output = Robot<E>;

    /// The robot of this number, which [`World::add`] has given.
    fn index(&self, robot: usize) -> &Robot<E> {
        &self.robots[robot]
    }
}

impl<E> IndexMut<usize> for World<E> {
    fn index_mut(&mut self, robot: usize) -> &mut Robot<E> {
        &mut self.robots[robot]
    }
}

impl<E: Effects> Default for World<E> {
    fn default() -> World<E> {
        World::new()
    }
}

impl<E: Effects> World<E> {
    /// A world without robots.
    pub fn new() -> World<E> {
        World {
            robots: Vec::new(),
            wires: Vec::new(),
            outside: BTreeMap::new(),
            is_cut: false,
            loops: BTreeSet::new(),
            waiting: VecDeque::new(),
            is_awaited: false,
            now: Time::ZERO,
            late: None,
        }
    }

    /// Adds a robot at a moment; its own time continues from that of its controller. Returns its number, counted from
    /// 0.
    pub fn add(&mut self, now: Time, seat: Seat, edge: E, span: Span) -> usize {
        let time = seat.controller.now();
        let mut robot = Robot {
            seat,
            edge,
            span,
            ahead: 0,
        };
        robot.set_time(now, time);
        self.robots.push(robot);
        self.robots.len() - 1
    }

    /// Joins the robots with wires, whose ends then show their levels. Nothing else drives these inputs.
    pub fn join(&mut self, wires: Vec<Wire>) {
        for wire in &wires {
            if let WireEnd::Line { robot, line } = &wire.to {
                self.robots[*robot].seat.join_wire(*line);
            }
        }
        self.wires = wires;
        self.settle();
    }

    /// The robots in the order of their numbers.
    pub fn robots(&self) -> &[Robot<E>] {
        &self.robots
    }

    /// The robots themselves.
    pub fn into_robots(self) -> Vec<Robot<E>> {
        self.robots
    }

    /// Mutable access to [`World::robots`].
    pub fn robots_mut(&mut self) -> &mut [Robot<E>] {
        &mut self.robots
    }

    /// The moment of the last event.
    pub fn now(&self) -> Time {
        self.now
    }

    /// The moment at which a robot has something due.
    pub fn deadline(&self) -> Option<Time> {
        self.robots.iter().filter_map(Robot::deadline).min()
    }

    /// Whether a robot stores something. Every input waits for it, because its next action may affect any robot.
    pub fn is_storing(&self) -> bool {
        self.robots.iter().any(|robot| robot.seat.is_waiting())
    }

    /// Whether inputs wait until nothing is being stored.
    pub fn has_waiting_inputs(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// The time that was reached, if the rest of the due work has to wait ([`Effects::is_late`]).
    pub fn take_late(&mut self) -> Option<Time> {
        self.late.take()
    }

    /// Handles an input of a robot at `now`, and all its consequences at any robot. Earlier deadlines are handled
    /// first, each at its own moment.
    ///
    /// While a change of a file is being stored, every input waits; [`Input::Persisted`] of the robot that stores
    /// continues with them, and its result is that of the action that has waited.
    ///
    /// # Errors
    /// Why `input`, an action, had no effect.
    pub fn feed(&mut self, now: Time, robot: usize, input: Input, by: Side) -> Result<Accepted, ActionError> {
        if matches!(input, Input::Persisted(_)) && self.robots[robot].seat.is_waiting() {
            // No time has passed for the robots meanwhile: what else was due happens in the order of all.
            let resumed = self.handle(self.now, robot, input, by);
            let result = if self.is_awaited {
                resumed
            } else {
                Ok(Accepted::Pending)
            };
            self.is_awaited &= result == Ok(Accepted::Pending);
            return self.feed_waiting(now, result);
        }
        // What was due may itself have something to store. Then the input waits too, and keeps its place in the queue.
        let now = self.catch_up(now);
        if self.is_storing() {
            self.waiting.push_back(Waiting::Input(robot, input, by));
            return Ok(Accepted::Pending);
        }
        let result = self.handle(now, robot, input, by);
        self.is_awaited = result == Ok(Accepted::Pending);
        result
    }

    /// Handles the inputs that wait, as far as nothing has to be stored. Returns the first result that is one.
    fn feed_waiting(
        &mut self,
        now: Time,
        mut result: Result<Accepted, ActionError>,
    ) -> Result<Accepted, ActionError> {
        while !self.is_storing()
            && let Some(first) = self.waiting.pop_front()
        {
            let now = self.catch_up(now);
            if self.is_storing() {
                // It came before the others that wait.
                self.waiting.push_front(first);
                break;
            }
            let (robot, input, by) = match first {
                Waiting::Input(robot, input, by) => (robot, input, by),
                Waiting::Outside(name, on) => {
                    self.set_level(now, name, on);
                    continue;
                }
            };
            let next = self.handle(now, robot, input, by);
            self.is_awaited = next == Ok(Accepted::Pending);
            if result == Ok(Accepted::Pending) {
                result = next;
            }
        }
        result
    }

    /// Lets every robot do the work that is due until `now`. If one stores something first, the others wait for it.
    pub fn advance(&mut self, now: Time) {
        let now = self.catch_up(now);
        // A robot that is left out keeps its deadline and is served by the next `advance`.
        for robot in 0..self.robots.len() {
            if !self.is_storing() {
                // Time alone is not refused.
                let _ = self.handle(now, robot, Input::Tick, Side::Robot);
            }
        }
    }

    /// Handles everything that was due before `now`, the earliest first. Returns the moment at which the next input is
    /// handled.
    fn catch_up(&mut self, now: Time) -> Time {
        let mut last = None;
        while !self.is_storing()
            && let Some((due, robot)) = self.overdue(now)
        {
            if let Some(last) = last.replace(robot)
                && self.robots[last].edge.is_late(self.now)
            {
                // The machine is too slow. The input is handled at the moment that was reached, and the clock continues
                // from there: hosts and requests get a turn before the rest of what was due.
                self.late = Some(self.now);
                for robot in &mut self.robots {
                    robot.seat.report_timed_findings(false);
                }
                return self.now;
            }
            // Nobody waits for the result: what a scenario does, and what is refused of it, are events.
            let _ = self.handle(due, robot, Input::Tick, Side::Robot);
        }
        now
    }

    /// Earliest deadline before `now`, with its robot.
    fn overdue(&self, now: Time) -> Option<(Time, usize)> {
        let robots = self.robots.iter().enumerate();
        let due = robots.filter_map(|(number, robot)| Some((robot.deadline()?, number)));
        due.min().filter(|(due, _)| *due < now)
    }

    /// Feeds an input at a moment, and lets the wires settle.
    fn handle(
        &mut self,
        moment: Time,
        robot: usize,
        input: Input,
        by: Side,
    ) -> Result<Accepted, ActionError> {
        self.now = self.now.max(moment);
        let result = self.feed_seat(robot, input, by);
        self.settle();
        result
    }

    fn feed_seat(&mut self, robot: usize, input: Input, by: Side) -> Result<Accepted, ActionError> {
        let robot = &mut self.robots[robot];
        let time = robot.time_at(self.now);
        let Robot { seat, edge, span, .. } = robot;
        span.in_scope(|| seat.feed(time, input, by, edge))
    }

    /// Sets an outside line at `now`, as [`World::feed`] handles an input: earlier deadlines are handled first, and
    /// during a write the level waits in the queue of inputs.
    pub fn set_outside(&mut self, now: Time, name: String, on: bool) {
        let now = self.catch_up(now);
        if self.is_storing() {
            self.waiting.push_back(Waiting::Outside(name, on));
        } else {
            self.set_level(now, name, on);
        }
    }

    fn set_level(&mut self, moment: Time, name: String, on: bool) {
        self.now = self.now.max(moment);
        self.outside.insert(name, on);
        self.settle();
    }

    /// Whether a wire begins at this outside line.
    pub fn can_set(&self, name: &str) -> bool {
        let begins = |wire: &Wire| matches!(&wire.from, WireEnd::Outside(known) if known == name);
        self.wires.iter().any(begins)
    }

    /// The level of each wire.
    pub fn levels(&self) -> Vec<bool> {
        self.wires.iter().map(|wire| self.level(&wire.from)).collect()
    }

    /// The wires carry nothing until [`World::mend_wires`]: of several robots that are replaced together, none sees the
    /// previous state of another.
    pub fn cut_wires(&mut self) {
        self.is_cut = true;
    }

    /// The wires carry again.
    pub fn mend_wires(&mut self) {
        self.is_cut = false;
        self.settle();
    }

    fn level(&self, end: &WireEnd) -> bool {
        match end {
            WireEnd::Line { robot, line } => {
                let controller = &self.robots[*robot].seat.controller;
                controller.state().powered && controller.signals().output(*line)
            }
            WireEnd::Outside(name) => self.outside.get(name).copied().unwrap_or(false),
        }
    }

    /// The level that the end of a wire has to take, if it has another.
    fn change(&self, wire: &Wire) -> Option<bool> {
        let on = self.level(&wire.from);
        let shown = match &wire.to {
            // A forced input shows what it is forced to, and the wire as soon as it is released.
            WireEnd::Line { robot, line } => {
                self.robots[*robot].seat.controller.signals().driven_input(*line)
            }
            WireEnd::Outside(_) => self.level(&wire.to),
        };
        (shown != on).then_some(on)
    }

    /// The levels that ends of wires have to take, each with the number of its wire.
    fn changes(&self) -> Vec<(usize, bool)> {
        let wires = self.wires.iter().enumerate();
        wires
            .filter_map(|(number, wire)| Some((number, self.change(wire)?)))
            .collect()
    }

    /// Lets each wire carry its level, and handles the consequences, in rounds without time. A write in the middle of a
    /// round comes first; the rest of the round is found again by comparing levels.
    fn settle(&mut self) {
        if self.wires.is_empty() || self.is_cut {
            return;
        }
        let mut counts = Vec::new();
        for _ in 0..MAX_ROUNDS {
            // All wires are compared before the first input changes. What a robot answers within a round is seen in the
            // next one, so the order of the wires does not matter.
            let changes = self.changes();
            if changes.is_empty() {
                break;
            }
            counts.resize(self.wires.len(), 0);
            for (number, on) in changes {
                // No change is lost: the end of the write comes through `handle`, which settles again.
                if self.is_storing() {
                    return;
                }
                counts[number] += 1;
                match self.wires[number].to.clone() {
                    WireEnd::Line { robot, line } => {
                        debug!(
                            "wire: input {line} of robot {robot} {}",
                            if on { "on" } else { "off" }
                        );
                        let input = Input::by_hand(PanelAction::InputLine { line, on });
                        // A panel is told nothing.
                        let _ = self.feed_seat(robot, input, Side::Robot);
                    }
                    WireEnd::Outside(name) => {
                        self.outside.insert(name, on);
                    }
                }
            }
        }
        let restless = counts
            .iter()
            .enumerate()
            .filter(|(_, count)| **count >= MAX_CHANGES);
        let restless: BTreeSet<usize> = restless.map(|(number, _)| number).collect();
        if !restless.is_subset(&self.loops) {
            self.report_loop(restless);
        }
    }

    /// Reports wires that keep changing each other, once, at the first robot where one of them ends. They change again
    /// whenever time advances.
    fn report_loop(&mut self, restless: BTreeSet<usize>) {
        let wires = restless.iter().filter_map(|number| self.wires.get(*number));
        let names: Vec<&str> = wires.clone().map(|wire| wire.name.as_str()).collect();
        let input = Input::WireLoop {
            wires: names.join(", "),
        };
        let robot = wires.clone().find_map(|wire| wire.to.robot());
        self.loops.extend(restless);
        if let Some(robot) = robot {
            // Nothing is refused of it.
            let _ = self.feed_seat(robot, input, Side::Robot);
        }
    }
}

#[cfg(test)]
mod tests;
