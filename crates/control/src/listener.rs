//! The listening socket of the control interface. It limits the number of connections and the time a connection may
//! take over a request, so that forgotten or hostile clients cannot exhaust the interface: when every place is taken, the
//! connection that has owed something longest gives way to the next one.
//!
//! HTTP itself is axum's; access is decided in [`super::guard`].

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::future::Future as _;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep, sleep, timeout};

/// Most connections at a time.
pub const MAX_CONNECTIONS: usize = 64;
/// Longest time from the accept, or from the first byte of a further request, to the end of the request's head.
pub const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest time between two requests. Also the longest time a peer may leave a response unread: a reader of events may
/// be stopped in a debugger.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(30);
/// Pause after a failed accept, for example without free file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// Longest time that the next peer waits for the connection that gives way, before another one has to.
const GIVE_WAY_PAUSE: Duration = Duration::from_millis(50);

/// The next thing that a connection waits for. Its order is that in which connections give way: who has not even sent a request first,
/// and last who reads an answer slowly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Owed {
    /// The head of a request.
    Head,
    /// The body of a request.
    Body,
    /// Another request.
    Request,
    /// Room for the response: the peer does not read.
    Reading,
}

impl Owed {
    /// Longest time for it.
    fn limit(self) -> Duration {
        match self {
            Owed::Head => HEAD_TIMEOUT,
            // The reader of the body has a limit of its own, and answers when it is reached.
            Owed::Body => Duration::MAX,
            Owed::Request | Owed::Reading => IDLE_TIMEOUT,
        }
    }
}

/// The state of a connection, shared with its requests and the listener.
#[derive(Debug)]
struct Activity(Mutex<State>);

#[derive(Debug)]
struct State {
    /// Requests that are being served, and streams of events.
    requests: usize,
    /// `None` while the peer waits for the emulator.
    owed: Option<Owed>,
    /// Time of the last change of `owed`.
    since: Instant,
    /// The place of the connection is needed: it closes when it next waits for its peer.
    gives_way: bool,
    /// Wakes the connection.
    waker: Option<Waker>,
}

impl State {
    fn owe(&mut self, owed: Option<Owed>) {
        if self.owed != owed {
            self.owed = owed;
            self.since = Instant::now();
        }
    }

    /// Nothing is being sent or received: a new connection owes its first request, another owes nothing.
    fn rest(&mut self) {
        self.owe((self.requests == 0).then_some(Owed::Request));
    }
}

impl Activity {
    fn new() -> Activity {
        Activity(Mutex::new(State {
            requests: 0,
            owed: Some(Owed::Head),
            since: Instant::now(),
            gives_way: false,
            waker: None,
        }))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the connection close.
    fn give_way(&self) {
        let mut state = self.lock();
        state.gives_way = true;
        if let Some(waker) = state.waker.take() {
            waker.wake();
        }
    }
}

/// A listener that serves at most [`MAX_CONNECTIONS`] at a time.
pub struct BoundedListener {
    listener: TcpListener,
    /// The connection accepted by `after_first_connection`, until axum takes it.
    first: Option<(TcpStream, SocketAddr)>,
    slots: Arc<Semaphore>,
    connections: Vec<Weak<Activity>>,
}

impl BoundedListener {
    /// Waits for the first connection to a bound socket.
    pub async fn after_first_connection(listener: TcpListener) -> BoundedListener {
        let first = accept_retrying(&listener).await;
        BoundedListener {
            listener,
            first: Some(first),
            slots: Arc::new(Semaphore::new(MAX_CONNECTIONS)),
            connections: Vec::new(),
        }
    }

    /// Waits for a place. While there is none, connections that owe something give way one after the other.
    async fn place(&mut self) -> OwnedSemaphorePermit {
        loop {
            if let Ok(place) = Arc::clone(&self.slots).try_acquire_owned() {
                return place;
            }
            self.make_room();
            let place = timeout(GIVE_WAY_PAUSE, Arc::clone(&self.slots).acquire_owned()).await;
            // The semaphore is never closed.
            if let Ok(Ok(place)) = place {
                return place;
            }
        }
    }

