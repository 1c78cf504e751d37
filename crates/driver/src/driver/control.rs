//! Requests to the driver: actions, queries, waits, and control of time.
//!
//! Here a request becomes
//! an input of the controller or a change of a connection, between two inputs. Snapshot requests are in `snapshots`.

use super::Driver;
use super::request::{LinkAction, PendingWait, Request, View, WaitResult};
use crate::cell::{Notice, Side};
use crate::clock::{self, TimeMode, Wake};
use crate::store::StoreError;
use crate::store::backing::Backing;
use std::time::Duration;
use tracing::{error, info};
use ts3100_controller::action::{Action, ActionError, ActionErrorKind};
use ts3100_controller::faults::FaultAction;
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

impl Driver {
    /// Carries out one request and replies to the caller.
    pub(super) fn serve_request(&mut self, request: Request) {
        match request {
            Request::Panel(panel, reply) => {
                self.edge.clock.note_activity();
                self.feed(Input::Panel(panel));
                reply((), &self.view());
            }
            Request::Action(action, reply) => {
                self.edge.clock.note_activity();
                let result = self.feed_from(Input::Action(action), Side::Host);
                reply(result, &self.view());
            }
            Request::LinkAction(action, reply) => {
                self.edge.clock.note_activity();
                let result = self.act_on_link(action);
                // What is due in the new time mode, before the state is read.
                self.feed(Input::Tick);
                reply(result, &self.view());
            }
            Request::Snapshot(task, reply) => {
                // Handle what is already due first, so that the saved state is the present one.
                self.feed(Input::Tick);
                let result = self.act_on_snapshots(task);
                reply(result, &self.view());
            }
            Request::Query(look) => {
                // As above.
                self.feed(Input::Tick);
                look((), &self.view());
            }
            Request::Wait(wait, done) => {
                self.feed(Input::Tick);
                let since = self.cell.controller.now();
                let limit = since + wait.timeout;
                self.edge.waits.push(PendingWait {
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

    fn view(&self) -> View<'_> {
        View {
            controller: &self.cell.controller,
            clock: &self.edge.clock,
            ports: &self.edge.ports,
            serial_lines: &self.edge.serial_lines,
            backing: self.edge.backing.as_ref().map(Backing::status),
            snapshots: &self.snapshot_store,
        }
    }

    fn act_on_link(&mut self, action: LinkAction) -> Result<(), ActionError> {
        match action {
            LinkAction::Inject { port, bytes } => {
                self.require_peer(port, port.protocol().is_some())?;
                self.feed(Input::received(port, bytes));
                Ok(())
            }
            LinkAction::Drop { port } => {
                self.require_peer(port, true)?;
                if self.edge.serial_lines.has(port) {
                    return Err(ActionError {
                        kind: ActionErrorKind::Conflict,
                        expected: "a channel of Ethernet".to_owned(),
                        found: "a serial line, of which the host holds its own end".to_owned(),
                        place: port.name().to_owned(),
                    });
                }
                self.cell.notify(self.edge.clock.now(), Notice::Dropped(port));
                for input in self.edge.channels.drop_peer(port) {
                    // Only actions are refused.
                    let _ = self.feed_from(input, Side::Robot);
                }
                Ok(())
            }
            LinkAction::TimeMode(mode) => {
                self.edge.clock.set_mode(mode);
                self.judge_pace();
                info!("time: {mode}");
                Ok(())
            }
            LinkAction::Reset => self.reset().map_err(|reason| ActionError {
                kind: ActionErrorKind::NotPersisted,
                expected: "a directory with the files of the start".to_owned(),
                found: reason.to_string(),
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
        if !self.cell.controller.state().powered {
            return Err(refused("power on", "the power is off"));
        }
        if expected && self.cell.controller.peer(port).is_none() {
            return Err(refused("a connected peer", "nobody is connected"));
        }
        Ok(())
    }

    /// Restores the state at the start: connections closed, time at its initial value.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the initial files; everything else is reset.
    fn reset(&mut self) -> Result<(), StoreError> {
        for input in self.edge.close_channels() {
            if let Input::Disconnected { port } = input {
                self.cell.notify(self.edge.clock.now(), Notice::Dropped(port));
            }
            let _ = self.feed_from(input, Side::Robot);
        }
        self.feed(Input::Tick);
        let mut next = self.initial_controller.clone();
        let files_result = self.edge.replace_files(&self.cell.controller, &next);
        let wall_clock = matches!(self.edge.clock.mode(), TimeMode::Real | TimeMode::Scaled(_));
        let calendar = wall_clock.then(clock::system_calendar);
        if let Some(calendar) = calendar {
            next.set_calendar(calendar);
        }
        let notice = Notice::Reset {
            controller: &next,
            calendar,
        };
        self.cell.notify(self.cell.controller.now(), notice);
        self.cell.controller = next;
        self.edge.clock.restart();
        self.edge.clock.set(self.cell.controller.now());
        self.abandon_waits(Time::ZERO);
        self.edge.save_history(&self.cell.controller);
        if let Err(reason) = self.edge.open_channels(&self.cell.controller) {
            error!("no port is open: {reason}");
        }
        info!("reset; ports: {:?}", self.edge.ports);
        for input in self.edge.serial_lines.power_cycled(&self.cell.controller) {
            self.feed(input);
        }
        self.start();
        files_result
    }

    /// Ends every wait unreached: they refer to the time of another controller.
    pub(super) fn abandon_waits(&mut self, at: Time) {
        for pending in std::mem::take(&mut self.edge.waits) {
            let (reached, passed) = (false, Duration::ZERO);
            // Fails only when the caller no longer waits.
            let _ = pending.done.send(WaitResult { reached, at, passed });
        }
    }

    /// Feeds the first inputs after power-on: the initial faults and the servo power.
    pub(super) fn start(&mut self) {
        for fault in self.faults.clone() {
            let request = FaultAction::Arm(Box::new(fault));
            self.feed(Input::Action(Action::Fault(request)));
        }
        if self.servo_on {
            self.feed(Input::Panel(PanelAction::Servo(true)));
        } else {
            self.feed(Input::Tick);
        }
    }

    /// Answers the waits that have ended and drops those whose caller is gone.
    pub(super) fn end_waits(&mut self) {
        let now = self.cell.controller.now();
        let mut index = 0;
        while let Some(pending) = self.edge.waits.get(index) {
            let reached = pending.wait.is_met(&self.cell.controller);
            if !reached && now < pending.limit && !pending.done.is_closed() {
                index += 1;
                continue;
            }
            let pending = self.edge.waits.swap_remove(index);
            let passed = now.since(pending.since);
            // Fails only when nobody waits for it.
            let _ = pending.done.send(WaitResult {
                reached,
                at: now,
                passed,
            });
        }
        let needs_statements = self.edge.waits.iter().any(PendingWait::needs_statements);
        self.cell.await_statements(needs_statements);
    }

    /// When the loop must wake if no input arrives, and the deadline to which virtual time then jumps.
    pub(super) fn next_wake(&self) -> (Wake, Option<Time>) {
        let deadline = self.cell.deadline();
        let advancing = self.edge.waits.iter().filter(|pending| pending.wait.advance);
        if let Some(limit) = advancing.map(|pending| pending.limit).min() {
            let next = deadline.map_or(limit, |deadline| deadline.min(limit));
            return (Wake::JumpAfter(Duration::ZERO), Some(next));
        }
        let wake = self
            .edge
            .clock
            .wake(deadline, self.cell.controller.host_is_silent());
        let limit = self.edge.waits.iter().map(|pending| pending.limit).min();
        // The end of a wait alone does not let `auto` jump: the caller asked for a length of time.
        let left = limit.and_then(|limit| self.edge.clock.wall_time_until(limit));
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
