//! What every call of the control interface uses: the queue to the driver, the journal, the record of the run.
//!
//! Each method sends one request and waits for its answer. The requests are carried out in [`ts3100_driver::driver`].

use super::body::Json;
use super::journal::Journal;
use super::problem::Problem;
use axum::http::StatusCode;
use futures_util::future::BoxFuture;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::time::timeout;
use ts3100_controller::{Action, PanelAction};
use ts3100_driver::driver::REQUEST_QUEUE;
use ts3100_driver::driver::request::{Reply, Request, View, WaitResult};
use ts3100_driver::driver::wait::Wait;
use ts3100_recording::reports::RunRecord;
use ts3100_recording::scenario::Play;

/// Streams of events at a time; each holds a connection.
pub const MAX_STREAMS: usize = 32;

/// What most calls answer: a document, or why they had no effect.
pub type Answer<T> = Result<Json<T>, Problem>;

/// The way to the driver; as a parameter of a handler that to the robot of the call, which [`super::robots`] has found.
#[derive(Clone)]
pub struct Handle {
    driver: mpsc::Sender<Request>,
    /// What has happened.
    pub journal: Arc<Journal>,
    /// What the reports of this run are made of.
    pub record: RunRecord,
    /// The scenario that is played, if there is one.
    pub scenario: Option<Play>,
    /// Streams of events that may still be opened.
    pub streams: Arc<Semaphore>,
}

/// Where the driver puts an answer.
struct Slot<T> {
    value: Arc<Mutex<Option<T>>>,
    done: oneshot::Sender<()>,
}

impl<T> Slot<T> {
    fn fill(self, value: T) {
        *self.value.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
        // Fails only when nobody waits for it.
        let _ = self.done.send(());
    }
}

impl Handle {
    /// Requests go to `driver`; events and findings are read from `journal`, coverage from `record`.
    pub fn new(
        driver: mpsc::Sender<Request>,
        journal: Arc<Journal>,
        record: RunRecord,
        scenario: Option<Play>,
    ) -> Handle {
        Handle {
            driver,
            journal,
            record,
            scenario,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        }
    }

    async fn request<T>(&self, request: impl FnOnce(Slot<T>) -> Request) -> Result<T, Problem> {
        let (done, is_done) = oneshot::channel();
        let value = Arc::default();
        let slot = Slot {
            value: Arc::clone(&value),
            done,
        };
        self.deliver(request(slot), is_done).await?;
        let answer = value.lock().unwrap_or_else(PoisonError::into_inner).take();
        answer.ok_or_else(Problem::shutting_down)
    }

    /// Sends a request and waits for what comes when it is done. Boxed, and nothing for an answer in a slot, so that it is
    /// compiled once for all of those.
    fn deliver<T: Send + 'static>(
        &self,
        request: Request,
        is_done: oneshot::Receiver<T>,
    ) -> BoxFuture<'_, Result<T, Problem>> {
        Box::pin(async {
            let sent = self.driver.send(request).await;
            sent.map_err(|_| Problem::shutting_down())?;
            is_done.await.map_err(|_| Problem::shutting_down())
        })
    }

    /// Does something to the controller, and reads what has come of it, with all that follows from it at once.
    pub async fn act<T: Send + 'static>(
        &self,
        action: Action,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.change(Request::Action, action, look).await
    }

    /// As [`Handle::act`], at the operating panel; what is read is the answer of the call.
    pub async fn press<T: Send + 'static>(
        &self,
        panel: PanelAction,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Answer<T> {
        self.act(Action::Panel(panel), look).await.map(Json)
    }

    /// As [`Handle::act`], for every kind of request that can be refused.
    pub async fn change<A, T: Send + 'static, E: Send + 'static>(
        &self,
        request: fn(A, Reply<Result<(), E>>) -> Request,
        action: A,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem>
    where
        Problem: From<E>,
    {
        let send = |slot: Slot<Result<T, E>>| {
            let reply = move |result: Result<(), E>, view: &View<'_>| slot.fill(result.map(|()| look(view)));
            request(action, Box::new(reply))
        };
        Ok(self.request(send).await??)
    }

    /// Looks at everything as it is now.
    pub async fn query<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.request(|slot| Request::Query(Box::new(move |(), view| slot.fill(look(view)))))
            .await
    }

    /// A way to the same robot, which serves nobody else until that is dropped.
    pub async fn exclusive(&self) -> Result<Handle, Problem> {
        let (driver, requests) = mpsc::channel(REQUEST_QUEUE);
        let sent = self.driver.send(Request::Exclusive(requests)).await;
        sent.map_err(|_| Problem::shutting_down())?;
        let handle = Handle {
            driver,
            ..self.clone()
        };
        // It is answered when everybody else waits.
        handle.query(|_| ()).await?;
        Ok(handle)
    }

    /// Lets time stand at this moment, as long as nobody else is served.
    pub async fn stand_still(&self, moment: Instant) -> Result<(), Problem> {
        let fill = |slot: Slot<()>| Request::StandStill(moment, Box::new(move |(), _| slot.fill(())));
        self.request(fill).await
    }

    /// Waits for something, for at most so long on the wall.
    pub async fn wait(&self, wait: Wait, wall: Duration) -> Result<WaitResult, Problem> {
        let (done, is_done) = oneshot::channel();
        let waited = timeout(wall, self.deliver(Request::Wait(wait, done), is_done)).await;
        waited.unwrap_or_else(|_| {
            let limit = wall.as_secs_f64();
            let expected = format!("an end of the wait within {limit} s of the wall clock");
            let status = StatusCode::REQUEST_TIMEOUT;
            let told = format!("the wait has not ended within {limit} s of wall-clock time");
            Err(Problem::expected_found(status, "wall", expected, "none").told(told))
        })
    }
}
