//! A controller behind Ethernet.

use super::{Line, Peer, PeerError};
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Longest wait for a connection.
const CONNECT: Duration = Duration::from_secs(5);
/// Longest wait until the network takes bytes.
const WRITE: Duration = Duration::from_secs(5);
/// Bytes read at once.
const READ_BUFFER: usize = 1_024;
/// Systems wait at a socket in steps of some milliseconds. The last of them is slept, which is exact: most waits are the pause
/// before a text, and a thousand of them would take seconds more.
const STEP: Duration = Duration::from_millis(5);

/// A controller at an address.
#[derive(Debug)]
pub struct TcpPeer {
    ip0: SocketAddr,
    ip1: SocketAddr,
    start: Instant,
    streams: BTreeMap<Line, TcpStream>,
}

impl TcpPeer {
    /// The controller with IP0 and IP1 at these addresses. Nothing is connected yet.
    pub fn new(ip0: SocketAddr, ip1: SocketAddr) -> TcpPeer {
        TcpPeer {
            ip0,
            ip1,
            start: Instant::now(),
            streams: BTreeMap::new(),
        }
    }

    fn stream(&mut self, line: Line) -> Result<&mut TcpStream, PeerError> {
        self.streams.get_mut(&line).ok_or(PeerError::Closed)
    }
}

impl Peer for TcpPeer {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn open(&mut self, line: Line) -> Result<(), PeerError> {
        self.close(line);
        let address = match line {
            Line::Commands | Line::Second => self.ip0,
            Line::Channel => self.ip1,
        };
        let port = address.port();
        let unreachable = |error| PeerError::Unreachable(format!("cannot connect to port {port}: {error}"));
        let stream = TcpStream::connect_timeout(&address, CONNECT).map_err(unreachable)?;
        stream
            .set_nodelay(true)
            .and_then(|()| stream.set_write_timeout(Some(WRITE)))
            .map_err(unreachable)?;
        self.streams.insert(line, stream);
        Ok(())
    }

    fn close(&mut self, line: Line) {
        self.streams.remove(&line);
    }

    fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError> {
        self.stream(line)?.write_all(bytes).map_err(|_| PeerError::Closed)
    }

    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError> {
        let wait = until.saturating_sub(self.now());
        let is_short = wait <= STEP;
        let stream = self.stream(line)?;
        let prepared = if is_short {
            std::thread::sleep(wait);
            stream.set_nonblocking(true)
        } else {
            stream.set_read_timeout(Some(wait - STEP))
        };
        let mut buffer = [0; READ_BUFFER];
        let read = prepared.and_then(|()| stream.read(&mut buffer));
        if is_short {
            stream.set_nonblocking(false).map_err(|_| PeerError::Closed)?;
        }
        match read {
            Ok(0) => Err(PeerError::Closed),
            Ok(length) => Ok(buffer.get(..length).unwrap_or_default().to_vec()),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
                ) =>
            {
                Ok(Vec::new())
            }
            Err(_) => Err(PeerError::Closed),
        }
    }
}
