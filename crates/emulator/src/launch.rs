//! Starts an emulator as configured: a driver, and whoever listens to it (log, transcripts, reports, scenario, control
//! interface). The command line and the embedding API start here; the loop is [`ts3100_driver::driver`].

use crate::config::Settings;
use crate::loading::{self, StartError};
use crate::log::EventLog;
use crate::ready::OPEN_WARNING;
use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::sync::mpsc;
use tracing::warn;
use ts3100_control::journal::{Journal, JournalWriter};
use ts3100_controller::Controller;
use ts3100_driver::driver::request::Request;
use ts3100_driver::driver::{Driver, Setup};
use ts3100_recording::faults;
use ts3100_recording::reports::RunRecord;
use ts3100_recording::scenario::Play;
use ts3100_recording::transcript::{Header, TranscriptBuffer, TranscriptSink, calendar_if_set};

/// An emulator whose ports are open.
pub struct Launched {
    /// The driver, not running yet.
    pub driver: Driver,
    /// Requests to the driver.
    pub requests: mpsc::Sender<Request>,
    /// Findings, coverage and executed lines of this run; clones share the data.
    pub run_record: RunRecord,
    /// The example programs were stored on the RAM drive.
    pub has_examples: bool,
    /// The last records, for the control interface.
    transcript: Arc<TranscriptBuffer>,
}

impl Launched {
    /// Powers the controller on and opens its ports; to be called in a runtime.
    ///
    /// # Errors
    /// See [`StartError`]; no port stays open.
    pub fn open(settings: &Settings) -> Result<Launched, StartError> {
        let powered = loading::power_on(settings)?;
        let header = Header {
            origin: format!("observed, ts3100 serve {}", env!("CARGO_PKG_VERSION")),
            calendar: calendar_if_set(settings.controller.calendar),
            flags: settings.flags.clone(),
            files: powered.files.clone(),
            select: settings.select.clone(),
        };
        let restored = powered.restored.then_some(&powered.controller);
        let buffered = settings.control.is_some();
        let transcript = TranscriptSink::create(header, &settings.transcripts, buffered, restored)?;
        let buffer = transcript.buffer();
        let run_record = RunRecord::new(&powered.controller, settings.record_lines);
        let (driver, requests) = Driver::open(Setup {
            controller: powered.controller,
            backing: powered.backing,
            listen: settings.listen,
            ports: settings.ports,
            links: settings.links,
            serial: settings.serial.clone(),
            time: settings.time,
            time_gap: settings.time_gap,
            faults: settings.faults.clone(),
            servo_on: settings.servo_on,
            subscribers: vec![
                Box::new(transcript),
                Box::new(run_record.clone()),
                Box::new(EventLog::default()),
            ],
        })?;
        Ok(Launched {
            driver,
            requests,
            run_record,
            has_examples: powered.has_examples,
            transcript: buffer,
        })
    }

    /// Opens the control interface if the settings configure one, and returns its address. Requests are answered while
    /// the driver runs.
    ///
    /// # Errors
    /// [`StartError::Control`].
    pub fn open_control(&mut self, settings: &Settings) -> Result<Option<SocketAddr>, StartError> {
        let Some(control) = &settings.control else {
            return Ok(None);
        };
        let server = ts3100_control::Server::bind(control).map_err(|reason| StartError::Control {
            address: control.address,
            reason,
        })?;
        if control.accepts_everybody() {
            warn!(event = "control-open", "{OPEN_WARNING}");
        }
        let address = server.address();
        let journal = Arc::new(Journal::with_transcript(Arc::clone(&self.transcript)));
        let writer = JournalWriter(Arc::clone(&journal));
        self.driver.cell().subscribe(Box::new(writer));
        server.serve(self.requests.clone(), journal);
        Ok(Some(address))
    }

    /// Starts the scenario of the settings, if there is one.
    pub fn start_scenario(&mut self, settings: &Settings) -> Option<Play> {
        let play = Play::new(settings.scenario.clone()?);
        play.start(self.driver.cell());
        Some(play)
    }

    /// Runs until `stop` completes, logs the outcome of every fault, and returns the final controller.
    pub async fn run(self, stop: impl Future<Output = ()>) -> Controller {
        let controller = self.driver.run(stop).await;
        faults::log_summary(controller.faults());
        controller
    }
}
