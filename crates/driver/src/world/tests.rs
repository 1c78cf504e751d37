//! Tests of robots that share one time, without a socket.

use super::*;
use crate::seat::{ActionSource, PlannedAction, Subscriber};
use std::sync::{Arc, Mutex};
use ts3100_controller::action::Action;
use ts3100_controller::findings::Finding;
use ts3100_controller::{Config, Controller, Dialect, Event, Output, Port};
use ts3100_proto::status::ExecutionStatus;

/// Gives a part at its output 5 and waits until it was taken, half a second each.
const FEEDER: &str = "PROGRAM FEEDER\nN=0\nLOOP:\nDELAY 0.5\nDOUT(5)\nWAIT DIN(3)\nDOUT(-5)\nWAIT DIN(-3)\nN=N+1\n\
    PRINT IP1,\"FED\",N,CR\nGOTO LOOP\nEND\n";
/// Takes a part that is there.
const PICKER: &str =
    "PROGRAM PICKER\nLOOP:\nWAIT DIN(1)\nDELAY 0.2\nDOUT(2)\nWAIT DIN(-1)\nDOUT(-2)\nGOTO LOOP\nEND\n";
/// The system input that stops the program.
const STOP: u16 = 257;

/// An edge that keeps what its robot sends. One with a slow disk stores alarms until it is told that it has.
#[derive(Default)]
struct Edge {
    sent: Vec<(Time, Port, Vec<u8>)>,
    has_slow_disk: bool,
    is_storing: bool,
    is_late: bool,
}

impl Effects for Edge {
    fn is_storing(&self) -> bool {
        self.is_storing
    }

    fn perform(&mut self, at: Time, output: Output, _: &Controller) -> Vec<Input> {
        if let Output::Event(Event::Alarm { .. }) = &output {
            self.is_storing = self.has_slow_disk;
        }
        if let Output::Send { port, bytes } = output {
            self.sent.push((at, port, bytes.to_vec()));
        }
        Vec::new()
    }

    fn is_late(&mut self, _reached: Time) -> bool {
        self.is_late
    }
}

fn controller(program: &str) -> Controller {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    let mut controller = Controller::new(config, Vec::new()).unwrap();
    if !program.is_empty() {
        controller.put_file("P", program.as_bytes()).unwrap();
        controller.select(Time::ZERO, "P").unwrap();
    }
    controller
}

fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

/// Robots with these programs, which run; one without a program has its servo on.
fn world(programs: &[&str]) -> World<Edge> {
    let mut world = World::new();
    for program in programs {
        let seat = Seat::new(controller(program));
        let robot = world.add(Time::ZERO, seat, Edge::default(), Span::none());
        act(&mut world, Time::ZERO, robot, "servo on");
        if !program.is_empty() {
            act(&mut world, Time::ZERO, robot, "program start");
        }
    }
    world
}

fn act(world: &mut World<Edge>, now: Time, robot: usize, words: &str) {
    let action: Action = words.parse().unwrap();
    let done = world.feed(now, robot, Input::by_owner(action), Side::Host);
    assert_eq!(done, Ok(Accepted::Done), "{words}");
}

fn line(robot: usize, line: u16) -> WireEnd {
    WireEnd::Line { robot, line }
}

fn outside(name: &str) -> WireEnd {
    WireEnd::Outside(name.to_owned())
}

fn wire(from: WireEnd, to: WireEnd) -> Wire {
    let name = format!("{from:?} to {to:?}");
    Wire { from, to, name }
}

fn input(world: &World<Edge>, robot: usize, line: u16) -> bool {
    world[robot].seat.controller.signals().input(line)
}

fn status(world: &World<Edge>, robot: usize) -> ExecutionStatus {
    world[robot].seat.controller.status()
}

/// Two robots that shake hands, with a stop for both.
fn cell() -> World<Edge> {
    let mut world = world(&[FEEDER, PICKER]);
    let connected = Input::Connected {
        port: Port::Ip1,
        peer: "suite".to_owned(),
    };
    world.feed(Time::ZERO, 0, connected, Side::Host).unwrap();
    world.join(vec![
        wire(line(0, 5), line(1, 1)),
        wire(line(1, 2), line(0, 3)),
        wire(outside("stop"), line(0, STOP)),
        wire(outside("stop"), line(1, STOP)),
        wire(line(1, 2), outside("taken")),
    ]);
    world
}

