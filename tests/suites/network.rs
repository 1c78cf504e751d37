//! What only real sockets show: four channels at once, sizes of segments, addresses and ports of the parameter file,
//! ping. Each test starts its own emulator in this process, on loopback addresses.
//!
//! Everything that can be tested under virtual time is in the other suites.

use socket2::{Domain, Protocol, SockAddr, Socket, Type};
use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;
use ts3100_controller::{PanelAction, Port};
use ts3100_emulator::config::Ports;
use ts3100_emulator::embed::Emulator;
use ts3100_proto::parameter::{EthernetParameters, LineEnd, OpenMode};
use ts3100_tests::host::{Host, LONG, dial, dial_address};
use ts3100_tests::testing::eventually;

/// What one read brings: on the loopback interface what one write sent, if nothing else was sent.
fn segment(stream: &mut TcpStream) -> Vec<u8> {
    let mut buffer = [0; 4_096];
    let count = stream.read(&mut buffer).unwrap();
    buffer[..count].to_vec()
}

/// Connects from a source port of the host's own choice, as the maker's library does when it is told to.
fn dial_from(source: u16, address: SocketAddr) -> TcpStream {
    let stream = eventually("connect from a port of the host's own", || {
        let socket = Socket::new(Domain::IPV4, Type::STREAM, Some(Protocol::TCP)).unwrap();
        socket.set_reuse_address(true).unwrap();
        // Without lingering, the pair of ports is free for the next connection at once.
        socket.set_linger(Some(Duration::ZERO)).unwrap();
        socket
            .bind(&SocketAddr::from((Ipv4Addr::LOCALHOST, source)).into())
            .unwrap();
        match socket.connect(&address.into()) {
            Ok(()) => Some(TcpStream::from(socket)),
            // A program that another test is starting holds a copy of the socket before, from its fork to its exec.
            Err(reason) if reason.kind() == ErrorKind::AddrNotAvailable => None,
            Err(reason) => panic!("connect from port {source}: {reason}"),
        }
    });
    stream.set_nodelay(true).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    stream
}

/// Where the ports of these tests begin, and how many a process has: below those that systems hand out by themselves to
/// other tests (from 32,768 on, or from 49,152), so that a port found free stays free.
const FIRST_PORT: u16 = 20_000;
const PORTS: u16 = 64;
const PROCESSES: u32 = 190;

/// This many neighbouring ports that nobody has, each handed out once in this process.
fn free_ports(count: u16) -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let place = u16::try_from(std::process::id() % PROCESSES).unwrap();
    loop {
        let taken = NEXT.fetch_add(count, Ordering::Relaxed);
        assert!(taken + count <= PORTS, "none of {PORTS} ports is free");
        let first = FIRST_PORT + place * PORTS + taken;
        if (first..first + count).all(|port| TcpListener::bind(("127.0.0.1", port)).is_ok()) {
            return first;
        }
    }
}

const ECHO: &str = "PROGRAM ECHO\nN = 0\nM = 0\nLOOP:\nINPUT IP1, N\nINPUT IP2, M\nPRINT IP1, M, CR\nPRINT IP2, N, CR\nGOTO LOOP\nEND\n";

// clause: ETH-01 GEN-04
#[test]
fn four_channels_serve_at_the_same_time() {
    let robot = Emulator::builder()
        .file("ECHO", ECHO)
        .select("ECHO")
        .servo_on(true)
        .start()
        .unwrap();
    // IP0 last: when it is served, the driver knows of the others.
    let [mut ip3, mut ip2, mut ip1, mut ip0] =
        [Port::Ip3, Port::Ip2, Port::Ip1, Port::Ip0].map(|port| dial(&robot, port));
    ip0.exchange(b"\x02RN\r\x03", b"\x02OK\r\x03");
    for round in 1..=5 {
        ip3.write_all(b"\x02SU\r\x03").unwrap();
        ip1.write_all(format!("{round}\r").as_bytes()).unwrap();
        ip0.write_all(b"\x02SU\r\x03").unwrap();
        ip2.write_all(format!("{}\r", round * 10).as_bytes()).unwrap();
        let status = ip0.read_until(0x03);
        assert!(
            status.ends_with(b"STATUS:running\x1A\x03"),
            "{}",
            status.escape_ascii()
        );
        ip0.write_all(b"\x02OK\r\x03").unwrap();
        assert_eq!(ip1.read_until(b'\r'), format!("{:12}\r", round * 10).as_bytes());
        assert_eq!(ip2.read_until(b'\r'), format!("{round:12}\r").as_bytes());
    }
    drop(robot);
    assert_eq!(ip3.rest(), (vec![], None));
}

