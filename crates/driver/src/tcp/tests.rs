//! Tests of the links over the loopback, with the messages taken as the driver takes them. Nothing waits by
//! the clock: each step waits for the message or the bytes it is about.

use super::*;
use std::future::poll_fn;
use std::task::Poll;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Longest wait for anything; reached only when a test fails.
const LONG: Duration = Duration::from_secs(20);

fn plan(ip0: OpenMode, ip1: OpenMode, peer_port: u16) -> NetworkConfig {
    let channel = |mode, own_port| ChannelConfig {
        mode,
        own_port,
        peer_address: [127, 0, 0, 1],
        peer_port,
    };
    let unused = channel(OpenMode::NotUsed, 1002);
    NetworkConfig {
        channels: [channel(ip0, 1000), channel(ip1, 1001), unused, unused],
    }
}

fn links(options: LinkOptions) -> Channels {
    Channels::new(IpAddr::from([127, 0, 0, 1]), Ports::Auto, None, options)
}

/// A server on IP0 and its port.
fn server(second: SecondConnection) -> (Channels, u16) {
    let mut links = links(LinkOptions {
        second,
        ..LinkOptions::default()
    });
    let ports = links.open(&plan(OpenMode::Server, OpenMode::NotUsed, 0)).unwrap();
    (links, ports[&Port::Ip0])
}

async fn dial(port: u16) -> TcpStream {
    TcpStream::connect(("127.0.0.1", port)).await.unwrap()
}

/// Inputs of the next event.
async fn event(links: &mut Channels) -> Vec<Input> {
    event_reading(links, READ_BUFFER).await
}

/// Inputs of the next event, with a limit to the bytes that are read.
async fn event_reading(links: &mut Channels, most: usize) -> Vec<Input> {
    let poll = poll_fn(|context| {
        let mut polled = links.channels.values_mut();
        let ready = polled.find_map(|channel| match channel.poll(most, Some(context)) {
            Poll::Ready(inputs) => Some(inputs),
            Poll::Pending => None,
        });
        ready.map_or(Poll::Pending, Poll::Ready)
    });
    timeout(LONG, poll).await.expect("an event")
}

/// Sends to the peer of a port.
fn send(links: &mut Channels, port: Port, bytes: &[u8]) -> Vec<Input> {
    let bytes = bytes.to_vec().into();
    links.get_mut(port).unwrap().send(bytes)
}

/// The inputs of the next event that means something.
async fn next(links: &mut Channels) -> Vec<Input> {
    loop {
        let inputs = event(links).await;
        if !inputs.is_empty() {
            return inputs;
        }
    }
}

fn connected(stream: &TcpStream) -> Input {
    Input::Connected {
        port: Port::Ip0,
        peer: stream.local_addr().unwrap().to_string(),
    }
}

fn second_peer(stream: &TcpStream, kept: bool) -> Input {
    Input::SecondPeer {
        port: Port::Ip0,
        peer: stream.local_addr().unwrap().to_string(),
        kept,
    }
}

fn received(bytes: &[u8]) -> Input {
    Input::Received {
        port: Port::Ip0,
        bytes: bytes.to_vec().into(),
    }
}

const GONE: Input = Input::Disconnected { port: Port::Ip0 };

// clause: ETH-03
#[tokio::test]
async fn bytes_pass_both_ways_and_the_end_is_reported_once() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    assert_eq!(next(&mut links).await, [connected(&host)]);
    host.write_all(b"\x02SU\r\x03").await.unwrap();
    assert_eq!(next(&mut links).await, [received(b"\x02SU\r\x03")]);
    assert_eq!(send(&mut links, Port::Ip0, b"\x02NG\r\x03"), []);
    let mut answer = [0; 5];
    host.read_exact(&mut answer).await.unwrap();
    assert_eq!(&answer, b"\x02NG\r\x03");
    drop(host);
    assert_eq!(next(&mut links).await, [GONE]);
    assert_eq!(send(&mut links, Port::Ip0, b"SP"), [], "nobody is there");
    let again = dial(port).await;
    assert_eq!(
        next(&mut links).await,
        [connected(&again)],
        "no second end came in between"
    );
}

