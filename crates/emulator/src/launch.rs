//! Starts an emulator as configured: a driver and its listeners (log, transcripts, reports, scenario, control
//! interface). The command line and the embedding API start here; the loop is [`ts3100_driver::driver`].

use crate::config::Settings;
use crate::loading::{self, StartError};
use crate::log::EventLog;
use crate::ready::OPEN_WARNING;
use std::net::SocketAddr;
use std::sync::Arc;
use tracing::{Span, warn};
use ts3100_control::journal::{Journal, JournalWriter, KEPT_EVENTS};
use ts3100_control::robots::{CannotStart, RobotInfo, Robots};
use ts3100_control::{ControlSettings, DriverHandle};
use ts3100_controller::Port;
use ts3100_driver::driver::request::Requests;
use ts3100_driver::driver::self_check::connectable;
use ts3100_driver::driver::{Driver, Setup};
use ts3100_driver::tcp::SharedPorts;
use ts3100_recording::reports::RunRecord;
use ts3100_recording::scenario::Play;
use ts3100_recording::transcript::{Header, MAX_BUFFERED_RECORDS, TranscriptSink, calendar_if_set};

/// The name of a robot that is alone in its process.
pub const ONLY: &str = "robot-1";
/// Most robots of which as much is kept as of one alone.
const UNDIVIDED: usize = 16;
/// Fewest events and records that are kept of a robot.
const MIN_KEPT: usize = 64;

/// A robot whose ports are open; its driver does not run yet.
pub struct Launched {
    /// Its number in the driver.
    pub number: usize,
    /// Requests to the driver, for this robot.
    pub requests: Requests,
    /// Findings, coverage and executed lines of this run; clones share the data.
    pub run_record: RunRecord,
    /// The example programs were stored on the RAM drive.
    pub has_examples: bool,
    /// Journal for the control interface.
    journal: Option<Arc<Journal>>,
    /// The scenario of the settings.
    play: Option<Play>,
}

/// Resources that a robot shares with the others of its process.
#[derive(Clone)]
pub struct Surroundings {
    /// Listening sockets.
    pub shared: Option<SharedPorts>,
    /// Robots of the process: what is kept in memory for the control interface is divided among many.
    pub robots: usize,
}

impl Surroundings {
    /// Surroundings of a robot that is alone.
    pub const NONE: Surroundings = Surroundings {
        shared: None,
        robots: 1,
    };

    /// Number of entries kept of one robot, of `most`.
    fn share(&self, most: usize) -> usize {
        (most * UNDIVIDED / self.robots.max(UNDIVIDED)).max(MIN_KEPT)
    }
}

impl Launched {
    /// Powers the controller of a robot on that is alone, and opens its ports; to be called in a runtime.
    ///
    /// # Errors
    /// See [`StartError`]; no port stays open.
    pub fn alone(settings: &Settings) -> Result<(Box<Driver>, Launched), StartError> {
        let (mut driver, requests) = Driver::new(settings.time, settings.time_gap);
        let launched = Launched::add(
            &mut driver,
            &requests,
            settings,
            &Surroundings::NONE,
            Span::none(),
        )?;
        Ok((driver, launched))
    }

    /// Powers a controller on and opens its ports, as a further robot of a driver; to be called in a runtime. The span
    /// names it in the lines of the log.
    ///
    /// # Errors
    /// See [`StartError`].
    pub fn add(
        driver: &mut Driver,
        requests: &Requests,
        settings: &Settings,
        surroundings: &Surroundings,
        span: Span,
    ) -> Result<Launched, StartError> {
        let powered = loading::power_on(settings)?;
        let header = Header {
            origin: format!("observed, ts3100 serve {}", env!("CARGO_PKG_VERSION")),
            calendar: calendar_if_set(settings.controller.calendar),
            flags: settings.flags.clone(),
            files: powered.files.clone(),
            select: settings.files.select.clone(),
        };
        let restored = powered.restored.then_some(&powered.controller);
        let buffered = settings
            .control
            .as_ref()
            .map(|_| surroundings.share(MAX_BUFFERED_RECORDS));
        let transcript = TranscriptSink::create(header, &settings.reports.transcript, buffered, restored)?;
        let journal = settings.control.as_ref().map(|_| {
            let kept = surroundings.share(KEPT_EVENTS);
            Arc::new(Journal::new(kept, transcript.buffer()))
        });
        let run_record = RunRecord::new(&powered.controller, settings.record_lines);
        let number = driver.add(Setup {
            controller: powered.controller,
            backing: powered.backing,
            listen: settings.listen,
            ports: settings.ports,
            shared: surroundings.shared.clone(),
            links: settings.links,
            serial: settings.serial.clone(),
            faults: settings.faults.clone(),
            servo_on: settings.servo_on,
            subscribers: vec![
                Box::new(transcript),
                Box::new(run_record.clone()),
                Box::new(EventLog::default()),
            ],
            span,
        })?;
        if let Some(journal) = &journal {
            driver
                .seat(number)
                .subscribe(Box::new(JournalWriter::new(Arc::clone(journal))));
        }
        Ok(Launched {
            number,
            requests: requests.of(number),
            run_record,
            has_examples: powered.has_examples,
            journal,
            play: settings.scenario.clone().map(Play::new),
        })
    }