// clause: ETH-02 PRT-09 FRM-05
#[test]
fn each_send_is_one_segment_of_512_bytes_at_most() {
    let program = format!("PROGRAM T\nPRINT IP1, \"{}\", CR\nEND\n", "x".repeat(200));
    let long = format!("PROGRAM L\n{}END\n", "DELAY 1.0\n".repeat(200));
    let robot = Emulator::builder()
        .file("T", program)
        .file("L", long)
        .select("T")
        .servo_on(true)
        .start()
        .unwrap();
    let [mut ip0, mut ip1] = [Port::Ip0, Port::Ip1].map(|port| dial(&robot, port));
    ip0.write_all(b"\x02UL,L\r\x03").unwrap();
    let mut sizes = Vec::new();
    loop {
        let text = segment(&mut ip0);
        assert!(
            text.starts_with(b"\x02") && text.ends_with(b"\x03"),
            "a text in one piece"
        );
        sizes.push(text.len());
        ip0.write_all(b"\x02OK\r\x03").unwrap();
        if text.ends_with(b"\x1A\x03") {
            break;
        }
    }
    assert!(
        sizes.len() > 4 && sizes[..sizes.len() - 1].iter().all(|size| *size == 255),
        "{sizes:?}"
    );
    ip0.write_all(b"\x02SF\r\x03").unwrap();
    assert_eq!(segment(&mut ip0).len(), 282);
    ip0.write_all(b"\x02OK\r\x03").unwrap();
    for byte in b"\x02SU\r\x03" {
        ip0.write_all(&[*byte]).unwrap();
    }
    assert!(
        segment(&mut ip0).starts_with(b"\x02FL,MODE:"),
        "cut at every byte"
    );
    ip0.write_all(b"\x02OK\r\x03\x02RN\r\x03").unwrap();
    assert!(
        segment(&mut ip0).starts_with(b"\x02OK\r\x03"),
        "two texts in one segment"
    );
    assert_eq!(segment(&mut ip1).len(), 201);
}

fn ethernet(change: impl Fn(&mut EthernetParameters)) -> Vec<u8> {
    let mut parameters = EthernetParameters::factory();
    change(&mut parameters);
    parameters.encode(LineEnd::Lf)
}

// clause: PAR-E01-02
#[test]
fn e01_is_for_display_and_does_not_bind() {
    let content = ethernet(|parameters| parameters.address = [10, 9, 9, 9]);
    for listen in [Ipv4Addr::LOCALHOST, Ipv4Addr::UNSPECIFIED] {
        let robot = Emulator::builder()
            .file("ETHERNET.PAR", &content)
            .listen(IpAddr::V4(listen))
            .start()
            .unwrap();
        let port = robot.address(Port::Ip0).unwrap().port();
        let mut ip0 = dial_address(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
        ip0.write_all(b"\x02UL,ETHERNET.PAR\r\x03").unwrap();
        let text = String::from_utf8(ip0.read_until(0x03)).unwrap();
        assert!(text.contains("10.9.9.9"), "{text}");
    }
}

// clause: TSPC-01 ETH-03 PAR-E05-01
#[test]
fn a_host_connects_to_the_port_of_e05_not_of_e06() {
    let (own, other) = (free_ports(1), free_ports(1));
    let content = ethernet(|parameters| {
        parameters.open_mode = [
            OpenMode::Server,
            OpenMode::NotUsed,
            OpenMode::NotUsed,
            OpenMode::NotUsed,
        ];
        parameters.own_port[0] = own;
        parameters.peer_port[0] = other;
    });
    let robot = Emulator::builder()
        .file("ETHERNET.PAR", content)
        .ports(Ports::Offset(0))
        .start()
        .unwrap();
    assert_eq!(robot.ports().len(), 1);
    let mut ip0 = dial_address(SocketAddr::from((Ipv4Addr::LOCALHOST, own)));
    ip0.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    assert!(
        TcpStream::connect((Ipv4Addr::LOCALHOST, other)).is_err(),
        "[E06] opens nothing"
    );
}

// clause: L4 L5 J1-J5
#[test]
fn a_host_that_comes_back_from_the_same_source_port_is_served_each_time() {
    let robot = Emulator::builder().start().unwrap();
    let source = free_ports(1);
    for visit in 0..60 {
        let mut ip0 = dial_from(source, robot.address(Port::Ip0).unwrap());
        // What the library asks when it connects.
        for command in ["SM,1", "VR"] {
            ip0.write_all(format!("{command}\r\x03").as_bytes()).unwrap();
            let answer = ip0.read_until(0x03);
            assert!(answer.starts_with(b"FL,"), "visit {visit}: {command}");
            ip0.write_all(b"OK\r\x03").unwrap();
        }
        // The last exchange is over when the next command is served.
        ip0.exchange(b"SP\r\x03", b"OK\r\x03");
    }
}

// clause: TSPC-02
#[test]
fn factory_settings_answer_a_client_with_factory_settings() {
    // Ports 1000 to 1003 need privileges; moved by an offset they are the same otherwise.
    let offset = free_ports(4) - 1_000;
    let robot = Emulator::builder().ports(Ports::Offset(offset)).start();
    let robot = robot.unwrap_or_else(|error| panic!("{error}"));
    let mut ip0 = dial_address(SocketAddr::from((Ipv4Addr::LOCALHOST, 1_000 + offset)));
    for _ in 0..3 {
        // STX none, checksum none.
        ip0.write_all(b"SU\r\x03").unwrap();
        let answer = ip0.read_until(0x03);
        assert!(answer.starts_with(b"FL,MODE:external(ethernet)/") && answer.ends_with(b"\x1A\x03"));
        ip0.write_all(b"OK\r\x03").unwrap();
    }
    drop(robot);
    assert_eq!(ip0.rest(), (vec![], None));
    let serial = ts3100_tests::Robot::new(ts3100_controller::Dialect::Field);
    let com1 = serial.seat.controller.serial_line(Port::Com1).unwrap();
    assert_eq!(
        (com1.speed, com1.length, com1.parity.number(), com1.stop),
        (9_600, 8, 0, 1)
    );
}

/// Sum of RFC 1071 over 16-bit words.
fn checksum(bytes: &[u8]) -> u16 {
    let words = bytes
        .chunks(2)
        .map(|pair| u32::from(pair[0]) << 8 | u32::from(pair.get(1).copied().unwrap_or(0)));
    let mut sum: u32 = words.sum();
    while sum > 0xFFFF {
        sum = (sum >> 16) + (sum & 0xFFFF);
    }
    !u16::try_from(sum).unwrap()
}

/// Sends an ICMP echo to the address; whether the answer with the same number and data came.
fn echo(address: Ipv4Addr) -> std::io::Result<bool> {
    let kinds = [Type::DGRAM, Type::RAW];
    let mut opened = kinds
        .into_iter()
        .map(|kind| Socket::new(Domain::IPV4, kind, Some(Protocol::ICMPV4)));
    let mut socket = opened.next().unwrap().or_else(|_| opened.next().unwrap())?;
    socket.set_read_timeout(Some(LONG))?;
    let mut request = b"\x08\0\0\0\x31\x00\0\x01ts3100 answers".to_vec();
    let sum = checksum(&request).to_be_bytes();
    request[2..4].copy_from_slice(&sum);
    socket.send_to(&request, &SockAddr::from(SocketAddr::from((address, 0))))?;
    loop {
        let mut buffer = [0; 1_024];
        let count = match socket.read(&mut buffer) {
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(false);
            }
            Err(error) => return Err(error),
        };
        // A raw socket brings the IP header and hears the request as well, and what is meant for others.
        let packet = &buffer[..count];
        let icmp = if packet[0] >> 4 == 4 {
            &packet[usize::from(packet[0] & 15) * 4..]
        } else {
            packet
        };
        if icmp[0] == 0 && icmp[6..] == request[6..] {
            return Ok(true);
        }
    }
}

