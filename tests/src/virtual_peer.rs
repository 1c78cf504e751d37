//! A [`Robot`] as a peer of `ts3100 survey`: its waiting is virtual time.

use crate::Robot;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use ts3100_controller::{Output, Port, Time};
use ts3100_survey::{Connection, Peer, PeerError};

/// The peer.
pub struct VirtualPeer {
    /// The robot, whose panel a test may use.
    pub robot: Robot,
    /// IP0 or HOST.
    port: Port,
    open: [bool; 3],
    /// What was sent on the connection for commands, one item for each call, with its time.
    pub sent: Vec<(Duration, Vec<u8>)>,
    /// When somebody interrupts the survey, and the flag of its plan.
    pub interruption: Option<(Duration, Arc<AtomicBool>)>,
}

impl VirtualPeer {
    /// The port for commands is IP0, or HOST for a serial line.
    #[must_use]
    pub fn new(mut robot: Robot, port: Port) -> VirtualPeer {
        if port == Port::Host {
            robot.connect(port);
        }
        VirtualPeer {
            robot,
            port,
            open: [false; 3],
            sent: Vec::new(),
            interruption: None,
        }
    }

    /// Closes what the controller has closed, and forgets the rest of what it did.
    fn follow(&mut self) {
        for output in std::mem::take(&mut self.robot.outputs) {
            let ports = match output {
                Output::Disconnect { port, .. } => vec![port],
                Output::PowerOff => vec![self.port, Port::Ip1],
                _ => continue,
            };
            for connection in [Connection::Commands, Connection::Channel] {
                if ports.contains(&self.port(connection)) {
                    self.close(connection);
                }
            }
        }
    }

    fn port(&self, connection: Connection) -> Port {
        match connection {
            Connection::Commands | Connection::Second => self.port,
            Connection::Channel => Port::Ip1,
        }
    }
}

impl Peer for VirtualPeer {
    fn now(&self) -> Duration {
        self.robot.now().since(Time::ZERO)
    }

    fn open(&mut self, connection: Connection) -> Result<(), PeerError> {
        if self.is_serial() && connection != Connection::Commands {
            return Err(PeerError::Absent);
        }
        self.close(connection);
        // A second connection is accepted and closed; that is the daemon's, not the controller's. A serial line is there.
        if connection != Connection::Second {
            if !self.is_serial() {
                self.robot.connect(self.port(connection));
            }
            self.open[connection as usize] = true;
        }
        Ok(())
    }

    fn close(&mut self, connection: Connection) {
        if std::mem::take(&mut self.open[connection as usize]) {
            if !self.is_serial() {
                self.robot.disconnect(self.port(connection));
            }
            self.robot.received(self.port(connection));
        }
    }

    fn send(&mut self, connection: Connection, bytes: &[u8]) -> Result<(), PeerError> {
        if !self.open[connection as usize] {
            return Err(PeerError::Closed);
        }
        if connection == Connection::Commands {
            self.sent.push((self.now(), bytes.to_vec()));
        }
        self.robot.raw(self.port(connection), bytes);
        self.follow();
        Ok(())
    }

    fn receive(&mut self, connection: Connection, until: Duration) -> Result<Vec<u8>, PeerError> {
        if let Some((at, stop)) = &self.interruption {
            stop.store(self.now() >= *at, Ordering::Relaxed);
        }
        if !self.open[connection as usize] {
            return Err(PeerError::Closed);
        }
        let end = Time::ZERO + until;
        loop {
            let bytes = self.robot.received(self.port(connection));
            let now = self.robot.now();
            if !bytes.is_empty() || now >= end {
                return Ok(bytes);
            }
            let due = self.robot.seat.deadline().unwrap_or(end);
            let next = due.max(now + Duration::from_micros(1)).min(end);
            self.robot.advance(next.since(now));
            self.follow();
            if !self.open[connection as usize] {
                return Err(PeerError::Closed);
            }
        }
    }

    fn is_serial(&self) -> bool {
        self.port == Port::Host
    }
}
