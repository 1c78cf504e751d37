//! Waiting for sockets. The system may call one ready for ever that takes and gives nothing (a peer that has closed it
//! while it is full, for one): who waits in a loop would then keep every other task from its turn. Here each wait is
//! counted, and after some of them the others have theirs, whatever the system says.

use std::io;
use tokio::io::{Interest, Ready};
use tokio::net::TcpStream;
use tokio::task::coop::consume_budget;

/// Waits until one of these may be done. Cancel safe.
pub(crate) async fn ready(stream: &TcpStream, interest: Interest) -> io::Result<Ready> {
    consume_budget().await;
    stream.ready(interest).await
}

/// Waits until something may be read. Cancel safe.
pub(crate) async fn readable(stream: &TcpStream) -> io::Result<()> {
    ready(stream, Interest::READABLE).await.map(drop)
}

/// Waits until something may be written. Cancel safe.
pub(crate) async fn writable(stream: &TcpStream) -> io::Result<()> {
    ready(stream, Interest::WRITABLE).await.map(drop)
}

/// Writes everything.
pub(crate) async fn write_all(stream: &TcpStream, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        writable(stream).await?;
        match stream.try_write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
