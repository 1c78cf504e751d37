//! Emulators inside another process, for Rust tests. Each emulator listens on free ports of the loopback and ends
//! when its handle is dropped.
//!
//! The builder fills the same [`Settings`] as the command line, and the thread it starts runs the same driver
//! as `serve`. The methods of [`Emulator`] are the commands of `ts3100 ctl`; they are in `control`.
//!
//! ```
//! use std::time::Duration;
//! use ts3100_emulator::embed::{Emulator, Port, TimeMode};
//!
//! const PICK: &str = "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n";
//!
//! let robot = Emulator::builder()
//!     .file("PICK", PICK)
//!     .select("PICK")
//!     .servo_on(true)
//!     .time(TimeMode::Stepped)
//!     .start()?;
//! let ip0 = robot.address(Port::Ip0).ok_or("IP0 is closed")?;
//! let host = std::net::TcpStream::connect(ip0)?; // your host program
//!
//! robot.start_program()?;
//! robot.set_input(1, true)?;
//! assert!(robot.advance_until("output 5 on", Duration::from_secs(10))?);
//! assert!(robot.now()? >= Duration::from_secs(2));
//!
//! robot.set_emergency_stop(true)?;
//! let refused = robot.set_servo(true).unwrap_err();
//! assert_eq!(refused.to_string(), "cannot turn the servo on: the emergency stop is pressed");
//! # drop(host);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod control;

pub use crate::config::{LinkOptions, OptionError, Ports};
use crate::config::{Settings, set_option};
use crate::launch::Launched;
pub use crate::loading::StartError;
pub use crate::watch::WaitError;
use crate::watch::{Watch, channel};
pub use scol_mini::ValueKind;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::runtime::{self, Runtime};
use tokio::sync::oneshot;
pub use ts3100_control::ControlSettings;
pub use ts3100_controller::faults::{Fault, FaultError, FaultReport};
pub use ts3100_controller::findings::{Finding, Message, rules};
pub use ts3100_controller::input::JogMode;
pub use ts3100_controller::model::ArmModel;
pub use ts3100_controller::panel::PanelState;
pub use ts3100_controller::queries::VariableView;
use ts3100_controller::signals::LINE_NUMBERS;
pub use ts3100_controller::{Action, ActionError, ActionErrorKind, IoKind};
pub use ts3100_controller::{ArmPose, ConditionParseError, ControlRight, Controller, KeySwitch};
pub use ts3100_controller::{Config, ControllerType, Dialect, Options, PanelAction, Port, Time};
pub use ts3100_controller::{Event, Findings, Output, Rule, Severity, Verdict};
pub use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::FIRST;
use ts3100_driver::driver::request::{Request, Requests};
pub use ts3100_driver::serial::SerialEndpoint;
use ts3100_driver::snapshot;
pub use ts3100_driver::snapshot::SnapshotRequestError;
use ts3100_driver::snapshot::{CopyOfState, SnapshotTask};
pub use ts3100_proto::command::Number;
pub use ts3100_proto::command::RunMode;
pub use ts3100_proto::status::{ExecutionStatus, MasterMode};
pub use ts3100_proto::text::Framing;
pub use ts3100_recording::reports::{CoverageReport, RunRecord};
pub use ts3100_recording::transcript::FormatError;

/// Configures an emulator; see [`Emulator::builder`].
#[derive(Debug, Clone)]
pub struct Builder {
    settings: Settings,
}

/// Methods that set one thing.
macro_rules! setters {
    (|$settings:ident| $($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) => $set:expr;)*) => {
        /// Initial settings of an emulator.
        impl Builder {
            $(
                $(#[$doc])*
                pub fn $name(mut self $(, $argument: $type)*) -> Builder {
                    let $settings = &mut self.settings;
                    $set;
                    self
                }
            )*
        }
    };
}

