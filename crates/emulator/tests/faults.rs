//! Faults where the edge has to act: real connections that are reset, closed, or half-open, by the embedding API.

#![expect(clippy::unwrap_used, reason = "helpers of tests, which may fail as tests do")]

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_emulator::embed::{ArmError, Emulator};

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
    let limit = Instant::now() + LONG;
    loop {
        // After the power was off nobody listens for a moment.
        if let Ok(mut host) = TcpStream::connect(robot.address(Port::Ip0).unwrap()) {
            host.set_read_timeout(Some(LONG)).unwrap();
            let asked = host.write_all(SO);
            let mut answer = [0; 5];
            if asked.and_then(|()| host.read_exact(&mut answer)).is_ok() {
                assert_eq!(answer, OK);
                return host;
            }
        }
        assert!(Instant::now() < limit, "the robot does not serve again");
        std::thread::sleep(Duration::from_millis(20));
    }
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
    let robot = Emulator::builder()
        .fault("half-open:command=SO,lasts=700")
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot);
    host.write_all(SO).unwrap();
    let since = Instant::now();
    host.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    let silent = host.read(&mut [0; 8]).map_err(|error| error.kind());
    assert!(
        matches!(silent, Err(ErrorKind::WouldBlock | ErrorKind::TimedOut)),
        "{silent:?}"
    );
    // Still open: it takes what nobody reads.
    host.write_all(SO).unwrap();
    // Nobody else is served as long as the robot believes in it.
    let mut second = dial(&robot);
    assert!(matches!(second.read(&mut [0; 8]), Ok(0) | Err(_)));
    host.set_read_timeout(Some(LONG)).unwrap();
    assert_eq!(rest(&mut host), (Vec::new(), Some(ErrorKind::ConnectionReset)));
    assert!(
        since.elapsed() >= Duration::from_millis(650),
        "{:?}",
        since.elapsed()
    );
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
    host.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    assert!(host.read(&mut [0; 8]).is_err());
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
    let said = robot.wait_for(LONG, |output| match output {
        Output::Event(Event::Fault {
            fired: true, message, ..
        }) => Some(message.clone()),
        _ => None,
    });
    assert_eq!(said.as_deref(), Ok("SO is refused"));
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
