//! Everything around the controller that a driver owns: carries out the outputs, at sockets, serial lines and the backing
//! directory. Which inputs come when is decided by `run_loop`.

use super::request::PendingWait;
use crate::cell::Effects;
use crate::clock::{CATCH_UP_SLICE, Clock};
use crate::serial::SerialLines;
use crate::store::StoreError;
use crate::store::backing::Backing;
use crate::tcp::{ChannelError, Channels};
use std::collections::BTreeMap;
use std::time::Instant;
use tracing::{error, info, warn};
use ts3100_controller::{Controller, Event, Input, Output, PersistError, Port, Time};

/// Clock, connections and directory of a driver.
pub(super) struct Edge {
    pub clock: Clock,
    pub channels: Channels,
    pub serial_lines: SerialLines,
    pub backing: Option<Backing>,
    /// TCP port of each server channel.
    pub ports: BTreeMap<Port, u16>,
    pub waits: Vec<PendingWait>,
    /// Wall-clock time at which the present input came.
    pub begun: Instant,
}

impl Edge {
    /// Opens the channels of the controller's network parameters.
    pub fn open_channels(&mut self, controller: &Controller) -> Result<(), ChannelError> {
        self.ports.clear();
        self.ports = self.channels.open(controller.network())?;
        Ok(())
    }

    /// Closes every channel; returns the resulting inputs.
    pub fn close_channels(&mut self) -> Vec<Input> {
        self.ports.clear();
        let gone = self.channels.close().into_iter();
        gone.map(|port| Input::Disconnected { port }).collect()
    }

    /// Replaces the files of the backing directory by those of `next`.
    ///
    /// # Errors
    /// Why some of the files were not saved.
    pub fn replace_files(&mut self, current: &Controller, next: &Controller) -> Result<(), StoreError> {
        match &mut self.backing {
            Some(backing) => backing.replace_files(current.files(), next),
            None => Ok(()),
        }
    }

    /// Saves the error history to the backing directory.
    pub fn save_history(&mut self, controller: &Controller) {
        if let Some(backing) = &mut self.backing {
            backing.save_history(controller);
        }
    }
}

impl Effects for Edge {
    fn persist(&mut self, at: Time, name: &str, content: Option<&[u8]>) -> Result<(), PersistError> {
        match &mut self.backing {
            Some(backing) => {
                let kept = backing.persist(at, name, content);
                kept.map_err(|reason| PersistError::Refused(reason.to_string()))
            }
            None => Ok(()),
        }
    }

    fn perform(&mut self, _at: Time, output: Output, controller: &Controller) -> Vec<Input> {
        for pending in &mut self.waits {
            pending.wait.observe(&output);
        }
        match output {
            Output::Send { port, bytes } => {
                self.clock.note_activity();
                if !self.serial_lines.has(port) {
                    return self.channels.send(port, bytes);
                }
                self.serial_lines.send(port, bytes.into());
            }
            Output::Stored { .. } | Output::Erased { .. } => {
                if let Some(backing) = &mut self.backing {
                    backing.retry_unsaved(controller);
                }
            }
            Output::PowerOff => {
                info!("power off; no port is open");
                return self.close_channels();
            }
            Output::PowerCycled => {
                let mut inputs = self.serial_lines.power_cycled(controller);
                inputs.extend(self.close_channels());
                match self.open_channels(controller) {
                    Ok(()) => info!("power cycled; ports: {:?}", self.ports),
                    Err(reason) => error!("after the power cycle no port is open: {reason}"),
                }
                return inputs;
            }
            Output::Disconnect { port, how } => return self.channels.disconnect(port, how),
            Output::Stall { port } => self.channels.stall(port),
            // Before an answer that reports the alarm is sent.
            Output::Event(Event::Alarm { .. }) => self.save_history(controller),
            Output::Event(_) | Output::Pendant(_) | Output::Persist { .. } => {}
        }
        Vec::new()
    }

    fn is_late(&mut self, reached: Time) -> bool {
        if self.begun.elapsed() <= CATCH_UP_SLICE {
            return false;
        }
        if self.clock.note_lag(reached) {
            let mode = self.clock.mode();
            warn!("this machine cannot keep up with --time {mode}: virtual time lags (`behind` of /clock)");
        }
        true
    }
}
