//! A [`Robot`] as a peer of `ts3100 survey`: its waiting is virtual time.

use crate::Robot;
use std::time::Duration;
use ts3100_controller::{Port, Time};
use ts3100_survey::{Line, Peer, PeerError};

/// Longest step of time while bytes are waited for.
const STEP: Duration = Duration::from_millis(5);

/// The peer.
pub struct VirtualPeer {
    /// The robot, whose panel a test may use.
    pub robot: Robot,
    /// IP0 or HOST.
    port: Port,
    open: [bool; 3],
    /// Every byte that was sent on the line for commands, one item for each call.
    pub sent: Vec<Vec<u8>>,
}

impl VirtualPeer {
    /// The port for commands is IP0, or HOST for a serial line.
    #[must_use]
    pub fn new(robot: Robot, port: Port) -> VirtualPeer {
        VirtualPeer {
            robot,
            port,
            open: [false; 3],
            sent: Vec::new(),
        }
    }

    fn port(&self, line: Line) -> Port {
        match line {
            Line::Commands | Line::Second => self.port,
            Line::Channel => Port::Ip1,
        }
    }
}

impl Peer for VirtualPeer {
    fn now(&self) -> Duration {
        self.robot.now().since(Time::ZERO)
    }

    fn open(&mut self, line: Line) -> Result<(), PeerError> {
        if self.is_serial() && line != Line::Commands {
            return Err(PeerError::Absent);
        }
        self.close(line);
        // A second connection is accepted and closed; that is the daemon's, not the controller's.
        if line != Line::Second {
            self.robot.connect(self.port(line));
            self.open[line as usize] = true;
        }
        Ok(())
    }

    fn close(&mut self, line: Line) {
        if std::mem::take(&mut self.open[line as usize]) {
            self.robot.disconnect(self.port(line));
            self.robot.received(self.port(line));
        }
    }

    fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError> {
        if !self.open[line as usize] {
            return Err(PeerError::Closed);
        }
        if line == Line::Commands {
            self.sent.push(bytes.to_vec());
        }
        self.robot.raw(self.port(line), bytes);
        Ok(())
    }

    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError> {
        if !self.open[line as usize] {
            return Err(PeerError::Closed);
        }
        let end = Time::ZERO + until;
        loop {
            let bytes = self.robot.received(self.port(line));
            let now = self.robot.now();
            if !bytes.is_empty() || now >= end {
                return Ok(bytes);
            }
            let due = self.robot.cell.deadline().unwrap_or(end);
            let next = due.clamp(now + Duration::from_micros(1), now + STEP).min(end);
            self.robot.advance(next.since(now));
        }
    }

    fn is_serial(&self) -> bool {
        self.port == Port::Host
    }
}
