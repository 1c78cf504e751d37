//! `/events`: the stream of events, as Server-Sent Events.
//!
//! A slow reader is told how many events it missed; it never makes the emulator wait. The events are kept in
//! [`super::journal`] and described in [`super::event`].

use super::body::Query;
use super::event::NumberedEvent;
use super::handle::MAX_STREAMS;
use super::journal::Journal;
use super::listener::{ConnectionInfo, RequestGuard};
use super::resource::{Deserialize, Handle, Problem, call};
use axum::extract::ConnectInfo;
use axum::http::StatusCode;
use axum::response::Sse;
use axum::response::sse::{Event, KeepAlive};
use futures_util::stream::{Stream, unfold};
use serde_json::json;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::pending;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio::time::{Instant, sleep_until};

/// Events taken out of the journal at once.
const BATCH: usize = 64;
/// Time after which a stream with the state has a comment, at the latest.
const STATE_KEEP_ALIVE: Duration = Duration::from_secs(5);
/// Shortest time between two events `changed`.
const CHANGE_PAUSE: Duration = Duration::from_millis(50);

/// Selection of events.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::IntoParams), into_params(parameter_in = Query))]
#[serde(deny_unknown_fields)]
pub struct EventsQuery {
    /// Number of the first event; 1 for all events in memory. Default: only new ones.
    since: Option<u64>,
    /// End the stream after this many events.
    #[cfg_attr(test, param(minimum = 1))]
    count: Option<u64>,
    /// Also send an event `changed`, without a number, when the state may have changed; at most 20 a second.
    #[serde(default)]
    #[cfg_attr(test, param(default = false))]
    state: bool,
}

call! {
    /// Stream events as Server-Sent Events
    ///
    /// Each event is a JSON document; its number is the id. A reader that is too slow gets an event `missed` with the
    /// number of events it missed. With `state` an event `changed` tells when to read `/state` again: a page or a monitor
    /// then asks for nothing while nothing happens. With the header `Last-Event-ID` the stream continues after that event.
    get_events = get("/events",
        params(EventsQuery),
        responses((status = 200, description = "One event after the other, until `count` or the end of the connection.",
            body = crate::event::ApiEvent, content_type = "text/event-stream")))
}
pub async fn get_events(
    handle: Handle,
    ConnectInfo(connection): ConnectInfo<ConnectionInfo>,
    headers: axum::http::HeaderMap,
    Query(query): Query<EventsQuery>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let permit = Arc::clone(&handle.streams).try_acquire_owned().map_err(|_| {
        let expected = format!("at most {} streams of events", MAX_STREAMS);
        let status = StatusCode::SERVICE_UNAVAILABLE;
        let told = format!("cannot open another stream of events: {MAX_STREAMS} are open, the most");
        Problem::expected_found(status, "events", expected, "as many already").told(told)
    })?;
    if query.count == Some(0) {
        return Err(Problem::unreadable("count", "1 or more", "0"));
    }
    let last = headers.get("last-event-id").and_then(|id| id.to_str().ok());
    let after_last = last.and_then(|id| id.parse::<u64>().ok()?.checked_add(1));
    let next = query.since.or(after_last);
    let reader = EventReader {
        next: next.unwrap_or_else(|| handle.journal.next_number()),
        left: query.count,
        ready: VecDeque::new(),
        watch: handle.journal.watch(),
        changes: query.state.then(|| StateChanges::new(&handle.journal)),
        journal: handle.journal,
        _permit: permit,
        _busy: connection.begin_request(),
    };
    let stream = unfold(reader, |mut reader| async {
        let event = reader.next_event().await?;
        Some((Ok(event), reader))
    });
    let keep_alive = match query.state {
        // Whoever shows a state wants to know soon that nothing comes any more.
        true => KeepAlive::new().interval(STATE_KEEP_ALIVE),
        false => KeepAlive::default(),
    };
    Ok(Sse::new(stream).keep_alive(keep_alive))
}

/// The events of one reader.
struct EventReader {
    journal: Arc<Journal>,
    next: u64,
    left: Option<u64>,
    ready: VecDeque<Event>,
    watch: watch::Receiver<u64>,
    changes: Option<StateChanges>,
    _permit: OwnedSemaphorePermit,
    _busy: RequestGuard,
}

/// Changes of the state, for a reader that wants to be told.
struct StateChanges {
    watch: watch::Receiver<u64>,
    /// When it may be told again.
    next: Instant,
}

impl StateChanges {
    fn new(journal: &Journal) -> StateChanges {
        StateChanges {
            watch: journal.watch_state(),
            next: Instant::now(),
        }
    }

    /// Waits for a change. Nothing is lost when the wait is given up.
    async fn next(changes: &mut Option<StateChanges>) {
        let Some(changes) = changes else {
            return pending().await;
        };
        sleep_until(changes.next).await;
        if changes.watch.changed().await.is_err() {
            return pending().await;
        }
        changes.next = Instant::now() + CHANGE_PAUSE;
    }
}

