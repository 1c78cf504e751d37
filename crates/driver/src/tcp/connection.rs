//! One TCP connection: what is sent is written at once, as far as the system takes it; what was received is read when
//! the driver polls. Each text leaves in one write. Which connection a channel serves is decided in [`super`].

use super::NewConnection;
use crate::portion::{log_bytes, take_portion};
use crate::socket;
#[cfg(target_os = "linux")]
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::{SockRef, TcpKeepalive};
use std::collections::VecDeque;
use std::io::{self, Read as _};
use std::net::{Shutdown, SocketAddr};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::time::timeout;
use tracing::debug;
use ts3100_controller::Bytes;
use ts3100_controller::port::Port;

/// Queued writes for a peer that does not read: with texts of 255 bytes about 64 KiB, in addition to the
/// buffers of the system.
pub(super) const WRITE_QUEUE: usize = 256;
/// Most bytes per read.
pub(crate) const READ_BUFFER: usize = 4_096;
/// Bytes without a pause on a port with texts at which a peer floods it: 128 of the longest texts, of which a host sends the next
/// when it has the answer to the last. Read at the rate of the texts that take longest, they keep the next host waiting for 10 ms.
const FLOOD: usize = 32 * 1024;
/// Time that a peer that has closed its sending half has to read the queued bytes.
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

/// Writes that the system has not taken yet.
#[derive(Default)]
pub(super) struct Unsent {
    pub(super) writes: VecDeque<Bytes>,
    /// Bytes of the first write that the system has taken.
    written: usize,
}

impl Unsent {
    /// Writes until nothing is left or the system takes no more ([`io::ErrorKind::WouldBlock`]).
    pub(super) fn write_to(&mut self, stream: &TcpStream) -> io::Result<()> {
        while let Some(bytes) = self.writes.front() {
            let rest = bytes.get(self.written..).unwrap_or_default();
            // Not `try_write()`: on a new connection the runtime does not know yet that the socket is writable.
            self.written += SockRef::from(stream).send(rest)?;
            if self.written >= bytes.len() {
                self.writes.pop_front();
                self.written = 0;
            }
        }
        Ok(())
    }
}

/// A connection that its poller reads and writes.
pub(super) struct Connection {
    port: Port,
    pub(super) peer: SocketAddr,
    stream: TcpStream,
    pub(super) unsent: Unsent,
    /// Bytes that were read and exceed a portion.
    rest: Vec<u8>,
    /// Bytes that were read since nothing was left to read.
    without_pause: usize,
    /// A fault has stalled the connection: nothing is read or written.
    pub(super) stalled: bool,
    /// Bytes were read, and nothing was sent since: no answer has carried the acknowledgement.
    unacknowledged: bool,
    /// Dropped with the connection.
    _on_drop: Option<oneshot::Sender<()>>,
}

impl Connection {
    pub(super) fn new(port: Port, (stream, peer, on_drop): NewConnection) -> Connection {
        Connection {
            port,
            peer,
            stream,
            unsent: Unsent::default(),
            rest: Vec::new(),
            without_pause: 0,
            stalled: false,
            unacknowledged: false,
            _on_drop: on_drop,
        }
    }

    /// Sends at once what the system takes; the rest waits until the socket is writable.
    pub(super) fn send(&mut self, bytes: Bytes) {
        self.unacknowledged = false;
        self.unsent.writes.push_back(bytes);
        let written = self.unsent.write_to(&self.stream);
        self.note_written(written);
    }

    /// Ends the connection if writing has failed.
    fn note_written(&mut self, written: io::Result<()>) {
        match written {
            Err(error) if error.kind() != io::ErrorKind::WouldBlock => {
                debug!(port = self.port.name(), "{}: writing ended: {error}", self.port);
                self.unsent = Unsent::default();
                // The next read reports the end.
                close(&self.stream, Shutdown::Both);
            }
            Ok(()) | Err(_) => {}
        }
    }

    /// Writes what is unsent if the socket is writable; registers for waking otherwise.
    fn poll_write(&mut self, context: &mut Context<'_>) {
        // Twice: the second call registers for waking after a socket that was thought to be writable was not.
        for _ in 0..2 {
            if self.unsent.writes.is_empty() || self.stream.poll_write_ready(context).is_pending() {
                return;
            }
            let (stream, unsent) = (&self.stream, &mut self.unsent);
            let written = stream.try_io(Interest::WRITABLE, || unsent.write_to(stream));
            self.note_written(written);
        }
    }

    /// Writes what is unsent, and returns the next portion of at most `most` bytes that were received; `None` when the peer
    /// has closed. Without a context it asks the system itself, whatever the runtime knows of the socket.
    pub(super) fn poll(
        &mut self,
        most: usize,
        mut context: Option<&mut Context<'_>>,
    ) -> Poll<Option<Vec<u8>>> {
        if self.stalled {
            return Poll::Pending;
        }
        if let Some(context) = &mut context {
            self.poll_write(context);
        }
        if self.rest.is_empty() {
            if std::mem::take(&mut self.unacknowledged) {
                acknowledge(&self.stream);
            }
            // The caller asks again when there is room: after a deadline of the controller, or when the socket has
            // taken what is unsent.
            if most == 0 {
                return Poll::Pending;
            }
            match ready!(self.poll_read(most, context)) {
                Ok(bytes) if bytes.is_empty() => return Poll::Ready(None),
                Ok(bytes) => self.rest = bytes,
                Err(error) => {
                    debug!(port = self.port.name(), "{}: reading ended: {error}", self.port);
                    return Poll::Ready(None);
                }
            }
            log_bytes(self.port, '<', &self.rest);
            self.unacknowledged = true;
        }
        Poll::Ready(Some(take_portion(self.port, &mut self.rest)))
    }

