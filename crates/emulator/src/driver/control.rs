//! Requests to the driver: actions, queries, waits, and control of time.
//!
//! The control interface (`crate::control`) decides what a client may ask and how it is written; here a request becomes
//! an input of the controller or a change of a connection, between two inputs. Snapshot requests are in `snapshots`.

use super::Driver;
use super::request::{LinkAction, PendingWait, Request, View, WaitResult};
use crate::clock::{self, TimeMode, Wake};
use crate::store::backing::Backing;
use crate::transcript::{LinkRecord, Side};
use std::time::Duration;
use tracing::{error, info};
use ts3100_controller::action::{Action, ActionError, ActionErrorKind};
use ts3100_controller::faults::FaultAction;
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::output::Output;
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

impl Driver {
    /// Carries out one request and replies to the caller.
    pub(super) async fn serve_request(&mut self, request: Request) {
        match request {
            Request::Panel { panel, done } => {
                self.clock.note_activity();
                self.feed(Input::Panel(panel)).await;
                // Fails only when the caller no longer waits.
                let _ = done.send(());
            }
            Request::Action { action, done } => {
                self.clock.note_activity();
                let result = self.act(action).await;
                let _ = done.send(result);
            }
            Request::ActionBlocking { action, done } => {
                self.clock.note_activity();
                let result = self.act(action).await;
                let _ = done.send(result);
            }
            Request::LinkAction { action, done } => {
                self.clock.note_activity();
                let result = self.act_on_link(action).await;
                let _ = done.send(result);
            }
            Request::Snapshot(request) => self.serve_snapshot_request(request).await,
            Request::Query(query) => {
                // Handle what is already due first, so that the query sees the present state.
                self.feed(Input::Tick).await;
                query(&View {
                    controller: &self.controller,
                    clock: &self.clock,
                    ports: &self.ports,
                    serial: &self.serial_lines.endpoints(),
                    backing: self.backing.as_ref().map(Backing::status),
                });
            }
            Request::Wait { wait, done } => {
                self.feed(Input::Tick).await;
                let since = self.controller.now();
                let limit = since + wait.timeout;
                self.waits.push(PendingWait {
                    wait,
                    since,
                    limit,
                    done,
                });
                self.end_waits();
                self.update_idle();
            }
        }
    }

    async fn act(&mut self, action: Action) -> Result<(), ActionError> {
        self.feed_from(Input::Action(action), Side::Host).await
    }

    async fn act_on_link(&mut self, action: LinkAction) -> Result<(), ActionError> {
        match action {
            LinkAction::Inject { port, bytes } => {
                self.require_peer(port, port.protocol().is_some())?;
                self.feed(Input::received(port, bytes)).await;
                Ok(())
            }
            LinkAction::Drop { port } => {
                self.require_peer(port, true)?;
                if self.serial_lines.has(port) {
                    return Err(ActionError {
                        kind: ActionErrorKind::Conflict,
                        expected: "a channel of Ethernet".to_owned(),
                        found: "a serial line, of which the host holds its own end".to_owned(),
                        place: port.name().to_owned(),
                    });
                }
                self.transcript
                    .link(self.clock.now(), LinkRecord::Dropped { port });
                for input in self.channels.drop_peer(port) {
                    // Only actions are refused.
                    let _ = self.feed_from(input, Side::Robot).await;
                }
                Ok(())
            }
            LinkAction::TimeMode(mode) => {
                self.clock.set_mode(mode);
                info!("time: {mode}");
                Ok(())
            }
            LinkAction::Reset => self.reset().await.map_err(|reason| ActionError {
                kind: ActionErrorKind::NotPersisted,
                expected: "a directory with the files of the start".to_owned(),
                found: reason,
                place: "drive".to_owned(),
            }),
        }
    }

    /// Fails if the power is off, or if `expected` is set and no peer is connected.
    fn require_peer(&self, port: Port, expected: bool) -> Result<(), ActionError> {
        let refused = |expected: &str, found: &str| ActionError {
            kind: ActionErrorKind::Conflict,
            expected: expected.to_owned(),
            found: found.to_owned(),
            place: port.name().to_owned(),
        };
        if !self.controller.state().powered {
            return Err(refused("power on", "the power is off"));
        }
        if expected && self.controller.peer_of(port).is_none() {
            return Err(refused("a connected peer", "nobody is connected"));
        }
        Ok(())
    }

