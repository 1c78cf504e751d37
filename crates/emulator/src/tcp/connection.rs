//! One TCP connection: a reading and a writing task that share a socket. Each text leaves in one write. The end is
//! reported exactly once, whatever caused it. Which connection a channel serves is decided in [`super`].

use super::ChannelMessage;
use crate::socket;
use socket2::{SockRef, TcpKeepalive};
use std::future::Future;
use std::io;
use std::net::{Shutdown, SocketAddr};
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::timeout;
use tracing::{debug, trace};
use ts3100_controller::port::Port;
use ts3100_proto::escape::Escaped;

/// Queued writes for a peer that does not read: with texts of 255 bytes about 64 KiB, in addition to the
/// buffers of the system.
pub(super) const WRITE_QUEUE: usize = 256;
/// Yields in which the writing task can empty a full queue into the buffers of the system.
const WRITE_YIELDS: u32 = 8;
/// Bytes per read.
const READ_BUFFER: usize = 4_096;
/// How long a peer that has closed its sending half may take to read the queued bytes.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(5);
/// Idle time before the first TCP keepalive probe; [`KEEPALIVE_PROBES`] follow at [`KEEPALIVE_INTERVAL`]
/// (decision D3).
const KEEPALIVE_IDLE: Duration = Duration::from_secs(10);
/// Pause between two keepalive probes.
#[cfg(unix)]
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(5);
/// Unanswered probes after which the peer counts as disconnected.
#[cfg(unix)]
const KEEPALIVE_PROBES: u32 = 3;
/// Longest time without acknowledgement of sent bytes; keepalive does not run during that time.
#[cfg(target_os = "linux")]
const ACKNOWLEDGE_TIMEOUT: Duration = Duration::from_secs(30);

/// The write queue of a connection is full.
pub(super) struct Overflow;

/// A connection with its two tasks.
pub(super) struct Connection {
    id: u64,
    peer: SocketAddr,
    stream: Arc<TcpStream>,
    queue: mpsc::Sender<Vec<u8>>,
    reader: JoinHandle<()>,
    writer: JoinHandle<()>,
    /// A fault has stalled the connection: nothing is read or written.
    stalled: bool,
    /// Dropped with the connection.
    _on_drop: Option<oneshot::Sender<()>>,
}

impl Connection {
    /// Starts the reading and the writing task.
    pub(super) fn start(
        port: Port,
        id: u64,
        stream: TcpStream,
        peer: SocketAddr,
        on_drop: Option<oneshot::Sender<()>>,
        driver: mpsc::Sender<ChannelMessage>,
    ) -> Connection {
        let stream = Arc::new(stream);
        let (queue, queued) = mpsc::channel(WRITE_QUEUE);
        let reader = tokio::spawn(read(port, id, Arc::clone(&stream), driver));
        let writer = tokio::spawn(write(port, Arc::clone(&stream), queued));
        Connection {
            id,
            peer,
            stream,
            queue,
            reader,
            writer,
            stalled: false,
            _on_drop: on_drop,
        }
    }

    pub(super) fn id(&self) -> u64 {
        self.id
    }

    pub(super) fn peer(&self) -> SocketAddr {
        self.peer
    }

    /// Queues one write. A full queue does not prove that the peer does not read, because the controller may
    /// send much at once: let the writing task run first.
    pub(super) async fn send(&self, mut bytes: Vec<u8>) -> Result<(), Overflow> {
        if self.stalled {
            return Ok(());
        }
        for _ in 0..=WRITE_YIELDS {
            match self.queue.try_send(bytes) {
                // Closed: the writing task failed, and the reading task is about to report the end.
                Ok(()) | Err(mpsc::error::TrySendError::Closed(_)) => return Ok(()),
                Err(mpsc::error::TrySendError::Full(back)) => bytes = back,
            }
            tokio::task::yield_now().await;
        }
        Err(Overflow)
    }

    /// Whether the system knows that the peer has closed, though its last bytes may still be unread.
    pub(super) fn peer_has_closed(&self) -> bool {
        has_closed(&self.stream)
    }

    /// Closes the connection at once, without a further message.
    pub(super) fn abort(self) {
        self.reader.abort();
        self.writer.abort();
        close(&self.stream, Shutdown::Both);
    }

    /// Ends the connection by a TCP reset; unsent data is lost.
    pub(super) fn reset(self) {
        self.reader.abort();
        self.writer.abort();
        // The reset is sent when the last of the three owners of the socket drops it, which is when the tasks
        // end.
        if let Err(error) = SockRef::from(&*self.stream).set_linger(Some(Duration::ZERO)) {
            debug!("no reset, an orderly end: {error}");
        }
    }