/// The key by which a document says what kind of event it is.
#[derive(Deserialize)]
struct Tag<'a> {
    event: &'a str,
}

fn sse_event(event: &NumberedEvent) -> Event {
    // A document of words and numbers can always be written, and its tag is one word.
    let document = serde_json::to_string(event).unwrap_or_default();
    let kind = serde_json::from_str(&document).map_or("", |Tag { event }| event);
    Event::default()
        .event(kind)
        .id(event.seq.to_string())
        .data(&document)
}

impl EventReader {
    fn refill(&mut self) {
        let most = self
            .left
            .map_or(BATCH, |left| usize::try_from(left).unwrap_or(BATCH).min(BATCH));
        let batch = self.journal.events_from(self.next, most);
        if batch.missed > 0 {
            let event = Event::default().event("missed");
            let missed = event.json_data(json!({ "missed": batch.missed }));
            self.ready.push_back(missed.unwrap_or_default());
        }
        self.ready.extend(batch.events.iter().map(sse_event));
        if let Some(left) = &mut self.left {
            *left = left.saturating_sub(batch.events.len() as u64);
        }
        self.next = batch.next;
    }

    /// Waits for the next event; `None` at the end of the stream.
    async fn next_event(&mut self) -> Option<Event> {
        while self.ready.is_empty() {
            if self.left == Some(0) {
                return None;
            }
            // Seen before it is read: what comes in between is not missed.
            self.watch.borrow_and_update();
            self.refill();
            if self.ready.is_empty() {
                tokio::select! {
                    changed = self.watch.changed() => changed.ok()?,
                    () = StateChanges::next(&mut self.changes) => {
                        self.ready.push_back(Event::default().event("changed").data("{}"));
                    }
                }
            }
        }
        self.ready.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::ApiEvent;
    use crate::event::JournalEvent;
    use crate::every_event::{bless, compare, inputs, moment, outputs};
    use crate::journal::{JournalWriter, KEPT_EVENTS};
    use axum::body::to_bytes;
    use axum::response::IntoResponse as _;
    use futures_util::stream::iter;
    use tokio::time::timeout;
    use ts3100_controller::Time;
    use ts3100_driver::seat::{Side, Subscriber as _};
    use utoipa::PartialSchema as _;

    const STREAM: &str = "stream.sse";
    const FINDINGS: &str = "findings.json";

    /// The journal of every event.
    fn journal() -> Journal {
        let journal = Arc::new(Journal::new(KEPT_EVENTS, Arc::default()));
        let mut writer = JournalWriter::new(Arc::clone(&journal));
        for (place, input) in inputs().iter().enumerate() {
            writer.input(moment(place), input, Side::Host);
        }
        for (place, output) in outputs().iter().enumerate() {
            writer.output(moment(place), output);
        }
        journal.note(moment(0), JournalEvent::Restored);
        journal.note(Time::ZERO, JournalEvent::Reset);
        drop(writer);
        Arc::into_inner(journal).unwrap()
    }

    /// Every event as it comes out of the interface.
    fn stream() -> String {
        let batch = journal().events_from(1, usize::MAX);
        let events: Vec<_> = batch
            .events
            .iter()
            .map(|event| Ok::<_, Infallible>(sse_event(event)))
            .collect();
        let body = Sse::new(iter(events)).into_response().into_body();
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let bytes = runtime.block_on(to_bytes(body, usize::MAX)).unwrap();
        String::from_utf8(bytes.into()).unwrap()
    }

    fn findings() -> String {
        serde_json::to_string(&journal().findings()).unwrap() + "\n"
    }

    #[test]
    fn every_event_has_its_document() {
        compare(STREAM, &stream());
        compare(FINDINGS, &findings());
    }

    #[test]
    fn the_schema_has_every_key() {
        let schema = serde_json::to_value(ApiEvent::schema()).unwrap();
        let keys = schema["properties"].as_object().unwrap();
        for event in journal().events_from(1, usize::MAX).events {
            let document = serde_json::to_value(&event).unwrap();
            for key in document.as_object().unwrap().keys() {
                assert!(keys.contains_key(key), "{key} of {document}");
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn changes_are_told_at_most_20_times_a_second() {
        let journal = Journal::new(KEPT_EVENTS, Arc::default());
        let mut changes = Some(StateChanges::new(&journal));
        let short = CHANGE_PAUSE / 2;
        journal.touch();
        journal.touch();
        timeout(short, StateChanges::next(&mut changes)).await.unwrap();
        journal.touch();
        assert!(timeout(short, StateChanges::next(&mut changes)).await.is_err());
        timeout(CHANGE_PAUSE, StateChanges::next(&mut changes))
            .await
            .unwrap();
        let more = timeout(100 * CHANGE_PAUSE, StateChanges::next(&mut changes));
        assert!(more.await.is_err(), "a change was told that did not happen");
    }

    #[test]
    #[ignore = "writes fixtures/golden/events anew; review the difference"]
    fn bless_stream() {
        bless(STREAM, &stream());
        bless(FINDINGS, &findings());
    }
}
