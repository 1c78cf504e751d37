//! A cell in which the steps of a plan are carried out, and the rules about exchanges.

use crate::figures::Figures;
use crate::host::{Asked, Host};
use crate::plan::{Plan, Step, programs};
use crate::rules::{Rule, Violation};
use crate::watch::Watch;
use std::hash::{DefaultHasher, Hasher};
use std::time::Duration;
use tracing::Span;
use ts3100_controller::{Action, Controller, Input, Port, Time};
use ts3100_driver::files::PathError;
use ts3100_driver::seat::{Notice, Seat, Side};
use ts3100_driver::snapshot;
use ts3100_driver::world::{Wire, WireEnd, World};
use ts3100_host::{Event as HostEvent, Response};
use ts3100_recording::transcript::{TranscriptFile, TranscriptSink};

/// Longest time without anything from a controller that owes an answer. A second of 9600 baud are 960 characters.
const LONGEST_ANSWER: Duration = Duration::from_secs(10);
/// Longest time until an SP, once nothing is open: 200 ms of legal variation, and a slow serial line.
const LONGEST_SP: Duration = Duration::from_secs(2);
/// Time passes in pieces of this while a host has an exchange open: it reads and answers in between.
const PIECE: Duration = Duration::from_millis(100);
/// Most turns of a host at one moment.
const MAX_TURNS: usize = 4_000;
/// Brings a robot to where programs can run, with the power on.
const RECOVERY: [&str; 8] = [
    "power on",
    "key-switch ext",
    "control-right ether",
    "emergency-stop release",
    "safety-switch close",
    "feed-hold off",
    "alarms reset",
    "servo on",
];
/// The wire that comes from outside.
const OUTSIDE: &str = "outside";

pub(crate) struct Cell {
    world: World<Watch>,
    now: Time,
    /// The kept state of each robot.
    kept: Vec<Option<Controller>>,
    figures: Figures,
}

impl Cell {
    pub fn new(plan: &Plan, canary: Option<Rule>) -> Cell {
        let mut world = World::new();
        for (number, robot) in plan.robots.iter().enumerate() {
            let files = programs()
                .map(|(name, content)| (name, content.to_vec()))
                .collect();
            // Its own programs, on an empty drive.
            let Ok(mut controller) = Controller::new(robot.config(), files) else {
                continue;
            };
            // What starting has put out is for the disk and the log, and no part of a snapshot.
            while controller.poll_output().is_some() {}
            controller.persist_outside(true);
            let watch = Watch::new(number, robot, &controller, canary);
            let mut seat = Seat::new(controller);
            seat.await_statements(true);
            world.add(Time::ZERO, seat, watch, Span::none());
        }
        let robots = world.robots().len();
        world.join(wires(robots));
        Cell {
            world,
            now: Time::ZERO,
            kept: vec![None; robots],
            figures: Figures::default(),
        }
    }

    /// Writes what happens to a robot from now on.
    pub fn record(&mut self, robot: usize, plan: &Plan, target: TranscriptFile) -> Result<(), PathError> {
        let header = plan.robots[robot].header();
        let sink = TranscriptSink::create(header, &[target], None, None)?;
        self.world[robot].seat.subscribe(Box::new(sink));
        Ok(())
    }

    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Everything that was put out, as a number.
    pub fn digest(&self) -> u64 {
        let mut digest = DefaultHasher::new();
        for robot in self.world.robots() {
            digest.write_u64(robot.edge.digest());
        }
        digest.finish()
    }

    /// Carries steps out, until a rule is broken.
    pub fn run(&mut self, steps: &[Step]) -> Result<(), Violation> {
        let mut result = Ok(());
        for step in steps {
            self.figures.steps += 1;
            self.step(step);
            result = self.settle();
            if result.is_err() {
                break;
            }
        }
        for robot in self.world.robots_mut() {
            let figures = std::mem::take(&mut robot.edge.figures);
            self.figures.add(&figures);
        }
        self.figures.pass(self.now.since(Time::ZERO));
        result
    }

