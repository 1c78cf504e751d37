//! A controller on Ethernet.

use super::{LONGEST_WAIT, Transport, is_timeout};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// Bytes read at once.
const READ_BUFFER: usize = 1_024;
/// Systems wait at a socket in steps of some milliseconds. The last of them is slept, which is exact: most waits are the
/// pause before a text, and a thousand of them would take seconds more.
const STEP: Duration = Duration::from_millis(5);

/// A TCP connection to IP0 or another port of a controller.
#[derive(Debug)]
pub struct TcpTransport {
    stream: TcpStream,
    start: Instant,
}

impl TcpTransport {
    /// Connects to the first of these addresses that takes the connection within this time. It is also the longest
    /// time for a write.
    ///
    /// # Errors
    /// The last address that was tried cannot be reached, or there is none.
    pub fn connect(address: impl ToSocketAddrs, timeout: Duration) -> io::Result<TcpTransport> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for candidate in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&candidate, timeout) {
                Ok(stream) => {
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(timeout))?;
                    return Ok(TcpTransport::from(stream));
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

impl From<TcpStream> for TcpTransport {
    /// Uses a connected stream, with its limits for writes.
    fn from(stream: TcpStream) -> TcpTransport {
        TcpTransport {
            stream,
            start: Instant::now(),
        }
    }
}

impl Transport for TcpTransport {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }

    fn receive(&mut self, until: Duration) -> io::Result<Vec<u8>> {
        let wait = until.saturating_sub(self.now()).min(LONGEST_WAIT);
        let is_short = wait <= STEP;
        if is_short {
            std::thread::sleep(wait);
            self.stream.set_nonblocking(true)?;
        } else {
            self.stream.set_read_timeout(Some(wait - STEP))?;
        }
        let mut buffer = [0; READ_BUFFER];
        let read = self.stream.read(&mut buffer);
        if is_short {
            self.stream.set_nonblocking(false)?;
        }
        match read {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(length) => Ok(buffer.get(..length).unwrap_or_default().to_vec()),
            Err(error) if is_timeout(&error) => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
}
