//! A controller under virtual time, and what its hosts see of it: segments, ends of connections, the clock.
//!
//! What is lost, late or cut is so because of a fault; this file only transports it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;
use ts3100_controller::faults::{Fault, FaultAction, FaultReport};
use ts3100_controller::{
    Config, Controller, Dialect, Event, Findings, Input, Output, PanelAction, Port, Time,
};
use ts3100_driver::seat::{Effects, Seat, Side};
use ts3100_tests::round_trip::{self, RoundTrips};

/// Inputs and deadlines of one test before the controller is taken to hang.
const MOST_STEPS: u32 = 200_000;

/// Inputs between two round trips: a snapshot holds what faults and variation are in the middle of.
const ROUND_TRIP_EVERY: u32 = 5;

/// Why a read gave nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoBytes {
    /// The time was over.
    Late,
    /// There is no connection.
    Gone,
}

/// A controller with hosts.
pub struct World {
    pub seat: Seat,
    pub now: Time,
    pub peers: Peers,
    steps: u32,
    round_trips: RoundTrips,
}

/// The hosts, and what they have got.
#[derive(Debug, Default)]
pub struct Peers {
    /// What was sent and not read yet, segment by segment.
    segments: BTreeMap<Port, VecDeque<Vec<u8>>>,
    connected: BTreeSet<Port>,
    stalled: BTreeSet<Port>,
    /// The log: what the faults did.
    pub fired: Vec<(u32, &'static str, String)>,
    /// When and how bytes left, for comparisons.
    pub sent: Vec<(Time, Port, Vec<u8>)>,
    /// What the controller has found about the hosts.
    pub findings: Findings,
}

impl World {
    /// The field dialect with these files, the first of them selected, servo on.
    pub fn new(config: Config, files: &[(&str, &str)]) -> World {
        let stored = files
            .iter()
            .map(|(name, text)| ((*name).to_string(), text.as_bytes().to_vec()));
        let mut world = World {
            seat: Seat::new(Controller::new(config, stored.collect()).unwrap()),
            now: Time::ZERO,
            peers: Peers::default(),
            steps: 0,
            round_trips: RoundTrips::every(ROUND_TRIP_EVERY),
        };
        if let Some((name, _)) = files.first() {
            world.seat.controller.select(Time::ZERO, name).unwrap();
        }
        world.put(Input::by_hand(PanelAction::Servo(true)));
        world
    }

    pub fn field(files: &[(&str, &str)]) -> World {
        World::new(Config::new(Dialect::Field), files)
    }

    /// Arms a fault as it is written.
    pub fn arm(&mut self, spec: &str) {
        let fault: Fault = spec.parse().unwrap_or_else(|error| panic!("{spec}: {error}"));
        self.put(Input::from(FaultAction::Arm(Box::new(fault))));
    }

    pub fn reports(&self) -> Vec<FaultReport> {
        self.seat.controller.faults().reports().cloned().collect()
    }

    pub fn put(&mut self, input: Input) {
        self.steps += 1;
        assert!(self.steps < MOST_STEPS, "the controller does not get on");
        // The suites read the refusal of an action from its event.
        let _refused = self.seat.feed(self.now, input, Side::Host, &mut self.peers);
        if self.round_trips.is_due() {
            self.seat.controller = round_trip::round_trip(&self.seat.controller);
        }
    }

    /// Connects, unless the robot still believes that somebody is there (`channel.second = refuse`).
    pub fn connect(&mut self, port: Port) -> bool {
        if self.peers.connected.contains(&port) {
            return false;
        }
        self.peers.segments.remove(&port);
        self.peers.connected.insert(port);
        self.put(Input::Connected {
            port,
            peer: "host".to_string(),
        });
        true
    }

    /// The host hangs up. A stalled robot does not notice.
    pub fn hang_up(&mut self, port: Port) {
        self.peers.segments.remove(&port);
        if self.peers.connected.contains(&port) && !self.peers.stalled.contains(&port) {
            self.peers.lose(port);
            self.put(Input::Disconnected { port });
        }
    }

    pub fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), NoBytes> {
        if !self.peers.connected.contains(&port) {
            return Err(NoBytes::Gone);
        }
        if !self.peers.stalled.contains(&port) {
            let bytes = bytes.to_vec();
            self.put(Input::received(port, bytes));
        }
        Ok(())
    }

    /// The next segment, if it comes within this time.
    pub fn read(&mut self, port: Port, limit: Duration) -> Result<Vec<u8>, NoBytes> {
        let end = self.now + limit;
        loop {
            if let Some(segment) = self.peers.segments.get_mut(&port).and_then(VecDeque::pop_front) {
                return Ok(segment);
            }
            if !self.peers.connected.contains(&port) {
                return Err(NoBytes::Gone);
            }
            if !self.step(end) {
                return Err(NoBytes::Late);
            }
        }
    }

    /// Time passes.
    pub fn pass(&mut self, duration: Duration) {
        let end = self.now + duration;
        while self.step(end) {}
    }

    /// To the next deadline, or to the end: false.
    fn step(&mut self, end: Time) -> bool {
        let due = self.seat.deadline().filter(|due| *due <= end);
        self.now = due.unwrap_or(end).max(self.now);
        self.put(Input::Tick);
        due.is_some()
    }
}

impl Peers {
    fn lose(&mut self, port: Port) {
        self.connected.remove(&port);
        self.stalled.remove(&port);
    }
}

impl Effects for Peers {
    fn perform(&mut self, at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        if let Output::Event(event) = &output {
            self.findings.record(event);
        }
        match output {
            Output::Send { port, bytes } => {
                self.sent.push((at, port, bytes.to_vec()));
                if self.connected.contains(&port) && !self.stalled.contains(&port) {
                    self.segments.entry(port).or_default().push_back(bytes.into());
                }
            }
            Output::Disconnect { port, .. } => {
                self.lose(port);
                return vec![Input::Disconnected { port }];
            }
            Output::Stall { port } => {
                self.stalled.insert(port);
            }
            Output::PowerCycled => {
                let lost = std::mem::take(&mut self.connected);
                self.segments.retain(|port, _| !lost.contains(port));
                return lost
                    .into_iter()
                    .map(|port| Input::Disconnected { port })
                    .collect();
            }
            Output::Event(Event::Fault {
                id,
                kind,
                message,
                fired: true,
                ..
            }) => self.fired.push((id, kind, message)),
            _ => {}
        }
        Vec::new()
    }
}
