//! The conversation on one port of the simple protocol: its text decoder and its open exchange. The effect of a command is
//! in `ops`.

use crate::finding::HostHistory;
use crate::limits::{HOST_TIMEOUT, TEXT_END_WAIT};
use crate::panel::StopRequests;
use crate::port::Port;
use crate::prelude::*;
use crate::time::Time;
use ts3100_proto::file::{FlReceiver, FlSender, Received};
use ts3100_proto::message::MessageJoiner;
use ts3100_proto::name::FileName;
use ts3100_proto::status::su::StatusBody;
use ts3100_proto::text::{Decoded, Framing, HOST_DELAY, Reading, TextDecoder, TextOptions};

/// Letters of a command, as its table has them.
pub type Letters = &'static str;

/// The exchange that is open on a port.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
        /// The file so far.
        receiver: FlReceiver,
        /// The first text has come.
        begun: bool,
    },
}

/// State of one protocol port.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Session {
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
    pub received_at: Time,
    /// When the last text was sent.
    pub sent_at: Option<Time>,
    /// When OK or NG was last sent: texts the host does not acknowledge.
    pub replied_at: Option<Time>,
    /// An unsolicited SP waits for the open exchange to end.
    pub waiting_sp: bool,
    /// Before this time it does not come. Later than `sp_by` only after [`Session::replied`].
    pub sp_after: Time,
    /// From this time on no pause of the host is waited for any more.
    pub sp_by: Time,
    /// The host has sent a text without STX or an extension command: no such host listens for SP (hosts 8.3).
    pub never_told_of_stops: bool,
    /// Letters of the command that is served or was served last; empty before the first.
    #[serde(deserialize_with = "crate::serde_form::letters")]
    pub asked: Letters,
    /// FL texts of its exchange that have passed, in either direction.
    pub block: u32,
    /// The SU body as last served here, for the SU request flag (SF-21).
    pub last_status: Option<StatusBody>,
    /// Requests to stop that an SM on this connection has shown, or that came before it (T1).
    pub seen_requests: StopRequests,
    /// Memory of the host, for findings.
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
            received_at: Time::ZERO,
            sent_at: None,
            replied_at: None,
            waiting_sp: false,
            sp_after: Time::ZERO,
            sp_by: Time::ZERO,
            never_told_of_stops: false,
            asked: "",
            block: 0,
            last_status: None,
            seen_requests: StopRequests::default(),
            history: HostHistory::default(),
        }
    }

    /// Drops the conversation, as a peer came or went (ETH-07). HOST keeps the requests that SM has shown and the end of its
    /// texts (T6): a serial line has no connection, so these last as long as the power.
    pub fn reset(&mut self, options: TextOptions, peer: Option<String>) {
        // IP0 gets other latches from `begin_session()`, and no mark: a new connection may be another host (T6.6).
        let mark = self.decoder.mark().filter(|_| self.port == Port::Host);
        let fresh = Session::new(self.port, options);
        *self = Session {
            peer,
            decoder: fresh.decoder.with_mark(mark),
            seen_requests: self.seen_requests,
            ..fresh
        };
    }

    /// The next text, or bytes that belong to none; `None` when more bytes are needed.
    pub fn next_text(&mut self) -> Option<Decoded> {
        let reading = self.reading();
        self.decoder.next_as(reading)
    }

    /// How the next bytes are read. Between the texts of a file that have no STX, and those of a long message, nothing
    /// tells a byte that may be skipped from data (T7, T27).
    fn reading(&self) -> Reading {
        match &self.exchange {
            Exchange::Receiving { begun: true, .. } if self.framing == Framing::Bare => Reading::Data,
            Exchange::Receiving { .. } => Reading::File,
            Exchange::Idle | Exchange::Sending { .. } if self.joiner.is_partial() => Reading::Data,
            Exchange::Idle | Exchange::Sending { .. } => Reading::Command,
        }
    }

    /// Whether a text or a message has begun and is not complete.
    pub fn is_partial(&self) -> bool {
        self.decoder.is_partial_as(self.reading()) || self.joiner.is_partial()
    }

    /// Whether the host owes something: the rest of a text, an answer, a block.
    pub fn awaits_host(&self) -> bool {
        self.is_partial() || self.exchange != Exchange::Idle
    }

    /// When the port gives up waiting (SER-06, SER-08), or takes a CR for the end of its text (T6).
    pub fn deadline(&self) -> Option<Time> {
        // First: in an open exchange, too, 250 ms are enough to see whether ETX follows the CR (T6.3).
        if self.decoder.awaits_etx() {
            return Some(self.received_at + TEXT_END_WAIT);
        }
        // On a paced line `sent_at` is when the last character of the answer is out: the host has its full 10 s from
        // there.
        let since = self
            .sent_at
            .map_or(self.received_at, |sent| sent.max(self.received_at));
        self.awaits_host().then(|| since + HOST_TIMEOUT)
    }

    /// Lets an SP wait: its earliest and latest time.
    pub fn await_sp(&mut self, (after, by): (Time, Time)) {
        self.waiting_sp = true;
        self.sp_after = after;
        self.sp_by = by;
    }

    /// When a waiting SP may be sent, unless an exchange is open: a host that compares a reply by its length must
    /// not find SP glued to its OK (hosts.md 1.3), so it keeps the pause that is asked of hosts (TRN-04). A host that
    /// never pauses gets it at `sp_by`.
    pub fn sp_due(&self) -> Option<Time> {
        let pause = self.replied_at.map_or(Time::ZERO, |replied| replied + HOST_DELAY);
        let due = pause.min(self.sp_by).max(self.sp_after);
        (self.waiting_sp && !self.awaits_host()).then_some(due)
    }

    /// OK or NG leaves. If it ends the exchange that has held back an SP until after `sp_by`, the SP keeps its pause,
    /// but once: a host that never pauses gets it after the next OK.
    pub fn replied(&mut self, at: Time) {
        self.replied_at = Some(at);
        if self.waiting_sp && (self.sp_after..=at).contains(&self.sp_by) && !self.awaits_host() {
            self.sp_after = at + HOST_DELAY;
        }
    }

    /// Whether a waiting SP goes between two texts that the host has sent in one go: it waits for no answer, so there
    /// is no better moment.
    pub fn sp_overdue(&self, now: Time) -> bool {
        // Not `awaits_host()`: a segment may end inside a further text, and a host whose segments always do would never get
        // its SP.
        self.waiting_sp && self.exchange == Exchange::Idle && self.sp_by <= now
    }

    /// The open exchange.
    pub fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// Takes the open exchange and leaves the port idle. The caller opens the exchange again with one of the verbs
    /// below if it continues. Nothing else changes it, except that [`Session::receive`] adds texts to its file.
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
    /// Sending and Receiving never follow each other directly: only a command opens an exchange, and a command takes the
    /// open one first (TRN-09). A peer that leaves and power off make a new session (ETH-07).
    pub fn take_exchange(&mut self) -> Exchange {
        core::mem::replace(&mut self.exchange, Exchange::Idle)
    }

    /// An FL text was sent: OK or NG is awaited, and then these texts are sent.
    pub fn await_acknowledgement(&mut self, sender: FlSender) {
        self.open(Exchange::Sending { sender });
    }

    /// DL was answered OK: the texts of this file are awaited.
    pub fn await_file(&mut self, name: FileName, receiver: FlReceiver) {
        self.open(Exchange::Receiving {
            name,
            receiver,
            begun: false,
        });
    }

    /// Opens an exchange. The one before was taken when the command came.
    fn open(&mut self, next: Exchange) {
        debug_assert!(
            self.exchange == Exchange::Idle,
            "{}: {:?} cannot become {next:?}",
            self.port,
            self.exchange
        );
        self.exchange = next;
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
        // From here on a text that is no command is data; see `is_block()`.
        *begun = true;
        let received = (name.clone(), receiver.push(data));
        if received.1 != Received::More {
            self.take_exchange();
        }
        Some(received)
    }

    /// Gives up waiting, in silence (SER-07). Returns the bytes dropped.
    pub fn give_up(&mut self) -> usize {
        self.take_exchange();
        self.joiner.reset();
        self.decoder.give_up()
    }

    /// Whether a file of this name is being received here (TRN-11).
    pub fn receives(&self, file: &FileName) -> bool {
        matches!(&self.exchange, Exchange::Receiving { name, .. } if name == file)
    }

    /// Whether a run with these options can lead to this state of the conversation.
    pub fn is_valid(&self, options: TextOptions) -> bool {
        let exchange = match &self.exchange {
            Exchange::Idle => true,
            Exchange::Sending { sender } => sender.is_valid(),
            Exchange::Receiving { receiver, .. } => receiver.is_valid(),
        };
        exchange && self.joiner.is_valid() && self.decoder.is_valid(options)
    }
}
