//! One channel: where its connections come from, the one that it serves, and those that wait for the end of their
//! predecessor. The Ethernet channels and the serial lines over TCP are each a [`Channel`]. Bytes are read and written by
//! `connection`.

use super::connection::{self, Connection, WRITE_QUEUE};
use super::listen::Acceptor;
use super::shared::{Claim, reset};
use super::{CLOSE_GRACE, NewConnection, SecondConnection};
use crate::portion::log_bytes;
use std::collections::VecDeque;
use std::future::Future;
use std::net::Shutdown;
use std::pin::Pin;
use std::task::{Context, Poll, Waker};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio::time::{Sleep, sleep};
use tracing::{debug, info, warn};
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::{Bytes, Input, Port};

/// Connections that may wait on one channel: a host that connects and closes several times in a row.
const MAX_WAITING_CONNECTIONS: usize = 4;

/// End of a peer whose bytes would keep the next host out, though it may be gone.
const FLOODS: &str = "floods the port; its unread bytes are dropped";

/// A connection that waits for its predecessor to end.
struct Waiting {
    connection: NewConnection,
    /// Time after which it is refused if its predecessor stays; `None` afterwards.
    overdue: Option<Pin<Box<Sleep>>>,
}

/// Origin of the connections of a channel.
pub(super) enum Source {
    /// Peers connect.
    Accepted(Acceptor),
    /// Peers connect to a shared port.
    Claimed(Claim),
    /// A task dials them.
    Dialled(JoinHandle<()>, mpsc::Receiver<NewConnection>),
}

/// A channel and its connections.
pub(crate) struct Channel {
    port: Port,
    second: SecondConnection,
    source: Source,
    connection: Option<Connection>,
    /// Connections that wait, in the order of their arrival.
    waiting: VecDeque<Waiting>,
    /// A new connection is taken before the present one is read again.
    accepts_first: bool,
    /// Unread bytes of a peer that has closed are dropped when the next one has waited for [`CLOSE_GRACE`].
    drops_unread: bool,
}

impl Channel {
    pub(super) fn new(port: Port, second: SecondConnection, source: Source) -> Channel {
        Channel {
            port,
            second,
            source,
            connection: None,
            waiting: VecDeque::new(),
            accepts_first: false,
            drops_unread: false,
        }
    }

    /// The channel of a serial line, on which bytes take time: those of a closed peer do not keep the next one out.
    pub(crate) fn for_serial_line(self) -> Channel {
        Channel {
            drops_unread: true,
            ..self
        }
    }

    /// A channel to which peers connect.
    pub(crate) fn accepting(port: Port, second: SecondConnection, listener: TcpListener) -> Channel {
        Channel::new(port, second, Source::Accepted(Acceptor::new(listener)))
    }

    /// The inputs of the controller that result from the next event; at most `most` bytes are read. Without a context
    /// the system itself is asked, whatever the runtime knows of the sockets, so nothing that has arrived is overlooked.
    pub(crate) fn poll(&mut self, most: usize, mut context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        for accepts in [self.accepts_first, !self.accepts_first] {
            let context = context.as_deref_mut();
            let inputs = if accepts {
                self.poll_incoming(context)
            } else {
                let connection = self.connection.as_mut();
                let read = connection.map_or(Poll::Pending, |connection| connection.poll(most, context));
                read.map(|bytes| match bytes {
                    Some(bytes) => vec![Input::received(self.port, bytes)],
                    None => self.end("disconnected", Connection::finish),
                })
            };
            if inputs.is_ready() {
                self.accepts_first = !accepts;
                return inputs;
            }
        }
        Poll::Pending
    }

    fn poll_incoming(&mut self, context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        if context.is_none() {
            let inputs = self.accept_arrived(true);
            if !inputs.is_empty() {
                return Poll::Ready(inputs);
            }
        }
        let mut unheard = Context::from_waker(Waker::noop());
        let context = context.unwrap_or(&mut unheard);
        let incoming = match &mut self.source {
            Source::Accepted(acceptor) => acceptor.poll(self.port, context).map(Some),
            Source::Claimed(claim) => claim.connections.poll_recv(context),
            Source::Dialled(_, dialled) => dialled.poll_recv(context),
        };
        if let Poll::Ready(Some(incoming)) = incoming {
            return Poll::Ready(self.on_connected(incoming));
        }
        for index in 0..self.waiting.len() {
            if let Some(waiting) = self.waiting.get_mut(index)
                && let Some(overdue) = &mut waiting.overdue
                && overdue.as_mut().poll(context).is_ready()
            {
                waiting.overdue = None;
                return Poll::Ready(self.refuse_overdue(index));
            }
        }
        Poll::Pending
    }

