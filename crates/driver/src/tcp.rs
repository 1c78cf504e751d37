//! The Ethernet channels IP0 to IP3 as TCP sockets: their connections, and bytes in both directions. Nothing here knows
//! what the bytes mean.
//!
//! The driver owns [`Channels`] and polls each `Channel`: accepting (`listen`), reading and writing (`connection`) happen
//! in its own task; only dialling (`dial`) is a task of its own. Start with
//! `Channel::poll()` in `channel`.

mod channel;
mod connection;
mod dial;
mod listen;
mod options;
mod shared;

pub(crate) use channel::Channel;
pub(crate) use connection::READ_BUFFER;
pub use listen::ChannelError;
pub use listen::{bind, open};
pub use options::{LinkOptions, Ports, SecondConnection};
pub use shared::SharedPorts;

use channel::Source;
use listen::ReservedPort;
use shared::Claim;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{mpsc, oneshot};
use tracing::info;
use ts3100_controller::input::Input;
use ts3100_controller::port::Port;
use ts3100_controller::{ChannelConfig, NetworkConfig};
use ts3100_proto::parameter::OpenMode;

/// How long a second connection waits before it is refused. A host that reconnects at once may be seen here
/// before its close, when the machine is busy.
pub const CLOSE_GRACE: Duration = Duration::from_millis(50);

/// A connection that has no channel yet: stream, peer, and the sender to drop with it.
type NewConnection = (TcpStream, SocketAddr, Option<oneshot::Sender<()>>);

/// All Ethernet channels and their connections.
pub struct Channels {
    listen: IpAddr,
    ports: Ports,
    shared: Option<SharedPorts>,
    options: LinkOptions,
    channels: BTreeMap<Port, Channel>,
    /// TCP port of each server channel.
    numbers: BTreeMap<Port, u16>,
    /// The plan by which they were opened.
    plan: Option<NetworkConfig>,
    /// Own port of ETHERNET.PAR and the free port used instead (`--ports auto`); kept, so that a power cycle
    /// gets the same port.
    reserved: BTreeMap<Port, (u16, ReservedPort)>,
}

impl Channels {
    /// No channel is open yet. Connections come from the shared sockets, where they have the port of a channel.
    pub fn new(listen: IpAddr, ports: Ports, shared: Option<SharedPorts>, options: LinkOptions) -> Channels {
        Channels {
            listen,
            ports,
            shared,
            options,
            channels: BTreeMap::new(),
            numbers: BTreeMap::new(),
            plan: None,
            reserved: BTreeMap::new(),
        }
    }

    /// Opens every channel as planned that is not open: all listening sockets are bound before the first one accepts.
    /// Returns the port in use of each server channel.
    ///
    /// # Errors
    /// The first port that cannot be bound; then none is opened.
    pub fn open(&mut self, plan: &NetworkConfig) -> Result<BTreeMap<Port, u16>, ChannelError> {
        let second = self.options.second;
        let mut opened = Vec::new();
        for (port, channel) in planned(plan, OpenMode::Server) {
            if self.numbers.contains_key(&port) {
                continue;
            }
            let (channel, number) = if let Some((claim, number)) = self.claim(channel.own_port) {
                (Channel::new(port, second, Source::Claimed(claim)), number)
            } else {
                let (listener, number) = self.bind(port, channel.own_port)?;
                (Channel::accepting(port, second, listener), number)
            };
            opened.push((port, channel, number));
        }
        for (port, channel, number) in opened {
            self.channels.insert(port, channel);
            self.numbers.insert(port, number);
        }
        self.plan = Some(*plan);
        for (port, channel) in planned(plan, OpenMode::Client) {
            let peer = SocketAddr::new(IpAddr::from(channel.peer_address), channel.peer_port);
            info!(port = port.name(), "{port} dials {peer}");
            let (sender, dialled) = mpsc::channel(1);
            let task = tokio::spawn(dial::dial(port, peer, self.options.redial, sender));
            let channel = Channel::new(port, second, Source::Dialled(task, dialled));
            self.channels.insert(port, channel);
        }
        Ok(self.numbers.clone())
    }

