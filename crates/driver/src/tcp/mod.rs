//! The Ethernet channels IP0 to IP3 as TCP sockets: who is connected to which channel, and bytes in both directions.
//! Nothing here knows what the bytes mean.
//!
//! The driver owns [`Channels`] and polls it: accepting (`listen`), reading and writing (`connection`) happen in its own
//! task; only dialling (`dial`) is a task of its own. Start with [`Channels::poll_next`].

mod connection;
mod dial;
mod listen;
mod options;

pub use connection::{has_closed, prepare};
pub use listen::ChannelError;
pub use listen::{bind, open};
pub use options::{LinkOptions, Ports, SecondConnection};

use connection::Connection;
use listen::{Acceptor, ReservedPort};
use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::{Sleep, sleep};
use tracing::{debug, info, warn};
use ts3100_controller::Bytes;
use ts3100_controller::input::Input;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::port::Port;
use ts3100_controller::{ChannelConfig, NetworkConfig};
use ts3100_proto::parameter::OpenMode;

/// How long a second connection waits before it is refused. A host that reconnects at once may be seen here
/// before its close, when the machine is busy.
pub const CLOSE_GRACE: Duration = Duration::from_millis(50);

/// Connections that may wait on one channel: a host that connects and closes several times in a row.
const MAX_WAITING_CONNECTIONS: usize = 4;

/// A connection that has no channel yet: stream, peer, and the sender to drop with it.
type NewConnection = (TcpStream, SocketAddr, Option<oneshot::Sender<()>>);

/// A connection that waits for its predecessor to end.
struct Waiting {
    connection: NewConnection,
    /// When it is refused if its predecessor stays; `None` afterwards.
    overdue: Option<Pin<Box<Sleep>>>,
}

impl Waiting {
    fn new(connection: NewConnection) -> Waiting {
        let overdue = Some(Box::pin(sleep(CLOSE_GRACE)));
        Waiting { connection, overdue }
    }
}

/// Where the connections of a channel come from.
enum Source {
    Accepted(Acceptor),
    Dialled(JoinHandle<()>, mpsc::Receiver<NewConnection>),
}

#[derive(Default)]
struct Channel {
    source: Option<Source>,
    connection: Option<Connection>,
    /// In the order of their arrival.
    waiting: VecDeque<Waiting>,
    /// A new connection is taken before the present one is read again.
    accepts_first: bool,
}

/// What has happened on a channel.
enum ChannelEvent {
    Incoming(NewConnection),
    Received(Vec<u8>),
    Ended,
    /// This waiting connection has waited long enough.
    Overdue(usize),
}

impl Channel {
    /// The next event. Without a context sockets are read whatever the runtime knows of them.
    fn poll(&mut self, port: Port, mut context: Option<&mut Context<'_>>) -> Poll<ChannelEvent> {
        for accepts in [self.accepts_first, !self.accepts_first] {
            let context = context.as_deref_mut();
            let event = if accepts {
                self.poll_incoming(port, context.unwrap_or(&mut Context::from_waker(Waker::noop())))
            } else {
                let connection = self.connection.as_mut();
                connection.map_or(Poll::Pending, |connection| {
                    let received = connection.poll(context);
                    received.map(|bytes| bytes.map_or(ChannelEvent::Ended, ChannelEvent::Received))
                })
            };
            if event.is_ready() {
                self.accepts_first = !accepts;
                return event;
            }
        }
        Poll::Pending
    }

    fn poll_incoming(&mut self, port: Port, context: &mut Context<'_>) -> Poll<ChannelEvent> {
        let incoming = match &mut self.source {
            Some(Source::Accepted(acceptor)) => acceptor.poll(port, context).map(Some),
            Some(Source::Dialled(_, dialled)) => dialled.poll_recv(context),
            None => Poll::Pending,
        };
        if let Poll::Ready(Some(incoming)) = incoming {
            return Poll::Ready(ChannelEvent::Incoming(incoming));
        }
        for (index, waiting) in self.waiting.iter_mut().enumerate() {
            let overdue = waiting.overdue.as_mut();
            if overdue.is_some_and(|overdue| overdue.as_mut().poll(context).is_ready()) {
                waiting.overdue = None;
                return Poll::Ready(ChannelEvent::Overdue(index));
            }
        }
        Poll::Pending
    }
}