#[test]
fn a_robot_without_a_disk_keeps_every_change_of_a_file_at_once() {
    let mut world = world(&[""]);
    world.robots_mut()[0].seat.controller.persist_outside(true);
    let (name, content) = ("NEW".to_owned(), b"PROGRAM NEW\nEND\n".to_vec());
    let file = |world: &World<Edge>| world[0].seat.controller.drive().get("NEW").map(<[u8]>::to_vec);
    for (action, kept) in [
        (
            Action::PutFile {
                name: name.clone(),
                content: content.clone(),
            },
            Some(content),
        ),
        (Action::EraseFile { name }, None),
    ] {
        let done = world.feed(Time::ZERO, 0, Input::by_owner(action), Side::Host);
        assert_eq!(done, Ok(Accepted::Done));
        assert_eq!(file(&world), kept);
        assert!(!world.has_waiting_inputs());
    }
}

#[test]
fn wires_a_shared_stop_and_a_restore_of_two_robots_need_no_socket() {
    let mut world = cell();
    world.advance(ms(10_000));
    // 0.5 s to give, 0.2 s to take.
    let fed = world[0].edge.sent.len();
    assert!((12..=14).contains(&fed), "{:?}", world[0].edge.sent);

    let before: Vec<Controller> = (0..2).map(|robot| world[robot].seat.controller.clone()).collect();
    let levels = world.levels();
    world.set_outside(ms(11_000), "stop".to_owned(), true);
    for robot in 0..2 {
        assert!(input(&world, robot, STOP));
        assert_ne!(status(&world, robot), ExecutionStatus::Running);
    }
    world.set_outside(ms(12_000), "stop".to_owned(), false);

    // Both go on from where they were, with the time of then.
    world.cut_wires();
    for (robot, controller) in before.into_iter().enumerate() {
        let time = controller.now();
        world[robot].seat.controller = controller;
        world[robot].set_time(ms(12_000), time);
    }
    world.mend_wires();
    assert_eq!(world.levels(), levels);
    let played = |world: &mut World<Edge>, from: u64| {
        world[0].edge.sent.clear();
        world.advance(ms(from + 5_000));
        std::mem::take(&mut world[0].edge.sent)
    };
    let again = played(&mut world, 12_000);
    let mut other = cell();
    other.advance(ms(10_000));
    assert_eq!(again, played(&mut other, 10_000));
    assert!(!again.is_empty());
}

/// The number of a robot, and when which of its inputs has become what.
type Change = (usize, Time, u16, bool);

#[derive(Clone, Default)]
struct Changes(Arc<Mutex<Vec<Change>>>);

struct OfRobot(usize, Changes);

impl Subscriber for OfRobot {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        if let Input::Action {
            action: Action::Panel(PanelAction::InputLine { line, on }),
            ..
        } = input
        {
            self.1.0.lock().unwrap().push((self.0, at, *line, *on));
        }
    }
}

#[test]
fn what_follows_at_one_moment_happens_in_rounds_that_take_no_time() {
    // Each answers at the moment at which it is asked.
    const ECHO: &str = "PROGRAM P\nWAIT DIN(1)\nDOUT(1)\nEND\n";
    let mut world = world(&[ECHO, ECHO, ECHO]);
    let changes = Changes::default();
    for robot in 0..3 {
        let seen = OfRobot(robot, changes.clone());
        world[robot].seat.subscribe(Box::new(seen));
    }
    world.join(vec![
        wire(outside("start"), line(0, 1)),
        wire(line(0, 1), line(1, 1)),
        wire(line(1, 1), line(2, 1)),
        wire(line(2, 1), line(0, 2)),
        // A wire that comes late in the list is not a round ahead of the others.
        wire(line(0, 1), line(0, 3)),
    ]);
    world.set_outside(ms(105), "start".to_owned(), true);
    let at = ms(105);
    let expected = [
        (0, at, 1, true),
        (1, at, 1, true),
        (0, at, 3, true),
        (2, at, 1, true),
        (0, at, 2, true),
    ];
    assert_eq!(*changes.0.lock().unwrap(), expected);
}

/// The findings with their times.
#[derive(Clone, Default)]
struct Found(Arc<Mutex<Vec<(Time, Finding)>>>);

impl Subscriber for Found {
    fn output(&mut self, at: Time, output: &Output) {
        if let Output::Event(Event::Finding(finding)) = output {
            self.0.lock().unwrap().push((at, finding.clone()));
        }
    }
}