    /// Stops reading and writing; the connection stays open.
    pub(super) fn stall(&mut self) {
        self.reader.abort();
        self.writer.abort();
        self.stalled = true;
    }

    /// The peer has closed its half: queued bytes are still sent, for at most [`FLUSH_TIMEOUT`].
    pub(super) fn finish(self) {
        let Connection {
            queue,
            mut writer,
            reader,
            ..
        } = self;
        reader.abort();
        drop(queue);
        tokio::spawn(async move {
            if timeout(FLUSH_TIMEOUT, &mut writer).await.is_err() {
                writer.abort();
            }
        });
    }
}

/// Sets the socket options of every connection: no delay, and keepalive to detect a vanished peer.
pub(crate) fn prepare(port: Port, stream: &TcpStream) {
    let socket = SockRef::from(stream);
    let keepalive = TcpKeepalive::new().with_time(KEEPALIVE_IDLE);
    #[cfg(unix)]
    let keepalive = keepalive
        .with_interval(KEEPALIVE_INTERVAL)
        .with_retries(KEEPALIVE_PROBES);
    let set = || -> io::Result<()> {
        socket.set_tcp_nodelay(true)?;
        socket.set_tcp_keepalive(&keepalive)?;
        #[cfg(target_os = "linux")]
        socket.set_tcp_user_timeout(Some(ACKNOWLEDGE_TIMEOUT))?;
        Ok(())
    };
    if let Err(error) = set() {
        debug!(port = port.name(), "{port}: socket options not set: {error}");
    }
}

/// Whether the system knows that the peer has closed, though its last bytes may still be unread.
pub(crate) fn has_closed(stream: &TcpStream) -> bool {
    let ready = pin!(stream.ready(Interest::READABLE));
    match ready.poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(Ok(ready)) => ready.is_read_closed(),
        Poll::Ready(Err(_)) => true,
        Poll::Pending => false,
    }
}

/// Closes a connection that is not served.
pub(super) fn refuse(stream: &TcpStream) {
    close(stream, Shutdown::Both);
}

fn close(stream: &TcpStream, how: Shutdown) {
    // Fails if the peer closed first, which has the same effect.
    let _ = SockRef::from(stream).shutdown(how);
}

async fn read(port: Port, id: u64, stream: Arc<TcpStream>, driver: mpsc::Sender<ChannelMessage>) {
    let mut buffer = [0; READ_BUFFER];
    loop {
        if socket::readable(&stream).await.is_err() {
            break;
        }
        match stream.try_read(&mut buffer) {
            Ok(0) => break,
            Ok(length) => {
                let bytes = buffer.get(..length).unwrap_or_default().to_vec();
                log_bytes(port, '<', &bytes);
                acknowledge(&stream);
                if driver
                    .send(ChannelMessage::Received { port, id, bytes })
                    .await
                    .is_err()
                {
                    return;
                }
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => {
                debug!(port = port.name(), "{port}: reading ended: {error}");
                break;
            }
        }
    }
    // Fails only when the driver has ended.
    let _ = driver.send(ChannelMessage::Ended { port, id }).await;
}

/// Has the system tell the peer at once that its bytes have come. A host that sends OK to an FL text, which nothing
/// answers, and then its next command would otherwise hold that back (Nagle) until the acknowledgement, which the
/// system delays by 40 ms in the hope of an answer to send with it.
fn acknowledge(stream: &TcpStream) {
    #[cfg(target_os = "linux")]
    if let Err(error) = SockRef::from(stream).set_tcp_quickack(true) {
        debug!("acknowledgements may come late: {error}");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
}

async fn write(port: Port, stream: Arc<TcpStream>, mut queued: mpsc::Receiver<Vec<u8>>) {
    while let Some(bytes) = queued.recv().await {
        log_bytes(port, '>', &bytes);
        if let Err(error) = socket::write_all(&stream, &bytes).await {
            debug!(port = port.name(), "{port}: writing ended: {error}");
            // Wakes the reading task, which reports the end.
            close(&stream, Shutdown::Both);
            return;
        }
    }
    close(&stream, Shutdown::Write);
}

/// On a channel without texts the bytes are all there is to show.
fn log_bytes(port: Port, direction: char, bytes: &[u8]) {
    let text = Escaped::for_reading(bytes);
    if port.protocol().is_some() {
        trace!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    } else {
        debug!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    }
}