setters! {
    |settings|
    /// Replaces the whole controller configuration: dialect, options, model, key switch. Named options set before are lost.
    controller(controller: Config) => settings.controller = controller;
    /// The arm (default: ts3100-tv800).
    model(model: ArmModel) => settings.controller.model = model;
    /// Position of the key switch at the start (default: EXT).
    key_switch(position: KeySwitch) => settings.controller.key = position;
    /// Sets the options of the TCP links and of the backing directory.
    links(links: LinkOptions) => settings.links = links;
    /// Address to listen on (default: 127.0.0.1).
    listen(address: IpAddr) => settings.listen = address;
    /// Port numbers (default: free ones).
    ports(ports: Ports) => settings.ports = ports;
    /// Endpoint of the serial port HOST or COM1 (default: none).
    serial(port: Port, end: SerialEndpoint) => settings.serial.insert(port, end);
    /// Time mode (default: real time).
    time(time: TimeMode) => settings.time = time;
    /// Backing directory of the RAM drive (default: memory only).
    drive(directory: impl Into<PathBuf>) => settings.files.drive = Some(directory.into());
    /// A file of the PC to put on the drive, as `--load` does.
    load(path: impl Into<PathBuf>) => settings.files.load.push(path.into());
    /// A file of the drive by its name there and its content.
    #[must_use]
    file(name: &str, content: impl AsRef<[u8]>) =>
        settings.contents.push((name.to_ascii_uppercase(), content.as_ref().to_vec()));
    /// File of the drive to select.
    select(name: &str) => settings.files.select = Some(name.to_owned());
    /// Records the executed lines of user files; see [`Emulator::evidence`].
    record_lines(on: bool) => settings.record_lines = on;
    /// Servo power at the start (default: off).
    servo_on(on: bool) => settings.servo_on = on;
    /// Seed for the random choices of faults (default: 0).
    fault_seed(seed: u64) => settings.controller.fault_seed = seed;
    /// Varies what the manual leaves open, from this seed (default: nothing varies).
    vary(seed: u64) => settings.controller.vary = Some(seed);
    /// Adds a control interface (default: none). [`ControlSettings::free`] is one on a free port of the loopback.
    control(control: ControlSettings) => settings.control = Some(control);
    /// Starts from this snapshot. The controller configuration, files and selection of the builder are ignored.
    restore(path: impl Into<PathBuf>) => settings.files.restore = Some(path.into());
}

impl Builder {
    /// Sets one named option (decision D0), for example `text.stx` and `required`.
    ///
    /// # Errors
    /// An unknown name, or a value the option does not take.
    pub fn option(mut self, key: &str, value: &str) -> Result<Builder, OptionError> {
        set_option(
            &mut self.settings.controller.options,
            &mut self.settings.links,
            key,
            value,
        )?;
        self.settings.flags.push(format!("set={key}={value}"));
        Ok(self)
    }

    /// A fault that is armed from the start, as `--fault` takes it.
    ///
    /// # Errors
    /// The specification is not valid.
    pub fn fault(mut self, spec: &str) -> Result<Builder, FaultError> {
        self.settings.faults.push(spec.parse()?);
        Ok(self)
    }

    /// A file for a transcript of every port, as `--transcript` does.
    ///
    /// # Errors
    /// A name that does not end in `.txt`, `.jsonl` or `.pcapng`.
    pub fn transcript(mut self, path: &str) -> Result<Builder, FormatError> {
        self.settings.reports.transcript.push(path.parse()?);
        Ok(self)
    }

    /// Starts the emulator in a thread of its own and returns when every port accepts connections.
    ///
    /// # Errors
    /// See [`StartError`].
    pub fn start(self) -> Result<Emulator, StartError> {
        let (started_sender, started) = std::sync::mpsc::sync_channel(1);
        let (stop, stopped) = oneshot::channel::<()>();
        let (observer, watch) = channel();
        let settings = self.settings;
        let listen = settings.listen;
        let controller = settings.controller.clone();
        let thread = std::thread::Builder::new()
            .name("ts3100".to_owned())
            .spawn(move || {
                let opened = single_threaded().and_then(|runtime| {
                    let entered = runtime.enter();
                    let (driver, launched) = Launched::alone(&settings)?;
                    let control = launched.open_control(&driver, &settings)?;
                    drop(entered);
                    Ok((runtime, driver, launched, control))
                });
                match opened {
                    Ok((runtime, mut driver, launched, control)) => {
                        driver.seat(FIRST).subscribe(Box::new(observer));
                        let started = Started {
                            ports: driver.ports(FIRST).clone(),
                            serial: driver.serial_endpoints(FIRST),
                            control,
                            requests: launched.requests.clone(),
                            evidence: launched.run_record.clone(),
                        };
                        if started_sender.send(Ok(started)).is_ok() {
                            runtime.block_on(driver.run(async {
                                // An error means that the handle was dropped, which ends the emulator as well.
                                let _ = stopped.await;
                            }));
                        }
                    }
                    // Fails only when nobody waits for the result.
                    Err(error) => drop(started_sender.send(Err(error))),
                }
            })
            .map_err(cannot_start("a thread"))?;
        match started.recv() {
            Ok(Ok(started)) => Ok(Emulator {
                listen,
                started,
                controller,
                watch,
                stop: Some(stop),
                thread: Some(thread),
            }),
            Ok(Err(error)) => Err(error),
            Err(_) => {
                let reason = io::Error::other("its thread ended during the start");
                Err(cannot_start("the emulator")(reason))
            }
        }
    }
}

