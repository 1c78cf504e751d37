//! Tests of the capture, byte by byte: blocks, times, sequence numbers, checksums.

use super::super::tests::sample;
use super::*;
use frame::checksum;
use ts3100_controller::{Action, PanelAction, Time};

struct Packet {
    interface: u32,
    micros: u64,
    data: Vec<u8>,
    /// Code and value of each option.
    options: Vec<(u16, Vec<u8>)>,
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn half(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())
}

/// Kind and body of each block; both lengths have to agree.
fn blocks(mut bytes: &[u8]) -> Vec<(u32, Vec<u8>)> {
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let (kind, length) = (word(bytes, 0), word(bytes, 4) as usize);
        assert_eq!(length % 4, 0);
        assert_eq!(word(bytes, length - 4) as usize, length);
        found.push((kind, bytes[8..length - 4].to_vec()));
        bytes = &bytes[length..];
    }
    found
}

fn options(mut bytes: &[u8]) -> Vec<(u16, Vec<u8>)> {
    let mut found = Vec::new();
    loop {
        let (code, length) = (half(bytes, 0), half(bytes, 2) as usize);
        if code == 0 {
            assert_eq!(bytes.len(), 4);
            return found;
        }
        found.push((code, bytes[4..4 + length].to_vec()));
        bytes = &bytes[4 + length.next_multiple_of(4)..];
    }
}

fn packet(body: &[u8]) -> Packet {
    let length = word(body, 12) as usize;
    assert_eq!(word(body, 16) as usize, length);
    Packet {
        interface: word(body, 0),
        micros: u64::from(word(body, 4)) << 32 | u64::from(word(body, 8)),
        data: body[20..20 + length].to_vec(),
        options: options(&body[20 + length.next_multiple_of(4)..]),
    }
}

fn capture(base: Duration, header: &Header, records: &[Record]) -> Vec<u8> {
    let (mut writer, mut out) = (CaptureWriter::new(base), Vec::new());
    writer.header(header, &mut out);
    records.iter().for_each(|record| writer.record(record, &mut out));
    out
}

fn packets(records: &[Record]) -> Vec<Packet> {
    let out = capture(Duration::ZERO, &Header::default(), records);
    let all = blocks(&out);
    all.iter().skip(5).map(|(_, body)| packet(body)).collect()
}

fn at(millis: u64, what: RecordKind) -> Record {
    Record {
        at: Time::from_millis(millis),
        kind: what,
    }
}

fn from_host(port: Port, bytes: &[u8]) -> RecordKind {
    RecordKind::FromHost {
        line: PeerId::first(port),
        bytes: bytes.to_vec().into(),
    }
}

fn from_robot(port: Port, bytes: &[u8]) -> RecordKind {
    RecordKind::FromRobot {
        line: PeerId::first(port),
        bytes: bytes.to_vec().into(),
    }
}

#[test]
fn the_section_and_its_interfaces_come_first() {
    let (header, _) = sample();
    let all = blocks(&capture(Duration::ZERO, &header, &[]));
    let kinds: Vec<u32> = all.iter().map(|(kind, _)| *kind).collect();
    assert_eq!(kinds, [0x0A0D_0D0A, 1, 1, 1, 1]);
    let section = &all[0].1;
    assert_eq!(word(section, 0), 0x1A2B_3C4D);
    assert_eq!((half(section, 4), half(section, 6)), (1, 0));
    assert_eq!(section[8..16], [0xFF; 8]);
    let told = options(&section[16..]);
    assert_eq!(told[0], (4, b"observed, a test".to_vec()));
    assert_eq!(told[1].1, b"dialect=manual set=text.stx=required select=A");
    for ((_, body), (link, name, _)) in all[1..].iter().zip(INTERFACES) {
        assert_eq!(half(body, 0), link);
        let told = options(&body[8..]);
        assert_eq!(told[0], (2, name.as_bytes().to_vec()));
        assert_eq!(told[2], (9, vec![6]));
    }
}

/// Flags, whether from the controller, sequence number, acknowledged, data bytes; checksums have to be right.
fn segment(packet: &Packet) -> (u8, bool, u32, u32, usize) {
    let ip = &packet.data[14..];
    assert_eq!(checksum(&ip[..20]), 0, "header of IP");
    assert_eq!(usize::from(u16::from_be_bytes([ip[2], ip[3]])), ip.len());
    let tcp = &ip[20..];
    let length = u16::try_from(tcp.len()).unwrap().to_be_bytes();
    let pseudo = [&ip[12..20], &[0, 6], &length, tcp].concat();
    assert_eq!(checksum(&pseudo), 0, "segment");
    let big = |at: usize| u32::from_be_bytes(tcp[at..at + 4].try_into().unwrap());
    let from_robot = ip[12..16] == [192, 0, 2, 1];
    let ports = (
        u16::from_be_bytes([tcp[0], tcp[1]]),
        u16::from_be_bytes([tcp[2], tcp[3]]),
    );
    assert_eq!(
        ports,
        if from_robot {
            (1_001, 49_152)
        } else {
            (49_152, 1_001)
        }
    );
    let flag = packet.options.iter().find(|(code, _)| *code == 2).unwrap();
    assert_eq!(flag.1, [if from_robot { 2 } else { 1 }, 0, 0, 0]);
    (tcp[13], from_robot, big(4), big(8), tcp.len() - 20)
}