// clause: ETH-06
#[tokio::test]
async fn who_connects_before_a_command_is_sent_on_another_channel_is_known_before_it() {
    let mut links = links(LinkOptions::default());
    let ports = links.open(&plan(OpenMode::Server, OpenMode::Server, 0)).unwrap();
    let host = dial(ports[&Port::Ip0]).await;
    assert_eq!(next(&mut links).await, [connected(&host)]);
    // The runtime gets no turn, as when the driver is busy, and learns of neither.
    let vision = std::net::TcpStream::connect(("127.0.0.1", ports[&Port::Ip1])).unwrap();
    assert_eq!(host.try_write(b"RN\r").unwrap(), 3);
    let peer = vision.local_addr().unwrap().to_string();
    let known = Input::Connected {
        port: Port::Ip1,
        peer,
    };
    // As the driver does when it has found bytes on a port.
    let read = links.get_mut(Port::Ip0).unwrap().poll(READ_BUFFER, None);
    assert_eq!(read, Poll::Ready(vec![received(b"RN\r")]));
    assert_eq!(links.accept_arrived(), [known]);
    // It is served like any other.
    use std::io::Write as _;
    (&vision).write_all(b"1\r").unwrap();
    let data = Input::received(Port::Ip1, b"1\r".to_vec());
    assert_eq!(next(&mut links).await, [data]);
}

#[tokio::test]
async fn a_second_connection_is_closed_and_the_first_untouched() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut first = dial(port).await;
    next(&mut links).await;
    let mut second = dial(port).await;
    assert_eq!(
        event(&mut links).await,
        [],
        "it may wait for a predecessor that is about to end"
    );
    assert_eq!(
        event(&mut links).await,
        [second_peer(&second, false)],
        "that time is over"
    );
    let end = timeout(LONG, second.read(&mut [0; 8])).await.unwrap();
    assert!(matches!(end, Ok(0) | Err(_)), "{end:?}");
    first.write_all(b"x").await.unwrap();
    assert_eq!(next(&mut links).await, [received(b"x")]);
}

// clause: ETH-07
#[tokio::test]
async fn a_host_that_is_back_before_its_close_is_seen_is_served() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let first = dial(port).await;
    next(&mut links).await;
    let mut second = dial(port).await;
    assert_eq!(event(&mut links).await, [], "the first is still there");
    let passing = dial(port).await;
    assert_eq!(event(&mut links).await, [], "so is the second");
    drop((first, passing));
    assert_eq!(next(&mut links).await, [GONE, connected(&second)]);
    second.write_all(b"x").await.unwrap();
    assert_eq!(next(&mut links).await, [received(b"x")]);
}

#[tokio::test]
async fn a_host_that_floods_gives_way_to_the_next() {
    // Its close may be behind what it has sent.
    for is_gone in [true, false] {
        let (mut links, port) = server(SecondConnection::Refuse);
        let mut flood = dial(port).await;
        assert_eq!(next(&mut links).await, [connected(&flood)]);
        flood.write_all(&[0x03; 40 * 1024]).await.unwrap();
        let flood = (!is_gone).then_some(flood);
        let host = dial(port).await;
        let met = loop {
            let inputs = next(&mut links).await;
            match inputs.as_slice() {
                [Input::Received { bytes, .. }] => assert!(bytes.len() < 100, "a portion"),
                _ => break inputs,
            }
        };
        assert_eq!(met, [GONE, connected(&host)]);
        drop(flood);
    }
}