    fn poll_read(&mut self, most: usize, mut context: Option<&mut Context<'_>>) -> Poll<io::Result<Vec<u8>>> {
        loop {
            if let Some(context) = &mut context {
                ready!(self.stream.poll_read_ready(context))?;
            }
            let mut buffer = [0; READ_BUFFER];
            let (buffer, _) = buffer.split_at_mut(most.min(READ_BUFFER));
            let read = match context {
                Some(_) => self.stream.try_read(buffer),
                None => (&*SockRef::from(&self.stream)).read(buffer),
            };
            match read {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    self.without_pause = 0;
                    if context.is_none() {
                        return Poll::Pending;
                    }
                }
                Ok(count) => {
                    if count < buffer.len() {
                        self.without_pause = 0;
                        self.note_emptied();
                    } else {
                        self.without_pause = self.without_pause.saturating_add(count);
                    }
                    return Poll::Ready(Ok(buffer.get(..count).unwrap_or_default().to_vec()));
                }
                Err(error) => return Poll::Ready(Err(error)),
            }
        }
    }

    /// Tells the runtime that nothing is left to read. It asks the system before it reports further bytes, and learns
    /// then of connections that came before them; so a further read that finds nothing is saved.
    fn note_emptied(&self) {
        let emptied: io::Result<()> = Err(io::ErrorKind::WouldBlock.into());
        // The result is the error that says so.
        let _ = self.stream.try_io(Interest::READABLE, || emptied);
    }

    /// Whether the system knows that the peer has closed, though its last bytes may still be unread. The runtime learns of it only
    /// when it looks at its sockets, and bytes without a pause keep it from that for longer than [`super::CLOSE_GRACE`].
    #[cfg(target_os = "linux")]
    pub(super) fn peer_has_closed(&self) -> bool {
        let mut asked = [PollFd::new(&self.stream, PollFlags::RDHUP)];
        // Nothing is known of one that cannot be asked: it counts as closed.
        poll(&mut asked, Some(&Timespec::default())).map_or(true, |ready| ready > 0)
    }

    /// Whether the runtime knows that the peer has closed, though its last bytes may still be unread.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn peer_has_closed(&self) -> bool {
        use std::future::Future as _;
        use std::pin::pin;
        use std::task::Waker;
        let ready = pin!(self.stream.ready(Interest::READABLE));
        match ready.poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(Ok(ready)) => ready.is_read_closed(),
            Poll::Ready(Err(_)) => true,
            Poll::Pending => false,
        }
    }

    /// Whether more has come without a pause than a host sends that waits for its answers, and some of it is unread. How much of
    /// it is unread says little: the system takes the next from a peer when most of the last is read. The peer's close, if
    /// it has closed, is not seen before all of that is read.
    pub(super) fn is_flooding(&self) -> bool {
        if self.port.protocol().is_none() {
            return false;
        }
        let mut unread = Vec::with_capacity(FLOOD);
        let peeked = SockRef::from(&self.stream).peek(unread.spare_capacity_mut());
        peeked.is_ok_and(|count| count > 0 && self.without_pause.saturating_add(count) >= FLOOD)
    }

    /// Closes the connection at once.
    pub(super) fn abort(self) {
        close(&self.stream, Shutdown::Both);
    }

    /// Ends the connection by a TCP reset; unsent data is lost.
    pub(super) fn reset(self) {
        if let Err(error) = SockRef::from(&self.stream).set_linger(Some(Duration::ZERO)) {
            debug!("cannot reset the connection, closing it instead: {error}");
        }
    }

    /// The peer has closed its half: unsent bytes are still sent, for at most [`FLUSH_TIMEOUT`].
    pub(super) fn finish(mut self) {
        let flush = async move {
            while !self.unsent.writes.is_empty() {
                socket::ready(&self.stream, Interest::WRITABLE).await?;
                let (stream, unsent) = (&self.stream, &mut self.unsent);
                match stream.try_io(Interest::WRITABLE, || unsent.write_to(stream)) {
                    Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(error),
                    Ok(()) | Err(_) => {}
                }
            }
            close(&self.stream, Shutdown::Write);
            Ok(())
        };
        tokio::spawn(timeout(FLUSH_TIMEOUT, flush));
    }
}

/// Sets the socket options of every connection: no delay, and keepalive to detect a vanished peer.
pub(super) fn prepare(port: Port, stream: &TcpStream) {
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
        debug!(
            port = port.name(),
            "{port}: cannot set the socket options: {error}"
        );
    }
}

/// Closes one half of a connection, or both.
pub(super) fn close(stream: &TcpStream, how: Shutdown) {
    // Fails if the peer closed first, which has the same effect.
    let _ = SockRef::from(stream).shutdown(how);
}

/// Has the system tell the peer at once that its bytes have come. A host that sends OK to an FL text, which nothing
/// answers, and then its next command would otherwise hold that back (Nagle) until the acknowledgement, which the
/// system delays by 40 ms in the hope of an answer to send with it. An answer carries the acknowledgement; only bytes
/// that none has followed need this call, which costs as much as a seventh of a whole exchange.
fn acknowledge(stream: &TcpStream) {
    #[cfg(target_os = "linux")]
    if let Err(error) = SockRef::from(stream).set_tcp_quickack(true) {
        debug!("acknowledgements may come late: {error}");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
}