    /// Has the connection close that owes what gives way first, of several the one that has owed it longest.
    fn make_room(&mut self) {
        self.connections
            .retain(|connection| connection.strong_count() > 0);
        let connections = self.connections.iter().filter_map(Weak::upgrade);
        let owing = connections.filter_map(|connection| {
            let state = connection.lock();
            let key = (state.owed.filter(|_| !state.gives_way)?, state.since);
            drop(state);
            Some((key, connection))
        });
        if let Some((_, connection)) = owing.min_by_key(|(key, _)| *key) {
            connection.give_way();
        }
    }
}

async fn accept_retrying(listener: &TcpListener) -> (TcpStream, SocketAddr) {
    loop {
        match listener.accept().await {
            Ok(caller) => return caller,
            Err(_) => sleep(ACCEPT_PAUSE).await,
        }
    }
}

impl Listener for BoundedListener {
    type Io = HttpConnection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (HttpConnection, SocketAddr) {
        let (stream, peer) = match self.first.take() {
            Some(first) => first,
            None => accept_retrying(&self.listener).await,
        };
        let connection = HttpConnection::new(stream, self.place().await);
        self.connections
            .retain(|connection| connection.strong_count() > 0);
        self.connections.push(Arc::downgrade(&connection.activity));
        (connection, peer)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A connection that closes itself when its peer owes something too long, or when its place is needed.
pub struct HttpConnection {
    stream: TcpStream,
    _slot: OwnedSemaphorePermit,
    activity: Arc<Activity>,
    /// Ends when what is owed is overdue.
    timer: Pin<Box<Sleep>>,
}

impl HttpConnection {
    fn new(stream: TcpStream, place: OwnedSemaphorePermit) -> HttpConnection {
        // Without Nagle a short response leaves at once; a failure only delays it.
        let _ = stream.set_nodelay(true);
        HttpConnection {
            stream,
            _slot: place,
            activity: Arc::new(Activity::new()),
            timer: Box::pin(sleep(HEAD_TIMEOUT)),
        }
    }

    /// Whether the connection ends while it waits for its peer.
    fn is_over(&mut self, context: &mut Context<'_>) -> bool {
        let mut state = self.activity.lock();
        state.waker = Some(context.waker().clone());
        let Some(owed) = state.owed else {
            return false;
        };
        if state.gives_way {
            return true;
        }
        let Some(deadline) = state.since.checked_add(owed.limit()) else {
            return false;
        };
        drop(state);
        if self.timer.deadline() != deadline {
            self.timer.as_mut().reset(deadline);
        }
        self.timer.as_mut().poll(context).is_ready()
    }
}

impl AsyncRead for HttpConnection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        if read.is_ready() {
            let mut state = self.activity.lock();
            if state.owed == Some(Owed::Request) {
                state.owe(Some(Owed::Head));
            }
        } else if self.is_over(context) {
            return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
        }
        read
    }
}

impl AsyncWrite for HttpConnection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        let mut state = self.activity.lock();
        if written.is_ready() {
            if state.owed == Some(Owed::Reading) {
                state.rest();
            }
            return written;
        }
        state.owe(Some(Owed::Reading));
        drop(state);
        if self.is_over(context) {
            return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
        }
        written
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// Facts about the connection of a request.
#[derive(Debug, Clone)]
pub struct ConnectionInfo {
    /// The local address that the peer dialled.
    pub reached_at: Option<SocketAddr>,
    activity: Arc<Activity>,
}

impl ConnectionInfo {
    /// Marks the connection as busy until the returned guard is dropped.
    pub fn begin_request(&self) -> RequestGuard {
        let mut state = self.activity.lock();
        state.requests += 1;
        state.owe(None);
        drop(state);
        RequestGuard(Arc::clone(&self.activity))
    }

    /// Notes that the peer owes the body of its request until the returned guard is dropped.
    pub fn begin_body(&self) -> BodyGuard {
        self.activity.lock().owe(Some(Owed::Body));
        BodyGuard(Arc::clone(&self.activity))
    }
}

impl Connected<IncomingStream<'_, BoundedListener>> for ConnectionInfo {
    fn connect_info(stream: IncomingStream<'_, BoundedListener>) -> ConnectionInfo {
        let line = stream.io();
        ConnectionInfo {
            reached_at: line.stream.local_addr().ok(),
            activity: Arc::clone(&line.activity),
        }
    }
}