/// All Ethernet channels and their connections.
pub struct Channels {
    listen: IpAddr,
    ports: Ports,
    options: LinkOptions,
    channels: BTreeMap<Port, Channel>,
    /// Own port of ETHERNET.PAR and the free port used instead (`--ports auto`); kept, so that a power cycle
    /// gets the same port.
    reserved: BTreeMap<Port, (u16, ReservedPort)>,
    /// The channel that is polled first.
    first: usize,
}

impl Channels {
    /// No channel is open yet.
    #[must_use]
    pub fn new(listen: IpAddr, ports: Ports, options: LinkOptions) -> Channels {
        let (channels, reserved) = (BTreeMap::new(), BTreeMap::new());
        Channels {
            listen,
            ports,
            options,
            channels,
            reserved,
            first: 0,
        }
    }

    /// Opens every channel as planned: all listening sockets are bound before the first one accepts.
    /// Returns the port in use of each server channel.
    ///
    /// # Errors
    /// The first port that cannot be bound; then none is open.
    pub fn open(&mut self, plan: &NetworkConfig) -> Result<BTreeMap<Port, u16>, ChannelError> {
        let mut bound = Vec::new();
        for (port, channel) in planned(plan, OpenMode::Server) {
            bound.push((port, self.bind(port, channel.own_port)?));
        }
        let mut ports = BTreeMap::new();
        for (port, (listener, actual)) in bound {
            let source = Source::Accepted(Acceptor::new(listener));
            self.channels.entry(port).or_default().source = Some(source);
            ports.insert(port, actual);
        }
        for (port, channel) in planned(plan, OpenMode::Client) {
            let peer = SocketAddr::new(IpAddr::from(channel.peer_address), channel.peer_port);
            info!(port = port.name(), "{port} dials {peer}");
            let (sender, dialled) = mpsc::channel(1);
            let task = tokio::spawn(dial::dial(port, peer, self.options.redial, sender));
            self.channels.entry(port).or_default().source = Some(Source::Dialled(task, dialled));
        }
        Ok(ports)
    }

    /// Closes every channel and connection; returns the channels that were connected.
    pub fn close(&mut self) -> Vec<Port> {
        let mut connected = Vec::new();
        for (port, channel) in std::mem::take(&mut self.channels) {
            if let Some(Source::Dialled(task, _)) = channel.source {
                task.abort();
            }
            if let Some(connection) = channel.connection {
                connection.abort();
                connected.push(port);
            }
        }
        connected
    }

    /// Closes the connection of a port at once; the channel continues to accept or dial. Returns the resulting
    /// inputs of the controller.
    pub fn drop_peer(&mut self, port: Port) -> Vec<Input> {
        let channel = self.channels.entry(port).or_default();
        let Some(connection) = channel.connection.take() else {
            return Vec::new();
        };
        info!(port = port.name(), "{port}: {} is dropped", connection.peer());
        connection.abort();
        self.on_ended(port)
    }

    /// The inputs of the controller that result from the next event on a channel, taking the channels in rotation. A
    /// host that sends without pause delays only itself: each turn serves at most one portion of its bytes. Without a
    /// context sockets are read whatever the runtime knows of them, so that nothing that has arrived is overlooked.
    pub fn poll_next(&mut self, mut context: Option<&mut Context<'_>>) -> Poll<(Port, Vec<Input>)> {
        for turn in 0..Port::ETHERNET.len() {
            let index = (self.first + turn) % Port::ETHERNET.len();
            let found = Port::ETHERNET.get(index).copied();
            let Some((port, channel)) = found.and_then(|port| Some((port, self.channels.get_mut(&port)?)))
            else {
                continue;
            };
            if let Poll::Ready(event) = channel.poll(port, context.as_deref_mut()) {
                self.first = index + 1;
                let mut inputs = match event {
                    ChannelEvent::Received(_) => self.connect_arrived(),
                    ChannelEvent::Incoming(_) | ChannelEvent::Ended | ChannelEvent::Overdue(_) => Vec::new(),
                };
                inputs.extend(self.handle_event(port, event));
                return Poll::Ready((port, inputs));
            }
        }
        Poll::Pending
    }

