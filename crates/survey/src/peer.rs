//! The connections of a survey to a controller, over Ethernet or a serial port. The transports are `ts3100-host`'s;
//! `tests/src/virtual_peer.rs` has a peer in virtual time.

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use ts3100_host::{SerialTransport, TcpTransport, Transport};
use ts3100_proto::parameter::SerialSettings;

/// Longest wait for a connection, and until the network takes bytes.
const CONNECT: Duration = Duration::from_secs(5);

/// A connection of a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Connection {
    /// The one for commands: IP0 or HOST.
    Commands,
    /// Another one to the same port.
    Second,
    /// The channel IP1, for PRINT and INPUT.
    Channel,
}

/// Why bytes cannot be sent or received.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PeerError {
    /// The controller cannot be reached. The reason names no address: files of surveys have it.
    #[error("{0}")]
    Unreachable(String),
    /// The controller ended the connection.
    #[error("the controller closed the connection")]
    Closed,
    /// Somebody wants the survey to end.
    #[error("it was interrupted")]
    Interrupted,
    /// A serial line has one connection and no channel.
    #[error("a serial line has no such connection")]
    Absent,
}

/// A controller, real or emulated, with its time.
pub trait Peer {
    /// Time since an arbitrary start.
    fn now(&self) -> Duration;

    /// Opens a connection; one that is open is closed before.
    ///
    /// # Errors
    /// The controller cannot be reached, or this type of peer has no such connection.
    fn open(&mut self, connection: Connection) -> Result<(), PeerError>;

    /// Closes a connection. Nothing happens if it is closed.
    fn close(&mut self, connection: Connection);

    /// Sends bytes.
    ///
    /// # Errors
    /// The connection has ended.
    fn send(&mut self, connection: Connection, bytes: &[u8]) -> Result<(), PeerError>;

    /// Waits for bytes until this time. None: no byte came.
    ///
    /// # Errors
    /// The connection has ended.
    fn receive(&mut self, connection: Connection, until: Duration) -> Result<Vec<u8>, PeerError>;

    /// Whether it is a serial line, on which each character takes its time.
    fn is_serial(&self) -> bool {
        false
    }
}

/// Receives until this time of a peer that began at `start`.
fn receive(
    transport: Option<&mut impl Transport>,
    start: Instant,
    until: Duration,
) -> Result<Vec<u8>, PeerError> {
    let transport = transport.ok_or(PeerError::Closed)?;
    let wait = until.saturating_sub(start.elapsed());
    let until = transport.now() + wait;
    transport.receive(until).map_err(|_| PeerError::Closed)
}

fn send(transport: Option<&mut impl Transport>, bytes: &[u8]) -> Result<(), PeerError> {
    let transport = transport.ok_or(PeerError::Closed)?;
    transport.send(bytes).map_err(|_| PeerError::Closed)
}

/// A controller at an address.
#[derive(Debug)]
pub struct TcpPeer {
    ip0: SocketAddr,
    ip1: SocketAddr,
    start: Instant,
    connections: BTreeMap<Connection, TcpTransport>,
}

impl TcpPeer {
    /// The controller with IP0 and IP1 at these addresses. Nothing is connected yet.
    pub fn new(ip0: SocketAddr, ip1: SocketAddr) -> TcpPeer {
        TcpPeer {
            ip0,
            ip1,
            start: Instant::now(),
            connections: BTreeMap::new(),
        }
    }
}

impl Peer for TcpPeer {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn open(&mut self, connection: Connection) -> Result<(), PeerError> {
        self.close(connection);
        let address = match connection {
            Connection::Commands | Connection::Second => self.ip0,
            Connection::Channel => self.ip1,
        };
        let port = address.port();
        let unreachable = |error| PeerError::Unreachable(format!("cannot connect to port {port}: {error}"));
        let transport = TcpTransport::connect(address, CONNECT).map_err(unreachable)?;
        self.connections.insert(connection, transport);
        Ok(())
    }

    fn close(&mut self, connection: Connection) {
        self.connections.remove(&connection);
    }

    fn send(&mut self, connection: Connection, bytes: &[u8]) -> Result<(), PeerError> {
        send(self.connections.get_mut(&connection), bytes)
    }

    fn receive(&mut self, connection: Connection, until: Duration) -> Result<Vec<u8>, PeerError> {
        receive(self.connections.get_mut(&connection), self.start, until)
    }
}

/// A controller at a serial port.
#[derive(Debug)]
pub struct SerialPeer {
    device: String,
    settings: SerialSettings,
    start: Instant,
    transport: Option<SerialTransport>,
}

impl SerialPeer {
    /// The controller at this port, such as `/dev/ttyUSB0` or `COM3`, with the settings of its `[U06]`. Nothing is opened
    /// yet.
    pub fn new(device: &str, settings: SerialSettings) -> SerialPeer {
        SerialPeer {
            device: device.to_owned(),
            settings,
            start: Instant::now(),
            transport: None,
        }
    }

    fn transport(&mut self, connection: Connection) -> Result<Option<&mut SerialTransport>, PeerError> {
        match connection {
            Connection::Commands => Ok(self.transport.as_mut()),
            Connection::Second | Connection::Channel => Err(PeerError::Absent),
        }
    }
}

impl Peer for SerialPeer {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn open(&mut self, connection: Connection) -> Result<(), PeerError> {
        self.transport(connection)?;
        self.close(connection);
        let unreachable =
            |error: io::Error| PeerError::Unreachable(format!("cannot open the serial port: {error}"));
        let transport = SerialTransport::open(&self.device, &self.settings).map_err(unreachable)?;
        self.transport = Some(transport);
        Ok(())
    }

    fn close(&mut self, connection: Connection) {
        if connection == Connection::Commands {
            self.transport = None;
        }
    }

    fn send(&mut self, connection: Connection, bytes: &[u8]) -> Result<(), PeerError> {
        send(self.transport(connection)?, bytes)
    }

    fn receive(&mut self, connection: Connection, until: Duration) -> Result<Vec<u8>, PeerError> {
        let start = self.start;
        receive(self.transport(connection)?, start, until)
    }

    fn is_serial(&self) -> bool {
        true
    }
}
