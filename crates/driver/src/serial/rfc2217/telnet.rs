//! The Telnet stream (RFC 854): splits it into data, negotiations and subnegotiations, independent of how the stream is
//! cut, and encodes them. Which options are accepted is decided in [`super`].

/// "Interpret as command": begins every command; doubled, it is a data byte.
pub const IAC: u8 = 255;
/// The sender asks the receiver to use an option.
pub const DO: u8 = 253;
/// The sender asks the receiver not to.
pub const DONT: u8 = 254;
/// The sender wants to use an option.
pub const WILL: u8 = 251;
/// The sender does not.
pub const WONT: u8 = 252;
/// Begins a subnegotiation.
const SB: u8 = 250;
/// Ends it.
const SE: u8 = 240;

/// Longest subnegotiation that is kept, in bytes; the longest one of RFC 2217 is a signature.
const MAX_SUBNEGOTIATION: usize = 256;

/// Part of the stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Telnet {
    /// Bytes for the line.
    Data(Vec<u8>),
    /// `DO`, `DONT`, `WILL` or `WONT` and its option.
    Negotiation(u8, u8),
    /// An option and what is said about it.
    Subnegotiation(u8, Vec<u8>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum State {
    #[default]
    Data,
    Command,
    Negotiation(u8),
    Subnegotiation,
    SubnegotiationCommand,
}

/// Cuts a stream.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    state: State,
    subnegotiation: Vec<u8>,
    /// More came than is kept: it is given up.
    too_long: bool,
}

impl Decoder {
    /// Decodes bytes; returns the parts that they complete, in order.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Telnet> {
        let mut found = Vec::new();
        for &byte in bytes {
            self.state = match (self.state, byte) {
                (State::Data, IAC) => State::Command,
                (State::Data, byte) => {
                    put(&mut found, byte);
                    State::Data
                }
                (State::Command, IAC) => {
                    put(&mut found, IAC);
                    State::Data
                }
                (State::Negotiation(verb), option) => {
                    found.push(Telnet::Negotiation(verb, option));
                    State::Data
                }
                (State::Subnegotiation, IAC) => State::SubnegotiationCommand,
                (State::SubnegotiationCommand, SE) => {
                    found.extend(self.subnegotiated());
                    State::Data
                }
                (State::Subnegotiation, byte) | (State::SubnegotiationCommand, byte @ IAC) => {
                    self.keep(byte);
                    State::Subnegotiation
                }
                // After a subnegotiation that was not ended, what follows is a command again.
                (State::Command | State::SubnegotiationCommand, DO | DONT | WILL | WONT) => {
                    State::Negotiation(byte)
                }
                (State::Command | State::SubnegotiationCommand, SB) => {
                    self.subnegotiation.clear();
                    self.too_long = false;
                    State::Subnegotiation
                }
                // NOP, AYT and the like mean nothing to a line.
                (State::Command | State::SubnegotiationCommand, _) => State::Data,
            };
        }
        found
    }

    fn keep(&mut self, byte: u8) {
        if self.subnegotiation.len() < MAX_SUBNEGOTIATION {
            self.subnegotiation.push(byte);
        } else {
            self.too_long = true;
        }
    }

    fn subnegotiated(&mut self) -> Option<Telnet> {
        let (option, data) = self.subnegotiation.split_first().filter(|_| !self.too_long)?;
        Some(Telnet::Subnegotiation(*option, data.to_vec()))
    }
}

fn put(found: &mut Vec<Telnet>, byte: u8) {
    match found.last_mut() {
        Some(Telnet::Data(bytes)) => bytes.push(byte),
        _ => found.push(Telnet::Data(vec![byte])),
    }
}

/// Bytes as data of a stream.
pub fn escape(bytes: &[u8], out: &mut Vec<u8>) {
    for &byte in bytes {
        out.push(byte);
        if byte == IAC {
            out.push(IAC);
        }
    }
}

/// A negotiation.
pub fn negotiate(verb: u8, option: u8, out: &mut Vec<u8>) {
    out.extend([IAC, verb, option]);
}

/// A subnegotiation.
pub fn subnegotiate(option: u8, data: &[u8], out: &mut Vec<u8>) {
    out.extend([IAC, SB, option]);
    escape(data, out);
    out.extend([IAC, SE]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream() -> (Vec<u8>, Vec<Telnet>) {
        let mut bytes = b"ab".to_vec();
        negotiate(WILL, 44, &mut bytes);
        escape(&[1, IAC, 2], &mut bytes);
        subnegotiate(44, &[1, 0, 0, IAC, IAC], &mut bytes);
        bytes.extend([IAC, 241]);
        bytes.extend(b"c");
        let found = vec![
            Telnet::Data(b"ab".to_vec()),
            Telnet::Negotiation(WILL, 44),
            Telnet::Data(vec![1, IAC, 2]),
            Telnet::Subnegotiation(44, vec![1, 0, 0, IAC, IAC]),
            Telnet::Data(b"c".to_vec()),
        ];
        (bytes, found)
    }

    /// Neighbouring data is one.
    fn joined(parts: impl IntoIterator<Item = Telnet>) -> Vec<Telnet> {
        let mut found: Vec<Telnet> = Vec::new();
        for part in parts {
            match (found.last_mut(), part) {
                (Some(Telnet::Data(bytes)), Telnet::Data(more)) => bytes.extend(more),
                (_, part) => found.push(part),
            }
        }
        found
    }

    #[test]
    fn every_split_of_a_stream_gives_the_same() {
        let (bytes, expected) = stream();
        for first in 0..=bytes.len() {
            for second in first..=bytes.len() {
                let mut decoder = Decoder::default();
                let parts = [&bytes[..first], &bytes[first..second], &bytes[second..]];
                let found = joined(parts.into_iter().flat_map(|part| decoder.push(part)));
                assert_eq!(found, expected, "{first} {second}");
            }
        }
    }

    #[test]
    fn a_subnegotiation_without_end_is_bounded_and_dropped() {
        let mut decoder = Decoder::default();
        assert!(decoder.push(&[IAC, SB, 44]).is_empty());
        assert!(decoder.push(&[7; 100_000]).is_empty());
        assert!(decoder.subnegotiation.capacity() <= 2 * MAX_SUBNEGOTIATION);
        assert!(decoder.push(&[IAC, SE]).is_empty());
        assert_eq!(decoder.push(b"x"), [Telnet::Data(b"x".to_vec())]);
    }

    #[test]
    fn no_stream_makes_it_lose_its_way() {
        // Every pair of command bytes in front: data behind a whole subnegotiation is data.
        for first in 240..=255_u8 {
            for second in 240..=255_u8 {
                let mut decoder = Decoder::default();
                decoder.push(&[IAC, first, second, 0]);
                let mut task = Vec::new();
                task.extend([IAC, SE]);
                subnegotiate(1, b"", &mut task);
                decoder.push(&task);
                assert_eq!(
                    decoder.push(b"x"),
                    [Telnet::Data(b"x".to_vec())],
                    "{first} {second}"
                );
            }
        }
    }
}
