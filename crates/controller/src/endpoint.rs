//! The communication ports: bytes become texts, texts commands, and answers leave. Each port of the simple protocol
//! (HOST, IP0) has a [`Session`]; HOST and COM1 have a serial line in front; faults and variation act on what passes.
//! What a command does is `ops`'; the data of INPUT waits in the robot's channels.

mod actions;
mod command;
mod download;
mod exchange;
mod filters;
mod notices;
pub(crate) mod send_queue;
mod sending;
pub mod serial_line;
mod serial_lines;
pub(crate) mod session;

use crate::endpoint::send_queue::SendQueue;
use crate::endpoint::serial_line::SerialLine;
use crate::endpoint::session::Session;
use crate::faults::Faults;
use crate::options::Config;
use crate::port::Port;
use crate::prelude::*;
use crate::robot::Robot;
use crate::time::Time;
use crate::variation::Variation;
use alloc::collections::BTreeMap;
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
    /// When the first timer of all is due. It is asked for several times an input and found once after it.
    pub(crate) due: Option<Time>,
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
            due: None,
        }
    }

    /// The conversation of HOST or IP0, which is there from the start.
    pub(crate) fn session(&mut self, port: Port) -> &mut Session {
        debug_assert!(port.protocol().is_some(), "{port} has no conversation");
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

    /// Serves the texts that waited for a file to be kept.
    pub(crate) fn read_waiting_texts(&mut self, robot: &mut Robot) {
        for port in [Port::Host, Port::Ip0] {
            self.read_texts(robot, port, false);
        }
    }

    /// The peer of a port, while there is one.
    pub(crate) fn peer<'a>(&'a self, robot: &'a Robot, port: Port) -> Option<&'a str> {
        let session = self.sessions.get(&port).map(|session| session.peer.as_deref());
        session.unwrap_or_else(|| robot.channels.get(port)?.peer())
    }

    /// Takes over the peers of the controller that was here before: the edge keeps its links. What this one knew of its
    /// own peers is gone as with a cable that was cut, and those that are there now are met as new ones. Only what kind
    /// of host one is stays known.
    pub(crate) fn adopt_peers(&mut self, robot: &mut Robot, before: &Endpoints, robot_before: &Robot) {
        for port in Port::ALL {
            let departed = before
                .lines
                .get(&port)
                .and_then(|line| line.departed_peer.as_ref());
            let (there, host) = match departed {
                Some(departed) => (departed.next_peer.as_deref(), None),
                None => (before.peer(robot_before, port), before.sessions.get(&port)),
            };
            let knew = self.peer(robot, port).is_some();
            if knew {
                robot.arm.stop_jog_from(port, robot.now);
            }
            if let Some(line) = self.lines.get_mut(&port) {
                // How the far end is opened is the edge's knowledge.
                *line = SerialLine {
                    host: before.lines.get(&port).map(|line| line.host).unwrap_or_default(),
                    ..SerialLine::default()
                };
            }
            match there {
                Some(peer) => {
                    if let Some(channel) = robot.channels.get_mut(port) {
                        channel.disconnect_peer();
                    }
                    self.connected(robot, port, String::from(peer));
                    if let (Some(session), Some(host)) = (self.sessions.get_mut(&port), host) {
                        session.framing = host.framing;
                        session.never_told_of_stops = host.never_told_of_stops;
                    }
                }
                None if knew => self.disconnected(robot, port),
                None => {}
            }
        }
    }
}

/// The serial lines when the power comes on.
pub(crate) fn fresh_lines() -> BTreeMap<Port, SerialLine> {
    Port::SERIAL.map(|port| (port, SerialLine::default())).into()
}
