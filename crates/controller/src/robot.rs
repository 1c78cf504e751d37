//! The robot as one value: the parts a command, a program or a button acts on, and what several of
//! them do together. How bytes become commands is `endpoint`'s; each part has a file of its own.

mod checks;
mod direct;
mod looking;
mod requests;
mod run_control;
pub(crate) mod scheduler;
mod selection;
mod system_signals;
mod watching;

use crate::alarm::Alarms;
use crate::arm::Arm;
use crate::context::Context;
use crate::drive::{Drive, DriveError, PersistError};
use crate::executor::Executor;
use crate::faults::effects::MachineState;
use crate::finding::Rule;
use crate::io::channels::Channels;
use crate::io::signals::Signals;
use crate::maintenance::MaintenanceCounters;
use crate::options::Config;
use crate::output::Output;
use crate::panel::{KeySwitch, Panel};
use crate::parameters::Parameters;
use crate::persistence::{Change, Persistence, Then, Waiting};
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::name::FileName;

/// News of the program for the hosts, in the order in which it happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunNotice {
    /// It runs (again): an SP that waits is about the past.
    Started,
    /// A stop that no host has asked for.
    Stopped,
}

/// The parts of the robot. The ports are not among them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Robot {
    pub(crate) context: Context,
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
    /// Taken by `Controller::take_notices`; empty between two inputs.
    pub(crate) notices: Vec<RunNotice>,
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
            drive.store(&FileName::parse(&name)?, content)?;
        }
        let key = if config.key == KeySwitch::Internal && !config.controller.has_internal() {
            KeySwitch::Ext
        } else {
            config.key
        };
        let mut robot = Box::new(Robot {
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
            context: Context::new(config),
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

    /// The state that a fault on the machine changes, as it is now.
    pub(crate) fn machine_state(&self) -> MachineState {
        let state = self.panel.state();
        MachineState {
            powered: state.powered,
            servo: state.servo,
            key: state.key,
            alarms: self.alarms.active().len(),
            program: self.executor.program_runs(),
        }
    }

    /// An alarm follows a finding of this rule: it is the fault's, too, if the finding is.
    pub(crate) fn blame_alarm(&mut self, rule: &'static Rule, port: Option<Port>) {
        if let Some(cause) = self.context.fault_effects.cause_of(rule, port) {
            let state = self.machine_state();
            self.context
                .fault_effects
                .alarm_follows(self.context.now, cause, state);
        }
    }

    /// Stores a file at power-on, or a file that is stored outside already.
    ///
    /// # Errors
    /// [`DriveError`]; the drive is then unchanged.
    pub(crate) fn store_inside(&mut self, name: &FileName, content: &Bytes) -> Result<(), DriveError> {
        let staged = self.drive.stage(name, content.clone())?;
        self.commit(staged.into(), Ok(()))
    }

    /// Has a change stored outside, which the answer makes; or gives it back to be made at once.
    #[must_use]
    pub(crate) fn propose(&mut self, change: Change, then: Then) -> Option<Waiting> {
        let waiting = Waiting { change, then };
        if !self.persistence.is_outside() {
            return Some(waiting);
        }
        let staged = &waiting.change.staged;
        self.context.outputs.push(Output::Persist {
            name: staged.name().to_string(),
            content: staged.content().cloned(),
        });
        self.persistence.wait(waiting);
        None
    }

    /// Makes a change that was stored, or drops it.
    ///
    /// # Errors
    /// [`DriveError::NotPersisted`]; nothing has changed then.
    pub(crate) fn commit(
        &mut self,
        change: Change,
        stored: Result<(), PersistError>,
    ) -> Result<(), DriveError> {
        let Change {
            staged,
            program,
            variable,
        } = change;
        let name = staged.name().to_string();
        if let Err(reason) = stored {
            return Err(DriveError::NotPersisted { name, reason });
        }
        let content = staged.content().cloned();
        self.drive.commit(staged);
        match (program, &content) {
            (Some(program), Some(content)) => {
                let source = String::from_utf8_lossy(content).into_owned();
                self.executor.take_rewritten(source, program);
            }
            (None, Some(_)) => self.executor.mark_stale(&name, self.context.now),
            (_, None) => {}
        }
        self.context.outputs.push(match content {
            Some(content) => Output::Stored { name, content },
            None => Output::Erased { name },
        });
        if let Some((variable, value)) = variable {
            let set = self.executor.set_global(&variable, value);
            debug_assert!(
                set.is_ok(),
                "{}: written into the file, and {set:?}",
                variable.name
            );
        }
        Ok(())
    }
}
