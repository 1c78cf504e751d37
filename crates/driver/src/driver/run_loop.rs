//! The loop of the driver: it takes work from requests, TCP channels and serial lines in rotation, and lets time pass when
//! there is none.
//!
//! What the work means is handled elsewhere: requests in `control` and `snapshots`, inputs in `Driver::feed`. When to wake
//! is decided by [`crate::clock::Clock`].

use super::Driver;
use super::request::Request;
use crate::clock::Wake;
use crate::serial::SerialMessage;
use std::collections::BTreeSet;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};
use tokio::task::yield_now;
use tracing::warn;
use ts3100_controller::input::Input;

/// Yields in which the tasks of serial lines, of the control interface and of the process's signals can report what they
/// have received: the runtime polls its sources in the first, a task reads in the second, and its message is queued in the
/// third. The channels need none; the driver reads them itself.
const YIELDS_TO_TASKS: u32 = 3;
/// Most portions of bytes that are handled in each round before a request.
const MAX_DRAINED_PORTIONS: u32 = 64;
/// Time after which no second portion of the same port is handled before a request.
const DRAIN_TIME: Duration = Duration::from_micros(100);
/// Longest time the driver works without yielding to other tasks.
const MAX_TIME_WITHOUT_YIELD: Duration = Duration::from_micros(100);
/// Requests, channels, serial lines.
const SOURCES: usize = 3;

/// One unit of work.
enum Work {
    Request(Request),
    /// What has come of an event on a channel.
    Channel(Vec<Input>),
    Serial(SerialMessage),
    /// The wake time has come.
    Tick,
    /// The clock checks whether the process was stopped.
    ClockCheck,
}

/// Which source is polled next, and when the driver last yielded.
pub(super) struct SourceRotation {
    next: usize,
    last_yield: Instant,
    /// No source had work at the last poll.
    idle: bool,
}

impl Default for SourceRotation {
    fn default() -> SourceRotation {
        SourceRotation {
            next: 0,
            last_yield: Instant::now(),
            idle: true,
        }
    }
}

impl Driver {
    /// Runs the loop until `stop` completes.
    pub(super) async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            let (wake, deadline) = self.next_wake();
            let beats = self.edge.clock.gap_check_interval();
            // The order matters: `auto` may jump only when there is no other work.
            let work = tokio::select! {
                biased;
                () = &mut stop => break,
                work = poll_fn(|context| self.poll_work(context)) => work,
                () = sleep(wake) => Work::Tick,
                () = clock_check(beats) => Work::ClockCheck,
            };
            if let Some(missed) = self.edge.clock.skip_gap() {
                warn!("the emulator was stopped for {missed:.1?}: skipped (`skipped` of /clock)");
            }
            if let (Work::Tick, Wake::JumpAfter(_), Some(deadline)) = (&work, wake, deadline) {
                // Time does not pass a host that has sent something.
                if self.drain_once() {
                    continue;
                }
                self.edge.clock.jump(deadline);
            }
            self.do_work(work).await;
        }
    }

    fn poll_work(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        for _ in 0..SOURCES {
            let source = self.rotation.next;
            self.rotation.next = (source + 1) % SOURCES;
            let work = match source {
                // Ends when nobody can send requests any more.
                0 => match self.requests.poll_recv(context) {
                    Poll::Ready(Some(request)) => Poll::Ready(Work::Request(request)),
                    Poll::Ready(None) | Poll::Pending => Poll::Pending,
                },
                1 => {
                    let inputs = self.edge.channels.poll_next(Some(context));
                    inputs.map(|(_, inputs)| Work::Channel(inputs))
                }
                _ => self.edge.serial_lines.poll_next(context).map(Work::Serial),
            };
            if work.is_ready() {
                if std::mem::take(&mut self.rotation.idle) {
                    self.rotation.last_yield = Instant::now();
                }
                return work;
            }
        }
        self.rotation.idle = true;
        Poll::Pending
    }

    async fn do_work(&mut self, work: Work) {
        match work {
            Work::Request(request) => {
                self.drain_links().await;
                self.serve_request(request);
            }
            Work::Channel(inputs) => self.feed_received(inputs),
            Work::Serial(message) => {
                let input = self.edge.serial_lines.handle_message(message);
                self.feed_received(input);
            }
            Work::Tick => self.feed(Input::Tick),
            Work::ClockCheck => {}
        }
        if self.rotation.last_yield.elapsed() > MAX_TIME_WITHOUT_YIELD {
            yield_now().await;
            self.rotation.last_yield = Instant::now();
        }
    }

    fn feed_received(&mut self, inputs: impl IntoIterator<Item = Input>) {
        self.edge.clock.note_activity();
        for input in inputs {
            self.feed(input);
        }
    }

    /// Handles what hosts have sent before a request is served. A test that sends a command and then moves the
    /// clock expects this order, although the two arrive on different connections.
    async fn drain_links(&mut self) {
        self.drain_once();
        if self.edge.serial_lines.is_open() {
            for _ in 0..YIELDS_TO_TASKS {
                yield_now().await;
                self.drain_once();
            }
        }
    }

    /// Each port with data is served once, and again only for a short time: a host that sends without pause does not
    /// delay the request further. Whether anything was served.
    fn drain_once(&mut self) -> bool {
        let mut context = Context::from_waker(Waker::noop());
        let begun = Instant::now();
        let mut served_ports = BTreeSet::new();
        for _ in 0..MAX_DRAINED_PORTIONS {
            let mut again = false;
            let (channel, line) = (
                self.edge.channels.poll_next(None),
                self.edge.serial_lines.poll_next(&mut context),
            );
            if channel.is_pending() && line.is_pending() {
                break;
            }
            if let Poll::Ready((port, inputs)) = channel {
                again |= !served_ports.insert(port);
                self.feed_received(inputs);
            }
            if let Poll::Ready(message) = line {
                again |= !served_ports.insert(message.port());
                let input = self.edge.serial_lines.handle_message(message);
                self.feed_received(input);
            }
            if again && begun.elapsed() > DRAIN_TIME {
                break;
            }
        }
        !served_ports.is_empty()
    }
}

async fn clock_check(beats: Option<Duration>) {
    match beats {
        None => std::future::pending().await,
        Some(pause) => tokio::time::sleep(pause).await,
    }
}

async fn sleep(wake: Wake) {
    match wake {
        Wake::Never => std::future::pending().await,
        // Something is due already, but other tasks get one turn.
        Wake::After(duration) if duration.is_zero() => yield_now().await,
        Wake::JumpAfter(duration) if duration.is_zero() => {
            for _ in 0..YIELDS_TO_TASKS {
                yield_now().await;
            }
        }
        Wake::After(duration) | Wake::JumpAfter(duration) => tokio::time::sleep(duration).await,
    }
}
