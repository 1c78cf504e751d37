//! Legal variation (docs/explanation/variation.md): the careful host gets its work done under every seed, the careless one does not,
//! and a seed is a run that repeats byte for byte.
//!
//! The hosts are in `hosts.rs`.

use super::hosts::{Careful, Careless, Host};
use super::world::World;
use super::{TALK, greetings, servo, status, store, talk};
use std::collections::BTreeSet;
use std::time::Duration;
use ts3100_controller::{Config, Dialect, Input, PanelAction, Port};
use ts3100_proto::status::ca::decode_directory;

const SEEDS: std::ops::Range<u64> = 0..20;

fn varied(seed: Option<u64>) -> World {
    let config = Config {
        vary: seed,
        ..Config::new(Dialect::Field)
    };
    World::new(config, &[("TALK", TALK)])
}

// clause: FRM-05 ETH-02 FL-03 DIR-04
#[test]
fn a_careful_host_does_not_lean_on_luck() {
    for seed in SEEDS {
        let mut world = varied(Some(seed));
        let mut host = Careful::new(&mut world, Port::Ip0);
        for job in [servo, status, store, talk] {
            assert_eq!(job(&mut world, &mut host), Ok(()), "seed {seed}");
        }
    }
}

#[test]
fn a_careless_host_does() {
    let lucky = |seed| {
        let mut world = varied(seed);
        let mut host = Careless::new(&mut world, Port::Ip0);
        [servo, status, store, greetings]
            .iter()
            .all(|job| job(&mut world, &mut host).is_ok())
    };
    assert!(lucky(None));
    assert_eq!(SEEDS.filter(|seed| lucky(Some(*seed))).count(), 0);
}

#[test]
fn a_seed_is_a_run_and_another_seed_another_one() {
    let run = |seed| {
        let mut world = varied(seed);
        let mut host = Careful::new(&mut world, Port::Ip0);
        store(&mut world, &mut host).unwrap();
        host.file(&mut world, "CA", "").unwrap();
        world.peers.sent
    };
    assert_eq!(run(Some(7)), run(Some(7)));
    assert_ne!(run(Some(7)), run(Some(8)));
    assert_ne!(run(Some(7)), run(None));
}

// clause: DIR-02 DIR-04
#[test]
fn directories_keep_their_files_in_another_order_and_with_other_blanks() {
    let (mut orders, mut blanks) = (BTreeSet::new(), BTreeSet::new());
    for seed in SEEDS {
        let mut config = Config {
            vary: Some(seed),
            ..Config::new(Dialect::Field)
        };
        let mut library = World::new(config.clone(), &[("TALK", TALK)]);
        let mut host = Careful::new(&mut library, Port::Ip0);
        let content = host.file(&mut library, "CA", "").unwrap();
        assert!(
            !content.windows(2).any(|pair| pair == b"  "),
            "the vendor's library reads one"
        );
        config.options.extensions = false;
        let mut world = World::new(config, &[("TALK", TALK)]);
        let mut host = Careful::new(&mut world, Port::Ip0);
        let content = host.file(&mut world, "CA", "").unwrap();
        let names: Vec<String> = decode_directory(&content)
            .unwrap()
            .into_iter()
            .map(|entry| entry.name)
            .collect();
        let sorted: BTreeSet<&str> = names.iter().map(String::as_str).collect();
        assert_eq!(sorted, BTreeSet::from(["ETHERNET.PAR", "TALK", "USER.PAR"]));
        orders.insert(names);
        blanks.insert(content.iter().filter(|byte| **byte == b' ').count() / 3);
    }
    assert!(orders.len() > 3, "{orders:?}");
    assert_eq!(blanks, BTreeSet::from([1, 2, 3]));
}

// clause: EU-06
#[test]
fn the_history_is_in_either_order() {
    let mut orders = BTreeSet::new();
    for seed in SEEDS {
        let mut world = varied(Some(seed));
        world.put(Input::by_hand(PanelAction::EmergencyStop(true)));
        world.pass(Duration::from_secs(5));
        world.put(Input::by_hand(PanelAction::SafetySwitch(true)));
        let mut host = Careful::new(&mut world, Port::Ip0);
        orders.insert(host.file(&mut world, "EU", "2").unwrap());
    }
    assert_eq!(orders.len(), 2);
}

// clause: CMD-SP-05 CMD-SP-07
#[test]
fn an_unsolicited_stop_comes_at_another_time_and_not_more_than_half_a_second_later() {
    let mut times = BTreeSet::new();
    for seed in SEEDS {
        let mut world = varied(Some(seed));
        world.connect(Port::Ip0);
        world.connect(Port::Ip1);
        world.put(Input::by_hand(PanelAction::Start));
        world.pass(Duration::from_secs(1));
        let stopped = world.now;
        world.put(Input::by_hand(PanelAction::EmergencyStop(true)));
        world.pass(Duration::from_secs(2));
        let sent = world.peers.sent.iter().find(|(_, port, _)| *port == Port::Ip0);
        let (at, ..) = sent.unwrap_or_else(|| panic!("seed {seed}: nothing was sent"));
        assert!(at.since(stopped) <= Duration::from_millis(500), "seed {seed}");
        times.insert(at.as_micros());
    }
    assert!(times.len() > 10, "{times:?}");
}

// clause: FL-02 FL-03
#[test]
fn texts_of_long_files_are_cut_elsewhere() {
    let content = "REMARK 0123456789\n".repeat(60);
    let mut texts = BTreeSet::new();
    for seed in SEEDS {
        let config = Config {
            vary: Some(seed),
            ..Config::new(Dialect::Field)
        };
        let mut world = World::new(config, &[]);
        world
            .seat
            .controller
            .put_file("LONG", content.as_bytes())
            .unwrap();
        let mut host = Careful::new(&mut world, Port::Ip0);
        assert_eq!(host.file(&mut world, "UL,LONG", "").unwrap(), content.as_bytes());
        let bytes: Vec<u8> = world
            .peers
            .sent
            .iter()
            .flat_map(|(_, _, bytes)| bytes.clone())
            .collect();
        let lengths: Vec<usize> = bytes.split(|byte| *byte == 3).map(<[u8]>::len).collect();
        assert!(lengths.iter().all(|length| *length <= 254), "{lengths:?}");
        texts.insert(lengths);
    }
    assert!(texts.len() > 15);
}
