//! Which Ethernet channels are to be opened, and how: \[E00\] and \[E05\] to \[E07\] as of the last power-on.
//! Opening them is the edge's.

use ts3100_proto::parameter::{EthernetParameters, OpenMode};

/// One channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct ChannelPlan {
    /// Not used, server, or client.
    pub mode: OpenMode,
    /// The controller's own port, where it is a server.
    pub own_port: u16,
    /// The peer's address, where it is a client.
    pub peer_address: [u8; 4],
    /// The peer's port, where it is a client.
    pub peer_port: u16,
}

/// The four channels IP0 to IP3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct NetworkPlan {
    /// In the order of the parameter file.
    pub channels: [ChannelPlan; 4],
}

impl NetworkPlan {
    /// What the parameters ask for.
    #[must_use]
    pub fn of(parameters: &EthernetParameters) -> NetworkPlan {
        let channel = |index: usize| ChannelPlan {
            mode: parameters.open_mode[index],
            own_port: parameters.own_port[index],
            peer_address: parameters.peer_address[index],
            peer_port: parameters.peer_port[index],
        };
        NetworkPlan {
            channels: [channel(0), channel(1), channel(2), channel(3)],
        }
    }
}
