//! The driver owns the controller and runs its loop: it takes one input (bytes, an action, a deadline), hands it to
//! the controller, carries out every output, and only then takes the next input.
//!
//! The driver does not know what bytes or states mean; that is `ts3100-controller`. Who records or reports what happens
//! subscribes to its [`Cell`]. Sockets are in [`crate::tcp`], serial lines in [`crate::serial`], time in [`crate::clock`],
//! files in [`crate::store`].
//!
//! Start with [`Driver::run`] and `run_loop`, then `edge`, which carries out the outputs. `control` serves requests,
//! `snapshots` replaces the running controller.

use crate::cell::{Cell, Side, Subscriber};
use crate::clock::{Clock, TimeGap, TimeMode};
use crate::serial::{SerialEndpoint, SerialError, SerialLines};
use crate::snapshot::SnapshotStore;
use crate::store::backing::Backing;
use crate::tcp::{ChannelError, Channels, LinkOptions, Ports, SharedPorts};
use edge::{Edge, WriteResult};
use request::{Reply, Request};
use run_loop::Rotation;
use std::collections::BTreeMap;
use std::future::Future;
use std::net::IpAddr;
use std::time::Instant;
use tokio::sync::mpsc;
use ts3100_controller::Controller;
use ts3100_controller::action::{Accepted, ActionError};
use ts3100_controller::faults::Fault;
use ts3100_controller::input::Input;
use ts3100_controller::port::Port;

mod control;
mod edge;
pub mod request;
mod run_loop;
pub mod self_check;
mod snapshots;
pub mod wait;
pub mod wired;

/// Requests that may be queued for the driver; further senders wait.
pub const REQUEST_QUEUE: usize = 64;

/// Why a driver cannot start.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// A TCP port cannot be opened.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// A serial line cannot be opened.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// The self-check failed.
    #[error("the operating system refuses a conversation with the emulator (SU on IP0): {0}")]
    SelfCheck(std::io::Error),
}

/// What a driver starts with.
pub struct Setup {
    /// The controller, after power-on or from a snapshot.
    pub controller: Controller,
    /// The directory behind its RAM drive.
    pub backing: Option<Backing>,
    /// Address to listen on.
    pub listen: IpAddr,
    /// TCP port numbers.
    pub ports: Ports,
    /// Listening sockets that robots share.
    pub shared: Option<SharedPorts>,
    /// Options of the links.
    pub links: LinkOptions,
    /// How the serial ports are reached.
    pub serial: BTreeMap<Port, SerialEndpoint>,
    /// How time passes.
    pub time: TimeMode,
    /// What becomes of time in which the process was stopped.
    pub time_gap: TimeGap,
    /// Faults that are armed at the start and after a reset.
    pub faults: Vec<Fault>,
    /// Servo power at the start and after a reset.
    pub servo_on: bool,
    /// Who sees what happens, from the first input on.
    pub subscribers: Vec<Box<dyn Subscriber>>,
}

/// A controller with its channels, serial lines, clock and backing directory.
pub struct Driver {
    cell: Cell,
    edge: Edge,
    requests: mpsc::Receiver<Request>,
    /// The requests that are served alone.
    exclusive: Option<mpsc::Receiver<Request>>,
    rotation: Rotation,
    /// Takes the result of an action that waits until a change of a file is stored.
    awaiting: Option<Reply<Result<(), ActionError>>>,
    snapshot_store: SnapshotStore,
    servo_on: bool,
    /// Faults that are armed at the start and after a reset.
    faults: Vec<Fault>,
    /// Copy of the controller before the first input; a reset returns to it.
    initial_controller: Controller,
}

