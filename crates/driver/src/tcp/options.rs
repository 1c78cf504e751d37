//! Options of the links: port numbers, second connections, dialling.

use crate::clock::AUTO_GRACE;
use crate::store::backing::WhenFull;
use std::time::Duration;

/// Choice of the TCP ports of the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ports {
    /// The channel's own port of ETHERNET.PAR plus this many.
    Offset(u16),
    /// Free ports, chosen by the system.
    Auto,
}

/// Handling of a second connection to a channel (`channel.second`, decision D3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SecondConnection {
    /// The second is accepted and closed at once; the first is untouched (ETH-06).
    #[default]
    Refuse,
    /// The second replaces the first, which is closed.
    Replace,
}

/// Options of the links and of the backing directory of the RAM drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkOptions {
    /// `channel.second`.
    pub second: SecondConnection,
    /// `channel.redial`: pause between two attempts of a client channel (ETH-05).
    pub redial: Duration,
    /// `auto.silence`: how long hosts must be silent before `--time auto` jumps.
    pub silence: Duration,
    /// `drive.when_full`: treatment of a change that the backing directory does not accept.
    pub when_full: WhenFull,
}

impl Default for LinkOptions {
    fn default() -> LinkOptions {
        LinkOptions {
            second: SecondConnection::default(),
            redial: Duration::from_secs(2),
            silence: AUTO_GRACE,
            when_full: WhenFull::default(),
        }
    }
}