    /// The socket at which the channel listens while it has no peer.
    pub(super) fn idle_listener(&self) -> Option<&TcpListener> {
        match &self.source {
            _ if self.connection.is_some() => None,
            Source::Accepted(acceptor) => Some(acceptor.listener()),
            Source::Claimed(claim) => claim.listener(),
            Source::Dialled(..) => None,
        }
    }

    /// Accepts what has arrived if the channel has no peer; at the socket only if something `has_arrived` there.
    pub(super) fn accept_arrived(&mut self, has_arrived: bool) -> Vec<Input> {
        let arrived = match &mut self.source {
            _ if self.connection.is_some() => None,
            Source::Accepted(acceptor) if has_arrived => acceptor.accept_now(self.port),
            Source::Claimed(claim) => claim.arrived(has_arrived),
            Source::Accepted(_) | Source::Dialled(..) => None,
        };
        arrived.map_or_else(Vec::new, |incoming| self.on_connected(incoming))
    }

    fn on_connected(&mut self, incoming: NewConnection) -> Vec<Input> {
        let port = self.port;
        match &self.connection {
            None => vec![self.connect(incoming)],
            // Otherwise the next host would be refused until all of it is answered.
            Some(old) if self.waiting.len() < MAX_WAITING_CONNECTIONS && old.is_flooding() => {
                self.waiting.push_back(Waiting {
                    connection: incoming,
                    overdue: None,
                });
                self.end(FLOODS, Connection::abort)
            }
            // A host that has closed and is already back is not refused: it is served as soon as the old
            // connection is read to its end.
            Some(old)
                if self.waiting.len() < MAX_WAITING_CONNECTIONS
                    && (old.peer_has_closed() || self.second == SecondConnection::Refuse) =>
            {
                self.waiting.push_back(Waiting {
                    connection: incoming,
                    overdue: Some(Box::pin(sleep(CLOSE_GRACE))),
                });
                Vec::new()
            }
            Some(old) if self.second == SecondConnection::Refuse => vec![refuse(port, &incoming, old)],
            Some(_) => {
                self.waiting.clear();
                let mut inputs = vec![second_peer(port, &incoming, true)];
                inputs.extend(self.end(&format!("replaced by {}", incoming.1), Connection::abort));
                inputs.push(self.connect(incoming));
                inputs
            }
        }
    }

    /// Refuses a waiting connection if the previous one is still open and not about to close. On a serial line one that has
    /// closed makes room for it, and anywhere one that floods the port by now.
    fn refuse_overdue(&mut self, index: usize) -> Vec<Input> {
        if self.connection.as_ref().is_some_and(Connection::is_flooding) {
            return self.end(FLOODS, Connection::abort);
        }
        let has_closed = self.connection.as_ref().is_some_and(Connection::peer_has_closed);
        if self.drops_unread && has_closed {
            return self.end("has gone; its unread output is dropped", Connection::abort);
        }
        let old = self.connection.as_ref().filter(|old| !old.peer_has_closed());
        let refused = old.and_then(|old| {
            let incoming = self.waiting.remove(index)?.connection;
            Some(refuse(self.port, &incoming, old))
        });
        refused.into_iter().collect()
    }

    fn connect(&mut self, incoming: NewConnection) -> Input {
        let (port, peer) = (self.port, incoming.1);
        info!(port = port.name(), "{port}: {peer} connected");
        self.connection = Some(Connection::new(port, incoming));
        Input::Connected {
            port,
            peer: peer.to_string(),
        }
    }

