//! The loop of the hub: what has come, one thing at a time, from each source in turn; and time, when nothing has come.

use super::Driver;
use super::request::Request;
use crate::clock::Wake;
use crate::serial::LineMessage;
use crate::snapshot::handle::SnapshotRequest;
use crate::tcp::LinkMessage;
use std::collections::BTreeSet;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};
use tokio::task::yield_now;
use tracing::warn;
use ts3100_controller::input::Input;

/// Turns the other tasks get before time jumps: the runtime looks at its sockets in each, a link task reads
/// in the next, and its message is there in the one behind.
const TURNS_BEFORE_A_JUMP: u32 = 3;
/// Turns that the links get before a request is served, so that what has come to the sockets before it is read.
const TURNS_TO_HEAR: u32 = 3;
/// Most portions that are served before a request, in each of these turns.
const PORTIONS_HEARD: u32 = 64;
/// Longest time for which more than one portion of a port is served then.
const HEARING: Duration = Duration::from_micros(100);
/// Longest time for which the hub works without giving the tasks of the ports and of the control interface a turn.
const STRETCH: Duration = Duration::from_micros(100);

/// Something to be done.
enum Work {
    Request(Request),
    Order(SnapshotRequest),
    Link(LinkMessage),
    Line(LineMessage),
    /// Something is due.
    Time,
    /// The clock wants to be looked at.
    Beat,
}

/// Whose turn it is, and since when others have had none.
pub(super) struct SourceTurns {
    next: usize,
    since: Instant,
    /// Nothing was to be done at the last look.
    idle: bool,
}

impl Default for SourceTurns {
    fn default() -> SourceTurns {
        SourceTurns {
            next: 0,
            since: Instant::now(),
            idle: true,
        }
    }
}

type Source = fn(&mut Driver, &mut Context<'_>) -> Poll<Option<Work>>;

/// Where work comes from. Those who ask may end; the links and lines never do.
const SOURCES: [Source; 4] = [
    |hub, context| {
        hub.requests
            .poll_recv(context)
            .map(|request| request.map(Work::Request))
    },
    |hub, context| hub.orders.poll_recv(context).map(|order| order.map(Work::Order)),
    |hub, context| {
        hub.links
            .poll_next(context)
            .map(|message| Some(Work::Link(message)))
    },
    |hub, context| {
        hub.lines
            .poll_next(context)
            .map(|message| Some(Work::Line(message)))
    },
];

impl Driver {
    /// Serves until `stop` is ready.
    pub(super) async fn serve(&mut self, stop: impl Future<Output = ()>) {
        let mut stop = pin!(stop);
        loop {
            let (wake, deadline) = self.next_wake();
            let beats = self.clock.beats();
            // In this order: `auto` may jump only when nothing else is there to be done.
            let work = tokio::select! {
                biased;
                () = &mut stop => break,
                work = poll_fn(|context| self.poll_work(context)) => work,
                () = sleep(wake) => Work::Time,
                () = beat(beats) => Work::Beat,
            };
            if let Some(missed) = self.clock.beat() {
                warn!("the emulator was stopped for {missed:.1?}: skipped (`skipped` of /clock)");
            }
            if let (Work::Time, Wake::JumpAfter(_), Some(deadline)) = (&work, wake, deadline) {
                self.clock.jump(deadline);
            }
            self.work(work).await;
        }
    }

    fn poll_work(&mut self, context: &mut Context<'_>) -> Poll<Work> {
        for _ in SOURCES {
            let source = SOURCES.get(self.rota.next);
            self.rota.next = (self.rota.next + 1) % SOURCES.len();
            if let Some(Poll::Ready(Some(work))) = source.map(|poll| poll(self, context)) {
                if std::mem::take(&mut self.rota.idle) {
                    self.rota.since = Instant::now();
                }
                return Poll::Ready(work);
            }
        }
        self.rota.idle = true;
        Poll::Pending
    }

    async fn work(&mut self, work: Work) {
        match work {
            Work::Request(request) => {
                self.drain_links().await;
                self.serve_request(request).await;
            }
            Work::Order(order) => {
                self.drain_links().await;
                self.serve_snapshot_request(order).await;
            }
            Work::Link(message) => self.take_link(message).await,
            Work::Line(message) => self.take_line(message).await,
            Work::Time => self.feed(Input::Tick).await,
            Work::Beat => {}
        }
        if self.rota.since.elapsed() > STRETCH {
            yield_now().await;
            self.rota.since = Instant::now();
        }
    }

    async fn take_link(&mut self, message: LinkMessage) {
        self.clock.note_activity();
        for input in self.links.take(message) {
            self.feed(input).await;
        }
    }

    async fn take_line(&mut self, message: LineMessage) {
        self.clock.note_activity();
        if let Some(input) = self.lines.take(message) {
            self.feed(input).await;
        }
    }

    /// What hosts have sent is served before what somebody asks for at the side: a test that sends a command and then
    /// moves the clock means them in this order, though they come by two connections. Each port that has something is
    /// heard in each turn; a host that never ends is left where others wait for it.
    async fn drain_links(&mut self) {
        let mut context = Context::from_waker(Waker::noop());
        for _ in 0..TURNS_TO_HEAR {
            yield_now().await;
            let begun = Instant::now();
            let mut heard = BTreeSet::new();
            for _ in 0..PORTIONS_HEARD {
                let (link, line) = (
                    self.links.poll_next(&mut context),
                    self.lines.poll_next(&mut context),
                );
                let mut again = false;
                if let Poll::Ready(message) = link {
                    again |= !heard.insert(message.port());
                    self.take_link(message).await;
                } else if line.is_pending() {
                    break;
                }
                if let Poll::Ready(message) = line {
                    again |= !heard.insert(message.port());
                    self.take_line(message).await;
                }
                if again && begun.elapsed() > HEARING {
                    break;
                }
            }
        }
    }
}

async fn beat(beats: Option<Duration>) {
    match beats {
        None => std::future::pending().await,
        Some(pause) => tokio::time::sleep(pause).await,
    }
}

async fn sleep(wake: Wake) {
    match wake {
        Wake::Never => std::future::pending().await,
        // Something is due already, but the links get their turn.
        Wake::After(duration) if duration.is_zero() => yield_now().await,
        Wake::JumpAfter(duration) if duration.is_zero() => {
            for _ in 0..TURNS_BEFORE_A_JUMP {
                yield_now().await;
            }
        }
        Wake::After(duration) | Wake::JumpAfter(duration) => tokio::time::sleep(duration).await,
    }
}
