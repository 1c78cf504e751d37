//! Requests that other tasks and threads send to the driver: perform an action, query the state, wait.
//!
//! The driver owns the controller alone, so everything else asks through a [`Request`]. Requests are served between two
//! inputs, at the current virtual time, by `driver::control`.

use super::wait::Wait;
use crate::clock::{Clock, TimeMode};
use crate::serial::SerialLines;
use crate::snapshot::{SnapshotRequestError, SnapshotStore, SnapshotTask};
use crate::store::backing;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, oneshot};
use ts3100_controller::Controller;
use ts3100_controller::action::{Action, ActionError};
use ts3100_controller::input::PanelAction;
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

/// Takes the result of a request, and reads the state at that moment; runs in the driver.
pub type Reply<T> = Box<dyn FnOnce(T, &View<'_>) + Send>;

/// A request to the driver.
pub enum Request {
    /// Does something at the operator panel, as a person who gets no answer.
    Panel(PanelAction, Reply<()>),
    /// An action on the controller; the reply follows after the action and its immediate effects.
    Action(Action, Reply<Result<(), ActionError>>),
    /// An action on connections or time, outside of the controller.
    LinkAction(LinkAction, Reply<Result<(), ActionError>>),
    /// Saves, restores or removes a snapshot.
    Snapshot(SnapshotTask, Reply<Result<(), SnapshotRequestError>>),
    /// A read-only query.
    Query(Reply<()>),
    /// Waits until a condition is met; drop the receiver to cancel the wait.
    Wait(Wait, oneshot::Sender<WaitResult>),
    /// Serves these requests alone, until nobody can send more of them: no host, no other caller, no deadline is served.
    /// So several robots are read or replaced together. A caller that wants several has to ask them in the same order as
    /// every other caller.
    Exclusive(mpsc::Receiver<Request>),
    /// Among those requests: everything that is due until this moment happens, and time stands there as long as they last.
    StandStill(Instant, Reply<()>),
}

/// An action around the controller: on a connection, on time, or a reset.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkAction {
    /// Handles bytes as if the peer of a port had sent them.
    Inject {
        /// Port that receives them.
        port: Port,
        /// Raw bytes, with framing.
        bytes: Vec<u8>,
    },
    /// Closes the connection of a port.
    Drop {
        /// Ethernet channel.
        port: Port,
    },
    /// Changes the time mode.
    TimeMode(TimeMode),
    /// Restores the state at the start, including time, and closes all connections.
    Reset,
}

/// What a query can read.
pub struct View<'a> {
    /// Current state of the controller.
    pub controller: &'a Controller,
    /// Virtual time and its relation to the wall clock.
    pub clock: &'a Clock,
    /// TCP port of each server channel.
    pub ports: &'a BTreeMap<Port, u16>,
    /// The open serial lines.
    pub serial_lines: &'a SerialLines,
    /// State of the backing directory; `None` without `--drive`.
    pub backing: Option<&'a backing::BackingStatus>,
    /// The named snapshots.
    pub snapshots: &'a SnapshotStore,
}

/// Result of a wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WaitResult {
    /// `true` if the condition was met, `false` after the timeout.
    pub reached: bool,
    /// Virtual time at the end of the wait.
    pub at: Time,
    /// Virtual time that passed during the wait.
    pub passed: Duration,
}

/// A wait that has not ended.
pub(super) struct PendingWait {
    pub wait: Wait,
    pub since: Time,
    pub limit: Time,
    /// Whether the condition was met by `limit`, as soon as that is certain.
    pub reached: Option<bool>,
    pub done: oneshot::Sender<WaitResult>,
}

impl PendingWait {
    /// Takes into account the state that lasted until `at`, before the input of that time. One step of the driver can
    /// handle much that happens at different times, before and after the limit.
    pub fn judge(&mut self, at: Time, controller: &Controller) {
        let is_met = self.wait.is_met(controller);
        if self.reached.is_none() && (is_met || at > self.limit) {
            self.reached = Some(is_met);
        }
    }

    /// Whether the condition was met by now, and not after the limit.
    pub fn is_reached(&self, controller: &Controller) -> bool {
        self.reached.unwrap_or_else(|| self.wait.is_met(controller))
    }

    /// Answers the caller.
    pub fn end(self, reached: bool, at: Time, passed: Duration) {
        // Fails only when the caller no longer waits.
        let _ = self.done.send(WaitResult { reached, at, passed });
    }
}
