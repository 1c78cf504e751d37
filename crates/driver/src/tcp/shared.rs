//! Listening sockets that many robots share, each robot at an address of its own: a connection belongs to the robot whose
//! address was dialled. With sockets of its own for each robot, ten thousand of them would need forty thousand.
//!
//! A robot claims the address and port of each of its channels. [`SharedPorts::serve`] hands over what arrives; a channel
//! that must not overlook a connection asks by itself, as it does at a socket of its own.

use super::NewConnection;
use super::connection::prepare;
use super::listen::{ACCEPT_PAUSE, ChannelError, accept, listen_at_all};
use socket2::SockRef;
use std::collections::{BTreeMap, HashMap};
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tracing::warn;
use ts3100_controller::port::Port;

/// Connections that may wait until their channel takes them; further ones are reset.
const MAILBOX: usize = 4;

/// Called with an address without a robot; it may start the robot of this address.
type Newcomer = Box<dyn Fn(IpAddr) + Send + Sync>;

/// The shared listening sockets of a process.
#[derive(Clone)]
pub struct SharedPorts(Arc<Shared>);

struct Shared {
    /// Listening sockets by port number; `Port` is the channel that has this number as delivered, for messages.
    listeners: BTreeMap<u16, (Port, TcpListener)>,
    claims: Mutex<HashMap<SocketAddr, mpsc::Sender<NewConnection>>>,
    newcomer: OnceLock<Newcomer>,
}

impl SharedPorts {
    /// Listens at these ports of the machine. If the robots' addresses are loopback addresses, only this machine
    /// reaches them (on Linux; elsewhere a connection to another address is reset).
    ///
    /// # Errors
    /// The first port that cannot be opened.
    pub fn open(
        first: IpAddr,
        numbers: impl IntoIterator<Item = (Port, u16)>,
    ) -> Result<SharedPorts, ChannelError> {
        let mut listeners = BTreeMap::new();
        for (port, number) in numbers {
            let listener = listen_at_all(port, first, number)?;
            listeners.insert(number, (port, listener));
        }
        Ok(SharedPorts(Arc::new(Shared {
            listeners,
            claims: Mutex::default(),
            newcomer: OnceLock::new(),
        })))
    }

    /// Hands connections to their channels, for as long as it is polled.
    pub async fn serve(self, newcomer: impl Fn(IpAddr) + Send + Sync + 'static) {
        // It is served once.
        let _ = self.0.newcomer.set(Box::new(newcomer));
        let mut tasks = JoinSet::new();
        for number in self.0.listeners.keys().copied() {
            let shared = self.clone();
            tasks.spawn(async move { shared.accept_at(number).await });
        }
        while tasks.join_next().await.is_some() {}
    }

    async fn accept_at(&self, number: u16) {
        let Some((port, listener)) = self.0.listeners.get(&number) else {
            return;
        };
        loop {
            match listener.accept().await {
                Ok(accepted) => self.hand_over(*port, accepted),
                Err(error) => {
                    warn!("port {number}: cannot accept a connection: {error}");
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }

    /// Hands a connection to the channel that was dialled. Without one the robot starts, or the port is closed.
    fn hand_over(&self, port: Port, (stream, peer): (TcpStream, SocketAddr)) {
        let Ok(dialled) = stream.local_addr() else {
            return;
        };
        let mut mailbox = self.claims().get(&dialled).cloned();
        if let (None, Some(newcomer)) = (&mailbox, self.0.newcomer.get()) {
            // The lock of the claims is not held here: the robot that starts claims its address.
            newcomer(dialled.ip());
            mailbox = self.claims().get(&dialled).cloned();
        }
        let Some(mailbox) = mailbox else {
            return reset(&stream);
        };
        prepare(port, &stream);
        if let Err(error) = mailbox.try_send((stream, peer, None)) {
            reset(&error.into_inner().0);
        }
    }

    fn claims(&self) -> MutexGuard<'_, HashMap<SocketAddr, mpsc::Sender<NewConnection>>> {
        // Consistent between any two statements.
        self.0.claims.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The connections to this address and port, if the port is shared. A claim lasts until it is dropped.
    pub(super) fn claim(&self, address: SocketAddr) -> Option<Claim> {
        self.0.listeners.get(&address.port())?;
        let (mailbox, connections) = mpsc::channel(MAILBOX);
        self.claims().insert(address, mailbox);
        Some(Claim {
            ports: self.clone(),
            address,
            connections,
        })
    }

    /// Hands over what has arrived at a port, whether or not the runtime knows of it.
    fn hand_over_arrived(&self, number: u16) {
        let Some((port, listener)) = self.0.listeners.get(&number) else {
            return;
        };
        while let Ok(accepted) = accept(listener) {
            self.hand_over(*port, accepted);
        }
    }
}

/// Makes the end of a connection a reset, as at a port that is closed, though the system has accepted already.
pub(super) fn reset(stream: &TcpStream) {
    // Without it the peer sees an orderly end when the stream is dropped, which tells it less.
    let _ = SockRef::from(stream).set_linger(Some(Duration::ZERO));
}

/// The connections to one address and port.
pub(super) struct Claim {
    ports: SharedPorts,
    address: SocketAddr,
    pub(super) connections: mpsc::Receiver<NewConnection>,
}

impl Claim {
    /// The shared socket.
    pub(super) fn listener(&self) -> Option<&TcpListener> {
        let listeners = &self.ports.0.listeners;
        listeners.get(&self.address.port()).map(|(_, listener)| listener)
    }

    /// A connection that has arrived; also one at the socket, if something `has_arrived` there.
    pub(super) fn arrived(&mut self, has_arrived: bool) -> Option<NewConnection> {
        if has_arrived {
            self.ports.hand_over_arrived(self.address.port());
        }
        self.connections.try_recv().ok()
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.ports.claims().remove(&self.address);
        // Who was not heard is refused, as at a port that is closed.
        while let Ok((stream, ..)) = self.connections.try_recv() {
            reset(&stream);
        }
    }
}