impl Driver {
    /// Powers the controller on and opens its ports; to be called in a runtime. Send requests through the returned
    /// sender; [`Driver::run`] continues after all senders are dropped.
    ///
    /// # Errors
    /// See [`OpenError`]; no port stays open.
    pub fn open(setup: Setup) -> Result<(Box<Driver>, mpsc::Sender<Request>), OpenError> {
        let (sender, requests) = mpsc::channel(REQUEST_QUEUE);
        let mut clock = Clock::start(setup.time, setup.time_gap, setup.links.silence);
        clock.set(setup.controller.now());
        // On the heap: a future has a place for each value that is moved through it.
        let mut driver = Box::new(Driver {
            initial_controller: setup.controller.clone(),
            cell: Cell::new(setup.controller),
            edge: Edge {
                channels: Channels::new(setup.listen, setup.ports, setup.shared, setup.links),
                serial_lines: SerialLines::new(setup.serial, setup.links),
                clock,
                shares_time: false,
                backing: setup.backing,
                waits: Vec::new(),
                begun: Instant::now(),
                write: None,
            },
            requests,
            exclusive: None,
            rotation: Rotation::default(),
            awaiting: None,
            snapshot_store: SnapshotStore::default(),
            servo_on: setup.servo_on,
            faults: setup.faults,
        });
        for subscriber in setup.subscribers {
            driver.cell.subscribe(subscriber);
        }
        driver.judge_pace();
        // A snapshot can hold a controller that is powered off; it has no open ports.
        if driver.cell.controller.state().powered {
            driver.edge.channels.open(driver.cell.controller.network())?;
        }
        driver.edge.serial_lines.open(&driver.cell.controller)?;
        driver.start();
        Ok((driver, sender))
    }

    /// TCP port of each server channel.
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        self.edge.channels.numbers()
    }

    /// Endpoint (path or address) of each open serial line.
    pub fn serial_endpoints(&self) -> BTreeMap<Port, SerialEndpoint> {
        self.edge.serial_lines.endpoints()
    }

    /// The controller with its subscribers, for adding some before [`Driver::run`].
    pub fn cell(&mut self) -> &mut Cell {
        &mut self.cell
    }

    /// Runs until `stop` completes, closes all ports and returns the final controller.
    pub async fn run(mut self: Box<Self>, stop: impl Future<Output = ()>) -> Controller {
        self.serve(stop).await;
        self.finish().await
    }

    /// Closes all ports and returns the final controller.
    async fn finish(mut self: Box<Self>) -> Controller {
        self.finish_writes().await;
        // Handle what is already due, so that the returned state and the reports agree.
        self.feed(Input::Tick);
        self.finish_writes().await;
        self.edge.channels.close();
        self.edge.serial_lines.close();
        self.cell.controller
    }

    /// Handles an input and every input that results from it, at the present time.
    fn handle(&mut self, input: Input, by: Side) -> Result<Accepted, ActionError> {
        self.cell.feed(self.edge.begin(), input, by, &mut self.edge)
    }

    /// Handles an input of the host whose result nobody waits for: a refusal is an event.
    fn feed(&mut self, input: Input) {
        let _ = self.handle(input, Side::Host);
    }

    /// A write to the backing directory has ended: what has waited for it goes on.
    fn stored(&mut self, written: WriteResult) {
        let answer = Input::Persisted(self.edge.finish_write(written));
        // Among robots that share their time, what was due meanwhile happens in the order of all.
        let at = match self.edge.shares_time {
            true => self.cell.controller.now(),
            false => self.edge.begin(),
        };
        let result = self.cell.feed(at, answer, Side::Host, &mut self.edge);
        if let Some(reply) = self.awaiting.take() {
            self.reply(result, reply);
        }
    }

    /// Waits until nothing is being stored.
    async fn finish_writes(&mut self) {
        while let Some(write) = &mut self.edge.write {
            let written = (&mut write.task).await;
            self.stored(written);
        }
    }

    /// Findings about the host's timing are valid only while virtual time is as fast as the host's clock.
    fn judge_pace(&mut self) {
        let keeps_pace = self.edge.clock.keeps_pace();
        self.cell.report_timed_findings(keeps_pace);
    }
}

#[cfg(test)]
mod tests;
