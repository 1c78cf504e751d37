//! The loop of the driver: it takes work from requests and ports in rotation, and lets time pass when there is none.
//!
//! What the work means is handled elsewhere: requests in `control` and `snapshots`, inputs in [`crate::cell::Cell::feed`].
//! When to wake is decided by [`crate::clock::Clock`].

use super::Driver;
use super::edge::WriteResult;
use super::request::Request;
use crate::clock::Wake;
use crate::pause::pause;
use crate::tcp::READ_BUFFER;
use std::collections::BTreeSet;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};
use tokio::task::coop::unconstrained;
use tokio::task::yield_now;
use tokio::time::{Sleep, sleep_until};
use tracing::warn;
use ts3100_controller::{Input, Port, Time};

/// Most portions of bytes that are handled before a request.
const MAX_DRAINED_PORTIONS: u32 = 64;
/// Time after which no second portion of the same port is handled before a request.
const DRAIN_TIME: Duration = Duration::from_micros(100);
/// Longest time the driver works without yielding to other tasks.
pub(super) const MAX_TIME_WITHOUT_YIELD: Duration = Duration::from_micros(100);

/// One unit of work.
pub(super) enum Work {
    Request(Request),
    /// Requests are no longer served alone.
    Resume,
    /// What has come of an event on a port.
    Inputs(Vec<Input>),
    /// A write to the backing directory has ended.
    Stored(WriteResult),
    /// Virtual time jumps, because every host is silent.
    Jump(Time),
    /// The wake time has come.
    Tick,
    /// The clock checks whether the process was stopped.
    ClockCheck,
}

/// Which port is polled next, what waits for the ports, and how long the driver has worked.
#[derive(Default)]
pub(super) struct Rotation {
    port: usize,
    /// A request, or a jump of time.
    held: Option<Held>,
    /// Since when other tasks had no turn; `None` if nothing had work at the last poll.
    working_since: Option<Instant>,
}

/// Work before which the ports are drained: what hosts have sent is handled first. A test that sends a command and then
/// moves the clock expects this order, although the two arrive on different connections.
pub(super) struct Held {
    work: Work,
    begun: Instant,
    served: BTreeSet<Port>,
    portions_left: u32,
}

