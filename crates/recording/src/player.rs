//! A controller in virtual time with the connections of a recording: what the driver and its channels do, without sockets
//! (decision D3: one peer per channel). It keeps what the controller sends until somebody takes it, as [`crate::diff`] does.

use crate::answers::{Answer, AnswerSplitter};
use crate::transcript::{EndReason, LinkRecord, PeerId, RecordKind, Recording};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use ts3100_controller::findings::Finding;
use ts3100_controller::inspection::Inspection;
use ts3100_controller::output::DisconnectMode;
use ts3100_controller::{
    Action, Bytes, Controller, Event, Input, Output, PanelAction, PersistError, Port, Time, Watched,
};
use ts3100_driver::seat::{Effects, Notice, Seat, Side, Subscriber};
use ts3100_driver::snapshot;
use ts3100_driver::tcp::{CLOSE_GRACE, SecondConnection};
use ts3100_proto::text::TextOptions;

/// Bytes that a newcomer's peer may send before it is served.
const MAX_WAITING_BYTES: usize = 65_536;

/// The emulator that a recording is played to.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its controller, after power-on.
    pub controller: Controller,
    /// Treatment of a second connection.
    pub second: SecondConnection,
    /// Servo power is turned on at the start.
    pub servo_on: bool,
}

/// Something the controller has done on a line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum RobotEvent {
    /// An answer, and why it refuses, if it does.
    Answer(Answer, Option<String>),
    /// It has ended the connection.
    Ended(EndReason, Time),
}

/// A newcomer that waits for its predecessor to end.
#[derive(Debug, Clone)]
struct WaitingPeer {
    line: PeerId,
    /// When it is refused.
    until: Time,
    peer: String,
    bytes: Vec<u8>,
}

/// A controller and its lines.
#[derive(Clone)]
pub(crate) struct Player {
    seat: Seat,
    /// The controller before the first input.
    initial_controller: Controller,
    text: TextOptions,
    second: SecondConnection,
    waiting_peers: Vec<WaitingPeer>,
    lines: Lines,
}

/// The connections and the bytes that the controller has sent.
#[derive(Clone)]
struct Lines {
    now: Time,
    /// The peer each port serves.
    current_peers: BTreeMap<Port, PeerId>,
    splitters: BTreeMap<PeerId, AnswerSplitter>,
    robot_events: BTreeMap<PeerId, VecDeque<RobotEvent>>,
    /// Why the last command of a port was refused.
    refusals: BTreeMap<Port, String>,
    /// The last remark about a port's input, to explain a missing reply.
    remarks: BTreeMap<Port, String>,
    /// Recorded changes of files that were not stored.
    not_persisted: VecDeque<NotPersisted>,
    /// Epochs that have ended.
    epoch: usize,
    /// The bytes as they were sent, if somebody wants them.
    sent: Option<Vec<Sent>>,
}

/// Bytes that the controller has sent, in the piece in which they went out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sent {
    pub(crate) at: Time,
    pub(crate) line: PeerId,
    pub(crate) bytes: Bytes,
}

impl Player {
    /// As `serve` starts.
    pub(crate) fn new(candidate: Candidate, recording: &Recording) -> Player {
        let mut controller = candidate.controller;
        // What starting has put out is for the disk and the log.
        while controller.poll_output().is_some() {}
        controller.persist_outside(true);
        let text = controller.config().options.text;
        let mut player = Player {
            initial_controller: controller.clone(),
            seat: Seat::new(controller),
            text,
            second: candidate.second,
            waiting_peers: Vec::new(),
            lines: Lines {
                now: Time::ZERO,
                current_peers: BTreeMap::new(),
                splitters: BTreeMap::new(),
                robot_events: BTreeMap::new(),
                refusals: BTreeMap::new(),
                remarks: BTreeMap::new(),
                not_persisted: not_persisted(recording).collect(),
                epoch: 0,
                sent: None,
            },
        };
        if candidate.servo_on {
            player.feed(Input::by_hand(PanelAction::Servo(true)));
        }
        player
    }

