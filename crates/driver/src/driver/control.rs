//! Requests to the driver: actions, queries, waits, and control of time.
//!
//! Here a request becomes
//! an input of the controller or a change of a connection, between two inputs. Snapshot requests are in `snapshots`.

use super::Driver;
use super::edge::Start;
use super::request::{Awaiting, LinkAction, PendingWait, Reply, Request, View};
use crate::clock::{self, TimeMode, Wake};
use crate::seat::{Notice, Side};
use crate::store::StoreError;
use crate::store::backing::Backing;
use crate::tcp::Channel;
use crate::world::Robot;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use tracing::{error, info};
use ts3100_controller::action::{Accepted, Action, ActionError, ActionErrorKind};
use ts3100_controller::faults::FaultAction;
use ts3100_controller::input::{Input, PanelAction};
use ts3100_controller::port::Port;
use ts3100_controller::time::Time;

impl Driver {
    /// Carries out one request for a robot and replies to the caller.
    pub(super) async fn serve_request(&mut self, robot: usize, request: Request) {
        match request {
            Request::Action(action, by, reply) => {
                self.clock.note_activity();
                let result = self.handle(robot, Input::Action { action, by }, Side::Host);
                self.reply(robot, result, reply);
            }
            Request::LinkAction(action, reply) => {
                self.clock.note_activity();
                let result = self.act_on_link(robot, action).await;
                // What is due in the new time mode, before the state is read.
                self.feed(robot, Input::Tick);
                self.reply(robot, result, reply);
            }
            Request::Snapshot(task, reply) => {
                let mut results = self.act_together(vec![(robot, task)]).await;
                if let Some(result) = results.pop() {
                    reply(result, &self.view(robot));
                }
            }
            Request::Query(look) => {
                // What is already due happens first; what is being stored is not waited for.
                if !self.is_writing() {
                    self.feed(robot, Input::Tick);
                }
                look((), &self.view(robot));
            }
            Request::Wait(wait, done) => {
                self.feed(robot, Input::Tick);
                let since = self.world[robot].seat.controller.now();
                let limit = since + wait.timeout;
                self.world[robot].edge.waits.push(PendingWait {
                    wait,
                    since,
                    limit,
                    reached: None,
                    done,
                });
                // It may have ended already.
                self.feed(robot, Input::Tick);
            }
            Request::SetOutside(name, on, done) => {
                if self.world.can_set(&name) {
                    let now = self.begin();
                    self.world.set_outside(now, name, on);
                    self.note_effects();
                    self.tell_settled(done);
                } else {
                    // Fails only when nobody waits for it.
                    let _ = done.send(false);
                }
            }
            // The loop ends its turn with it.
            Request::Pause(_) => {}
        }
    }

    /// Replies to the caller, as soon as the action has its result.
    pub(super) fn reply(
        &mut self,
        robot: usize,
        result: Result<Accepted, ActionError>,
        reply: Reply<Result<(), ActionError>>,
    ) {
        if result == Ok(Accepted::Pending) {
            self.awaiting = Some(Awaiting::Result(robot, reply));
        } else {
            reply(result.map(drop), &self.view(robot));
        }
    }

    /// Answers the caller once all consequences of an outside line have happened and no write is pending.
    pub(super) fn tell_settled(&mut self, done: oneshot::Sender<bool>) {
        if self.world.is_storing() {
            self.awaiting = Some(Awaiting::Settled(done));
        } else {
            // Fails only when nobody waits for it.
            let _ = done.send(true);
        }
    }

