//! Every kind of fault against two hosts: the careful one survives, the careless one does not, and the log and the report
//! give the reason. A kind without a row fails.
//!
//! Which findings are a fault's is in `faults/causes.rs`. The hosts are in `faults/hosts.rs`, the controller they share in `faults/world.rs`.

mod causes;
mod hosts;
mod variation;
mod world;

use hosts::{Careful, Careless, Host, Outcome};
use std::collections::BTreeSet;
use std::time::Duration;
use ts3100_controller::faults::{Fault, FaultAction, KINDS};
use ts3100_controller::{
    Action, Config, Controller, ControllerType, Dialect, Input, PanelAction, Port, Time,
};
use world::World;

/// A cycle of two steps and some seconds.
const CYCLE: &str = "PROGRAM CYCLE\nDELAY 1.0\nDELAY 1.0\nDELAY 1.0\nEND\n";
/// A program that answers each record, and says two things at once on the way.
const TALK: &str = "PROGRAM TALK\nN = 0\nPRINT IP1, \"READY\", CR\nPRINT IP1, \"GO\", CR\nAGAIN:\nINPUT IP1, N\n\
                    PRINT IP1, N, CR\nGOTO AGAIN\nEND\n";

/// What a host has to get done.
type Job = fn(&mut World, &mut dyn Host) -> Outcome<()>;

/// Kind, its specification, the files, the port of the host, and the job.
type Row = (
    &'static str,
    &'static str,
    &'static [(&'static str, &'static str)],
    Port,
    Job,
);

const ROWS: &[Row] = &[
    ("no-reply", "no-reply:command=SO", &[], Port::Ip0, servo),
    ("late-reply", "late-reply:command=SU", &[], Port::Ip0, status),
    ("ng", "ng:command=SU", &[], Port::Ip0, status),
    ("wrong-reply", "wrong-reply:command=SU", &[], Port::Ip0, status),
    ("lost-etx", "lost-etx:command=SU", &[], Port::Ip0, status),
    (
        "flipped-bit",
        "flipped-bit:command=SU,byte=4,bit=0",
        &[],
        Port::Ip0,
        status,
    ),
    (
        "split-bytes",
        "split-bytes:command=SU,size=7",
        &[],
        Port::Ip0,
        status,
    ),
    (
        "merged-texts",
        "merged-texts:channel=IP1",
        &[("TALK", TALK)],
        Port::Ip0,
        greetings,
    ),
    (
        "duplicate-text",
        "duplicate-text:command=SO",
        &[],
        Port::Ip0,
        servo,
    ),
    (
        "reset-mid-text",
        "reset-mid-text:command=SU",
        &[],
        Port::Ip0,
        status,
    ),
    ("half-open", "half-open:command=SU", &[], Port::Ip0, status),
    ("slow-line", "slow-line:command=SU", &[], Port::Ip0, status),
    ("drive-full", "drive-full:free=300", &[], Port::Ip0, store),
    ("power-loss", "power-loss:block=2", &[], Port::Ip0, store),
    (
        "alarm",
        "alarm:command=RN,number=2-046,delay=1500",
        &[("CYCLE", CYCLE)],
        Port::Ip0,
        cycle,
    ),
    (
        "emergency-stop",
        "emergency-stop:command=RN,delay=1500,release=2s",
        &[("CYCLE", CYCLE)],
        Port::Ip0,
        cycle,
    ),
    (
        "servo-failure",
        "servo-failure:command=RN,delay=1500",
        &[("CYCLE", CYCLE)],
        Port::Ip0,
        cycle,
    ),
    (
        "key-turned",
        "key-turned:delay=1500,back=2s",
        &[("CYCLE", CYCLE)],
        Port::Ip0,
        cycle,
    ),
    (
        "parity-error",
        "parity-error:channel=HOST,character=1",
        &[],
        Port::Host,
        status,
    ),
    (
        "lost-record",
        "lost-record:channel=IP1,after=1",
        &[("TALK", TALK)],
        Port::Ip0,
        talk,
    ),
];

/// The servo goes on, and each later command gets its own answer.
fn servo(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    host.command(world, "BR")?;
    host.command(world, "SO")?;
    host.file(world, "SU", "MODE:").map(drop)
}

fn status(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    host.file(world, "SU", "MODE:").map(drop)
}

/// A file of three texts is stored.
fn store(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    let content = format!("PROGRAM BIG\n{}END\n", "DELAY 0.001\n".repeat(50));
    host.download(world, "BIG", &content)?;
    // Whoever goes on without looking finds out here, where it is too late.
    host.file(world, "UL,BIG", &content).map(drop)
}

fn cycle(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    world.put(Input::by_hand(PanelAction::Servo(true)));
    host.cycle(world)
}

fn greetings(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    world.connect(Port::Ip1);
    world.put(Input::by_hand(PanelAction::Start));
    let found = host.records(world, Port::Ip1, 2)?;
    match found.as_slice() {
        [first, second] if first == "READY" && second == "GO" => Ok(()),
        other => Err(format!("{other:?}")),
    }
}

/// Three records, each of which the program answers.
fn talk(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    greetings(world, host)?;
    for record in ["7", "8", "9"] {
        let answer = host.record(world, Port::Ip1, record)?;
        if answer != record {
            return Err(format!("{record} is answered {answer}"));
        }
    }
    Ok(())
}

/// A serial line without pace, so that the careless host has whole texts there too.
fn config() -> Config {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    config
}

