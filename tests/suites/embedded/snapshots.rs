//! Snapshots of a running emulator: kept under names, put back between two tests while the hosts stay connected,
//! written to files and begun with.

use std::io::{Read, Write};
use std::net::TcpStream;
use ts3100_controller::port::Port;
use ts3100_controller::{Event, Output, PanelAction};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::embed::Emulator;
use ts3100_proto::status::ExecutionStatus;
use ts3100_tests::host::{Host, LONG, dial};
use ts3100_tests::testing::TempDir;

const PROGRAM: &str = "PROGRAM PICK\nINPUT IP1, N\nPRINT IP1, N + 1, CR\nDELAY 3600\nEND\n";

/// Asks and acknowledges; a stop that the host did not ask for is told in between.
fn ask(host: &mut TcpStream, command: &str) -> String {
    let mut answer = host.command(command);
    while answer == "SP" {
        answer = host.answer();
    }
    answer
}

fn robot() -> ts3100_emulator::embed::Builder {
    Emulator::builder()
        .time(TimeMode::Auto)
        .file("PICK", PROGRAM)
        .select("PICK")
        .servo_on(true)
}

#[test]
fn a_state_is_put_back_while_the_hosts_stay() {
    let robot = robot().start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    let before = ask(&mut host, "SU");
    robot.take_snapshot("ready").unwrap();
    for _ in 0..3 {
        assert_eq!(ask(&mut host, "EC,OVRD 7"), "OK");
        assert_eq!(ask(&mut host, "RS,SEL"), "OK");
        robot.panel(PanelAction::EmergencyStop(true)).unwrap();
        let changed = ask(&mut host, "SU");
        assert!(
            changed.contains("OVRD:7%") && !changed.contains("PICK"),
            "{changed}"
        );
        robot.restore_snapshot("ready").unwrap();
        assert_eq!(
            ask(&mut host, "SU"),
            before,
            "the same connection, the state of before"
        );
        assert_eq!(ask(&mut host, "DO,DOUT(5)"), "OK", "servo power is back");
    }
    let error = robot.restore_snapshot("steady").unwrap_err().to_string();
    assert_eq!(error, "snapshot: expected one of ready, found `steady`");
    let error = robot.take_snapshot("a b").unwrap_err().to_string();
    assert!(error.contains("found `a b`"), "{error}");
}

#[test]
fn a_program_goes_on_from_its_input_with_the_peer_that_is_there() {
    let robot = robot().start().unwrap();
    let mut peer = dial(&robot, Port::Ip1);
    // A later connection is served, so the driver knows of the peer.
    let mut host = dial(&robot, Port::Ip0);
    assert_eq!(ask(&mut host, "RN"), "OK");
    robot.take_snapshot("waiting").unwrap();
    for number in [4, 41] {
        peer.write_all(format!("{number}\r").as_bytes()).unwrap();
        assert_eq!(
            peer.read_until(b'\r').trim_ascii_start(),
            format!("{}\r", number + 1).as_bytes()
        );
        let ended = |output: &Output| match output {
            Output::Event(Event::Status {
                status: ExecutionStatus::Reset,
                ..
            }) => Some(()),
            _ => None,
        };
        robot.wait_for(LONG, ended).unwrap();
        robot.restore_snapshot("waiting").unwrap();
        assert!(ask(&mut host, "SU").contains("STATUS:running"));
    }
    // Each run has taken an hour of virtual time, and each time the clock was set back.
    robot.panel(PanelAction::EmergencyStop(true)).unwrap();
    let history = ask(&mut host, "EU");
    assert!(history.contains("008-014 14-02-06 00:00"), "{history}");
}

#[test]
fn what_a_fault_made_half_open_does_not_outlast_the_state_it_came_with() {
    let robot = robot().start().unwrap();
    robot.take_snapshot("ready").unwrap();
    robot.arm_fault("half-open:command=SU,lasts=600000").unwrap();
    let mut host = dial(&robot, Port::Ip0);
    host.write_all(b"\x02SU\r\x03").unwrap();
    let applied = |output: &Output| match output {
        Output::Event(Event::Fault { fired: true, .. }) => Some(()),
        _ => None,
    };
    robot.wait_for(LONG, applied).unwrap();
    robot.restore_snapshot("ready").unwrap();
    assert!(host.read(&mut [0]).is_err(), "the connection is reset");
    assert!(robot.faults().unwrap().is_empty(), "armed behind the snapshot");
    assert!(ask(&mut dial(&robot, Port::Ip0), "SU").contains("PICK"));
}

#[test]
fn the_backing_directory_follows_and_a_file_begins_another_emulator() {
    let folder = TempDir::new("drive");
    let (drive, file) = (folder.at("drive"), folder.at("state.json"));
    std::fs::create_dir_all(&drive).unwrap();
    let first = robot().drive(&drive).start().unwrap();
    let mut host = dial(&first, Port::Ip0);
    assert_eq!(ask(&mut host, "EC,OVRD 33"), "OK");
    first.write_snapshot(&file).unwrap();
    assert_eq!(ask(&mut host, "RS,SEL"), "OK");
    assert_eq!(ask(&mut host, "ER,PICK"), "OK");
    assert_eq!(ask(&mut host, "DL,OTHER"), "OK");
    host.write_all(b"\x02FL,PROGRAM X\nEND\n\x1a\x03").unwrap();
    assert_eq!(host.answer(), "OK");
    let names = || {
        let mut names: Vec<String> = std::fs::read_dir(&drive)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| !name.starts_with('.'))
            .collect();
        names.sort();
        names
    };
    assert_eq!(names(), ["ETHERNET.PAR", "OTHER", "USER.PAR"]);
    first.load_snapshot(&file).unwrap();
    assert_eq!(names(), ["ETHERNET.PAR", "PICK", "USER.PAR"]);
    let state = ask(&mut host, "SU");
    assert!(
        state.contains("FILE:PICK") && state.contains("OVRD:33%"),
        "{state}"
    );
    drop(first);

    let second = Emulator::builder()
        .restore(&file)
        .time(TimeMode::Auto)
        .start()
        .unwrap();
    let mut host = dial(&second, Port::Ip0);
    assert_eq!(ask(&mut host, "SU"), state);
    assert_eq!(ask(&mut host, "DO,DOUT(5)"), "OK", "servo power too");
}