    pub(super) fn view(&self, robot: usize) -> View<'_> {
        let Robot { seat, edge, .. } = &self.world[robot];
        let (lag, skipped) = edge.lost_before;
        View {
            controller: &seat.controller,
            time: self.clock.mode(),
            lag: self.clock.lag().saturating_sub(lag),
            skipped: self.clock.skipped().saturating_sub(skipped),
            ports: edge.channels.numbers(),
            serial_lines: &edge.serial_lines,
            backing: edge.backing.as_ref().map(Backing::status),
            snapshots: &edge.snapshots,
            world: Some(&self.world),
        }
    }

    /// Handles everything that is due until this moment. Time is stopped there until [`Driver::go_on`].
    pub(super) async fn stand_at(&mut self, moment: Instant) {
        self.clock.hold(Some(moment));
        self.tick();
        self.finish_writes().await;
    }

    /// Time passes again, and wires carry, wherever the caller of a pause has stopped.
    pub(super) fn go_on(&mut self) {
        self.clock.hold(None);
        self.begin();
        self.world.mend_wires();
        self.note_effects();
    }

    async fn act_on_link(&mut self, robot: usize, action: LinkAction) -> Result<Accepted, ActionError> {
        match action {
            LinkAction::Inject { port, bytes } => {
                self.require_peer(robot, port, port.protocol().is_some())?;
                return self.handle(robot, Input::received(port, bytes), Side::Host);
            }
            LinkAction::Drop { port } => {
                self.require_peer(robot, port, true)?;
                let now = self.clock.now();
                let dropped = &mut self.world[robot];
                if dropped.edge.serial_lines.endpoint(port).is_some() {
                    return Err(ActionError::conflict(
                        port,
                        format!("cannot drop the peer of {port}: a serial line has no connection to close"),
                    ));
                }
                let time = dropped.time_at(now);
                dropped.seat.notify(time, Notice::Dropped(port));
                let channel = dropped.edge.channels.get_mut(port);
                let inputs = channel.map_or_else(Vec::new, Channel::drop_peer);
                self.feed_own(robot, inputs);
            }
            LinkAction::TimeMode(mode) => {
                self.clock.set_mode(mode);
                self.judge_pace(self.clock.now());
                info!("time: {mode}");
            }
            LinkAction::Reset => self.reset(robot).await.map_err(|reason| ActionError {
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
    fn feed_own(&mut self, robot: usize, inputs: Vec<Input>) {
        for input in inputs {
            // Only actions are refused.
            let _ = self.handle(robot, input, Side::Robot);
        }
    }

    /// Fails if the power is off, or if `expected` is set and no peer is connected.
    fn require_peer(&self, robot: usize, port: Port, expected: bool) -> Result<(), ActionError> {
        let controller = &self.world[robot].seat.controller;
        let reason = if !controller.state().powered {
            "the power is off; turn it on first"
        } else if expected && controller.peer(port).is_none() {
            "nobody is connected"
        } else {
            return Ok(());
        };
        Err(ActionError::conflict(
            port,
            format!("cannot use {port}: {reason}"),
        ))
    }

    /// Restores the state of a robot at the start: connections closed, time at its initial value.
    ///
    /// # Errors
    /// Why the backing directory lacks some of the initial files; everything else is reset.
    async fn reset(&mut self, number: usize) -> Result<(), StoreError> {
        let robot = &mut self.world[number];
        let network = *robot.edge.start.controller.network();
        for input in robot.edge.channels.close_for(&network) {
            if let Input::Disconnected { port } = input {
                let now = self.clock.now();
                let robot = &mut self.world[number];
                let time = robot.time_at(now);
                robot.seat.notify(time, Notice::Dropped(port));
            }
            self.feed_own(number, vec![input]);
        }
        self.feed(number, Input::Tick);
        self.finish_writes().await;
        let robot = &mut self.world[number];
        let mut next = robot.edge.start.controller.clone();
        let wall_clock = matches!(self.clock.mode(), TimeMode::Real | TimeMode::Scaled(_));
        let calendar = wall_clock.then(clock::system_calendar);
        if let Some(calendar) = calendar {
            next.set_calendar(calendar);
        }
        let notice = Notice::Reset {
            controller: &next,
            calendar,
        };
        robot.seat.notify(robot.seat.controller.now(), notice);
        robot.edge.lost_before = (self.clock.lag(), self.clock.skipped());
        self.clock.note_activity();
        let files_result = self.take_over(number, next).await;
        let Robot { seat, edge, .. } = &mut self.world[number];
        if let Err(reason) = edge.channels.open(seat.controller.network()) {
            error!("cannot open the ports after the reset: {reason}");
        }
        info!("reset: {}", edge.channels.listing());
        for input in edge.serial_lines.power_cycled(&seat.controller) {
            self.feed(number, input);
        }
        self.start(number);
        files_result
    }

    /// Feeds the first inputs after power-on: the initial faults and the servo power.
    pub(super) fn start(&mut self, robot: usize) {
        let Start { faults, servo_on, .. } = &self.world[robot].edge.start;
        let (faults, servo_on) = (faults.clone(), *servo_on);
        for fault in faults {
            let request = FaultAction::Arm(Box::new(fault));
            self.feed(robot, Input::by_owner(Action::Fault(request)));
        }
        if servo_on {
            self.feed(robot, Input::by_hand(PanelAction::Servo(true)));
        } else {
            self.feed(robot, Input::Tick);
        }
    }

    /// Next moment at which the loop must wake if no input arrives.
    pub(super) fn wake(&self) -> Wake {
        // No deadline is served before the write has ended, and its end wakes the loop.
        if self.is_writing() {
            return Wake::Never;
        }
        let robots = self.world.robots();
        if self.waits().any(|(_, pending)| pending.wait.advance) {
            return Wake::JumpAfter(Duration::ZERO);
        }
        let is_silent = robots.iter().all(|robot| robot.seat.controller.host_is_silent());
        let wake = self.clock.wake(self.world.deadline(), is_silent);
        // The end of a wait alone does not let `auto` jump: the caller asked for a length of time.
        let limit = self.waits().map(|(limit, _)| limit).min();
        wake.min(self.clock.wake(limit, false))
    }

    /// Target of a jump after [`Wake::JumpAfter`]: the next deadline, or the end of a wait that moves time.
    pub(super) fn jump_target(&self) -> Option<Time> {
        let advancing = self.waits().filter(|(_, pending)| pending.wait.advance);
        let limits = advancing.map(|(limit, _)| limit);
        self.world.deadline().into_iter().chain(limits).min()
    }

    /// The pending waits of all robots, each with the moment of its limit.
    fn waits(&self) -> impl Iterator<Item = (Time, &PendingWait)> {
        let robots = self.world.robots().iter();
        robots.flat_map(|robot| {
            let waits = robot.edge.waits.iter();
            waits.map(|pending| (robot.moment_of(pending.limit), pending))
        })
    }
}
