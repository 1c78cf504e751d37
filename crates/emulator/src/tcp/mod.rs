//! The Ethernet channels IP0 to IP3 as TCP sockets: who is connected to which channel, and bytes in both directions.
//! Nothing here knows what the bytes mean.
//!
//! The driver owns [`Channels`] and is the only one that changes it. Accepting (`listen`), dialling (`dial`), reading and
//! writing (`connection`) are tasks that send it [`ChannelMessage`]s. Start with [`Channels::handle_message`].

mod connection;
mod dial;
mod listen;

pub(crate) use connection::{has_closed, prepare};
pub use listen::ChannelError;
pub(crate) use listen::{bind, open};

use crate::config::{LinkOptions, Ports, SecondConnection};
use crate::port_queues::{PortQueues, SplitPortion, split_bytes};
use connection::Connection;
use listen::ReservedPort;
use std::collections::{BTreeMap, VecDeque};
use std::net::{IpAddr, SocketAddr};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use tracing::{debug, info, warn};
use ts3100_controller::input::Input;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::port::Port;
use ts3100_controller::{ChannelConfig, NetworkConfig};
use ts3100_proto::parameter::OpenMode;

/// A message of a connection task to the driver.
#[derive(Debug)]
pub enum ChannelMessage {
    /// A peer has connected or was dialled.
    Connected {
        /// Channel it connected to.
        port: Port,
        /// The accepted or dialled connection.
        stream: TcpStream,
        /// Address of the peer.
        peer: SocketAddr,
        /// Dropped with the connection, which tells the dialling task to dial again.
        on_drop: Option<oneshot::Sender<()>>,
    },
    /// Bytes were received.
    Received {
        /// Channel that received them.
        port: Port,
        /// Number of the connection.
        id: u64,
        /// The bytes as read from the socket.
        bytes: Vec<u8>,
    },
    /// A waiting connection has waited 50 ms for the previous one to end.
    Overdue {
        /// Channel it waits for.
        port: Port,
        /// Address of the waiting peer.
        peer: SocketAddr,
    },
    /// The peer has closed; the last message of a connection.
    Ended {
        /// Channel it was connected to.
        port: Port,
        /// Number of the connection.
        id: u64,
    },
}

impl ChannelMessage {
    /// Port that the message concerns.
    #[must_use]
    pub fn port(&self) -> Port {
        match self {
            ChannelMessage::Connected { port, .. }
            | ChannelMessage::Received { port, .. }
            | ChannelMessage::Overdue { port, .. }
            | ChannelMessage::Ended { port, .. } => *port,
        }
    }
}

impl SplitPortion for ChannelMessage {
    fn split_portion(&mut self, port: Port) -> Option<ChannelMessage> {
        let ChannelMessage::Received { id, bytes, .. } = self else {
            return None;
        };
        let (id, bytes) = (*id, split_bytes(port, bytes)?);
        Some(ChannelMessage::Received { port, id, bytes })
    }
}

/// How long a second connection waits before it is refused. A host that reconnects at once may be seen here
/// before its close, when the machine is busy.
pub(crate) const CLOSE_GRACE: Duration = Duration::from_millis(50);

/// Connections that may wait on one channel: a host that connects and closes several times in a row.
const MAX_WAITING_CONNECTIONS: usize = 4;

/// A connection that has no channel yet: stream, peer, and the sender to drop with it.
type NewConnection = (TcpStream, SocketAddr, Option<oneshot::Sender<()>>);