impl Found {
    /// Those of a rule: time and message.
    fn of(&self, rule: &str) -> Vec<(Time, String)> {
        let found = self.0.lock().unwrap();
        let found = found.iter().filter(|(_, finding)| finding.rule.id == rule);
        found
            .map(|(at, finding)| (*at, finding.message.to_string()))
            .collect()
    }
}

#[test]
fn wires_that_go_on_changing_each_other_are_one_finding_that_names_them() {
    const FOLLOWS: &str = "PROGRAM P\nLOOP:\nWAIT DIN(1)\nDOUT(1)\nWAIT DIN(-1)\nDOUT(-1)\nGOTO LOOP\nEND\n";
    const CONTRADICTS: &str =
        "PROGRAM P\nDOUT(1)\nLOOP:\nWAIT DIN(1)\nDOUT(-1)\nWAIT DIN(-1)\nDOUT(1)\nGOTO LOOP\nEND\n";
    let named = |name: &str, from, to| Wire {
        name: name.to_owned(),
        ..wire(from, to)
    };
    let mut world = world(&[FOLLOWS, CONTRADICTS, ""]);
    let found = Found::default();
    for robot in 0..3 {
        world[robot].seat.subscribe(Box::new(found.clone()));
    }
    world.join(vec![
        named("a to c", line(0, 2), line(2, 1)),
        named("a to b", line(0, 1), line(1, 1)),
        named("b to a", line(1, 1), line(0, 1)),
    ]);
    world.advance(ms(1_000));
    let loops = found.of("wire-loop");
    let [(at, message)] = &loops[..] else {
        panic!("{loops:?}");
    };
    assert_eq!(*at, Time::ZERO);
    assert!(message.ends_with(": a to b, b to a"), "{message}");
    // A handshake that takes no time is none.
    let mut world = cell();
    let found = Found::default();
    world[0].seat.subscribe(Box::new(found.clone()));
    world[1].seat.subscribe(Box::new(found.clone()));
    world.advance(ms(10_000));
    assert_eq!(found.of("wire-loop"), []);
}

