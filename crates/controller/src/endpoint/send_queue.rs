//! What is sent later: texts that a fault or a variation delays, cuts or holds back, in order for each port.
//!
//! Without faults and variation the queue stays empty. `sending` fills it.

use crate::endpoint::Endpoints;
use crate::faults::kind::{Departure, Segment};
use crate::limits::{MAX_QUEUED_BYTES, MAX_QUEUED_SEGMENTS, MAX_SEND};
use crate::output::{Event, Output};
use crate::port::Port;
use crate::robot::Robot;
use crate::time::Time;
use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

/// What waits to be sent, by port.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct SendQueue {
    queues: BTreeMap<Port, VecDeque<(Time, Departure)>>,
}

impl SendQueue {
    /// When the next segment is due.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        let fronts = self.queues.values().filter_map(VecDeque::front);
        fronts.map(|(due, _)| *due).min()
    }

    /// Whether a segment waits on this port.
    #[must_use]
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
    fn push(&mut self, port: Port, earliest: Time, segment: Segment) -> Time {
        let queue = self.queues.entry(port).or_default();
        let Segment { delay, departure } = segment;
        // Bytes that were held back are sent together with these, before them.
        let held = match (queue.back_mut(), &departure) {
            (Some((_, Departure::Held(held))), Departure::Bytes(bytes))
                if held.len() + bytes.len() <= MAX_SEND =>
            {
                Some(core::mem::take(held))
            }
            _ => None,
        };
        let (departure, from) = match (held, departure) {
            (Some(mut held), Departure::Bytes(bytes)) => {
                queue.pop_back();
                held.extend(bytes);
                (Departure::Bytes(held), None)
            }
            (_, departure) => {
                // Held bytes that do not fit into one write are sent now.
                if let Some((due, Departure::Held(_))) = queue.back_mut() {
                    *due = earliest;
                }
                (departure, queue.back().map(|(due, _)| *due))
            }
        };
        let due = from.map_or(earliest, |from| from.max(earliest)) + delay;
        queue.push_back((due, departure));
        due
    }

    fn take_due(&mut self, now: Time) -> Option<(Port, Departure)> {
        let due = self
            .queues
            .iter()
            .filter_map(|(port, queue)| Some((queue.front()?.0, *port)));
        let (_, port) = due.filter(|(due, _)| *due <= now).min()?;
        let (_, what) = self.queues.get_mut(&port)?.pop_front()?;
        Some((port, what))
    }
}

impl Endpoints {
    /// Queues segments after those that wait on the port and sends what is due. Returns when the last of the bytes
    /// is sent, as far as known.
    pub(crate) fn enqueue(&mut self, robot: &mut Robot, port: Port, segments: Vec<Segment>) -> Time {
        let at_once =
            |segment: &Segment| segment.delay.is_zero() && matches!(segment.departure, Departure::Bytes(_));
        let mut segments = VecDeque::from(segments);
        if segments.len() == 1
            && segments.iter().all(at_once)
            && !self.send_queue.is_busy(port)
            && let Some(Departure::Bytes(bytes)) = segments.pop_front().map(|segment| segment.departure)
        {
            return self.put_on_line(robot, port, bytes);
        }
        let mut last = robot.now;
        for segment in segments {
            let surplus = segment.departure.length();
            let (bytes, segments) = self.send_queue.waiting(port);
            if bytes + surplus > MAX_QUEUED_BYTES || segments >= MAX_QUEUED_SEGMENTS {
                robot.event(Event::Dropped {
                    port,
                    bytes: surplus,
                    reason: "more is to be sent than a delayed port holds",
                });
                continue;
            }
            last = self.send_queue.push(port, last, segment);
        }
        self.send_due(robot);
        last
    }

    /// Sends what is due.
    pub(crate) fn send_due(&mut self, robot: &mut Robot) {
        while let Some((port, what)) = self.send_queue.take_due(robot.now) {
            match what {
                Departure::Bytes(bytes) | Departure::Held(bytes) if bytes.is_empty() => {}
                Departure::Bytes(bytes) | Departure::Held(bytes) => {
                    self.put_on_line(robot, port, bytes);
                }
                Departure::Stall => {
                    self.faults.stall(port);
                    if port.ethernet_index().is_some() {
                        robot.push_output(Output::Stall { port });
                    }
                }
                // A serial line has no connection to end.
                Departure::Disconnect(_) if port.ethernet_index().is_none() => self.faults.forget_peer(port),
                Departure::Disconnect(how) => {
                    // Send nothing more until the embedding program reports that the peer is gone.
                    self.faults.stall(port);
                    self.send_queue.clear(port);
                    robot.push_output(Output::Disconnect { port, how });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::DisconnectMode;
    use core::time::Duration;

    fn bytes(text: &[u8]) -> Departure {
        Departure::Bytes(text.to_vec())
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
    fn what_is_held_leaves_with_the_next_or_alone_or_before_what_is_too_much() {
        let held =
            |length: usize| Segment::after(Duration::from_secs(1), Departure::Held([b'h'].repeat(length)));
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
