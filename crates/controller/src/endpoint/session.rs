//! One port of the simple protocol: where its text decoder stands, and which exchange is open. What a
//! command does is in `ops`; this file knows only the conversation.

use crate::findings::HostHistory;
use crate::limits::{HOST_DELAY, HOST_TIMEOUT};
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use ts3100_proto::file::{FlReceiver, FlSender, Received};
use ts3100_proto::message::MessageJoiner;
use ts3100_proto::name::FileName;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{Framing, TextDecoder, TextOptions};

/// Letters of a command, as its table has them.
pub type Letters = &'static str;

/// The exchange that is open on a port.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum Exchange {
    /// None: the port waits for a command.
    Idle,
    /// An FL text was sent; the host's OK is awaited.
    Sending {
        /// The texts still to be sent.
        sender: FlSender,
    },
    /// DL was accepted; FL texts are awaited.
    Receiving {
        /// The file to be stored.
        name: FileName,
        /// What has come so far.
        receiver: FlReceiver,
        /// The first text has come.
        begun: bool,
    },
}

/// State of one protocol port.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize), serde(deny_unknown_fields))]
pub struct Session {
    /// The port.
    pub port: Port,
    /// The peer, while there is one.
    pub peer: Option<String>,
    /// Cuts the bytes into texts.
    pub decoder: TextDecoder,
    /// Joins texts into messages.
    pub joiner: MessageJoiner,
    /// The open exchange.
    exchange: Exchange,
    /// Form of the host's last text; answers take the same.
    pub framing: Framing,
    /// When the last byte came.
    pub heard_at: Time,
    /// When the last text was sent.
    pub sent_at: Option<Time>,
    /// When OK or NG was last sent: texts the host does not acknowledge.
    pub replied_at: Option<Time>,
    /// An unsolicited SP waits for the open exchange to end.
    pub waiting_sp: bool,
    /// Before this time it does not come. Later than `sp_by` only after [`Session::replied`].
    pub sp_after: Time,
    /// From this time on no pause of the host is waited for any more.
    #[cfg_attr(feature = "serde", serde(default))]
    pub sp_by: Time,
    /// The host has sent a text without STX or an extension command: no such host listens for SP (hosts 8.3).
    #[cfg_attr(feature = "serde", serde(default))]
    pub never_told_of_stops: bool,
    /// Letters of the command that is served or was served last; empty before the first.
    #[cfg_attr(
        feature = "serde",
        serde(deserialize_with = "crate::snapshot::field::letters")
    )]
    pub asked: Letters,
    /// FL texts of its exchange that have passed, in either direction.
    pub block: u32,
    /// The SU body as last served here, for the SU request flag (SF-21).
    pub last_status: Option<StatusBody>,
    /// What is remembered of the host, for findings.
    #[cfg_attr(feature = "serde", serde(rename = "habits"))]
    pub history: HostHistory,
}

impl Session {
    /// A port without a peer.
    pub fn new(port: Port, options: TextOptions) -> Session {
        Session {
            port,
            peer: None,
            decoder: TextDecoder::new(options),
            joiner: MessageJoiner::default(),
            exchange: Exchange::Idle,
            framing: Framing::Stx,
            heard_at: Time::ZERO,
            sent_at: None,
            replied_at: None,
            waiting_sp: false,
            sp_after: Time::ZERO,
            sp_by: Time::ZERO,
            never_told_of_stops: false,
            asked: "",
            block: 0,
            last_status: None,
            history: HostHistory::default(),
        }
    }

    /// A peer came or went: nothing of the former conversation remains (ETH-07).
    pub fn reset(&mut self, options: TextOptions, peer: Option<String>) {
        *self = Session {
            peer,
            ..Session::new(self.port, options)
        };
    }

    /// Whether a text or a message has begun and is not complete.
    pub fn is_partial(&self) -> bool {
        self.decoder.is_partial() || self.joiner.is_partial()
    }

