//! A SCOL channel: the ring buffer between a port and INPUT, and the parsing of values (NPC-01, INP-01 to INP-17, D10).
//!
//! `robot::requests` decides what INPUT does with the values.

use crate::limits::RING_BUFFER;
use crate::options::Malformed;
use crate::prelude::*;
use alloc::collections::VecDeque;
use scol_mini::Number;
use ts3100_proto::text::{CR, LF};

/// The next value in the buffer.
#[derive(Debug, Clone, PartialEq)]
pub enum Datum {
    /// No complete value yet: neither comma nor CR has arrived (INP-16).
    Incomplete,
    Value(Number),
    /// Nothing between two separators; counts as 0 (INP-17).
    Empty,
    /// Not a number; with the number it begins with, or 0 (option `input.malformed`).
    Leading(String, Number),
    /// Not a number.
    Malformed(String),
    /// A number beyond the range of a real.
    OutOfRange(String),
}

/// The receive side of a channel.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Address of the peer, while one is connected.
    peer: Option<String>,
    #[serde(with = "ts3100_proto::serde_latin1")]
    ring: VecDeque<u8>,
    /// The last byte read was a comma: a CR directly after it ends the record without a further value.
    after_comma: bool,
    /// A peer has left since power-on.
    had_peer: bool,
}

impl Channel {
    /// Stores bytes as far as there is room; returns how many were stored. The newest are lost, not the oldest (INP-13).
    pub fn push(&mut self, bytes: &[u8]) -> usize {
        let taken = bytes.len().min(RING_BUFFER.saturating_sub(self.ring.len()));
        self.ring.extend(bytes.iter().take(taken));
        taken
    }

    /// Empties the buffer (BUFFRESET, start from step 1). A CR that ends a record after its last comma may still
    /// arrive; it then counts as no value.
    pub fn clear(&mut self) {
        self.after_comma = self.ring.back().map_or(self.after_comma, |last| *last == b',');
        self.ring.clear();
    }

    /// Sets the peer and drops a record that the previous one began. Returns whether there was a previous one since
    /// power-on.
    pub fn connect_peer(&mut self, peer: String) -> bool {
        let replaced = self.peer.replace(peer).is_some();
        self.after_comma = false;
        self.had_peer || replaced
    }

    /// Address of the peer, while one is connected.
    pub fn peer(&self) -> Option<&str> {
        self.peer.as_deref()
    }

    /// Number of bytes in the buffer.
    pub fn len(&self) -> usize {
        self.ring.len()
    }

    /// The bytes in the buffer, oldest first.
    pub fn bytes(&self) -> Vec<u8> {
        self.ring.iter().copied().collect()
    }

    /// Whether the buffer is empty.
    pub fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    /// The bytes after the last comma or CR, without blanks.
    pub fn partial_value(&self) -> Vec<u8> {
        let rest = self.ring.iter().rev().take_while(|&&byte| !is_separator(byte));
        let mut half: Vec<u8> = rest.copied().filter(|byte| !matches!(byte, b' ' | &LF)).collect();
        half.reverse();
        half
    }

    /// Clears the peer and drops its incomplete last value, so that it does not become part of the next peer's.
    pub fn disconnect_peer(&mut self) {
        self.had_peer |= self.peer.take().is_some();
        // Complete values stay for an INPUT that comes to them later.
        let last = self.ring.iter().rposition(|&byte| is_separator(byte));
        self.ring.truncate(last.map_or(0, |last| last + 1));
    }

    /// Removes the next value from the buffer.
    pub fn take(&mut self, malformed: Malformed) -> Datum {
        // `1,2,` CR has two values. Without this its CR would end a third one, and INPUT would read 0 (INP-17).
        self.skip_record_end();
        let Some(end) = self.ring.iter().position(|&byte| is_separator(byte)) else {
            return Datum::Incomplete;
        };
        let token: Vec<u8> = self.ring.drain(..end).filter(|&byte| byte != LF).collect();
        self.after_comma = self.ring.pop_front() == Some(b',');
        let token = String::from_utf8_lossy(&token);
        parse_datum(token.trim_matches(' '), malformed)
    }

    fn skip_record_end(&mut self) {
        if !self.after_comma {
            return;
        }
        let next = self.ring.iter().position(|&byte| byte != b' ' && byte != LF);
        if let Some(next) = next.filter(|&next| self.ring.get(next) == Some(&CR)) {
            self.ring.drain(..=next);
            self.after_comma = false;
        }
    }
}

fn is_separator(byte: u8) -> bool {
    byte == b',' || byte == CR
}

/// The value of a token. An empty one counts as 0 (INP-17).
fn parse_datum(token: &str, malformed: Malformed) -> Datum {
    if token.is_empty() {
        return Datum::Empty;
    }
    let whole = number(token);
    let value = match (whole, malformed) {
        (Some(value), _) => value,
        (None, Malformed::Alarm) => return Datum::Malformed(String::from(token)),
        (None, Malformed::LeadingNumber) => {
            // The longest beginning counts: `12mm` is 12, `1E3x` is 1000 (INP-14).
            let mut beginnings = (1..=token.len()).rev().filter_map(|end| token.get(..end));
            beginnings.find_map(number).unwrap_or(Number::Integer(0))
        }
    };
    if matches!(value, Number::Real(real) if !real.is_finite()) {
        return Datum::OutOfRange(String::from(token));
    }
    match whole {
        Some(value) => Datum::Value(value),
        None => Datum::Leading(String::from(token), value),
    }
}

