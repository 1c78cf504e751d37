//! What is to leave a port later: texts that a fault or a variation delays, cuts or holds back, in the order of each
//! port. Why they wait is not known here; without faults and variations nothing ever does.

use crate::Controller;
use crate::faults::kind::{Departure, Segment};
use crate::limits::{MAX_PARCELS, MAX_SEND, OUTBOX};
use crate::output::{Event, Output};
use crate::port::Port;
use crate::time::Time;
use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

/// What waits, by port.
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
    /// When something is to leave.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        let fronts = self.queues.values().filter_map(VecDeque::front);
        fronts.map(|(due, _)| *due).min()
    }

    /// Whether something waits on this port.
    #[must_use]
    pub fn is_busy(&self, port: Port) -> bool {
        self.queues.get(&port).is_some_and(|queue| !queue.is_empty())
    }

    /// Nothing of this port is to leave any more.
    pub fn clear(&mut self, port: Port) {
        self.queues.remove(&port);
    }

    /// Bytes that wait on a port, and parcels.
    pub(crate) fn waiting(&self, port: Port) -> (usize, usize) {
        let queue = self.queues.get(&port).into_iter().flatten();
        queue.fold((0, 0), |(bytes, parcels), (_, what)| {
            (bytes + what.length(), parcels + 1)
        })
    }

    /// Puts a parcel behind what waits; returns when it is due.
    fn push(&mut self, port: Port, earliest: Time, parcel: Segment) -> Time {
        let queue = self.queues.entry(port).or_default();
        let Segment {
            delay: after,
            departure: what,
        } = parcel;
        // What was held back leaves with what comes now, in front of it.
        let held = match (queue.back_mut(), &what) {
            (Some((_, Departure::Held(held))), Departure::Bytes(bytes))
                if held.len() + bytes.len() <= MAX_SEND =>
            {
                Some(core::mem::take(held))
            }
            _ => None,
        };
        let (what, from) = match (held, what) {
            (Some(mut held), Departure::Bytes(bytes)) => {
                queue.pop_back();
                held.extend(bytes);
                (Departure::Bytes(held), None)
            }
            (_, what) => {
                // What is held back, and does not fit, waits no longer either.
                if let Some((due, Departure::Held(_))) = queue.back_mut() {
                    *due = earliest;
                }
                (what, queue.back().map(|(due, _)| *due))
            }
        };
        let due = from.map_or(earliest, |from| from.max(earliest)) + after;
        queue.push_back((due, what));
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

impl Controller {
    /// Sends parcels behind what waits on the port; what is due leaves at once. Returns when the last of the bytes
    /// leaves, as far as that is known.
    pub(crate) fn enqueue(&mut self, port: Port, parcels: Vec<Segment>) -> Time {
        let at_once =
            |parcel: &Segment| parcel.delay.is_zero() && matches!(parcel.departure, Departure::Bytes(_));
        let mut parcels = VecDeque::from(parcels);
        if parcels.len() == 1
            && parcels.iter().all(at_once)
            && !self.send_queue.is_busy(port)
            && let Some(Departure::Bytes(bytes)) = parcels.pop_front().map(|parcel| parcel.departure)
        {
            return self.put_on_line(port, bytes);
        }
        let mut last = self.now;
        for parcel in parcels {
            let surplus = parcel.departure.length();
            let (bytes, parcels) = self.send_queue.waiting(port);
            if bytes + surplus > OUTBOX || parcels >= MAX_PARCELS {
                self.event(Event::Dropped {
                    port,
                    bytes: surplus,
                    reason: "more is to be sent than a delayed port holds",
                });
                continue;
            }
            last = self.send_queue.push(port, last, parcel);
        }
        self.send_due();
        last
    }

    /// Lets leave what is due.
    pub(crate) fn send_due(&mut self) {
        while let Some((port, what)) = self.send_queue.take_due(self.now) {
            match what {
                Departure::Bytes(bytes) | Departure::Held(bytes) if bytes.is_empty() => {}
                Departure::Bytes(bytes) | Departure::Held(bytes) => {
                    self.put_on_line(port, bytes);
                }
                Departure::Stall => {
                    self.faults.stall(port);
                    if port.ethernet_index().is_some() {
                        self.push_output(Output::Stall { port });
                    }
                }
                // A serial line has no connection that could end.
                Departure::Disconnect(_) if port.ethernet_index().is_none() => self.faults.forget_peer(port),
                Departure::Disconnect(how) => {
                    // Until the edge says that the peer is gone nothing more is said to it.
                    self.faults.stall(port);
                    self.send_queue.clear(port);
                    self.push_output(Output::Disconnect { port, how });
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
        let mut outbox = SendQueue::default();
        let (now, ms) = (Time::ZERO, Duration::from_millis);
        assert_eq!(
            outbox.push(Port::Ip0, now, Segment::after(ms(30), bytes(b"a"))),
            Time::from_millis(30)
        );
        assert_eq!(
            outbox.push(Port::Ip0, now, Segment::bytes(b"b".to_vec())),
            Time::from_millis(30)
        );
        outbox.push(Port::Ip1, now, Segment::after(ms(10), bytes(b"c")));
        assert_eq!(outbox.deadline(), Some(Time::from_millis(10)));
        assert_eq!(
            outbox.take_due(Time::from_millis(29)),
            Some((Port::Ip1, bytes(b"c")))
        );
        assert_eq!(outbox.take_due(Time::from_millis(29)), None);
        let rest: Vec<_> = core::iter::from_fn(|| outbox.take_due(Time::from_millis(30))).collect();
        assert_eq!(rest, [(Port::Ip0, bytes(b"a")), (Port::Ip0, bytes(b"b"))]);
    }

    #[test]
    fn what_is_held_leaves_with_the_next_or_alone_or_before_what_is_too_much() {
        let held =
            |length: usize| Segment::after(Duration::from_secs(1), Departure::Held([b'h'].repeat(length)));
        let mut outbox = SendQueue::default();
        outbox.push(Port::Ip0, Time::ZERO, held(1));
        assert_eq!(outbox.take_due(Time::from_millis(999)), None);
        outbox.push(Port::Ip0, Time::from_millis(5), Segment::bytes(b"n".to_vec()));
        assert_eq!(
            outbox.take_due(Time::from_millis(5)),
            Some((Port::Ip0, bytes(b"hn")))
        );
        outbox.push(Port::Ip0, Time::ZERO, held(MAX_SEND));
        outbox.push(Port::Ip0, Time::from_millis(5), Segment::bytes(b"n".to_vec()));
        let alone = outbox.take_due(Time::from_millis(5));
        assert!(matches!(alone, Some((_, Departure::Held(held))) if held.len() == MAX_SEND));
        assert_eq!(
            outbox.take_due(Time::from_millis(5)),
            Some((Port::Ip0, bytes(b"n")))
        );
        outbox.push(Port::Ip0, Time::ZERO, held(1));
        outbox.push(
            Port::Ip0,
            Time::from_millis(5),
            Segment::after(Duration::ZERO, Departure::Disconnect(DisconnectMode::Close)),
        );
        assert_eq!(outbox.waiting(Port::Ip0), (1, 2));
        outbox.clear(Port::Ip0);
        assert!(!outbox.is_busy(Port::Ip0));
    }
}