    /// Hosts read and answer; returns what is broken.
    fn settle(&mut self) -> Result<(), Violation> {
        for robot in 0..self.world.robots().len() {
            for port in [Port::Ip0, Port::Host] {
                self.converse(robot, port);
            }
            self.check_deadlines(robot);
        }
        let broken = self
            .world
            .robots_mut()
            .iter_mut()
            .find_map(|robot| robot.edge.violation.take());
        broken.map_or(Ok(()), Err)
    }

    fn host(&mut self, robot: usize, port: Port) -> Option<&mut Host> {
        self.world[robot].edge.hosts.get_mut(&port)
    }

    fn time(&self, robot: usize) -> Time {
        self.world[robot].time_at(self.now)
    }

    fn feed(&mut self, robot: usize, input: Input) {
        // A refusal is an event.
        let _ = self.world.feed(self.now, robot, input, Side::Host);
    }

    fn act(&mut self, robot: usize, action: Action) {
        self.feed(robot, Input::by_owner(action));
    }

    fn step(&mut self, step: &Step) {
        match step {
            Step::Connect { robot, port } => self.connect(*robot, *port),
            Step::Disconnect { robot, port } => self.disconnect(*robot, *port),
            Step::Ask {
                robot,
                port,
                command,
                cut,
            } => self.ask(*robot, *port, command, *cut, None),
            Step::Download {
                robot, port, name, ..
            } => {
                self.ask(*robot, *port, &format!("DL,{name}"), false, step.content());
            }
            Step::Noise { robot, port, bytes } => self.disturb(*robot, *port, bytes),
            Step::Act { robot, action } => self.act(*robot, action.clone()),
            Step::Recover { robot } => self.recover(*robot),
            Step::Outside { on } => self.world.set_outside(self.now, OUTSIDE.to_owned(), *on),
            Step::Disk { robot, refuses, slow } => {
                let disk = &mut self.world[*robot].edge.disk;
                (disk.refuses, disk.slow) = (*refuses, *slow);
            }
            Step::Snapshot { robot } => self.snapshot(*robot),
            Step::Restore { robot } => self.restore(*robot),
            Step::Agree { robot } => self.agree(*robot),
            Step::Pass(time) => self.pass(*time),
        }
    }

    fn is_powered(&self, robot: usize) -> bool {
        self.world[robot].seat.controller.state().powered
    }

    fn connect(&mut self, robot: usize, port: Port) {
        self.disconnect(robot, port);
        let is_open = self.world[robot].seat.controller.network().is_used(port);
        if !is_open || !self.is_powered(robot) || self.world.is_storing() {
            return;
        }
        match self.host(robot, port) {
            Some(host) => host.connect(),
            None => drop(self.world[robot].edge.partners.insert(port)),
        }
        let peer = "simulation".to_owned();
        self.feed(robot, Input::Connected { port, peer });
    }

    fn disconnect(&mut self, robot: usize, port: Port) {
        let is_there = match self.host(robot, port) {
            Some(host) => {
                let is_there = host.is_connected;
                host.leave();
                is_there
            }
            None => self.world[robot].edge.partners.remove(&port),
        };
        if is_there {
            self.feed(robot, Input::Disconnected { port });
        }
    }

    fn ask(&mut self, robot: usize, port: Port, command: &str, cut: bool, file: Option<Vec<u8>>) {
        let now = self.time(robot);
        // While a disk of the cell works, a command waits outside of its robot.
        let waits = self.world.is_storing();
        let Some(host) = self.host(robot, port).filter(|host| host.is_idle()) else {
            return;
        };
        host.ask(now, command, file);
        if let Some(asked) = host.asked.as_mut() {
            asked.crosses |= waits;
        }
        if cut && let Some(bytes) = host.conversation.poll_transmit(Duration::ZERO) {
            let (first, rest) = bytes.split_at(bytes.len() / 2);
            self.feed(robot, Input::received(port, first.to_vec()));
            self.feed(robot, Input::received(port, rest.to_vec()));
        }
        self.converse(robot, port);
    }