    /// The journal of the run for the control interface, if the settings configure one.
    pub fn journal(&self) -> Option<&Journal> {
        self.journal.as_deref()
    }

    /// The way to this robot for the control interface, if the settings configure one.
    pub fn handle(&self) -> Option<DriverHandle> {
        let journal = Arc::clone(self.journal.as_ref()?);
        let record = self.run_record.clone();
        let (requests, play) = (self.requests.clone(), self.play.clone());
        Some(DriverHandle::new(requests, journal, record, play))
    }

    /// Opens the control interface if the settings configure one, and returns its address. Requests are answered while
    /// the driver runs.
    ///
    /// # Errors
    /// [`StartError::Control`].
    pub fn open_control(
        &self,
        driver: &Driver,
        settings: &Settings,
    ) -> Result<Option<SocketAddr>, StartError> {
        let (Some(control), Some(handle)) = (&settings.control, self.handle()) else {
            return Ok(None);
        };
        let server = bind_control(control)?;
        let address = server.address();
        let info = self.info(driver, ONLY.to_owned(), settings);
        server.serve(Arc::new(OnlyRobot { info, handle }));
        Ok(Some(address))
    }

    /// The robot by this name, and the addresses of these settings.
    pub fn info(&self, driver: &Driver, name: String, settings: &Settings) -> RobotInfo {
        let word = |port: &Port| port.name().to_ascii_lowercase();
        let address = |number: &u16| SocketAddr::new(connectable(settings.listen), *number);
        let ports = driver.ports(self.number).iter();
        let serial = driver.serial_endpoints(self.number).into_iter();
        RobotInfo {
            name,
            ports: ports
                .map(|(port, number)| (word(port), address(number)))
                .collect(),
            serial: serial
                .map(|(port, place)| (word(&port), place.to_string()))
                .collect(),
            started: true,
        }
    }

    /// Starts the scenario of the settings, if there is one.
    pub fn start_scenario(&self, driver: &mut Driver) -> Option<Play> {
        let play = self.play.clone()?;
        play.start(driver.seat(self.number));
        Some(play)
    }
}

/// Binds the socket of the control interface.
///
/// # Errors
/// [`StartError::Control`].
pub fn bind_control(control: &ControlSettings) -> Result<ts3100_control::Server, StartError> {
    let server = ts3100_control::Server::bind(control).map_err(|reason| StartError::Control {
        address: control.address,
        reason,
    })?;
    if control.accepts_everybody() {
        warn!(event = "control-open", "{OPEN_WARNING}");
    }
    Ok(server)
}

/// The robot of a process that has no other.
struct OnlyRobot {
    info: RobotInfo,
    handle: DriverHandle,
}

impl Robots for OnlyRobot {
    fn names(&self) -> Vec<String> {
        vec![self.info.name.clone()]
    }

    fn only(&self) -> Option<&str> {
        Some(&self.info.name)
    }

    fn info(&self, name: &str) -> Option<RobotInfo> {
        (name == self.info.name).then(|| self.info.clone())
    }

    fn start(&self, name: &str) -> Option<Result<DriverHandle, CannotStart>> {
        self.running(name).map(Ok)
    }

    fn running(&self, name: &str) -> Option<DriverHandle> {
        (name == self.info.name).then(|| self.handle.clone())
    }
}
