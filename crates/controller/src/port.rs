//! The six communication ports of the controller and the purpose of each (GEN-02).
//!
//! Sockets and serial devices belong to the emulator.

use core::fmt;
use scol_mini::Channel;
use ts3100_proto::permission::ProtocolPort;

ts3100_proto::codes! {
    /// A communication port.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "UPPERCASE")]
    pub enum Port {
        /// Serial port HOST: simple protocol.
        Host = "HOST",
        /// Serial port COM1: SCOL PRINT and INPUT.
        Com1 = "COM1",
        /// Ethernet channel IP0: simple protocol.
        Ip0 = "IP0",
        /// Ethernet channel IP1: SCOL PRINT and INPUT.
        Ip1 = "IP1",
        /// Ethernet channel IP2: SCOL PRINT and INPUT.
        Ip2 = "IP2",
        /// Ethernet channel IP3: a dedicated protocol of which nothing is known; bytes are discarded (GEN-04).
        Ip3 = "IP3",
    }
    /// The manual's name of the port.
    fn name -> &'static str;
    impl Word;
}

impl Port {
    /// The Ethernet channels in the order of ETHERNET.PAR.
    pub const ETHERNET: [Port; 4] = [Port::Ip0, Port::Ip1, Port::Ip2, Port::Ip3];
    /// The serial ports.
    pub const SERIAL: [Port; 2] = [Port::Host, Port::Com1];

    /// The permission table of a port that speaks the simple protocol.
    pub const fn protocol(self) -> Option<ProtocolPort> {
        match self {
            Port::Host => Some(ProtocolPort::Host),
            Port::Ip0 => Some(ProtocolPort::Ip0),
            Port::Com1 | Port::Ip1 | Port::Ip2 | Port::Ip3 => None,
        }
    }

    /// Whether PRINT and INPUT use the port.
    pub const fn is_scol_channel(self) -> bool {
        matches!(self, Port::Com1 | Port::Ip1 | Port::Ip2)
    }

    /// The port of a SCOL channel; the teach pendant has none.
    pub const fn from_channel(channel: Channel) -> Option<Port> {
        match channel {
            Channel::Tp => None,
            Channel::Com1 => Some(Port::Com1),
            Channel::Ip1 => Some(Port::Ip1),
            Channel::Ip2 => Some(Port::Ip2),
        }
    }

    /// Index among the Ethernet channels, 0 to 3; `None` for a serial port.
    pub const fn ethernet_index(self) -> Option<usize> {
        match self {
            Port::Ip0 => Some(0),
            Port::Ip1 => Some(1),
            Port::Ip2 => Some(2),
            Port::Ip3 => Some(3),
            Port::Host | Port::Com1 => None,
        }
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
