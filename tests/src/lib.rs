//! Helpers shared by the suites, first of all a controller under virtual time.
//!
//! [`Robot`] only carries bytes, time and panel actions to a [`Seat`] and keeps what the controller sends; what is expected
//! is written in the suites. [`mod@bench`] and [`host`] are for running emulators and their real connections. [`transcript`] runs hand-written conversations, [`round_trip`] adds snapshots to any suite.

#![expect(
    clippy::panic,
    clippy::unwrap_used,
    reason = "what does not hold in a helper of the suites fails the test"
)]

pub mod bench;
pub mod clauses;
pub mod host;
pub mod kinematics;
pub mod notation;
pub mod reference;
pub mod round_trip;
pub mod testing;
pub mod transcript;
pub mod virtual_peer;

use std::collections::BTreeMap;
use std::time::Duration;
use ts3100_controller::{
    Config, Controller, Dialect, Event, Findings, Input, Output, PanelAction, Port, Time,
};
use ts3100_driver::seat::{Effects, Seat, Side};
use ts3100_host::{Event as HostEvent, Expected, Response};
use ts3100_proto::command::Command;
use ts3100_proto::reply::STOP;
use ts3100_proto::text::{Checksum, Framing, encode_text};

/// Deadlines served in one call of [`Robot::advance`] before the controller is taken to hang.
const MAX_DEADLINES: u32 = 200_000;

/// A controller, its virtual clock, and what it has sent.
#[derive(Clone)]
pub struct Robot {
    /// The controller, to which nobody listens.
    pub seat: Seat,
    now: Time,
    sent: BTreeMap<Port, Vec<u8>>,
    /// Everything else it has put out, in order.
    pub outputs: Vec<Output>,
    /// After everything that happens it is written down and read back.
    round_trips: round_trip::RoundTrips,
    /// The protocol mistakes of the host.
    pub findings: Findings,
}

impl Robot {
    /// A controller of this dialect whose power has just come on. Its serial lines take no time: most suites are
    /// about the bytes on them.
    #[must_use]
    pub fn new(dialect: Dialect) -> Robot {
        let mut config = Config::new(dialect);
        config.options.serial_pacing = false;
        Robot::with(config)
    }

    /// A controller made of this.
    ///
    /// # Panics
    /// When the controller cannot be made.
    #[must_use]
    pub fn with(config: Config) -> Robot {
        let controller = Controller::new(config, Vec::new());
        let mut robot =
            Robot::from_controller(controller.unwrap_or_else(|error| panic!("a fresh controller: {error}")));
        robot.feed(Input::Tick);
        robot
    }

    /// A controller that has lived already.
    #[must_use]
    pub fn from_controller(controller: Controller) -> Robot {
        Robot {
            now: controller.now(),
            seat: Seat::new(controller),
            sent: BTreeMap::new(),
            outputs: Vec::new(),
            round_trips: round_trip::RoundTrips::current(),
            findings: Findings::default(),
        }
    }

    /// A field-dialect controller with a host on IP0, a peer on IP1, servo on, and this program selected.
    ///
    /// # Panics
    /// When the program does not compile.
    #[must_use]
    pub fn ready(program: &str) -> Robot {
        let mut robot = Robot::new(Dialect::Field);
        robot.load("TEST", program);
        robot.connect(Port::Ip0);
        robot.connect(Port::Ip1);
        robot.panel(PanelAction::Servo(true));
        robot
    }

    /// Puts a program on the RAM drive and selects it.
    ///
    /// # Panics
    /// When the drive does not take it or it does not compile.
    pub fn load(&mut self, name: &str, program: &str) {
        let stored = self.seat.controller.put_file(name, program.as_bytes());
        stored.unwrap_or_else(|error| panic!("storing {name}: {error}"));
        let selected = self.seat.controller.select(self.now, name);
        selected.unwrap_or_else(|error| panic!("selecting {name}: {error}"));
        self.feed(Input::Tick);
    }

    /// The virtual time.
    #[must_use]
    pub fn now(&self) -> Time {
        self.now
    }

