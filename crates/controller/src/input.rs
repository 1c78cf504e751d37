//! Everything that can happen to the controller from outside.
//!
//! The embedding program knows who caused it: a socket, a serial device, a test, a scenario.

use crate::action::Action;
pub use crate::controls::PanelAction;
use crate::drive::PersistError;
use crate::faults::FaultAction;
pub use crate::panel::{ControlRight, JogMode, KeySwitch};
use crate::port::Port;
use crate::prelude::*;
use crate::serial_line::HostEnd;
use bytes::Bytes;

/// One thing that happened outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// Nothing but time: deadlines up to now are served.
    Tick,
    /// A peer is on the line of this port. Serial lines are connected while the port is open.
    Connected {
        port: Port,
        /// The peer's address, for logs and the Ethernet display.
        peer: String,
    },
    /// Bytes from the peer, cut anywhere.
    Received { port: Port, bytes: Bytes },
    /// How the host has opened its end of a serial line, as far as the edge can tell; before the bytes it holds
    /// for. Nothing on the Ethernet channels. A new peer starts with nothing known.
    SerialOpened { port: Port, host: HostEnd },
    /// The host purges bytes that are not on the line yet.
    SerialPurged { port: Port },
    /// Characters with a parity or framing error that the line itself brought: a real port has found them, or the
    /// host holds the line low (break, a character of zeros).
    SerialErrors {
        port: Port,
        /// The bytes as received.
        bytes: Vec<u8>,
    },
    /// The peer is gone.
    Disconnected { port: Port },
    /// A second peer came to a port that has one (D3); reported before anything else happens.
    SecondPeer {
        port: Port,
        /// The newcomer's address.
        peer: String,
        /// The newcomer takes the place of the first; otherwise it was turned away.
        kept: bool,
    },
    /// The peer does not read, and its connection is about to be closed.
    Backlogged { port: Port },
    /// Wires between robots keep changing each other at one moment; reported to one of the robots, once.
    WireLoop {
        /// The wires by name.
        wires: String,
    },
    /// The answer to [`Output::Persist`](crate::output::Output::Persist): the change is kept, or why it is not. It comes before
    /// any other input; one that comes first says that it is not.
    Persisted(Result<(), PersistError>),
    /// Something done to the controller itself.
    Action { action: Action, by: By },
}

/// Who does an action: it decides who learns that the action was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// A person at the panel or the teach pendant, or a device on a line: no answer is awaited, so a refusal is a
    /// finding.
    Hand,
    /// The owner of the controller: a refusal is the result of [`Controller::handle`](crate::Controller::handle), and an
    /// event.
    Owner,
}

impl Input {
    /// Something done at the operating panel, the teach pendant or the terminals.
    pub fn by_hand(action: PanelAction) -> Input {
        let action = Action::Panel(action);
        Input::Action { action, by: By::Hand }
    }

    /// Something done by the owner of the controller.
    pub fn by_owner(action: Action) -> Input {
        Input::Action {
            action,
            by: By::Owner,
        }
    }

    /// [`Input::Received`] from any form of bytes.
    pub fn received(port: Port, bytes: impl Into<Bytes>) -> Input {
        let bytes = bytes.into();
        Input::Received { port, bytes }
    }
}

impl From<FaultAction> for Input {
    fn from(action: FaultAction) -> Input {
        Input::by_owner(Action::Fault(action))
    }
}