    /// Accepts what has arrived at channels without a peer. A host that has connected IP1 and then sends a command on
    /// IP0 expects that the program finds its peer; the two sockets are not polled in that order.
    fn connect_arrived(&mut self) -> Vec<Input> {
        let mut inputs = Vec::new();
        for port in Port::ETHERNET {
            if let Some(Channel {
                source: Some(Source::Accepted(acceptor)),
                connection: None,
                ..
            }) = self.channels.get(&port)
                && let Some(incoming) = acceptor.accept_now(port)
            {
                inputs.extend(self.on_connected(port, incoming));
            }
        }
        inputs
    }

    fn handle_event(&mut self, port: Port, event: ChannelEvent) -> Vec<Input> {
        match event {
            ChannelEvent::Incoming(incoming) => self.on_connected(port, incoming),
            ChannelEvent::Received(bytes) => vec![Input::received(port, bytes)],
            ChannelEvent::Ended => self.on_ended(port),
            ChannelEvent::Overdue(index) => self.on_overdue(port, index).into_iter().collect(),
        }
    }

    /// Queues bytes for the peer of a port. If the peer has left too much unread, the connection is closed and
    /// the resulting inputs are returned.
    pub fn send(&mut self, port: Port, bytes: Bytes) -> Vec<Input> {
        let Some(channel) = self.channels.get_mut(&port) else {
            return Vec::new();
        };
        let Some(connection) = &mut channel.connection else {
            debug!(port = port.name(), "{port}: no peer for {} bytes", bytes.len());
            return Vec::new();
        };
        if connection.send(bytes).is_ok() {
            return Vec::new();
        }
        warn!(
            port = port.name(),
            "{port}: {} does not read, closed with {} writes unsent",
            connection.peer(),
            connection::WRITE_QUEUE
        );
        if let Some(connection) = channel.connection.take() {
            connection.abort();
        }
        vec![Input::Backlogged { port }, Input::Disconnected { port }]
    }

    /// Ends the connection of a channel because of a fault. Returns the resulting inputs of the controller.
    pub fn disconnect(&mut self, port: Port, how: DisconnectMode) -> Vec<Input> {
        let channel = self.channels.entry(port).or_default();
        let Some(connection) = channel.connection.take() else {
            return Vec::new();
        };
        info!(
            port = port.name(),
            "{port}: {} cut off on purpose",
            connection.peer()
        );
        match how {
            DisconnectMode::Reset => connection.reset(),
            DisconnectMode::Close => connection.finish(),
        }
        self.next_peer(port)
    }

    /// Stops reading and writing on the connection of a channel, which stays open (a half-open peer).
    pub fn stall(&mut self, port: Port) {
        let connection = self
            .channels
            .get_mut(&port)
            .and_then(|channel| channel.connection.as_mut());
        if let Some(connection) = connection {
            info!(
                port = port.name(),
                "{port}: {} is half-open on purpose",
                connection.peer()
            );
            connection.stall();
        }
    }

    /// Binds the listening socket of a channel; returns it with its port number.
    fn bind(&mut self, port: Port, own: u16) -> Result<(TcpListener, u16), ChannelError> {
        let free = SocketAddr::new(self.listen, 0);
        let Ports::Offset(offset) = self.ports else {
            let reserved_port = self.reserved.remove(&port).filter(|(same, _)| *same == own);
            let reserved = match reserved_port {
                Some((_, reserved)) => reserved,
                None => ReservedPort::new(port, free)?,
            };
            let bound = (reserved.listen(port, free)?, reserved.port());
            self.reserved.insert(port, (own, reserved));
            return Ok(bound);
        };
        let requested = own.checked_add(offset).ok_or(ChannelError::PortRange {
            channel: port,
            own,
            offset,
        })?;
        listen::bind(port, SocketAddr::new(self.listen, requested))
    }