    pub(crate) fn now(&self) -> Time {
        self.lines.now
    }

    pub(crate) fn controller(&self) -> &Controller {
        &self.seat.controller
    }

    /// Adds a subscriber; a copy of the player has none.
    pub(crate) fn subscribe(&mut self, subscriber: Box<dyn Subscriber>) {
        self.seat.subscribe(subscriber);
    }

    /// Tells every statement from now on, with the value of what is watched.
    pub(crate) fn watch(&mut self, watched: Option<&Watched>) {
        self.seat.await_statements(true);
        for controller in [&mut self.seat.controller, &mut self.initial_controller] {
            controller.trace(true);
            controller.watch(watched.cloned());
        }
    }

    /// Looks at every statement from now on.
    pub(crate) fn inspect(&mut self, inspection: Inspection) {
        self.seat.controller.inspect(inspection);
    }

    /// Takes what has looked at the statements.
    pub(crate) fn take_inspection(&mut self) -> Option<Inspection> {
        self.seat.controller.take_inspection()
    }

    /// Keeps the bytes that are sent from now on, until they are taken.
    pub(crate) fn keep_sent(&mut self) {
        self.lines.sent = Some(Vec::new());
    }

    /// Takes the bytes that were sent.
    pub(crate) fn take_sent(&mut self) -> Vec<Sent> {
        self.lines.sent.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Forgets what the controller has done.
    pub(crate) fn forget_events(&mut self) {
        self.lines.robot_events.clear();
    }

    /// When something happens by itself.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let waiting = self.waiting_peers.iter();
        let refusals = waiting.map(|waiting| waiting.until);
        refusals.chain(self.seat.deadline()).min()
    }

    /// Lets time pass, each deadline at its own time.
    pub(crate) fn advance_to(&mut self, to: Time) {
        while let Some(due) = self.deadline().filter(|due| *due <= to) {
            self.lines.now = self.lines.now.max(due);
            self.refuse_overdue();
            self.feed(Input::Tick);
        }
        self.lines.now = self.lines.now.max(to);
    }

    /// As [`Player::advance_to`]; the controller itself is then at this moment.
    pub(crate) fn stand_at(&mut self, to: Time) {
        self.advance_to(to);
        self.feed(Input::Tick);
    }

    /// The next thing the controller has done on a line.
    pub(crate) fn first(&self, line: PeerId) -> Option<&RobotEvent> {
        self.lines.robot_events.get(&line)?.front()
    }

    /// The one after it.
    pub(crate) fn second(&self, line: PeerId) -> Option<&RobotEvent> {
        self.lines.robot_events.get(&line)?.get(1)
    }

    /// Takes the next thing the controller has done on a line.
    pub(crate) fn take(&mut self, line: PeerId) -> Option<RobotEvent> {
        self.lines.robot_events.get_mut(&line)?.pop_front()
    }

    /// The known reason for a missing reply to a port's last input.
    pub(crate) fn remark(&self, port: Port) -> Option<String> {
        let refusal = self.lines.refusals.get(&port);
        refusal.or_else(|| self.lines.remarks.get(&port)).cloned()
    }

    /// Lines on which something is left.
    pub(crate) fn lines_with_events(&self) -> Vec<PeerId> {
        let lines = self.lines.robot_events.iter();
        let left = lines.filter(|(_, robot_events)| !robot_events.is_empty());
        left.map(|(line, _)| *line).collect()
    }

    /// Plays an action of the host or at the panel.
    pub(crate) fn play(&mut self, what: &RecordKind) {
        self.flush_lines();
        self.lines.epoch += usize::from(what.new_time().is_some());
        match what {
            RecordKind::Connected { line, peer } => self.connect(*line, peer),
            RecordKind::FromHost { line, bytes } => self.receive(*line, bytes),
            RecordKind::Ended { line, .. } => self.disconnect(*line),
            RecordKind::Action(Action::Panel(panel)) => self.feed(Input::by_hand(panel.clone())),
            RecordKind::Action(action) => self.feed(Input::by_owner(action.clone())),
            RecordKind::Link(edge) => self.apply_link_record(edge),
            RecordKind::FromRobot { .. } | RecordKind::Remark(_) => {}
        }
    }