impl Held {
    /// Notes that a port was served. Each port with data is served once, and again only for a short time: a host that
    /// sends without pause does not delay the work further. `None` if the work is void: time does not pass a host that has
    /// sent something.
    fn after(mut self, port: Port) -> Option<Held> {
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
    /// Keeps work until the ports are drained.
    pub(super) fn hold(&mut self, work: Work) {
        self.held = Some(Held {
            work,
            begun: Instant::now(),
            served: BTreeSet::new(),
            portions_left: MAX_DRAINED_PORTIONS,
        });
    }

    /// Time does not jump: somebody else had work.
    pub(super) fn forget_jump(&mut self) {
        self.held.take_if(|held| matches!(held.work, Work::Jump(_)));
    }
}

impl Driver {
    /// Runs the loop until `stop` completes.
    pub(super) async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let (mut stop, mut timer) = (pin!(stop), WakeTimer::default());
        loop {
            let wake = self.wake(self.cell.controller.host_is_silent());
            let beats = self.edge.clock.gap_check_interval();
            let fine = self.edge.clock.needs_fine_timer();
            // The order matters: `auto` may jump only when there is no other work.
            let work = tokio::select! {
                biased;
                () = &mut stop => break,
                // Without the budget of the runtime, which would hide what has arrived: the loop yields by itself.
                work = unconstrained(poll_fn(|context| self.poll_work(context))) => work,
                () = timer.sleep(wake, fine) => Work::Tick,
                () = clock_check(beats) => Work::ClockCheck,
            };
            self.skip_gap();
            if let (Work::Tick, Wake::JumpAfter(_)) = (&work, wake)
                && let Some(target) = self.jump_target()
            {
                self.rotation.hold(Work::Jump(target));
            } else if let Work::Inputs(_) = work {
                // The system is asked once what time it is, not at every step of a request.
                self.edge.clock.hold(Some(Instant::now()));
                self.perform(work).await;
                self.edge.clock.hold(None);
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

    pub(super) fn skip_gap(&mut self) {
        if let Some(missed) = self.edge.clock.skip_gap() {
            warn!("the emulator was stopped for {missed:.1?}: skipped (`skipped` of /clock)");
        }
    }

    /// Does one unit of work.
    pub(super) async fn perform(&mut self, work: Work) {
        match work {
            Work::Request(request) => self.serve_request(request).await,
            Work::Resume => {
                self.exclusive = None;
                // Robots that share their time go on together.
                if !self.edge.shares_time {
                    self.edge.clock.hold(None);
                }
            }
            Work::Inputs(inputs) => {
                self.edge.clock.note_activity();
                inputs.into_iter().for_each(|input| self.feed(input));
            }
            Work::Stored(written) => self.stored(written),
            Work::Jump(deadline) => {
                self.edge.clock.jump(deadline);
                self.feed(Input::Tick);
            }
            Work::Tick => self.feed(Input::Tick),
            Work::ClockCheck => {}
        }
    }

    /// The next request, while nothing else is served.
    pub(super) fn poll_request(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        if let Some(held) = self.rotation.held.take() {
            return Poll::Ready(held.work);
        }
        match self.requests.poll_recv(context) {
            Poll::Ready(Some(request)) => Poll::Ready(Work::Request(request)),
            Poll::Ready(None) | Poll::Pending => Poll::Pending,
        }
    }

    /// The next unit of work. While a write is under way, requests that only read are served, and nothing else.
    pub(super) fn poll_work(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        let rotation = &mut self.rotation;
        rotation.working_since.get_or_insert_with(Instant::now);
        let storing = self.edge.write.is_some();
        if let Some(write) = &mut self.edge.write
            && let Poll::Ready(written) = Pin::new(&mut write.task).poll(context)
        {
            return Poll::Ready(Work::Stored(written));
        }
        if let Some(requests) = self.exclusive.as_mut().filter(|_| !storing) {
            let next = requests.poll_recv(context);
            return next.map(|next| next.map_or(Work::Resume, Work::Request));
        }
        // Ends when nobody can send requests any more.
        if rotation.held.is_none()
            && let Poll::Ready(Some(request)) = self.requests.poll_recv(context)
        {
            if storing && matches!(request, Request::Query(_)) {
                return Poll::Ready(Work::Request(request));
            }
            rotation.hold(Work::Request(request));
        }
        let drains = rotation.held.is_some();
        let drained = rotation.held.as_ref().is_some_and(|held| held.portions_left == 0);
        let turns = if drained || storing { 0 } else { Port::ALL.len() };
        for turn in 0..turns {
            let index = (rotation.port + turn) % Port::ALL.len();
            let Some(&port) = Port::ALL.get(index) else {
                continue;
            };
            // Before other work the system itself is asked, so that nothing that has arrived is overlooked.
            let runtime = (!drains).then_some(&mut *context);
            let polled = match self.edge.channels.get_mut(port) {
                Some(channel) => channel.poll(READ_BUFFER, runtime),
                None => self.edge.serial_lines.poll(port, &self.cell.controller, runtime),
            };
            if let Poll::Ready(mut inputs) = polled {
                rotation.port = index + 1;
                rotation.held = rotation.held.take().and_then(|held| held.after(port));
                if inputs.iter().any(|input| matches!(input, Input::Received { .. })) {
                    let mut arrived = self.edge.channels.accept_arrived();
                    arrived.extend(self.edge.serial_lines.open_arrived());
                    inputs.splice(..0, arrived);
                }
                return Poll::Ready(Work::Inputs(inputs));
            }
        }
        match rotation.held.take_if(|_| !storing) {
            Some(held) => Poll::Ready(held.work),
            None => {
                rotation.working_since = None;
                Poll::Pending
            }
        }
    }
}

pub(super) async fn clock_check(beats: Option<Duration>) {
    match beats {
        None => std::future::pending().await,
        Some(pause) => tokio::time::sleep(pause).await,
    }
}

/// The timer of a loop. It may be set too early: each request moves what is due next, and to set a timer anew costs more
/// than to look again when it has run out.
#[derive(Default)]
pub(super) struct WakeTimer(Option<Pin<Box<Sleep>>>);

impl WakeTimer {
    /// Sleeps until then; `fine` when a fraction of a millisecond matters.
    pub(super) async fn sleep(&mut self, wake: Wake, fine: bool) {
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
