//! The controller value: what it is made of, and the loop of one input, its effects, and the deadlines.

use crate::alarm::{Alarm, Alarms};
use crate::arm::Arm;
use crate::channel::Channel;
use crate::drive::{Drive, DriveError};
use crate::executor::{Executor, RunState, Selected};
use crate::faults::Faults;
use crate::input::{Input, KeySwitch};
use crate::maintenance::MaintenanceCounters;
use crate::network::NetworkConfig;
use crate::options::Config;
use crate::output::{Event, Output};
use crate::persistence::Persistence;
use crate::port::Port;
use crate::send_queue::SendQueue;
use crate::serial_line::SerialLine;
use crate::session::Session;
use crate::signals::Signals;
use crate::state::{PanelState, Watchdog};
use crate::time::Time;
use crate::variation::Variation;
use alloc::collections::{BTreeMap, VecDeque};
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use scol_mini::{Diagnostic, Memory, Severity};
use thiserror::Error;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::name::{FileName, NameError};
use ts3100_proto::parameter::{EthernetParameters, UserParameters};

/// Why a file was not selected.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SelectError {
    /// Not a file name.
    #[error("file name: {0}")]
    Name(NameError),
    /// Not on the RAM drive.
    #[error("file {0} is not on the RAM drive")]
    Missing(String),
    /// A parameter file.
    #[error("file {0} is a parameter file, not a program")]
    Parameter(String),
    /// A program runs.
    #[error("a program is running; stop it first")]
    Running,
    /// It does not compile; the diagnostics rendered.
    #[error("file {name} has errors\n{rendered}")]
    Errors {
        /// The file.
        name: String,
        /// Its diagnostics with carets.
        rendered: String,
    },
}

impl From<NameError> for SelectError {
    fn from(error: NameError) -> SelectError {
        SelectError::Name(error)
    }
}

/// The robot controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    pub(crate) config: Config,
    pub(crate) now: Time,
    pub(crate) state: PanelState,
    pub(crate) drive: Drive,
    pub(crate) alarms: Alarms,
    pub(crate) signals: Signals,
    /// HOST and IP0.
    pub(crate) sessions: BTreeMap<Port, Session>,
    /// COM1, IP1, IP2, and IP3 for its peer alone.
    pub(crate) channels: BTreeMap<Port, Channel>,
    /// HOST and COM1.
    pub(crate) lines: BTreeMap<Port, SerialLine>,
    /// What was typed at the teach pendant.
    pub(crate) keys: Channel,
    /// What PRINT has shown on the teach pendant.
    pub(crate) pendant: String,
    pub(crate) executor: Executor,
    pub(crate) arm: Arm,
    /// The port whose host guides the arm by JG.
    pub(crate) jogging: Option<Port>,
    pub(crate) ethernet: EthernetParameters,
    pub(crate) user: UserParameters,
    pub(crate) network: NetworkConfig,
    /// Every statement of the program is told as an event.
    pub(crate) traced: bool,
    /// What is counted for the maintenance information.
    pub(crate) maintenance: MaintenanceCounters,
    /// What is broken on purpose.
    pub(crate) faults: Faults,
    /// What varies, if anything.
    pub(crate) variation: Option<Variation>,
    /// What leaves later.
    pub(crate) send_queue: SendQueue,
    pub(crate) outputs: VecDeque<Output>,
    pub(crate) persistence: Persistence,
}

impl Controller {
    /// A controller whose power has just come on, with these files on its RAM drive. Parameter files that
    /// are missing are made.
    ///
    /// # Errors
    /// A file that the RAM drive does not take.
    pub fn new(config: Config, files: Vec<(String, Vec<u8>)>) -> Result<Controller, DriveError> {
        let mut drive = Drive::new(config.options.drive_capacity);
        for (name, content) in files {
            drive.store(&FileName::parse(&name)?, &content)?;
        }
        let arm = Arm::new(config.model.clone());
        let text = config.options.text;
        let ethernet = EthernetParameters {
            open_mode: config.options.open_mode,
            ..EthernetParameters::factory()
        };
        let key = if config.key == KeySwitch::Internal && !config.controller.has_internal() {
            KeySwitch::Ext
        } else {
            config.key
        };
        let mut controller = Controller {
            now: Time::ZERO,
            state: PanelState::power_on(Time::ZERO, key, config.control_right),
            drive,
            alarms: Alarms::default(),
            signals: Signals::default(),
            sessions: [Port::Host, Port::Ip0]
                .map(|port| (port, Session::new(port, text)))
                .into(),
            channels: [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3]
                .map(|port| (port, Channel::default()))
                .into(),
            lines: fresh_lines(),
            keys: Channel::default(),
            pendant: String::new(),
            executor: Executor::new(&config.language()),
            arm,
            jogging: None,
            network: NetworkConfig::new(&ethernet),
            ethernet,
            user: UserParameters::factory(),
            traced: false,
            maintenance: MaintenanceCounters::default(),
            faults: Faults::new(config.fault_seed),
            variation: config.vary.map(Variation::new),
            send_queue: SendQueue::default(),
            outputs: VecDeque::new(),
            persistence: Persistence::default(),
            config,
        };
        controller.make_parameter_files()?;
        controller.take_parameters();
        controller.show_state();
        controller.update_maintenance();
        Ok(controller)
    }

