//! Everything behind the ports as one value: the parts a command, a program or a button acts on, and what several of
//! them do together. How bytes become commands is `endpoint`'s; each part has a file of its own.

use crate::alarm::Alarms;
use crate::arm::Arm;
use crate::drive::{Drive, DriveError};
use crate::executor::Executor;
use crate::findings::{Finding, MAX_BYTES, Message, Rule};
use crate::io::channels::Channels;
use crate::io::signals::Signals;
use crate::maintenance::MaintenanceCounters;
use crate::options::Config;
use crate::output::{Event, Output};
use crate::outputs::Outputs;
use crate::panel::{KeySwitch, Panel};
use crate::parameters::Parameters;
use crate::persistence::Persistence;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::calendar::CalendarTime;
use ts3100_proto::name::FileName;

/// What the hosts are to be told of the program, in the order in which it happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunNotice {
    /// It runs (again): an SP that waits is about the past.
    Started,
    /// It stands, and no host has asked for it.
    Stopped,
}

/// The robot behind the ports.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Robot {
    pub(crate) config: Config,
    pub(crate) now: Time,
    pub(crate) panel: Panel,
    pub(crate) drive: Drive,
    pub(crate) alarms: Alarms,
    pub(crate) signals: Signals,
    pub(crate) channels: Channels,
    pub(crate) executor: Executor,
    pub(crate) arm: Arm,
    pub(crate) parameters: Parameters,
    pub(crate) maintenance: MaintenanceCounters,
    pub(crate) persistence: Persistence,
    /// Taken by `Endpoints::settle`; empty between two inputs.
    pub(crate) notices: Vec<RunNotice>,
    pub(crate) outputs: Outputs,
}

impl Robot {
    /// A robot whose power has just come on, with these files on its RAM drive. Parameter files that are missing are
    /// made.
    ///
    /// # Errors
    /// A file that the RAM drive does not take.
    pub(crate) fn new(config: Config, files: Vec<(String, Vec<u8>)>) -> Result<Box<Robot>, DriveError> {
        let mut drive = Drive::new(config.options.drive_capacity);
        for (name, content) in files {
            drive.store(&FileName::parse(&name)?, &content)?;
        }
        let key = if config.key == KeySwitch::Internal && !config.controller.has_internal() {
            KeySwitch::Ext
        } else {
            config.key
        };
        let mut robot = Box::new(Robot {
            now: Time::ZERO,
            panel: Panel::new(Time::ZERO, key, config.control_right),
            drive,
            alarms: Alarms::default(),
            signals: Signals::default(),
            channels: Channels::default(),
            executor: Executor::new(&config.language(), Time::ZERO),
            arm: Arm::new(config.model.clone()),
            parameters: Parameters::factory(config.options.open_mode),
            maintenance: MaintenanceCounters::default(),
            persistence: Persistence::default(),
            notices: Vec::new(),
            outputs: Outputs::default(),
            config,
        });
        // Before the missing ones are made: what they say counts already.
        robot.take_parameters();
        robot.make_parameter_files()?;
        robot.show_state();
        robot.update_maintenance();
        Ok(robot)
    }

    /// Lines of the selected file that are executed and analysed (SF-24).
    pub(crate) fn steps(&self) -> (u32, u32) {
        let (executed, _) = self.executor.executed(self.arm.is_moving());
        let (analysed, _) = self.executor.analysed();
        (executed, analysed)
    }

    /// Bytes of a port go no further.
    pub(crate) fn dropped(&mut self, port: Port, bytes: usize, reason: &'static str) {
        self.outputs.event(Event::Dropped { port, bytes, reason });
    }

    /// A rule was broken.
    pub(crate) fn report(
        &mut self,
        rule: &'static Rule,
        port: impl Into<Option<Port>>,
        bytes: &[u8],
        message: impl Into<Message>,
    ) {
        let bytes = Bytes::copy_from_slice(bytes.get(..MAX_BYTES).unwrap_or(bytes));
        self.report_shared(rule, port.into(), bytes, message.into());
    }

    /// A rule was broken by these bytes, which others keep too.
    pub(crate) fn report_shared(
        &mut self,
        rule: &'static Rule,
        port: Option<Port>,
        mut bytes: Bytes,
        message: Message,
    ) {
        bytes.truncate(MAX_BYTES);
        self.outputs.event(Event::Finding(Finding {
            rule,
            port,
            at: self.now,
            bytes,
            message,
        }));
    }

    /// Date and time now, for the error history.
    pub(crate) fn calendar(&self) -> CalendarTime {
        let seconds = self.now.as_micros() / 1_000_000;
        self.config.calendar.plus_seconds(seconds)
    }

    /// A file is about to be stored, or with no content erased.
    ///
    /// # Errors
    /// [`DriveError::NotPersisted`]: see [`Persistence::ask`].
    pub(crate) fn persist(&mut self, name: &str, content: Option<&Bytes>) -> Result<(), DriveError> {
        let name = name.to_string();
        let answer = self.persistence.ask();
        if self.persistence.is_pending() {
            self.outputs.push(Output::Persist {
                name: name.clone(),
                content: content.cloned(),
            });
        }
        answer.map_err(|reason| DriveError::NotPersisted { name, reason })
    }

    /// Stores a file; it is kept outside too if files are.
    ///
    /// # Errors
    /// [`DriveError`]; the drive is then unchanged.
    pub(crate) fn store(&mut self, name: &FileName, content: &Bytes) -> Result<(), DriveError> {
        self.drive.check(name, content)?;
        self.persist(name.as_str(), Some(content))?;
        self.drive.store_checked(name, content.clone());
        self.outputs.push(Output::Stored {
            name: name.as_str().to_string(),
            content: content.clone(),
        });
        self.executor.mark_stale(name.as_str(), self.now);
        Ok(())
    }

    /// Stores a file without asking whether it is kept outside.
    ///
    /// # Errors
    /// [`DriveError`]; the drive is then unchanged.
    pub(crate) fn store_inside(&mut self, name: &FileName, content: &Bytes) -> Result<(), DriveError> {
        let persistence = core::mem::take(&mut self.persistence);
        let stored = self.store(name, content);
        self.persistence = persistence;
        stored
    }
}
