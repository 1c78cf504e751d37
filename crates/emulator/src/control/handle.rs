//! What a call of the control interface has in hand: the way to the hub, and the journal.

use super::journal::Journal;
use super::problem::Problem;
use crate::driver::request::{LinkAction, Request, View, WaitResult};
use crate::driver::wait::Wait;
use crate::snapshot::handle::{SnapshotReply, SnapshotRequest, SnapshotRequestError, SnapshotTask};
use axum::http::StatusCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::timeout;
use ts3100_controller::action::{Action, ActionError};

/// Streams of events at a time; each holds a connection.
pub const MAX_STREAMS: usize = 32;

/// The way to the hub.
#[derive(Clone)]
pub struct Handle {
    hub: mpsc::Sender<Request>,
    /// What has happened.
    pub journal: Arc<Journal>,
    /// Streams of events that may still be opened.
    pub streams: Arc<Semaphore>,
}

impl Handle {
    /// To this hub.
    #[must_use]
    pub fn new(hub: mpsc::Sender<Request>, journal: Arc<Journal>) -> Handle {
        Handle {
            hub,
            journal,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        }
    }

    async fn ask<T>(&self, request: impl FnOnce(oneshot::Sender<T>) -> Request) -> Result<T, Problem> {
        let (done, is_done) = oneshot::channel();
        self.hub
            .send(request(done))
            .await
            .map_err(|_| Problem::ending())?;
        is_done.await.map_err(|_| Problem::ending())
    }

    /// Does something to the controller; when this returns it is done, and all that follows from it at once.
    pub async fn action(&self, action: Action) -> Result<(), Problem> {
        let result: Result<(), ActionError> = self.ask(|done| Request::Action { action, done }).await?;
        result.map_err(Problem::from)
    }

    /// Does something around the controller.
    pub async fn edge(&self, action: LinkAction) -> Result<(), Problem> {
        let result: Result<(), ActionError> = self.ask(|done| Request::LinkAction { action, done }).await?;
        result.map_err(Problem::from)
    }

    /// Looks at everything as it is now.
    pub async fn look<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.ask(|done| {
            Request::Query(Box::new(move |sight| {
                // Fails only when nobody waits for it.
                let _ = done.send(look(sight));
            }))
        })
        .await
    }

    /// Has something done with snapshots.
    pub async fn snapshot(&self, task: SnapshotTask) -> Result<SnapshotReply, Problem> {
        let result: Result<SnapshotReply, SnapshotRequestError> = self
            .ask(|done| Request::Snapshot(SnapshotRequest { task, done }))
            .await?;
        result.map_err(Problem::from)
    }

    /// Waits for something, for at most so long on the wall.
    pub async fn wait(&self, seek: Wait, wall: Duration) -> Result<WaitResult, Problem> {
        let waited = timeout(wall, self.ask(|done| Request::Wait { wait: seek, done })).await;
        waited.unwrap_or_else(|_| {
            let limit = wall.as_secs_f64();
            Err(Problem::at(
                StatusCode::REQUEST_TIMEOUT,
                "wall",
                format!("an end of the wait within {limit} s of the wall clock"),
                "none",
            ))
        })
    }
}
