//! The serial lines as a host meets them: pseudo terminals, RFC 2217, bare TCP, a real port. No test waits for time to
//! pass: each waits for bytes, or for the controller to have put something out.

use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serialport::{SerialPort, TTYPort};
use std::fs::File;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::Duration;
use ts3100_controller::{Event, Output, PanelAction, Port};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::embed::{Builder, Emulator};
use ts3100_emulator::serial::SerialEndpoint;
use ts3100_emulator::transcript::{RecordKind, Recording};
use ts3100_tests::host::{Host, LONG, dial, dial_address};
use ts3100_tests::testing::{TempDir, eventually};

/// A robot with both ports as pseudo terminals in this directory.
fn robot_in(directory: &TempDir) -> Builder {
    Emulator::builder()
        .serial(Port::Host, SerialEndpoint::Pty(directory.at("host")))
        .serial(Port::Com1, SerialEndpoint::Pty(directory.at("com1")))
}

/// A program that another test is just starting holds the lock of a terminal that was closed until it has begun.
fn open(path: &Path, speed: u32) -> TTYPort {
    let port = serialport::new(path.to_string_lossy(), speed).timeout(LONG);
    eventually("a lock on the terminal", || port.clone().open_native().ok())
}

fn text(data: &str) -> Vec<u8> {
    format!("\x02{data}\r\x03").into_bytes()
}

/// A host asks for SU and acknowledges it.
fn status(host: &mut (impl Read + Write)) {
    host.write_all(&text("SU")).unwrap();
    let answer = host.read_until(0x03);
    assert!(answer.starts_with(b"\x02FL,MODE:"), "{answer:02x?}");
    host.write_all(&text("OK")).unwrap();
}

fn finding(robot: &Emulator, rule: &str) -> String {
    let found = robot.wait_for(LONG, |output| match output {
        Output::Event(Event::Finding(found)) if found.rule.id == rule => Some(found.message.to_string()),
        _ => None,
    });
    found.unwrap_or_else(|error| panic!("{rule}: {error}"))
}

fn text_in(robot: &Emulator, data: &[u8]) {
    let found = robot.wait_for(LONG, |output| match output {
        Output::Event(Event::TextIn { data: found, .. }) => (found == data).then_some(()),
        _ => None,
    });
    found.unwrap_or_else(|error| panic!("{data:02x?}: {error}"));
}

#[test]
fn hosts_come_and_go_and_the_link_stays() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    assert_eq!(
        robot.serial(Port::Host),
        Some(&SerialEndpoint::Pty(directory.at("host")))
    );
    let first = std::fs::read_link(directory.at("host")).unwrap();
    for _ in 0..5 {
        let mut host = open(&directory.at("host"), 9_600);
        status(&mut host);
    }
    assert_eq!(std::fs::read_link(directory.at("host")).unwrap(), first);
    drop(robot);
    assert!(!directory.at("host").exists() && !directory.at("com1").exists());
    // Its lock has gone with it.
    let robot = robot_in(&directory).start().unwrap();
    status(&mut open(&directory.at("host"), 9_600));
    drop(robot);
}

#[test]
fn what_a_killed_daemon_left_is_replaced_and_what_a_living_one_has_is_not() {
    let directory = TempDir::new("serial");
    symlink("/dev/pts/999999", directory.at("host")).unwrap();
    let robot = robot_in(&directory).start().unwrap();
    status(&mut open(&directory.at("host"), 9_600));
    let error = robot_in(&directory).start().unwrap_err().to_string();
    assert!(
        error.contains("another running ts3100") && error.contains("--serial-dir"),
        "{error}"
    );
    status(&mut open(&directory.at("host"), 9_600));
    drop(robot);
    std::fs::write(directory.at("com1"), "mine").unwrap();
    let error = robot_in(&directory).start().unwrap_err().to_string();
    assert!(
        error.contains("COM1") && error.contains("not a symbolic link"),
        "{error}"
    );
    assert_eq!(std::fs::read(directory.at("com1")).unwrap(), b"mine");
    assert!(
        !directory.at("host").exists(),
        "nothing is left of a start that failed"
    );
}

