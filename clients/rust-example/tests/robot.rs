//! The example of `docs/how-to/rust.md`, which is generated from this file. It uses `ts3100_emulator` alone, as a test
//! of a user does.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use ts3100_emulator::embed::{Emulator, Event, Port, TimeMode, rules};

/// Waits for input 1, works for two seconds, and turns output 5 on.
const PICK: &str = "PROGRAM PICK\nWAIT DIN(1)\nDELAY 2\nDOUT(5)\nEND\n";

/// Your host program: here it starts the selected program and returns the answer.
fn start_robot(address: std::net::SocketAddr) -> std::io::Result<Vec<u8>> {
    let mut host = TcpStream::connect(address)?;
    host.write_all(b"\x02RN\r\x03")?;
    let mut answer = [0; 64];
    let length = host.read(&mut answer)?;
    Ok(answer[..length].to_vec())
}

#[test]
fn the_robot_places_a_part() -> Result<(), Box<dyn std::error::Error>> {
    let robot = Emulator::builder()
        .file("PICK", PICK)
        .select("PICK")
        .servo_on(true)
        .time(TimeMode::Stepped)
        .start()?;
    let address = robot.address(Port::Ip0).ok_or("IP0 is closed")?;

    assert_eq!(start_robot(address)?, b"\x02OK\r\x03");
    robot.set_input(1, true)?;
    assert!(robot.advance_until("output 5 on", Duration::from_secs(10))?);
    assert!(robot.now()? >= Duration::from_secs(2));
    assert!(robot.findings().is_empty(), "{:?}", robot.findings());
    Ok(())
}

#[test]
fn the_emergency_stop_refuses_a_start() -> Result<(), Box<dyn std::error::Error>> {
    let robot = Emulator::builder()
        .file("PICK", PICK)
        .select("PICK")
        .servo_on(true)
        .start()?;
    let address = robot.address(Port::Ip0).ok_or("IP0 is closed")?;

    robot.set_emergency_stop(true)?;
    assert_eq!(start_robot(address)?, b"\x02NG\r\x03");
    let refused = robot.set_servo(true).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "cannot turn the servo on: the emergency stop is pressed"
    );
    Ok(())
}

#[test]
fn a_mistake_of_the_host_is_explained() -> Result<(), Box<dyn std::error::Error>> {
    let robot = Emulator::builder().start()?;
    let mut host = TcpStream::connect(robot.address(Port::Ip0).ok_or("IP0 is closed")?)?;
    host.write_all(b"\x02su\r\x03")?;
    let mut answer = [0; 64];
    assert!(host.read(&mut answer)? > 0, "no answer");

    let findings = robot.findings();
    assert_eq!(findings.count(&rules::LOWER_CASE), 1);
    let (rule, _) = findings.broken().next().ok_or("no finding")?;
    assert!(
        rule.remedy.starts_with("Send command letters in upper case"),
        "{}",
        rule.remedy
    );
    Ok(())
}

#[test]
fn a_host_survives_a_refusal() -> Result<(), Box<dyn std::error::Error>> {
    let robot = Emulator::builder()
        .file("PICK", PICK)
        .select("PICK")
        .servo_on(true)
        .fault("ng:command=RN")?
        .start()?;
    let address = robot.address(Port::Ip0).ok_or("IP0 is closed")?;

    assert_eq!(start_robot(address)?, b"\x02NG\r\x03", "the fault");
    assert_eq!(start_robot(address)?, b"\x02OK\r\x03", "once");
    assert_eq!(robot.faults()?[0].fired, 1);
    let fired = |event: &Event| matches!(event, Event::Fault { fired: true, .. });
    assert_eq!(robot.events().iter().filter(|event| fired(event)).count(), 1);
    Ok(())
}
