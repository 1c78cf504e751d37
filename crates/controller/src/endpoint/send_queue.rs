//! The queue of bytes that leave later: texts that a fault or a variation delays, cuts or holds back, in order for each port.
//!
//! Without faults and variation the queue stays empty. `sending` fills it.

use crate::limits::MAX_SEND;
use crate::port::Port;
use crate::segment::{Departure, Segment};
use crate::time::Time;
use alloc::collections::{BTreeMap, VecDeque};

/// Segments that wait to be sent, by port.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SendQueue {
    queues: BTreeMap<Port, VecDeque<(Time, Departure)>>,
}

impl SendQueue {
    /// When the next segment is due.
    pub fn deadline(&self) -> Option<Time> {
        let fronts = self.queues.values().filter_map(VecDeque::front);
        fronts.map(|(due, _)| *due).min()
    }

    /// Whether a segment waits on this port.
    pub fn is_busy(&self, port: Port) -> bool {
        self.queues.get(&port).is_some_and(|queue| !queue.is_empty())
    }

    /// Drops everything that waits on this port.
    pub fn clear(&mut self, port: Port) {
        self.queues.remove(&port);
    }

    /// Number of bytes and of segments that wait on a port.
    pub(crate) fn waiting(&self, port: Port) -> (usize, usize) {
        let queue = self.queues.get(&port).into_iter().flatten();
        queue.fold((0, 0), |(bytes, segments), (_, what)| {
            (bytes + what.length(), segments + 1)
        })
    }

    /// Appends a segment; returns when it is due.
    pub(super) fn push(&mut self, port: Port, earliest: Time, segment: Segment) -> Time {
        let queue = self.queues.entry(port).or_default();
        let Segment { delay, departure } = segment;
        if let (Some((_, Departure::Held(held))), Departure::Bytes(bytes)) = (queue.back(), &departure)
            && held.len() + bytes.len() <= MAX_SEND
        {
            // Bytes that were held back are sent together with these, before them.
            let together = [held.as_ref(), bytes].concat();
            queue.pop_back();
            queue.push_back((earliest + delay, Departure::Bytes(together.into())));
            return earliest + delay;
        }
        // Held bytes that do not fit into one write are sent now.
        if let Some((due, Departure::Held(_))) = queue.back_mut() {
            *due = earliest;
        }
        // A segment waits for the one before it: the port is one stream, and a short delay must not overtake a long
        // one.
        let from = queue.back().map_or(earliest, |(due, _)| earliest.max(*due));
        queue.push_back((from + delay, departure));
        from + delay
    }

    /// Takes the next segment that is due, from the port with the earliest.
    pub(super) fn take_due(&mut self, now: Time) -> Option<(Port, Departure)> {
        let queues = self.queues.iter();
        let due = queues.filter_map(|(port, queue)| Some((queue.front()?.0, *port)));
        // Of segments due at one moment the lower port goes first, so that a run repeats byte for byte.
        let (_, port) = due.filter(|(due, _)| *due <= now).min()?;
        let (_, what) = self.queues.get_mut(&port)?.pop_front()?;
        Some((port, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::DisconnectMode;
    use crate::prelude::*;
    use bytes::Bytes;
    use core::time::Duration;

    fn bytes(text: &[u8]) -> Departure {
        Departure::Bytes(Bytes::copy_from_slice(text))
    }

    #[test]
    fn a_port_keeps_its_order_and_another_port_does_not_wait_for_it() {
        let mut queue = SendQueue::default();
        let (now, ms) = (Time::ZERO, Duration::from_millis);
        assert_eq!(
            queue.push(Port::Ip0, now, Segment::after(ms(30), bytes(b"a"))),
            Time::from_millis(30)
        );
        assert_eq!(
            queue.push(Port::Ip0, now, Segment::bytes(b"b".to_vec())),
            Time::from_millis(30)
        );
        queue.push(Port::Ip1, now, Segment::after(ms(10), bytes(b"c")));
        assert_eq!(queue.deadline(), Some(Time::from_millis(10)));
        assert_eq!(
            queue.take_due(Time::from_millis(29)),
            Some((Port::Ip1, bytes(b"c")))
        );
        assert_eq!(queue.take_due(Time::from_millis(29)), None);
        let rest: Vec<_> = core::iter::from_fn(|| queue.take_due(Time::from_millis(30))).collect();
        assert_eq!(rest, [(Port::Ip0, bytes(b"a")), (Port::Ip0, bytes(b"b"))]);
    }

    #[test]
    fn what_is_held_leaves_when_the_delay_of_the_next_has_passed() {
        let (mut queue, ms) = (SendQueue::default(), Duration::from_millis);
        let held = Departure::Held(Bytes::from_static(b"h"));
        queue.push(Port::Ip0, Time::ZERO, Segment::after(ms(1_000), held));
        let due = queue.push(
            Port::Ip0,
            Time::from_millis(5),
            Segment::after(ms(30), bytes(b"n")),
        );
        assert_eq!(due, Time::from_millis(35));
        assert_eq!(queue.take_due(Time::from_millis(34)), None);
        assert_eq!(queue.take_due(due), Some((Port::Ip0, bytes(b"hn"))));
    }

    #[test]
    fn what_is_held_leaves_with_the_next_or_alone_or_before_what_is_too_much() {
        let held = |length: usize| {
            Segment::after(
                Duration::from_secs(1),
                Departure::Held([b'h'].repeat(length).into()),
            )
        };
        let mut queue = SendQueue::default();
        queue.push(Port::Ip0, Time::ZERO, held(1));
        assert_eq!(queue.take_due(Time::from_millis(999)), None);
        queue.push(Port::Ip0, Time::from_millis(5), Segment::bytes(b"n".to_vec()));
        assert_eq!(
            queue.take_due(Time::from_millis(5)),
            Some((Port::Ip0, bytes(b"hn")))
        );
        queue.push(Port::Ip0, Time::ZERO, held(MAX_SEND));
        queue.push(Port::Ip0, Time::from_millis(5), Segment::bytes(b"n".to_vec()));
        let alone = queue.take_due(Time::from_millis(5));
        assert!(matches!(alone, Some((_, Departure::Held(held))) if held.len() == MAX_SEND));
        assert_eq!(
            queue.take_due(Time::from_millis(5)),
            Some((Port::Ip0, bytes(b"n")))
        );
        queue.push(Port::Ip0, Time::ZERO, held(1));
        queue.push(
            Port::Ip0,
            Time::from_millis(5),
            Segment::after(Duration::ZERO, Departure::Disconnect(DisconnectMode::Close)),
        );
        assert_eq!(queue.waiting(Port::Ip0), (1, 2));
        queue.clear(Port::Ip0);
        assert!(!queue.is_busy(Port::Ip0));
    }
}
