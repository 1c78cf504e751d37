//! Findings that faults have caused: a host that does everything right has none of its own under any fault, and a host
//! with a defect keeps its finding under a fault that does not cause it.

use super::hosts::{Careful, Host, Outcome};
use super::world::World;
use super::{CYCLE, ROWS, TALK, careful, config, cycle, servo, status, store, talk};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use ts3100_controller::faults::{CAUSES, Fault, KINDS};
use ts3100_controller::findings::rules;
use ts3100_controller::{Input, PanelAction, Port};

/// Keys of the faults that are tried with each kind: other sites, and other values of its parameters.
const KEYS: &[&str] = &[
    "command=BR",
    "command=SO",
    "command=SU",
    "command=UL",
    "command=UL,block=2",
    "command=DL,block=0",
    "command=DL,block=1",
    "command=DL,block=2",
    "command=DL,block=3",
    "command=RN",
    "command=SP",
    "command=SO,times=3",
    "channel=IP1",
    "channel=IP1,after=2",
    "channel=HOST,after=3",
    "lost=command,command=DL,block=2",
    "lost=command,command=SU",
    "way=in,channel=IP0,after=4,byte=0",
    "way=in,channel=IP0,after=6,byte=2,bit=3",
    "way=in,channel=IP1,byte=0,bit=6",
    "way=in,channel=IP1,byte=1,bit=1",
    "command=DL,block=3,delay=12s",
    "command=SU,delay=1500",
    "command=SU,how=close",
    "command=UL,block=2,lasts=15s",
    "command=SU,pause=700",
    "command=RN,delay=1500",
    "command=RN,delay=1500,release=2s",
    "command=RN,delay=1500,back=2s",
    "command=RN,delay=1500,number=4-104",
];

/// Everything the hosts of this suite do on one port.
fn work(world: &mut World, host: &mut dyn Host) -> Outcome<()> {
    servo(world, host)?;
    status(world, host)?;
    store(world, host)?;
    cycle(world, host)?;
    store(world, host)
}

/// The rules that hosts have broken.
fn broken(world: &World) -> BTreeSet<&'static str> {
    let broken = world.peers.findings.broken().map(|(rule, _)| rule.id);
    // A host that recovers by RS,ERR has chosen an extension.
    broken
        .filter(|rule| *rule != rules::EXTENSION_COMMAND.id)
        .collect()
}

/// The rules whose findings faults have caused.
fn caused(world: &World) -> BTreeSet<&'static str> {
    world.peers.findings.caused().map(|(rule, _)| rule.id).collect()
}

// clause: T27
#[test]
fn a_careful_host_has_no_finding_of_its_own_under_any_kind_of_fault() {
    for row in ROWS {
        let (plain, _) = careful(row, None);
        let (world, _) = careful(row, Some(row.1));
        assert_eq!(broken(&world), broken(&plain), "{}", row.1);
    }
}