    /// A host sends, reads and answers, as long as anything comes without time passing.
    fn converse(&mut self, robot: usize, port: Port) {
        for _ in 0..MAX_TURNS {
            let now = self.time(robot);
            let Some(host) = self.host(robot, port).filter(|host| host.is_connected) else {
                return;
            };
            if host.is_spoiled {
                host.incoming.clear();
                return;
            }
            if let Some(bytes) = host.conversation.poll_transmit(Duration::ZERO) {
                self.feed(robot, Input::received(port, bytes));
            } else if !host.incoming.is_empty() {
                let bytes = std::mem::take(&mut host.incoming);
                if let Some(asked) = &mut host.asked {
                    asked.at = now;
                }
                host.conversation.receive(Duration::ZERO, &bytes);
            } else if let Some(event) = host.conversation.poll_event() {
                self.judge(robot, port, now, event);
            } else {
                return;
            }
        }
    }

    fn judge(&mut self, robot: usize, port: Port, now: Time, event: HostEvent) {
        let edge = &mut self.world[robot].edge;
        let Some(host) = edge.hosts.get_mut(&port) else {
            return;
        };
        match event {
            HostEvent::Response(response) => {
                let Some(asked) = host.asked.as_mut() else {
                    return edge.report(Rule::OneAnswer, now, "an answer without a request");
                };
                if response == Response::Ok
                    && let Some(file) = asked.file.take()
                {
                    host.conversation.send_file(file);
                    return;
                }
                let command = std::mem::take(&mut asked.command);
                let is_valid = host.is_valid.take();
                (host.asked, host.idle_since) = (None, now);
                host.response = Some((now, response.clone()));
                edge.figures.exchanges += 1;
                edge.figures.check(Rule::OneAnswer);
                edge.figures.check(Rule::Permissions);
                if is_valid == Some(false) && response != Response::Ng {
                    edge.report(
                        Rule::Permissions,
                        now,
                        format!("{command} on {port} is served where the manual has it invalid"),
                    );
                }
            }
            HostEvent::Stopped => {
                host.owed = None;
                // A text that is still on a serial line has not opened its exchange.
                let is_open = |asked: &mut Asked| !std::mem::take(&mut asked.crosses);
                let is_inside = port == Port::Ip0 && host.asked.as_mut().is_some_and(is_open);
                edge.figures.check(Rule::SpOutsideExchanges);
                if is_inside {
                    edge.report(
                        Rule::SpOutsideExchanges,
                        now,
                        format!("SP inside an exchange on {port}"),
                    );
                }
            }
            HostEvent::Failed(error) => {
                let command = host.asked.take().map(|asked| asked.command);
                edge.report(
                    Rule::OneAnswer,
                    now,
                    format!("{command:?} on {port}: {error}: {error:?}"),
                );
            }
            HostEvent::Skipped { bytes } => {
                edge.report(
                    Rule::OneAnswer,
                    now,
                    format!("{bytes} bytes of no text on {port}"),
                );
            }
            HostEvent::Text(_) | HostEvent::Bytes(_) => {
                edge.report(
                    Rule::OneAnswer,
                    now,
                    format!("a text on {port} without a request"),
                );
            }
        }
    }

    /// Answers and SPs that have not come.
    fn check_deadlines(&mut self, robot: usize) {
        let now = self.time(robot);
        if self.world.is_storing() || !self.is_powered(robot) {
            return;
        }
        let edge = &mut self.world[robot].edge;
        let mut late = None;
        for (port, host) in &edge.hosts {
            if !host.is_connected || host.is_spoiled {
                continue;
            }
            if let Some(asked) = &host.asked
                && now.since(asked.at) > LONGEST_ANSWER
            {
                late = Some((
                    Rule::OneAnswer,
                    format!("no answer to {} on {port}", asked.command),
                ));
            }
            if let Some(owed) = host.owed
                && host.asked.is_none()
                && now.since(owed.max(host.idle_since)) > LONGEST_SP
            {
                let seen = format!("a program has stopped at {owed} and no SP has come on {port}");
                late = Some((Rule::StopsReported, seen));
            }
        }
        edge.figures.check(Rule::StopsReported);
        if let Some((rule, seen)) = late {
            edge.report(rule, now, seen);
        }
    }