/// The number that a token is; an infinite one if it is beyond the range of a real.
fn number(token: &str) -> Option<Number> {
    let is_figure = |byte| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'E' | b'e');
    if !token.bytes().all(is_figure) || !token.bytes().any(|byte| byte.is_ascii_digit()) {
        return None;
    }
    if let Ok(integer) = token.parse::<i32>() {
        return Some(Number::Integer(integer));
    }
    let real = token.parse::<f32>().ok()?;
    // An integer below the range must not be rounded into it.
    let is_integer = !token.bytes().any(|byte| matches!(byte, b'.' | b'E' | b'e'));
    // The upper end needs no such step: 2147483648 is above the range as a real, too.
    let real = match is_integer && real == i32::MIN as f32 {
        true => real.next_down(),
        false => real,
    };
    Some(Number::Real(real))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Number::{Integer, Real};

    fn values(bytes: &[u8]) -> Vec<Datum> {
        let mut channel = Channel::default();
        channel.push(bytes);
        let mut found = Vec::new();
        loop {
            match channel.take(Malformed::Alarm) {
                Datum::Incomplete => return found,
                datum => found.push(datum),
            }
        }
    }

    fn numbers(bytes: &[u8]) -> Vec<Number> {
        values(bytes)
            .into_iter()
            .map(|datum| match datum {
                Datum::Value(number) | Datum::Leading(_, number) => number,
                Datum::Empty => Integer(0),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    // clause: NPC-01 INP-03 INP-04 INP-16 INP-17
    #[test]
    fn values_are_cut_at_comma_and_cr() {
        assert_eq!(numbers(b"1,2,3\r"), [Integer(1), Integer(2), Integer(3)]);
        assert_eq!(numbers(b"-12,3.25\r"), [Integer(-12), Real(3.25)]);
        assert_eq!(numbers(b" 1 , 2\r\n 3\r\n"), [Integer(1), Integer(2), Integer(3)]);
        assert_eq!(numbers(b"1,,3\r"), [Integer(1), Integer(0), Integer(3)]);
        assert_eq!(numbers(b"12"), []);
    }

    // clause: NPC-01
    #[test]
    fn a_comma_before_cr_adds_no_value() {
        assert_eq!(numbers(b"1,2,\r3\r"), [Integer(1), Integer(2), Integer(3)]);
        let mut channel = Channel::default();
        channel.push(b"1,");
        assert_eq!(channel.take(Malformed::Alarm), Datum::Value(Integer(1)));
        assert_eq!(channel.take(Malformed::Alarm), Datum::Incomplete);
        channel.push(b"\r\n2\r");
        assert_eq!(channel.take(Malformed::Alarm), Datum::Value(Integer(2)));
    }

    // clause: INP-14
    #[test]
    fn what_is_no_number_is_reported_or_read_as_far_as_it_goes() {
        assert_eq!(values(b"ABC\r"), [Datum::Malformed(String::from("ABC"))]);
        let mut channel = Channel::default();
        channel.push(b"ABC,12mm,-3.5x,1e,--\r");
        for (token, number) in [
            ("ABC", Integer(0)),
            ("12mm", Integer(12)),
            ("-3.5x", Real(-3.5)),
            ("1e", Integer(1)),
            ("--", Integer(0)),
        ] {
            let expected = Datum::Leading(String::from(token), number);
            assert_eq!(channel.take(Malformed::LeadingNumber), expected);
        }
    }

    // clause: INP-03 INP-14
    #[test]
    fn a_number_beyond_its_range_is_one_number_out_of_range() {
        for malformed in [Malformed::Alarm, Malformed::LeadingNumber] {
            for token in ["1E400", "-1e39", "1E400mm"] {
                if malformed == Malformed::Alarm && token.ends_with('m') {
                    continue;
                }
                let mut channel = Channel::default();
                channel.push(token.as_bytes());
                channel.push(b",5\r");
                assert_eq!(channel.take(malformed), Datum::OutOfRange(String::from(token)));
                assert_eq!(channel.take(malformed), Datum::Value(Integer(5)));
            }
        }
        let beyond = |token: &str| match numbers(token.as_bytes())[..] {
            [Real(value)] => f64::from(value),
            ref other => panic!("{other:?}"),
        };
        assert!(beyond("2147483648\r") > f64::from(i32::MAX));
        assert!(beyond("-2147483649\r") < f64::from(i32::MIN));
        assert!(beyond("-2147483776\r") < f64::from(i32::MIN));
        assert_eq!(beyond("-2147483648.0\r"), f64::from(i32::MIN));
        assert_eq!(numbers(b"-2147483648\r"), [Integer(i32::MIN)]);
    }

    // clause: INP-13
    #[test]
    fn the_ring_holds_256_bytes_and_keeps_the_oldest() {
        let mut channel = Channel::default();
        assert_eq!(channel.push(&[b'1'; 300]), 256);
        assert_eq!(channel.push(b","), 0);
        assert_eq!(channel.len(), 256);
    }

    // clause: BUF-01
    #[test]
    fn the_end_of_a_cleared_record_is_no_value() {
        let mut channel = Channel::default();
        channel.push(b"1,2,");
        assert_eq!(channel.take(Malformed::Alarm), Datum::Value(Integer(1)));
        channel.clear();
        channel.push(b"\r9\r");
        assert_eq!(channel.take(Malformed::Alarm), Datum::Value(Integer(9)));
    }

    #[test]
    fn half_a_value_of_a_lost_peer_is_dropped() {
        let mut channel = Channel::default();
        channel.push(b"1,2\r34");
        channel.disconnect_peer();
        channel.push(b"5\r");
        for expected in [1, 2, 5] {
            assert_eq!(channel.take(Malformed::Alarm), Datum::Value(Integer(expected)));
        }
    }
}