// clause: T27
#[test]
fn a_careful_host_has_no_finding_of_its_own_wherever_a_fault_fires() {
    let run = |spec: Option<&str>, port: Port, on_channel: bool| {
        let files: &[(&str, &str)] = match on_channel {
            true => &[("TALK", TALK)],
            false => &[("CYCLE", CYCLE)],
        };
        let mut world = World::new(config(), files);
        spec.into_iter().for_each(|spec| world.arm(spec));
        let mut host = Careful::new(&mut world, port);
        // The host may give up; what it has done until then was right.
        let _done = match on_channel {
            true => talk(&mut world, &mut host),
            false => work(&mut world, &mut host),
        };
        world.hang_up(Port::Ip1);
        world.pass(Duration::from_secs(20));
        world
    };
    let hosts = [(Port::Ip0, false), (Port::Ip0, true), (Port::Host, false)];
    let plain: BTreeMap<_, _> = hosts
        .map(|host| (host, broken(&run(None, host.0, host.1))))
        .into();
    let mut by_faults = BTreeSet::new();
    let mut fired = BTreeSet::new();
    let mut failures = Vec::new();
    for kind in KINDS {
        for keys in KEYS {
            let spec = format!("{}:{keys}", kind.name);
            // Not every kind has every key.
            if spec.parse::<Fault>().is_err() {
                continue;
            }
            let port = match keys.contains("HOST") {
                true => Port::Host,
                false => Port::Ip0,
            };
            let on_channel = keys.contains("IP1");
            let world = run(Some(&spec), port, on_channel);
            if !world.peers.fired.is_empty() {
                fired.insert(kind.name);
            }
            by_faults.extend(caused(&world));
            let own: Vec<_> = broken(&world)
                .difference(&plain[&(port, on_channel)])
                .copied()
                .collect();
            if !own.is_empty() {
                failures.push(format!("{spec}: {own:?}; caused {:?}", caused(&world)));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert_eq!(fired.len(), KINDS.len(), "{fired:?}");
    // The sweep means something: these would be the host's otherwise.
    for rule in [
        &rules::COMMAND_IN_EXCHANGE,
        &rules::LEFT_IN_EXCHANGE,
        &rules::FILE_TOO_LARGE,
        &rules::REFUSED_BY_STATE,
        &rules::MODE_FORBIDS,
        &rules::INPUT_NOT_A_NUMBER,
    ] {
        assert!(by_faults.contains(rule.id), "{}: {by_faults:?}", rule.id);
    }
}

/// A host that takes a status and does not answer it, and one that sends a command into an open exchange.
fn defects(world: &mut World, port: Port) {
    let say = |world: &mut World, text: &[u8]| {
        world.pass(Duration::from_millis(60));
        world.connect(port);
        let _ = world.write(port, text);
    };
    say(world, b"\x02SU\r\x03");
    world.pass(Duration::from_secs(11));
    say(world, b"\x02SU\r\x03");
    say(world, b"\x02VR\r\x03");
    say(world, b"\x02OK\r\x03");
}

// clause: T27
#[test]
fn a_host_with_a_defect_keeps_its_finding_after_any_kind_of_fault() {
    for row in ROWS {
        let (kind, spec, .., port, _) = *row;
        let (mut world, done) = careful(row, Some(spec));
        assert_eq!(done, Ok(()), "{kind}");
        let mut host = Careful::new(&mut world, port);
        for _ in 0..2 {
            host.file(&mut world, "SU", "MODE:").unwrap();
        }
        let before = broken(&world);
        assert!(!before.contains("answer-missing"), "{kind}");
        defects(&mut world, port);
        for rule in [&rules::ANSWER_MISSING, &rules::COMMAND_IN_EXCHANGE] {
            assert_eq!(world.peers.findings.count(rule), 1, "{kind}: {}", rule.id);
        }
    }
}

// clause: T27
#[test]
fn a_fault_in_the_same_exchange_excuses_only_what_it_causes() {
    for (spec, own) in [
        // The text arrives whole and in time, so its OK is due.
        ("split-bytes:command=SU,size=10,pause=30", true),
        ("split-bytes:command=SU,size=1,pause=50", false),
        ("late-reply:command=SU,delay=499", true),
        ("late-reply:command=SU,delay=500", false),
        ("merged-texts:command=SU,hold=499", true),
        ("merged-texts:command=SU,hold=500", false),
        ("slow-line:command=SU,speed=115200", true),
        ("slow-line:command=SU,speed=50", false),
        ("duplicate-text:command=SU", true),
        ("lost-etx:command=SU", false),
        ("no-reply:command=SU", false),
        ("wrong-reply:command=SU", false),
        ("flipped-bit:command=SU", false),
        // Refused without effect: there is no exchange, and the second request has one.
        ("ng:command=SU", true),
        ("alarm:command=SU", true),
        ("key-turned:command=SU,delay=0", true),
        // The effect is over with the command.
        ("no-reply:command=BR", true),
        ("late-reply:command=BR,delay=40", true),
        // It comes when the host has asked for something else already.
        ("late-reply:command=BR,delay=100", false),
    ] {
        let mut world = World::new(config(), &[]);
        world.arm(spec);
        world.connect(Port::Ip0);
        for text in [b"\x02BR\r\x03", b"\x02SU\r\x03"] {
            world.write(Port::Ip0, text).unwrap();
            world.pass(Duration::from_millis(60));
        }
        if spec.starts_with("ng") {
            world.write(Port::Ip0, b"\x02SU\r\x03").unwrap();
        }
        world.pass(Duration::from_secs(30));
        let found = &world.peers.findings;
        assert_eq!(found.count(&rules::ANSWER_MISSING) == 1, own, "{spec}");
        assert_eq!(caused(&world).contains("answer-missing"), !own, "{spec}");
    }
}

// clause: T27
#[test]
fn what_a_host_has_sent_behind_a_stalled_connection_is_no_mistake() {
    let mut world = World::new(config(), &[]);
    let ask_and_leave = |world: &mut World| {
        world.connect(Port::Ip0);
        world.write(Port::Ip0, b"\x02SU\r\x03").unwrap();
        world.hang_up(Port::Ip0);
    };
    world.arm("half-open:command=SU,lasts=5000");
    world.connect(Port::Ip0);
    world.write(Port::Ip0, b"\x02SU\r\x03").unwrap();
    world.pass(Duration::from_millis(5_001));
    // They connected, asked, and gave up, all while nothing was read.
    ask_and_leave(&mut world);
    ask_and_leave(&mut world);
    assert_eq!(world.peers.findings.caused().count(), 1);
    assert!(caused(&world).contains("left-in-exchange"));
    assert_eq!(broken(&world), BTreeSet::new());
    // Whoever comes later finds a robot that answers.
    world.pass(Duration::from_secs(1));
    ask_and_leave(&mut world);
    ask_and_leave(&mut world);
    assert!(broken(&world).contains("left-in-exchange"));
}

// clause: T27
#[test]
fn a_text_that_lost_its_stx_is_answered_without_one_and_the_host_cannot_read_that() {
    let mut world = World::new(config(), &[]);
    world.connect(Port::Ip0);
    world.arm("flipped-bit:way=in,byte=0,bit=1");
    world.write(Port::Ip0, b"\x02SU\r\x03").unwrap();
    world.pass(Duration::from_secs(11));
    assert!(caused(&world).contains("answer-missing"));
    assert_eq!(broken(&world), BTreeSet::new());
    // The next one is whole, and its OK is due.
    world.write(Port::Ip0, b"\x02SU\r\x03").unwrap();
    world.pass(Duration::from_secs(11));
    assert!(broken(&world).contains("answer-missing"));
}

// clause: T27
#[test]
fn a_program_that_starts_is_in_step_with_its_peer_again() {
    for is_started_again in [false, true] {
        let mut world = World::new(config(), &[("TALK", TALK)]);
        world.arm("lost-record:channel=IP1");
        world.connect(Port::Ip1);
        world.put(Input::by_hand(PanelAction::Start));
        world.write(Port::Ip1, b"7\r").unwrap();
        world.pass(Duration::from_secs(1));
        if is_started_again {
            for action in [PanelAction::Stop, PanelAction::ProgramReset, PanelAction::Start] {
                world.put(Input::by_hand(action));
                world.pass(Duration::from_secs(1));
            }
        }
        world.write(Port::Ip1, b"8").unwrap();
        world.hang_up(Port::Ip1);
        assert_eq!(broken(&world).contains("half-value"), is_started_again);
        assert_eq!(caused(&world).contains("half-value"), !is_started_again);
    }
}

// clause: T27
#[test]
fn a_caused_finding_is_a_note_and_names_its_fault() {
    let mut world = World::new(config(), &[]);
    world.arm("ng:command=CA");
    world.arm("reset-mid-text:command=SU");
    let mut host = Careful::new(&mut world, Port::Ip0);
    host.file(&mut world, "SU", "MODE:").unwrap();
    let found: Vec<_> = world.peers.findings.caused().collect();
    let [(rule, tally)] = found.as_slice() else {
        panic!("{found:?}");
    };
    assert_eq!((rule.id, tally.count), ("left-in-exchange", 1));
    let first = &tally.first[0];
    assert_eq!(first.severity().as_str(), "note");
    assert_eq!(first.caused_by.unwrap().to_string(), "fault 2 (reset-mid-text)");
}

// clause: T27
#[test]
fn legal_variation_excuses_nothing() {
    let mut config = config();
    config.vary = Some(3);
    let mut world = World::new(config, &[]);
    world.connect(Port::Ip0);
    defects(&mut world, Port::Ip0);
    assert_eq!(caused(&world), BTreeSet::new());
    assert!(broken(&world).contains("answer-missing"));
}

#[test]
fn every_row_of_the_table_names_kinds_that_exist() {
    for row in CAUSES {
        for name in row.kinds {
            assert!(KINDS.iter().any(|kind| kind.name == *name), "{name}");
        }
    }
}
