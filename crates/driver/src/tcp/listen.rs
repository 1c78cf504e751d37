//! Server channels: binds ports, with errors that name the remedies, and accepts connections. Which connection is served
//! is decided in [`super::Channels`].

use super::NewConnection;
use super::connection::prepare;
#[cfg(unix)]
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::SockRef;
use std::future::Future;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::time::Sleep;
use tracing::warn;
use ts3100_controller::port::Port;

/// Backlog of the listening sockets.
const BACKLOG: u32 = 16;
/// Backlog of a socket that many robots share.
const SHARED_BACKLOG: u32 = 4_096;
/// Pause after a failed accept (for example no file descriptors left), so that it does not flood the log.
pub(super) const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Why a channel cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum ChannelError {
    /// Another program uses the port.
    #[error(
        "cannot open {channel} at {address}: the port is in use.\n\
         Use {} or `--ports auto` (free ports), or end the program that has the port",
        other_offset(*address)
    )]
    InUse {
        /// Channel that cannot be opened.
        channel: Port,
        /// Address it should listen on.
        address: SocketAddr,
    },
    /// The port is below 1024, and the process has no permission for it.
    #[error(
        "cannot open {channel} at {address}: permission denied; ports below 1024 are reserved.\n\
         Use `--port-offset 10000` (ports 11000-11003), `--ports auto` (free ports), \
         `sudo setcap cap_net_bind_service=+ep PATH_TO/ts3100`, \
         or `sudo sysctl net.ipv4.ip_unprivileged_port_start=1000`"
    )]
    Denied {
        /// Channel that cannot be opened.
        channel: Port,
        /// Address it should listen on.
        address: SocketAddr,
    },
    /// Any other error, for example an address of another machine.
    #[error("cannot open {channel} at {address}: {reason}")]
    Io {
        /// Channel that cannot be opened.
        channel: Port,
        /// Address it should listen on.
        address: SocketAddr,
        /// Error of the operating system.
        reason: io::Error,
    },
    /// Own port plus offset exceeds 65535.
    #[error(
        "cannot open {channel}: port {own} of ETHERNET.PAR plus --port-offset {offset} exceeds 65535; choose a smaller offset"
    )]
    PortRange {
        /// Channel that cannot be opened.
        channel: Port,
        /// Its own port in ETHERNET.PAR.
        own: u16,
        /// Value of `--port-offset`.
        offset: u16,
    },
}

/// Names the option that helps instead of the offset that led to this address.
fn other_offset(address: SocketAddr) -> &'static str {
    // The ports as delivered are below 1024, so no offset was given.
    if address.port() < 1_024 {
        "`--port-offset 10000` (ports 11000-11003)"
    } else {
        "another `--port-offset`"
    }
}

/// Purpose of binding a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BindPurpose {
    /// Listens.
    Listen,
    /// Listens at a reserved port.
    ListenReserved,
    /// Reserves the port without listening.
    Reserve,
}

fn bound(address: SocketAddr, purpose: BindPurpose) -> io::Result<TcpSocket> {
    let socket = if address.is_ipv4() {
        TcpSocket::new_v4()?
    } else {
        TcpSocket::new_v6()?
    };
    // Connections that ended a moment ago do not count. A reserved port is nobody else's, though nobody listens; and on
    // Windows this option would let two programs share the port.
    if cfg!(unix) && purpose != BindPurpose::Reserve {
        socket.set_reuseaddr(true)?;
    }
    // The socket that listens and the one that reserves take over from each other.
    #[cfg(target_os = "linux")]
    socket.set_reuseport(purpose != BindPurpose::Listen)?;
    socket.bind(address)?;
    Ok(socket)
}

fn listening(address: SocketAddr, purpose: BindPurpose) -> io::Result<(TcpListener, SocketAddr)> {
    let listener = bound(address, purpose)?.listen(BACKLOG)?;
    let actual = listener.local_addr()?;
    Ok((listener, actual))
}

/// Opens a listening socket and returns its address; port 0 selects a free port.
pub fn open(address: SocketAddr) -> io::Result<(TcpListener, SocketAddr)> {
    listening(address, BindPurpose::Listen)
}

/// A free port that its channel keeps while it does not listen, for example during a power cycle: with many emulators
/// on one machine another program would get it meanwhile. A bound socket that does not listen keeps it, so that
/// connections are refused. Elsewhere than on Linux such a socket would take connections from the one that listens:
/// there the port is free meanwhile.
#[derive(Debug)]
pub(super) struct ReservedPort {
    /// The reserved address; port 0 until the system has chosen one.
    address: SocketAddr,
    socket: Option<TcpSocket>,
}

impl ReservedPort {
    /// A free port at this address, chosen when it is first listened at.
    pub(super) fn new(address: IpAddr) -> ReservedPort {
        ReservedPort {
            address: SocketAddr::new(address, 0),
            socket: None,
        }
    }

    /// Opens the listening socket of a channel; returns it with its port number.
    pub(super) fn listen(&mut self, channel: Port) -> Result<(TcpListener, u16), ChannelError> {
        let opened = listening(self.address, BindPurpose::ListenReserved);
        let (listener, actual) =
            opened.map_err(|reason| ChannelError::from_io(channel, self.address, reason))?;
        *self = ReservedPort {
            address: actual,
            socket: None,
        };
        Ok((listener, actual.port()))
    }

