//! What the tasks of the ports tell the driver: a queue for each port, and the ports take turns. A host that sends without
//! pause keeps only itself waiting: its queue is short, and at its turn no more than a portion is served.

use std::task::{Context, Poll};
use tokio::sync::mpsc;
use ts3100_controller::port::Port;
use ts3100_proto::text::ETX;

/// Messages of one port that may wait for the driver; then its task waits, and so does the host.
const QUEUE_LENGTH: usize = 4;
/// Texts of a portion: no host that waits for its answers sends as many at once, and they take well under a
/// millisecond.
const PORTION_TEXTS: usize = 8;
/// Bytes of a portion on a channel without texts, four times what its buffer holds.
const PORTION_BYTES: usize = 1_024;

/// Something that may be more than is served at one turn.
pub(crate) trait SplitPortion: Sized {
    /// Keeps the first portion of itself and returns the rest.
    fn split_portion(&mut self, port: Port) -> Option<Self>;
}

/// Cuts bytes of a host behind the first portion and returns the rest.
pub(crate) fn split_bytes(port: Port, bytes: &mut Vec<u8>) -> Option<Vec<u8>> {
    let end = if port.protocol().is_some() {
        let mut ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == ETX);
        ends.nth(PORTION_TEXTS - 1).map_or(bytes.len(), |(at, _)| at + 1)
    } else {
        PORTION_BYTES.min(bytes.len())
    };
    Some(bytes.split_off(end)).filter(|rest| !rest.is_empty())
}

struct Queue<M> {
    sender: mpsc::Sender<M>,
    receiver: mpsc::Receiver<M>,
    /// What is left of a message that was more than a portion.
    rest: Option<M>,
}

impl<M> Default for Queue<M> {
    fn default() -> Queue<M> {
        let (sender, receiver) = mpsc::channel(QUEUE_LENGTH);
        Queue {
            sender,
            receiver,
            rest: None,
        }
    }
}

/// The queues of all ports.
pub(crate) struct PortQueues<M> {
    queues: [(Port, Queue<M>); Port::ALL.len()],
    /// Place of the port whose turn is next.
    next: usize,
}

impl<M> Default for PortQueues<M> {
    fn default() -> PortQueues<M> {
        PortQueues {
            queues: Port::ALL.map(|port| (port, Queue::default())),
            next: 0,
        }
    }
}

impl<M: SplitPortion> PortQueues<M> {
    /// Where the tasks of a port send to.
    pub(crate) fn sender(&self, port: Port) -> mpsc::Sender<M> {
        let queues = self.queues.iter();
        let found = queues
            .filter(|(of, _)| *of == port)
            .map(|(_, queue)| queue.sender.clone());
        // Each port has a queue; a sender that leads nowhere stands for one that has not.
        found.last().unwrap_or_else(|| mpsc::channel(1).0)
    }

    /// The next portion: the ports that have one take turns. Ready when there is one.
    pub(crate) fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<M> {
        let first = self.next;
        let (before, from) = self.queues.split_at_mut(first);
        for (place, (port, queue)) in from.iter_mut().chain(before).enumerate() {
            let message = match queue.rest.take() {
                Some(rest) => Poll::Ready(Some(rest)),
                None => queue.receiver.poll_recv(context),
            };
            // It does not end: a sender is kept beside the receiver.
            if let Poll::Ready(Some(mut message)) = message {
                queue.rest = message.split_portion(*port);
                self.next = (first + place + 1) % Port::ALL.len();
                return Poll::Ready(message);
            }
        }
        Poll::Pending
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::task::Waker;

    #[derive(Debug, PartialEq)]
    struct TestMessage(Vec<u8>);

    fn next(turns: &mut PortQueues<TestMessage>) -> Option<Vec<u8>> {
        match turns.poll_next(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(TestMessage(bytes)) => Some(bytes),
            Poll::Pending => None,
        }
    }

    impl SplitPortion for TestMessage {
        fn split_portion(&mut self, port: Port) -> Option<TestMessage> {
            split_bytes(port, &mut self.0).map(TestMessage)
        }
    }

    #[test]
    fn a_port_that_sends_without_pause_has_every_other_turn_beside_one_that_sends_now_and_then() {
        let mut turns = PortQueues::default();
        let flood = turns.sender(Port::Ip0);
        for _ in 0..QUEUE_LENGTH {
            flood.try_send(TestMessage(b"\x02SU\r\x03".repeat(800))).unwrap();
        }
        assert!(flood.try_send(TestMessage(Vec::new())).is_err(), "its host waits");
        for port in [Port::Host, Port::Com1, Port::Ip1] {
            assert!(next(&mut turns).is_some());
            turns.sender(port).try_send(TestMessage(vec![b'1'])).unwrap();
            let found: Vec<Vec<u8>> = (0..2).filter_map(|_| next(&mut turns)).collect();
            assert!(found.contains(&vec![b'1']), "{port}: {found:?}");
        }
    }

    #[test]
    fn what_is_served_at_one_turn_is_bounded_and_nothing_is_lost_or_out_of_order() {
        for (port, block, most) in [
            (Port::Ip0, &b"\x02SU\r\x03"[..], PORTION_TEXTS * 5),
            (Port::Host, b"SU\r\x03", PORTION_TEXTS * 4),
            (Port::Ip1, b"1\r", PORTION_BYTES),
            (Port::Com1, b"\x03", PORTION_BYTES),
        ] {
            let mut turns = PortQueues::default();
            let sent = block.repeat(1_000);
            turns.sender(port).try_send(TestMessage(sent.clone())).unwrap();
            let portions: Vec<Vec<u8>> = std::iter::from_fn(|| next(&mut turns)).collect();
            assert!(portions.iter().all(|portion| (1..=most).contains(&portion.len())));
            assert_eq!(portions.concat(), sent, "{port}");
        }
        let mut unfinished = vec![b'A'; 4_096];
        assert_eq!(split_bytes(Port::Ip0, &mut unfinished), None);
    }
}
