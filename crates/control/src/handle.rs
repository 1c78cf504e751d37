//! What every call of the control interface uses: the queue to the driver and the journal.
//!
//! Each method sends one request and waits for its answer. The requests are carried out in [`ts3100_driver::driver`].

use super::journal::Journal;
use super::problem::Problem;
use axum::http::StatusCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::timeout;
use ts3100_controller::action::Action;
use ts3100_driver::driver::request::{LinkAction, Reply, Request, View, WaitResult};
use ts3100_driver::driver::wait::Wait;
use ts3100_driver::snapshot::SnapshotTask;

/// Streams of events at a time; each holds a connection.
pub const MAX_STREAMS: usize = 32;

/// The way to the driver.
#[derive(Clone)]
pub struct DriverHandle {
    driver: mpsc::Sender<Request>,
    /// What has happened.
    pub journal: Arc<Journal>,
    /// Streams of events that may still be opened.
    pub streams: Arc<Semaphore>,
}

impl DriverHandle {
    /// Requests go to `driver`; events and findings are read from `journal`.
    #[must_use]
    pub fn new(driver: mpsc::Sender<Request>, journal: Arc<Journal>) -> DriverHandle {
        DriverHandle {
            driver,
            journal,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        }
    }

    async fn request<T>(&self, request: impl FnOnce(oneshot::Sender<T>) -> Request) -> Result<T, Problem> {
        let (done, is_done) = oneshot::channel();
        self.driver
            .send(request(done))
            .await
            .map_err(|_| Problem::shutting_down())?;
        is_done.await.map_err(|_| Problem::shutting_down())
    }

    /// Does something to the controller; when this returns it is done, and all that follows from it at once.
    pub async fn action(&self, action: Action) -> Result<(), Problem> {
        self.act(action, |_| ()).await
    }

    /// Does something to the controller, and reads what has come of it, with all that follows from it at once.
    pub async fn act<T: Send + 'static>(
        &self,
        action: Action,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.try_request(look, |reply| Request::Action(action, reply))
            .await
    }

    /// Does something around the controller.
    pub async fn link_action(&self, action: LinkAction) -> Result<(), Problem> {
        self.try_request(|_| (), |reply| Request::LinkAction(action, reply))
            .await
    }

    /// Has something done with snapshots, and reads what has come of it.
    pub async fn snapshot<T: Send + 'static>(
        &self,
        task: SnapshotTask,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.try_request(look, |reply| Request::Snapshot(task, reply))
            .await
    }

    async fn try_request<T: Send + 'static, E: Into<Problem> + Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
        request: impl FnOnce(Reply<Result<(), E>>) -> Request,
    ) -> Result<T, Problem> {
        let result: Result<T, E> = self
            .request(|done| {
                request(Box::new(move |result, view| {
                    // Fails only when nobody waits for it.
                    let _ = done.send(result.map(|()| look(view)));
                }))
            })
            .await?;
        result.map_err(Into::into)
    }

    /// Looks at everything as it is now.
    pub async fn query<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.request(|done| {
            Request::Query(Box::new(move |(), view| {
                // As above.
                let _ = done.send(look(view));
            }))
        })
        .await
    }

    /// Waits for something, for at most so long on the wall.
    pub async fn wait(&self, wait: Wait, wall: Duration) -> Result<WaitResult, Problem> {
        let waited = timeout(wall, self.request(|done| Request::Wait(wait, done))).await;
        waited.unwrap_or_else(|_| {
            let limit = wall.as_secs_f64();
            Err(Problem::expected_found(
                StatusCode::REQUEST_TIMEOUT,
                "wall",
                format!("an end of the wait within {limit} s of the wall clock"),
                "none",
            ))
        })
    }
}