    /// Whether the host owes something: the rest of a text, an answer, a block.
    pub fn awaits_host(&self) -> bool {
        self.is_partial() || self.exchange != Exchange::Idle
    }

    /// When the port gives up waiting (SER-06, SER-08).
    pub fn deadline(&self) -> Option<Time> {
        let since = self.sent_at.map_or(self.heard_at, |sent| sent.max(self.heard_at));
        self.awaits_host().then(|| since + HOST_TIMEOUT)
    }

    /// When a waiting SP may be sent, unless an exchange is open: a host that compares a reply by its length must
    /// not find SP glued to its OK (hosts.md 1.3), so it keeps the pause that is asked of hosts (TRN-04). A host that
    /// never pauses gets it at `sp_by`.
    pub fn sp_due(&self) -> Option<Time> {
        let pause = self.replied_at.map_or(Time::ZERO, |replied| replied + HOST_DELAY);
        let due = pause.min(self.sp_by).max(self.sp_after);
        (self.waiting_sp && !self.awaits_host()).then_some(due)
    }

    /// OK or NG leaves. If it ends what has held back an SP until after `sp_by`, the SP keeps its pause all the same, but
    /// once: a host that never pauses gets it after the next OK.
    pub fn replied(&mut self, at: Time) {
        self.replied_at = Some(at);
        if self.waiting_sp && (self.sp_after..=at).contains(&self.sp_by) && !self.awaits_host() {
            self.sp_after = at + HOST_DELAY;
        }
    }

    /// Whether a waiting SP goes between two texts that the host has sent in one go: it waits for no answer, so there
    /// is no better moment.
    pub fn sp_overdue(&self, now: Time) -> bool {
        self.waiting_sp && self.exchange == Exchange::Idle && self.sp_by <= now
    }

    /// The open exchange.
    pub fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// Goes over to another exchange; returns the former one. Nothing else changes it, but that the texts of a file
    /// are counted in it.
    ///
    /// ```text
    ///            command answered OK or NG
    ///            +-----------------------+
    ///            v                       |
    ///   +------ Idle <-------------------+----------------------------+
    ///   |        |                                                    |
    ///   |        | command answered FL        host OK, no text left;  |
    ///   |        v                            host NG; other command; |
    ///   |     Sending ---host OK, next text-> Sending ----10 s------->+
    ///   |                                                             |
    ///   +-- DL answered OK --> Receiving --block OK--> Receiving      |
    ///                             |  EOF stored or refused; host NG;  |
    ///                             +--other command; 10 s------------->+
    /// ```
    pub fn set_exchange(&mut self, next: Exchange) -> Exchange {
        core::mem::replace(&mut self.exchange, next)
    }

    /// Adds a text to the file of the open download, which ends with a complete or a refused file.
    pub fn receive(&mut self, data: &[u8]) -> Option<(FileName, Received)> {
        let Exchange::Receiving {
            name,
            receiver,
            begun,
        } = &mut self.exchange
        else {
            return None;
        };
        *begun = true;
        let received = (name.clone(), receiver.push(data));
        if received.1 != Received::More {
            self.set_exchange(Exchange::Idle);
        }
        Some(received)
    }

    /// Gives up waiting, in silence (SER-07). Returns the bytes dropped.
    pub fn give_up(&mut self) -> usize {
        self.set_exchange(Exchange::Idle);
        self.joiner.reset();
        self.decoder.reset()
    }

    /// Whether a file of this name is being received here (TRN-11).
    pub fn receives(&self, file: &FileName) -> bool {
        matches!(&self.exchange, Exchange::Receiving { name, .. } if name == file)
    }

    /// Whether a run with these options can lead to this state of the conversation.
    #[cfg(feature = "serde")]
    pub fn is_valid(&self, options: TextOptions) -> bool {
        let exchange = match &self.exchange {
            Exchange::Idle => true,
            Exchange::Sending { sender } => sender.is_valid(),
            Exchange::Receiving { receiver, .. } => receiver.is_valid(),
        };
        exchange && self.joiner.is_valid() && self.decoder.is_valid(options)
    }
}
