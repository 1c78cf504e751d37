//! The driver owns the controller and runs its loop: it takes one input (bytes, an action, a deadline), hands it to
//! the controller, carries out every output, and only then takes the next input.
//!
//! The driver does not know what bytes or states mean; that is `ts3100-controller`. Sockets are in [`crate::tcp`],
//! serial lines in [`crate::serial`], time in [`crate::clock`], files in [`crate::store`].
//!
//! Start with [`Driver::run`] and `run_loop`, then `Driver::step`, which handles one input. `control` serves the
//! requests of the control interface, `snapshots` replaces the running controller.

use crate::clock::{CATCH_UP_SLICE, Clock};
use crate::config::Settings;
use crate::control as interface;
use crate::control::journal::Journal;
use crate::faults;
use crate::loading::{self, LoadError};
use crate::log::EventLog;
use crate::reports::RunRecord;
use crate::scenario::Play;
use crate::serial::{SerialEndpoint, SerialError, SerialLines};
use crate::snapshot::{self, SnapshotStore};
use crate::store::backing::Backing;
use crate::tcp::{ChannelError, Channels};
use crate::transcript::{RecorderError, Side, TranscriptSink};
use crate::watch::WatchSender;
use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::mpsc;
use tracing::{error, info, warn};
use ts3100_controller::action::ActionError;
use ts3100_controller::faults::Fault;
use ts3100_controller::findings::Rule;
use ts3100_controller::input::Input;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;
use ts3100_controller::{Accepted, Controller};

mod control;
mod persistence;
pub mod request;
mod run_loop;
pub mod wait;

use request::{PendingWait, Request};
use run_loop::SourceRotation;

/// Requests that may be queued for the driver; further senders wait.
pub const REQUEST_QUEUE: usize = 64;