    /// One thing happens now.
    pub fn feed(&mut self, input: Input) {
        let mut world = World {
            sent: &mut self.sent,
            outputs: &mut self.outputs,
            findings: &mut self.findings,
            deadlines: 0,
        };
        // The suites read the refusal of an action from its event.
        let _refused = self.seat.feed(self.now, input, Side::Host, &mut world);
        if self.round_trips.is_due() {
            self.seat.controller = round_trip::round_trip(&self.seat.controller);
        }
    }

    /// Anything that happens outside.
    pub fn put(&mut self, input: Input) {
        self.feed(input);
    }

    /// A peer comes to a port.
    pub fn connect(&mut self, port: Port) {
        self.feed(Input::Connected {
            port,
            peer: "suite".to_string(),
        });
    }

    /// The peer of a port leaves.
    pub fn disconnect(&mut self, port: Port) {
        self.feed(Input::Disconnected { port });
    }

    /// Something is done at the controller itself.
    pub fn panel(&mut self, panel: PanelAction) {
        self.feed(Input::by_hand(panel));
    }

    /// The settings of HOST or COM1 are changed in USER.PAR; they act after a power cycle.
    ///
    /// # Panics
    /// The file has no line of this port.
    pub fn set_serial_line(&mut self, port: &str, settings: &str) {
        let content = self.seat.controller.drive().get("USER.PAR").unwrap();
        let content = std::str::from_utf8(content).unwrap();
        let begin = content.find(&format!("{{{port}}} =")).unwrap();
        let (before, line) = content.split_at(begin);
        let after = line.split_at(line.find(['\r', '\n']).unwrap()).1;
        let changed = format!("{before}{{{port}}} = {settings}{after}");
        let controller = &mut self.seat.controller;
        controller.put_file("USER.PAR", changed.as_bytes()).unwrap();
    }

    /// Bytes come in on a port, as one segment.
    pub fn raw(&mut self, port: Port, bytes: &[u8]) {
        self.feed(Input::received(port, bytes.to_vec()));
    }

    /// A text comes in: its data section, STX and ETX added here.
    pub fn send(&mut self, port: Port, data: &[u8]) {
        self.raw(port, &frame(data));
    }

    /// Time passes; every deadline on the way is served at its own time.
    ///
    /// # Panics
    /// When the controller wants to be called for ever without time going on.
    pub fn advance(&mut self, duration: Duration) {
        let end = self.now + duration;
        for _ in 0..MAX_DEADLINES {
            // The seat serves all deadlines in one go; a round trip comes after each of them.
            match self.seat.deadline() {
                Some(due) if due < end && self.round_trips.are_made() => self.now = self.now.max(due),
                _ => break,
            }
            self.feed(Input::Tick);
        }
        self.now = end;
        self.feed(Input::Tick);
    }

    /// Time passes in milliseconds.
    pub fn advance_ms(&mut self, millis: u64) {
        self.advance(Duration::from_millis(millis));
    }

    /// What was sent on a port since the last call.
    pub fn received(&mut self, port: Port) -> Vec<u8> {
        self.sent.remove(&port).unwrap_or_default()
    }

    /// Takes the first bytes sent on a port and not received yet.
    pub fn take(&mut self, port: Port, count: usize) -> Vec<u8> {
        let mut bytes = self.received(port);
        let rest = bytes.split_off(count.min(bytes.len()));
        if !rest.is_empty() {
            self.sent.insert(port, rest);
        }
        bytes
    }

    /// The ports with bytes that were sent and not read by the test.
    #[must_use]
    pub fn unread(&self) -> Vec<(Port, Vec<u8>)> {
        self.sent
            .iter()
            .map(|(port, bytes)| (*port, bytes.clone()))
            .collect()
    }

    /// A command with its answer: the data section of an OK, an NG or the first FL text. An unsolicited SP
    /// after it is left to be received.
    ///
    /// # Panics
    /// When the answer is not one text with STX.
    pub fn ask(&mut self, port: Port, command: &str) -> Vec<u8> {
        self.received(port);
        self.send(port, &[command.as_bytes(), b"\r"].concat());
        let mut answer = self.received(port);
        let stop = frame(STOP);
        if answer.len() > stop.len() && answer.ends_with(&stop) {
            answer.truncate(answer.len() - stop.len());
            self.sent.insert(port, stop);
        }
        unframe(&answer).unwrap_or_else(|| panic!("{command}: one text expected, {answer:02x?} found"))
    }

