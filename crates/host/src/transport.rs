//! The way to a controller over blocking TCP streams and serial lines. A host does one thing at a time, so blocking
//! calls are enough.

mod serial;
mod tcp;

pub use serial::SerialTransport;
pub use tcp::TcpTransport;

use std::io;
use std::time::Duration;

/// A connection with its clock.
pub trait Transport {
    /// Time since any moment.
    fn now(&self) -> Duration;

    /// Sends bytes in one write.
    ///
    /// # Errors
    /// The connection has ended, or takes no bytes.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes until this time. Returns none if the time comes first, or earlier.
    ///
    /// # Errors
    /// The connection has ended: [`io::ErrorKind::UnexpectedEof`] if the controller closed it.
    fn receive(&mut self, until: Duration) -> io::Result<Vec<u8>>;
}

/// Longest wait of one call to a socket or serial port.
const LONGEST_WAIT: Duration = Duration::from_secs(3_600);

/// Whether the read was ended by its time limit or a signal.
fn is_timeout(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    [WouldBlock, TimedOut, Interrupted].contains(&error.kind())
}
