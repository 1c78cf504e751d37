//! Peers that come and go, at the ports and at the robot's channels.

use crate::alarm::ethernet_disconnected;
use crate::controller::Controller;
use crate::finding::rules;
use crate::options::Reconnect;
use crate::port::Port;
use crate::prelude::*;
use crate::serial_line::SerialLine;

impl Controller {
    /// Address and port of the peer on a port, as the edge gave it; `None` while there is none.
    pub fn peer(&self, port: Port) -> Option<&str> {
        let session = self.endpoints.sessions.get(&port);
        let session = session.map(|session| session.peer.as_deref());
        session.unwrap_or_else(|| self.robot.channels.get(port)?.peer())
    }

    /// A peer has come: at once, or when the one before it has left a serial line.
    pub(super) fn connected(&mut self, port: Port, peer: &str) {
        if self.endpoints.comes_later(&mut self.robot.context, port, peer) {
            return self.receive_from_lines();
        }
        self.endpoints.forget_peer(port);
        self.robot.context.fault_effects.connected(port);
        let peer = peer.to_string();
        if port.protocol().is_some() {
            let (status, requests) = (self.robot.status_body(), self.robot.panel.state().stop_requests);
            self.endpoints
                .begin_session(&self.robot.context, port, peer, status, requests);
        } else if let Some(channel) = self.robot.channels.get_mut(port) {
            let is_another = channel.connect_peer(peer);
            let releases = self.robot.context.config.options.reconnect == Reconnect::Release;
            // A serial line has no way to tell that its peer is another one.
            if releases && is_another && port.ethernet_index().is_some() {
                self.robot.executor.release_inputs(port);
            }
        }
    }

    /// Drops a peer that has left: at once, or when its bytes have passed the serial line.
    pub(super) fn peer_left(&mut self, port: Port) {
        if !self.endpoints.leaves_later(port) {
            self.disconnected(port);
        }
    }

    fn disconnected(&mut self, port: Port) {
        let robot = &mut self.robot;
        // The findings first: they read the exchange, the jog and the half value that the next lines drop.
        robot.check_left_jogging(port);
        self.endpoints.check_left_exchange(&mut robot.context, port);
        robot.check_left_channel(port);
        self.endpoints.disconnected(&robot.context, port);
        robot.arm.stop_jog_from(port, robot.context.now);
        if port.protocol().is_none()
            && let Some(channel) = robot.channels.get_mut(port)
        {
            channel.disconnect_peer();
        }
        // The alarm of [E10] is for a running program: a channel that drops between two runs raises none (PAR-E10-02).
        let levels = robot.parameters.ethernet().alarm_level;
        let level = port.ethernet_index().and_then(|index| levels[index]);
        if let Some(level) = level.filter(|_| robot.executor.program_runs()) {
            robot.blame_alarm(&rules::PEER_LEFT, Some(port));
            let detail = format!("{port}: the peer left");
            robot.raise(ethernet_disconnected(level), detail);
        }
    }

    /// Drops a former peer whose bytes have all passed, and lets the next one connect.
    pub(super) fn replace_peer(&mut self, port: Port) {
        let Some(before) = self.endpoints.end_leaving(port) else {
            return;
        };
        self.disconnected(port);
        let departed = before.departed_peer.as_ref();
        let Some((next, sp)) =
            departed.and_then(|leaving| Some((leaving.next_peer.clone()?, leaving.next_sp)))
        else {
            return;
        };
        self.connected(port, &next);
        // The program has stopped since the next host connected: the SP is for that host.
        if let (Some(window), Some(session)) = (sp, self.endpoints.sessions.get_mut(&port)) {
            session.await_sp(window);
        }
        // `disconnected()` has reset the line: the settings of the new host, and bytes printed for it, come back.
        self.endpoints.take_over_line(port, before);
        self.receive_from_lines();
    }

    /// Takes over the peers of the controller that this one replaces: the edge keeps its links. The peers that this
    /// controller knew leave, and the present ones connect again. Only the type of each host stays known: its framing,
    /// the end of its texts, and whether it gets SP.
    pub fn adopt_peers(&mut self, before: &Controller) {
        self.robot
            .context
            .outputs
            .trace(before.robot.context.outputs.is_traced());
        let watched = before.robot.context.outputs.watched().cloned();
        self.watch(watched);
        for port in Port::ALL {
            let line = before.endpoints.lines.get(&port);
            let departed = line.and_then(|line| line.departed_peer.as_ref());
            let (there, host) = match departed {
                Some(departed) => (departed.next_peer.as_deref(), None),
                None => (before.peer(port), before.endpoints.sessions.get(&port)),
            };
            let knew = self.peer(port).is_some();
            if knew {
                self.robot.arm.stop_jog_from(port, self.robot.context.now);
            }
            if let Some(own) = self.endpoints.lines.get_mut(&port) {
                // How the far end is opened is the edge's knowledge.
                *own = SerialLine {
                    host: line.map(|line| line.host).unwrap_or_default(),
                    ..SerialLine::default()
                };
            }
            match there {
                Some(peer) => {
                    if let Some(channel) = self.robot.channels.get_mut(port) {
                        channel.disconnect_peer();
                    }
                    self.connected(port, peer);
                    if let (Some(session), Some(host)) = (self.endpoints.sessions.get_mut(&port), host) {
                        session.framing = host.framing;
                        let mark = host.decoder.mark().or(session.decoder.mark());
                        session.decoder = session.decoder.clone().with_mark(mark);
                        session.never_told_of_stops = host.never_told_of_stops;
                    }
                }
                None if knew => self.disconnected(port),
                None => {}
            }
        }
        self.settle();
    }
}
