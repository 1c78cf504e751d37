//! The connection of `ts3100 host`: recognizes a web server at the address, names the address in errors, and warns of
//! what was received besides the reply. The exchanges are [`ts3100_host::Client`]'s.

use super::address::{NoAnswer, dial, robot_hint};
use crate::log::print_warning;
use std::fmt::Display;
use std::io;
use std::time::Duration;
use ts3100_host::client::Shown;
use ts3100_host::{Client, ClientError, Options, TcpTransport, Transport};

/// Beginning of a reply of a web server.
const HTTP: &[u8] = b"HTTP/1.";

/// A host at the address of the command line.
pub(super) type Session = Client<Connection>;

/// A connection that ends with an error when a web server replies.
#[derive(Debug)]
pub(super) struct Connection(TcpTransport);

/// The error for a web server.
#[derive(Debug, thiserror::Error)]
#[error("the reply is HTTP, as from the control interface: give the address of IP0")]
struct WebServer;

impl Transport for Connection {
    fn now(&self) -> Duration {
        self.0.now()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.send(bytes)
    }

    fn receive(&mut self, until: Duration) -> io::Result<Vec<u8>> {
        let bytes = self.0.receive(until)?;
        if bytes.starts_with(HTTP) {
            return Err(io::Error::other(WebServer));
        }
        Ok(bytes)
    }
}

/// Connects. `timeout` is the longest wait for the connection and for each text, `total` for everything after it.
pub(super) fn connect(
    address: &str,
    no_stx: bool,
    timeout: Duration,
    total: Duration,
) -> anyhow::Result<Session> {
    let options = match no_stx {
        true => Options::without_stx(),
        false => Options::with_stx(),
    };
    let connection = Connection(dial(address, timeout)?);
    let mut session = Client::new(connection, Options { timeout, ..options });
    session.set_total(Some(total));
    Ok(session)
}

/// The error with the address, and with the address that may have been meant.
pub(super) fn with_address(address: &str, error: &ClientError) -> NoAnswer {
    let (reason, hint) = match error {
        ClientError::Timeout { .. } => (error.to_string(), robot_hint(address)),
        ClientError::Transport(error) => (error.to_string(), robot_hint(address)),
        ClientError::Unexpected { .. }
        | ClientError::File { .. }
        | ClientError::Status { .. }
        | ClientError::Closed { .. } => (error.to_string(), String::new()),
    };
    NoAnswer::new(format_args!("{address}: {reason}{hint}"))
}

/// A content that cannot be decoded.
pub(super) fn unreadable(letters: &str, reason: &impl Display, content: &[u8]) -> NoAnswer {
    let content = Shown(content);
    NoAnswer::new(format_args!(
        "cannot read the reply to {letters}: {reason}; the reply is {content}"
    ))
}

/// Warns of what was received besides the reply.
pub(super) fn warn(session: &mut Session) {
    if session.take_stops() > 0 {
        print_warning("SP came before the reply: the program has stopped");
    }
    match session.take_skipped() {
        0 => {}
        bytes => print_warning(format_args!("skipped {bytes} bytes outside a text")),
    }
}