#[derive(Default)]
struct Channel {
    /// The accepting or dialling task.
    source: Option<JoinHandle<()>>,
    connection: Option<Connection>,
    /// In the order of their arrival.
    waiting: VecDeque<NewConnection>,
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
    next_id: u64,
    /// Messages of the tasks; when a queue is full, TCP flow control stops the peer.
    messages: PortQueues<ChannelMessage>,
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
            next_id: 0,
            messages: PortQueues::default(),
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
            let source = tokio::spawn(listen::accept(port, listener, self.messages.sender(port)));
            self.channels.entry(port).or_default().source = Some(source);
            ports.insert(port, actual);
        }
        for (port, channel) in planned(plan, OpenMode::Client) {
            let peer = SocketAddr::new(IpAddr::from(channel.peer_address), channel.peer_port);
            info!(port = port.name(), "{port} dials {peer}");
            let driver = self.messages.sender(port);
            let source = tokio::spawn(dial::dial(port, peer, self.options.redial, driver));
            self.channels.entry(port).or_default().source = Some(source);
        }
        Ok(ports)
    }

    /// Closes every channel and connection; returns the channels that were connected.
    pub async fn close(&mut self) -> Vec<Port> {
        let mut connected = Vec::new();
        for (port, channel) in std::mem::take(&mut self.channels) {
            if let Some(source) = channel.source {
                source.abort();
                // A listening socket is free only when its task is gone.
                let _ = source.await;
            }
            if let Some(connection) = channel.connection {
                connection.abort();
                connected.push(port);
            }
        }
        // Messages of closed connections are dropped with the old queues.
        self.messages = PortQueues::default();
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

    /// Returns the next message of a connection task, taking the channels in rotation.
    pub fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<ChannelMessage> {
        self.messages.poll_next(context)
    }

    /// Handles a message and returns the resulting inputs of the controller.
    pub fn handle_message(&mut self, message: ChannelMessage) -> Vec<Input> {
        match message {
            ChannelMessage::Connected {
                port,
                stream,
                peer,
                on_drop,
            } => self.on_connected(port, (stream, peer, on_drop)),
            ChannelMessage::Received { port, id, bytes } if self.is_current(port, id) => {
                vec![Input::received(port, bytes)]
            }
            ChannelMessage::Ended { port, id } if self.is_current(port, id) => self.on_ended(port),
            ChannelMessage::Overdue { port, peer } => self.on_overdue(port, peer).into_iter().collect(),
            ChannelMessage::Received { .. } | ChannelMessage::Ended { .. } => Vec::new(),
        }
    }

    /// Queues bytes for the peer of a port. If the peer has left too much unread, the connection is closed and
    /// the resulting inputs are returned.
    pub async fn send(&mut self, port: Port, bytes: Vec<u8>) -> Vec<Input> {
        let Some(channel) = self.channels.get_mut(&port) else {
            return Vec::new();
        };
        let Some(connection) = &channel.connection else {
            debug!(port = port.name(), "{port}: no peer for {} bytes", bytes.len());
            return Vec::new();
        };
        if connection.send(bytes).await.is_ok() {
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

    fn is_current(&self, port: Port, id: u64) -> bool {
        self.channels
            .get(&port)
            .and_then(|channel| channel.connection.as_ref())
            .is_some_and(|connection| connection.id() == id)
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
                let peer = incoming.1;
                channel.waiting.push_back(incoming);
                self.remind(port, peer);
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

    /// Schedules the check of a waiting connection after [`CLOSE_GRACE`].
    fn remind(&self, port: Port, peer: SocketAddr) {
        let sender = self.messages.sender(port);
        tokio::spawn(async move {
            tokio::time::sleep(CLOSE_GRACE).await;
            // Fails only when the driver has ended.
            let _ = sender.send(ChannelMessage::Overdue { port, peer }).await;
        });
    }

    /// Refuses a waiting connection if the previous one is still open and not about to close.
    fn on_overdue(&mut self, port: Port, peer: SocketAddr) -> Option<Input> {
        let channel = self.channels.entry(port).or_default();
        let old = channel.connection.as_ref().filter(|old| !old.peer_has_closed())?;
        let place = channel.waiting.iter().position(|waiting| waiting.1 == peer);
        let incoming = place.and_then(|place| channel.waiting.remove(place))?;
        Some(refuse(port, &incoming, old))
    }

    fn connect(&mut self, port: Port, (stream, peer, on_drop): NewConnection) -> Input {
        self.next_id += 1;
        info!(port = port.name(), "{port}: {peer} connected");
        let connection = Connection::start(
            port,
            self.next_id,
            stream,
            peer,
            on_drop,
            self.messages.sender(port),
        );
        self.channels.entry(port).or_default().connection = Some(connection);
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
        let waiting = channel.waiting.pop_front();
        let others: Vec<SocketAddr> = channel.waiting.iter().map(|waiting| waiting.1).collect();
        let mut inputs = vec![Input::Disconnected { port }];
        inputs.extend(waiting.map(|incoming| self.connect(port, incoming)));
        // The others now wait for a new connection, which may stay.
        for peer in others {
            self.remind(port, peer);
        }
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
