//! Snapshot requests, and replacing running controllers by other states: clock, channels, backing directory and pending
//! waits follow. The format and the named snapshots are in [`crate::snapshot`].

use super::Driver;
use crate::seat::Notice;
use crate::snapshot::{SnapshotRequestError, SnapshotTask};
use crate::store::StoreError;
use crate::world::Robot;
use std::time::Duration;
use tracing::{Instrument as _, info};
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::port::Port;
use ts3100_controller::{Controller, Input};

impl Driver {
    /// Carries out snapshot tasks of robots, each with its number, as one unit of work: none sees the previous state of
    /// another. Returns each result.
    pub(super) async fn act_together(
        &mut self,
        tasks: Vec<(usize, SnapshotTask)>,
    ) -> Vec<Result<(), SnapshotRequestError>> {
        // What is already due happens first, so that a state that is saved is the present one.
        self.tick();
        self.finish_writes().await;
        self.world.cut_wires();
        let mut results = Vec::new();
        for (robot, task) in tasks {
            let span = self.world[robot].span.clone();
            results.push(self.act_on_snapshots(robot, task).instrument(span).await);
            self.finish_writes().await;
        }
        self.begin();
        self.world.mend_wires();
        self.note_effects();
        self.finish_writes().await;
        results
    }

    async fn act_on_snapshots(
        &mut self,
        robot: usize,
        task: SnapshotTask,
    ) -> Result<(), SnapshotRequestError> {
        let Robot { seat, edge, .. } = &mut self.world[robot];
        match task {
            SnapshotTask::Save(name) => Ok(edge.snapshots.insert(&name, seat.controller.clone())?),
            SnapshotTask::Restore(name) => {
                let controller = edge.snapshots.get(&name)?.clone();
                self.replace_controller(robot, controller).await
            }
            SnapshotTask::Replace(controller) => self.replace_controller(robot, *controller).await,
            SnapshotTask::Remove(name) => Ok(edge.snapshots.remove(&name)?),
            SnapshotTask::Copy(taker) => {
                (taker.0)(seat.controller.clone());
                Ok(())
            }
        }
    }

    /// Continues with `next`: its time becomes the current time, its files replace those of the backing
    /// directory, and connected peers stay and are new to it. Ports are reopened only if its network parameters
    /// or its power state differ.
    async fn replace_controller(
        &mut self,
        number: usize,
        mut next: Controller,
    ) -> Result<(), SnapshotRequestError> {
        self.clock.note_activity();
        self.reset_stalled_peers(number);
        self.finish_writes().await;
        let now = self.clock.now();
        let robot = &mut self.world[number];
        let time = robot.time_at(now);
        robot.seat.notify(time, Notice::Restored(&next));
        let before = &robot.seat.controller;
        next.adopt_peers(before);
        next.persist_outside(robot.edge.backing.is_some());
        let ports = |controller: &Controller| (*controller.network(), controller.state().powered);
        let same_ports = ports(&next) == ports(before);
        let was_powered = before.state().powered;
        let lines = |controller: &Controller| Port::SERIAL.map(|port| controller.serial_line(port));
        let same_lines = lines(&next) == lines(before);
        let files_result = self.take_over(number, next).await;
        let Robot { seat, edge, .. } = &mut self.world[number];
        if !same_lines {
            edge.serial_lines.set_robot(&seat.controller);
        }
        let mut opened = Ok(());
        // Ports that stay open keep their connections, which `adopt_peers` has told the next controller of.
        if !same_ports {
            let mut inputs = edge.channels.close();
            if seat.controller.state().powered {
                let reopened = edge.channels.open(seat.controller.network());
                opened = reopened
                    .map(drop)
                    .map_err(|error| SnapshotRequestError::Channels(error.to_string()));
                if !was_powered {
                    // A controller without power knows nobody: there were no peers to adopt.
                    inputs.extend(edge.serial_lines.power_cycled(&seat.controller));
                }
            }
            inputs.into_iter().for_each(|input| self.feed(number, input));
        }
        let time = self.world[number].time_at(self.clock.now());
        info!(event = "restored", t = %time, "snapshot restored");
        // Send what the change of peers has caused.
        self.feed(number, Input::Tick);
        opened.and(files_result.map_err(|reason| SnapshotRequestError::Drive(reason.to_string())))
    }

    /// `next` takes over with its time and its files. Pending waits end unreached before anything is fed: they refer to
    /// the time of another controller.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the files.
    pub(super) async fn take_over(&mut self, number: usize, next: Controller) -> Result<(), StoreError> {
        let robot = &mut self.world[number];
        let backing = robot.edge.backing.as_mut();
        let files = robot.seat.controller.files();
        // While the old controller is in place: its files are what the directory has.
        let stored = backing.map_or(Ok(()), |backing| backing.replace_files(files, &next));
        // The time that the files have taken is not time of the robot.
        robot.set_time(self.clock.now(), next.now());
        for pending in std::mem::take(&mut robot.edge.waits) {
            pending.end(false, next.now(), Duration::ZERO);
        }
        robot.seat.controller = next;
        robot.edge.save_history(&robot.seat.controller);
        self.finish_writes().await;
        stored
    }

    /// Resets connections that a fault has stalled: the state that knows when the fault ends is about to be
    /// replaced.
    fn reset_stalled_peers(&mut self, number: usize) {
        for port in Port::ETHERNET {
            let robot = &mut self.world[number];
            if robot.seat.controller.faults().is_stalled(port) {
                let channel = robot.edge.channels.get_mut(port);
                let inputs =
                    channel.map_or_else(Vec::new, |channel| channel.disconnect(DisconnectMode::Reset));
                inputs.into_iter().for_each(|input| self.feed(number, input));
            }
        }
    }
}
