//! One direction of a serial line in time: bytes given to the sender, and when its characters arrive.
//!
//! The owner of the line decides about garbled characters and about the meaning of the others.

use super::clock::{Clock, frame_time};
use super::uart::{Character, Receiver};
use crate::limits::UART_FIFO;
use crate::prelude::*;
use crate::time::Time;
use alloc::collections::VecDeque;
use ts3100_proto::parameter::SerialSettings;
use ts3100_proto::text::{CR, ETX, LF};

/// Bytes that are sent with the same settings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Burst {
    sender: SerialSettings,
    #[serde(with = "ts3100_proto::serde_latin1")]
    bytes: VecDeque<u8>,
}

/// A character that was received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// As it was read.
    pub character: Character,
    /// When its transmission began.
    pub begin: Time,
    /// When its transmission ended.
    pub end: Time,
}

/// One direction of a serial line.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direction {
    bursts: VecDeque<Burst>,
    queued: usize,
    clock: Clock,
    /// Microseconds the line was idle before the first byte queued.
    idle: u64,
    receiver: Option<Receiver>,
    /// The last byte transmitted.
    last: u8,
}

impl Arrival {
    /// A character that was on the line from `begin` to `end`.
    pub fn new(character: Character, begin: Time, end: Time) -> Arrival {
        Arrival {
            character,
            begin,
            end,
        }
    }
}

impl Direction {
    /// Number of bytes not yet transmitted.
    pub fn queued(&self) -> usize {
        self.queued
    }

    /// Whether a character is being transmitted or received.
    pub fn is_busy(&self) -> bool {
        self.queued > 0 || self.receiver.as_ref().is_some_and(Receiver::is_busy)
    }

    /// Queues bytes for transmission; returns when the first begins and the last ends.
    pub fn push(&mut self, now: Time, bytes: &[u8], sender: SerialSettings) -> (Time, Time) {
        // Only an idle line starts at `now`. On a busy one the next character follows the last without a gap,
        // whenever it was handed over.
        if self.bursts.is_empty() && self.clock.now() < now {
            let idle = now.since(self.clock.now());
            self.idle = u64::try_from(idle.as_micros()).unwrap_or(u64::MAX);
            self.clock = Clock::start(now, sender.speed);
        }
        let begin = self.ends_at();
        if bytes.is_empty() {
            return (begin, begin);
        }
        self.queued += bytes.len();
        match self.bursts.back_mut() {
            Some(burst) if burst.sender == sender => burst.bytes.extend(bytes),
            _ => self.bursts.push_back(Burst {
                sender,
                bytes: bytes.iter().copied().collect(),
            }),
        }
        (begin, self.ends_at())
    }

    /// When everything queued will have been transmitted.
    fn ends_at(&self) -> Time {
        self.drained_to_at(0)
    }

    /// When at most `most` bytes will be left.
    pub fn drained_to_at(&self, most: usize) -> Time {
        let mut surplus = self.queued.saturating_sub(most);
        let mut clock = self.clock;
        for burst in &self.bursts {
            let count = burst.bytes.len().min(surplus);
            clock.pass(burst.sender, count);
            surplus -= count;
        }
        clock.now()
    }

    /// When the next characters should be taken: at the end of a text or value, at the byte after an ETX (a
    /// checksum), at the last character, or after [`UART_FIFO`] characters. If the settings of both ends differ, at
    /// every character, because its value is not known before.
    pub fn deadline(&self, own: SerialSettings) -> Option<Time> {
        let mut clock = self.clock;
        let Some(burst) = self.bursts.front() else {
            let receiver = self.receiver.as_ref().filter(|receiver| receiver.is_busy())?;
            return Some(clock.now() + frame_time(receiver.own()));
        };
        let most = if burst.sender == own && self.last != ETX {
            burst.bytes.len().min(UART_FIFO)
        } else {
            1
        };
        let end = burst
            .bytes
            .iter()
            .take(most)
            .position(|byte| matches!(*byte, ETX | CR | LF | b','));
        clock.pass(burst.sender, end.map_or(most, |end| end + 1));
        Some(clock.now())
    }

    /// Removes the characters received by `now`, as a receiver with these settings reads them.
    pub fn take(&mut self, now: Time, own: SerialSettings) -> Vec<Arrival> {
        self.take_first(usize::MAX, now, own)
    }

    /// As [`Direction::take`], for the first `most` bytes queued.
    pub fn take_first(&mut self, most: usize, now: Time, own: SerialSettings) -> Vec<Arrival> {
        let mut arrivals = Vec::new();
        let mut read = Vec::new();
        let mut left = most;
        while let Some(burst) = self.bursts.front_mut() {
            // More bytes follow on the line, so the receiver is not flushed: its half character may go on.
            if left == 0 {
                return arrivals;
            }
            left -= 1;
            let sender = burst.sender;
            let begin = self.clock.now();
            let mut clock = self.clock;
            clock.pass(sender, 1);
            let end = clock.now();
            if end > now {
                return arrivals;
            }
            let byte = burst.bytes.pop_front();
            if burst.bytes.is_empty() {
                self.bursts.pop_front();
            }
            let Some(byte) = byte else { continue };
            (self.clock, self.last) = (clock, byte);
            self.queued = self.queued.saturating_sub(1);
            let receiver = self.receiver.get_or_insert_with(|| Receiver::new(sender, own));
            receiver.set(sender, own);
            receiver.idle_for(core::mem::take(&mut self.idle), &mut read);
            receiver.receive(byte, &mut read);
            // A receiver at another speed may read none, one or several characters of one that was sent.
            let arrived = read.drain(..);
            arrivals.extend(arrived.map(|character| Arrival::new(character, begin, end)));
        }
        // The last byte may end while the receiver is inside a character: the idle line gives it the remaining samples.
        let ended = self.clock.now();
        if let Some(receiver) = self.receiver.as_mut().filter(|receiver| receiver.is_busy())
            && ended + frame_time(receiver.own()) <= now
        {
            receiver.flush(&mut read);
            let (begin, end) = (ended, ended + frame_time(receiver.own()));
            let arrived = read.into_iter();
            arrivals.extend(arrived.map(|character| Arrival::new(character, begin, end)));
        }
        arrivals
    }

    /// Whether the count matches the queue and the receiver is in a possible state; for a snapshot.
    pub fn is_valid(&self) -> bool {
        let bursts = &self.bursts;
        bursts.iter().all(|burst| !burst.bytes.is_empty())
            && self.queued == bursts.iter().map(|burst| burst.bytes.len()).sum::<usize>()
            && self.receiver.as_ref().is_none_or(Receiver::is_valid)
    }

    /// Drops the queued bytes whose transmission has not begun.
    pub fn purge(&mut self, now: Time) {
        let Some(first) = self.bursts.front_mut() else {
            return;
        };
        // The character whose start bit is out cannot be taken back; all others can.
        let begun = usize::from(self.clock.now() < now);
        first.bytes.truncate(begun);
        self.queued = begun;
        self.bursts.truncate(begun);
    }
}

/// Characters that a receiver reads when the line takes no time (option `serial.pacing` off).
pub fn receive_unpaced(bytes: &[u8], sender: SerialSettings, own: SerialSettings) -> Vec<Character> {
    let mut receiver = Receiver::new(sender, own);
    let mut read = Vec::new();
    for &byte in bytes {
        receiver.receive(byte, &mut read);
    }
    receiver.flush(&mut read);
    read
}