#[test]
fn a_shell_that_writes_and_closes_is_heard() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    std::fs::write(directory.at("host"), text("VR")).unwrap();
    text_in(&robot, b"VR\r");
    status(&mut open(&directory.at("host"), 9_600));
}

#[test]
fn a_host_with_other_settings_is_told_and_the_next_is_served() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    let mut host = open(&directory.at("host"), 19_200);
    host.write_all(&text("SU")).unwrap();
    let told = finding(&robot, "line-settings");
    assert!(
        told.starts_with("speed: [U06] says 9600 bps, the host opened the port with 19200 bps;"),
        "{told}"
    );
    host.set_baud_rate(9_600).unwrap();
    host.set_stop_bits(serialport::StopBits::Two).unwrap();
    host.write_all(&text("SU")).unwrap();
    let told = finding(&robot, "line-settings");
    assert!(
        told.starts_with("stop bits: [U06] says 1 stop bit, the host opened the port with 2"),
        "{told}"
    );
    drop(host);
    let mut host = open(&directory.at("host"), 9_600);
    host.set_parity(serialport::Parity::Odd).unwrap();
    host.write_all(&text("SU")).unwrap();
    let told = finding(&robot, "line-settings");
    assert!(
        told.starts_with("parity: [U06] says no parity, the host opened the port with odd"),
        "{told}"
    );
}

/// Downloads USER.PAR over IP0 and turns the power off and on.
fn set_u06(robot: &Emulator, com1: &str, host: &str) {
    let mut ip0 = dial(robot, Port::Ip0);
    ip0.exchange(&text("DL,USER.PAR"), &text("OK"));
    let file = format!("\x02FL,[U06]\n{{COM1}} = {com1}\n{{HOST}} = {host}\n[END]\n\x1A\x03");
    ip0.exchange(file.as_bytes(), &text("OK"));
    robot.panel(PanelAction::PowerCycle).unwrap();
}

#[test]
fn other_settings_of_u06_hold_after_a_power_cycle() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    let mut host = open(&directory.at("host"), 9_600);
    status(&mut host);
    set_u06(&robot, "9600 8 0 1", "115200 8 2 2");
    host.set_baud_rate(115_200).unwrap();
    host.set_parity(serialport::Parity::Even).unwrap();
    host.set_stop_bits(serialport::StopBits::Two).unwrap();
    status(&mut host);
    drop(host);
    let mut host = open(&directory.at("host"), 9_600);
    host.write_all(&text("SU")).unwrap();
    assert!(finding(&robot, "line-settings").contains("[U06] says 115200 bps"));
}

/// Speed and stop bits of a terminal.
fn shown(path: &Path) -> (u32, bool) {
    let termios = rustix::termios::tcgetattr(File::open(path).unwrap()).unwrap();
    assert!(!termios.local_modes.contains(rustix::termios::LocalModes::ECHO));
    let two = termios
        .control_modes
        .contains(rustix::termios::ControlModes::CSTOPB);
    (termios.output_speed(), two)
}

#[test]
fn a_terminal_nobody_has_set_follows_the_robot_and_another_stays() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    assert_eq!(shown(&directory.at("host")), (9_600, false));
    drop(open(&directory.at("com1"), 19_200));
    set_u06(&robot, "4800 8 0 1", "38400 8 0 2");
    // Each look is a host for the robot, which has to see it go.
    eventually("the terminal follows [U06]", || {
        (shown(&directory.at("host")) == (38_400, true)).then_some(())
    });
    assert_eq!(
        shown(&directory.at("com1")),
        (19_200, false),
        "as stty leaves a real port"
    );
}

