//! A controller in virtual time with the lines of a recording: what the links and the hub of an emulator do, without
//! sockets (decision D3: one peer a channel). It keeps what the controller sends until somebody compares it.

use super::unit::{Cutter, Unit};
use crate::config::{SecondConnection, Settings};
use crate::driver::StartError;
use crate::loading;
use crate::snapshot;
use crate::tcp::CLOSE_GRACE;
use crate::transcript::{EndReason, LinkRecord, PeerId, Record, RecordKind, Recording};
use std::collections::{BTreeMap, VecDeque};
use ts3100_controller::findings::Rule;
use ts3100_controller::output::{DisconnectMode, Event};
use ts3100_controller::{Action, Controller, Input, Output, PanelAction, Port, Time};
use ts3100_proto::parameter::OpenMode;
use ts3100_proto::text::TextOptions;

/// Bytes that a newcomer's peer may send before it is served.
const MAX_EARLY: usize = 65_536;

/// Something the controller has done on a line.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Produced {
    /// An answer, and why it refuses, if it does.
    Answer(Unit, Option<String>),
    /// It has ended the connection.
    Ended(EndReason, Time),
}

/// A newcomer that waits for its predecessor to end.
#[derive(Debug, Clone)]
struct Newcomer {
    line: PeerId,
    since: Time,
    peer: String,
    bytes: Vec<u8>,
}

/// A controller and its lines.
#[derive(Debug, Clone)]
pub(super) struct Player {
    controller: Controller,
    /// As it was before the first input.
    initial: Controller,
    text: TextOptions,
    second: SecondConnection,
    now: Time,
    /// The peer each port serves.
    served: BTreeMap<Port, PeerId>,
    newcomers: Vec<Newcomer>,
    cutters: BTreeMap<PeerId, Cutter>,
    produced: BTreeMap<PeerId, VecDeque<Produced>>,
    /// Why the last command of a port was refused.
    refused: BTreeMap<Port, String>,
    /// What was said about the bytes a port has last received: why nothing may come of them.
    remarks: BTreeMap<Port, String>,
    /// Changes of files that were not kept, as they were recorded: when, which, why.
    unkept: VecDeque<(Time, String, String)>,
}

impl Player {
    /// As `serve` starts.
    pub(super) fn power_on(settings: &Settings, recording: &Recording) -> Result<Player, StartError> {
        let mut controller = loading::power_on(settings)?.controller;
        // What starting has put out is for the disk and the log.
        while controller.poll_output().is_some() {}
        controller.persist_outside(true);
        let mut player = Player {
            initial: controller.clone(),
            controller,
            text: settings.controller.options.text,
            second: settings.links.second,
            now: Time::ZERO,
            served: BTreeMap::new(),
            newcomers: Vec::new(),
            cutters: BTreeMap::new(),
            produced: BTreeMap::new(),
            refused: BTreeMap::new(),
            remarks: BTreeMap::new(),
            unkept: recording.records.iter().filter_map(unkept).collect(),
        };
        if settings.servo_on {
            player.feed(Input::Panel(PanelAction::Servo(true)));
        }
        Ok(player)
    }

    pub(super) fn now(&self) -> Time {
        self.now
    }

    /// When something happens by itself.
    pub(super) fn deadline(&self) -> Option<Time> {
        let newcomers = self.newcomers.iter().map(|newcomer| newcomer.since + CLOSE_GRACE);
        newcomers.chain(self.controller.poll_deadline()).min()
    }

    /// Lets time pass, each deadline at its own time.
    pub(super) fn advance_to(&mut self, to: Time) {
        while let Some(due) = self.deadline().filter(|due| *due <= to) {
            self.now = self.now.max(due);
            self.turn_away();
            self.feed(Input::Tick);
        }
        self.now = self.now.max(to);
    }

    /// The next thing the controller has done on a line.
    pub(super) fn first(&self, line: PeerId) -> Option<&Produced> {
        self.produced.get(&line)?.front()
    }

    /// The one behind it.
    pub(super) fn second(&self, line: PeerId) -> Option<&Produced> {
        self.produced.get(&line)?.get(1)
    }

    /// Takes the next thing the controller has done on a line.
    pub(super) fn take(&mut self, line: PeerId) -> Option<Produced> {
        self.produced.get_mut(&line)?.pop_front()
    }

    /// Why nothing may have come of what a port has last received, as far as that is known.
    pub(super) fn remark(&self, port: Port) -> Option<String> {
        let remark = self.refused.get(&port).or_else(|| self.remarks.get(&port));
        remark.cloned()
    }

    /// Lines on which something is left.
    pub(super) fn left(&self) -> Vec<PeerId> {
        let left = self.produced.iter().filter(|(_, produced)| !produced.is_empty());
        left.map(|(line, _)| *line).collect()
    }

