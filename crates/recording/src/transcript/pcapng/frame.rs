//! Synthetic Ethernet, IPv4 and TCP around the bytes of a connection, with sequence numbers and checksums as in a real
//! capture. The addresses are reserved for documentation; the controller's ports are those of the manual (ETH-05).

use super::super::Side;
use ts3100_controller::Port;

/// TCP flags.
pub(super) const FIN: u8 = 0x01;
pub(super) const SYN: u8 = 0x02;
pub(super) const RST: u8 = 0x04;
pub(super) const PSH: u8 = 0x08;
pub(super) const ACK: u8 = 0x10;
/// Data bytes of a segment.
pub(super) const MSS: usize = 1_460;

/// Port of IP0; the others follow (ETH-05).
const FIRST_PORT: u16 = 1_000;
/// First port of hosts; each connection takes the next, and the numbers wrap around.
const FIRST_HOST_PORT: u16 = 49_152;
const HOST_PORTS: u16 = u16::MAX - FIRST_HOST_PORT;
/// Sequence number of a SYN of either side.
const FIRST_SEQUENCE: u32 = 1_000;
const IPV4_TYPE: u16 = 0x0800;
const TCP: u8 = 6;
const IP_HEADER: usize = 20;
const TCP_HEADER: usize = 20;
const HOPS: u8 = 64;
const WINDOW: u16 = u16::MAX;
const DO_NOT_FRAGMENT: u16 = 0x4000;

/// One end of a connection.
#[derive(Debug, Clone, Copy)]
struct End {
    mac: [u8; 6],
    address: [u8; 4],
    port: u16,
    /// Next sequence number.
    sequence: u32,
}

impl End {
    /// The end whose addresses have this number: the controller is 192.0.2.1, every host 192.0.2.2.
    const fn new(number: u8, port: u16) -> End {
        End {
            mac: [2, 0, 0, 0, 0, number],
            address: [192, 0, 2, number],
            port,
            sequence: FIRST_SEQUENCE,
        }
    }
}

/// A connection as its segments see it.
#[derive(Debug, Clone)]
pub(super) struct Flow {
    robot: End,
    host: End,
}

impl Flow {
    /// A connection to a channel, the `number`th of the transcript.
    pub(super) fn new(port: Port, number: u16) -> Flow {
        let channel = port.ethernet_index().and_then(|index| u16::try_from(index).ok());
        Flow {
            robot: End::new(1, FIRST_PORT + channel.unwrap_or(0)),
            host: End::new(2, FIRST_HOST_PORT + number % HOST_PORTS),
        }
    }

    /// The next frame of one side. `data` has at most [`MSS`] bytes.
    pub(super) fn frame(&mut self, by: Side, flags: u8, data: &[u8], identification: u16) -> Vec<u8> {
        let (from, to) = match by {
            Side::Host => (&mut self.host, self.robot),
            Side::Robot => (&mut self.robot, self.host),
        };
        let segment = segment(*from, to, flags, data);
        let length = u32::try_from(data.len()).unwrap_or(0);
        let advance = length + u32::from(flags & (SYN | FIN) != 0);
        let mut frame = Vec::with_capacity(14 + IP_HEADER + segment.len());
        frame.extend(to.mac);
        frame.extend(from.mac);
        frame.extend(IPV4_TYPE.to_be_bytes());
        frame.extend(packet_header(*from, to, segment.len(), identification));
        frame.extend(segment);
        from.sequence = from.sequence.wrapping_add(advance);
        frame
    }
}

fn segment(from: End, to: End, flags: u8, data: &[u8]) -> Vec<u8> {
    let acknowledged = if flags & ACK == 0 { 0 } else { to.sequence };
    let mut segment = Vec::with_capacity(TCP_HEADER + data.len());
    segment.extend(from.port.to_be_bytes());
    segment.extend(to.port.to_be_bytes());
    segment.extend(from.sequence.to_be_bytes());
    segment.extend(acknowledged.to_be_bytes());
    // Five words of header, no options.
    segment.extend([5 << 4, flags]);
    segment.extend(WINDOW.to_be_bytes());
    segment.extend([0; 4]);
    segment.extend_from_slice(data);
    let length = u16::try_from(segment.len()).unwrap_or(u16::MAX).to_be_bytes();
    let pseudo = [&from.address, &to.address, &[0, TCP][..], &length, &segment].concat();
    put(&mut segment, 16, checksum(&pseudo));
    segment
}

fn packet_header(from: End, to: End, length: usize, identification: u16) -> Vec<u8> {
    let total = u16::try_from(IP_HEADER + length).unwrap_or(u16::MAX);
    let mut header = vec![0x45, 0];
    header.extend(total.to_be_bytes());
    header.extend(identification.to_be_bytes());
    header.extend(DO_NOT_FRAGMENT.to_be_bytes());
    header.extend([HOPS, TCP, 0, 0]);
    header.extend(from.address);
    header.extend(to.address);
    let sum = checksum(&header);
    put(&mut header, 10, sum);
    header
}

fn put(bytes: &mut [u8], at: usize, word: u16) {
    if let Some(place) = bytes.get_mut(at..at + 2) {
        place.copy_from_slice(&word.to_be_bytes());
    }
}

/// The sum of the Internet protocols (RFC 1071).
pub(super) fn checksum(bytes: &[u8]) -> u16 {
    let (pairs, odd) = bytes.as_chunks::<2>();
    let words = pairs.iter().map(|pair| u32::from(u16::from_be_bytes(*pair)));
    let last = odd.first().map_or(0, |byte| u32::from(*byte) << 8);
    let mut sum = words.sum::<u32>() + last;
    while sum > 0xFFFF {
        sum = (sum & 0xFFFF) + (sum >> 16);
    }
    !u16::try_from(sum).unwrap_or(0)
}
