//! The loop of the driver: it takes work from requests and from the ports of all robots in rotation, and lets time pass
//! when there is none.
//!
//! The work itself is done elsewhere: requests in `control` and `snapshots`, inputs in [`crate::world::World::feed`].
//! [`crate::clock::Clock`] decides when to wake.

use super::Driver;
use super::edge::WriteResult;
use super::request::{Paused, Request};
use crate::clock::Wake;
use crate::pause::pause;
use crate::tcp::READ_BUFFER;
use crate::world::Robot;
use std::collections::BTreeSet;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use tokio::task::coop::unconstrained;
use tokio::task::yield_now;
use tokio::time::{Sleep, sleep_until};
use tracing::{Instrument as _, warn};
use ts3100_controller::{Input, Port, Time};

/// Most portions of bytes of a robot that are handled before a request.
const MAX_DRAINED_PORTIONS: usize = 64;
/// Time after which no second portion of the same port is handled before a request.
const DRAIN_TIME: Duration = Duration::from_micros(100);
/// Longest time the driver works without yielding to other tasks.
const MAX_TIME_WITHOUT_YIELD: Duration = Duration::from_micros(100);

/// One unit of work; the numbers are robots.
pub(super) enum Work {
    Request(usize, Request),
    /// Inputs that an event on a port has led to.
    Inputs(usize, Vec<Input>),
    /// A write to the backing directory has ended.
    Stored(usize, WriteResult),
    /// Virtual time jumps, because every host is silent.
    Jump(Time),
    /// The wake time has come.
    Tick,
    /// The clock checks whether the process was stopped.
    ClockCheck,
}

/// The port to poll next, the work that waits for the ports, and the time since the last yield. Ports are numbered
/// through all robots.
#[derive(Default)]
pub(super) struct Rotation {
    pub port: usize,
    /// A request, or a jump of time.
    held: Option<Held>,
    /// Since when other tasks had no turn; `None` if nothing had work at the last poll.
    working_since: Option<Instant>,
}

/// Work before which the ports are drained: bytes of hosts are handled first. A test that sends a command and then
/// moves the clock expects this order, although the two arrive on different connections.
pub(super) struct Held {
    work: Work,
    begun: Instant,
    served: BTreeSet<usize>,
    portions_left: usize,
}

impl Held {
    /// Notes that a port was served. Each port with data is served once, and again only for a short time: a host that
    /// sends without pause does not delay the work further. `None` if the work is void: time does not pass a host that has
    /// sent something.
    fn after(mut self, port: usize) -> Option<Held> {
        let again = !self.served.insert(port);
        self.portions_left = if again && self.begun.elapsed() > DRAIN_TIME {
            0
        } else {
            self.portions_left - 1
        };
        (!matches!(self.work, Work::Jump(_))).then_some(self)
    }
}

impl Rotation {
    /// Keeps work until the ports of that many robots are drained.
    fn hold(&mut self, work: Work, robots: usize) {
        self.held = Some(Held {
            work,
            begun: Instant::now(),
            served: BTreeSet::new(),
            portions_left: MAX_DRAINED_PORTIONS * robots,
        });
    }
}

impl Driver {
    /// Runs the loop until `stop` completes, or until a caller has it pause, which is then returned.
    pub(super) async fn serve(&mut self, stop: impl Future<Output = ()>) -> Option<oneshot::Sender<Paused>> {
        let (mut stop, mut timer) = (pin!(stop), WakeTimer::default());
        loop {
            let wake = self.wake();
            let beats = self.clock.gap_check_interval();
            let fine = self.clock.needs_fine_timer();
            // The order matters: `auto` may jump only when there is no other work.
            let work = tokio::select! {
                biased;
                () = &mut stop => return None,
                // Without the budget of the runtime, which would hide what has arrived: the loop yields by itself.
                work = unconstrained(poll_fn(|context| self.poll_work(context))) => work,
                () = timer.sleep(wake, fine) => Work::Tick,
                () = clock_check(beats) => Work::ClockCheck,
            };
            self.skip_gap();
            if let Work::Request(_, Request::Pause(caller)) = work {
                return Some(caller);
            }
            if let (Work::Tick, Wake::JumpAfter(_)) = (&work, wake)
                && let Some(target) = self.jump_target()
            {
                // Not yet: the ports are asked first, and the jump is void if a host has sent something meanwhile
                // (`Held::after`).
                self.rotation.hold(Work::Jump(target), self.world.robots().len());
            } else {
                self.perform(work).await;
            }
            let working_since = self.rotation.working_since;
            if working_since.is_some_and(|since| since.elapsed() > MAX_TIME_WITHOUT_YIELD) {
                yield_now().await;
                self.rotation.working_since = None;
            }
        }
    }

    fn skip_gap(&mut self) {
        if let Some(missed) = self.clock.skip_gap() {
            self.span().in_scope(|| {
                warn!(
                    "the process was stopped for {missed:.1?}; virtual time skips it (`skipped` of /clock)"
                );
            });
        }
    }