    fn disturb(&mut self, robot: usize, port: Port, bytes: &[u8]) {
        match self.host(robot, port) {
            Some(host) if host.is_connected => {
                host.is_spoiled = true;
                host.asked = None;
            }
            Some(_) => return,
            None => {}
        }
        self.feed(robot, Input::received(port, bytes.to_vec()));
    }

    fn recover(&mut self, robot: usize) {
        self.answer_disks();
        for action in RECOVERY.iter().filter_map(|words| words.parse().ok()) {
            self.act(robot, action);
        }
        for port in [Port::Ip0, Port::Ip1] {
            let is_good = match self.host(robot, port) {
                Some(host) => host.is_connected && !host.is_spoiled,
                None => self.world[robot].edge.partners.contains(&port),
            };
            if !is_good {
                self.connect(robot, port);
            }
        }
    }

    /// Every disk that is slow answers.
    fn answer_disks(&mut self) {
        for _ in 0..MAX_TURNS {
            let robots = self.world.robots_mut();
            let answer = robots.iter_mut().enumerate();
            let answer = answer.filter_map(|(number, robot)| Some((number, robot.edge.disk.answer()?)));
            let Some((robot, answer)) = { answer }.next() else {
                return;
            };
            // The result is that of an action before.
            let _ = self
                .world
                .feed(self.now, robot, Input::Persisted(answer), Side::Robot);
        }
    }

    fn snapshot(&mut self, robot: usize) {
        self.answer_disks();
        let at = self.time(robot);
        let place = &mut self.world[robot];
        let line = snapshot::to_json_line(&place.seat.controller);
        place.edge.figures.snapshots += 1;
        place.edge.figures.check(Rule::Snapshots);
        match snapshot::from_json(&line) {
            Ok(mut restored) => {
                restored.persist_outside(true);
                if restored != place.seat.controller || place.edge.is_canary(Rule::Snapshots) {
                    place
                        .edge
                        .report(Rule::Snapshots, at, "it differs from what was read back");
                }
                self.kept[robot] = Some(restored.clone());
                place.seat.controller = restored;
            }
            Err(error) => place.edge.report(Rule::Snapshots, at, error.to_string()),
        }
    }

    fn restore(&mut self, robot: usize) {
        self.answer_disks();
        let Some(mut next) = self.kept[robot].clone() else {
            return;
        };
        // The ports of a robot without power are closed, and those with other parameters open anew: no peer is adopted.
        let same_ports = next.network() == self.world[robot].seat.controller.network();
        if !same_ports || !next.state().powered || !self.is_powered(robot) {
            for port in [Port::Ip0, Port::Host, Port::Ip1, Port::Com1] {
                self.disconnect(robot, port);
            }
        }
        let (now, moment) = (self.time(robot), self.now);
        let place = &mut self.world[robot];
        place.seat.notify(now, Notice::Restored(&next));
        next.adopt_peers(&place.seat.controller);
        next.persist_outside(true);
        let time = next.now();
        place.seat.controller = next;
        place.set_time(moment, time);
        let (seat, edge) = (&place.seat, &mut place.edge);
        edge.begin_again(&seat.controller);
        edge.figures.restores += 1;
        self.feed(robot, Input::Tick);
    }

    /// The content of a status that is asked for and answered at this moment.
    fn status(&mut self, robot: usize, command: &str) -> Option<Vec<u8>> {
        let now = self.time(robot);
        self.ask(robot, Port::Ip0, command, false, None);
        match self.host(robot, Port::Ip0)?.response.take() {
            Some((at, Response::Content(content))) if at == now => Some(content),
            _ => None,
        }
    }

