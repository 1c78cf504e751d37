//! The listening socket of the control interface: connections are bounded in number and in the time they may do
//! nothing. What is said on them is not known here.

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
use tokio::time::{Instant, Sleep};

/// Connections at a time; further ones wait in the system's queue.
pub const MAX_CONNECTIONS: usize = 64;
/// Longest time from the end of an answer, or from the accept, to the end of the next request's head; and longest
/// time a peer may leave an answer unread.
pub const IDLE: Duration = Duration::from_secs(30);
/// Pause behind an accept that failed, for want of file descriptors for example.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Accepts no more than [`MAX_CONNECTIONS`].
pub struct Bounded {
    listener: TcpListener,
    /// Accepted, not yet served.
    first: Option<(TcpStream, SocketAddr)>,
    places: Arc<Semaphore>,
}

impl Bounded {
    /// Around a bound socket, as soon as somebody has called there.
    pub async fn called(listener: TcpListener) -> Bounded {
        let first = next(&listener).await;
        Bounded {
            listener,
            first: Some(first),
            places: Arc::new(Semaphore::new(MAX_CONNECTIONS)),
        }
    }
}

async fn next(listener: &TcpListener) -> (TcpStream, SocketAddr) {
    loop {
        match listener.accept().await {
            Ok(caller) => return caller,
            Err(_) => tokio::time::sleep(ACCEPT_PAUSE).await,
        }
    }
}

impl Listener for Bounded {
    type Io = Line;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Line, SocketAddr) {
        loop {
            let Ok(place) = Arc::clone(&self.places).acquire_owned().await else {
                // The semaphore is never closed.
                std::future::pending::<()>().await;
                continue;
            };
            let (stream, peer) = match self.first.take() {
                Some(first) => first,
                None => next(&self.listener).await,
            };
            return (Line::new(stream, place), peer);
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// One connection.
pub struct Line {
    stream: TcpStream,
    _place: OwnedSemaphorePermit,
    requests: Arc<AtomicUsize>,
    /// Runs while nothing is being answered.
    idle: Pin<Box<Sleep>>,
    /// Something was being answered when the peer was last listened to.
    answered: bool,
    /// Runs while the peer does not read.
    stalled: Option<Pin<Box<Sleep>>>,
}

impl Line {
    fn new(stream: TcpStream, place: OwnedSemaphorePermit) -> Line {
        // A short answer is one segment; a failure means only that it leaves a little later.
        let _ = stream.set_nodelay(true);
        Line {
            stream,
            _place: place,
            requests: Arc::default(),
            idle: Box::pin(tokio::time::sleep(IDLE)),
            answered: false,
            stalled: None,
        }
    }

    fn idle_for_too_long(&mut self, context: &mut Context<'_>) -> bool {
        if self.requests.load(Ordering::Relaxed) > 0 {
            self.answered = true;
            return false;
        }
        if std::mem::take(&mut self.answered) {
            self.idle.as_mut().reset(Instant::now() + IDLE);
        }
        self.idle.as_mut().poll(context).is_ready()
    }

    fn stalled_for_too_long(&mut self, context: &mut Context<'_>) -> bool {
        let stalled = self
            .stalled
            .get_or_insert_with(|| Box::pin(tokio::time::sleep(IDLE)));
        stalled.as_mut().poll(context).is_ready()
    }
}

impl AsyncRead for Line {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let late = self.idle_for_too_long(context);
        match Pin::new(&mut self.stream).poll_read(context, buffer) {
            Poll::Pending if late => Poll::Ready(Err(io::ErrorKind::TimedOut.into())),
            other => other,
        }
    }
}

impl AsyncWrite for Line {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        if written.is_ready() {
            self.stalled = None;
        } else if self.stalled_for_too_long(context) {
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

/// What a request knows of its connection.
#[derive(Debug, Clone)]
pub struct Place {
    /// The address the peer has dialled.
    pub reached_at: Option<SocketAddr>,
    requests: Arc<AtomicUsize>,
}

impl Place {
    /// A request is being answered until the value returned is dropped.
    pub fn busy(&self) -> Busy {
        self.requests.fetch_add(1, Ordering::Relaxed);
        Busy(Arc::clone(&self.requests))
    }
}

impl Connected<IncomingStream<'_, Bounded>> for Place {
    fn connect_info(stream: IncomingStream<'_, Bounded>) -> Place {
        let line = stream.io();
        Place {
            reached_at: line.stream.local_addr().ok(),
            requests: Arc::clone(&line.requests),
        }
    }
}

/// Keeps a connection from counting as idle.
#[derive(Debug)]
pub struct Busy(Arc<AtomicUsize>);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
