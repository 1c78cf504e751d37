//! The embedding API: several emulators in one process, each with its own state, actions at the panel, and
//! a power cycle.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::Duration;
use ts3100_controller::findings::rules;
use ts3100_controller::input::{ControlRight, KeySwitch, PanelAction};
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::embed::Emulator;
use ts3100_emulator::embed::StartError;
use ts3100_emulator::watch::WaitError;
use ts3100_tests::host::{Host, LONG, dial};
use ts3100_tests::testing::TempDir;

#[test]
fn several_emulators_in_one_process_know_nothing_of_each_other() {
    let robots: Vec<Emulator> = (0..8).map(|_| Emulator::builder().start().unwrap()).collect();
    dial(&robots[3], Port::Ip0).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    for (index, robot) in robots.iter().enumerate() {
        assert_eq!(
            dial(robot, Port::Ip0).sf()[0],
            u8::from(index == 3),
            "servo of robot {index}"
        );
    }
}

#[test]
fn an_emulator_that_is_dropped_frees_its_ports() {
    let robot = Emulator::builder().start().unwrap();
    let address = robot.address(Port::Ip0).unwrap();
    drop(robot);
    TcpListener::bind(address).unwrap();
}

#[test]
fn errors_at_the_start_are_returned() {
    let error = Emulator::builder().select("ABSENT").start().unwrap_err();
    assert!(
        matches!(error, StartError::Select { ref name, .. } if name == "ABSENT"),
        "{error}"
    );
    assert!(Emulator::builder().option("text.stx", "sometimes").is_err());
}

#[test]
fn the_panel_starts_the_program() {
    let robot = Emulator::builder()
        .file("HELLO", "PROGRAM HELLO\nPRINT IP1, \"HELLO\", CR\nEND\n")
        .select("HELLO")
        .servo_on(true)
        .start()
        .unwrap();
    let mut program = dial(&robot, Port::Ip1);
    // The panel and the connection reach the driver by different ways; the host's answer shows that it has
    // served the connection.
    dial(&robot, Port::Ip0).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::Start).unwrap();
    assert_eq!(program.read_until(b'\r'), b"HELLO\r");
}

#[test]
fn everything_that_can_be_done_at_the_panel_is_done_when_the_call_returns() {
    let robot = Emulator::builder().start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    robot.panel(PanelAction::InputLine { line: 3, on: true }).unwrap();
    host.exchange(b"\x02HI,1 8\r\x03", b"\x02FL,4\r\x1a\x03");
    host.exchange(b"\x02OK\r\x03\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::SafetySwitch(true)).unwrap();
    host.exchange(b"\x02SO\r\x03", b"\x02NG\r\x03");
    for action in [
        PanelAction::SafetySwitch(false),
        PanelAction::EmergencyStop(true),
        PanelAction::EmergencyStop(false),
        PanelAction::AlarmReset,
        PanelAction::Servo(true),
        PanelAction::Start,
        PanelAction::Stop,
        PanelAction::PressFeedHold,
        PanelAction::MachineLock(true),
        PanelAction::Battery(true),
        PanelAction::Keys("12".to_owned()),
        PanelAction::ControlRight(ControlRight::Ether),
        PanelAction::Key(KeySwitch::Teaching),
    ] {
        robot.panel(action).unwrap();
    }
    host.exchange(b"\x02RN\r\x03", b"\x02NG\r\x03");
}

#[test]
fn a_test_waits_for_what_happens_instead_of_sleeping() {
    let robot = Emulator::builder()
        .file("WAITS", "PROGRAM WAITS\nDELAY 0.05\nPRINT \"HELLO\", CR\nEND\n")
        .select("WAITS")
        .servo_on(true)
        .start()
        .unwrap();
    robot.panel(PanelAction::Battery(true)).unwrap();
    robot.panel(PanelAction::Start).unwrap();
    let alarm = robot.wait_for(LONG, |output| match output {
        Output::Event(Event::Alarm { number, .. }) => Some(number.clone()),
        _ => None,
    });
    assert!(alarm.unwrap().contains('-'));
    let shown = robot.wait_for(LONG, |output| match output {
        Output::Pendant(text) => Some(text.clone()),
        _ => None,
    });
    assert!(shown.unwrap().contains("HELLO"));
    let nothing = robot.wait_for(Duration::ZERO, |output| {
        matches!(output, Output::PowerCycled).then_some(())
    });
    assert_eq!(nothing, Err(WaitError::Late(Duration::ZERO)));
}

#[test]
fn two_emulators_do_not_share_a_directory() {
    let directory = TempDir::new("embed");
    let first = Emulator::builder().drive(directory.path()).start().unwrap();
    let error = Emulator::builder().drive(directory.path()).start().unwrap_err();
    assert!(error.to_string().contains("another running ts3100"), "{error}");
    drop(first);
    drop(Emulator::builder().drive(directory.path()).start().unwrap());
}

// clause: PAR-FILE-03
#[test]
fn a_power_cycle_closes_every_link_and_opens_the_same_ports() {
    let robot = Emulator::builder().servo_on(true).start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::PowerCycle).unwrap();
    assert!(matches!(host.read(&mut [0; 8]), Ok(0) | Err(_)));
    assert_eq!(
        dial(&robot, Port::Ip0).sf()[0],
        0,
        "the servo is off after power-on"
    );
}

