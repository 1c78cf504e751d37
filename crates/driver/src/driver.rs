//! The driver owns a [`World`] and runs its loop: it takes one input (bytes, an action, a deadline), hands it to the robot it
//! is for, has every output carried out, and only then takes the next input. One robot is a world of one.
//!
//! The driver does not know what bytes or states mean; that is `ts3100-controller`. Who records or reports what happens
//! subscribes to a [`Seat`]. Sockets are in [`crate::tcp`], serial lines in [`crate::serial`], time in [`crate::clock`],
//! files in [`crate::store`].
//!
//! Start with [`Driver::run`] and `run_loop`, then `edge`, which carries out the outputs. `control` serves requests,
//! `snapshots` replaces running controllers.

use crate::clock::{Clock, TimeGap, TimeMode};
use crate::seat::{Seat, Side, Subscriber};
use crate::serial::{SerialEndpoint, SerialError, SerialLines};
use crate::snapshot::SnapshotStore;
use crate::store::backing::Backing;
use crate::tcp::{ChannelError, Channels, LinkOptions, Ports, SharedPorts};
use crate::world::{Wire, World};
use edge::{Edge, Start, WriteResult};
use request::{Awaiting, Paused, Request, Requests};
use run_loop::Rotation;
use std::collections::BTreeMap;
use std::future::Future;
use std::net::IpAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Mutex, mpsc};
use tracing::{Span, warn};
use ts3100_controller::action::{Accepted, ActionError};
use ts3100_controller::faults::Fault;
use ts3100_controller::input::Input;
use ts3100_controller::port::Port;
use ts3100_controller::{Controller, Time};

mod control;
mod edge;
pub mod request;
mod run_loop;
pub mod self_check;
mod snapshots;
pub mod wait;

/// Requests that may be queued for the driver; further senders wait.
pub const REQUEST_QUEUE: usize = 64;
/// The number of the first robot of a driver.
pub const FIRST: usize = 0;

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
    #[error("cannot exchange SU with the emulator on IP0: {0}")]
    SelfCheck(std::io::Error),
}

/// Settings and initial state of a robot.
pub struct Setup {
    /// The controller, after power-on or from a snapshot.
    pub controller: Controller,
    /// The backing directory of its RAM drive.
    pub backing: Option<Backing>,
    /// Address to listen on.
    pub listen: IpAddr,
    /// TCP port numbers.
    pub ports: Ports,
    /// Listening sockets that robots share.
    pub shared: Option<SharedPorts>,
    /// Options of the links.
    pub links: LinkOptions,
    /// Endpoint of each serial port that hosts can reach.
    pub serial: BTreeMap<Port, SerialEndpoint>,
    /// Faults that are armed at the start and after a reset.
    pub faults: Vec<Fault>,
    /// Servo power at the start and after a reset.
    pub servo_on: bool,
    /// Subscribers, which see everything from the first input on.
    pub subscribers: Vec<Box<dyn Subscriber>>,
    /// Names the robot in the lines of the log.
    pub span: Span,
}

/// Robots that share one time, with their connections, their directories and their clock.
pub struct Driver {
    world: World<Edge>,
    clock: Clock,
    /// Each with the number of the robot it is for.
    requests: mpsc::Receiver<(usize, Request)>,
    rotation: Rotation,
    /// The caller that waits until a change of a file is stored. One at most: meanwhile only queries are served.
    awaiting: Option<Awaiting>,
    /// Number of writes that the inputs in the queue have waited for.
    writes_awaited: u32,
}

impl Driver {
    /// A driver without robots. `gap` decides about time in which the process was stopped. The returned handle sends
    /// requests to the first robot, or with [`Requests::of`] to another; [`Driver::run`] continues after all senders
    /// are dropped.
    pub fn new(time: TimeMode, gap: TimeGap) -> (Box<Driver>, Requests) {
        let (sender, requests) = mpsc::channel(REQUEST_QUEUE);
        // On the heap: a future has a place for each value that is moved through it.
        let driver = Box::new(Driver {
            world: World::new(),
            clock: Clock::start(time, gap, Duration::ZERO),
            requests,
            rotation: Rotation::default(),
            awaiting: None,
            writes_awaited: 0,
        });
        (driver, Requests::new(FIRST, sender))
    }

