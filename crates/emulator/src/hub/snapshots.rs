//! Another state put in the place of the running controller: clock, links and backing directory follow it. What a
//! snapshot is and where it is kept is `snapshot`'s.

use super::Hub;
use super::request::Waited;
use crate::snapshot::desk::{DeskError, Done, Order, Task};
use std::collections::VecDeque;
use std::time::Duration;
use tracing::info;
use ts3100_controller::output::Cut;
use ts3100_controller::port::Port;
use ts3100_controller::{Controller, Input};

impl Hub {
    /// Does what was asked at the desk.
    pub(super) async fn serve_order(&mut self, order: Order) {
        let Order { task, done } = order;
        // What is due by now has happened in what is kept or told.
        self.feed(Input::Tick).await;
        let result = match task {
            Task::Keep(name) => {
                let kept = self.shelf.keep(&name, self.controller.clone());
                kept.map(|()| Done::Well).map_err(DeskError::from)
            }
            Task::Restore(name) => match self.shelf.get(&name) {
                Ok(controller) => self.put_in(controller).await.map(|()| Done::Well),
                Err(error) => Err(error.into()),
            },
            Task::PutIn(controller) => self.put_in(*controller).await.map(|()| Done::Well),
            Task::Forget(name) => self
                .shelf
                .forget(&name)
                .map(|()| Done::Well)
                .map_err(DeskError::from),
            Task::List => Ok(Done::Names(self.shelf.list())),
            Task::TellNamed(name) => match self.shelf.get(&name) {
                Ok(controller) => Ok(Done::State(Box::new(controller))),
                Err(error) => Err(error.into()),
            },
            Task::Tell => Ok(Done::State(Box::new(self.controller.clone()))),
        };
        // Fails only when nobody waits for it.
        let _ = done.send(result);
    }

    /// The controller goes on as this one: the time is its time, the peers that are connected stay and are new to it,
    /// the backing directory has its files, and if its channels are others, the ports are opened anew.
    pub(super) async fn put_in(&mut self, mut next: Controller) -> Result<(), DeskError> {
        self.clock.stir();
        self.end_half_open().await;
        self.tape.restored(self.clock.now(), &next);
        next.take_peers_of(&self.controller);
        let followed = self.follow_files(&next);
        next.keep_outside(self.backing.is_some());
        let before = self.clock.now();
        self.clock.set(next.now());
        let ports = |controller: &Controller| (*controller.network(), controller.state().powered);
        let same_ports = ports(&next) == ports(&self.controller);
        self.controller = next;
        self.keep_history();
        if let Some(play) = &self.play {
            play.go_on(before, &self.controller);
        }
        // Who waits, waits on another time than this.
        for waiting in std::mem::take(&mut self.waits) {
            let at = self.controller.now();
            let (reached, passed) = (false, Duration::ZERO);
            let _ = waiting.done.send(Waited { reached, at, passed });
        }
        self.evidence.begin(&self.controller);
        let mut opened = Ok(());
        if !same_ports {
            let mut inputs = VecDeque::new();
            opened = self
                .open_anew(&mut inputs)
                .await
                .map_err(|error| DeskError::Links(error.to_string()));
            for input in inputs {
                self.feed(input).await;
            }
        }
        if let Some(journal) = &self.journal {
            journal.restored(self.clock.now());
        }
        info!(event = "restored", t = %self.clock.now(), "snapshot restored");
        // What the change of peers has brought about leaves now.
        self.feed(Input::Tick).await;
        opened.and(followed.map_err(DeskError::Drive))
    }

    /// What a fault has made half-open would stay so: the state that knows when it ends is the one that goes.
    async fn end_half_open(&mut self) {
        let deaf = |port: &Port| self.controller.faults().is_deaf(*port) && port.ethernet_index().is_some();
        let ports: Vec<Port> = Port::ALL.into_iter().filter(deaf).collect();
        for port in ports {
            for input in self.links.end(port, Cut::Reset) {
                self.feed(input).await;
            }
        }
    }
}
