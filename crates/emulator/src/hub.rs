//! The one owner of the controller and its one loop: a link message, a panel action, a deadline or the end.
//! One input, all its outputs, the next input. Nothing here knows what bytes or states mean.

use crate::clock::{Clock, Wake};
use crate::config::Settings;
use crate::control as interface;
use crate::control::journal::Journal;
use crate::link::{LinkError, Links};
use crate::loading::{self, LoadError, Loaded};
use crate::log::EventLog;
use crate::store::Store;
use crate::watch::Feeder;
use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use tokio::sync::mpsc;
use tracing::info;
use ts3100_controller::Controller;
use ts3100_controller::deed::Refusal;
use ts3100_controller::input::Input;
use ts3100_controller::output::Output;
use ts3100_controller::port::Port;

pub mod condition;
mod control;
pub mod request;

use request::{Pending, Request};

/// Turns the other tasks get before time jumps: the runtime looks at its sockets in each, a link task reads
/// in the next, and its message is there in the one behind.
const TURNS_BEFORE_A_JUMP: u32 = 3;

/// Requests that may wait for the hub; then those who ask wait.
pub const WAITING_REQUESTS: usize = 64;

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
    Link(#[from] LinkError),
    /// The control interface.
    #[error("the control interface cannot listen on {address}: {source}")]
    Control {
        /// Where.
        address: std::net::SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// The runtime or the thread of an embedded emulator.
    #[error("the operating system refuses a {what}: {source}")]
    System {
        /// What was asked for.
        what: &'static str,
        /// What it said.
        source: std::io::Error,
    },
}

/// A controller with its links, clock and store.
pub struct Hub {
    controller: Controller,
    clock: Clock,
    links: Links,
    store: Option<Store>,
    log: EventLog,
    requests: mpsc::Receiver<Request>,
    watch: Option<Feeder>,
    journal: Option<Arc<Journal>>,
    ports: BTreeMap<Port, u16>,
    demo: bool,
    servo_on: bool,
    /// The controller as it was before the first input, for a reset.
    initial: Controller,
    waits: Vec<Pending>,
    /// Why the deed that was just fed had no effect.
    refusal: Option<Refusal>,
}

impl Hub {
    /// Powers the controller on and opens its ports. The sender takes requests; when all senders are
    /// dropped, [`Hub::run`] goes on without them.
    ///
    /// # Errors
    /// See [`StartError`]; nothing is left open.
    pub async fn open(settings: &Settings) -> Result<(Hub, mpsc::Sender<Request>), StartError> {
        let Loaded {
            store,
            present,
            put,
            demo,
        } = loading::load(settings)?;
        let controller =
            Controller::new(settings.controller.clone(), present).map_err(|error| StartError::Store {
                name: "a file".to_owned(),
                reason: error.to_string(),
            })?;
        let (sender, requests) = mpsc::channel(WAITING_REQUESTS);
        let mut hub = Hub {
            initial: controller.clone(),
            controller,
            clock: Clock::start(settings.time),
            links: Links::new(settings.listen, settings.ports, settings.links),
            store,
            log: EventLog::default(),
            requests,
            watch: None,
            journal: None,
            ports: BTreeMap::new(),
            demo,
            servo_on: settings.servo_on,
            waits: Vec::new(),
            refusal: None,
        };
        for (name, content) in put {
            let stored = hub.controller.put_file(&name, &content);
            stored.map_err(|error| StartError::Store {
                name,
                reason: error.to_string(),
            })?;
        }
        if let Some(name) = &settings.select {
            let selected = hub.controller.select(hub.clock.now(), name);
            selected.map_err(|error| StartError::Select {
                name: name.clone(),
                reason: error.to_string(),
            })?;
        }
        hub.ports = hub.links.open(hub.controller.network())?;
        hub.initial = hub.controller.clone();
        hub.begin().await;
        Ok((hub, sender))
    }

    /// The port each server channel accepts on.
    #[must_use]
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        &self.ports
    }

    /// Whether the example program is on the drive.
    #[must_use]
    pub fn has_demo(&self) -> bool {
        self.demo
    }

    /// Opens the control interface, if the settings ask for one; says where it is. It answers while the hub runs.
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
        let server = interface::Server::bind(control).map_err(|source| StartError::Control {
            address: control.address,
            source,
        })?;
        let address = server.address();
        let journal = Arc::new(Journal::default());
        self.journal = Some(Arc::clone(&journal));
        server.serve(requests.clone(), journal);
        Ok(Some(address))
    }

    /// From now on what has been done is told to `feeder`.
    pub fn watched_by(&mut self, feeder: Feeder) {
        self.watch = Some(feeder);
    }

    /// Serves until `stop` is ready, then closes every port.
    pub async fn run(mut self, stop: impl Future<Output = ()>) {
        self.serve(stop).await;
        self.links.close().await;
    }

    async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        let mut requests_open = true;
        loop {
            let (wake, deadline) = self.next_wake();
            // In this order: `auto` may jump only when nothing else is there to be done.
            tokio::select! {
                biased;
                () = &mut stop => break,
                request = self.requests.recv(), if requests_open => match request {
                    Some(request) => self.serve_request(request).await,
                    None => requests_open = false,
                },
                message = self.links.next() => if let Some(message) = message {
                    self.clock.stir();
                    for input in self.links.take(message) {
                        self.feed(input).await;
                    }
                },
                () = sleep(wake) => {
                    if let (Wake::JumpAfter(_), Some(deadline)) = (wake, deadline) {
                        self.clock.jump(deadline);
                    }
                    self.feed(Input::Tick).await;
                }
            }
        }
    }

    /// One input and everything that follows from it.
    async fn feed(&mut self, input: Input) {
        let mut inputs = VecDeque::from([input]);
        while let Some(input) = inputs.pop_front() {
            let now = self.clock.now();
            if let Some(journal) = &self.journal {
                journal.input(now, &input);
            }
            self.controller.handle(now, input);
            while let Some(output) = self.controller.poll_output() {
                self.notice(&output);
                if let Some(journal) = &self.journal {
                    journal.output(now, &output);
                }
                let watched = self.watch.as_ref().map(|_| output.clone());
                self.perform(output, &mut inputs).await;
                if let (Some(feeder), Some(output)) = (&self.watch, watched) {
                    feeder.put(output);
                }
            }
        }
        self.end_waits();
    }

    async fn perform(&mut self, output: Output, inputs: &mut VecDeque<Input>) {
        match output {
            Output::Send { port, bytes } => {
                self.clock.stir();
                inputs.extend(self.links.send(port, bytes).await);
            }
            Output::Stored { name, content } => {
                // Before the answer that follows it leaves: what the host believes stored is stored.
                let stored = self.store.as_mut().map(|store| store.put(&name, &content));
                if let Some(Err(reason)) = stored {
                    self.log.not_kept(self.clock.now(), &name, &reason);
                }
            }
            Output::Erased { name } => {
                if let Some(Err(reason)) = self.store.as_mut().map(|store| store.remove(&name)) {
                    self.log.not_removed(self.clock.now(), &name, &reason);
                }
            }
            Output::PowerOff => {
                info!("power off; no port is open");
                let gone = self.links.close().await;
                inputs.extend(gone.into_iter().map(|port| Input::Disconnected { port }));
                self.ports.clear();
            }
            Output::PowerCycled => {
                let gone = self.links.close().await;
                inputs.extend(gone.into_iter().map(|port| Input::Disconnected { port }));
                self.open_links();
                info!("power on; ports: {:?}", self.ports);
            }
            Output::Undone(refusal) => {
                info!(event = "undone", "{refusal}");
                self.refusal = Some(refusal);
            }
            Output::Pendant(text) => info!(event = "pendant", text, "teach pendant: {text}"),
            Output::Event(event) => self.log.write(self.clock.now(), &event),
        }
    }
}

async fn sleep(wake: Wake) {
    match wake {
        Wake::Never => std::future::pending().await,
        // Something is due already, but the links get their turn.
        Wake::After(duration) if duration.is_zero() => tokio::task::yield_now().await,
        Wake::JumpAfter(duration) if duration.is_zero() => {
            for _ in 0..TURNS_BEFORE_A_JUMP {
                tokio::task::yield_now().await;
            }
        }
        Wake::After(duration) | Wake::JumpAfter(duration) => tokio::time::sleep(duration).await,
    }
}

#[cfg(test)]
mod tests;
