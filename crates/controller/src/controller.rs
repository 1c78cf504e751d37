//! The controller value: one input, its effects, and the deadlines. It alone sees the ports ([`Endpoints`]) and the
//! robot ([`Robot`]) together: it owns time, hands each input to the part it is for, and carries the result to the
//! other.

mod commands;
mod owner;
mod peers;
mod texts;
mod timers;

use crate::action::{Accepted, ActionError};
use crate::alarm::Alarm;
use crate::drive::{DriveError, PersistError};
use crate::endpoint::Endpoints;
use crate::input::Input;
use crate::options::Config;
use crate::output::Output;
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::SelectError;
use crate::robot::Robot;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::name::FileName;

/// The robot controller.
#[derive(Debug, PartialEq)]
pub struct Controller {
    /// Several kilobytes, which a move of the controller would copy.
    pub(crate) robot: Box<Robot>,
    pub(crate) endpoints: Endpoints,
    /// When the first timer is due. It is asked for several times an input and computed once after it.
    pub(crate) due: Option<Time>,
    /// The input that came at the instant at which a change had to be stored first; it is handled when it is.
    pub(crate) deferred: Option<Box<(Time, Input)>>,
}

impl Clone for Controller {
    /// Not inlined: a copy of every part is ten kilobytes of code at each of the places that copy a controller.
    #[inline(never)]
    fn clone(&self) -> Controller {
        Controller {
            robot: self.robot.clone(),
            endpoints: self.endpoints.clone(),
            due: self.due,
            deferred: self.deferred.clone(),
        }
    }
}

impl Controller {
    /// A controller whose power has just come on, with these files on its RAM drive. Parameter files that
    /// are missing are made.
    ///
    /// # Errors
    /// A file that the RAM drive does not take.
    pub fn new(config: Config, files: Vec<(String, Vec<u8>)>) -> Result<Controller, DriveError> {
        let mut endpoints = Endpoints::new(&config);
        let robot = Robot::new(config, files)?;
        endpoints.settings = robot.parameters.serial_lines();
        let mut controller = Controller {
            robot,
            endpoints,
            due: None,
            deferred: None,
        };
        controller.find_due();
        Ok(controller)
    }

    /// This controller with an error history (EU) from before the power came on: newest first.
    #[must_use]
    pub fn remembering(mut self, history: impl IntoIterator<Item = Alarm>) -> Controller {
        self.robot.alarms.append_history(history);
        self
    }

    /// Takes one thing that happened at `now`. Deadlines before it are served first, each at its own time.
    /// A `now` before the last one counts as the last one.
    ///
    /// # Errors
    /// Why an [`Input::Action`] had no effect. Of an action that waits for its file to be persisted the result comes
    /// with [`Input::Persisted`].
    pub fn handle(&mut self, now: Time, input: Input) -> Result<Accepted, ActionError> {
        if self.is_halted() {
            return Ok(Accepted::Pending);
        }
        if let Input::Persisted(answer) = input {
            return self.persisted(answer);
        }
        while self.robot.persistence.is_waiting() {
            // Whoever did not wait for the answer does not wait for the result either. A loop: the texts and the input that
            // waited come first, and may begin the next change.
            let _late = self.persisted(Err(PersistError::NoAnswer));
        }
        let settled = self.advance_to(now);
        if self.is_halted() {
            return Ok(Accepted::Pending);
        }
        // Something that was due has changed a file. The input belongs after that, so it waits for the same answer.
        if self.robot.persistence.is_waiting() {
            debug_assert!(
                self.deferred.is_none(),
                "two inputs wait: {:?}, {input:?}",
                self.deferred
            );
            self.deferred = Some(Box::new((now, input)));
            return Ok(Accepted::Pending);
        }
        let mut result = Ok(Accepted::Done);
        let (robot, endpoints) = (&mut self.robot, &mut self.endpoints);
        match input {
            // Nothing listens while the power is off.
            Input::Connected { .. }
            | Input::Received { .. }
            | Input::Disconnected { .. }
            | Input::SerialOpened { .. }
            | Input::SerialErrors { .. }
            | Input::SerialPurged { .. }
                if !robot.panel.state().powered => {}
            // `advance_to()` has settled at this very moment: once more would change nothing.
            Input::Tick if settled => return result,
            Input::Tick | Input::Persisted(_) => {}
            Input::Connected { port, peer } => self.connected(port, &peer),
            Input::SerialOpened { port, host } => endpoints.line_opened(port, host),
            Input::SerialPurged { port } => endpoints.purge_line(&mut robot.context, port),
            Input::SerialErrors { port, bytes } => {
                let received = endpoints.line_faults(&mut robot.context, port, bytes.into());
                self.received_from_line(port, received);
            }
            Input::Received { port, bytes } if port.ethernet_index().is_none() => {
                let received = endpoints.take_from_host(&mut robot.context, port, bytes);
                self.received_from_line(port, received);
            }
            Input::Received { port, bytes } => {
                let now = robot.context.now;
                let settled = self.received(port, now, &bytes);
                if settled && self.due.is_none_or(|due| due > now) {
                    return result;
                }
            }
            Input::Disconnected { port } => self.peer_left(port),
            Input::SecondPeer { port, peer, kept } => robot.context.report_second_peer(port, &peer, kept),
            Input::Backlogged { port } => robot.context.report_backlog(port),
            Input::WireLoop { wires } => robot.context.report_wire_loop(&wires),
            Input::Action { action, by } => result = self.act(action, by),
        }
        self.settle();
        result
    }