/// Actions at one time.
struct Together(Time, VecDeque<&'static str>);

impl ActionSource for Together {
    fn deadline(&self) -> Option<Time> {
        (!self.1.is_empty()).then_some(self.0)
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let action = self.1.pop_front_if(|_| self.0 <= now)?.parse().unwrap();
        Some((self.0, PlannedAction::Input(Input::by_owner(action))))
    }
}

#[test]
fn what_is_due_at_one_moment_happens_in_the_order_of_the_robots() {
    let mut world = world(&["", "", ""]);
    let changes = Changes::default();
    for robot in [2, 0, 1] {
        world[robot]
            .seat
            .plan(Box::new(Together(ms(1), ["input 7 on"].into())));
        let seen = OfRobot(robot, changes.clone());
        world[robot].seat.subscribe(Box::new(seen));
    }
    world[1]
        .seat
        .plan(Box::new(Together(ms(2), ["input 7 on"].into())));
    world.advance(ms(3));
    let order: Vec<usize> = (0..3).filter(|robot| input(&world, *robot, 7)).collect();
    assert_eq!(order, [0, 1, 2]);
}

#[test]
fn robots_that_lag_lag_together() {
    let mut world = world(&["", ""]);
    world[0]
        .seat
        .plan(Box::new(Together(ms(5), ["output 1 on"].into())));
    world[1]
        .seat
        .plan(Box::new(Together(ms(6), ["output 1 on"].into())));
    world[0].edge.is_late = true;
    let done = world.feed(ms(8), 1, Input::Tick, Side::Host);
    assert_eq!(done, Ok(Accepted::Done));
    assert_eq!(world.take_late(), Some(ms(5)));
    let output = |robot: usize| world[robot].seat.controller.signals().output(1);
    assert_eq!([output(0), output(1)], [true, false]);
    assert_eq!(world[1].seat.controller.now(), ms(5));
    // Only what has to wait makes time lag.
    world.advance(ms(8));
    assert_eq!(world.take_late(), None);
    assert_eq!(world[1].seat.controller.now(), ms(8));
}

#[test]
fn a_host_is_not_accused_of_haste_when_the_machine_lags() {
    for (lags, expected) in [(false, &["answer-early"][..]), (true, &[])] {
        let mut world = world(&["", ""]);
        let connected = Input::Connected {
            port: Port::Ip0,
            peer: "host".to_owned(),
        };
        world.feed(ms(0), 0, connected, Side::Host).unwrap();
        let text = |bytes: &'static [u8]| Input::received(Port::Ip0, bytes);
        world.feed(ms(1), 0, text(b"\x02SU\r\x03"), Side::Host).unwrap();
        let found = Found::default();
        world[0].seat.subscribe(Box::new(found.clone()));
        for robot in 0..2 {
            let due = Together(ms(40), ["output 1 on"].into());
            world[robot].seat.plan(Box::new(due));
            world[robot].edge.is_late = lags;
        }
        // Without the lag 49 ms have passed; with it 60, and the text is handled as if it had come after 39.
        let at = ms(if lags { 61 } else { 50 });
        world.feed(at, 0, text(b"\x02OK\r\x03"), Side::Host).unwrap();
        assert_eq!(world.take_late(), lags.then_some(ms(40)));
        let found = found.0.lock().unwrap();
        let rules: Vec<&str> = found.iter().map(|(_, finding)| finding.rule.id).collect();
        assert_eq!(rules, expected);
    }
}

#[test]
fn a_robot_that_was_reset_goes_on_with_the_others() {
    let mut world = world(&["", ""]);
    world.advance(ms(1_000));
    world[1].seat.controller = controller("");
    world[1].set_time(ms(1_000), Time::ZERO);
    world[1]
        .seat
        .plan(Box::new(Together(ms(3), ["output 2 on"].into())));
    assert_eq!(world[1].deadline(), Some(ms(1_003)));
    world.advance(ms(1_010));
    let now = |robot: usize| world[robot].seat.controller.now();
    assert_eq!([now(0), now(1)], [ms(1_010), ms(10)]);
    // No time is before that of the world.
    world[1].set_time(ms(1_010), ms(5_000));
    assert_eq!(world[1].moment_of(Time::ZERO), Time::ZERO);
}

#[test]
fn while_one_stores_something_every_input_waits_and_is_answered_then() {
    let mut world = world(&["", ""]);
    world[0].edge.has_slow_disk = true;
    let plan = Together(ms(5), ["alarms raise 1-102", "output 5 on"].into());
    world[0].seat.plan(Box::new(plan));
    let changes = Changes::default();
    world[1].seat.subscribe(Box::new(OfRobot(1, changes.clone())));
    world.join(vec![wire(line(0, 5), line(1, 7))]);
    // What is due before an input is stored first.
    let name = "NOFILE".to_owned();
    let select = Input::by_owner(Action::Select { name });
    let refused = world.feed(ms(8), 1, select, Side::Host);
    assert_eq!(refused, Ok(Accepted::Pending));
    let output = Input::by_owner("output 6 on".parse().unwrap());
    let later = world.feed(ms(9), 0, output, Side::Host);
    assert_eq!(later, Ok(Accepted::Pending));
    assert!(world.is_storing() && world.has_waiting_inputs());
    assert_eq!(world.deadline(), Some(ms(5)), "no time passes");
    assert!(!input(&world, 1, 7));
    world[0].edge.is_storing = false;
    let stored = world.feed(ms(20), 0, Input::Persisted(Ok(())), Side::Host);
    assert!(stored.is_err(), "there is no such file");
    assert!(!world.is_storing() && !world.has_waiting_inputs());
    assert!(world[0].seat.controller.signals().output(6));
    assert_eq!(*changes.0.lock().unwrap(), [(1, ms(5), 7, true)]);
}

#[test]
fn a_program_sees_nothing_of_what_else_drives_the_input_of_a_wire() {
    for (words, is_planned) in [
        ("input 7 on", false),
        ("input 7 on", true),
        ("input 7 pulse on 1 s", false),
        ("input 7 release", false),
    ] {
        let mut world = World::new();
        let seat = Seat::new(controller("PROGRAM P\nWAIT DIN(7)\nDOUT(1)\nEND\n"));
        world.add(Time::ZERO, seat, Edge::default(), Span::none());
        act(&mut world, Time::ZERO, 0, "servo on");
        // What it has been set to before the wire is there.
        let before = ["input 7 on", "input 7 force off", "program start"];
        for words in before.iter().skip(if words.ends_with("release") { 0 } else { 2 }) {
            act(&mut world, Time::ZERO, 0, words);
        }
        if is_planned {
            world[0].seat.plan(Box::new(Together(Time::ZERO, [words].into())));
        }
        world.join(vec![wire(outside("lid"), line(0, 7))]);
        match is_planned {
            true => world.advance(Time::ZERO),
            false => act(&mut world, Time::ZERO, 0, words),
        }
        assert!(!input(&world, 0, 7), "{words}");
        assert_eq!(status(&world, 0), ExecutionStatus::Running, "{words}");
    }
}

#[test]
fn the_order_in_which_robots_and_ports_are_polled_does_not_change_a_byte() {
    const COMMANDS: [&[u8]; 4] = [
        b"\x02SU\r\x03",
        b"\x02VR,N\r\x03",
        b"\x02CA\r\x03",
        b"\x02EU\r\x03",
    ];
    let mut first = None;
    for seed in 0..20_u64 {
        let mut world = cell();
        let mut random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1;
        let ports: Vec<(usize, Port)> = (0..2)
            .flat_map(|robot| [Port::Host, Port::Ip0, Port::Ip1, Port::Ip2].map(|port| (robot, port)))
            .collect();
        for &(robot, port) in &ports {
            let peer = "suite".to_owned();
            let _ = world.feed(Time::ZERO, robot, Input::Connected { port, peer }, Side::Host);
        }
        for step in 0..40_u64 {
            let mut order = ports.clone();
            for place in (1..order.len()).rev() {
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                order.swap(place, usize::try_from(random % (place as u64 + 1)).unwrap());
            }
            for (robot, port) in order {
                let bytes = match port {
                    Port::Ip1 | Port::Ip2 => &b"7\r"[..],
                    _ => COMMANDS[usize::try_from(step % 4).unwrap()],
                };
                world
                    .feed(ms(step * 150), robot, Input::received(port, bytes), Side::Host)
                    .unwrap();
            }
            world.advance(ms(step * 150 + 100));
        }
        let of_ports = |robot: usize| {
            let mut of_ports: BTreeMap<Port, Vec<(Time, Vec<u8>)>> = BTreeMap::new();
            for (at, port, bytes) in &world[robot].edge.sent {
                of_ports.entry(*port).or_default().push((*at, bytes.clone()));
            }
            of_ports
        };
        let found = [of_ports(0), of_ports(1)];
        assert!(found[0].contains_key(&Port::Ip1) && found[1].contains_key(&Port::Host));
        let first = first.get_or_insert_with(|| found.clone());
        assert!(*first == found, "seed {seed}: {found:?}");
    }
}

#[test]
fn a_robot_answers_alone_as_it_does_among_others() {
    let exchange = |world: &mut World<Edge>, robot: usize| {
        let peer = "suite".to_owned();
        let connected = Input::Connected {
            port: Port::Ip0,
            peer,
        };
        world.feed(ms(10), robot, connected, Side::Host).unwrap();
        for step in 0..20_u64 {
            let input = Input::received(Port::Ip0, &b"\x02SF\r\x03\x02SU\r\x03"[..]);
            world.feed(ms(100 + step * 70), robot, input, Side::Host).unwrap();
        }
        world.advance(ms(2_000));
        world[robot].edge.sent.clone()
    };
    let alone = exchange(&mut world(&[FEEDER]), 0);
    assert!(alone.len() > 20, "{}", alone.len());
    let among_others = exchange(&mut world(&[PICKER, FEEDER, PICKER]), 1);
    assert_eq!(among_others, alone);
}

#[test]
fn an_outside_line_that_is_set_meanwhile_waits_for_what_was_due_before() {
    let mut world = world(&["", ""]);
    world[0].edge.has_slow_disk = true;
    let alarm = Together(ms(5), ["alarms raise 1-102"].into());
    world[0].seat.plan(Box::new(alarm));
    world[1]
        .seat
        .plan(Box::new(Together(ms(7), ["input 9 on"].into())));
    let changes = Changes::default();
    world[1].seat.subscribe(Box::new(OfRobot(1, changes.clone())));
    world.join(vec![wire(outside("go"), line(1, 8))]);
    world.set_outside(ms(10), "go".to_owned(), true);
    assert!(world.is_storing() && world.has_waiting_inputs());
    assert_eq!(*changes.0.lock().unwrap(), []);
    world[0].edge.is_storing = false;
    let _ = world.feed(ms(20), 0, Input::Persisted(Ok(())), Side::Host);
    let seen = changes.0.lock().unwrap().clone();
    assert_eq!(seen, [(1, ms(7), 9, true), (1, ms(20), 8, true)]);
}