    /// A command that is answered by OK.
    ///
    /// # Panics
    /// When it is not.
    pub fn command(&mut self, port: Port, command: &str) {
        let answer = self.ask(port, command);
        assert_eq!(notation::write(&answer), "OK<CR>", "{command}");
    }

    /// The binary body of SF.
    pub fn total(&mut self, port: Port) -> Vec<u8> {
        self.file(port, "SF")
    }

    /// A command that is answered by FL: the content without EOF, every text acknowledged with OK. An unsolicited SP is
    /// left to be received.
    ///
    /// # Panics
    /// When the texts are not those of a file.
    pub fn file(&mut self, port: Port, command: &str) -> Vec<u8> {
        let parsed = Command::parse(command.as_bytes());
        let expected = parsed.map_or(Expected::Content, |command| Expected::of(&command));
        self.received(port);
        let mut host = host::unhurried();
        host.send(format!("{command}\r").as_bytes(), expected);
        let mut stops = Vec::new();
        let content = loop {
            while let Some(bytes) = host.poll_transmit(Duration::ZERO) {
                self.raw(port, &bytes);
            }
            match host.poll_event() {
                Some(HostEvent::Response(Response::Content(content))) => break content,
                Some(HostEvent::Stopped) => stops.extend(frame(STOP)),
                Some(other) => panic!("{command}: FL expected, {other:?} found"),
                None => {
                    let bytes = self.received(port);
                    assert!(!bytes.is_empty(), "{command}: {} expected", host.expected());
                    host.receive(Duration::ZERO, &bytes);
                }
            }
        };
        let rest = self.received(port);
        assert!(
            rest.is_empty() || rest == frame(STOP),
            "{command}: {rest:02x?} follows the host's last OK"
        );
        stops.extend(rest);
        if !stops.is_empty() {
            self.sent.insert(port, stops);
        }
        content
    }

    /// A float of the SF body.
    ///
    /// # Panics
    /// When the body is shorter.
    pub fn float(&mut self, port: Port, offset: usize) -> f32 {
        let body = self.total(port);
        let word: [u8; 4] = body[offset..offset + 4]
            .try_into()
            .expect("a slice of four bytes");
        f32::from_be_bytes(word)
    }

    /// Numbers of the alarms raised so far, for example `2-046`.
    #[must_use]
    pub fn alarms(&self) -> Vec<String> {
        let number = |output: &Output| match output {
            Output::Event(Event::Alarm { number, .. }) => Some(number.clone()),
            _ => None,
        };
        self.outputs.iter().filter_map(number).collect()
    }
}

/// What is around the controller of a [`Robot`]: it keeps what is put out.
struct World<'a> {
    sent: &'a mut BTreeMap<Port, Vec<u8>>,
    outputs: &'a mut Vec<Output>,
    findings: &'a mut Findings,
    deadlines: u32,
}

impl Effects for World<'_> {
    fn perform(&mut self, _at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        if let Output::Event(event) = &output {
            self.findings.record(event);
        }
        match output {
            Output::Send { port, bytes } => self.sent.entry(port).or_default().extend(bytes),
            other => self.outputs.push(other),
        }
        Vec::new()
    }

    fn is_late(&mut self, reached: Time) -> bool {
        self.deadlines += 1;
        assert!(
            self.deadlines < MAX_DEADLINES,
            "{MAX_DEADLINES} deadlines before {reached}: the controller does not get on"
        );
        false
    }
}

/// A text with STX around this data section.
#[must_use]
pub fn frame(data: &[u8]) -> Vec<u8> {
    encode_text(data, Framing::Stx, Checksum::None)
}

/// The data section of exactly one text with STX; binary data inside is let through.
#[must_use]
pub fn unframe(text: &[u8]) -> Option<Vec<u8>> {
    Some(text.strip_prefix(b"\x02")?.strip_suffix(b"\x03")?.to_vec())
}
