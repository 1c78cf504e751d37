//! Portions of received bytes: each turn of the driver serves at most one portion of one port, so a host that sends without
//! pause delays only itself. Sockets and terminals are read by [`crate::tcp`] and [`crate::serial`].

use tracing::{debug, trace};
use ts3100_controller::port::Port;
use ts3100_proto::escape::Escaped;
use ts3100_proto::text::ETX;

/// Texts in a portion. A host that waits for its answers never sends as many at once, and they take well under
/// a millisecond.
const PORTION_TEXTS: usize = 8;
/// Bytes in a portion on a channel without texts: four times its receive buffer.
const PORTION_BYTES: usize = 1_024;

/// Takes the first portion out of `bytes`.
pub(crate) fn take_portion(port: Port, bytes: &mut Vec<u8>) -> Vec<u8> {
    let end = if port.protocol().is_some() {
        let mut ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == ETX);
        ends.nth(PORTION_TEXTS - 1).map_or(bytes.len(), |(at, _)| at + 1)
    } else {
        PORTION_BYTES.min(bytes.len())
    };
    let rest = bytes.split_off(end);
    std::mem::replace(bytes, rest)
}

/// Logs bytes of a port. On a channel without texts nothing else is logged, so there the level is higher.
pub(crate) fn log_bytes(port: Port, direction: char, bytes: &[u8]) {
    let text = Escaped::for_reading(bytes);
    if port.protocol().is_some() {
        trace!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    } else {
        debug!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_served_at_one_turn_is_bounded_and_nothing_is_lost_or_out_of_order() {
        for (port, block, most) in [
            (Port::Ip0, &b"\x02SU\r\x03"[..], PORTION_TEXTS * 5),
            (Port::Host, b"SU\r\x03", PORTION_TEXTS * 4),
            (Port::Ip1, b"1\r", PORTION_BYTES),
            (Port::Com1, b"\x03", PORTION_BYTES),
        ] {
            let sent = block.repeat(1_000);
            let mut rest = sent.clone();
            let mut portions = Vec::new();
            while !rest.is_empty() {
                portions.push(take_portion(port, &mut rest));
            }
            assert!(portions.iter().all(|portion| (1..=most).contains(&portion.len())));
            assert_eq!(portions.concat(), sent, "{port}");
        }
        let mut unfinished = vec![b'A'; 4_096];
        assert_eq!(take_portion(Port::Ip0, &mut unfinished).len(), 4_096);
        assert!(unfinished.is_empty());
    }
}