    /// This controller, whose error history (EU) goes on from before the power came on: newest first.
    #[must_use]
    pub fn remembering(mut self, history: impl IntoIterator<Item = Alarm>) -> Controller {
        self.alarms.append_history(history);
        self
    }

    /// Takes one thing that happened at `now`. Deadlines before it are served first, each at its own time.
    /// A `now` before the last one counts as the last one.
    pub fn handle(&mut self, now: Time, input: Input) {
        if let Input::Persisted(answer) = input {
            return self.persisted(answer);
        }
        while self.persistence.is_pending() {
            self.persisted(Err("nobody has answered".to_string()));
        }
        self.advance_to(now);
        if self.persistence.is_pending() {
            return self.persistence.defer(now, input);
        }
        match input {
            // Nobody is there to hear it.
            Input::Connected { .. }
            | Input::Received { .. }
            | Input::Disconnected { .. }
            | Input::SerialOpened { .. }
            | Input::SerialErrors { .. }
            | Input::SerialPurged { .. }
                if !self.state.powered => {}
            Input::Tick | Input::Persisted(_) => {}
            Input::Connected { port, peer } => self.connected(port, peer),
            Input::SerialOpened { port, host } => self.line_opened(port, host),
            Input::SerialPurged { port } => self.purge_line(port),
            Input::SerialErrors { port, bytes } => self.line_faults(port, &bytes),
            Input::Received { port, bytes } => self.received(port, &bytes),
            Input::Disconnected { port } => self.peer_left(port),
            Input::SecondPeer { port, peer, kept } => self.second_peer(port, &peer, kept),
            Input::Backlogged { port } => self.unread(port),
            Input::Panel(panel) => self.panel(panel),
            Input::Action(action) => self.act(action),
        }
        self.settle();
    }

    /// What is to be done outside, in order.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When the controller wants to be called again, at the latest.
    #[must_use]
    pub fn poll_deadline(&self) -> Option<Time> {
        let sessions = self.sessions.values().filter_map(|session| {
            let sp = session.sp_due().filter(|_| !self.line_is_taken(session.port));
            session.deadline().into_iter().chain(sp).min()
        });
        sessions
            .chain(self.line_deadline())
            .chain(self.send_queue.deadline())
            .chain(self.faults.deadline())
            .chain(self.arm.ends_at())
            .chain(self.arrives_at())
            .chain(self.executor.deadline())
            .chain(self.signals.deadline())
            .chain(self.state.servo_due)
            .chain(self.state.watchdog.as_ref().map(Watchdog::deadline))
            .min()
    }

    /// Handles one input and drains what comes of it.
    pub fn feed(&mut self, now: Time, input: Input) -> Vec<Output> {
        self.handle(now, input);
        core::iter::from_fn(|| self.poll_output()).collect()
    }

    /// Whether time may be jumped over: no host is in the middle of a text or owes an answer, none has promised to
    /// be heard in time (WD), and none holds a guided motion. While characters are on its line a host owes nothing.
    #[must_use]
    pub fn host_is_silent(&self) -> bool {
        let mut sessions = self.sessions.values();
        let owes = sessions.any(|session| {
            session.awaits_host()
                && !self.line_is_busy(session.port)
                && !self.send_queue.is_busy(session.port)
        });
        !owes && self.state.watchdog.is_none() && !self.is_jogging()
    }

    /// Whether a host guides the arm right now.
    pub(crate) fn is_jogging(&self) -> bool {
        self.jogging.is_some() && self.arm.is_moving()
    }