/// Of what a peer has sent the system has only a part at a time.
#[tokio::test]
async fn a_host_floods_by_what_it_sends_without_a_pause() {
    // With three reads all of a block is read, with two the next one comes before.
    for (reads, floods) in [(3, false), (2, true)] {
        let (mut links, port) = server(SecondConnection::Refuse);
        let mut flood = dial(port).await;
        next(&mut links).await;
        for block in 0..4 {
            flood.write_all(&[b'A'; 10 * 1024]).await.unwrap();
            for _ in 0..if block < 3 { reads } else { 0 } {
                next(&mut links).await;
            }
        }
        let host = dial(port).await;
        let met = event_reading(&mut links, 0).await;
        assert_eq!(met.as_slice() == [GONE, connected(&host)], floods, "{met:?}");
    }
}

#[tokio::test]
async fn a_host_that_begins_to_flood_while_the_next_waits_gives_way() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut flood = dial(port).await;
    next(&mut links).await;
    let host = dial(port).await;
    assert_eq!(event(&mut links).await, [], "it waits");
    flood.write_all(&[0x03; 40 * 1024]).await.unwrap();
    assert_eq!(event_reading(&mut links, 0).await, [GONE, connected(&host)]);
}

/// Bytes without a pause keep the runtime from its sockets; here it never looks at them.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_close_is_known_before_the_runtime_looks_at_its_sockets() {
    use std::io::Write as _;
    let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let mut peer = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (stream, address) = listener.accept().unwrap();
    stream.set_nonblocking(true).unwrap();
    let stream = TcpStream::from_std(stream).unwrap();
    let connection = connection::Connection::new(Port::Ip0, (stream, address, None));
    peer.write_all(b"unread").unwrap();
    assert!(!connection.peer_has_closed());
    drop(peer);
    assert!(connection.peer_has_closed());
}

#[tokio::test]
async fn a_second_connection_may_replace_the_first() {
    let (mut links, port) = server(SecondConnection::Replace);
    let mut first = dial(port).await;
    next(&mut links).await;
    let mut second = dial(port).await;
    assert_eq!(
        next(&mut links).await,
        [second_peer(&second, true), GONE, connected(&second)]
    );
    assert!(is_ended(&mut first).await);
    second.write_all(b"x").await.unwrap();
    assert_eq!(next(&mut links).await, [received(b"x")]);
}

/// The first of two connections that have waited for an unread predecessor is served. The other waits for its end, and is
/// refused when it stays.
// clause: ETH-07
#[tokio::test]
async fn who_has_waited_for_one_connection_waits_for_the_next_one_too() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut first = dial(port).await;
    next(&mut links).await;
    first.write_all(b"x").await.unwrap();
    drop(first);
    let (second, third) = (dial(port).await, dial(port).await);
    for what in [
        "the second waits",
        "the third waits",
        "the second stays",
        "the third stays",
    ] {
        assert_eq!(event_reading(&mut links, 0).await, [], "{what}");
    }
    assert_eq!(next(&mut links).await, [received(b"x")]);
    assert_eq!(next(&mut links).await, [GONE, connected(&second)]);
    assert_eq!(next(&mut links).await, [second_peer(&third, false)]);
}

#[tokio::test]
async fn who_replaces_a_connection_replaces_those_that_wait_too() {
    let (mut links, port) = server(SecondConnection::Replace);
    let mut first = dial(port).await;
    next(&mut links).await;
    first.write_all(b"x").await.unwrap();
    drop(first);
    let second = dial(port).await;
    assert_eq!(event_reading(&mut links, 0).await, [], "the second waits");
    let mut third = dial(port).await;
    assert_eq!(event_reading(&mut links, 0).await, [], "the third waits");
    assert_eq!(next(&mut links).await, [received(b"x")]);
    assert_eq!(next(&mut links).await, [GONE, connected(&second)]);
    let fourth = dial(port).await;
    assert_eq!(
        next(&mut links).await,
        [second_peer(&fourth, true), GONE, connected(&fourth)]
    );
    drop(fourth);
    assert_eq!(next(&mut links).await, [GONE]);
    assert!(is_ended(&mut third).await);
}