// clause: ETH-08
#[test]
fn the_address_of_the_emulator_answers_ping() {
    let robot = Emulator::builder().start().unwrap();
    let address = robot.address(Port::Ip0).unwrap();
    let IpAddr::V4(ip) = address.ip() else {
        panic!("an IPv4 address expected, {address} found")
    };
    dial_address(address).exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    let answered =
        echo(ip).unwrap_or_else(|error| panic!("no echo can be sent to {ip}: {error}{}", means(&error)));
    assert!(answered, "no echo from {ip}");
}

/// What lets this user send an ICMP echo.
fn means(error: &std::io::Error) -> &'static str {
    if error.kind() == ErrorKind::PermissionDenied {
        "; this user may open no ICMP socket: run the tests as root, or set net.ipv4.ping_group_range to its group"
    } else {
        ""
    }
}

// clause: PAR-FILE-03 PAR-E05-01
#[test]
fn a_new_port_serves_after_the_power_cycle_and_the_old_no_more() {
    let (first, second) = (free_ports(1), free_ports(1));
    let with_port = |port| {
        ethernet(|parameters| {
            parameters.open_mode = [
                OpenMode::Server,
                OpenMode::NotUsed,
                OpenMode::NotUsed,
                OpenMode::NotUsed,
            ];
            parameters.own_port[0] = port;
        })
    };
    let robot = Emulator::builder()
        .file("ETHERNET.PAR", with_port(first))
        .ports(Ports::Offset(0))
        .start()
        .unwrap();
    let mut ip0 = dial_address(SocketAddr::from((Ipv4Addr::LOCALHOST, first)));
    ip0.exchange(b"\x02DL,ETHERNET.PAR\r\x03", b"\x02OK\r\x03");
    for block in [b"FL,", with_port(second).as_slice(), b"\x1A"]
        .concat()
        .chunks(253)
    {
        ip0.exchange(&[b"\x02", block, b"\x03"].concat(), b"\x02OK\r\x03");
    }
    assert!(
        TcpStream::connect((Ipv4Addr::LOCALHOST, second)).is_err(),
        "not before"
    );
    ip0.exchange(b"\x02SO\r\x03", b"\x02OK\r\x03");
    robot.panel(PanelAction::PowerCycle).unwrap();
    let mut ip0 = dial_address(SocketAddr::from((Ipv4Addr::LOCALHOST, second)));
    ip0.exchange(b"\x02BR\r\x03", b"\x02OK\r\x03");
    assert!(
        TcpStream::connect((Ipv4Addr::LOCALHOST, first)).is_err(),
        "no more"
    );
}
