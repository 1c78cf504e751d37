//! Tests of the tap between plain sockets: bytes and ends pass as they are, nothing else does.

use super::*;
use crate::testing::eventually;
use crate::transcript::{Format, Recording};
use socket2::SockRef;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener as Listener, TcpStream as Stream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;
use tokio::runtime::Builder;
use tokio::sync::oneshot;

const LONG: Duration = Duration::from_secs(30);

/// A tap of IP0 in a thread of its own.
struct Tapped {
    address: SocketAddr,
    path: PathBuf,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Tapped {
    fn before(controller: SocketAddr) -> Tapped {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("ts3100-tap-{}-{count}.txt", std::process::id()));
        let settings = TapSettings {
            routes: vec![Route {
                port: Port::Ip0,
                listen: "127.0.0.1:0".parse().unwrap(),
                controller,
            }],
            transcripts: vec![TranscriptFile {
                path: path.clone(),
                format: Format::Text,
            }],
            connect_timeout: LONG,
        };
        let (stop, stopped) = oneshot::channel::<()>();
        let (tell, told) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            Builder::new_current_thread()
                .enable_all()
                .build()
                .unwrap()
                .block_on(async {
                    let tap = Tap::open(&settings).unwrap();
                    tell.send(tap.ports()[&Port::Ip0]).unwrap();
                    tap.run(async {
                        let _ = stopped.await;
                    })
                    .await;
                });
        });
        Tapped {
            address: SocketAddr::new("127.0.0.1".parse().unwrap(), told.recv().unwrap()),
            path,
            stop: Some(stop),
            thread: Some(thread),
        }
    }

    fn dial(&self) -> Stream {
        let stream = Stream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        stream
    }

    fn whats(&self) -> Vec<RecordKind> {
        let recording = Recording::read(&self.path).unwrap();
        recording.records.into_iter().map(|record| record.kind).collect()
    }

    /// Waits until so many things are written down.
    fn noted(&self, count: usize) -> Vec<RecordKind> {
        eventually("so many records", || {
            Some(self.whats()).filter(|whats| whats.len() >= count)
        })
    }
}

impl Drop for Tapped {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_file(&self.path);
    }
}

fn real() -> (Listener, SocketAddr) {
    let listener = Listener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    (listener, address)
}

fn accept(listener: &Listener) -> Stream {
    let (stream, _) = listener.accept().unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    stream
}

fn read(stream: &mut Stream, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count];
    stream.read_exact(&mut bytes).unwrap();
    bytes
}

fn cut(stream: Stream) {
    SockRef::from(&stream).set_linger(Some(Duration::ZERO)).unwrap();
    drop(stream);
}

fn is_reset(stream: &mut Stream) -> bool {
    matches!(stream.read(&mut [0; 8]), Err(error) if error.kind() == ErrorKind::ConnectionReset)
}

const LINE: PeerId = PeerId::first(Port::Ip0);

fn ended(by: Side, how: EndReason) -> RecordKind {
    RecordKind::Ended { line: LINE, by, how }
}

fn connected(peer: u16) -> RecordKind {
    RecordKind::Connected {
        line: PeerId { peer, ..LINE },
        peer: "127.0.0.1".to_owned(),
    }
}

#[test]
fn bytes_pass_unchanged_and_a_half_close_stays_one() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let mut host = tap.dial();
    let mut robot = accept(&listener);
    let every: Vec<u8> = (0..=255).collect();
    host.write_all(&every).unwrap();
    assert_eq!(read(&mut robot, 256), every);
    robot.write_all(&every).unwrap();
    assert_eq!(read(&mut host, 256), every);
    host.shutdown(Shutdown::Write).unwrap();
    assert_eq!(
        robot.read(&mut [0; 8]).unwrap(),
        0,
        "the close of the host arrives"
    );
    robot.write_all(b"late").unwrap();
    assert_eq!(read(&mut host, 4), b"late", "what comes behind it is passed on");
    drop(robot);
    assert_eq!(host.read(&mut [0; 8]).unwrap(), 0);
    let host_bytes = RecordKind::FromHost {
        line: LINE,
        bytes: every.clone().into(),
    };
    let robot_bytes = |bytes: &[u8]| RecordKind::FromRobot {
        line: LINE,
        bytes: bytes.to_vec().into(),
    };
    assert_eq!(
        tap.noted(6),
        [
            connected(1),
            host_bytes,
            robot_bytes(&every),
            ended(Side::Host, EndReason::Closed),
            robot_bytes(b"late"),
            ended(Side::Robot, EndReason::Closed),
        ]
    );
}