#[test]
fn characters_take_their_time_unless_told_not_to() {
    let directory = TempDir::new("serial");
    let transcript = directory.at("robot.jsonl");
    // From the command to the host's answer behind the last byte, in the robot's own time; and to the first byte.
    let answer = |paced: &str| {
        let robot = robot_in(&directory)
            .option("serial.pacing", paced)
            .unwrap()
            .transcript(transcript.to_str().unwrap())
            .unwrap()
            .start()
            .unwrap();
        let mut host = open(&directory.at("host"), 9_600);
        host.sf();
        text_in(&robot, b"OK\r");
        drop(robot);
        let recording = Recording::read(&transcript).unwrap();
        recording.has_beginning(&transcript).unwrap();
        let records = recording.records;
        let of_host = |what: &RecordKind| matches!(what, RecordKind::FromHost { .. });
        let asked = records.iter().find(|record| of_host(&record.kind)).unwrap().at;
        let said = records.iter().rfind(|record| of_host(&record.kind)).unwrap().at;
        let of_robot = |what: &RecordKind| matches!(what, RecordKind::FromRobot { .. });
        let first = records.iter().find(|record| of_robot(&record.kind)).unwrap().at;
        (said.since(asked), first.since(asked))
    };
    // 287 characters of 10 bits.
    let (paced, unpaced) = (answer("true"), answer("false"));
    assert!(paced.0 >= Duration::from_millis(298), "{paced:?}");
    assert_eq!(unpaced.1, Duration::ZERO, "{unpaced:?} {paced:?}");
}

#[test]
fn a_host_that_writes_faster_than_the_line_waits_and_loses_nothing() {
    let program = "GLOBAL\nN = 0\nS = 0\nEND\nPROGRAM P\nS = 0\nFOR K = 1 TO 3000\nINPUT COM1, N\nS = S + N\nNEXT K\n\
                   PRINT COM1, S, CR\nEND\n";
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory)
        .time(TimeMode::Scaled(200.0))
        .file("P", program)
        .select("P")
        .servo_on(true)
        .start()
        .unwrap();
    let mut host = open(&directory.at("com1"), 9_600);
    robot.panel(PanelAction::Start).unwrap();
    let mut writer = host.try_clone_native().unwrap();
    let sender = std::thread::spawn(move || {
        for number in 1..=3_000_u32 {
            writer.write_all(format!("{number:7}\r").as_bytes()).unwrap();
        }
    });
    host.exchange(b"", b"     4501500\r");
    sender.join().unwrap();
}

#[test]
fn a_host_that_vanishes_is_forgotten() {
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory).start().unwrap();
    for begun in [
        "\x02S",
        "\x02UL,USER.PAR\r\x03",
        "\x02DL,HALF\r\x03",
        "\x02DL,HALF\r\x03\x02FL,PROGRAM HALF\r\x03",
    ] {
        let mut host = open(&directory.at("host"), 9_600);
        for part in begun.split_inclusive('\x03') {
            host.write_all(part.as_bytes()).unwrap();
            if part.ends_with('\x03') {
                host.read_until(0x03);
            }
        }
        drop(host);
        let mut host = open(&directory.at("host"), 9_600);
        host.clear(serialport::ClearBuffer::All).unwrap();
        host.write_all(&text("CA")).unwrap();
        let mut answer = host.read_until(0x03);
        while !String::from_utf8_lossy(&answer).contains("ETHERNET.PAR") {
            // The end of what was said to the former host.
            answer = host.read_until(0x03);
        }
        assert!(!String::from_utf8_lossy(&answer).contains("HALF"));
        host.write_all(&text("OK")).unwrap();
    }
    drop(robot);
}

#[test]
fn a_program_that_waits_or_moves_outlives_its_partner() {
    let program = "GLOBAL\nN = 0\nEND\nPROGRAM P\nN = 0\nINPUT COM1, N\nMOVE POINT(300,0,200) WITH SPEED=20\n\
                   PRINT COM1, N, CR\nEND\n";
    let directory = TempDir::new("serial");
    let robot = robot_in(&directory)
        .time(TimeMode::Scaled(50.0))
        .file("P", program)
        .select("P")
        .servo_on(true)
        .start()
        .unwrap();
    drop(open(&directory.at("com1"), 9_600));
    robot.panel(PanelAction::Start).unwrap();
    drop(open(&directory.at("com1"), 9_600));
    let mut partner = open(&directory.at("com1"), 9_600);
    partner.write_all(b"7\r").unwrap();
    drop(partner);
    let mut partner = open(&directory.at("com1"), 9_600);
    partner.exchange(b"", b"           7\r");
}

