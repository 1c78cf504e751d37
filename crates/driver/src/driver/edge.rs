//! The edge of a robot: carries out the outputs of its controller, at sockets, serial lines and the backing directory. Which inputs come when is decided by `run_loop`.

use super::request::PendingWait;
use crate::clock::CATCH_UP_SLICE;
use crate::seat::Effects;
use crate::serial::SerialLines;
use crate::snapshot::SnapshotStore;
use crate::store::StoreError;
use crate::store::backing::Backing;
use crate::tcp::Channels;
use std::time::{Duration, Instant};
use tokio::task::{JoinError, JoinHandle, spawn_blocking};
use tracing::{error, info};
use ts3100_controller::faults::Fault;
use ts3100_controller::{Bytes, Controller, Event, Input, Output, PersistError, Port, Time};

/// Result of a write, with that of its task.
pub(super) type WriteResult = Result<Result<(), StoreError>, JoinError>;

/// A write to the backing directory that is under way.
pub(super) struct Write {
    pub task: JoinHandle<Result<(), StoreError>>,
    at: Time,
    /// The file; `None` for the error history.
    file: Option<String>,
}

/// State to which a robot returns with a reset.
pub(super) struct Start {
    /// The controller before the first input.
    pub controller: Controller,
    /// Faults that are armed.
    pub faults: Vec<Fault>,
    pub servo_on: bool,
}

/// Connections and directory of a robot, and its further state outside the controller.
pub(super) struct Edge {
    pub channels: Channels,
    pub serial_lines: SerialLines,
    pub backing: Option<Backing>,
    pub waits: Vec<PendingWait>,
    /// Wall-clock time at which the present input came.
    pub begun: Instant,
    /// The write under way; no input is handled before it has ended.
    pub write: Option<Write>,
    /// Something was sent to a host.
    pub has_sent: bool,
    pub snapshots: SnapshotStore,
    pub start: Start,
    /// Lag and skipped time of the clock when the time of this robot began.
    pub lost_before: (Duration, Duration),
}

impl Edge {
    /// Begins to save the error history to the backing directory.
    pub fn save_history(&mut self, controller: &Controller) {
        if let Some(backing) = &self.backing {
            self.write = Some(Write {
                task: spawn_blocking(backing.history(controller)),
                at: controller.now(),
                file: None,
            });
        }
    }

    /// A write has ended: the answer for the controller.
    pub fn finish_write(&mut self, ended: WriteResult) -> Result<(), PersistError> {
        let written = ended.unwrap_or_else(|reason| Err(StoreError::Unfinished(reason)));
        // The task is gone before the controller continues, so that the next output can begin another write.
        let (Some(write), Some(backing)) = (self.write.take(), &mut self.backing) else {
            return Ok(());
        };
        let Some(file) = &write.file else {
            backing.finish_history(write.at, written);
            return Ok(());
        };
        let kept = backing.finish(write.at, file, written);
        kept.map_err(|reason| PersistError::Refused(reason.to_string()))
    }

    /// Answers the waits that have ended and drops those whose caller is gone.
    fn end_waits(&mut self, controller: &Controller) {
        let now = controller.now();
        let ended = self.waits.extract_if(.., |pending| {
            now >= pending.limit || pending.done.is_closed() || pending.is_reached(controller)
        });
        for pending in ended {
            let (reached, passed) = (pending.is_reached(controller), now.since(pending.since));
            pending.end(reached, now, passed);
        }
    }

    /// Whether wall-clock time is irrelevant: no peer is connected and no wait is pending.
    pub fn is_idle(&self, controller: &Controller) -> bool {
        let has_peer = |port: &Port| controller.peer(*port).is_some();
        self.waits.is_empty() && controller.host_is_silent() && !Port::ALL.iter().any(has_peer)
    }
}

impl Effects for Edge {
    fn input(&mut self, at: Time, input: &Input, controller: &Controller) {
        for pending in &mut self.waits {
            pending.judge(at, controller);
            pending.wait.observe_input(input);
        }
    }

    fn persist(&mut self, at: Time, name: &str, content: Option<Bytes>) -> Option<Result<(), PersistError>> {
        let Some(backing) = &self.backing else {
            return Some(Ok(()));
        };
        self.write = Some(Write {
            task: spawn_blocking(backing.change(name.to_owned(), content)),
            at,
            file: Some(name.to_owned()),
        });
        None
    }

    fn is_storing(&self) -> bool {
        self.write.is_some()
    }

    fn settled(&mut self, controller: &Controller) -> Option<bool> {
        self.end_waits(controller);
        let mut waits = self.waits.iter();
        Some(waits.any(|pending| pending.wait.wants_statements()))
    }

    fn perform(&mut self, _at: Time, output: Output, controller: &Controller) -> Vec<Input> {
        for pending in &mut self.waits {
            pending.wait.observe_output(&output);
        }
        match output {
            Output::Send { port, bytes } => {
                self.has_sent = true;
                if let Some(channel) = self.channels.get_mut(port) {
                    return channel.send(bytes);
                }
                self.serial_lines.send(port, &bytes);
            }
            Output::Stored { .. } | Output::Erased { .. } => {
                // If this change was saved, the others may be now too. These writes block the loop.
                if let Some(backing) = &mut self.backing {
                    backing.retry_unsaved(controller);
                }
            }
            Output::PowerOff => {
                info!("power off; the ports are closed");
                return self.channels.close();
            }
            Output::PowerCycled => {
                // ETHERNET.PAR takes effect now, so the sockets close and open. Serial lines stay, with the settings of
                // [U06].
                let mut inputs = self.serial_lines.power_cycled(controller);
                inputs.extend(self.channels.close());
                match self.channels.open(controller.network()) {
                    Ok(_) => info!("power back on: {}", self.channels.listing()),
                    Err(reason) => error!("cannot open the ports after the power cycle: {reason}"),
                }
                return inputs;
            }
            Output::Disconnect { port, how } => {
                let channel = self.channels.get_mut(port);
                return channel.map_or_else(Vec::new, |channel| channel.disconnect(how));
            }
            Output::Stall { port } => {
                if let Some(channel) = self.channels.get_mut(port) {
                    channel.stall();
                }
            }
            // Before an answer that reports the alarm is sent.
            Output::Event(Event::Alarm { .. }) => self.save_history(controller),
            Output::Event(_) | Output::Pendant(_) | Output::Persist { .. } => {}
        }
        Vec::new()
    }

    fn is_late(&mut self, _reached: Time) -> bool {
        self.begun.elapsed() > CATCH_UP_SLICE
    }
}
