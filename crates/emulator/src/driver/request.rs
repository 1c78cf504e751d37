//! What others ask of the driver: to do something, to look, to wait. The driver is the one owner of the controller; all
//! of these are done between two inputs, at the present virtual time.

use super::wait::{Wait, WaitCondition};
use crate::clock::Clock;
use crate::clock::TimeMode;
use crate::serial::SerialEndpoint;
use crate::snapshot::handle::SnapshotRequest;
use crate::store::backing;
use std::collections::BTreeMap;
use std::time::Duration;
use tokio::sync::oneshot;
use ts3100_controller::Controller;
use ts3100_controller::action::{Action, ActionError};
use ts3100_controller::input::PanelAction;
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

/// Something asked of the driver.
pub enum Request {
    /// Something done at the panel.
    Panel {
        /// What.
        panel: PanelAction,
        /// Told when it is done, with all that follows from it at once.
        done: std::sync::mpsc::Sender<()>,
    },
    /// Something done to the controller.
    Action {
        /// What.
        action: Action,
        /// Told when it is done, with all that follows from it at once, or refused.
        done: oneshot::Sender<Result<(), ActionError>>,
    },
    /// The same, for one who waits in a thread of its own.
    ActionBlocking {
        /// What.
        action: Action,
        /// As of [`Request::Action`].
        done: std::sync::mpsc::Sender<Result<(), ActionError>>,
    },
    /// Something done at the edge.
    LinkAction {
        /// What.
        action: LinkAction,
        /// As of [`Request::Action`].
        done: oneshot::Sender<Result<(), ActionError>>,
    },
    /// Something done with snapshots.
    Snapshot(SnapshotRequest),
    /// A look at everything.
    Query(Box<dyn FnOnce(&View<'_>) + Send>),
    /// A wait for something to happen.
    Wait {
        /// For what, and whether time is to be moved for it.
        wait: Wait,
        /// Told when it has happened or its time is over; dropped by one who waits no longer.
        done: oneshot::Sender<WaitResult>,
    },
}

/// Something done not to the controller but around it.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkAction {
    /// Bytes as if they had come from the peer of a port.
    Inject {
        /// The port.
        port: Port,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// The connection of a port is closed.
    Drop {
        /// The port.
        port: Port,
    },
    /// Time passes in this way from now on.
    TimeMode(TimeMode),
    /// Everything is as when the emulator started, time included; connections are closed.
    Reset,
}

/// What can be looked at.
pub struct View<'a> {
    /// The controller.
    pub controller: &'a Controller,
    /// Virtual time beside the wall clock.
    pub clock: &'a Clock,
    /// The TCP port each server channel accepts on.
    pub ports: &'a BTreeMap<Port, u16>,
    /// Where the serial lines are.
    pub serial: &'a BTreeMap<Port, SerialEndpoint>,
    /// How it is with the backing directory, if there is one.
    pub backing: Option<&'a backing::BackingStatus>,
}

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WaitResult {
    /// It happened; otherwise its time is over.
    pub reached: bool,
    /// The virtual time then.
    pub at: Time,
    /// The virtual time that passed meanwhile.
    pub passed: Duration,
}

/// A wait that is under way.
pub(super) struct PendingWait {
    pub wait: Wait,
    pub since: Time,
    pub limit: Time,
    pub done: oneshot::Sender<WaitResult>,
}

impl PendingWait {
    /// Whether only this could tell of single statements.
    pub fn needs_statements(&self) -> bool {
        matches!(self.wait.condition, WaitCondition::Statement(_))
    }
}