    fn apply_link_record(&mut self, edge: &LinkRecord) {
        if let Some(input) = edge.input() {
            self.feed(input);
        }
        match edge {
            // The emulator's own doing, as is the end of the connection that follows.
            LinkRecord::Backlogged { port } | LinkRecord::Dropped { port } => {
                if let Some(line) = self.lines.current_peers.remove(port) {
                    self.lines.end(line, EndReason::Closed);
                    self.feed(Input::Disconnected { port: *port });
                }
            }
            LinkRecord::TimedFindings { on } => self.seat.report_timed_findings(*on),
            // A recording whose snapshots cannot be read was refused before.
            LinkRecord::Restored { snapshot, .. } => {
                if let Ok(next) = snapshot::from_json(snapshot) {
                    self.replace_controller(next);
                }
            }
            LinkRecord::Begin {
                connected, snapshot, ..
            } => {
                if let Ok(next) = snapshot::from_json(snapshot) {
                    self.begin(next, connected);
                }
            }
            LinkRecord::Reset { calendar } => {
                let mut next = self.initial_controller.clone();
                if let Some(calendar) = calendar {
                    next.set_calendar(*calendar);
                }
                let (now, controller, calendar) = (self.lines.now, &next, *calendar);
                self.seat.notify(now, Notice::Reset { controller, calendar });
                self.lines.current_peers.clear();
                self.waiting_peers.clear();
                self.seat.replace(next);
                self.lines.now = Time::ZERO;
            }
            LinkRecord::Settings { .. }
            | LinkRecord::Purged { .. }
            | LinkRecord::SerialErrors { .. }
            | LinkRecord::Injected { .. }
            | LinkRecord::SecondPeer { .. }
            | LinkRecord::NotPersisted { .. } => {}
        }
    }

    /// As the driver does it.
    fn replace_controller(&mut self, mut next: Controller) {
        let now = self.lines.now;
        self.seat.notify(now, Notice::Restored(&next));
        next.adopt_peers(&self.seat.controller);
        next.persist_outside(true);
        for waiting in &mut self.waiting_peers {
            // Sockets know nothing of another time of the controller.
            waiting.until = next.now() + waiting.until.since(self.lines.now);
        }
        self.lines.now = next.now();
        self.seat.replace(next);
        self.feed(Input::Tick);
    }

    /// Continues with a controller that knows its peers, in the middle of whatever they say to each other.
    fn begin(&mut self, mut next: Controller, connected: &BTreeSet<Port>) {
        next.persist_outside(true);
        self.seat.notify(self.lines.now, Notice::Restored(&next));
        self.waiting_peers.clear();
        let lines = connected.iter().map(|port| PeerId::first(*port));
        self.lines.current_peers = lines.map(|line| (line.port, line)).collect();
        let lines = self.lines.current_peers.values();
        let splitters = lines.map(|line| (*line, AnswerSplitter::new(*line, self.text)));
        self.lines.splitters = splitters.collect();
        self.lines.now = next.now();
        self.seat.replace(next);
    }