    /// Adds a robot whose time passes with that of the others: powers its controller on and opens its ports. Call it in
    /// a runtime. Returns its number.
    ///
    /// # Errors
    /// See [`OpenError`].
    pub fn add(&mut self, setup: Setup) -> Result<usize, OpenError> {
        // Robots that jump together wait as long as the most patient of them.
        self.clock
            .set_silence(self.clock.silence().max(setup.links.silence));
        let edge = Edge {
            channels: Channels::new(setup.listen, setup.ports, setup.shared, setup.links),
            serial_lines: SerialLines::new(setup.serial, setup.links),
            backing: setup.backing,
            waits: Vec::new(),
            begun: self.clock.wall(),
            write: None,
            has_sent: false,
            snapshots: SnapshotStore::default(),
            start: Start {
                controller: setup.controller.clone(),
                faults: setup.faults,
                servo_on: setup.servo_on,
            },
            lost_before: (Duration::ZERO, Duration::ZERO),
        };
        let seat = Seat::new(setup.controller);
        let number = self.world.add(self.clock.now(), seat, edge, setup.span);
        let robot = &mut self.world[number];
        for subscriber in setup.subscribers {
            robot.seat.subscribe(subscriber);
        }
        let keeps_pace = self.clock.keeps_pace(self.clock.now());
        robot.seat.report_timed_findings(keeps_pace);
        // A snapshot can hold a controller that is powered off; it has no open ports.
        if robot.seat.controller.state().powered {
            robot.edge.channels.open(robot.seat.controller.network())?;
        }
        robot.edge.serial_lines.open(&robot.seat.controller)?;
        self.start(number);
        Ok(number)
    }

    /// Joins the robots by wires.
    pub fn join(&mut self, wires: Vec<Wire>) {
        self.begin();
        self.world.join(wires);
        self.note_effects();
    }

    /// TCP port of each server channel of a robot.
    pub fn ports(&self, robot: usize) -> &BTreeMap<Port, u16> {
        self.world[robot].edge.channels.numbers()
    }

    /// Endpoint (path or address) of each open serial line of a robot.
    pub fn serial_endpoints(&self, robot: usize) -> BTreeMap<Port, SerialEndpoint> {
        self.world[robot].edge.serial_lines.endpoints()
    }

    /// The controller of a robot with its subscribers, for adding some before [`Driver::run`].
    pub fn seat(&mut self, robot: usize) -> &mut Seat {
        &mut self.world[robot].seat
    }

    /// Runs until `stop` completes, closes all ports and returns the final controllers.
    pub async fn run(self: Box<Self>, stop: impl Future<Output = ()>) -> Vec<Controller> {
        let mut stop = pin!(stop);
        // Locked by the loop, and by whoever has it pause.
        let driver = Arc::new(Mutex::new(self));
        loop {
            // Here the loop waits for the end of a pause. `stop` waits with it: a caller that has the world is not
            // interrupted.
            let mut served = driver.lock().await;
            let Some(caller) = served.serve(stop.as_mut()).await else {
                return served.finish().await;
            };
            drop(served);
            let paused = Paused::new(Arc::clone(&driver).lock_owned().await);
            // Fails only when nobody waits for it any more: the loop goes on.
            drop(caller.send(paused));
        }
    }

    /// Closes all ports and returns the final controllers.
    async fn finish(&mut self) -> Vec<Controller> {
        // An answer that waits for the disk is given before the ports close.
        self.finish_writes().await;
        // Handle what is already due, so that the returned states and the reports agree.
        self.tick();
        self.finish_writes().await;
        let robots = std::mem::take(&mut self.world).into_robots().into_iter();
        let ended = robots.map(|mut robot| {
            // Without telling the controller, whose state is the one with its peers still connected.
            robot.edge.channels.close();
            robot.edge.serial_lines.close();
            robot.seat.controller
        });
        ended.collect()
    }

