//! Server channels: binding, with errors that name the remedies, and accepting.

use super::LinkMessage;
use super::connection::prepare;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::mpsc;
use tracing::warn;
use ts3100_controller::port::Port;

/// Connections the system may hold before they are accepted.
const BACKLOG: u32 = 16;
/// Pause after an accept that failed (out of file descriptors, say), so that the log stays readable.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Why a channel cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// Somebody else has the port.
    #[error(
        "{channel} cannot listen on {address}: the port is in use.\n\
         Remedies: `--port-offset 10000` (ports 11000-11003), `--ports auto` (free ports), \
         or end the program that has the port"
    )]
    InUse {
        /// The channel.
        channel: Port,
        /// Where it was to listen.
        address: SocketAddr,
    },
    /// A port below 1024 without the right to it.
    #[error(
        "{channel} cannot listen on {address}: permission denied; ports below 1024 are reserved.\n\
         Remedies: `--port-offset 10000` (ports 11000-11003), `--ports auto` (free ports), \
         `sudo setcap cap_net_bind_service=+ep PATH_TO/ts3100`, \
         or `sudo sysctl net.ipv4.ip_unprivileged_port_start=1000`"
    )]
    Denied {
        /// The channel.
        channel: Port,
        /// Where it was to listen.
        address: SocketAddr,
    },
    /// Anything else the system says, for example an address that is not this machine's.
    #[error("{channel} cannot listen on {address}: {reason}")]
    Io {
        /// The channel.
        channel: Port,
        /// Where it was to listen.
        address: SocketAddr,
        /// What the system said.
        reason: io::Error,
    },
    /// Own port and offset exceed a port number.
    #[error("{channel}: port {own} of ETHERNET.PAR plus --port-offset {offset} exceeds 65535")]
    PortRange {
        /// The channel.
        channel: Port,
        /// Its own port in ETHERNET.PAR.
        own: u16,
        /// The offset.
        offset: u16,
    },
}

/// A listening socket and its address; port 0 asks for a free one.
pub(crate) fn open(address: SocketAddr) -> io::Result<(TcpListener, SocketAddr)> {
    let socket = if address.is_ipv4() {
        TcpSocket::new_v4()?
    } else {
        TcpSocket::new_v6()?
    };
    // On Windows this option would let two programs share the port.
    if cfg!(unix) {
        socket.set_reuseaddr(true)?;
    }
    socket.bind(address)?;
    let listener = socket.listen(BACKLOG)?;
    let actual = listener.local_addr()?;
    Ok((listener, actual))
}

/// The listening socket of a channel and the port it has.
pub(crate) fn bind(channel: Port, address: SocketAddr) -> Result<(TcpListener, u16), LinkError> {
    let opened = open(address).map(|(listener, actual)| (listener, actual.port()));
    opened.map_err(|reason| match reason.kind() {
        io::ErrorKind::AddrInUse => LinkError::InUse { channel, address },
        io::ErrorKind::PermissionDenied => LinkError::Denied { channel, address },
        _ => LinkError::Io {
            channel,
            address,
            reason,
        },
    })
}

/// Accepts until the hub is gone; who may stay is the hub's decision.
pub(super) async fn accept(port: Port, listener: TcpListener, hub: mpsc::Sender<LinkMessage>) {
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => {
                prepare(port, &stream);
                if hub
                    .send(LinkMessage::Arrived {
                        port,
                        stream,
                        peer,
                        gone: None,
                    })
                    .await
                    .is_err()
                {
                    return;
                }
            }
            Err(error) => {
                warn!(
                    port = port.name(),
                    "{port}: a connection was not accepted: {error}"
                );
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}
