//! A message queue for each port, polled in rotation. A host that sends without pause delays only itself: its queue is
//! short, and each turn serves at most one portion of its bytes.
//!
//! The tasks of [`crate::serial`] send, the driver polls. The driver reads the sockets of [`crate::tcp`] itself, in portions of
//! the same size.

use std::task::{Context, Poll};
use tokio::sync::mpsc;
use ts3100_controller::port::Port;
use ts3100_proto::text::ETX;

/// Queued messages of one port; further sends make its task, and so the host, wait.
const QUEUE_LENGTH: usize = 4;
/// Texts in a portion. A host that waits for its answers never sends as many at once, and they take well under
/// a millisecond.
const PORTION_TEXTS: usize = 8;
/// Bytes in a portion on a channel without texts: four times its receive buffer.
const PORTION_BYTES: usize = 1_024;

/// A message that can be split into portions.
pub(crate) trait SplitPortion: Sized {
    /// Keeps the first portion of itself and returns the rest.
    fn split_portion(&mut self, port: Port) -> Option<Self>;
}

/// Truncates `bytes` to the first portion and returns the rest.
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
    /// Rest of a message that was larger than a portion.
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

/// One queue for each port.
pub(crate) struct PortQueues<M> {
    queues: [(Port, Queue<M>); Port::ALL.len()],
    /// Index of the port that is polled first.
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
    /// Sender for the tasks of a port.
    pub(crate) fn sender(&self, port: Port) -> mpsc::Sender<M> {
        let queues = self.queues.iter();
        let found = queues
            .filter(|(of, _)| *of == port)
            .map(|(_, queue)| queue.sender.clone());
        // Every port has a queue; the disconnected sender is never used.
        found.last().unwrap_or_else(|| mpsc::channel(1).0)
    }

    /// Returns the next portion, taking the ports in rotation.
    pub(crate) fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<M> {
        let first = self.next;
        let (before, from) = self.queues.split_at_mut(first);
        for (place, (port, queue)) in from.iter_mut().chain(before).enumerate() {
            let message = match queue.rest.take() {
                Some(rest) => Poll::Ready(Some(rest)),
                None => queue.receiver.poll_recv(context),
            };
            // The queue never ends, because it keeps a sender of its own.
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
