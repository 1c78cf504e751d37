//! Snapshot requests, and replacing the running controller by another state: clock, channels, backing directory,
//! transcript and pending waits follow. The format and the named snapshots are in [`crate::snapshot`].

use super::Driver;
use super::request::WaitResult;
use crate::snapshot::handle::{SnapshotReply, SnapshotRequest, SnapshotRequestError, SnapshotTask};
use std::collections::VecDeque;
use std::time::Duration;
use tracing::info;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::port::Port;
use ts3100_controller::{Controller, Input};

impl Driver {
    /// Carries out one snapshot request and replies to the caller.
    pub(super) async fn serve_snapshot_request(&mut self, order: SnapshotRequest) {
        let SnapshotRequest { task, done } = order;
        // Handle what is already due, so that the saved state is the present one.
        self.feed(Input::Tick).await;
        let result = match task {
            SnapshotTask::Save(name) => {
                let kept = self.snapshot_store.insert(&name, self.controller.clone());
                kept.map(|()| SnapshotReply::Done)
                    .map_err(SnapshotRequestError::from)
            }
            SnapshotTask::Restore(name) => match self.snapshot_store.get(&name) {
                Ok(controller) => self
                    .replace_controller(controller)
                    .await
                    .map(|()| SnapshotReply::Done),
                Err(error) => Err(error.into()),
            },
            SnapshotTask::Replace(controller) => self
                .replace_controller(*controller)
                .await
                .map(|()| SnapshotReply::Done),
            SnapshotTask::Remove(name) => self
                .snapshot_store
                .remove(&name)
                .map(|()| SnapshotReply::Done)
                .map_err(SnapshotRequestError::from),
            SnapshotTask::List => Ok(SnapshotReply::Names(self.snapshot_store.list())),
            SnapshotTask::GetNamed(name) => match self.snapshot_store.get(&name) {
                Ok(controller) => Ok(SnapshotReply::State(Box::new(controller))),
                Err(error) => Err(error.into()),
            },
            SnapshotTask::Get => Ok(SnapshotReply::State(Box::new(self.controller.clone()))),
        };
        // Fails only when the caller no longer waits.
        let _ = done.send(result);
    }

    /// Continues with `next`: its time becomes the current time, its files replace those of the backing
    /// directory, and connected peers stay and are new to it. Ports are reopened only if its network parameters
    /// or its power state differ.
    pub(super) async fn replace_controller(
        &mut self,
        mut next: Controller,
    ) -> Result<(), SnapshotRequestError> {
        self.clock.note_activity();
        self.reset_stalled_peers().await;
        self.transcript.restored(self.clock.now(), &next);
        next.adopt_peers(&self.controller);
        let files_result = self.replace_files(&next);
        next.persist_outside(self.backing.is_some());
        let before = self.clock.now();
        self.clock.set(next.now());
        let ports = |controller: &Controller| (*controller.network(), controller.state().powered);
        let same_ports = ports(&next) == ports(&self.controller);
        self.controller = next;
        self.save_history();
        if let Some(scenario) = &self.scenario {
            scenario.controller_replaced(before, &self.controller);
        }
        // Pending waits refer to the time of the old controller.
        for pending in std::mem::take(&mut self.waits) {
            let at = self.controller.now();
            let (reached, passed) = (false, Duration::ZERO);
            let _ = pending.done.send(WaitResult { reached, at, passed });
        }
        self.run_record.add_files(&self.controller);
        let mut opened = Ok(());
        if !same_ports {
            let mut inputs = VecDeque::new();
            opened = self
                .reopen_channels(&mut inputs)
                .await
                .map_err(|error| SnapshotRequestError::Channels(error.to_string()));
            for input in inputs {
                self.feed(input).await;
            }
        }
        if let Some(journal) = &self.journal {
            journal.restored(self.clock.now());
        }
        info!(event = "restored", t = %self.clock.now(), "snapshot restored");
        // Send what the change of peers has caused.
        self.feed(Input::Tick).await;
        opened.and(files_result.map_err(SnapshotRequestError::Drive))
    }

    /// Resets connections that a fault has stalled: the state that knows when the fault ends is about to be
    /// replaced.
    async fn reset_stalled_peers(&mut self) {
        let is_stalled =
            |port: &Port| self.controller.faults().is_stalled(*port) && port.ethernet_index().is_some();
        let ports: Vec<Port> = Port::ALL.into_iter().filter(is_stalled).collect();
        for port in ports {
            for input in self.channels.disconnect(port, DisconnectMode::Reset) {
                self.feed(input).await;
            }
        }
    }
}
