//! A [`Robot`] as a peer of `ts3100 survey`: its waiting is virtual time.

use crate::Robot;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use ts3100_controller::{Output, Port, Time};
use ts3100_survey::{Line, Peer, PeerError};

/// The peer.
pub struct VirtualPeer {
    /// The robot, whose panel a test may use.
    pub robot: Robot,
    /// IP0 or HOST.
    port: Port,
    open: [bool; 3],
    /// What was sent on the line for commands, one item for each call, with its time.
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
            for line in [Line::Commands, Line::Channel] {
                if ports.contains(&self.port(line)) {
                    self.close(line);
                }
            }
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
        // A second connection is accepted and closed; that is the daemon's, not the controller's. A serial line is there.
        if line != Line::Second {
            if !self.is_serial() {
                self.robot.connect(self.port(line));
            }
            self.open[line as usize] = true;
        }
        Ok(())
    }

    fn close(&mut self, line: Line) {
        if std::mem::take(&mut self.open[line as usize]) {
            if !self.is_serial() {
                self.robot.disconnect(self.port(line));
            }
            self.robot.received(self.port(line));
        }
    }

    fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError> {
        if !self.open[line as usize] {
            return Err(PeerError::Closed);
        }
        if line == Line::Commands {
            self.sent.push((self.now(), bytes.to_vec()));
        }
        self.robot.raw(self.port(line), bytes);
        self.follow();
        Ok(())
    }

    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError> {
        if let Some((at, stop)) = &self.interruption {
            stop.store(self.now() >= *at, Ordering::Relaxed);
        }
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
            let due = self.robot.seat.deadline().unwrap_or(end);
            let next = due.max(now + Duration::from_micros(1)).min(end);
            self.robot.advance(next.since(now));
            self.follow();
            if !self.open[line as usize] {
                return Err(PeerError::Closed);
            }
        }
    }

    fn is_serial(&self) -> bool {
        self.port == Port::Host
    }
}