    /// The Ethernet channels as of the last power-on.
    #[must_use]
    pub fn network(&self) -> &NetworkConfig {
        &self.network
    }

    /// The virtual time up to which everything has happened.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }

    /// Stores a file as a completed download does, without asking whether it is kept outside.
    ///
    /// # Errors
    /// What the RAM drive does not take.
    pub fn put_file(&mut self, name: &str, content: &[u8]) -> Result<(), DriveError> {
        let name = FileName::parse(name)?;
        self.drive.check(&name, content)?;
        self.put_in_place(&name, content);
        Ok(())
    }

    /// Selects the execution file as SL does.
    ///
    /// # Errors
    /// See [`SelectError`].
    pub fn select(&mut self, now: Time, name: &str) -> Result<(), SelectError> {
        self.advance_to(now);
        let name = FileName::parse(name)?;
        self.select_file(&name)
    }

    fn advance_to(&mut self, now: Time) {
        while let Some(due) = self.poll_deadline().filter(|&due| due <= now) {
            self.now = self.now.max(due);
            self.run_scheduled();
            self.send_due();
            self.serve_lines();
            self.expire_sessions();
            self.expire_watchdog();
            self.settle();
            if self.persistence.is_pending() {
                return;
            }
        }
        self.now = self.now.max(now);
        self.receive_from_lines();
    }

    /// Outputs that were not fetched yet.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = &Output> {
        self.outputs.iter()
    }

    pub(crate) fn push_output(&mut self, output: Output) {
        self.outputs.push_back(output);
    }

    pub(crate) fn event(&mut self, event: Event) {
        self.outputs.push_back(Output::Event(event));
    }

    /// Date and time now, for the error history.
    pub(crate) fn calendar(&self) -> CalendarTime {
        self.config
            .calendar
            .plus_seconds(self.now.as_micros() / 1_000_000)
    }

    pub(crate) fn store(&mut self, name: &FileName, content: &[u8]) -> Result<(), DriveError> {
        self.drive.check(name, content)?;
        self.persist(name.as_str(), Some(content))?;
        self.put_in_place(name, content);
        Ok(())
    }

    /// Stores what was checked.
    fn put_in_place(&mut self, name: &FileName, content: &[u8]) {
        self.drive.store_checked(name, content);
        self.push_output(Output::Stored {
            name: name.as_str().to_string(),
            content: content.to_vec(),
        });
        if let Some(selected) = self
            .executor
            .selected
            .as_mut()
            .filter(|selected| selected.name == name.as_str())
        {
            selected.stale = true;
            if !self.executor.program_runs() {
                self.executor.rewind(self.now);
            }
        }
    }

    pub(crate) fn select_file(&mut self, name: &FileName) -> Result<(), SelectError> {
        let label = || name.as_str().to_string();
        if self.executor.status() == ts3100_proto::status::ExecutionStatus::Running {
            return Err(SelectError::Running);
        }
        if name.is_parameter() {
            return Err(SelectError::Parameter(label()));
        }
        let content = self
            .drive
            .get(name.as_str())
            .ok_or_else(|| SelectError::Missing(label()))?;
        let source = String::from_utf8_lossy(content).into_owned();
        let compilation = self.config.compile(&source);
        let Some(program) = compilation.program else {
            return Err(SelectError::Errors {
                name: label(),
                rendered: render(&compilation.diagnostics, &source, name),
            });
        };
        let memory = Memory::new(&program);
        self.executor.selected = Some(Selected {
            name: label(),
            source,
            program,
            memory,
            stale: false,
        });
        self.executor.rewind(self.now);
        self.event(Event::Selected(Some(label())));
        Ok(())
    }

    pub(crate) fn deselect(&mut self) {
        self.executor.selected = None;
        self.executor.main = None;
        self.executor.drop_tasks();
        self.executor.course = RunState::Reset;
        self.event(Event::Selected(None));
    }
}

/// The serial lines when the power comes on.
pub(crate) fn fresh_lines() -> BTreeMap<Port, SerialLine> {
    [Port::Host, Port::Com1]
        .map(|port| (port, SerialLine::default()))
        .into()
}

fn render(diagnostics: &[Diagnostic], source: &str, name: &FileName) -> String {
    let errors = diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.severity == Severity::Error);
    errors
        .map(|diagnostic| diagnostic.render(source, name.as_str()))
        .collect::<Vec<_>>()
        .join("\n")
}