    /// The ports in use as words: `IP0 34301, IP1 33827`.
    pub fn listing(&self) -> String {
        let numbers = self.numbers.iter();
        let words: Vec<String> = numbers.map(|(port, number)| format!("{port} {number}")).collect();
        if words.is_empty() {
            "no port is open".to_owned()
        } else {
            words.join(", ")
        }
    }

    /// TCP port of each server channel that is open.
    pub fn numbers(&self) -> &BTreeMap<Port, u16> {
        &self.numbers
    }

    /// Closes every channel and connection; returns the resulting inputs.
    pub fn close(&mut self) -> Vec<Input> {
        self.numbers.clear();
        for (_, reserved) in self.reserved.values_mut() {
            reserved.keep();
        }
        let channels = std::mem::take(&mut self.channels).into_iter();
        channels
            .filter_map(|(port, channel)| channel.close().then_some(Input::Disconnected { port }))
            .collect()
    }

    /// Closes every connection and every channel, except channels that listen now and again under `plan`: reopening
    /// their sockets would cost more than the rest of a reset. Returns the resulting inputs.
    pub fn close_for(&mut self, plan: &NetworkConfig) -> Vec<Input> {
        if self.plan != Some(*plan) {
            return self.close();
        }
        let mut inputs = Vec::new();
        self.channels = std::mem::take(&mut self.channels)
            .into_iter()
            .filter_map(|(port, channel)| {
                let (was_connected, listening) = channel.clear();
                inputs.extend(was_connected.then_some(Input::Disconnected { port }));
                Some((port, listening?))
            })
            .collect();
        self.numbers.retain(|port, _| self.channels.contains_key(port));
        inputs
    }

    /// The open channel of a port.
    pub(crate) fn get_mut(&mut self, port: Port) -> Option<&mut Channel> {
        self.channels.get_mut(&port)
    }

    /// Accepts what has arrived at channels without a peer. A host that has connected IP1 and then sends a command on
    /// IP0 expects that the program finds its peer. The system itself is asked: what a read has found on one socket may
    /// have come after what the runtime has yet to learn of another.
    pub fn accept_arrived(&mut self) -> Vec<Input> {
        let has_arrived = listen::has_arrived(self.channels.values().filter_map(Channel::idle_listener));
        let channels = self.channels.values_mut();
        let arrived = channels.flat_map(|channel| channel.accept_arrived(has_arrived));
        arrived.collect()
    }

    /// The claim of a channel on a shared port, with the number of the port.
    fn claim(&self, own: u16) -> Option<(Claim, u16)> {
        let (Some(shared), Ports::Offset(offset)) = (&self.shared, self.ports) else {
            return None;
        };
        let number = own.checked_add(offset)?;
        Some((shared.claim(SocketAddr::new(self.listen, number))?, number))
    }

    /// Binds the listening socket of a channel; returns it with its port number.
    fn bind(&mut self, port: Port, own: u16) -> Result<(TcpListener, u16), ChannelError> {
        let Ports::Offset(offset) = self.ports else {
            let fresh = || (own, ReservedPort::new(self.listen));
            let reserved = self.reserved.entry(port).or_insert_with(fresh);
            if reserved.0 != own {
                *reserved = fresh();
            }
            return reserved.1.listen(port);
        };
        let requested = own.checked_add(offset).ok_or(ChannelError::PortRange {
            channel: port,
            own,
            offset,
        })?;
        listen::bind(port, SocketAddr::new(self.listen, requested))
    }
}

fn planned(plan: &NetworkConfig, mode: OpenMode) -> impl Iterator<Item = (Port, &ChannelConfig)> {
    Port::ETHERNET
        .into_iter()
        .zip(&plan.channels)
        .filter(move |(_, channel)| channel.mode == mode)
}

#[cfg(test)]
mod tests;