    fn connect(&mut self, line: PeerId, peer: &str) {
        let port = line.port;
        self.lines
            .splitters
            .insert(line, AnswerSplitter::new(line, self.text));
        if !self.seat.controller.network().is_used(port) {
            return self.lines.end(line, EndReason::Refused);
        }
        match (self.lines.current_peers.get(&port).copied(), self.second) {
            // The same cable, seen again after the power came on.
            (Some(_), _) if port.ethernet_index().is_none() => self.serve(line, peer),
            (None, _) => self.serve(line, peer),
            (Some(_), SecondConnection::Refuse) => self.waiting_peers.push(WaitingPeer {
                line,
                until: self.lines.now + CLOSE_GRACE,
                peer: peer.to_owned(),
                bytes: Vec::new(),
            }),
            (Some(old), SecondConnection::Replace) => {
                // The peer that comes under the number of one that was never seen to leave is the same line.
                if old != line {
                    self.lines.end(old, EndReason::Closed);
                }
                self.feed(Input::Disconnected { port });
                self.serve(line, peer);
            }
        }
    }

    fn serve(&mut self, line: PeerId, peer: &str) {
        let port = line.port;
        self.lines.current_peers.insert(port, line);
        let peer = peer.to_owned();
        self.feed(Input::Connected { port, peer });
    }

    fn receive(&mut self, line: PeerId, bytes: &[u8]) {
        let port = line.port;
        let mut waiting = self.waiting_peers.iter_mut();
        if let Some(waiting) = waiting.find(|waiting| waiting.line == line) {
            let room = MAX_WAITING_BYTES.saturating_sub(waiting.bytes.len());
            waiting.bytes.extend(bytes.iter().take(room));
            return;
        }
        if !self.lines.current_peers.contains_key(&port) && !self.lines.splitters.contains_key(&line) {
            // A recording may begin after the connection.
            self.connect(line, "");
        }
        if self.lines.current_peers.get(&port) == Some(&line) {
            if let Some(splitter) = self.lines.splitters.get_mut(&line) {
                splitter.push_host(bytes);
            }
            self.lines.refusals.remove(&port);
            self.lines.remarks.remove(&port);
            self.feed(Input::received(port, bytes.to_vec()));
        }
    }

    fn disconnect(&mut self, line: PeerId) {
        self.waiting_peers.retain(|waiting| waiting.line != line);
        let port = line.port;
        if self.lines.current_peers.get(&port) != Some(&line) {
            return;
        }
        self.lines.current_peers.remove(&port);
        self.feed(Input::Disconnected { port });
        let mut waiting = self.waiting_peers.iter();
        if let Some(next) = waiting.position(|waiting| waiting.line.port == port) {
            let next = self.waiting_peers.remove(next);
            self.serve(next.line, &next.peer);
            if !next.bytes.is_empty() {
                self.receive(next.line, &next.bytes);
            }
        }
    }

    /// Newcomers that have waited long enough are refused.
    fn refuse_overdue(&mut self) {
        let now = self.lines.now;
        for late in self.waiting_peers.extract_if(.., |waiting| waiting.until <= now) {
            self.lines.end(late.line, EndReason::Closed);
        }
    }

    fn feed(&mut self, input: Input) {
        let now = self.lines.now;
        let _refusal_is_an_event = self.seat.feed(now, input, Side::Host, &mut self.lines);
    }

    /// Takes the incomplete bytes of each line as an answer.
    pub(crate) fn flush_lines(&mut self) {
        let lines: Vec<PeerId> = self.lines.splitters.keys().copied().collect();
        lines.into_iter().for_each(|line| self.lines.flush(line));
    }

    /// Takes the incomplete bytes of a line as an answer.
    pub(crate) fn flush(&mut self, line: PeerId) {
        self.lines.flush(line);
    }
}

impl Lines {
    fn flush(&mut self, line: PeerId) {
        if let Some(answer) = self.splitters.get_mut(&line).and_then(AnswerSplitter::flush) {
            self.answer(line, answer);
        }
    }

    fn end(&mut self, line: PeerId, how: EndReason) {
        self.flush(line);
        let ended = RobotEvent::Ended(how, self.now);
        self.robot_events.entry(line).or_default().push_back(ended);
    }