fn careful(row: &Row, spec: Option<&str>) -> (World, Outcome<()>) {
    let (_, _, files, port, job) = row;
    let mut world = World::new(config(), files);
    spec.into_iter().for_each(|spec| world.arm(spec));
    let mut host = Careful::new(&mut world, *port);
    let done = job(&mut world, &mut host);
    (world, done)
}

fn careless(row: &Row, spec: Option<&str>) -> (World, Outcome<()>) {
    let (_, _, files, port, job) = row;
    let mut world = World::new(config(), files);
    spec.into_iter().for_each(|spec| world.arm(spec));
    let mut host = Careless::new(&mut world, *port);
    let done = job(&mut world, &mut host);
    (world, done)
}

#[test]
fn every_kind_has_its_row() {
    let rows: BTreeSet<&str> = ROWS.iter().map(|(kind, ..)| *kind).collect();
    let kinds: BTreeSet<&str> = KINDS.iter().map(|kind| kind.name).collect();
    assert_eq!(rows, kinds);
    for (kind, spec, ..) in ROWS {
        assert_eq!(spec.split(':').next(), Some(*kind));
    }
}

// clause: TRN-02 TRN-03
#[test]
fn a_host_that_knows_what_to_do_survives_and_one_that_does_not_fails() {
    for row in ROWS {
        let (kind, spec, ..) = *row;
        let plain = [careful(row, None).1, careless(row, None).1];
        assert_eq!(
            plain,
            [Ok(()), Ok(())],
            "{kind}: without the fault both get it done"
        );
        let (world, done) = careful(row, Some(spec));
        assert_eq!(
            done,
            Ok(()),
            "{kind}: the careful host; the log: {:?}",
            world.peers.fired
        );
        says_why(&world, kind);
        let (world, done) = careless(row, Some(spec));
        assert!(done.is_err(), "{kind}: the careless host gets through");
        says_why(&world, kind);
    }
}

/// The log has one line of the fault, with its words, and the report one firing with its time.
fn says_why(world: &World, kind: &str) {
    let [(1, logged, words)] = world.peers.fired.as_slice() else {
        panic!("{kind}: the log has {:?}", world.peers.fired);
    };
    assert_eq!(*logged, kind);
    assert!(words.len() > 10, "{kind}: {words}");
    let reports = world.reports();
    let [report] = reports.as_slice() else {
        panic!("{kind}: the report has {reports:?}");
    };
    assert_eq!(
        (report.fired, report.at.len(), report.armed),
        (1, 1, false),
        "{kind}"
    );
    assert!(report.summary().contains("fired 1 of "), "{}", report.summary());
    assert_eq!(world.seat.controller.faults().never_fired().count(), 0);
}

#[test]
fn the_same_faults_give_the_same_run() {
    let run = |seed| {
        let mut world = World::new(
            Config {
                fault_seed: seed,
                ..config()
            },
            &[],
        );
        for spec in [
            "flipped-bit:times=0,probability=0.3",
            "split-bytes:times=0,probability=0.3,size=5",
            "late-reply:times=0,probability=0.2,delay=700",
        ] {
            world.arm(spec);
        }
        let mut host = Careful::new(&mut world, Port::Ip0);
        let done: Vec<_> = (0..10).map(|_| host.file(&mut world, "VR", "").is_ok()).collect();
        (world.peers.sent, world.peers.fired, done)
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5).1, run(6).1);
}

#[test]
fn a_fault_that_waits_for_something_else_is_reported_as_never_fired() {
    let mut world = World::field(&[]);
    world.arm("no-reply:command=CA");
    world.arm("no-reply:command=SU,after=3");
    let mut host = Careful::new(&mut world, Port::Ip0);
    host.file(&mut world, "SU", "MODE:").unwrap();
    let lines: Vec<String> = world
        .seat
        .controller
        .faults()
        .never_fired()
        .map(ts3100_controller::faults::FaultReport::summary)
        .collect();
    assert_eq!(
        lines,
        [
            "fault 1 `no-reply:command=CA,lost=reply` never fired: no occasion occurred",
            "fault 2 `no-reply:command=SU,after=3,lost=reply` never fired: skipped 1 occasions (after, probability)",
        ]
    );
    world.pass(Duration::from_secs(1));
    assert!(world.peers.fired.is_empty());
}

#[test]
fn a_key_is_not_turned_to_a_position_that_the_controller_lacks() {
    for (controller, lacks) in [
        (ControllerType::Ts3100, None),
        (ControllerType::Tsl3100, Some("TSL3100")),
        (ControllerType::Tsl3000e, Some("TSL3000E")),
    ] {
        let mut robot = Controller::new(
            Config {
                controller,
                ..Config::new(Dialect::Field)
            },
            Vec::new(),
        )
        .unwrap();
        let mut arm = |to: &str| {
            let fault: Fault = format!("key-turned:to={to}").parse().unwrap();
            let action = Action::Fault(FaultAction::Arm(Box::new(fault)));
            let armed = robot.handle(Time::ZERO, Input::by_owner(action));
            armed.map(drop).map_err(|error| error.to_string())
        };
        assert_eq!(arm("teaching"), Ok(()));
        match (arm("internal"), lacks) {
            (Ok(()), None) => {}
            (Err(error), Some(name)) => {
                let expected = format!("the {name} has no INTERNAL position; give to=teaching or to=ext");
                assert!(error.contains(&expected), "{error}");
            }
            (found, _) => panic!("{controller:?}: {found:?}"),
        }
    }
}
