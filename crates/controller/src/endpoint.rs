//! The communication ports: bytes become texts, texts commands, and answers leave. Each port of the simple protocol
//! (HOST, IP0) has a [`Session`]; HOST and COM1 have a serial line in front; faults and variation act on what passes.
//! The effect of a command is in `ops`; the data of INPUT waits in the robot's channels.

mod checks;
pub(crate) mod command;
mod download;
pub(crate) mod exchange;
mod filters;
mod notices;
pub(crate) mod send_queue;
mod sending;
pub(crate) mod serial_lines;
pub(crate) mod session;

use crate::context::Context;
use crate::endpoint::send_queue::SendQueue;
use crate::endpoint::session::Session;
use crate::faults::Faults;
use crate::faults::kind::ScheduledAction;
use crate::options::Config;
use crate::output::Event;
use crate::port::Port;
use crate::prelude::*;
use crate::serial_line::SerialLine;
use crate::time::Time;
use crate::variation::Variation;
use alloc::collections::BTreeMap;
use ts3100_proto::parameter::SerialSettings;
use ts3100_proto::text::TextOptions;

/// The ports with their peers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Endpoints {
    /// HOST and IP0.
    pub(crate) sessions: BTreeMap<Port, Session>,
    /// HOST and COM1.
    pub(crate) lines: BTreeMap<Port, SerialLine>,
    pub(crate) faults: Faults,
    pub(crate) variation: Option<Variation>,
    pub(crate) send_queue: SendQueue,
    /// The settings of the serial lines as of the last power-on.
    pub(crate) settings: BTreeMap<Port, SerialSettings>,
    /// Faults that have fired, with what they do to the machine at once; empty between two inputs.
    pub(crate) fired: Vec<(Vec<ScheduledAction>, Event)>,
}

impl Endpoints {
    /// Ports without peers.
    pub(crate) fn new(config: &Config) -> Endpoints {
        let text = config.options.text;
        let sessions = [Port::Host, Port::Ip0].map(|port| (port, Session::new(port, text)));
        Endpoints {
            sessions: sessions.into(),
            lines: fresh_lines(),
            faults: Faults::new(config.fault_seed),
            variation: config.vary.map(Variation::new),
            send_queue: SendQueue::default(),
            settings: BTreeMap::new(),
            fired: Vec::new(),
        }
    }

    /// The conversation of HOST or IP0.
    pub(crate) fn session(&mut self, port: Port) -> &mut Session {
        debug_assert!(port.protocol().is_some(), "{port} has no conversation");
        // `new()` has made both sessions. A lookup that cannot fail saves every caller a case that never occurs.
        let fresh = || Session::new(port, TextOptions::default());
        self.sessions.entry(port).or_insert_with(fresh)
    }

    /// When a port gives up waiting for its host.
    pub(crate) fn host_deadline(&self) -> Option<Time> {
        self.sessions.values().filter_map(Session::deadline).min()
    }

    /// Whether a host is in the middle of a text or owes an answer. While characters are on its line it owes nothing.
    pub(crate) fn host_owes_text(&self) -> bool {
        self.sessions.values().any(|session| {
            let line = self.lines.get(&session.port);
            session.awaits_host()
                && !line.is_some_and(SerialLine::is_busy)
                && !self.send_queue.is_busy(session.port)
        })
    }

    /// Drops every conversation and everything on the lines: the power goes off.
    pub(crate) fn power_off(&mut self, context: &Context) {
        self.lines = fresh_lines();
        for port in Port::ALL {
            self.forget_peer(port);
        }
        for session in self.sessions.values_mut() {
            // Not `reset()`: the end mark and the SM latches of HOST last as long as the power (T6, T27.6).
            *session = Session::new(session.port, context.config.options.text);
        }
    }
}

/// The serial lines when the power comes on.
pub(crate) fn fresh_lines() -> BTreeMap<Port, SerialLine> {
    Port::SERIAL.map(|port| (port, SerialLine::default())).into()
}