    /// The next thing to do outside, in order.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.robot.context.outputs.take_next()
    }

    /// When the controller wants to be called again, at the latest.
    pub fn poll_deadline(&self) -> Option<Time> {
        debug_assert_eq!(self.due, self.deadline());
        self.due
    }

    /// Handles one input and drains its results. The refusal of an action is among the events
    /// ([`Event::ActionRefused`](crate::Event::ActionRefused)).
    pub fn feed(&mut self, now: Time, input: Input) -> Vec<Output> {
        let _among_the_events = self.handle(now, input);
        core::iter::from_fn(|| self.poll_output()).collect()
    }

    /// Stores a file as a completed download does, without asking whether it is kept outside.
    ///
    /// # Errors
    /// The RAM drive does not take it.
    pub fn put_file(&mut self, name: &str, content: &[u8]) -> Result<(), DriveError> {
        let name = FileName::parse(name)?;
        self.robot.store_inside(&name, &Bytes::copy_from_slice(content))?;
        self.find_due();
        Ok(())
    }

    /// Places the arm at rest with its tool point at these world coordinates, without a motion. Coordinates that are left out stay
    /// as they are; after all of them comes the configuration.
    ///
    /// # Errors
    /// There are too many, the arm moves, or it cannot be there; it stays where it is.
    pub fn place_arm(&mut self, world: &[f64]) -> Result<(), ActionError> {
        let result = self.robot.place_arm(world);
        self.find_due();
        result
    }

    /// Selects the execution file as SL does.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub fn select(&mut self, now: Time, name: &str) -> Result<(), SelectError> {
        self.advance_to(now);
        let result = FileName::parse(name).map_err(SelectError::from);
        let result = result.and_then(|name| self.robot.select_file(&name));
        self.find_due();
        result
    }

    /// Selects the execution file to run one call of its programs, as in `PLACE(2, 30.5)`, instead of its main program. A
    /// selection, a download or a RESTORE of the file ends that.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub fn select_call(&mut self, now: Time, name: &str, call: &str) -> Result<(), SelectError> {
        self.advance_to(now);
        let result = FileName::parse(name).map_err(SelectError::from);
        let result = result.and_then(|name| self.robot.select_call(&name, call));
        self.find_due();
        result
    }

    /// Whether every change of a file is asked for by [`Output::Persist`] first, and happens when [`Input::Persisted`]
    /// has come.
    pub fn persist_outside(&mut self, outside: bool) {
        self.robot.persistence.set_outside(outside);
    }

    /// Continues after the answer about a change: makes or drops it, then serves the texts and the input that waited
    /// for it.
    fn persisted(&mut self, answer: Result<(), PersistError>) -> Result<Accepted, ActionError> {
        let Some(waiting) = self.robot.persistence.take_waiting() else {
            return Ok(Accepted::Done);
        };
        // As if the change had been made at once: its answer, then the texts after it in the segment, then the input
        // that came at the same instant. `a_day_on_which_everything_is_kept_is_the_same_day` compares both ways byte
        // for byte.
        let result = self.finish(waiting, answer);
        self.settle();
        for port in [Port::Host, Port::Ip0] {
            self.read_texts(port, false);
        }
        self.find_due();
        if self.robot.persistence.is_waiting() {
            return Ok(Accepted::Pending);
        }
        match self.deferred.take() {
            Some(deferred) => {
                let (now, input) = *deferred;
                self.handle(now, input)
            }
            None => result,
        }
    }
}