    /// Keeps the port, whose listening socket is about to be closed.
    pub(super) fn keep(&mut self) {
        if cfg!(target_os = "linux") {
            // The port is free meanwhile if the system has no socket left.
            self.socket = bound(self.address, BindPurpose::Reserve).ok();
        }
    }
}

impl ChannelError {
    #[allow(clippy::wildcard_enum_match_arm, reason = "an enum of a library")]
    fn from_io(channel: Port, address: SocketAddr, reason: io::Error) -> ChannelError {
        match reason.kind() {
            io::ErrorKind::AddrInUse => ChannelError::InUse { channel, address },
            io::ErrorKind::PermissionDenied => ChannelError::Denied { channel, address },
            _ => ChannelError::Io {
                channel,
                address,
                reason,
            },
        }
    }
}

/// Opens the listening socket of a channel and returns its port number.
pub fn bind(channel: Port, address: SocketAddr) -> Result<(TcpListener, u16), ChannelError> {
    let opened = open(address).map(|(listener, actual)| (listener, actual.port()));
    opened.map_err(|reason| ChannelError::from_io(channel, address, reason))
}

/// Opens a listening socket for every address of the machine, or for every loopback address if `first` is one.
pub(super) fn listen_at_all(channel: Port, first: IpAddr, number: u16) -> Result<TcpListener, ChannelError> {
    let every = match first {
        IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
        IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::UNSPECIFIED),
    };
    let address = SocketAddr::new(every, number);
    let opened = || -> io::Result<TcpListener> {
        let socket = bound(address, BindPurpose::Listen)?;
        #[cfg(target_os = "linux")]
        if first.is_loopback() {
            SockRef::from(&socket).bind_device(Some(b"lo"))?;
        }
        socket.listen(SHARED_BACKLOG)
    };
    opened().map_err(|reason| ChannelError::from_io(channel, address, reason))
}

/// Accepts a connection that the system has, whether or not the runtime knows of it.
pub(super) fn accept(listener: &TcpListener) -> io::Result<(TcpStream, SocketAddr)> {
    let (socket, peer) = SockRef::from(listener).accept()?;
    // Accepted past the runtime, which would have set this.
    socket.set_nonblocking(true)?;
    let peer = peer.as_socket().ok_or(io::ErrorKind::Unsupported)?;
    Ok((TcpStream::from_std(socket.into())?, peer))
}

/// The listening socket of a channel.
pub(super) struct Acceptor {
    listener: TcpListener,
    /// After a failed accept nothing is accepted until then.
    pause: Option<Pin<Box<Sleep>>>,
}

impl Acceptor {
    pub(super) fn new(listener: TcpListener) -> Acceptor {
        Acceptor {
            listener,
            pause: None,
        }
    }

    /// The socket.
    pub(super) fn listener(&self) -> &TcpListener {
        &self.listener
    }

    /// A connection that has arrived, whether or not the runtime knows of it.
    pub(super) fn accept_now(&self, port: Port) -> Option<NewConnection> {
        if self.pause.is_some() || !has_arrived(std::iter::once(&self.listener)) {
            return None;
        }
        // What fails here fails again in `poll`, which reports it.
        let (stream, peer) = accept(&self.listener).ok()?;
        prepare(port, &stream);
        Some((stream, peer, None))
    }

    /// The next connection; whether it is served is decided by the caller.
    pub(super) fn poll(&mut self, port: Port, context: &mut Context<'_>) -> Poll<NewConnection> {
        loop {
            if let Some(pause) = &mut self.pause {
                ready!(pause.as_mut().poll(context));
                self.pause = None;
            }
            match ready!(self.listener.poll_accept(context)) {
                Ok((stream, peer)) => {
                    prepare(port, &stream);
                    return Poll::Ready((stream, peer, None));
                }
                Err(error) => {
                    let name = port.name();
                    warn!(port = name, "{port}: cannot accept a connection: {error}");
                    self.pause = Some(Box::pin(tokio::time::sleep(ACCEPT_PAUSE)));
                }
            }
        }
    }
}

/// Whether the system has a connection for one of these. It is asked before every command and every jump of time, about
/// all at once; and an accept that finds nothing costs more, since it makes a socket first.
#[cfg(unix)]
pub(super) fn has_arrived<'a>(mut listeners: impl Iterator<Item = &'a TcpListener>) -> bool {
    let Some(first) = listeners.next() else {
        return false;
    };
    let mut next = Some(first);
    let mut asked: [PollFd<'_>; Port::ETHERNET.len()] = std::array::from_fn(|_| {
        // To ask about the first twice does no harm.
        let listener = next.unwrap_or(first);
        next = listeners.next();
        PollFd::new(listener, PollFlags::IN)
    });
    // Listeners that cannot be asked are tried.
    poll(&mut asked, Some(&Timespec::default())).map_or(true, |ready| ready > 0)
}

#[cfg(not(unix))]
pub(super) fn has_arrived<'a>(mut listeners: impl Iterator<Item = &'a TcpListener>) -> bool {
    listeners.next().is_some()
}
