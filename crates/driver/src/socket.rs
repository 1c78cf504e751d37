//! Readiness of TCP sockets, with the task budget of the runtime applied.
//!
//! The system can report a socket as ready for ever although it accepts no data, for example a full socket whose peer has
//! closed. A loop around such a socket would starve all other tasks. Every wait here consumes task budget, so that the
//! task yields from time to time.

use std::io;
use tokio::io::{Interest, Ready};
use tokio::net::TcpStream;
use tokio::task::coop::consume_budget;

/// Waits for one of the given operations. Cancel safe.
pub async fn ready(stream: &TcpStream, interest: Interest) -> io::Result<Ready> {
    consume_budget().await;
    stream.ready(interest).await
}

/// Writes all bytes.
pub async fn write_all(stream: &TcpStream, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        ready(stream, Interest::WRITABLE).await?;
        match stream.try_write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