// clause: ETH-04
#[test]
fn a_client_channel_dials_its_peer() {
    let peer = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = peer.local_addr().unwrap().port();
    let factory = ts3100_proto::parameter::EthernetParameters::factory_file(
        [
            ts3100_proto::parameter::OpenMode::Server,
            ts3100_proto::parameter::OpenMode::Client,
            ts3100_proto::parameter::OpenMode::NotUsed,
            ts3100_proto::parameter::OpenMode::NotUsed,
        ],
        ts3100_proto::parameter::LineEnd::Lf,
    );
    let parameters = String::from_utf8(factory).unwrap();
    let (own, peers) = parameters.split_once("[E06]").unwrap();
    let peers = peers
        .replacen("1001", &port.to_string(), 1)
        .replace("192.168.0.151", "127.0.0.1");
    let robot = Emulator::builder()
        .file("ETHERNET.PAR", format!("{own}[E06]{peers}"))
        .file("HELLO", "PROGRAM HELLO\nPRINT IP1, \"HELLO\", CR\nEND\n")
        .select("HELLO")
        .servo_on(true)
        .start()
        .unwrap();
    assert_eq!(robot.ports().keys().copied().collect::<Vec<_>>(), [Port::Ip0]);
    let (mut stream, _) = peer.accept().unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    // A later connection is served, so the driver knows of this one.
    dial(&robot, Port::Ip0).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::Start).unwrap();
    assert_eq!(stream.read_until(b'\r'), b"HELLO\r");
}

#[test]
fn a_peer_that_does_not_read_blocks_nobody() {
    let robot = Emulator::builder()
        .file("FLOOD", "PROGRAM FLOOD\nAGAIN:\nPRINT IP1, \"0123456789012345678901234567890123456789\", CR\nGOTO AGAIN\nEND\n")
        .select("FLOOD")
        .servo_on(true)
        .start()
        .unwrap();
    let _stalled = dial(&robot, Port::Ip1);
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    for _ in 0..20 {
        host.write_all(b"\x02SU\r\x03").unwrap();
        let status = host.read_until(0x03);
        assert!(status.starts_with(b"\x02FL,MODE:"), "{}", status.escape_ascii());
        host.write_all(b"\x02OK\r\x03").unwrap();
    }
    host.exchange(b"\x02SP\r\x03", b"\x02OK\r\x03");
}

#[test]
fn what_a_host_did_wrong_is_there_while_it_runs() {
    let robot = Emulator::builder().start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02so\r\x03", b"\x02OK\r\x03");
    assert_eq!(robot.findings().count(&rules::LOWER_CASE), 1);
    assert_eq!(robot.coverage().reached, 1);
    host.exchange(b"\x02so\r\x03", b"\x02OK\r\x03");
    assert_eq!(robot.findings().count(&rules::LOWER_CASE), 2);
    assert_eq!(robot.findings().count(&rules::COMMAND_EARLY), 1);
    robot.evidence().clear();
    assert!(robot.findings().is_empty() && robot.coverage().reached == 0);
    let second = dial(&robot, Port::Ip0);
    robot
        .wait_for(LONG, |output| match output {
            Output::Event(Event::Finding(found)) => (found.rule.id == "second-connection").then_some(()),
            _ => None,
        })
        .unwrap();
    assert_eq!(robot.findings().count(&rules::SECOND_CONNECTION), 1);
    drop(second);
}

#[test]
fn the_pace_is_not_judged_where_time_stands_still() {
    let robot = Emulator::builder().time(TimeMode::Stepped).start().unwrap();
    let mut host = dial(&robot, Port::Ip0);
    for _ in 0..3 {
        host.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    }
    let findings = robot.findings();
    assert!(findings.is_empty(), "{findings:?}");
}
