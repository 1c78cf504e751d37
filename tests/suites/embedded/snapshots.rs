//! Snapshots of a running emulator: kept under names, put back between two tests while the hosts stay connected,
//! written to files and begun with. Embedded, and as the binary.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::time::Duration;
use ts3100_controller::port::Port;
use ts3100_controller::{Event, Output, PanelAction};
use ts3100_emulator::clock::TimeMode;
use ts3100_emulator::embed::Emulator;
use ts3100_proto::status::ExecutionStatus;

/// Longest wait for anything; reached only when a test fails.
const LONG: Duration = Duration::from_secs(30);

const PROGRAM: &str = "PROGRAM PICK\nINPUT IP1, N\nPRINT IP1, N + 1, CR\nDELAY 3600\nEND\n";

struct Host(TcpStream);

impl Host {
    fn dial(robot: &Emulator, port: Port) -> Host {
        let stream = TcpStream::connect(robot.address(port).unwrap()).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        Host(stream)
    }

    fn until(&mut self, end: u8) -> String {
        let mut found = Vec::new();
        while found.last() != Some(&end) {
            let mut byte = [0];
            self.0.read_exact(&mut byte).unwrap();
            found.push(byte[0]);
        }
        found.escape_ascii().to_string()
    }

    fn ask(&mut self, command: &str) -> String {
        self.0
            .write_all(format!("\x02{command}\r\x03").as_bytes())
            .unwrap();
        let mut answer = self.until(3);
        // A stop that the host did not ask for is told in between.
        while answer == "\\x02SP\\r\\x03" {
            answer = self.until(3);
        }
        if answer.starts_with("\\x02FL") {
            self.0.write_all(b"\x02OK\r\x03").unwrap();
        }
        answer
    }
}

/// A directory removed on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(what: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("ts3100-snapshots-{what}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Folder(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
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
    let mut host = Host::dial(&robot, Port::Ip0);
    let before = host.ask("SU");
    robot.snapshot("ready").unwrap();
    for _ in 0..3 {
        assert_eq!(host.ask("EC,OVRD 7"), "\\x02OK\\r\\x03");
        assert_eq!(host.ask("RS,SEL"), "\\x02OK\\r\\x03");
        robot.panel(PanelAction::EmergencyStop(true)).unwrap();
        let changed = host.ask("SU");
        assert!(
            changed.contains("OVRD:7%") && !changed.contains("PICK"),
            "{changed}"
        );
        robot.restore("ready").unwrap();
        assert_eq!(host.ask("SU"), before, "the same connection, the state of before");
        assert_eq!(host.ask("DO,DOUT(5)"), "\\x02OK\\r\\x03", "servo power is back");
    }
    let error = robot.restore("steady").unwrap_err().to_string();
    assert_eq!(error, "snapshot: expected one of ready, found `steady`");
    let error = robot.snapshot("a b").unwrap_err().to_string();
    assert!(error.contains("found `a b`"), "{error}");
}

#[test]
fn a_program_goes_on_from_its_input_with_the_peer_that_is_there() {
    let robot = robot().start().unwrap();
    let mut host = Host::dial(&robot, Port::Ip0);
    let mut peer = Host::dial(&robot, Port::Ip1);
    assert_eq!(host.ask("RN"), "\\x02OK\\r\\x03");
    robot.snapshot("waiting").unwrap();
    for number in [4, 41] {
        peer.0.write_all(format!("{number}\r").as_bytes()).unwrap();
        assert_eq!(peer.until(b'\r').trim(), format!("{}\\r", number + 1));
        let ended = |output: &Output| match output {
            Output::Event(Event::Status {
                status: ExecutionStatus::Reset,
                ..
            }) => Some(()),
            _ => None,
        };
        robot.wait_for(LONG, ended).unwrap();
        robot.restore("waiting").unwrap();
        assert!(host.ask("SU").contains("STATUS:running"));
    }
    // Each run has taken an hour of virtual time, and each time the clock was set back.
    robot.panel(PanelAction::EmergencyStop(true)).unwrap();
    let history = host.ask("EU");
    assert!(history.contains("008-027 14-02-06 00:00"), "{history}");
}

#[test]
fn what_a_fault_made_half_open_does_not_outlast_the_state_it_came_with() {
    let robot = robot().start().unwrap();
    robot.snapshot("ready").unwrap();
    robot.arm("half-open:command=SU,lasts=600000").unwrap();
    let mut host = Host::dial(&robot, Port::Ip0);
    host.0.write_all(b"\x02SU\r\x03").unwrap();
    let applied = |output: &Output| match output {
        Output::Event(Event::Fault { fired: true, .. }) => Some(()),
        _ => None,
    };
    robot.wait_for(LONG, applied).unwrap();
    robot.restore("ready").unwrap();
    assert!(host.0.read(&mut [0]).is_err(), "the connection is reset");
    assert!(robot.faults().unwrap().is_empty(), "armed behind the snapshot");
    assert!(Host::dial(&robot, Port::Ip0).ask("SU").contains("PICK"));
}

#[test]
fn the_backing_directory_follows_and_a_file_begins_another_emulator() {
    let folder = Folder::new("drive");
    let (drive, file) = (folder.0.join("drive"), folder.0.join("state.json"));
    std::fs::create_dir_all(&drive).unwrap();
    let first = robot().drive(&drive).start().unwrap();
    let mut host = Host::dial(&first, Port::Ip0);
    assert_eq!(host.ask("EC,OVRD 33"), "\\x02OK\\r\\x03");
    first.write_snapshot(&file).unwrap();
    assert_eq!(host.ask("RS,SEL"), "\\x02OK\\r\\x03");
    assert_eq!(host.ask("ER,PICK"), "\\x02OK\\r\\x03");
    assert_eq!(host.ask("DL,OTHER"), "\\x02OK\\r\\x03");
    host.0.write_all(b"\x02FL,PROGRAM X\nEND\n\x1a\x03").unwrap();
    assert_eq!(host.until(3), "\\x02OK\\r\\x03");
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
    first.read_snapshot(&file).unwrap();
    assert_eq!(names(), ["ETHERNET.PAR", "PICK", "USER.PAR"]);
    let state = host.ask("SU");
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
    let mut host = Host::dial(&second, Port::Ip0);
    assert_eq!(host.ask("SU"), state);
    assert_eq!(host.ask("DO,DOUT(5)"), "\\x02OK\\r\\x03", "servo power too");
}