    /// Ends the connection, if there is one; the channel continues to accept or dial.
    fn end(&mut self, what: &str, how: impl FnOnce(Connection)) -> Vec<Input> {
        let port = self.port;
        let Some(connection) = self.connection.take() else {
            return Vec::new();
        };
        info!(port = port.name(), "{port}: {} {what}", connection.peer);
        how(connection);
        self.next_peer()
    }

    /// The connection has ended; the first waiting connection takes its place.
    fn next_peer(&mut self) -> Vec<Input> {
        let next = self.waiting.pop_front();
        // The others now wait for a new connection, which may stay.
        for waiting in &mut self.waiting {
            waiting.overdue = Some(Box::pin(sleep(CLOSE_GRACE)));
        }
        let mut inputs = vec![Input::Disconnected { port: self.port }];
        inputs.extend(next.map(|waiting| self.connect(waiting.connection)));
        inputs
    }

    /// Closes the connection at once.
    pub(crate) fn drop_peer(&mut self) -> Vec<Input> {
        self.end("is dropped", Connection::abort)
    }

    /// Ends the connection because of a fault.
    pub(crate) fn disconnect(&mut self, how: DisconnectMode) -> Vec<Input> {
        self.end("is cut off (fault)", |connection| match how {
            DisconnectMode::Reset => connection.reset(),
            DisconnectMode::Close => connection.finish(),
        })
    }

    /// Stops reading and writing on the connection, which stays open (a half-open peer).
    pub(crate) fn stall(&mut self) {
        if let Some(connection) = &mut self.connection {
            let (port, peer) = (self.port, connection.peer);
            info!(port = port.name(), "{port}: {peer} is half-open (fault)");
            connection.stalled = true;
        }
    }

    /// Closes the channel; whether it was connected.
    pub(super) fn close(self) -> bool {
        if let Source::Dialled(task, _) = self.source {
            task.abort();
        }
        self.connection.map(Connection::abort).is_some()
    }

    /// Closes every connection, also those that have arrived and are not accepted. Returns whether the channel was
    /// connected, and the channel if it listens; otherwise it is closed.
    pub(super) fn clear(mut self) -> (bool, Option<Channel>) {
        let Source::Accepted(acceptor) = &self.source else {
            return (self.close(), None);
        };
        while let Some((stream, ..)) = acceptor.accept_now(self.port) {
            // As the system does when the socket that listens is closed.
            reset(&stream);
        }
        self.waiting.clear();
        let connected = self.connection.take().map(Connection::abort).is_some();
        (connected, Some(self))
    }

    /// Writes at once what the system takes; the rest waits until the socket is writable. A peer that does not read is
    /// disconnected.
    pub(crate) fn send(&mut self, bytes: Bytes) -> Vec<Input> {
        let port = self.port;
        let Some(connection) = &mut self.connection else {
            debug!(
                port = port.name(),
                "{port}: {} bytes dropped: no peer is connected",
                bytes.len()
            );
            return Vec::new();
        };
        if connection.stalled {
            return Vec::new();
        }
        log_bytes(port, '>', &bytes);
        connection.send(bytes);
        if connection.unsent.writes.len() <= WRITE_QUEUE {
            return Vec::new();
        }
        let peer = connection.peer;
        warn!(
            port = port.name(),
            "{port}: closed {peer}: it does not read, {WRITE_QUEUE} writes are unsent"
        );
        if let Some(connection) = self.connection.take() {
            connection.abort();
        }
        let mut inputs = vec![Input::Backlogged { port }];
        inputs.extend(self.next_peer());
        inputs
    }

    /// Whether the peer has left something unread that was sent.
    pub(crate) fn has_unsent(&self) -> bool {
        let connection = self.connection.as_ref();
        connection.is_some_and(|connection| !connection.unsent.writes.is_empty())
    }
}

fn refuse(port: Port, incoming: &NewConnection, old: &Connection) -> Input {
    info!(
        port = port.name(),
        "{port}: {} refused, {} is connected (channel.second=refuse)", incoming.1, old.peer
    );
    connection::close(&incoming.0, Shutdown::Both);
    second_peer(port, incoming, false)
}

fn second_peer(port: Port, incoming: &NewConnection, kept: bool) -> Input {
    Input::SecondPeer {
        port,
        peer: incoming.1.to_string(),
        kept,
    }
}