    /// What has no end on a line is an answer as it is.
    pub(super) fn flush(&mut self, line: PeerId) {
        if let Some(unit) = self.cutters.get_mut(&line).and_then(Cutter::flush) {
            self.answer(line, unit);
        }
    }

    /// Plays what the host or somebody at the panel does.
    pub(super) fn play(&mut self, what: &RecordKind) {
        let lines: Vec<PeerId> = self.cutters.keys().copied().collect();
        lines.into_iter().for_each(|line| self.flush(line));
        match what {
            RecordKind::Connected { line, peer } => self.arrive(*line, peer),
            RecordKind::FromHost { line, bytes } => self.host_bytes(*line, bytes),
            RecordKind::Ended { line, .. } => self.leave(*line),
            RecordKind::Action(Action::Panel(panel)) => self.feed(Input::Panel(panel.clone())),
            RecordKind::Action(action) => self.feed(Input::Action(action.clone())),
            RecordKind::Edge(edge) => self.edge(edge),
            RecordKind::FromRobot { .. } | RecordKind::Remark(_) => {}
        }
    }

    fn edge(&mut self, edge: &LinkRecord) {
        if let Some(input) = edge.input() {
            self.feed(input);
        }
        match edge {
            // The emulator's own doing, as what ends the connection behind it.
            LinkRecord::Unread { port } | LinkRecord::Dropped { port } => {
                if let Some(line) = self.served.remove(port) {
                    self.end(line, EndReason::Closed);
                    self.feed(Input::Disconnected { port: *port });
                }
            }
            // A recording whose snapshots cannot be read was refused before.
            LinkRecord::Restored { snapshot, .. } => {
                if let Ok(next) = snapshot::from_json(snapshot) {
                    self.put_in(next);
                }
            }
            LinkRecord::Reset { calendar } => {
                let mut next = self.initial.clone();
                if let Some(calendar) = calendar {
                    next.set_calendar(*calendar);
                }
                self.served.clear();
                self.newcomers.clear();
                self.controller = next;
                self.now = Time::ZERO;
            }
            LinkRecord::Settings { .. }
            | LinkRecord::Purged { .. }
            | LinkRecord::Garbled { .. }
            | LinkRecord::Second { .. }
            | LinkRecord::Unkept { .. } => {}
        }
    }

    /// As the hub does it.
    fn put_in(&mut self, mut next: Controller) {
        next.adopt_peers(&self.controller);
        next.persist_outside(true);
        self.now = next.now();
        self.controller = next;
        self.feed(Input::Tick);
    }

    fn arrive(&mut self, line: PeerId, peer: &str) {
        let port = line.port;
        self.cutters.insert(line, Cutter::new(line, self.text));
        let channel = port
            .ethernet_index()
            .and_then(|index| self.controller.network().channels.get(index));
        if channel.is_some_and(|channel| channel.mode == OpenMode::NotUsed) {
            return self.end(line, EndReason::Refused);
        }
        match (self.served.get(&port).copied(), self.second) {
            // The same cable, seen anew after the power came on.
            (Some(_), _) if port.ethernet_index().is_none() => self.serve(line, peer),
            (None, _) => self.serve(line, peer),
            (Some(_), SecondConnection::Refuse) => self.newcomers.push(Newcomer {
                line,
                since: self.now,
                peer: peer.to_owned(),
                bytes: Vec::new(),
            }),
            (Some(old), SecondConnection::Replace) => {
                // The peer that comes under the number of one that was never seen to leave is the same line.
                if old != line {
                    self.end(old, EndReason::Closed);
                }
                self.feed(Input::Disconnected { port });
                self.serve(line, peer);
            }
        }
    }

    fn serve(&mut self, line: PeerId, peer: &str) {
        let port = line.port;
        self.served.insert(port, line);
        let peer = peer.to_owned();
        self.feed(Input::Connected { port, peer });
    }

    fn host_bytes(&mut self, line: PeerId, bytes: &[u8]) {
        let port = line.port;
        if let Some(newcomer) = self.newcomers.iter_mut().find(|newcomer| newcomer.line == line) {
            let room = MAX_EARLY.saturating_sub(newcomer.bytes.len());
            newcomer.bytes.extend(bytes.iter().take(room));
            return;
        }
        if !self.served.contains_key(&port) && !self.cutters.contains_key(&line) {
            // A recording may begin behind the connection.
            self.arrive(line, "");
        }
        if self.served.get(&port) == Some(&line) {
            if let Some(cutter) = self.cutters.get_mut(&line) {
                cutter.host(bytes);
            }
            self.refused.remove(&port);
            self.remarks.remove(&port);
            let bytes = bytes.to_vec();
            self.feed(Input::Received { port, bytes });
        }
    }

