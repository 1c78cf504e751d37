//! Common parts of every call of the control interface: the queue to the driver, or a moment of a recorded run, the journal,
//! the record of the run.
//!
//! Each method sends one request and waits for its answer. The requests are carried out in [`ts3100_driver::driver`].

use super::body::Json;
use super::journal::Journal;
use super::problem::Problem;
use axum::http::StatusCode;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{Semaphore, oneshot};
use tokio::time::timeout;
use ts3100_controller::{Action, By, PanelAction};
use ts3100_driver::clock::TimeMode;
use ts3100_driver::driver::request::{Paused, Reply, Request, Requests, Still, View, WaitResult};
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
    way: Way,
    pub journal: Arc<Journal>,
    /// Record from which the reports of this run are made.
    pub record: RunRecord,
    /// The scenario that is played, if there is one.
    pub scenario: Option<Play>,
    /// Streams of events that may still be opened.
    pub streams: Arc<Semaphore>,
}

/// Where the requests of a handle go.
#[derive(Clone)]
enum Way {
    /// To the driver of a running robot.
    Driver(Requests),
    /// To a moment of a recorded run, which can only be read.
    Recorded(Arc<Still>),
}

impl Handle {
    /// Requests go to `driver`; events and findings are read from `journal`, coverage from `record`.
    pub fn new(driver: Requests, journal: Arc<Journal>, record: RunRecord, scenario: Option<Play>) -> Handle {
        Handle {
            way: Way::Driver(driver),
            journal,
            record,
            scenario,
            streams: Arc::new(Semaphore::new(MAX_STREAMS)),
        }
    }

    /// A moment of a recorded run, with what happened before it. Streams of events share the permits of the run.
    pub fn recorded(still: Still, journal: Arc<Journal>, streams: Arc<Semaphore>) -> Handle {
        Handle {
            way: Way::Recorded(Arc::new(still)),
            journal,
            record: RunRecord::default(),
            scenario: None,
            streams,
        }
    }

    /// Sends a request and waits for its answer. There is none once the driver has ended.
    async fn request<T>(&self, request: Request, answer: oneshot::Receiver<T>) -> Result<T, Problem> {
        match (&self.way, request) {
            (Way::Driver(driver), request) => {
                let sent = driver.send(request).await;
                sent.map_err(|_| Problem::shutting_down())?;
            }
            (Way::Recorded(still), Request::Query(reply)) => still.look(|view| reply((), view)),
            (Way::Recorded(_), _) => return Err(Problem::recorded()),
        }
        answer.await.map_err(|_| Problem::shutting_down())
    }

    /// Sends the request that `with` makes of a reply, and returns what `look` reads when the driver replies.
    async fn reply<R: 'static, T: Send + 'static>(
        &self,
        look: impl FnOnce(R, &View<'_>) -> T + Send + 'static,
        with: impl FnOnce(Reply<R>) -> Request,
    ) -> Result<T, Problem> {
        let place = Arc::new(Mutex::new(None));
        // It carries nothing: a channel of its own for each type of answer is much code.
        let (done, is_done) = oneshot::channel::<()>();
        let reply = {
            let place = Arc::clone(&place);
            move |result: R, view: &View<'_>| {
                let value = look(result, view);
                if let Ok(mut place) = place.lock() {
                    *place = Some(value);
                }
                // The caller may have gone.
                let _ = done.send(());
            }
        };
        self.request(with(Box::new(reply)), is_done).await?;
        let value = place.lock().ok().and_then(|mut place| place.take());
        value.ok_or_else(Problem::shutting_down)
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
        let look = move |result: Result<(), E>, view: &View<'_>| result.map(|()| look(view));
        Ok(self.reply(look, |reply| request(action, reply)).await??)
    }

    /// Reads from the present state.
    pub async fn query<T: Send + 'static>(
        &self,
        look: impl FnOnce(&View<'_>) -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.reply(move |(), view| look(view), Request::Query).await
    }

    /// The way to the driver alone.
    pub fn requests(&self) -> Result<&Requests, Problem> {
        match &self.way {
            Way::Driver(driver) => Ok(driver),
            Way::Recorded(_) => Err(Problem::recorded()),
        }
    }

    /// Has the world of the robot pause.
    pub async fn pause(&self) -> Result<Paused, Problem> {
        let (sender, paused) = oneshot::channel();
        self.request(Request::Pause(sender), paused).await
    }

    /// Sets an outside line with all immediate consequences; returns whether a wire begins there.
    pub async fn set_outside(&self, name: String, on: bool) -> Result<bool, Problem> {
        let (sender, begins) = oneshot::channel();
        self.request(Request::SetOutside(name, on, sender), begins).await
    }

    /// Waits for a condition, for at most `wall` of wall-clock time.
    pub async fn wait(&self, wait: Wait, wall: Duration) -> Result<WaitResult, Problem> {
        let awaited = wait.condition().map(|condition| format!(" for `{condition}`"));
        let advances = wait.advance;
        let (sender, result) = oneshot::channel();
        let waited = self.request(Request::Wait(wait, sender), result);
        let ended = timeout(wall, waited).await;
        // Time may have been advanced, which is no input.
        self.journal.touch();
        if let Ok(ended) = ended {
            return ended;
        }
        let look = |view: &View<'_>| (view.time, view.controller.now().as_seconds());
        let (mode, now) = self.query(look).await?;
        let limit = wall.as_secs_f64();
        let expected = format!("the end of the wait within {limit} s of wall-clock time");
        let (awaited, status) = (awaited.unwrap_or_default(), StatusCode::REQUEST_TIMEOUT);
        let hint = match mode {
            _ if advances => "; call again for the rest, or allow a longer `wall`",
            TimeMode::Stepped => "; advance it, or wait with POST /clock/advance-until",
            TimeMode::Real | TimeMode::Scaled(_) | TimeMode::Auto => "",
        };
        let told = format!(
            "the wait{awaited} has not ended within {limit} s of wall-clock time: the clock is {mode} and shows {now} s{hint}"
        );
        Err(Problem::expected_found(status, "wall", expected, "none").told(told))
    }
}