    fn sent(&mut self, at: Time, port: Port, bytes: &Bytes) {
        let Some(line) = self.current_peers.get(&port).copied() else {
            return;
        };
        if let Some(sent) = &mut self.sent {
            let bytes = bytes.clone();
            sent.push(Sent { at, line, bytes });
        }
        let Some(splitter) = self.splitters.get_mut(&line) else {
            return;
        };
        for answer in splitter.push_robot(self.now, 0, bytes) {
            self.answer(line, answer);
        }
    }

    fn answer(&mut self, line: PeerId, answer: Answer) {
        let reason = self.refusals.remove(&line.port);
        let answer = RobotEvent::Answer(answer, reason);
        self.robot_events.entry(line).or_default().push_back(answer);
    }

    /// The Ethernet connections end; the cable of a serial port stays in.
    fn end_connections(&mut self) -> Vec<Input> {
        let mut ended = self.current_peers.clone();
        ended.retain(|port, _| port.ethernet_index().is_some());
        self.current_peers.retain(|port, _| !ended.contains_key(port));
        ended.values().for_each(|line| self.end(*line, EndReason::Closed));
        let ports = ended.into_keys();
        ports.map(|port| Input::Disconnected { port }).collect()
    }
}

impl Effects for Lines {
    /// A change that was stored in the recording is stored.
    fn persist(&mut self, at: Time, name: &str, _content: Option<Bytes>) -> Option<Result<(), PersistError>> {
        let first = self.not_persisted.front();
        let is_refused =
            first.is_some_and(|next| next.epoch == self.epoch && next.at == at && next.name == name);
        let refused = is_refused.then(|| self.not_persisted.pop_front()).flatten();
        Some(refused.map_or(Ok(()), |refused| Err(PersistError::Refused(refused.reason))))
    }

    fn perform(&mut self, at: Time, output: Output, _controller: &Controller) -> Vec<Input> {
        match output {
            Output::Send { port, bytes } => self.sent(at, port, &bytes),
            Output::PowerCycled | Output::PowerOff => return self.end_connections(),
            Output::Disconnect { port, how } => {
                let how = match how {
                    DisconnectMode::Reset => EndReason::Reset,
                    DisconnectMode::Close => EndReason::Closed,
                };
                if let Some(line) = self.current_peers.remove(&port) {
                    self.end(line, how);
                }
                return vec![Input::Disconnected { port }];
            }
            Output::Event(Event::Refused {
                port,
                command,
                reason,
            }) => {
                self.refusals.insert(port, format!("{command} refused: {reason}"));
            }
            Output::Event(Event::Finding(Finding {
                rule,
                port: Some(port),
                message,
                ..
            })) if !rule.timed => {
                self.remarks.insert(port, format!("{}: {message}", rule.id));
            }
            Output::Event(Event::Dropped { port, bytes, reason }) => {
                let remark = || format!("{bytes} bytes dropped: {reason}");
                self.remarks.entry(port).or_insert_with(remark);
            }
            // Of a half-open line the controller hears and says nothing by itself.
            Output::Stall { .. }
            | Output::Persist { .. }
            | Output::Stored { .. }
            | Output::Erased { .. }
            | Output::Pendant(_)
            | Output::Event(_) => {}
        }
        Vec::new()
    }
}

/// A change of a file that could not be stored in the recording.
#[derive(Debug, Clone)]
struct NotPersisted {
    /// Number of the epoch: each has times of its own.
    epoch: usize,
    at: Time,
    name: String,
    reason: String,
}

/// The changes that could not be stored, in order.
fn not_persisted(recording: &Recording) -> impl Iterator<Item = NotPersisted> {
    let epochs = recording.epochs().enumerate();
    let records = epochs.flat_map(|(epoch, part)| part.records.iter().map(move |record| (epoch, record)));
    records.filter_map(|(epoch, record)| {
        let RecordKind::Link(LinkRecord::NotPersisted { name, reason }) = &record.kind else {
            return None;
        };
        Some(NotPersisted {
            epoch,
            at: record.at,
            name: name.clone(),
            reason: reason.clone(),
        })
    })
}
