//! Faults where the edge has to act: real connections that are reset, closed, or half-open, by the embedding API.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use ts3100_controller::output::{Event, Output};
use ts3100_controller::port::Port;
use ts3100_emulator::embed::{Emulator, Error};
use ts3100_tests::bench::{self, Bench};
use ts3100_tests::host::{Host, LONG, dial};
use ts3100_tests::testing::eventually;

const SO: &[u8] = b"\x02SO\r\x03";
const OK: &[u8] = b"\x02OK\r\x03";

/// Connects until the robot serves; the robot may hold on to a former connection for a while.
fn served(robot: &Emulator) -> TcpStream {
    eventually("the robot serves again", || {
        // After the power was off nobody listens for a moment.
        let mut host = TcpStream::connect(robot.address(Port::Ip0)?).ok()?;
        host.set_read_timeout(Some(LONG)).unwrap();
        let mut answer = [0; 5];
        host.write_all(SO)
            .and_then(|()| host.read_exact(&mut answer))
            .ok()?;
        assert_eq!(answer, OK);
        Some(host)
    })
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
        let mut host = dial(&robot, Port::Ip0);
        host.write_all(SO).unwrap();
        assert_eq!(host.rest(), (b"\x02OK".to_vec(), end), "{how}");
        served(&robot);
    }
}

#[test]
fn a_half_open_connection_is_silent_and_open_until_the_robot_gives_it_up() {
    let bench = Bench::start(bench::builder().fault("half-open:command=SO,lasts=700").unwrap());
    let mut host = bench.dial(Port::Ip0);
    host.write_all(SO).unwrap();
    applied(&bench.emulator);
    bench.post("/clock/advance", r#"{"seconds":0.699}"#);
    assert!(is_open(&mut host));
    // Still open: it takes what nobody reads.
    host.write_all(SO).unwrap();
    // Nobody else is served as long as the robot believes in it.
    let mut second = bench.dial(Port::Ip0);
    assert!(matches!(second.read(&mut [0; 8]), Ok(0) | Err(_)));
    assert!(is_open(&mut host));
    bench.post("/clock/advance", r#"{"seconds":0.001}"#);
    assert_eq!(host.rest(), (Vec::new(), Some(ErrorKind::ConnectionReset)));
    served(&bench.emulator);
}

#[test]
fn a_host_that_waits_behind_a_half_open_connection_it_has_closed_is_served_next() {
    let robot = Emulator::builder()
        .fault("half-open:command=SO,lasts=400")
        .unwrap()
        .start()
        .unwrap();
    let mut host = dial(&robot, Port::Ip0);
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
    assert!(matches!(robot.arm_fault("no-replay"), Err(Error::Fault(_))));
    robot.arm_fault("ng:command=SO").unwrap();
    robot.arm_fault("ng:command=CA").unwrap();
    host.exchange(SO, b"\x02NG\r\x03");
    assert_eq!(applied(&robot), "SO is refused");
    robot.disarm_fault(2).unwrap();
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
    let mut host = dial(&robot, Port::Ip0);
    host.exchange(b"\x02DL,PICK\r\x03", OK);
    host.write_all(b"\x02FL,PROGRAM OTHER\nEND\n\x1a\x03").unwrap();
    assert!(host.rest().0.is_empty(), "nothing is acknowledged");
    let mut host = served(&robot);
    host.exchange(b"\x02UL,PICK\r\x03", b"\x02FL,PROGRAM PICK\nEND\n\x1a\x03");
}