// clause: ETH-07
#[tokio::test]
async fn a_host_that_closes_and_comes_back_at_once_is_served() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    assert_eq!(next(&mut links).await, [connected(&host)]);
    for _ in 0..50 {
        host.write_all(b"half a te").await.unwrap();
        drop(host);
        host = dial(port).await;
        let mut inputs = Vec::new();
        while inputs.len() < 3 {
            inputs.extend(next(&mut links).await);
        }
        assert_eq!(inputs, [received(b"half a te"), GONE, connected(&host)]);
    }
}

#[tokio::test]
async fn a_host_that_has_finished_sending_still_gets_its_answer() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    next(&mut links).await;
    host.write_all(b"SU").await.unwrap();
    host.shutdown().await.unwrap();
    assert_eq!(next(&mut links).await, [received(b"SU")]);
    send(&mut links, Port::Ip0, b"FL");
    assert_eq!(next(&mut links).await, [GONE]);
    let mut answer = Vec::new();
    timeout(LONG, host.read_to_end(&mut answer))
        .await
        .unwrap()
        .unwrap();
    assert_eq!(answer, b"FL");
}

#[tokio::test]
async fn a_host_that_has_finished_sending_still_gets_what_the_system_has_not_taken_yet() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    next(&mut links).await;
    host.shutdown().await.unwrap();
    let mut sent = 0;
    while !links.get_mut(Port::Ip0).unwrap().has_unsent() {
        assert_eq!(send(&mut links, Port::Ip0, &[b' '; 65_536]), []);
        sent += 65_536;
    }
    assert_eq!(next(&mut links).await, [GONE]);
    let mut answer = Vec::new();
    timeout(LONG, host.read_to_end(&mut answer))
        .await
        .unwrap()
        .unwrap();
    assert_eq!(answer.len(), sent);
}

#[tokio::test]
async fn a_reset_ends_the_connection_once() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let host = dial(port).await;
    next(&mut links).await;
    // Closing with lingering switched off sends RST.
    socket2::SockRef::from(&host)
        .set_linger(Some(Duration::ZERO))
        .unwrap();
    drop(host);
    assert_eq!(next(&mut links).await, [GONE]);
    let host = dial(port).await;
    assert_eq!(next(&mut links).await, [connected(&host)]);
}

#[tokio::test]
async fn a_peer_that_does_not_read_is_closed_and_never_blocks() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let _host = dial(port).await;
    next(&mut links).await;
    // Ends when the system's buffers and the queue are full; no send waits for the peer.
    let end = async {
        loop {
            let end = send(&mut links, Port::Ip0, &[b' '; 512]);
            if !end.is_empty() {
                return end;
            }
        }
    };
    let unread = Input::Backlogged { port: Port::Ip0 };
    assert_eq!(timeout(LONG, end).await.unwrap(), [unread, GONE]);
    let host = dial(port).await;
    assert_eq!(
        next(&mut links).await,
        [connected(&host)],
        "and its end is not reported again"
    );
}

#[tokio::test]
async fn much_said_at_once_reaches_a_peer_that_reads() {
    const WRITES: usize = 20 * connection::WRITE_QUEUE;
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    next(&mut links).await;
    for _ in 0..WRITES {
        assert_eq!(send(&mut links, Port::Ip0, &[b' '; 12]), []);
    }
    let mut said = vec![0; WRITES * 12];
    timeout(LONG, host.read_exact(&mut said)).await.unwrap().unwrap();
}

// clause: ETH-04 ETH-05
#[tokio::test]
async fn a_client_channel_dials_and_dials_again() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let peer_port = listener.local_addr().unwrap().port();
    let mut links = links(LinkOptions {
        redial: Duration::from_millis(5),
        ..LinkOptions::default()
    });
    let ports = links
        .open(&plan(OpenMode::NotUsed, OpenMode::Client, peer_port))
        .unwrap();
    assert!(ports.is_empty(), "a client channel has no port to announce");
    for _ in 0..3 {
        let (peer, _) = timeout(LONG, listener.accept()).await.unwrap().unwrap();
        let address = peer.local_addr().unwrap().to_string();
        assert_eq!(
            next(&mut links).await,
            [Input::Connected {
                port: Port::Ip1,
                peer: address
            }]
        );
        drop(peer);
        assert_eq!(next(&mut links).await, [Input::Disconnected { port: Port::Ip1 }]);
    }
}

