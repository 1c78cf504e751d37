//! `/events`: what happens, as it happens, as Server-Sent Events. A reader that is slow is told what it missed; it
//! never makes the emulator wait.

use super::body::InQuery;
use super::event::ApiEvent;
use super::handle::Handle;
use super::journal::Journal;
use super::listener::{Busy, Place};
use super::problem::Problem;
use super::table::Table;
use axum::extract::{ConnectInfo, State};
use axum::http::StatusCode;
use axum::response::Sse;
use axum::response::sse::{Event, KeepAlive};
use futures_core::Stream;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use tokio::sync::{OwnedSemaphorePermit, watch};
use utoipa::IntoParams;

/// Events taken out of the journal at once.
const BATCH: usize = 64;

/// Which events.
#[derive(Debug, Clone, Copy, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct Which {
    /// Number of the first event wanted; 1 for all that are kept. Without it those from now on.
    since: Option<u64>,
    /// End the stream after so many events.
    #[param(minimum = 1)]
    count: Option<u64>,
}

/// How many events a reader was too late for.
#[derive(Debug, Clone, Copy, Serialize)]
struct Missed {
    missed: u64,
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group("events", "What happens, as it happens.")
        .call::<__path_get_events, _, _>(get_events)
}

/// What happens, as it happens: Server-Sent Events
///
/// Each is a JSON document named as its `event`, with its number as id. A reader that is too slow finds an event `missed`
/// with the number of those that are no longer kept. With the header `Last-Event-ID` the stream goes on behind that.
#[utoipa::path(get, path = "/events", params(Which),
    responses((status = 200, body = ApiEvent, content_type = "text/event-stream")))]
async fn get_events(
    State(hub): State<Handle>,
    ConnectInfo(place): ConnectInfo<Place>,
    headers: axum::http::HeaderMap,
    InQuery(which): InQuery<Which>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let permit = Arc::clone(&hub.streams).try_acquire_owned().map_err(|_| {
        let expected = format!("at most {} streams of events", super::handle::MAX_STREAMS);
        Problem::at(
            StatusCode::SERVICE_UNAVAILABLE,
            "events",
            expected,
            "as many already",
        )
    })?;
    if which.count == Some(0) {
        return Err(Problem::at(StatusCode::BAD_REQUEST, "count", "1 or more", "0"));
    }
    let last = headers.get("last-event-id").and_then(|id| id.to_str().ok());
    let behind_last = last.and_then(|id| id.parse::<u64>().ok()?.checked_add(1));
    let next = which.since.or(behind_last);
    let stream = Events {
        next: next.unwrap_or_else(|| hub.journal.next_number()),
        left: which.count,
        waiting: VecDeque::new(),
        watch: Some(hub.journal.watch()),
        changing: None,
        journal: hub.journal,
        _permit: permit,
        _busy: place.busy(),
    };
    Ok(Sse::new(stream).keep_alive(KeepAlive::default()))
}

type Changing = Pin<Box<dyn Future<Output = Option<watch::Receiver<u64>>> + Send>>;

/// The events of one reader.
struct Events {
    journal: Arc<Journal>,
    next: u64,
    left: Option<u64>,
    waiting: VecDeque<Event>,
    watch: Option<watch::Receiver<u64>>,
    changing: Option<Changing>,
    _permit: OwnedSemaphorePermit,
    _busy: Busy,
}

fn line(happening: &ApiEvent) -> Event {
    let event = Event::default()
        .event(happening.event)
        .id(happening.seq.to_string());
    // A document of words and numbers can always be written.
    event.json_data(happening).unwrap_or_default()
}

impl Events {
    fn refill(&mut self) {
        let most = self
            .left
            .map_or(BATCH, |left| usize::try_from(left).unwrap_or(BATCH).min(BATCH));
        let extract = self.journal.extract(self.next, most);
        if extract.missed > 0 {
            let missed = Missed {
                missed: extract.missed,
            };
            let event = Event::default().event("missed");
            self.waiting
                .push_back(event.json_data(missed).unwrap_or_default());
        }
        self.waiting
            .extend(extract.events.iter().map(|happening| line(happening)));
        if let Some(left) = &mut self.left {
            *left = left.saturating_sub(extract.events.len() as u64);
        }
        self.next = extract.next;
    }
}

impl Stream for Events {
    type Item = Result<Event, Infallible>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        loop {
            if let Some(event) = self.waiting.pop_front() {
                return Poll::Ready(Some(Ok(event)));
            }
            if self.left == Some(0) {
                return Poll::Ready(None);
            }
            if let Some(changing) = &mut self.changing {
                let watch = ready!(changing.as_mut().poll(context));
                self.changing = None;
                let Some(watch) = watch else {
                    return Poll::Ready(None);
                };
                self.watch = Some(watch);
            }
            // Seen before it is read: what comes in between is not missed.
            if let Some(watch) = &mut self.watch {
                watch.borrow_and_update();
            }
            self.refill();
            if self.waiting.is_empty() {
                let Some(mut watch) = self.watch.take() else {
                    return Poll::Ready(None);
                };
                self.changing = Some(Box::pin(async move {
                    let changed = watch.changed().await;
                    changed.ok().map(|()| watch)
                }));
            }
        }
    }
}