    /// Restores the state at the start: connections closed, time at its initial value.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the initial files; everything else is reset.
    async fn reset(&mut self) -> Result<(), String> {
        for port in self.channels.close() {
            self.transcript
                .link(self.clock.now(), LinkRecord::Dropped { port });
            let _ = self.feed_from(Input::Disconnected { port }, Side::Robot).await;
        }
        self.feed(Input::Tick).await;
        let ended = self.controller.now();
        let next = self.initial_controller.clone();
        let files_result = self.replace_files(&next);
        self.controller = next;
        let calendar =
            matches!(self.clock.mode(), TimeMode::Real | TimeMode::Scaled(_)).then(clock::system_calendar);
        if let Some(calendar) = calendar {
            self.controller.set_calendar(calendar);
        }
        if self.restored {
            self.transcript.restored(self.clock.now(), &self.controller);
        } else {
            self.transcript.reset(self.clock.now(), calendar);
        }
        self.clock.restart();
        self.clock.set(self.controller.now());
        if let Some(scenario) = &self.scenario {
            scenario.controller_replaced(ended, &self.controller);
        }
        for pending in std::mem::take(&mut self.waits) {
            let _ = pending.done.send(WaitResult {
                reached: false,
                at: Time::ZERO,
                passed: Duration::ZERO,
            });
        }
        if let Some(journal) = &self.journal {
            journal.reset();
        }
        self.save_history();
        self.open_channels();
        info!("reset; ports: {:?}", self.ports);
        for input in self.serial_lines.power_cycled(&self.controller) {
            self.feed(input).await;
        }
        self.start().await;
        files_result
    }

    /// Feeds the first inputs after power-on: the initial faults and the servo power.
    pub(super) async fn start(&mut self) {
        for fault in self.faults.clone() {
            let request = FaultAction::Arm(Box::new(fault));
            self.feed(Input::Action(Action::Fault(request))).await;
        }
        if self.servo_on {
            self.feed(Input::Panel(PanelAction::Servo(true))).await;
        } else {
            self.feed(Input::Tick).await;
        }
    }

    /// Opens the channels of the network parameters; if one fails, none is open.
    pub(super) fn open_channels(&mut self) {
        match self.channels.open(self.controller.network()) {
            Ok(ports) => self.ports = ports,
            Err(reason) => {
                error!("no port is open: {reason}");
                self.ports.clear();
            }
        }
    }

    /// Whether a pending wait needs statement events.
    pub(super) fn waits_for_statement(&self) -> bool {
        self.waits.iter().any(PendingWait::needs_statements)
    }

    /// Passes an output to every pending wait.
    pub(super) fn observe(&mut self, output: &Output) {
        for pending in &mut self.waits {
            pending.wait.observe(output);
        }
    }

    /// Answers the waits that have ended and drops those whose caller is gone.
    pub(super) fn end_waits(&mut self) {
        let now = self.controller.now();
        let mut index = 0;
        while let Some(pending) = self.waits.get(index) {
            let reached = pending.wait.is_met(&self.controller);
            if !reached && now < pending.limit && !pending.done.is_closed() {
                index += 1;
                continue;
            }
            let pending = self.waits.swap_remove(index);
            let passed = now.since(pending.since);
            // Fails only when nobody waits for it.
            let _ = pending.done.send(WaitResult {
                reached,
                at: now,
                passed,
            });
        }
        let traces = self.record_lines || self.waits_for_statement();
        self.controller.trace(traces);
    }

    /// When the loop must wake if no input arrives, and the deadline to which virtual time then jumps.
    pub(super) fn next_wake(&self) -> (Wake, Option<Time>) {
        let deadline = self.deadline();
        let advancing = self.waits.iter().filter(|pending| pending.wait.advance);
        if let Some(limit) = advancing.map(|pending| pending.limit).min() {
            let next = deadline.map_or(limit, |deadline| deadline.min(limit));
            return (Wake::JumpAfter(Duration::ZERO), Some(next));
        }
        let wake = self.clock.wake(deadline, self.controller.host_is_silent());
        let limit = self.waits.iter().map(|pending| pending.limit).min();
        // The end of a wait alone does not let `auto` jump: the caller asked for a length of time.
        let left = limit.and_then(|limit| self.clock.wall_time_until(limit));
        let wake = match (wake, left) {
            (wake, None) => wake,
            (Wake::Never, Some(left)) => Wake::After(left),
            (Wake::After(before), Some(left)) => Wake::After(before.min(left)),
            (Wake::JumpAfter(before), Some(left)) if left < before => Wake::After(left),
            (Wake::JumpAfter(before), Some(_)) => Wake::JumpAfter(before),
        };
        (wake, deadline)
    }
}
