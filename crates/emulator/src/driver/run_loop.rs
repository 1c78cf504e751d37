//! The loop of the driver: it takes work from four sources in rotation (requests, snapshot requests, TCP channels, serial
//! lines) and lets time pass when there is none.
//!
//! What the work means is handled elsewhere: requests in `control` and `snapshots`, inputs in `Driver::feed`. When to wake
//! is decided by [`crate::clock::Clock`].

use super::Driver;
use super::request::Request;
use crate::clock::Wake;
use crate::serial::SerialMessage;
use crate::snapshot::handle::SnapshotRequest;
use crate::tcp::ChannelMessage;
use std::collections::BTreeSet;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};
use tokio::task::yield_now;
use tracing::warn;
use ts3100_controller::input::Input;

/// Yields before virtual time jumps. The runtime polls its sockets in the first, a connection task reads in the
/// second, and its message is queued in the third.
const YIELDS_BEFORE_JUMP: u32 = 3;
/// Yields before a request is served, so that bytes that reached a socket before the request are read first.
const YIELDS_BEFORE_REQUEST: u32 = 3;
/// Most portions of bytes that are handled in each of these yields.
const MAX_DRAINED_PORTIONS: u32 = 64;
/// Time after which no second portion of the same port is handled before a request.
const DRAIN_TIME: Duration = Duration::from_micros(100);
/// Longest time the driver works without yielding to the tasks of the ports and of the control interface.
const MAX_TIME_WITHOUT_YIELD: Duration = Duration::from_micros(100);

/// One unit of work.
enum Work {
    Request(Request),
    Snapshot(SnapshotRequest),
    Channel(ChannelMessage),
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

type Source = fn(&mut Driver, &mut Context<'_>) -> Poll<Option<Work>>;

/// Sources of work. The request queues can end; channels and serial lines never do.
const SOURCES: [Source; 4] = [
    |driver, context| {
        driver
            .requests
            .poll_recv(context)
            .map(|request| request.map(Work::Request))
    },
    |driver, context| {
        driver
            .snapshot_requests
            .poll_recv(context)
            .map(|request| request.map(Work::Snapshot))
    },
    |driver, context| {
        driver
            .channels
            .poll_next(context)
            .map(|message| Some(Work::Channel(message)))
    },
    |driver, context| {
        driver
            .serial_lines
            .poll_next(context)
            .map(|message| Some(Work::Serial(message)))
    },
];

impl Driver {
    /// Runs the loop until `stop` completes.
    pub(super) async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            let (wake, deadline) = self.next_wake();
            let beats = self.clock.gap_check_interval();
            // The order matters: `auto` may jump only when there is no other work.
            let work = tokio::select! {
                biased;
                () = &mut stop => break,
                work = poll_fn(|context| self.poll_work(context)) => work,
                () = sleep(wake) => Work::Tick,
                () = clock_check(beats) => Work::ClockCheck,
            };
            if let Some(missed) = self.clock.skip_gap() {
                warn!("the emulator was stopped for {missed:.1?}: skipped (`skipped` of /clock)");
            }
            if let (Work::Tick, Wake::JumpAfter(_), Some(deadline)) = (&work, wake, deadline) {
                self.clock.jump(deadline);
            }
            self.do_work(work).await;
        }
    }

    fn poll_work(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        for _ in SOURCES {
            let source = SOURCES.get(self.rotation.next);
            self.rotation.next = (self.rotation.next + 1) % SOURCES.len();
            if let Some(Poll::Ready(Some(work))) = source.map(|poll| poll(self, context)) {
                if std::mem::take(&mut self.rotation.idle) {
                    self.rotation.last_yield = Instant::now();
                }
                return Poll::Ready(work);
            }
        }
        self.rotation.idle = true;
        Poll::Pending
    }

    async fn do_work(&mut self, work: Work) {
        match work {
            Work::Request(request) => {
                self.drain_links().await;
                self.serve_request(request).await;
            }
            Work::Snapshot(request) => {
                self.drain_links().await;
                self.serve_snapshot_request(request).await;
            }
            Work::Channel(message) => self.handle_channel_message(message).await,
            Work::Serial(message) => self.handle_serial_message(message).await,
            Work::Tick => self.feed(Input::Tick).await,
            Work::ClockCheck => {}
        }
        if self.rotation.last_yield.elapsed() > MAX_TIME_WITHOUT_YIELD {
            yield_now().await;
            self.rotation.last_yield = Instant::now();
        }
    }

    async fn handle_channel_message(&mut self, message: ChannelMessage) {
        self.clock.note_activity();
        for input in self.channels.handle_message(message) {
            self.feed(input).await;
        }
    }

    async fn handle_serial_message(&mut self, message: SerialMessage) {
        self.clock.note_activity();
        if let Some(input) = self.serial_lines.handle_message(message) {
            self.feed(input).await;
        }
    }

    /// Handles what hosts have sent before a request is served. A test that sends a command and then moves the
    /// clock expects this order, although the two arrive on different connections. Each port with data is
    /// served in each round; a host that sends without pause does not delay the request further.
    async fn drain_links(&mut self) {
        let mut context = Context::from_waker(Waker::noop());
        for _ in 0..YIELDS_BEFORE_REQUEST {
            yield_now().await;
            let begun = Instant::now();
            let mut served_ports = BTreeSet::new();
            for _ in 0..MAX_DRAINED_PORTIONS {
                let (link, line) = (
                    self.channels.poll_next(&mut context),
                    self.serial_lines.poll_next(&mut context),
                );
                let mut again = false;
                if let Poll::Ready(message) = link {
                    again |= !served_ports.insert(message.port());
                    self.handle_channel_message(message).await;
                } else if line.is_pending() {
                    break;
                }
                if let Poll::Ready(message) = line {
                    again |= !served_ports.insert(message.port());
                    self.handle_serial_message(message).await;
                }
                if again && begun.elapsed() > DRAIN_TIME {
                    break;
                }
            }
        }
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
        // Something is due already, but the connection tasks get one turn.
        Wake::After(duration) if duration.is_zero() => yield_now().await,
        Wake::JumpAfter(duration) if duration.is_zero() => {
            for _ in 0..YIELDS_BEFORE_JUMP {
                yield_now().await;
            }
        }
        Wake::After(duration) | Wake::JumpAfter(duration) => tokio::time::sleep(duration).await,
    }
}
