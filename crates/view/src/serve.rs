//! Serves a recorded run by the control interface: the page, the calls that read, and those about the run as a whole.
//!
//! | Path | |
//! |---|---|
//! | `/trace` | What there is to say about the run; see [`RunInfo`](crate::run::RunInfo) |
//! | `/trace/lanes` | The lanes of the timeline |
//! | `/trace/events?since=N&count=M` | Events by number |
//! | `/moments/KEY/...` | The control interface at a moment; see [`MomentKey`](crate::key::MomentKey) |

use crate::run::Run;
use axum::extract::{Query, State};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use ts3100_control::event::NumberedEvent;
use ts3100_control::recorded::{Moments, NoMoment};
use ts3100_control::{DriverHandle, Server};

/// Most events of one answer.
pub const MAX_BATCH: usize = 5_000;

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
            get(async |State(run): State<Arc<Run>>| Json(run.info()).into_response()),
        )
        .route(
            "/trace/lanes",
            get(async |State(run): State<Arc<Run>>| Json(run.lanes())),
        )
        .route("/trace/events", get(get_events))
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
    Json(Batch { events, next }).into_response()
}
