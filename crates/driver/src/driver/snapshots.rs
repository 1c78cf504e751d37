//! Snapshot requests, and replacing the running controller by another state: clock, channels, backing directory and pending
//! waits follow. The format and the named snapshots are in [`crate::snapshot`].

use super::Driver;
use crate::cell::Notice;
use crate::snapshot::{SnapshotRequestError, SnapshotTask};
use crate::store::StoreError;
use std::time::Duration;
use tracing::info;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::port::Port;
use ts3100_controller::{Controller, Input};

impl Driver {
    /// Carries out what is asked for about snapshots.
    pub(super) async fn act_on_snapshots(&mut self, task: SnapshotTask) -> Result<(), SnapshotRequestError> {
        match task {
            SnapshotTask::Save(name) => {
                let controller = self.cell.controller.clone();
                Ok(self.snapshot_store.insert(&name, controller)?)
            }
            SnapshotTask::Restore(name) => {
                let controller = self.snapshot_store.get(&name)?.clone();
                self.replace_controller(controller).await
            }
            SnapshotTask::Replace(controller) => self.replace_controller(*controller).await,
            SnapshotTask::Remove(name) => Ok(self.snapshot_store.remove(&name)?),
        }
    }

    /// Continues with `next`: its time becomes the current time, its files replace those of the backing
    /// directory, and connected peers stay and are new to it. Ports are reopened only if its network parameters
    /// or its power state differ.
    async fn replace_controller(&mut self, mut next: Controller) -> Result<(), SnapshotRequestError> {
        self.edge.clock.note_activity();
        self.reset_stalled_peers();
        self.finish_writes().await;
        self.cell.notify(self.edge.clock.now(), Notice::Restored(&next));
        next.adopt_peers(&self.cell.controller);
        next.persist_outside(self.edge.backing.is_some());
        let ports = |controller: &Controller| (*controller.network(), controller.state().powered);
        let same_ports = ports(&next) == ports(&self.cell.controller);
        let was_powered = self.cell.controller.state().powered;
        let lines = |controller: &Controller| Port::SERIAL.map(|port| controller.serial_line(port));
        let same_lines = lines(&next) == lines(&self.cell.controller);
        let files_result = self.take_over(next).await;
        if !same_lines {
            self.edge.serial_lines.set_robot(&self.cell.controller);
        }
        let mut opened = Ok(());
        if !same_ports {
            let mut inputs = self.edge.channels.close();
            if self.cell.controller.state().powered {
                let reopened = self.edge.channels.open(self.cell.controller.network());
                opened = reopened
                    .map(drop)
                    .map_err(|error| SnapshotRequestError::Channels(error.to_string()));
                if !was_powered {
                    // A controller without power knows nobody: there were no peers to adopt.
                    inputs.extend(self.edge.serial_lines.power_cycled(&self.cell.controller));
                }
            }
            inputs.into_iter().for_each(|input| self.feed(input));
        }
        info!(event = "restored", t = %self.edge.clock.now(), "snapshot restored");
        // Send what the change of peers has caused.
        self.feed(Input::Tick);
        opened.and(files_result.map_err(|reason| SnapshotRequestError::Drive(reason.to_string())))
    }

    /// `next` takes over with its time and its files. Pending waits end unreached before anything is fed: they refer to
    /// the time of another controller.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the files.
    pub(super) async fn take_over(&mut self, next: Controller) -> Result<(), StoreError> {
        let backing = self.edge.backing.as_mut();
        let files = self.cell.controller.files();
        let stored = backing.map_or(Ok(()), |backing| backing.replace_files(files, &next));
        self.edge.clock.set(next.now());
        for pending in std::mem::take(&mut self.edge.waits) {
            pending.end(false, next.now(), Duration::ZERO);
        }
        self.cell.controller = next;
        self.edge.save_history(&self.cell.controller);
        self.finish_writes().await;
        stored
    }

    /// Resets connections that a fault has stalled: the state that knows when the fault ends is about to be
    /// replaced.
    fn reset_stalled_peers(&mut self) {
        for port in Port::ETHERNET {
            if self.cell.controller.faults().is_stalled(port) {
                let channel = self.edge.channels.get_mut(port);
                let inputs =
                    channel.map_or_else(Vec::new, |channel| channel.disconnect(DisconnectMode::Reset));
                inputs.into_iter().for_each(|input| self.feed(input));
            }
        }
    }
}