    fn leave(&mut self, line: PeerId) {
        self.newcomers.retain(|newcomer| newcomer.line != line);
        let port = line.port;
        if self.served.get(&port) != Some(&line) {
            return;
        }
        self.served.remove(&port);
        self.feed(Input::Disconnected { port });
        let next = self
            .newcomers
            .iter()
            .position(|newcomer| newcomer.line.port == port);
        if let Some(next) = next {
            let Newcomer {
                line, peer, bytes, ..
            } = self.newcomers.remove(next);
            self.serve(line, &peer);
            if !bytes.is_empty() {
                self.host_bytes(line, &bytes);
            }
        }
    }

    /// Newcomers that have waited long enough are refused.
    fn turn_away(&mut self) {
        let now = self.now;
        let (late, waiting) = std::mem::take(&mut self.newcomers)
            .into_iter()
            .partition(|newcomer: &Newcomer| newcomer.since + CLOSE_GRACE <= now);
        self.newcomers = waiting;
        for newcomer in late {
            self.end(newcomer.line, EndReason::Closed);
        }
    }

    fn end(&mut self, line: PeerId, how: EndReason) {
        self.flush(line);
        let now = self.now;
        self.produced
            .entry(line)
            .or_default()
            .push_back(Produced::Ended(how, now));
    }

    fn feed(&mut self, input: Input) {
        let mut inputs = VecDeque::from([input]);
        while let Some(input) = inputs.pop_front() {
            self.controller.handle(self.now, input);
            while let Some(output) = self.controller.poll_output() {
                match output {
                    Output::Send { port, bytes } => self.sent(port, &bytes),
                    Output::PowerCycled | Output::PowerOff => {
                        let served = std::mem::take(&mut self.served);
                        for (port, line) in served {
                            // The cable of a serial port stays in.
                            if port.ethernet_index().is_none() {
                                self.served.insert(port, line);
                                continue;
                            }
                            self.end(line, EndReason::Closed);
                            inputs.push_back(Input::Disconnected { port });
                        }
                    }
                    Output::Disconnect { port, how } => {
                        if let Some(line) = self.served.remove(&port) {
                            self.end(
                                line,
                                match how {
                                    DisconnectMode::Reset => EndReason::Reset,
                                    DisconnectMode::Close => EndReason::Closed,
                                },
                            );
                        }
                        inputs.push_back(Input::Disconnected { port });
                    }
                    Output::Event(Event::Refused {
                        port,
                        command,
                        reason,
                    }) => {
                        self.refused.insert(port, format!("{command} refused: {reason}"));
                    }
                    Output::Event(Event::Finding {
                        rule,
                        port: Some(port),
                        message,
                        ..
                    }) if !Rule::by_id(rule).is_some_and(|rule| rule.timed) => {
                        self.remarks.insert(port, format!("{rule}: {message}"));
                    }
                    Output::Event(Event::Dropped { port, bytes, reason }) => {
                        let remark = || format!("{bytes} bytes dropped: {reason}");
                        self.remarks.entry(port).or_insert_with(remark);
                    }
                    Output::Persist { name, .. } => {
                        let answer = self.answer_of(&name);
                        self.controller.handle(self.now, Input::Persisted(answer));
                    }
                    // Of a half-open line the controller hears and says nothing by itself.
                    Output::Stall { .. } => {}
                    Output::Stored { .. }
                    | Output::Erased { .. }
                    | Output::Pendant(_)
                    | Output::Rejected(_)
                    | Output::Event(_) => {}
                }
            }
        }
    }

    /// What was kept in the recording is kept.
    fn answer_of(&mut self, name: &str) -> Result<(), String> {
        let now = self.now;
        match self.unkept.front() {
            Some((at, file, _)) if *at == now && file == name => {}
            _ => return Ok(()),
        }
        let refused = self.unkept.pop_front();
        refused.map_or(Ok(()), |(_, _, reason)| Err(reason))
    }

    fn sent(&mut self, port: Port, bytes: &[u8]) {
        let Some(line) = self.served.get(&port).copied() else {
            return;
        };
        let now = self.now;
        let units = self
            .cutters
            .get_mut(&line)
            .map(|cutter| cutter.robot(now, 0, bytes));
        for unit in units.unwrap_or_default() {
            self.answer(line, unit);
        }
    }

    fn answer(&mut self, line: PeerId, unit: Unit) {
        let reason = self.refused.remove(&line.port);
        self.produced
            .entry(line)
            .or_default()
            .push_back(Produced::Answer(unit, reason));
    }
}

/// A change that was not kept, if that is what was recorded.
fn unkept(record: &Record) -> Option<(Time, String, String)> {
    match &record.what {
        RecordKind::Edge(LinkRecord::Unkept { name, reason }) => {
            Some((record.at, name.clone(), reason.clone()))
        }
        _ => None,
    }
}
