//! The way to a controller. [`survey`](crate::survey()) does one thing at a time, so blocking calls are enough.

mod serial;
mod tcp;

pub use serial::SerialPeer;
pub use tcp::TcpPeer;

use std::time::Duration;

/// A connection of a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Line {
    /// The one that commands are sent on: IP0 or HOST.
    Commands,
    /// Another one to the same port.
    Second,
    /// The talk channel IP1, for PRINT and INPUT.
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
    /// A serial line has one connection and no talk channel.
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
    /// The controller cannot be reached, or the kind of peer has no such connection.
    fn open(&mut self, line: Line) -> Result<(), PeerError>;

    /// Closes a connection. Nothing happens if it is closed.
    fn close(&mut self, line: Line);

    /// Sends bytes.
    ///
    /// # Errors
    /// The connection has ended.
    fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError>;

    /// Waits for bytes until this time. None: no byte came.
    ///
    /// # Errors
    /// The connection has ended.
    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError>;

    /// Whether it is a serial line, on which each character takes its time.
    fn is_serial(&self) -> bool {
        false
    }
}