    /// Begins a unit of work: the moment at which its inputs are handled.
    fn begin(&mut self) -> Time {
        let wall = self.clock.wall();
        for robot in self.world.robots_mut() {
            robot.edge.begun = wall;
        }
        let now = self.clock.now();
        self.judge_pace(now);
        now
    }

    /// Handles an input of a robot and every input that results from it, at the present time.
    fn handle(&mut self, robot: usize, input: Input, by: Side) -> Result<Accepted, ActionError> {
        let now = self.begin();
        let result = self.world.feed(now, robot, input, by);
        self.note_effects();
        result
    }

    /// Handles an input whose result is not awaited; a refusal becomes an event.
    fn feed(&mut self, robot: usize, input: Input) {
        let _ = self.handle(robot, input, Side::Host);
    }

    /// Lets every robot do its due work.
    fn tick(&mut self) {
        let now = self.begin();
        self.world.advance(now);
        self.note_effects();
    }

    /// Updates the clock after the work of the robots: its pace depends on it.
    fn note_effects(&mut self) {
        if let Some(reached) = self.world.take_late() {
            self.note_lag(reached);
        }
        let (mut has_sent, mut is_idle) = (false, true);
        for robot in self.world.robots_mut() {
            has_sent |= std::mem::take(&mut robot.edge.has_sent);
            is_idle &= robot.edge.is_idle(&robot.seat.controller);
        }
        // Whatever leaves one robot ends the silence of all.
        if has_sent {
            self.clock.note_activity();
        }
        self.clock.set_idle(is_idle);
    }

    /// The machine is too slow: time continues from the moment that was reached.
    fn note_lag(&mut self, reached: Time) {
        let is_noticeable = self.clock.note_lag(reached);
        self.judge_pace(reached);
        if is_noticeable {
            let mode = self.clock.mode();
            self.span().in_scope(|| {
                warn!(
                    "this machine cannot keep up with --time {mode}: virtual time lags (`behind` of /clock)"
                );
            });
        }
    }

    /// Names the robot in lines about the whole world, if it has no other.
    fn span(&self) -> Span {
        match self.world.robots() {
            [only] => only.span.clone(),
            _ => Span::none(),
        }
    }

    /// A write to the backing directory has ended: the work that waited for it continues.
    fn stored(&mut self, robot: usize, written: WriteResult) {
        let answer = Input::Persisted(self.world[robot].edge.finish_write(written));
        if self.world.has_waiting_inputs() {
            self.writes_awaited += 1;
        }
        let mut now = self.begin();
        // Where more has to be stored than the disk can do, an input would wait for ever.
        if self.writes_awaited > 1 {
            now = self.world.now();
            self.note_lag(now);
        }
        let result = self.world.feed(now, robot, answer, Side::Host);
        self.note_effects();
        if !self.world.has_waiting_inputs() {
            self.writes_awaited = 0;
        }
        match self.awaiting.take() {
            Some(Awaiting::Result(robot, reply)) => self.reply(robot, result, reply),
            Some(Awaiting::Settled(done)) => self.tell_settled(done),
            None => {}
        }
    }

    /// Whether a robot stores something: nothing else is served meanwhile, because its next action may affect the
    /// others.
    fn is_writing(&self) -> bool {
        self.world.robots().iter().any(|robot| robot.edge.write.is_some())
    }

    /// Waits until nothing is being stored.
    async fn finish_writes(&mut self) {
        loop {
            // The end of one write can begin the next.
            let Some((robot, write)) = self.writes().next() else {
                break;
            };
            let written = (&mut write.task).await;
            self.stored(robot, written);
        }
    }

    /// The writes that are under way, each with its robot.
    fn writes(&mut self) -> impl Iterator<Item = (usize, &mut edge::Write)> {
        let robots = self.world.robots_mut().iter_mut().enumerate();
        robots.filter_map(|(number, robot)| Some((number, robot.edge.write.as_mut()?)))
    }

    /// Findings about the hosts' timing are valid only while virtual time is as fast as their clocks.
    fn judge_pace(&mut self, now: Time) {
        let keeps_pace = self.clock.keeps_pace(now);
        for robot in self.world.robots_mut() {
            robot.seat.report_timed_findings(keeps_pace);
        }
    }
}

#[cfg(test)]
mod tests;