    fn agree(&mut self, robot: usize) {
        if !self.world[robot].edge.is_prompt || self.world.is_storing() {
            return;
        }
        if self.host(robot, Port::Ip0).is_none_or(|host| !host.is_idle()) {
            return;
        }
        let faults = self.world[robot].edge.figures.faults;
        let Some(sf) = self.status(robot, "SF") else {
            return;
        };
        let Some(su) = self.status(robot, "SU") else {
            return;
        };
        let unseen = self
            .host(robot, Port::Ip0)
            .map(|host| host.unseen)
            .unwrap_or_default();
        let sm = self.status(robot, "SM,1");
        let now = self.time(robot);
        let place = &mut self.world[robot];
        let (state, edge) = (place.seat.controller.state(), &mut place.edge);
        if edge.figures.faults != faults {
            // One has changed the state in between.
            return;
        }
        let mut wrong = Vec::new();
        let mut hold = |holds: bool, what: String| {
            if !holds {
                wrong.push(what);
            }
        };
        let servo = u8::from(state.servo ^ edge.is_canary(Rule::Agreement));
        hold(sf[0] == servo, format!("SF has servo power {}", sf[0]));
        let stop = u8::from(state.emergency_stop);
        hold(sf[1] == stop, format!("SF has emergency stop {}", sf[1]));
        let status = ["stop(reset)", "running", "stop(retry)", "stop(continue)"].get(usize::from(sf[2]));
        let text = String::from_utf8_lossy(&su).replace(' ', "");
        let said = status.is_some_and(|status| text.trim_end().ends_with(&format!("STATUS:{status}")));
        hold(said, format!("SF has motion status {}, SU {text:?}", sf[2]));
        let mut events = None;
        if let Some(sm) = sm {
            let text = String::from_utf8_lossy(&sm).into_owned();
            let says = |word: &str, on: bool| text.contains(&format!("{word}{}", u8::from(on)));
            hold(
                says("ES", state.emergency_stop) && says("SS", state.safety_open),
                format!("SM is {text:?}"),
            );
            let expected = unseen.map(|seen| seen ^ edge.is_canary(Rule::EventsOnce));
            let holds = says("EE", expected[0]) && says("SE", expected[1]);
            events = Some((holds, format!("SM is {text:?} where EE and SE are {expected:?}")));
        }
        edge.figures.check(Rule::Agreement);
        if let Some(first) = wrong.into_iter().next() {
            edge.report(Rule::Agreement, now, first);
        }
        if let Some((holds, seen)) = events {
            edge.figures.check(Rule::EventsOnce);
            if !holds {
                edge.report(Rule::EventsOnce, now, seen);
            }
        }
    }

    /// Time passes; a host with an open exchange answers in between.
    fn pass(&mut self, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            let hosts = self
                .world
                .robots()
                .iter()
                .flat_map(|robot| robot.edge.hosts.values());
            let is_open = { hosts }.any(|host| host.asked.is_some());
            self.now = if is_open { end.min(self.now + PIECE) } else { end };
            self.answer_disks();
            self.world.advance(self.now);
            for robot in 0..self.world.robots().len() {
                for port in [Port::Ip0, Port::Host] {
                    self.converse(robot, port);
                }
                self.check_deadlines(robot);
            }
        }
    }
}

/// The outside line goes to the first robot, and an output of each robot to an input of the next.
fn wires(robots: usize) -> Vec<Wire> {
    let outside = Wire {
        from: WireEnd::Outside(OUTSIDE.to_owned()),
        to: WireEnd::Line { robot: 0, line: 3 },
        name: OUTSIDE.to_owned(),
    };
    let between = (1..robots).map(|robot| Wire {
        from: WireEnd::Line {
            robot: robot - 1,
            line: 1,
        },
        to: WireEnd::Line { robot, line: 1 },
        name: format!("ready-{robot}"),
    });
    std::iter::once(outside).chain(between).collect()
}