fn dial_line(end: Option<&SerialEndpoint>) -> TcpStream {
    let Some(SerialEndpoint::Rfc2217(address) | SerialEndpoint::Tcp(address)) = end else {
        panic!("{end:?}");
    };
    dial_address(address)
}

#[test]
fn bare_bytes_over_tcp() {
    let address = "127.0.0.1:0".parse().unwrap();
    let robot = Emulator::builder()
        .serial(Port::Host, SerialEndpoint::Tcp(address))
        .time(TimeMode::Scaled(10.0))
        .start()
        .unwrap();
    let mut first = dial_line(robot.serial(Port::Host));
    status(&mut first);
    let mut second = dial_line(robot.serial(Port::Host));
    assert_eq!(second.read(&mut [0]).unwrap(), 0, "one host at a time");
    status(&mut first);
    drop(first);
    // One that is back before the robot has noticed is not turned away.
    let mut third = dial_line(robot.serial(Port::Host));
    status(&mut third);
    // Nor is it while its last bytes are on the line: 5,000 take five seconds, ten times as fast here.
    third.write_all(&[b'x'; 5_000]).unwrap();
    drop(third);
    status(&mut dial_line(robot.serial(Port::Host)));
}

#[test]
fn what_a_client_that_has_gone_sent_last_keeps_nobody_out() {
    let address = "127.0.0.1:0".parse().unwrap();
    for end in [SerialEndpoint::Tcp(address), SerialEndpoint::Rfc2217(address)] {
        let robot = Emulator::builder().serial(Port::Host, end).start().unwrap();
        let mut first = dial_line(robot.serial(Port::Host));
        // Ten seconds on the line, and more than it holds.
        first.write_all(&[b'x'; 9_600]).unwrap();
        drop(first);
        let mut next = dial_line(robot.serial(Port::Host));
        next.write_all(&text("SU")).unwrap();
        let answer = next.read_until(0x03);
        assert!(answer.windows(8).any(|part| part == b"FL,MODE:"), "{answer:02x?}");
        // The bytes of the first would have taken ten seconds.
        assert!(robot.now().unwrap() < Duration::from_secs(5));
    }
}

#[test]
fn a_client_of_rfc_2217_sets_its_port_and_is_served() {
    let address = "127.0.0.1:0".parse().unwrap();
    let robot = Emulator::builder()
        .serial(Port::Host, SerialEndpoint::Rfc2217(address))
        .start()
        .unwrap();
    let mut client = dial_line(robot.serial(Port::Host));
    client.exchange(
        &[255, 251, 44, 255, 253, 44],
        &[255, 253, 44, 255, 250, 44, 107, 0xB0, 255, 240, 255, 251, 44],
    );
    let baud = |speed: u32| {
        let [a, b, c, d] = speed.to_be_bytes();
        [255, 250, 44, 1, a, b, c, d, 255, 240]
    };
    let agreed = |speed: u32| {
        let mut answer = baud(speed);
        answer[3] = 101;
        answer
    };
    client.exchange(&baud(0), &agreed(9_600));
    client.exchange(&baud(9_600), &agreed(9_600));
    client.write_all(&text("SF")).unwrap();
    // 282 bytes, of which each 255 comes twice: "no alarm" is 255 255.
    let mut body = Vec::new();
    let mut seen = 0;
    while body.len() < 282 {
        let mut byte = [0];
        client.read_exact(&mut byte).unwrap();
        if byte[0] == 255 {
            seen += 1;
            client.exchange(b"", &[255]);
        }
        body.push(byte[0]);
    }
    assert!(
        seen >= 2 && body.starts_with(b"\x02FL,") && body.ends_with(b"\x1A\x03"),
        "{seen}"
    );
    client.exchange(&baud(2_400), &agreed(2_400));
    client.write_all(&text("SU")).unwrap();
    assert!(finding(&robot, "line-settings").contains("the host opened the port with 2400 bps"));
}

