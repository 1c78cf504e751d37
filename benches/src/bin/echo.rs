//! A bare TCP echo server, the baseline with which `startup` compares the emulator. It binds a free port of
//! the loopback interface, prints `{"port":N}`, and echoes until it is killed.

use std::io::{ErrorKind, Result, Write};
use tokio::net::{TcpListener, TcpStream};

const BUFFER: usize = 512;

/// Without tokio's `io-util`: another feature of tokio would have every crate of the workspace built twice, with it for
/// this one and without it for the emulator.
async fn echo(stream: TcpStream) -> Result<()> {
    let mut buffer = [0; BUFFER];
    loop {
        stream.readable().await?;
        let count = match stream.try_read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => continue,
            Err(error) => return Err(error),
        };
        let mut rest = &buffer[..count];
        while !rest.is_empty() {
            stream.writable().await?;
            match stream.try_write(rest) {
                Ok(written) => rest = &rest[written..],
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
        }
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<()> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    println!("{{\"port\":{}}}", listener.local_addr()?.port());
    std::io::stdout().flush()?;
    loop {
        let (stream, _) = listener.accept().await?;
        tokio::spawn(async move { drop(echo(stream).await) });
    }
}