/// Keeps a connection from counting as idle while a request is served.
#[derive(Debug)]
pub struct RequestGuard(Arc<Activity>);

impl Drop for RequestGuard {
    fn drop(&mut self) {
        let mut state = self.0.lock();
        state.requests -= 1;
        if state.requests == 0 {
            state.rest();
        }
    }
}

/// Counts a connection as one whose peer owes a body.
#[derive(Debug)]
pub struct BodyGuard(Arc<Activity>);

impl Drop for BodyGuard {
    fn drop(&mut self) {
        self.0.lock().rest();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::time::advance;

    /// A peer and its accepted connection.
    async fn connected() -> (TcpStream, HttpConnection) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let peer = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let mut listener = BoundedListener::after_first_connection(listener).await;
        (peer, listener.accept().await.0)
    }

    /// The connection gives up on its peer after this time.
    async fn gives_up_after(connection: &mut HttpConnection, time: Duration) {
        let before = time.saturating_sub(Duration::from_millis(10));
        let early = timeout(before, connection.read_u8()).await;
        assert!(early.is_err(), "before {before:?}: {early:?}");
        let error = timeout(Duration::from_millis(20), connection.read_u8()).await;
        let error = error.expect("it still waits").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    }

    fn info(connection: &HttpConnection) -> ConnectionInfo {
        ConnectionInfo {
            reached_at: None,
            activity: Arc::clone(&connection.activity),
        }
    }

    #[tokio::test(start_paused = true)]
    async fn bytes_of_a_head_do_not_extend_its_time() {
        let (mut peer, mut connection) = connected().await;
        for _ in 0..4 {
            peer.write_all(b"G").await.unwrap();
            connection.read_u8().await.unwrap();
            advance(Duration::from_secs(1)).await;
        }
        gives_up_after(&mut connection, Duration::from_secs(1)).await;
    }

    #[tokio::test(start_paused = true)]
    async fn a_further_request_may_come_later_but_its_head_has_the_same_time() {
        let (mut peer, mut connection) = connected().await;
        drop(info(&connection).begin_request());
        gives_up_after(&mut connection, Duration::from_secs(30)).await;

        drop(info(&connection).begin_request());
        peer.write_all(b"G").await.unwrap();
        connection.read_u8().await.unwrap();
        gives_up_after(&mut connection, Duration::from_secs(5)).await;
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_that_is_served_has_no_limit_here() {
        let (mut peer, mut connection) = connected().await;
        let request = info(&connection).begin_request();
        let waits = timeout(Duration::from_secs(3_600), connection.read_u8());
        assert!(waits.await.is_err(), "it ended");
        connection.activity.give_way();
        let waits = timeout(Duration::from_secs(3_600), connection.read_u8());
        assert!(waits.await.is_err(), "it gave way");
        drop(request);
        let error = connection.read_u8().await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut, "it gives way at its end");
        peer.shutdown().await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn connections_give_way_in_the_order_of_what_they_owe() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut peers = vec![TcpStream::connect(address).await.unwrap()];
        let mut listener = BoundedListener::after_first_connection(listener).await;
        let mut connections = vec![listener.accept().await.0];
        for _ in 1..4 {
            peers.push(TcpStream::connect(address).await.unwrap());
            connections.push(listener.accept().await.0);
            advance(Duration::from_millis(1)).await;
        }
        let guards: Vec<_> = connections.iter().map(|one| info(one).begin_request()).collect();
        let [idle, body, head, _served] = connections.as_slice() else {
            panic!("four were accepted");
        };
        let _body = info(body).begin_body();
        let mut guards = guards.into_iter();
        drop(guards.next());
        head.activity.lock().owe(Some(Owed::Head));
        let given = || -> Vec<bool> {
            let given = connections.iter().map(|one| one.activity.lock().gives_way);
            given.collect()
        };
        for (expected, which) in [(2, head), (1, body), (0, idle)] {
            listener.make_room();
            assert!(which.activity.lock().gives_way, "{expected}: {:?}", given());
        }
        listener.make_room();
        assert_eq!(given(), [true, true, true, false], "one that is served stays");
    }
}