// clause: PAR-FILE-03
#[tokio::test]
async fn opened_again_after_a_power_cycle_the_ports_are_the_same() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    next(&mut links).await;
    assert_eq!(links.close(), [Input::Disconnected { port: Port::Ip0 }]);
    assert!(is_ended(&mut host).await);
    let ports = links.open(&plan(OpenMode::Server, OpenMode::Server, 0)).unwrap();
    assert_eq!(ports[&Port::Ip0], port);
    let host = dial(port).await;
    assert_eq!(next(&mut links).await, [connected(&host)]);
}

/// Whether the peer has ended this connection.
async fn is_ended(host: &mut TcpStream) -> bool {
    matches!(
        timeout(LONG, host.read(&mut [0; 8])).await.unwrap(),
        Ok(0) | Err(_)
    )
}

#[tokio::test]
async fn a_reset_ends_every_connection_and_keeps_the_sockets_that_listen() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let mut host = dial(port).await;
    next(&mut links).await;
    let mut waiting = dial(port).await;
    let plan = plan(OpenMode::Server, OpenMode::NotUsed, 0);
    assert_eq!(links.close_for(&plan), [Input::Disconnected { port: Port::Ip0 }]);
    assert!(is_ended(&mut host).await);
    assert!(is_ended(&mut waiting).await, "had arrived and was not accepted");
    let early = dial(port).await;
    assert_eq!(links.open(&plan).unwrap(), BTreeMap::from([(Port::Ip0, port)]));
    assert_eq!(next(&mut links).await, [connected(&early)]);
}

#[tokio::test]
async fn a_reset_to_other_parameters_closes_the_ports() {
    let (mut links, port) = server(SecondConnection::Refuse);
    let none = plan(OpenMode::NotUsed, OpenMode::NotUsed, 0);
    assert_eq!(links.close_for(&none), []);
    assert!(TcpStream::connect(("127.0.0.1", port)).await.is_err());
    assert_eq!(links.open(&none).unwrap(), BTreeMap::new());
}

#[tokio::test]
async fn when_one_port_cannot_be_had_none_is_open() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let number = taken.local_addr().unwrap().port();
    let mut plan = plan(OpenMode::Server, OpenMode::Server, 0);
    plan.channels[0].own_port = 0;
    plan.channels[1].own_port = number;
    let mut links = Channels::new(
        IpAddr::from([127, 0, 0, 1]),
        Ports::Offset(0),
        None,
        LinkOptions::default(),
    );
    let error = links.open(&plan).unwrap_err();
    assert!(matches!(
        error,
        ChannelError::InUse {
            channel: Port::Ip1,
            ..
        }
    ));
    let text = error.to_string();
    assert!(
        text.contains("Use another `--port-offset` or `--ports auto`"),
        "{text}"
    );
    let address = "127.0.0.1:1000".parse().unwrap();
    let text = ChannelError::InUse {
        channel: Port::Ip0,
        address,
    }
    .to_string();
    assert!(
        text.contains("Use `--port-offset 10000` (ports 11000-11003)"),
        "{text}"
    );
    assert!(links.channels.is_empty());
    plan.channels[1].own_port = 65_535;
    let mut links = Channels::new(
        IpAddr::from([127, 0, 0, 1]),
        Ports::Offset(1),
        None,
        LinkOptions::default(),
    );
    plan.channels[0].own_port = 65_535;
    assert!(matches!(
        links.open(&plan),
        Err(ChannelError::PortRange {
            own: 65_535,
            offset: 1,
            ..
        })
    ));
}
