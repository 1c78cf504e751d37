//! Requests to the driver: actions, queries, waits, and control of time.
//!
//! Here a request becomes
//! an input of the controller or a change of a connection, between two inputs. Snapshot requests are in `snapshots`.

use super::Driver;
use super::request::{LinkAction, PendingWait, Reply, Request, View};
use crate::cell::{Notice, Side};
use crate::clock::{self, TimeMode, Wake};
use crate::store::StoreError;
use crate::store::backing::Backing;
use crate::tcp::Channel;
use std::time::{Duration, Instant};
use tracing::{error, info};
use ts3100_controller::action::{Accepted, Action, ActionError, ActionErrorKind};
use ts3100_controller::faults::FaultAction;
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

impl Driver {
    /// Carries out one request and replies to the caller.
    pub(super) async fn serve_request(&mut self, request: Request) {
        match request {
            Request::Panel(panel, reply) => {
                self.edge.clock.note_activity();
                let result = self.handle(Input::Panel(panel), Side::Host);
                self.reply(result, Box::new(move |_, view| reply((), view)));
            }
            Request::Action(action, reply) => {
                self.edge.clock.note_activity();
                let result = self.handle(Input::Action(action), Side::Host);
                self.reply(result, reply);
            }
            Request::LinkAction(action, reply) => {
                self.edge.clock.note_activity();
                let result = self.act_on_link(action).await;
                // What is due in the new time mode, before the state is read.
                self.feed(Input::Tick);
                self.reply(result, reply);
            }
            Request::Snapshot(task, reply) => {
                // Handle what is already due first, so that the saved state is the present one.
                self.feed(Input::Tick);
                self.finish_writes().await;
                let result = self.act_on_snapshots(task).await;
                self.finish_writes().await;
                reply(result, &self.view());
            }
            Request::Query(look) => {
                // As above, but what is being stored is not waited for.
                if self.edge.write.is_none() {
                    self.feed(Input::Tick);
                }
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
                    reached: None,
                    done,
                });
                // It may have ended already.
                self.feed(Input::Tick);
            }
            Request::Exclusive(requests) => self.exclusive = Some(requests),
            Request::StandStill(moment, reply) => {
                self.edge.clock.hold(Some(moment));
                self.edge.begun = Instant::now();
                let now = self.edge.clock.now();
                let _ = self.cell.feed(now, Input::Tick, Side::Host, &mut self.edge);
                self.finish_writes().await;
                reply((), &self.view());
            }
        }
    }

    /// Replies to the caller, as soon as the action has its result.
    pub(super) fn reply(
        &mut self,
        result: Result<Accepted, ActionError>,
        reply: Reply<Result<(), ActionError>>,
    ) {
        if result == Ok(Accepted::Pending) {
            self.awaiting = Some(reply);
        } else {
            reply(result.map(drop), &self.view());
        }
    }

    fn view(&self) -> View<'_> {
        View {
            controller: &self.cell.controller,
            clock: &self.edge.clock,
            ports: self.ports(),
            serial_lines: &self.edge.serial_lines,
            backing: self.edge.backing.as_ref().map(Backing::status),
            snapshots: &self.snapshot_store,
        }
    }

    async fn act_on_link(&mut self, action: LinkAction) -> Result<Accepted, ActionError> {
        match action {
            LinkAction::Inject { port, bytes } => {
                self.require_peer(port, port.protocol().is_some())?;
                return self.handle(Input::received(port, bytes), Side::Host);
            }
            LinkAction::Drop { port } => {
                self.require_peer(port, true)?;
                if self.edge.serial_lines.endpoint(port).is_some() {
                    return Err(ActionError::conflict(
                        port,
                        format!(
                            "cannot drop the peer of {port}: the host holds its own end of a serial line"
                        ),
                    ));
                }
                self.cell.notify(self.edge.clock.now(), Notice::Dropped(port));
                let channel = self.edge.channels.get_mut(port);
                let inputs = channel.map_or_else(Vec::new, Channel::drop_peer);
                self.feed_own(inputs);
            }
            LinkAction::TimeMode(mode) => {
                self.edge.clock.set_mode(mode);
                self.judge_pace();
                info!("time: {mode}");
            }
            LinkAction::Reset => self.reset().await.map_err(|reason| ActionError {
                kind: ActionErrorKind::NotPersisted,
                ..ActionError::conflict(
                    "drive",
                    format!("cannot restore the files of the start: {reason}"),
                )
            })?,
        }
        Ok(Accepted::Done)
    }

    /// Handles inputs that the controller's side has caused.
    fn feed_own(&mut self, inputs: Vec<Input>) {
        for input in inputs {
            // Only actions are refused.
            let _ = self.handle(input, Side::Robot);
        }
    }

    /// Fails if the power is off, or if `expected` is set and no peer is connected.
    fn require_peer(&self, port: Port, expected: bool) -> Result<(), ActionError> {
        let reason = if !self.cell.controller.state().powered {
            "the power is off"
        } else if expected && self.cell.controller.peer(port).is_none() {
            "nobody is connected"
        } else {
            return Ok(());
        };
        Err(ActionError::conflict(
            port,
            format!("cannot use {port}: {reason}"),
        ))
    }

    /// Restores the state at the start: connections closed, time at its initial value.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the initial files; everything else is reset.
    async fn reset(&mut self) -> Result<(), StoreError> {
        let network = self.initial_controller.network();
        for input in self.edge.channels.close_for(network) {
            if let Input::Disconnected { port } = input {
                self.cell.notify(self.edge.clock.now(), Notice::Dropped(port));
            }
            self.feed_own(vec![input]);
        }
        self.feed(Input::Tick);
        self.finish_writes().await;
        let mut next = self.initial_controller.clone();
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
        self.edge.clock.restart();
        let files_result = self.take_over(next).await;
        if let Err(reason) = self.edge.channels.open(self.cell.controller.network()) {
            error!("no port is open: {reason}");
        }
        info!("reset; ports: {:?}", self.ports());
        for input in self.edge.serial_lines.power_cycled(&self.cell.controller) {
            self.feed(input);
        }
        self.start();
        files_result
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

    /// When the loop must wake if no input arrives.
    pub(super) fn wake(&self, host_is_silent: bool) -> Wake {
        if self.edge.write.is_some() || self.exclusive.is_some() {
            return Wake::Never;
        }
        let (waits, clock) = (&self.edge.waits, &self.edge.clock);
        if waits.iter().any(|pending| pending.wait.advance) {
            return Wake::JumpAfter(Duration::ZERO);
        }
        let limit = waits.iter().map(|pending| pending.limit).min();
        let wake = clock.wake(self.cell.deadline(), host_is_silent);
        // The end of a wait alone does not let `auto` jump: the caller asked for a length of time.
        wake.min(clock.wake(limit, false))
    }

    /// Where time jumps to after [`Wake::JumpAfter`]: what is due next, or the end of a wait that moves time.
    pub(super) fn jump_target(&self) -> Option<Time> {
        let advancing = self.edge.waits.iter().filter(|pending| pending.wait.advance);
        let limits = advancing.map(|pending| pending.limit);
        self.cell.deadline().into_iter().chain(limits).min()
    }
}