/// A pseudo terminal of the test's own, which the robot takes for a real port.
fn cable() -> (File, PathBuf) {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let mut termios = rustix::termios::tcgetattr(&master).unwrap();
    termios.make_raw();
    rustix::termios::tcsetattr(&master, rustix::termios::OptionalActions::Now, &termios).unwrap();
    let name = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    (File::from(master), PathBuf::from(name))
}

/// The master's end of a terminal has no limit of its own for reading.
fn unblocked(cable: &File) {
    let fd: OwnedFd = cable.try_clone().unwrap().into();
    let flags = rustix::fs::fcntl_getfl(&fd).unwrap();
    rustix::fs::fcntl_setfl(&fd, flags | OFlags::NONBLOCK).unwrap();
}

fn hear_cable(cable: &File) -> Vec<u8> {
    unblocked(cable);
    let mut found = Vec::new();
    eventually("a text on the cable", || {
        let mut byte = [0];
        while found.last() != Some(&0x03) {
            match (&mut &*cable).read(&mut byte) {
                Ok(1) => found.push(byte[0]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return None,
                other => panic!("{other:?} behind {found:02x?}"),
            }
        }
        Some(std::mem::take(&mut found))
    })
}

#[test]
fn a_real_port_is_served_and_looked_for_again_when_it_is_unplugged() {
    let directory = TempDir::new("serial");
    let (mut first, name) = cable();
    symlink(&name, directory.at("tty")).unwrap();
    let robot = Emulator::builder()
        .serial(Port::Host, SerialEndpoint::Device(directory.at("tty")))
        .option("channel.redial", "20ms")
        .unwrap()
        .start()
        .unwrap();
    let modes = rustix::termios::tcgetattr(&first).unwrap().input_modes;
    let marks = rustix::termios::InputModes::INPCK | rustix::termios::InputModes::PARMRK;
    assert!(modes.contains(marks), "bad characters are marked: {modes:?}");
    first.write_all(&text("SU")).unwrap();
    assert!(hear_cable(&first).starts_with(b"\x02FL,MODE:"));
    first.write_all(&text("DL,HALF")).unwrap();
    assert_eq!(hear_cable(&first), text("OK"));
    let (mut second, name) = cable();
    std::fs::remove_file(directory.at("tty")).unwrap();
    symlink(&name, directory.at("tty")).unwrap();
    drop(first);
    // What is written before the robot listens is not heard.
    unblocked(&second);
    let answer = eventually("the next cable is heard", || {
        // Nobody reads what fills the terminal before.
        let _ = second.write_all(&text("CA"));
        let mut bytes = [0; 300];
        let count = second.read(&mut bytes).ok().filter(|count| *count > 0)?;
        Some(bytes[..count].to_vec())
    });
    assert!(answer.starts_with(b"\x02FL,"), "{answer:02x?}");
    drop(robot);
}

#[test]
fn a_real_port_opens_again_with_the_u06_of_a_power_cycle() {
    let (mut cable, name) = cable();
    let robot = Emulator::builder()
        .serial(Port::Host, SerialEndpoint::Device(name))
        .start()
        .unwrap();
    set_u06(&robot, "9600 8 0 1", "115200 8 0 2");
    // Both ends of a pseudo terminal have the same settings.
    eventually("the port has the settings of [U06]", || {
        let termios = rustix::termios::tcgetattr(&cable).unwrap();
        let two = rustix::termios::ControlModes::CSTOPB;
        (termios.output_speed() == 115_200 && termios.control_modes.contains(two)).then_some(())
    });
    cable.write_all(&text("SU")).unwrap();
    assert!(hear_cable(&cable).starts_with(b"\x02FL,MODE:"));
}

#[test]
fn a_real_port_that_is_not_there_is_an_error_with_its_name() {
    let started = Emulator::builder()
        .serial(Port::Com1, SerialEndpoint::Device("/dev/ttyNOTHERE".into()))
        .start();
    let error = started.unwrap_err().to_string();
    assert!(
        error.contains("COM1") && error.contains("/dev/ttyNOTHERE"),
        "{error}"
    );
}
