//! Common parts of every call of the control interface: the queue to the driver, the journal, the record of the run.
//!
//! Each method sends one request and waits for its answer. The requests are carried out in [`ts3100_driver::driver`].

use super::body::Json;
use super::journal::Journal;
use super::problem::Problem;
use axum::http::StatusCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, oneshot};
use tokio::time::timeout;
use ts3100_controller::{Action, By, PanelAction};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::request::{Paused, Reply, Request, Requests, View, WaitResult};
use ts3100_driver::driver::wait::Wait;
use ts3100_recording::reports::RunRecord;
use ts3100_recording::scenario::Play;

/// Streams of events at a time; each holds a connection.
pub const MAX_STREAMS: usize = 32;

/// Answer of most calls: a document, or the reason why they had no effect.
pub type Answer<T> = Result<Json<T>, Problem>;

/// The way to the driver. As a parameter of a handler it leads to the robot of the call, which [`super::robots`] has
/// found.
#[derive(Clone)]
pub struct Handle {
    driver: Requests,
    pub journal: Arc<Journal>,
    /// Record from which the reports of this run are made.
    pub record: RunRecord,
    /// The scenario that is played, if there is one.
    pub scenario: Option<Play>,
    /// Streams of events that may still be opened.
    pub streams: Arc<Semaphore>,
}

impl Handle {
    /// Requests go to `driver`; events and findings are read from `journal`, coverage from `record`.
    pub fn new(driver: Requests, journal: Arc<Journal>, record: RunRecord, scenario: Option<Play>) -> Handle {
        Handle {
            driver,
            journal,
            record,
            scenario,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        }
    }

    /// Sends the request that `with` makes of a place for its answer, and waits for that answer. There is none once the
    /// driver has ended.
    async fn request<T>(&self, with: impl FnOnce(oneshot::Sender<T>) -> Request) -> Result<T, Problem> {
        let (sender, receiver) = oneshot::channel();
        let sent = self.driver.send(with(sender)).await;
        sent.map_err(|_| Problem::shutting_down())?;
        receiver.await.map_err(|_| Problem::shutting_down())
    }

    /// Changes the controller, and reads the state after the change and all its immediate consequences.
    pub async fn act<T: Send + 'static>(
        &self,
        action: Action,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.change(
            |action, reply| Request::Action(action, By::Owner, reply),
            action,
            look,
        )
        .await
    }

    /// As [`Handle::act`], at the operating panel; returns the answer of the call.
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
        let with = |sender| {
            let reply =
                move |result: Result<(), E>, view: &View<'_>| answer(sender, result.map(|()| look(view)));
            request(action, Box::new(reply))
        };
        Ok(self.request(with).await??)
    }

    /// Reads from the present state.
    pub async fn query<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.request(|sender| Request::Query(Box::new(move |(), view| answer(sender, look(view)))))
            .await
    }

    /// The way to the driver alone.
    pub fn requests(&self) -> &Requests {
        &self.driver
    }

    /// Has the world of the robot pause.
    pub async fn pause(&self) -> Result<Paused, Problem> {
        self.request(Request::Pause).await
    }

    /// Sets an outside line with all immediate consequences; returns whether a wire begins there.
    pub async fn set_outside(&self, name: String, on: bool) -> Result<bool, Problem> {
        self.request(|sender| Request::SetOutside(name, on, sender)).await
    }

    /// Waits for a condition, for at most `wall` of wall-clock time.
    pub async fn wait(&self, wait: Wait, wall: Duration) -> Result<WaitResult, Problem> {
        let awaited = wait.condition().map(|condition| format!(" for `{condition}`"));
        let waited = self.request(|sender| Request::Wait(wait, sender));
        if let Ok(ended) = timeout(wall, waited).await {
            return ended;
        }
        let look = |view: &View<'_>| (view.time, view.controller.now().as_seconds());
        let (mode, now) = self.query(look).await?;
        let limit = wall.as_secs_f64();
        let expected = format!("the end of the wait within {limit} s of wall-clock time");
        let (awaited, status) = (awaited.unwrap_or_default(), StatusCode::REQUEST_TIMEOUT);
        let hint = match mode {
            TimeMode::Stepped => "; advance it, or wait with POST /clock/advance-until",
            TimeMode::Real | TimeMode::Scaled(_) | TimeMode::Auto => "",
        };
        let told = format!(
            "the wait{awaited} has not ended within {limit} s of wall-clock time: the clock is {mode} and shows {now} s{hint}"
        );
        Err(Problem::expected_found(status, "wall", expected, "none").told(told))
    }
}

/// Answers a caller; it may have gone.
fn answer<T>(sender: oneshot::Sender<T>, value: T) {
    let _ = sender.send(value);
}
