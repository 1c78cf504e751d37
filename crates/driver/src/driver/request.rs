//! Requests that other tasks and threads send to the driver: perform an action, query the state, wait.
//!
//! The driver owns the controller alone, so everything else asks through a [`Request`]. Requests are served between two
//! inputs, at the current virtual time, by `driver::control`.

use super::Driver;
use super::edge::Edge;
use super::wait::Wait;
use crate::clock::TimeMode;
use crate::serial::SerialLines;
use crate::snapshot::{SnapshotRequestError, SnapshotStore, SnapshotTask};
use crate::store::backing;
use crate::tcp::LinkOptions;
use crate::world::World;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedMutexGuard, mpsc, oneshot};
use ts3100_controller::Controller;
use ts3100_controller::action::{Action, ActionError};
use ts3100_controller::input::By;
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

/// Takes the result of a request, and reads the state at that moment; runs in the driver.
pub type Reply<T> = Box<dyn FnOnce(T, &View<'_>) + Send>;

/// A request to the driver.
pub enum Request {
    /// An action on the controller; the reply follows after the action and its immediate effects.
    Action(Action, By, Reply<Result<(), ActionError>>),
    /// An action on connections or time, outside of the controller.
    LinkAction(LinkAction, Reply<Result<(), ActionError>>),
    /// Saves, restores or removes a snapshot.
    Snapshot(SnapshotTask, Reply<Result<(), SnapshotRequestError>>),
    /// A read-only query.
    Query(Reply<()>),
    /// Waits until a condition is met; drop the receiver to cancel the wait.
    Wait(Wait, oneshot::Sender<WaitResult>),
    /// Sets an outside line. Answered once all immediate consequences have happened; `false` if no wire begins there.
    SetOutside(String, bool, oneshot::Sender<bool>),
    /// Lets the whole loop pause: the caller has the world, and all robots in it, for itself. This is how several
    /// robots are read or replaced at one moment, also in several worlds. A caller that wants several has to ask for
    /// them in the same order as every other caller.
    Pause(oneshot::Sender<Paused>),
}

/// Sends requests to a driver, for one of its robots.
#[derive(Debug, Clone)]
pub struct Requests {
    robot: usize,
    queue: mpsc::Sender<(usize, Request)>,
}

/// The driver has ended, or its queue is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the emulator accepts no more requests")]
pub struct NotTaken;

impl Requests {
    pub(super) fn new(robot: usize, queue: mpsc::Sender<(usize, Request)>) -> Requests {
        Requests { robot, queue }
    }

    /// Returns the requests for another robot of the same driver.
    #[must_use]
    pub fn of(&self, robot: usize) -> Requests {
        Requests::new(robot, self.queue.clone())
    }

    /// The number of the robot.
    pub fn robot(&self) -> usize {
        self.robot
    }

    /// Whether both are for robots of one world.
    pub fn is_same_world(&self, other: &Requests) -> bool {
        self.queue.same_channel(&other.queue)
    }

    /// Sends a request, as soon as there is room in the queue.
    ///
    /// # Errors
    /// The driver has ended.
    pub async fn send(&self, request: Request) -> Result<(), NotTaken> {
        let sent = self.queue.send((self.robot, request)).await;
        sent.map_err(|_| NotTaken)
    }

    /// As [`Requests::send`], outside of a runtime.
    ///
    /// # Errors
    /// The driver has ended.
    pub fn blocking_send(&self, request: Request) -> Result<(), NotTaken> {
        let sent = self.queue.blocking_send((self.robot, request));
        sent.map_err(|_| NotTaken)
    }

    /// Sends a request if there is room in the queue.
    ///
    /// # Errors
    /// There is none, or the driver has ended.
    pub fn try_send(&self, request: Request) -> Result<(), NotTaken> {
        self.queue.try_send((self.robot, request)).map_err(|_| NotTaken)
    }
}

/// A world whose loop pauses: no host, no other caller and no deadline is served until this is dropped.
pub struct Paused(OwnedMutexGuard<Box<Driver>>);

impl Paused {
    pub(super) fn new(driver: OwnedMutexGuard<Box<Driver>>) -> Paused {
        Paused(driver)
    }

    /// Wall-clock time.
    pub fn wall(&self) -> Instant {
        self.0.clock.wall()
    }

    /// Handles everything that is due until this moment. Time is stopped there during the pause.
    pub async fn stand_at(&mut self, moment: Instant) {
        self.0.stand_at(moment).await;
    }

    /// State of a robot, as a query reads it.
    pub fn view(&self, robot: usize) -> View<'_> {
        self.0.view(robot)
    }

    /// Carries out snapshot tasks for several robots, each with its number, as one unit; none sees the previous state
    /// of another. Returns each result.
    pub async fn act_on_snapshots(
        &mut self,
        tasks: Vec<(usize, SnapshotTask)>,
    ) -> Vec<Result<(), SnapshotRequestError>> {
        self.0.act_together(tasks).await
    }
}

impl Drop for Paused {
    fn drop(&mut self) {
        self.0.go_on();
    }
}

/// A caller that waits until a change of a file is stored.
pub(super) enum Awaiting {
    /// The caller of an action, for its result and a look at the robot of this number.
    Result(usize, Reply<Result<(), ActionError>>),
    /// The caller that has set an outside line.
    Settled(oneshot::Sender<bool>),
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

/// State of a robot, as a query reads it.
pub struct View<'a> {
    /// Current state of the controller.
    pub controller: &'a Controller,
    /// Time mode.
    pub time: TimeMode,
    /// Lag of virtual time because the machine could not keep up, since the start or the last reset.
    pub lag: Duration,
    /// Wall-clock time that was skipped since then.
    pub skipped: Duration,
    /// TCP port of each server channel.
    pub ports: &'a BTreeMap<Port, u16>,
    /// The open serial lines.
    pub serial_lines: &'a SerialLines,
    /// State of the backing directory; `None` without `--drive`.
    pub backing: Option<&'a backing::BackingStatus>,
    /// The named snapshots.
    pub snapshots: &'a SnapshotStore,
    /// `None` of a recorded run, which has no wires.
    pub(super) world: Option<&'a World<Edge>>,
}

/// A controller that no driver owns, for reading: a moment of a recorded run. It has no connections and no disk.
#[derive(Debug, Clone)]
pub struct Still(pub Controller);

impl Still {
    /// Reads the state as a query does; time stands still.
    pub fn look<T>(&self, look: impl FnOnce(&View<'_>) -> T) -> T {
        look(&View {
            controller: &self.0,
            time: TimeMode::Stepped,
            lag: Duration::ZERO,
            skipped: Duration::ZERO,
            ports: &BTreeMap::new(),
            serial_lines: &SerialLines::new(BTreeMap::new(), LinkOptions::default()),
            backing: None,
            snapshots: &SnapshotStore::default(),
            world: None,
        })
    }
}

impl View<'_> {
    /// The level of each wire of the world.
    pub fn wire_levels(&self) -> Vec<bool> {
        self.world.map(World::levels).unwrap_or_default()
    }
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
