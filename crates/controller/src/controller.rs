//! The controller value: one input, its effects, and the deadlines. It routes between the ports ([`Endpoints`]) and the
//! robot behind them ([`Robot`]) and decides nothing else.

use crate::action::{Accepted, ActionError};
use crate::alarm::Alarm;
use crate::drive::{DriveError, PersistError};
use crate::endpoint::Endpoints;
use crate::executor::selection::SelectError;
use crate::input::Input;
use crate::options::Config;
use crate::output::Output;
use crate::persistence::PendingChange;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::name::FileName;

/// The robot controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// Several kilobytes, which a move of the controller would copy.
    pub(crate) robot: Box<Robot>,
    pub(crate) endpoints: Endpoints,
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
        endpoints.find_due(&robot);
        Ok(Controller { robot, endpoints })
    }

    /// This controller, whose error history (EU) goes on from before the power came on: newest first.
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
        if let Input::Persisted(answer) = input {
            return self.persisted(answer);
        }
        while self.robot.persistence.is_pending() {
            // Whoever did not wait for the answer does not wait for the result either.
            let _late = self.persisted(Err(PersistError::NoAnswer));
        }
        let settled = self.endpoints.advance_to(&mut self.robot, now);
        if self.robot.persistence.is_pending() {
            self.robot.persistence.defer(now, input);
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
            Input::Tick if settled => return result,
            Input::Tick | Input::Persisted(_) => {}
            Input::Connected { port, peer } => endpoints.connected(robot, port, peer),
            Input::SerialOpened { port, host } => endpoints.line_opened(port, host),
            Input::SerialPurged { port } => endpoints.purge_line(robot, port),
            Input::SerialErrors { port, bytes } => endpoints.line_faults(robot, port, &bytes.into()),
            Input::Received { port, bytes } if port.ethernet_index().is_none() => {
                endpoints.received_on_line(robot, port, bytes);
            }
            Input::Received { port, bytes } => {
                let settled = endpoints.received(robot, port, robot.now, &bytes);
                if settled && endpoints.due.is_none_or(|due| due > robot.now) {
                    return result;
                }
            }
            Input::Disconnected { port } => endpoints.peer_left(robot, port),
            Input::SecondPeer { port, peer, kept } => robot.report_second_peer(port, &peer, kept),
            Input::Backlogged { port } => robot.report_backlog(port),
            Input::Panel(action) => endpoints.panel(robot, action),
            Input::Action(action) => result = endpoints.act(robot, action),
        }
        self.endpoints.settle(&mut self.robot);
        result
    }

    /// What is to be done outside, in order.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.robot.outputs.take_next()
    }

    /// When the controller wants to be called again, at the latest.
    pub fn poll_deadline(&self) -> Option<Time> {
        debug_assert_eq!(self.endpoints.due, self.endpoints.deadline(&self.robot));
        self.endpoints.due
    }

    /// Handles one input and drains what comes of it. The refusal of an action is among the events
    /// ([`Event::ActionRefused`](crate::Event::ActionRefused)).
    pub fn feed(&mut self, now: Time, input: Input) -> Vec<Output> {
        let _among_the_events = self.handle(now, input);
        core::iter::from_fn(|| self.poll_output()).collect()
    }

    /// Stores a file as a completed download does, without asking whether it is kept outside.
    ///
    /// # Errors
    /// What the RAM drive does not take.
    pub fn put_file(&mut self, name: &str, content: &[u8]) -> Result<(), DriveError> {
        let name = FileName::parse(name)?;
        self.robot.store_inside(&name, &Bytes::copy_from_slice(content))?;
        self.endpoints.find_due(&self.robot);
        Ok(())
    }

    /// Selects the execution file as SL does.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub fn select(&mut self, now: Time, name: &str) -> Result<(), SelectError> {
        self.endpoints.advance_to(&mut self.robot, now);
        let result = FileName::parse(name).map_err(SelectError::from);
        let result = result.and_then(|name| self.robot.select_file(&name));
        self.endpoints.find_due(&self.robot);
        result
    }

    /// Whether every change of a file is asked for by [`Output::Persist`] first, and happens when [`Input::Persisted`]
    /// has come.
    pub fn persist_outside(&mut self, outside: bool) {
        self.robot.persistence.set_outside(outside);
    }

    /// Takes over the peers of the controller that was here before, and what the edge records of it.
    pub fn adopt_peers(&mut self, before: &Controller) {
        self.robot.outputs.trace(before.robot.outputs.is_traced());
        self.endpoints
            .adopt_peers(&mut self.robot, &before.endpoints, &before.robot);
        self.endpoints.settle(&mut self.robot);
    }

    /// The answer has come: what waited for it goes on, and then what came at the same instant.
    fn persisted(&mut self, answer: Result<(), PersistError>) -> Result<Accepted, ActionError> {
        if !self.robot.persistence.is_pending() {
            return Ok(Accepted::Done);
        }
        let mut result = Ok(Accepted::Done);
        let (robot, endpoints) = (&mut self.robot, &mut self.endpoints);
        match robot.persistence.begin_answer(answer) {
            Some(PendingChange::Download {
                port,
                name,
                content,
                last,
            }) => endpoints.end_download(robot, port, name, content, &last),
            Some(PendingChange::Command {
                port,
                message,
                command,
            }) => endpoints.answer_command(robot, port, &message, command),
            Some(PendingChange::Action(action)) => result = endpoints.act(robot, action),
            Some(PendingChange::Restore { names, direct }) => robot.restore_data(names, direct),
            None => {}
        }
        self.robot.persistence.end_answer();
        self.endpoints.settle(&mut self.robot);
        self.endpoints.read_waiting_texts(&mut self.robot);
        self.endpoints.find_due(&self.robot);
        if self.robot.persistence.is_pending() {
            return Ok(Accepted::Pending);
        }
        match self.robot.persistence.take_deferred() {
            Some((now, input)) => self.handle(now, input),
            None => result,
        }
    }
}
