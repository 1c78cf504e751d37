//! Faults where the edge has to act: real connections that are reset, closed, or half-open, by the embedding API.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_emulator::client::Client;
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::control::ControlSettings;
use ts3100_emulator::embed::{ArmError, Builder, Emulator};
use ts3100_tests::testing::eventually;

const LONG: Duration = Duration::from_secs(30);
const SO: &[u8] = b"\x02SO\r\x03";
const OK: &[u8] = b"\x02OK\r\x03";

fn dial(robot: &Emulator) -> TcpStream {
    let stream = TcpStream::connect(robot.address(Port::Ip0).unwrap()).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    stream
}

/// What comes until the connection ends, and how it ends: `None` for an orderly end.
fn rest(stream: &mut TcpStream) -> (Vec<u8>, Option<ErrorKind>) {
    let mut found = Vec::new();
    let mut buffer = [0; 64];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return (found, None),
            Ok(count) => found.extend_from_slice(&buffer[..count]),
            Err(error) => return (found, Some(error.kind())),
        }
    }
}

/// Connects until the robot serves; the robot may hold on to a former connection for a while.
fn served(robot: &Emulator) -> TcpStream {
    eventually("the robot serves again", || {
        // After the power was off nobody listens for a moment.
        let mut host = TcpStream::connect(robot.address(Port::Ip0).unwrap()).ok()?;
        host.set_read_timeout(Some(LONG)).unwrap();
        let mut answer = [0; 5];
        host.write_all(SO)
            .and_then(|()| host.read_exact(&mut answer))
            .ok()?;
        assert_eq!(answer, OK);
        Some(host)
    })
}

/// With time that only the test moves.
fn stepped() -> Builder {
    Emulator::builder()
        .control(ControlSettings::free())
        .time(TimeMode::Stepped)
}

fn advance(robot: &Emulator, seconds: f64) {
    let client = Client::new(&format!("http://{}", robot.control().unwrap()), None).unwrap();
    let body = format!("{{\"seconds\":{seconds}}}");
    let (status, answer) = client.call("POST", "/clock/advance", Some(&body)).unwrap();
    assert_eq!(status, 200, "{answer}");
}

/// Waits until a fault was applied.
fn applied(robot: &Emulator) -> String {
    let fired = |output: &Output| match output {
        Output::Event(Event::Fault {
            fired: true, message, ..
        }) => Some(message.clone()),
        _ => None,
    };
    robot.wait_for(LONG, fired).unwrap()
}

/// Whether nothing has come and the connection is open, without waiting for either.
fn is_open(host: &mut TcpStream) -> bool {
    host.set_nonblocking(true).unwrap();
    let kind = host.read(&mut [0; 8]).map_err(|error| error.kind());
    host.set_nonblocking(false).unwrap();
    kind == Err(ErrorKind::WouldBlock)
}

#[test]
fn a_connection_is_reset_or_closed_in_the_middle_of_a_text() {
    for (how, end) in [("reset", Some(ErrorKind::ConnectionReset)), ("close", None)] {
        let robot = Emulator::builder()
            .fault(&format!("reset-mid-text:bytes=3,how={how}"))
            .unwrap()
            .start()
            .unwrap();
        let mut host = dial(&robot);
        host.write_all(SO).unwrap();
        assert_eq!(rest(&mut host), (b"\x02OK".to_vec(), end), "{how}");
        served(&robot);
    }
}

#[test]
fn a_half_open_connection_is_silent_and_open_until_the_robot_gives_it_up() {
    let robot = stepped()
        .fault("half-open:command=SO,lasts=700")
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot);
    host.write_all(SO).unwrap();
    applied(&robot);
    advance(&robot, 0.699);
    assert!(is_open(&mut host));
    // Still open: it takes what nobody reads.
    host.write_all(SO).unwrap();
    // Nobody else is served as long as the robot believes in it.
    let mut second = dial(&robot);
    assert!(matches!(second.read(&mut [0; 8]), Ok(0) | Err(_)));
    assert!(is_open(&mut host));
    advance(&robot, 0.001);
    assert_eq!(rest(&mut host), (Vec::new(), Some(ErrorKind::ConnectionReset)));
    served(&robot);
}

#[test]
fn a_host_that_waits_behind_a_half_open_connection_it_has_closed_is_served_next() {
    let robot = Emulator::builder()
        .fault("half-open:command=SO,lasts=400")
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot);
    host.write_all(SO).unwrap();
    applied(&robot);
    assert!(is_open(&mut host));
    drop(host);
    served(&robot);
}

#[test]
fn faults_are_armed_reported_and_disarmed_while_it_runs() {
    let robot = Emulator::builder().fault_seed(3).start().unwrap();
    let mut host = served(&robot);
    assert!(matches!(robot.arm("no-replay"), Err(ArmError::Fault(_))));
    robot.arm("ng:command=SO").unwrap();
    robot.arm("ng:command=CA").unwrap();
    host.write_all(SO).unwrap();
    let mut answer = [0; 5];
    host.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"\x02NG\r\x03");
    assert_eq!(applied(&robot), "SO is refused");
    robot.disarm(2).unwrap();
    let reports = robot.faults().unwrap();
    let seen: Vec<_> = reports
        .iter()
        .map(|report| (report.fired, report.armed))
        .collect();
    assert_eq!(seen, [(1, false), (0, false)]);
}

#[test]
fn the_power_goes_during_a_download_and_the_old_file_is_there() {
    let robot = Emulator::builder()
        .file("PICK", "PROGRAM PICK\nEND\n")
        .fault("power-loss")
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot);
    host.write_all(b"\x02DL,PICK\r\x03").unwrap();
    let mut answer = [0; 5];
    host.read_exact(&mut answer).unwrap();
    host.write_all(b"\x02FL,PROGRAM OTHER\nEND\n\x1a\x03").unwrap();
    assert!(rest(&mut host).0.is_empty(), "nothing is acknowledged");
    let mut host = served(&robot);
    host.write_all(b"\x02UL,PICK\r\x03").unwrap();
    let mut file = [0; 23];
    host.read_exact(&mut file).unwrap();
    assert_eq!(&file, b"\x02FL,PROGRAM PICK\nEND\n\x1a\x03");
}