/// The runtime every emulator runs in: one thread, which is all the driver needs.
pub(crate) fn single_threaded() -> Result<Runtime, StartError> {
    let built = runtime::Builder::new_current_thread().enable_all().build();
    built.map_err(cannot_start("an async runtime"))
}

/// The error of what the system does not start.
fn cannot_start(what: &'static str) -> impl FnOnce(io::Error) -> StartError {
    move |reason| StartError::System { what, reason }
}

/// Longest wall-clock time for which a method waits.
pub const MAX_WAIT: Duration = Duration::from_secs(30);

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The robot refuses it: `cannot turn the servo on: the emergency stop is pressed`.
    #[error(transparent)]
    Refused(#[from] ActionError),
    /// The specification of a fault is wrong.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// The condition cannot be read.
    #[error(transparent)]
    Condition(#[from] ConditionParseError),
    /// No line has this number.
    #[error("unknown line `{0}`: expected {LINE_NUMBERS}")]
    Line(u16),
    /// A reset or a snapshot replaced the state before the time had passed.
    #[error("cannot advance time to the end: a reset or a snapshot replaced the state")]
    CutShort,
    /// The wait has not ended in this wall-clock time.
    #[error("the condition was not met within {0:?} of wall-clock time")]
    Late(Duration),
    /// The queue is full ([`ts3100_driver::driver::REQUEST_QUEUE`]), or the emulator has ended.
    #[error("the emulator accepts no request: too many are waiting, or it has ended")]
    Ended,
}

/// State of an emulator when its ports are open.
#[derive(Debug)]
struct Started {
    ports: BTreeMap<Port, u16>,
    serial: BTreeMap<Port, SerialEndpoint>,
    control: Option<SocketAddr>,
    requests: Requests,
    evidence: RunRecord,
}

/// A running emulator. Dropping it ends the emulator and waits for its thread.
#[derive(Debug)]
pub struct Emulator {
    listen: IpAddr,
    started: Started,
    controller: Config,
    watch: Watch,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Emulator {
    /// An emulator in the field dialect on free ports of the loopback.
    pub fn builder() -> Builder {
        let settings = Settings::new(Config::new(Dialect::default()));
        Builder {
            settings: Settings {
                ports: Ports::Auto,
                ..settings
            },
        }
    }

    /// The port each server channel accepted on when it started.
    pub fn ports(&self) -> &BTreeMap<Port, u16> {
        &self.started.ports
    }

    /// The address on which a channel accepts; `None` if it is not a server.
    pub fn address(&self, port: Port) -> Option<SocketAddr> {
        let number = self.started.ports.get(&port);
        number.map(|number| SocketAddr::new(self.listen, *number))
    }

    /// The address of the control interface, if there is one.
    pub fn control(&self) -> Option<SocketAddr> {
        self.started.control
    }

    /// Endpoint of the serial port HOST or COM1. Port 0 has been replaced by the port the system chose.
    pub fn serial(&self, port: Port) -> Option<&SerialEndpoint> {
        self.started.serial.get(&port)
    }

    /// Sends a request and blocks until its reply. This is also possible in a runtime.
    fn request<T: Send + 'static>(
        &self,
        request: impl FnOnce(Box<dyn FnOnce(T) + Send>) -> Request,
    ) -> Result<T, Error> {
        let place = Arc::new(Mutex::new(None));
        // It carries nothing: a channel for each type of answer was a tenth of the code of this crate.
        let (done, is_done) = std::sync::mpsc::channel::<Infallible>();
        let reply = {
            let place = Arc::clone(&place);
            Box::new(move |value| {
                if let Ok(mut place) = place.lock() {
                    *place = Some(value);
                }
                drop(done);
            })
        };
        let sent = self.started.requests.try_send(request(reply));
        sent.map_err(|_| Error::Ended)?;
        // Ends when the other side is gone, with an answer or without.
        let _ = is_done.recv();
        let answer = place.lock().ok().and_then(|mut place| place.take());
        answer.ok_or(Error::Ended)
    }

    fn request_snapshot(&self, task: SnapshotTask) -> Result<(), SnapshotRequestError> {
        self.request(|reply| Request::Snapshot(task, Box::new(move |result, _| reply(result))))
            .map_err(|_| SnapshotRequestError::Busy)?
    }

    /// Keeps the present state in memory under a name.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn take_snapshot(&self, name: &str) -> Result<(), SnapshotRequestError> {
        self.request_snapshot(SnapshotTask::Save(name.to_owned()))
            .map(drop)
    }

    /// Continues from the state of that name, for example between two tests. Connected hosts stay connected; to the
    /// controller they are new, as after a cable was pulled and plugged in again.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn restore_snapshot(&self, name: &str) -> Result<(), SnapshotRequestError> {
        self.request_snapshot(SnapshotTask::Restore(name.to_owned()))
    }

    /// Deletes the snapshot of that name.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn delete_snapshot(&self, name: &str) -> Result<(), SnapshotRequestError> {
        self.request_snapshot(SnapshotTask::Remove(name.to_owned()))
    }

    /// The names of the snapshots in alphabetical order.
    ///
    /// # Errors
    /// [`Error::Ended`].
    pub fn snapshots(&self) -> Result<Vec<String>, Error> {
        let listed = self.view(|view| view.snapshots.list())?;
        Ok(listed.into_iter().map(|(name, _)| name).collect())
    }

    /// Writes the present state into a file.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn write_snapshot(&self, path: &Path) -> Result<(), SnapshotRequestError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        let taker = CopyOfState(Box::new(move |state| {
            // Fails only when nobody waits for the copy.
            let _ = sender.send(state);
        }));
        self.request_snapshot(SnapshotTask::Copy(taker))?;
        let controller = receiver.recv().map_err(|_| SnapshotRequestError::Busy)?;
        Ok(snapshot::write(path, snapshot::States::One(&controller))?)
    }

    /// Continues from the state in a file, as [`Emulator::restore_snapshot`] does.
    ///
    /// # Errors
    /// [`SnapshotRequestError`].
    pub fn load_snapshot(&self, path: &Path) -> Result<(), SnapshotRequestError> {
        let controller = Box::new(snapshot::read(path, None)?);
        self.request_snapshot(SnapshotTask::Replace(controller))
    }

    /// The findings so far: which rules hosts broke, how often, and the first occurrences.
    pub fn findings(&self) -> Findings {
        self.started.evidence.findings()
    }

    /// Which cells of the permission tables the hosts have reached so far.
    pub fn coverage(&self) -> CoverageReport {
        self.started.evidence.coverage(&self.controller)
    }

    /// The record of findings, coverage and executed lines, for reports or to be cleared between tests.
    pub fn evidence(&self) -> &RunRecord {
        &self.started.evidence
    }

    /// The [events](Event) since the last look, in order. Other [outputs](Emulator::outputs) since then are dropped.
    pub fn events(&self) -> Vec<Event> {
        let outputs = self.outputs().into_iter();
        let event = |output| {
            let Output::Event(event) = output else {
                return None;
            };
            Some(event)
        };
        outputs.filter_map(event).collect()
    }

    /// Outputs of the controller since the last call, in order: texts sent, [events](Event), files stored. The oldest
    /// are forgotten when more than [`MAX_OUTPUTS`](crate::watch::MAX_OUTPUTS) wait.
    pub fn outputs(&self) -> Vec<Output> {
        self.watch.take()
    }

    /// Waits until the controller has put out something of which `found` makes a value: an alarm, a file stored, a text
    /// sent. Every output since the start is looked at once, in order; an output is there when it has been carried out.
    /// Of many unread ones the oldest are dropped ([`MAX_OUTPUTS`](crate::watch::MAX_OUTPUTS)).
    ///
    /// # Errors
    /// [`WaitError`]: not within `limit`, or the emulator has ended.
    pub fn wait_for<T>(
        &self,
        limit: Duration,
        found: impl FnMut(&Output) -> Option<T>,
    ) -> Result<T, WaitError> {
        self.watch.wait_for(limit, found)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // An error is a panic of the thread, which has been printed to stderr.
            let _ = thread.join();
        }
    }
}