    fn on_connected(&mut self, port: Port, incoming: NewConnection) -> Vec<Input> {
        let second = self.options.second;
        let channel = self.channels.entry(port).or_default();
        match &channel.connection {
            None => vec![self.connect(port, incoming)],
            // A host that has closed and is already back is not refused: it is served as soon as the old
            // connection is read to its end.
            Some(old)
                if channel.waiting.len() < MAX_WAITING_CONNECTIONS
                    && (old.peer_has_closed() || second == SecondConnection::Refuse) =>
            {
                channel.waiting.push_back(Waiting::new(incoming));
                Vec::new()
            }
            Some(old) if second == SecondConnection::Refuse => {
                vec![refuse(port, &incoming, old)]
            }
            Some(_) => {
                channel.waiting.clear();
                if let Some(old) = channel.connection.take() {
                    info!(
                        port = port.name(),
                        "{port}: {} replaced by {}",
                        old.peer(),
                        incoming.1
                    );
                    old.abort();
                }
                let second = second_peer(port, &incoming, true);
                vec![second, Input::Disconnected { port }, self.connect(port, incoming)]
            }
        }
    }

    /// Refuses a waiting connection if the previous one is still open and not about to close.
    fn on_overdue(&mut self, port: Port, index: usize) -> Option<Input> {
        let channel = self.channels.entry(port).or_default();
        let old = channel.connection.as_ref().filter(|old| !old.peer_has_closed())?;
        let incoming = channel.waiting.remove(index)?.connection;
        Some(refuse(port, &incoming, old))
    }

    fn connect(&mut self, port: Port, incoming: NewConnection) -> Input {
        let peer = incoming.1;
        info!(port = port.name(), "{port}: {peer} connected");
        self.channels.entry(port).or_default().connection = Some(Connection::new(port, incoming));
        Input::Connected {
            port,
            peer: peer.to_string(),
        }
    }

    fn on_ended(&mut self, port: Port) -> Vec<Input> {
        let channel = self.channels.entry(port).or_default();
        if let Some(connection) = channel.connection.take() {
            info!(port = port.name(), "{port}: {} disconnected", connection.peer());
            connection.finish();
        }
        self.next_peer(port)
    }

    /// The connection of a channel has ended; the first waiting connection takes its place.
    fn next_peer(&mut self, port: Port) -> Vec<Input> {
        let channel = self.channels.entry(port).or_default();
        let next = channel.waiting.pop_front();
        // The others now wait for a new connection, which may stay.
        for waiting in &mut channel.waiting {
            waiting.overdue = Some(Box::pin(sleep(CLOSE_GRACE)));
        }
        let mut inputs = vec![Input::Disconnected { port }];
        inputs.extend(next.map(|waiting| self.connect(port, waiting.connection)));
        inputs
    }
}

fn refuse(port: Port, incoming: &NewConnection, old: &Connection) -> Input {
    info!(
        port = port.name(),
        "{port}: {} refused, {} is connected (channel.second=refuse)",
        incoming.1,
        old.peer()
    );
    connection::refuse(&incoming.0);
    second_peer(port, incoming, false)
}

fn second_peer(port: Port, incoming: &NewConnection, kept: bool) -> Input {
    Input::SecondPeer {
        port,
        peer: incoming.1.to_string(),
        kept,
    }
}

fn planned(plan: &NetworkConfig, mode: OpenMode) -> impl Iterator<Item = (Port, &ChannelConfig)> {
    Port::ETHERNET
        .into_iter()
        .zip(&plan.channels)
        .filter(move |(_, channel)| channel.mode == mode)
}

#[cfg(test)]
mod tests;
