//! Everything that can happen to the controller from outside.
//!
//! The embedding program knows who caused it: a socket, a serial device, a test, a scenario.

use crate::action::Action;
use crate::drive::PersistError;
use crate::endpoint::serial_line::HostEnd;
use crate::port::Port;
use alloc::string::String;
use alloc::vec::Vec;
use bytes::Bytes;
use ts3100_proto::words::Word;

/// One thing that happened outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// Nothing but time: deadlines up to now are served.
    Tick,
    /// A peer is on the line of this port. Serial lines are connected while the port is open.
    Connected {
        /// The port.
        port: Port,
        /// The peer's address, for logs and the Ethernet display.
        peer: String,
    },
    /// Bytes from the peer, cut anywhere.
    Received {
        /// The port.
        port: Port,
        /// The bytes.
        bytes: Bytes,
    },
    /// How the host has opened its end of a serial line, as far as the edge can tell; before the bytes it holds
    /// for. Nothing on the Ethernet channels. A new peer starts with nothing known.
    SerialOpened {
        /// The port.
        port: Port,
        /// What is known.
        host: HostEnd,
    },
    /// The host has its port forget what is not on the line yet.
    SerialPurged {
        /// The port.
        port: Port,
    },
    /// Characters with a parity or framing error that the line itself brought: a real port has found them, or the
    /// host holds the line low (break, a character of zeros).
    SerialErrors {
        /// The port.
        port: Port,
        /// Them, as read.
        bytes: Vec<u8>,
    },
    /// The peer is gone.
    Disconnected {
        /// The port.
        port: Port,
    },
    /// A second peer came to a port that has one (D3); told before anything comes of it.
    SecondPeer {
        /// The port.
        port: Port,
        /// The newcomer's address.
        peer: String,
        /// The newcomer takes the place of the first; otherwise it was turned away.
        kept: bool,
    },
    /// The peer has left so much unread that its connection is about to be closed.
    Backlogged {
        /// The port.
        port: Port,
    },
    /// The answer to [`Output::Persist`](crate::output::Output::Persist): the change is kept, or why it is not. It comes before
    /// any other input; one that comes first says that it is not.
    Persisted(Result<(), PersistError>),
    /// Something done at the operating panel, the teach pendant or the terminals.
    Panel(PanelAction),
    /// Something that only the owner of the controller can do; a refusal is the result of
    /// [`Controller::handle`](crate::Controller::handle).
    Action(Action),
}

impl Input {
    /// [`Input::Received`] from any form of bytes.
    pub fn received(port: Port, bytes: impl Into<Bytes>) -> Input {
        let bytes = bytes.into();
        Input::Received { port, bytes }
    }
}

/// Something done at the controller itself.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PanelAction {
    /// The key switch is turned.
    Key(KeySwitch),
    /// The parameter EXTERNAL mode control right is set.
    ControlRight(ControlRight),
    /// The emergency stop button is pressed (true) or released (false).
    EmergencyStop(bool),
    /// The safety switch (fence) is open (true) or closed: an open one stops the robot like the emergency stop.
    SafetySwitch(bool),
    /// The servo power button: on or off. Refused on like SO.
    Servo(bool),
    /// START: automatic operation from the panel, whatever the control right.
    Start,
    /// STOP: the program stops after the present step, and the host is told by SP (CMD-SP-05).
    Stop,
    /// FEED HOLD pressed: alternate action (CMD-FD-02).
    FeedHold,
    /// ALARM RESET.
    AlarmReset,
    /// The machine lock: programs run without the arm moving.
    MachineLock(bool),
    /// An input line is driven by the outside (1-64, 101-164, 201-264).
    InputLine {
        /// Din number.
        line: u16,
        /// Its state.
        on: bool,
    },
    /// The battery of the RAM drive is low (true) or good again.
    Battery(bool),
    /// Figures typed at the teach pendant, for INPUT without a channel.
    Keys(String),
    /// Power off and on again.
    PowerCycle,
}

/// Position of the key switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum KeySwitch {
    /// Teaching (test run).
    Teaching,
    /// Internal automatic operation; the TS3100 only (GEN-05).
    Internal,
    /// External automatic operation.
    #[default]
    Ext,
}

/// Who commands the robot in EXT mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ControlRight {
    /// The external operation signals.
    Sig,
    /// The serial port HOST.
    Rs232c,
    /// The Ethernet channel IP0.
    #[default]
    Ether,
}

impl Word for KeySwitch {
    const ALL: &'static [KeySwitch] = &[KeySwitch::Teaching, KeySwitch::Internal, KeySwitch::Ext];

    fn word(self) -> &'static str {
        match self {
            KeySwitch::Teaching => "teaching",
            KeySwitch::Internal => "internal",
            KeySwitch::Ext => "ext",
        }
    }
}

impl Word for ControlRight {
    const ALL: &'static [ControlRight] = &[ControlRight::Sig, ControlRight::Rs232c, ControlRight::Ether];

    fn word(self) -> &'static str {
        match self {
            ControlRight::Sig => "sig",
            ControlRight::Rs232c => "rs232c",
            ControlRight::Ether => "ether",
        }
    }
}