#[test]
fn a_stream_larger_than_every_buffer_passes_while_nobody_reads_for_a_while() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let mut host = tap.dial();
    let mut robot = accept(&listener);
    // Nobody reads until nothing more fits between the two.
    let cycle: Vec<u8> = (0..=250).cycle().take(251 * 256).collect();
    host.set_nonblocking(true).unwrap();
    let mut written = 0;
    let full = loop {
        match host.write(&cycle[written % 251..]) {
            Ok(count) => written += count,
            Err(error) => break error.kind(),
        }
        assert!(written < 1_000_000_000, "nothing holds so much");
    };
    assert_eq!(full, ErrorKind::WouldBlock);
    host.set_nonblocking(false).unwrap();
    let rest = cycle[written % 251..].to_vec();
    let count = written + rest.len();
    let writing = std::thread::spawn(move || {
        host.write_all(&rest).unwrap();
        host
    });
    let received = read(&mut robot, count);
    assert!((0..=250).cycle().zip(received).all(|(sent, found)| sent == found));
    let mut host = writing.join().unwrap();
    robot.write_all(b"done").unwrap();
    assert_eq!(read(&mut host, 4), b"done");
}

#[test]
fn the_tap_says_nothing_of_its_own() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let mut host = tap.dial();
    let mut robot = accept(&listener);
    // What one end says is the first that the other hears, and then comes its end.
    host.write_all(b"h").unwrap();
    robot.write_all(b"r").unwrap();
    for (stream, said) in [(&mut robot, b"h"), (&mut host, b"r")] {
        assert_eq!(read(stream, 1), said);
    }
    host.shutdown(Shutdown::Write).unwrap();
    assert_eq!(robot.read(&mut [0; 8]).unwrap(), 0);
    robot.shutdown(Shutdown::Write).unwrap();
    assert_eq!(host.read(&mut [0; 8]).unwrap(), 0);
    listener.set_nonblocking(true).unwrap();
    let error = listener.accept().unwrap_err();
    assert_eq!(
        error.kind(),
        ErrorKind::WouldBlock,
        "one connection, for the one host"
    );
}

#[test]
fn a_reset_of_either_side_arrives_as_a_reset() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let meet = || {
        let (mut host, mut robot) = (tap.dial(), accept(&listener));
        host.write_all(b"x").unwrap();
        read(&mut robot, 1);
        (host, robot)
    };
    let (host, mut robot) = meet();
    cut(host);
    assert!(is_reset(&mut robot));
    assert_eq!(tap.noted(3)[2], ended(Side::Host, EndReason::Reset));
    let (mut host, robot) = meet();
    cut(robot);
    assert!(is_reset(&mut host));
    assert_eq!(tap.noted(6)[5], ended(Side::Robot, EndReason::Reset));
}

#[test]
fn a_host_that_closes_its_half_and_then_resets_the_rest_is_seen() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let host = tap.dial();
    let mut robot = accept(&listener);
    host.shutdown(Shutdown::Write).unwrap();
    assert_eq!(robot.read(&mut [0; 8]).unwrap(), 0);
    cut(host);
    let whats = tap.noted(3);
    assert_eq!(
        whats[1..],
        [
            ended(Side::Host, EndReason::Closed),
            ended(Side::Host, EndReason::Reset)
        ]
    );
}

#[test]
fn a_controller_that_is_not_there_is_said_and_the_next_host_is_carried() {
    let (listener, address) = real();
    drop(listener);
    let tap = Tapped::before(address);
    let mut host = tap.dial();
    assert!(is_reset(&mut host));
    assert_eq!(
        tap.noted(2),
        [connected(1), ended(Side::Robot, EndReason::Refused)]
    );
    let listener = Listener::bind(address).unwrap();
    let mut host = tap.dial();
    let mut robot = accept(&listener);
    host.write_all(b"SO").unwrap();
    assert_eq!(read(&mut robot, 2), b"SO");
}

#[test]
fn hosts_at_once_are_told_apart_and_the_controller_decides_who_stays() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let _first = tap.dial();
    let _robot = accept(&listener);
    let mut second = tap.dial();
    drop(accept(&listener));
    assert_eq!(second.read(&mut [0; 8]).unwrap(), 0);
    let whats = tap.noted(3);
    assert_eq!(whats[..2], [connected(1), connected(2)]);
    let line = PeerId { peer: 2, ..LINE };
    assert_eq!(
        whats[2],
        RecordKind::Ended {
            line,
            by: Side::Robot,
            how: EndReason::Closed
        }
    );
}

#[test]
fn more_hosts_than_there_is_room_for_are_turned_away() {
    let (listener, address) = real();
    let tap = Tapped::before(address);
    let mut there = Vec::new();
    for _ in 0..MAX_HOSTS {
        there.push((tap.dial(), accept(&listener)));
    }
    assert!(is_reset(&mut tap.dial()));
    assert_eq!(tap.noted(MAX_HOSTS).len(), MAX_HOSTS);
    there.clear();
    let greeter = std::thread::spawn(move || {
        let mut robot = accept(&listener);
        robot.write_all(b"r").unwrap();
        robot
    });
    // Room is there again as soon as the ends are seen.
    eventually("room for a host", || {
        let mut host = tap.dial();
        (!is_reset(&mut host)).then_some(())
    });
    drop(greeter.join().unwrap());
}