#[test]
fn a_connection_is_tcp_with_right_numbers_and_checksums() {
    let line = PeerId::first(Port::Ip1);
    let records = [
        at(
            1,
            RecordKind::Connected {
                line,
                peer: "10.0.0.9".to_owned(),
            },
        ),
        at(2, from_host(Port::Ip1, b"7\r")),
        at(3, from_robot(Port::Ip1, &[b'A'; MSS + 5])),
        at(
            4,
            RecordKind::Ended {
                line,
                by: Side::Host,
                how: EndReason::Closed,
            },
        ),
        at(
            5,
            RecordKind::Ended {
                line,
                by: Side::Robot,
                how: EndReason::Closed,
            },
        ),
    ];
    let all = packets(&records);
    let seen: Vec<_> = all.iter().map(segment).collect();
    let robot_end = 1_001 + 1_465;
    assert_eq!(
        seen,
        [
            (SYN, false, 1_000, 0, 0),
            (SYN | ACK, true, 1_000, 1_001, 0),
            (ACK, false, 1_001, 1_001, 0),
            (PSH | ACK, false, 1_001, 1_001, 2),
            (PSH | ACK, true, 1_001, 1_003, 1_460),
            (PSH | ACK, true, 2_461, 1_003, 5),
            (FIN | ACK, false, 1_003, robot_end, 0),
            (ACK, true, robot_end, 1_004, 0),
            (FIN | ACK, true, robot_end, 1_004, 0),
            (ACK, false, 1_004, robot_end + 1, 0),
        ]
    );
    assert_eq!(all[0].options[0], (1, b"IP1: 10.0.0.9".to_vec()));
    assert_eq!(all[3].micros, 2_000);
    assert!(all.iter().all(|packet| packet.interface == 0));
}

#[test]
fn serial_ports_and_the_panel_have_interfaces_of_their_own() {
    let all = packets(&[
        at(1, from_host(Port::Host, b"\x02SO\r\x03")),
        at(2, from_robot(Port::Com1, b"REQ\r")),
        at(
            3,
            RecordKind::Action(Action::Panel(PanelAction::EmergencyStop(true))),
        ),
    ]);
    let seen: Vec<_> = all
        .iter()
        .map(|packet| (packet.interface, packet.data.as_slice(), packet.options[0].1[0]))
        .collect();
    assert_eq!(
        seen,
        [
            (1, &b"\x02SO\r\x03"[..], 1),
            (2, b"REQ\r", 2),
            (3, b"emergency-stop press", 1),
        ]
    );
}

#[test]
fn times_begin_at_the_base_and_use_both_halves() {
    let base = Duration::from_secs(1_800_000_000);
    let out = capture(base, &Header::default(), &[at(5, from_host(Port::Host, b"x"))]);
    let last = packet(&blocks(&out).last().unwrap().1);
    assert_eq!(last.micros, 1_800_000_000_005_000);
}

#[test]
fn a_reset_ends_a_connection_and_the_next_has_a_port_of_its_own() {
    let line = PeerId::first(Port::Ip0);
    let come = || RecordKind::Connected {
        line,
        peer: String::new(),
    };
    let reset = RecordKind::Ended {
        line,
        by: Side::Host,
        how: EndReason::Reset,
    };
    let all = packets(&[
        at(1, come()),
        at(2, reset),
        at(3, come()),
        at(4, from_host(Port::Ip0, b"x")),
    ]);
    let tcp = |index: usize| &all[index].data[34..];
    assert_eq!(tcp(3)[13], RST | ACK);
    assert_eq!(u16::from_be_bytes([tcp(0)[0], tcp(0)[1]]), 49_152);
    assert_eq!(u16::from_be_bytes([tcp(4)[0], tcp(4)[1]]), 49_153);
    assert_eq!(all.len(), 8);
}

#[test]
fn everything_a_transcript_can_hold_makes_whole_blocks() {
    let (header, records) = sample();
    let all = blocks(&capture(Duration::ZERO, &header, &records));
    assert!(all.len() > records.len());
}

#[test]
fn packets_continue_from_the_time_at_which_a_recording_begins() {
    let begin = RecordKind::Link(LinkRecord::Begin {
        at: Time::from_millis(12_000),
        connected: [Port::Ip0].into(),
        snapshot: "{}".to_owned(),
    });
    let all = packets(&[at(0, begin), at(12_100, from_host(Port::Host, b"a"))]);
    assert_eq!(all[0].data, b"begin 12000000us");
    assert_eq!(all[1].micros, 12_100_000);
}

#[test]
fn packets_stay_in_order_when_a_snapshot_moves_time_back() {
    let restored = RecordKind::Link(LinkRecord::Restored {
        at: Time::from_millis(3),
        snapshot: "{}".to_owned(),
    });
    let reset = RecordKind::Link(LinkRecord::Reset { calendar: None });
    let all = packets(&[
        at(10, from_host(Port::Host, b"a")),
        at(20, restored),
        at(4, from_host(Port::Host, b"b")),
        at(5, reset),
        at(0, from_host(Port::Host, b"c")),
    ]);
    let times: Vec<u64> = all.iter().map(|packet| packet.micros).collect();
    assert_eq!(times, [10_000, 20_000, 21_000, 22_000, 22_000]);
    assert_eq!(all[1].data, b"restore 3000us");
}
