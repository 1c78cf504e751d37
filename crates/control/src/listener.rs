//! The listening socket of the control interface. It limits the number of connections and the time a connection may
//! be idle, so that forgotten clients cannot exhaust the interface.
//!
//! HTTP itself is axum's; access is decided in [`super::guard`].

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Sleep, sleep};

/// Most connections at a time; further ones wait in the backlog of the socket.
pub const MAX_CONNECTIONS: usize = 64;
/// Longest time from the accept or the end of a response to the end of the next request's head. Also the longest time a
/// peer may leave a response unread.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(30);
/// Pause after a failed accept, for example without free file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// A listener that serves at most [`MAX_CONNECTIONS`] at a time.
pub struct BoundedListener {
    listener: TcpListener,
    /// The connection accepted by `after_first_connection`, until axum takes it.
    first: Option<(TcpStream, SocketAddr)>,
    slots: Arc<Semaphore>,
}

impl BoundedListener {
    /// Waits for the first connection to a bound socket.
    pub async fn after_first_connection(listener: TcpListener) -> BoundedListener {
        let first = accept_retrying(&listener).await;
        BoundedListener {
            listener,
            first: Some(first),
            slots: Arc::new(Semaphore::new(MAX_CONNECTIONS)),
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
        loop {
            let Ok(place) = Arc::clone(&self.slots).acquire_owned().await else {
                // The semaphore is never closed.
                std::future::pending::<()>().await;
                continue;
            };
            let (stream, peer) = match self.first.take() {
                Some(first) => first,
                None => accept_retrying(&self.listener).await,
            };
            return (HttpConnection::new(stream, place), peer);
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// A connection that closes itself when it is idle for [`IDLE_TIMEOUT`].
pub struct HttpConnection {
    stream: TcpStream,
    _slot: OwnedSemaphorePermit,
    active_requests: Arc<AtomicUsize>,
    /// Runs while no request is being served.
    idle: IdleTimer,
    /// Runs while the peer does not read.
    stalled: IdleTimer,
}

/// Ends [`IDLE_TIMEOUT`] after it was asked first; `None` while it does not run.
type IdleTimer = Option<Pin<Box<Sleep>>>;

fn is_over(timer: &mut IdleTimer, context: &mut Context<'_>) -> bool {
    let timer = timer.get_or_insert_with(|| Box::pin(sleep(IDLE_TIMEOUT)));
    timer.as_mut().poll(context).is_ready()
}

impl HttpConnection {
    fn new(stream: TcpStream, place: OwnedSemaphorePermit) -> HttpConnection {
        // Without Nagle a short response leaves at once; a failure only delays it.
        let _ = stream.set_nodelay(true);
        HttpConnection {
            stream,
            _slot: place,
            active_requests: Arc::default(),
            idle: None,
            stalled: None,
        }
    }
}

impl AsyncRead for HttpConnection {
    #[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let is_busy = self.active_requests.load(Ordering::Relaxed) > 0;
        if is_busy {
            self.idle = None;
        }
        let late = !is_busy && is_over(&mut self.idle, context);
        match Pin::new(&mut self.stream).poll_read(context, buffer) {
            Poll::Pending if late => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            other => other,
        }
    }
}

impl AsyncWrite for HttpConnection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        if written.is_ready() {
            self.stalled = None;
        } else if is_over(&mut self.stalled, context) {
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
    active_requests: Arc<AtomicUsize>,
}

impl ConnectionInfo {
    /// Marks the connection as busy until the returned guard is dropped.
    pub fn begin_request(&self) -> RequestGuard {
        self.active_requests.fetch_add(1, Ordering::Relaxed);
        RequestGuard(Arc::clone(&self.active_requests))
    }
}

impl Connected<IncomingStream<'_, BoundedListener>> for ConnectionInfo {
    fn connect_info(stream: IncomingStream<'_, BoundedListener>) -> ConnectionInfo {
        let line = stream.io();
        ConnectionInfo {
            reached_at: line.stream.local_addr().ok(),
            active_requests: Arc::clone(&line.active_requests),
        }
    }
}

/// Keeps a connection from counting as idle while a request is served.
#[derive(Debug)]
pub struct RequestGuard(Arc<AtomicUsize>);

impl Drop for RequestGuard {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