    /// Does one unit of work.
    async fn perform(&mut self, work: Work) {
        match work {
            Work::Request(robot, request) => {
                let span = self.world[robot].span.clone();
                self.serve_request(robot, request).instrument(span).await;
            }
            Work::Inputs(robot, inputs) => {
                // The system is asked once what time it is, not at every step of a request.
                self.clock.hold(Some(Instant::now()));
                self.clock.note_activity();
                inputs.into_iter().for_each(|input| self.feed(robot, input));
                self.clock.hold(None);
            }
            Work::Stored(robot, written) => self.stored(robot, written),
            Work::Jump(deadline) => {
                self.clock.jump(deadline);
                self.tick();
            }
            Work::Tick => self.tick(),
            Work::ClockCheck => {}
        }
    }

    /// The next unit of work. While a write is under way, requests that only read are served, and nothing else.
    pub(super) fn poll_work(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        self.rotation.working_since.get_or_insert_with(Instant::now);
        // While something is being stored, ports are not polled and their wakers are not registered. No wake-up is
        // lost: the task of the write has the waker, and its end leads back here.
        let storing = self.is_writing();
        for (robot, write) in self.writes() {
            if let Poll::Ready(written) = Pin::new(&mut write.task).poll(context) {
                return Poll::Ready(Work::Stored(robot, written));
            }
        }
        let robots = self.world.robots().len();
        // Ends when nobody can send requests any more.
        if self.rotation.held.is_none()
            && let Poll::Ready(Some((robot, request))) = self.requests.poll_recv(context)
        {
            let work = Work::Request(robot, request);
            // A query behind a request that waits is not reached: the order of requests is kept.
            if storing && matches!(work, Work::Request(_, Request::Query(_))) {
                return Poll::Ready(work);
            }
            self.rotation.hold(work, robots);
        }
        let held = self.rotation.held.as_ref();
        let (drains, drained) = (held.is_some(), held.is_some_and(|held| held.portions_left == 0));
        let places = robots * Port::ALL.len();
        for turn in 0..if drained || storing { 0 } else { places } {
            // From the port after the one served last, so that a host that sends without pause does not keep the others
            // out.
            let place = (self.rotation.port + turn) % places;
            // Before other work the system itself is asked, so that nothing that has arrived is overlooked.
            let runtime = (!drains).then_some(&mut *context);
            if let Poll::Ready(work) = self.poll_port(place, runtime) {
                self.rotation.port = place + 1;
                self.rotation.held = self.rotation.held.take().and_then(|held| held.after(place));
                return Poll::Ready(work);
            }
        }
        match self.rotation.held.take_if(|_| !storing) {
            Some(held) => Poll::Ready(held.work),
            None => {
                self.rotation.working_since = None;
                Poll::Pending
            }
        }
    }

    /// Returns the inputs of the next event on a port, by its place among those of all robots.
    fn poll_port(&mut self, place: usize, runtime: Option<&mut Context<'_>>) -> Poll<Work> {
        let (number, index) = (place / Port::ALL.len(), place % Port::ALL.len());
        let Some(&port) = Port::ALL.get(index) else {
            return Poll::Pending;
        };
        let Robot { seat, edge, span, .. } = &mut self.world[number];
        let _named = span.enter();
        let polled = match edge.channels.get_mut(port) {
            Some(channel) => channel.poll(READ_BUFFER, runtime),
            None => edge.serial_lines.poll(port, &seat.controller, runtime),
        };
        polled.map(|mut inputs| {
            if inputs.iter().any(|input| matches!(input, Input::Received { .. })) {
                // The connections come before the bytes, as the host has made them.
                let mut arrived = edge.channels.accept_arrived();
                arrived.extend(edge.serial_lines.open_arrived());
                inputs.splice(..0, arrived);
            }
            Work::Inputs(number, inputs)
        })
    }
}

async fn clock_check(beats: Option<Duration>) {
    match beats {
        None => std::future::pending().await,
        Some(pause) => tokio::time::sleep(pause).await,
    }
}

/// The timer of a loop. It may fire too early: each request moves the deadline, and setting a timer again costs more
/// than checking the deadline when it fires.
#[derive(Default)]
struct WakeTimer(Option<Pin<Box<Sleep>>>);

impl WakeTimer {
    /// Sleeps until then; `fine` when a fraction of a millisecond matters.
    async fn sleep(&mut self, wake: Wake, fine: bool) {
        match wake {
            Wake::Never => std::future::pending().await,
            // Something is due already, but other tasks get one turn.
            Wake::After(duration) | Wake::JumpAfter(duration) if duration.is_zero() => yield_now().await,
            Wake::JumpAfter(duration) if fine => pause(duration).await,
            Wake::After(duration) | Wake::JumpAfter(duration) => {
                match tokio::time::Instant::now().checked_add(duration) {
                    Some(until) => self.sleep_until(until).await,
                    None => std::future::pending().await,
                }
            }
        }
    }

    async fn sleep_until(&mut self, until: tokio::time::Instant) {
        let timer = self.0.get_or_insert_with(|| Box::pin(sleep_until(until)));
        loop {
            if timer.deadline() > until || timer.is_elapsed() {
                timer.as_mut().reset(until);
            }
            timer.as_mut().await;
            if timer.deadline() >= until {
                return;
            }
        }
    }
}
