//! The options of the edge, which only real sockets show.
//!
//! Options of the controller are in `options.rs`.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;
use ts3100_controller::Port;
use ts3100_emulator::embed::{Emulator, TimeMode};
use ts3100_proto::parameter::{EthernetParameters, LineEnd, OpenMode};
use ts3100_tests::frame;
use ts3100_tests::host::{Host, LONG, dial, dial_address};
use ts3100_tests::testing::TempDir;

fn emulator(option: &str, value: Option<&str>, ethernet: &EthernetParameters) -> Emulator {
    let mut builder = Emulator::builder().file("ETHERNET.PAR", ethernet.encode(LineEnd::Lf));
    if let Some(value) = value {
        builder = builder.option(option, value).unwrap();
    }
    builder.start().unwrap()
}

/// Whether this host is served; the other case is the end of the connection.
fn served(host: &mut TcpStream) -> bool {
    let mut answer = [0; 5];
    let reply = host
        .write_all(&frame(b"SP\r"))
        .and_then(|()| host.read_exact(&mut answer));
    reply.is_ok() && answer == *frame(b"OK\r")
}

#[test]
fn channel_second_says_which_of_two_hosts_stays() {
    for (value, stays) in [
        (None, [true, false]),
        (Some("refuse"), [true, false]),
        (Some("replace"), [false, true]),
    ] {
        let robot = emulator("channel.second", value, &EthernetParameters::factory());
        let address = robot.address(Port::Ip0).unwrap();
        let mut first = dial_address(address);
        assert!(served(&mut first), "{value:?}");
        let mut second = dial_address(address);
        let second_stays = served(&mut second);
        assert_eq!([served(&mut first), second_stays], stays, "{value:?}");
    }
}

/// A directory that is gone takes nothing, as a full disk does.
#[test]
fn drive_when_full_says_whether_a_change_that_is_not_on_the_disk_is_accepted() {
    for (value, answer) in [(None, "NG"), (Some("refuse"), "NG"), (Some("memory"), "OK")] {
        let directory = TempDir::new("when-full");
        let mut builder = Emulator::builder()
            .drive(directory.path())
            .file("A", "PROGRAM A\nEND\n");
        if let Some(value) = value {
            builder = builder.option("drive.when_full", value).unwrap();
        }
        let robot = builder.start().unwrap();
        let mut host = dial(&robot, Port::Ip0);
        std::fs::remove_dir_all(directory.path()).unwrap();
        assert_eq!(host.command("ER,A"), answer, "{value:?}");
    }
}

/// The next who comes to a listener.
fn accepted(listener: &TcpListener) -> TcpStream {
    let (sender, come) = std::sync::mpsc::channel();
    let listener = listener.try_clone().unwrap();
    std::thread::spawn(move || sender.send(listener.accept().unwrap().0));
    come.recv_timeout(LONG).unwrap()
}

/// Two client channels that lose each connection at once: the one with the short pause comes again, and again; the one
/// that pauses for an hour does not.
#[test]
fn channel_redial_says_how_soon_a_client_channel_comes_again() {
    let dialled = |value| {
        let peer = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut parameters = EthernetParameters::factory();
        parameters.open_mode = [
            OpenMode::Server,
            OpenMode::Client,
            OpenMode::NotUsed,
            OpenMode::NotUsed,
        ];
        parameters.peer_address[1] = [127, 0, 0, 1];
        parameters.peer_port[1] = peer.local_addr().unwrap().port();
        let robot = emulator("channel.redial", Some(value), &parameters);
        drop(accepted(&peer));
        (robot, peer)
    };
    let (_slow_robot, slow) = dialled("3600s");
    let (_quick_robot, quick) = dialled("20ms");
    for _ in 0..3 {
        drop(accepted(&quick));
    }
    slow.set_nonblocking(true).unwrap();
    let error = slow.accept().unwrap_err();
    assert_eq!(error.kind(), ErrorKind::WouldBlock);
}

/// A host is connected to two robots and says nothing: time jumps over an hour where that is silence, and not where it
/// is none yet.
#[test]
fn auto_silence_says_how_long_hosts_must_be_silent_before_time_jumps() {
    let waiting = |value| {
        let robot = Emulator::builder()
            .file("LONG", "PROGRAM LONG\nDELAY 3600\nDOUT(1)\nEND\n")
            .select("LONG")
            .servo_on(true)
            .time(TimeMode::Auto)
            .option("auto.silence", value)
            .unwrap()
            .start()
            .unwrap();
        let mut host = dial(&robot, Port::Ip0);
        assert_eq!(host.command("RN"), "OK");
        (robot, host)
    };
    let (patient, _waits) = waiting("3600s");
    let (quick, _silent) = waiting("0.05ms");
    let done = quick
        .wait_until("output 1 on", Duration::from_secs(7_200))
        .unwrap();
    assert!(done);
    assert!(!patient.output(1).unwrap());
}
