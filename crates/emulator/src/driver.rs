//! The one owner of the controller and its one loop: a link message, a panel action, a deadline or the end.
//! One input, all its outputs, the next input. Nothing here knows what bytes or states mean.

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
use crate::snapshot::handle::{SnapshotHandle, SnapshotRequest};
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
use ts3100_controller::Controller;
use ts3100_controller::action::ActionError;
use ts3100_controller::faults::Fault;
use ts3100_controller::findings::Rule;
use ts3100_controller::input::Input;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

mod control;
mod persistence;
pub mod request;
mod run_loop;
pub mod wait;

use request::{PendingWait, Request};
use run_loop::SourceRotation;

/// Requests that may wait for the driver; then those who ask wait.
pub const REQUEST_QUEUE: usize = 64;

/// Why the emulator cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A file or the backing directory.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A file the controller does not take.
    #[error("{name} cannot be stored on the RAM drive: {reason}")]
    Store {
        /// Its name on the drive.
        name: String,
        /// Why.
        reason: String,
    },
    /// The file to be selected.
    #[error("{name} cannot be selected: {reason}")]
    Select {
        /// Its name on the drive.
        name: String,
        /// Why, with the diagnostics of the compiler.
        reason: String,
    },
    /// A port.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The control interface.
    #[error("the control interface cannot listen on {address}: {reason}")]
    Control {
        /// Where.
        address: std::net::SocketAddr,
        /// What the system said.
        reason: std::io::Error,
    },
    /// A serial line.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// A transcript.
    #[error(transparent)]
    Transcript(#[from] RecorderError),
    /// The snapshot to begin with.
    #[error(transparent)]
    Snapshot(#[from] snapshot::FileError),
    /// The runtime or the thread of an embedded emulator.
    #[error("the operating system refuses a {what}: {reason}")]
    System {
        /// What was asked for.
        what: &'static str,
        /// What it said.
        reason: std::io::Error,
    },
}

/// A controller with its links, clock and store.
pub struct Driver {
    controller: Controller,
    clock: Clock,
    channels: Channels,
    serial_lines: SerialLines,
    backing: Option<Backing>,
    log: EventLog,
    requests: mpsc::Receiver<Request>,
    snapshot_requests: mpsc::Receiver<SnapshotRequest>,
    rotation: SourceRotation,
    snapshot_handle: SnapshotHandle,
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
    /// Faults that are armed from the start.
    faults: Vec<Fault>,
    /// The controller as it was before the first input, for a reset.
    initial_controller: Controller,
    /// It was not new from its files: a snapshot's, or one with an error history.
    restored: bool,
    waits: Vec<PendingWait>,
    /// Why the action that was just fed had no effect.
    last_error: Option<ActionError>,
}

impl Driver {
    /// Powers the controller on and opens its ports. The sender takes requests; when all senders are
    /// dropped, [`Driver::run`] goes on without them.
    ///
    /// # Errors
    /// See [`StartError`]; nothing is left open.
    pub async fn open(settings: &Settings) -> Result<(Driver, mpsc::Sender<Request>), StartError> {
        let powered = loading::power_on(settings)?;
        let transcript = TranscriptSink::create(settings, &powered)?;
        let (sender, requests) = mpsc::channel(REQUEST_QUEUE);
        let (snapshot_handle, orders) = SnapshotHandle::channel();
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
            snapshot_requests: orders,
            rotation: SourceRotation::default(),
            snapshot_handle,
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
            last_error: None,
        };
        driver.run_record.add_files(&driver.controller);
        driver.controller.trace(settings.record_lines);
        // A snapshot may be one of a controller that is off.
        if driver.controller.state().powered {
            driver.ports = driver.channels.open(driver.controller.network())?;
        }
        driver.serial_lines.open(&driver.controller)?;
        driver.start().await;
        Ok((driver, sender))
    }

    /// The port each server channel accepts on.
    #[must_use]
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        &self.ports
    }

    /// The record of this run.
    #[must_use]
    pub fn run_record(&self) -> RunRecord {
        self.run_record.clone()
    }

    /// Where the serial lines are.
    #[must_use]
    pub fn serial_endpoints(&self) -> BTreeMap<Port, SerialEndpoint> {
        self.serial_lines.endpoints()
    }

    /// Whether the example program is on the drive.
    #[must_use]
    pub fn has_demo(&self) -> bool {
        self.has_demo
    }

    /// Where snapshots are asked for.
    #[must_use]
    pub fn snapshot_handle(&self) -> SnapshotHandle {
        self.snapshot_handle.clone()
    }

    /// From now on this scenario is played.
    pub fn set_scenario(&mut self, scenario: Play) {
        scenario.start(&self.controller);
        self.scenario = Some(scenario);
    }

    /// Opens the control interface, if the settings ask for one; says where it is. It answers while the driver runs.
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

    /// From now on what has been done is told to `feeder`.
    pub fn set_observer(&mut self, feeder: WatchSender) {
        self.observer = Some(feeder);
    }

    /// Serves until `stop` is ready, then says what became of the faults and closes every port. The controller as it
    /// was then.
    pub async fn run(mut self, stop: impl Future<Output = ()>) -> Controller {
        self.serve(stop).await;
        // What is due by now has happened in the state that is told.
        self.feed(Input::Tick).await;
        faults::log_summary(self.controller.faults());
        self.channels.close().await;
        self.serial_lines.close().await;
        self.controller
    }

    /// One input and everything that follows from it.
    async fn feed(&mut self, input: Input) {
        self.feed_from(input, Side::Host).await;
    }

    /// As [`Driver::feed`]; who has caused it stands in transcripts.
    async fn feed_from(&mut self, input: Input, mut by: Side) {
        let mut inputs = VecDeque::from([input]);
        while let Some(input) = inputs.pop_front() {
            let now = self.clock.now();
            let now = self.catch_up(now, by, &mut inputs).await;
            self.step(now, input, by, &mut inputs).await;
            // What follows from the first input is the controller's own doing.
            by = Side::Robot;
            if inputs.is_empty() {
                self.catch_up(now, by, &mut inputs).await;
            }
        }
        // Not before: room for bytes that still wait here would be given away twice.
        self.serial_lines.grant_read_credit(&self.controller);
        self.transcript.flush();
        self.end_waits();
        self.update_idle();
    }

    /// Tells the clock whether anybody is there for whom the wall counts.
    fn update_idle(&mut self) {
        let has_peer = |port: &Port| self.controller.peer(*port).is_some();
        let idle =
            self.waits.is_empty() && self.controller.host_is_silent() && !Port::ALL.iter().any(has_peer);
        self.clock.set_idle(idle);
    }

    /// When something happens by itself.
    fn deadline(&self) -> Option<Time> {
        let scenario = self.scenario.as_ref().and_then(Play::deadline);
        self.controller.poll_deadline().into_iter().chain(scenario).min()
    }

    /// However late the wall is: what was due before is done, and recorded with the time at which it was due. What takes
    /// longer than [`CATCH_UP_SLICE`] is left: virtual time lags, and whoever waits gets a turn. Returns the moment it is now.
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
            self.step(at.max(self.controller.now()), input, by, inputs).await;
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
    async fn step(&mut self, at: Time, input: Input, by: Side, inputs: &mut VecDeque<Input>) {
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
        self.controller.handle(at, input);
        while let Some(output) = self.controller.poll_output() {
            if let Output::Persist { name, content } = &output {
                self.persist(at, name, content.as_deref());
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
            // They are told for the record of lines alone, and there are very many.
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
    }

    /// Whether the output is a finding about the host's pace, and virtual time is not the host's time.
    fn is_irrelevant_pace_finding(&self, output: &Output) -> bool {
        let Output::Event(Event::Finding { rule, .. }) = output else {
            return false;
        };
        !self.clock.keeps_pace() && Rule::by_id(rule).is_some_and(|rule| rule.timed)
    }

    /// Closes every port and opens those that the controller now has.
    async fn reopen_channels(&mut self, inputs: &mut VecDeque<Input>) -> Result<(), ChannelError> {
        let gone = self.channels.close().await;
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
                    self.serial_lines.send(port, bytes);
                } else {
                    inputs.extend(self.channels.send(port, bytes).await);
                }
            }
            // A change is kept before it happens.
            Output::Persist { .. } => {}
            Output::Stored { .. } | Output::Erased { .. } => self.retry_unsaved_files(),
            Output::PowerOff => {
                info!("power off; no port is open");
                let gone = self.channels.close().await;
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
            Output::Rejected(refusal) => {
                info!(event = "undone", "{refusal}");
                self.last_error = Some(refusal);
            }
            Output::Disconnect { port, how } => inputs.extend(self.channels.disconnect(port, how)),
            Output::Stall { port } => self.channels.stall(port),
            Output::Pendant(text) => info!(event = "pendant", text, "teach pendant: {text}"),
            Output::Event(event) => {
                // Before an answer that tells of it leaves.
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
