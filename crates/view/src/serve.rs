//! Serves a recorded run by the control interface: the page, the calls that read, and those about the run as a whole.
//!
//! | Path | |
//! |---|---|
//! | `/trace` | What there is to say about the run; see [`RunInfo`](crate::run::RunInfo) |
//! | `/trace/lanes` | The lanes of the timeline |
//! | `/trace/events?since=N&count=M` | Events by number |
//! | `/trace/changes?of=N&until=KEY` | Changes of a value with their causes |
//! | `/trace/hits?line=7&file=PICK&value=N&until=KEY` | Executions of a line |
//! | `/moments/KEY/...` | The control interface at a moment; see [`MomentKey`] |

use crate::key::{KeyError, MomentKey};
use crate::run::Run;
use crate::why::{Found, Question};
use axum::Router;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::sync::Arc;
use tokio::task::spawn_blocking;
use ts3100_control::event::NumberedEvent;
use ts3100_control::recorded::{Moments, NoMoment, json_response};
use ts3100_control::{DriverHandle, Server};
use ts3100_controller::watched::WatchedError;

/// Most events of one answer.
pub const MAX_BATCH: usize = 5_000;
/// Most changes of one answer before a moment.
const MAX_BEFORE: usize = 200;

impl Moments for Run {
    fn find(&self, key: Option<&str>) -> Result<DriverHandle, NoMoment> {
        self.handle(key)
    }
}

/// Serves a run until the present runtime ends.
pub fn serve(run: &Arc<Run>, server: Server) {
    let own = Router::new()
        .route(
            "/trace",
            get(async |State(run): State<Arc<Run>>| json_response(run.info())),
        )
        .route(
            "/trace/lanes",
            get(async |State(run): State<Arc<Run>>| json_response(run.lanes())),
        )
        .route("/trace/events", get(get_events))
        .route(
            "/moments/{key}/state",
            get(async |key, State(run): State<Arc<Run>>| document(key, run, Run::state).await),
        )
        .route(
            "/moments/{key}/arm",
            get(async |key, State(run): State<Arc<Run>>| document(key, run, Run::arm).await),
        )
        .route("/trace/changes", get(get_changes))
        .route("/trace/hits", get(get_hits))
        .with_state(Arc::clone(run));
    server.serve_recorded(Arc::clone(run) as Arc<dyn Moments>, own);
}

/// Which events.
#[derive(Debug, Clone, Copy, Deserialize)]
struct Selection {
    #[serde(default)]
    since: u64,
    #[serde(default)]
    count: Option<usize>,
}

#[derive(Serialize)]
struct Batch {
    events: Vec<NumberedEvent>,
    next: u64,
}

async fn get_events(State(run): State<Arc<Run>>, Query(selection): Query<Selection>) -> Response {
    let count = selection.count.unwrap_or(MAX_BATCH).min(MAX_BATCH);
    let batch = run.journal().events_from(selection.since, count);
    let (events, next) = (batch.events, batch.next);
    json_response(Batch { events, next })
}

/// A question about the whole run, and the moment up to which its answer is of interest.
#[derive(Debug, Clone, Deserialize)]
struct Asked {
    of: Option<String>,
    line: Option<u32>,
    #[serde(default)]
    file: String,
    value: Option<String>,
    until: Option<String>,
}

/// What was found: the last until a moment and the next after it, or the first of all.
#[derive(Default)]
struct Extract {
    found: Vec<Found>,
    next: Option<Found>,
    /// How many there are in all.
    count: u64,
}

async fn get_changes(State(run): State<Arc<Run>>, Query(asked): Query<Asked>) -> Response {
    let of = asked.of.as_deref().unwrap_or_default();
    let of = of.strip_prefix("variable:").unwrap_or(of);
    match of.parse() {
        Ok(watched) => answer(run, Question::Changes(watched), asked.until).await,
        Err(error) => refusal(&format!("of: {error}")),
    }
}

async fn get_hits(State(run): State<Arc<Run>>, Query(asked): Query<Asked>) -> Response {
    let Some(line) = asked.line else {
        return refusal("line: expected the number of a line");
    };
    let value = match asked.value.as_deref().map(str::parse).transpose() {
        Ok(value) => value,
        Err(error) => return refusal(&format!("value: {}", WatchedError::to_string(&error))),
    };
    let file = asked.file;
    answer(run, Question::Hits { file, line, value }, asked.until).await
}

fn refusal(told: &str) -> Response {
    (StatusCode::BAD_REQUEST, json_response(json!({ "error": told }))).into_response()
}

async fn answer(run: Arc<Run>, question: Question, until: Option<String>) -> Response {
    let until = match until.as_deref().map(str::parse::<MomentKey>).transpose() {
        Ok(until) => until,
        Err(error) => return refusal(&format!("until: {error}")),
    };
    let key = match question {
        Question::Changes(_) => "changes",
        Question::Hits { .. } => "hits",
    };
    let asked = spawn_blocking(move || {
        let answer = run.ask(&question);
        let all = &answer.found;
        let count = all.len() as u64 + answer.more;
        let Some(moment) = until.and_then(|until| run.moment(until).ok()) else {
            let found = all.iter().take(MAX_BATCH).cloned().collect();
            return Extract {
                found,
                next: None,
                count,
            };
        };
        let after = answer.before(&run, moment).len();
        let before = all
            .get(after.saturating_sub(MAX_BEFORE)..after)
            .unwrap_or_default();
        let (found, next) = (before.to_vec(), all.get(after).cloned());
        Extract { found, next, count }
    });
    match asked.await {
        Ok(Extract { found, next, count }) => {
            let more = count - found.len() as u64;
            json_response(json!({ key: found, "next": next, "more": more }))
        }
        Err(_) => refusal("the question was given up"),
    }
}

/// A document of a moment that the run itself has: of a real robot no controller has it.
async fn document(
    Path(key): Path<String>,
    run: Arc<Run>,
    read: fn(&Run, MomentKey) -> Result<Value, NoMoment>,
) -> Response {
    let key = match key.parse() {
        Ok(key) => key,
        Err(error) => return refusal(&KeyError::to_string(&error)),
    };
    match spawn_blocking(move || read(&run, key)).await {
        Ok(Ok(document)) => json_response(document),
        Ok(Err(NoMoment(told))) => {
            (StatusCode::NOT_FOUND, json_response(json!({ "error": told }))).into_response()
        }
        Err(_) => refusal("the question was given up"),
    }
}
