//! The configuration of the Ethernet channels: \[E00\] and \[E05\] to \[E07\] as read at the last power-on.
//!
//! The emulator opens the channels accordingly.

use crate::port::Port;
use ts3100_proto::parameter::{EthernetParameters, OpenMode};

/// One Ethernet channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelConfig {
    /// Not used, server, or client.
    pub mode: OpenMode,
    /// The controller's own TCP port, as a server.
    pub own_port: u16,
    /// IPv4 address of the peer, as a client.
    pub peer_address: [u8; 4],
    /// TCP port of the peer, as a client.
    pub peer_port: u16,
}

/// The four channels IP0 to IP3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkConfig {
    /// IP0 to IP3, in the order of ETHERNET.PAR.
    pub channels: [ChannelConfig; 4],
}

impl NetworkConfig {
    /// The configuration that the parameters ask for.
    pub fn new(parameters: &EthernetParameters) -> NetworkConfig {
        let channel = |index: usize| ChannelConfig {
            mode: parameters.open_mode[index],
            own_port: parameters.own_port[index],
            peer_address: parameters.peer_address[index],
            peer_port: parameters.peer_port[index],
        };
        NetworkConfig {
            channels: [channel(0), channel(1), channel(2), channel(3)],
        }
    }

    /// Whether hosts can connect to the port: a serial port always, a channel unless its parameter says that it is not used.
    pub fn is_used(&self, port: Port) -> bool {
        let channel = port.ethernet_index().and_then(|index| self.channels.get(index));
        channel.is_none_or(|channel| channel.mode != OpenMode::NotUsed)
    }
}