/// Why the emulator cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A file or the backing directory cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The controller rejected a file.
    #[error("{name} cannot be stored on the RAM drive: {reason}")]
    Store {
        /// Its name on the drive.
        name: String,
        /// Why.
        reason: String,
    },
    /// The requested file cannot be selected.
    #[error("{name} cannot be selected: {reason}")]
    Select {
        /// Its name on the drive.
        name: String,
        /// Why, with the diagnostics of the compiler.
        reason: String,
    },
    /// A TCP port cannot be opened.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The control interface cannot listen.
    #[error("the control interface cannot listen on {address}: {reason}")]
    Control {
        /// Where.
        address: std::net::SocketAddr,
        /// Error of the operating system.
        reason: std::io::Error,
    },
    /// A serial line cannot be opened.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// A transcript cannot be created.
    #[error(transparent)]
    Transcript(#[from] RecorderError),
    /// The initial snapshot cannot be read.
    #[error(transparent)]
    Snapshot(#[from] snapshot::FileError),
    /// A runtime, thread or self-check failed.
    #[error("the operating system refuses a {what}: {reason}")]
    System {
        /// The resource that was requested.
        what: &'static str,
        /// Error of the operating system.
        reason: std::io::Error,
    },
}

/// A controller with its channels, serial lines, clock and backing directory.
pub struct Driver {
    controller: Controller,
    clock: Clock,
    channels: Channels,
    serial_lines: SerialLines,
    backing: Option<Backing>,
    log: EventLog,
    requests: mpsc::Receiver<Request>,
    rotation: SourceRotation,
    snapshot_store: SnapshotStore,
    observer: Option<WatchSender>,
    transcript: TranscriptSink,
    scenario: Option<Play>,
    journal: Option<Arc<Journal>>,
    run_record: RunRecord,
    record_lines: bool,
    ports: BTreeMap<Port, u16>,
    has_demo: bool,
    servo_on: bool,
    /// Faults that are armed at the start and after a reset.
    faults: Vec<Fault>,
    /// Copy of the controller before the first input; a reset returns to it.
    initial_controller: Controller,
    /// The controller started from a snapshot or with an error history, so a transcript needs its full state.
    restored: bool,
    waits: Vec<PendingWait>,
}

impl Driver {
    /// Powers the controller on and opens its ports. Send requests through the returned sender; [`Driver::run`]
    /// continues after all senders are dropped.
    ///
    /// # Errors
    /// See [`StartError`]; no port stays open.
    pub async fn open(settings: &Settings) -> Result<(Driver, mpsc::Sender<Request>), StartError> {
        let powered = loading::power_on(settings)?;
        let transcript = TranscriptSink::create(settings, &powered)?;
        let (sender, requests) = mpsc::channel(REQUEST_QUEUE);
        let mut clock = Clock::start(settings.time).with_gap(settings.time_gap);
        clock.set(powered.controller.now());
        let mut driver = Driver {
            initial_controller: powered.controller.clone(),
            restored: powered.restored,
            controller: powered.controller,
            clock,
            channels: Channels::new(settings.listen, settings.ports, settings.links),
            serial_lines: SerialLines::new(settings.serial.clone(), settings.links),
            backing: powered.backing,
            log: EventLog::default(),
            requests,
            rotation: SourceRotation::default(),
            snapshot_store: SnapshotStore::default(),
            observer: None,
            transcript,
            scenario: None,
            journal: None,
            run_record: RunRecord::default(),
            record_lines: settings.record_lines,
            ports: BTreeMap::new(),
            has_demo: powered.demo,
            servo_on: settings.servo_on,
            faults: settings.faults.clone(),
            waits: Vec::new(),
        };
        driver.run_record.add_files(&driver.controller);
        driver.controller.trace(settings.record_lines);
        // A snapshot can hold a controller that is powered off; it has no open ports.
        if driver.controller.state().powered {
            driver.ports = driver.channels.open(driver.controller.network())?;
        }
        driver.serial_lines.open(&driver.controller)?;
        driver.start().await;
        Ok((driver, sender))
    }

    /// TCP port of each server channel.
    #[must_use]
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        &self.ports
    }

    /// Findings, coverage and executed lines of this run; clones share the data.
    #[must_use]
    pub fn run_record(&self) -> RunRecord {
        self.run_record.clone()
    }

    /// Endpoint (path or address) of each open serial line.
    #[must_use]
    pub fn serial_endpoints(&self) -> BTreeMap<Port, SerialEndpoint> {
        self.serial_lines.endpoints()
    }

    /// Whether the example program was stored on the RAM drive.
    #[must_use]
    pub fn has_demo(&self) -> bool {
        self.has_demo
    }

    /// Starts a scenario; it sees every input and output from now on.
    pub fn set_scenario(&mut self, scenario: Play) {
        scenario.start(&self.controller);
        self.scenario = Some(scenario);
    }

    /// Opens the control interface if the settings configure one, and returns its address. Requests are
    /// answered while [`Driver::run`] runs.
    ///
    /// # Errors
    /// [`StartError::Control`].
    pub fn open_control(
        &mut self,
        settings: &Settings,
        requests: &mpsc::Sender<Request>,
    ) -> Result<Option<std::net::SocketAddr>, StartError> {
        let Some(control) = &settings.control else {
            return Ok(None);
        };
        let server = interface::Server::bind(control).map_err(|reason| StartError::Control {
            address: control.address,
            reason,
        })?;
        let address = server.address();
        let journal = Arc::new(Journal::with_transcript(self.transcript.buffer()));
        self.journal = Some(Arc::clone(&journal));
        server.serve(requests.clone(), journal);
        Ok(Some(address))
    }

    /// Sends every output that was carried out to `feeder`.
    pub fn set_observer(&mut self, feeder: WatchSender) {
        self.observer = Some(feeder);
    }

    /// Runs until `stop` completes, logs the outcome of every fault, closes all ports and returns the final
    /// controller.
    pub async fn run(mut self, stop: impl Future<Output = ()>) -> Controller {
        self.serve(stop).await;
        // Handle what is already due, so that the returned state and the report agree.
        self.feed(Input::Tick).await;
        faults::log_summary(self.controller.faults());
        self.channels.close();
        self.serial_lines.close().await;
        self.controller
    }

    /// Handles an input of the host and every input that results from it.
    async fn feed(&mut self, input: Input) {
        // The refusal of an action that nobody waits for is an event.
        let _ = self.feed_from(input, Side::Host).await;
    }

    /// As [`Driver::feed`]; transcripts name the side that has caused it.
    ///
    /// # Errors
    /// Why `input`, an action, had no effect. The actions of a scenario that come with it are not the caller's.
    async fn feed_from(&mut self, input: Input, mut by: Side) -> Result<(), ActionError> {
        let mut inputs = VecDeque::from([input]);
        let mut first = None;
        while let Some(input) = inputs.pop_front() {
            let now = self.clock.now();
            let now = self.catch_up(now, by, &mut inputs).await;
            let result = self.step(now, input, by, &mut inputs).await;
            first.get_or_insert(result);
            // What follows from the first input is the controller's own doing.
            by = Side::Robot;
            if inputs.is_empty() {
                self.catch_up(now, by, &mut inputs).await;
            }
        }
        // Grant read credit last: inputs that are still queued here would otherwise be counted as free room.
        self.serial_lines.grant_read_credit(&self.controller);
        self.transcript.flush();
        self.end_waits();
        self.update_idle();
        first.unwrap_or(Ok(()))
    }

    /// Tells the clock whether wall-clock time matters to anybody: a connected peer or a pending wait.
    fn update_idle(&mut self) {
        let has_peer = |port: &Port| self.controller.peer(*port).is_some();
        let idle =
            self.waits.is_empty() && self.controller.host_is_silent() && !Port::ALL.iter().any(has_peer);
        self.clock.set_idle(idle);
    }

    /// Earliest time at which the controller or the scenario has something due.
    fn deadline(&self) -> Option<Time> {
        let scenario = self.scenario.as_ref().and_then(Play::deadline);
        self.controller.poll_deadline().into_iter().chain(scenario).min()
    }

    /// Handles everything that was due before `now`, each item at the time it was due, however late the driver
    /// is. After [`CATCH_UP_SLICE`] of work it stops, so that hosts and requests get a turn; virtual time then
    /// lags. Returns the virtual time that was reached.
    async fn catch_up(&mut self, now: Time, by: Side, inputs: &mut VecDeque<Input>) -> Time {
        let begun = Instant::now();
        loop {
            let due = self.controller.poll_deadline().filter(|due| *due < now);
            let scenario = self.scenario.as_ref();
            let action = scenario.and_then(|scenario| scenario.due(due.unwrap_or(now)));
            let (at, input) = match (action, due) {
                (Some((at, input)), _) => (at, input),
                (None, Some(due)) => (due, Input::Tick),
                (None, None) => return now,
            };
            // A scenario's refused action is an event; no caller waits for its result.
            let _ = self.step(at.max(self.controller.now()), input, by, inputs).await;
            if begun.elapsed() > CATCH_UP_SLICE {
                let reached = self.controller.now();
                if self.clock.note_lag(reached) {
                    let mode = self.clock.mode();
                    warn!(
                        "this machine cannot keep up with --time {mode}: virtual time lags (`behind` of /clock)"
                    );
                }
                return reached;
            }
        }
    }

    /// One input at its time, and what the controller puts out.
    async fn step(
        &mut self,
        at: Time,
        input: Input,
        by: Side,
        inputs: &mut VecDeque<Input>,
    ) -> Result<(), ActionError> {
        if let Input::Connected { port, .. } = &input {
            self.log.new_peer(*port);
        }
        self.transcript.input(at, &input, by);
        if let Some(scenario) = &self.scenario {
            scenario.input(at, &input);
        }
        if let Some(journal) = &self.journal {
            journal.input(at, &input);
        }
        let mut result = self.controller.handle(at, input);
        while let Some(output) = self.controller.poll_output() {
            if let Output::Persist { name, content } = &output {
                // An action that waited for the answer has its result now.
                let answered = self.persist(at, name, content.as_deref());
                if result == Ok(Accepted::Pending) {
                    result = answered;
                }
                continue;
            }
            if self.is_irrelevant_pace_finding(&output) {
                continue;
            }
            self.transcript.output(at, &output);
            if let Some(scenario) = &self.scenario {
                scenario.output(at, &output);
            }
            self.run_record.observe(at, &output);
            self.observe(&output);
            // Statement events are frequent and serve only line coverage and waits for a statement.
            if matches!(output, Output::Event(Event::Statement { .. })) && !self.waits_for_statement() {
                continue;
            }
            if let Some(journal) = &self.journal {
                journal.output(at, &output);
            }
            let watched = self.observer.as_ref().map(|_| output.clone());
            self.perform(output, inputs).await;
            if let (Some(feeder), Some(output)) = (&self.observer, watched) {
                feeder.send(output);
            }
        }
        self.log.flush();
        if let Some(scenario) = &self.scenario {
            scenario.settled(at, &self.controller);
        }
        result.map(drop)
    }

    /// Whether the output is a finding about the host's timing while virtual time runs slower than the host's
    /// clock.
    fn is_irrelevant_pace_finding(&self, output: &Output) -> bool {
        let Output::Event(Event::Finding { rule, .. }) = output else {
            return false;
        };
        !self.clock.keeps_pace() && Rule::by_id(rule).is_some_and(|rule| rule.timed)
    }

    /// Closes every channel and opens those of the current network parameters.
    async fn reopen_channels(&mut self, inputs: &mut VecDeque<Input>) -> Result<(), ChannelError> {
        let gone = self.channels.close();
        inputs.extend(gone.into_iter().map(|port| Input::Disconnected { port }));
        self.ports.clear();
        if self.controller.state().powered {
            self.ports = self.channels.open(self.controller.network())?;
        }
        Ok(())
    }

    async fn perform(&mut self, output: Output, inputs: &mut VecDeque<Input>) {
        match output {
            Output::Send { port, bytes } => {
                self.clock.note_activity();
                if self.serial_lines.has(port) {
                    self.serial_lines.send(port, bytes.into());
                } else {
                    inputs.extend(self.channels.send(port, bytes));
                }
            }
            // `step` has persisted the change already, before the controller applied it.
            Output::Persist { .. } => {}
            Output::Stored { .. } | Output::Erased { .. } => self.retry_unsaved_files(),
            Output::PowerOff => {
                info!("power off; no port is open");
                let gone = self.channels.close();
                inputs.extend(gone.into_iter().map(|port| Input::Disconnected { port }));
                self.ports.clear();
            }
            Output::PowerCycled => {
                inputs.extend(self.serial_lines.power_cycled(&self.controller));
                match self.reopen_channels(inputs).await {
                    Ok(()) => info!("power cycled; ports: {:?}", self.ports),
                    Err(reason) => error!("after the power cycle no port is open: {reason}"),
                }
            }
            Output::Disconnect { port, how } => inputs.extend(self.channels.disconnect(port, how)),
            Output::Stall { port } => self.channels.stall(port),
            Output::Pendant(text) => info!(event = "pendant", text, "teach pendant: {text}"),
            Output::Event(event) => {
                // Save the error history before an answer that reports the alarm is sent.
                if let Event::Alarm { .. } = &event {
                    self.save_history();
                }
                self.log.write(self.clock.now(), &event);
            }
        }
    }
}

pub mod self_check;
mod snapshots;
#[cfg(test)]
mod tests;
