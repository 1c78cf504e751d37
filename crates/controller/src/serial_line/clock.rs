//! The clock of one direction of a line: a whole number of bits since the line became busy.
//!
//! Counting bits instead of adding times keeps ten thousand characters free of rounding errors.

use super::uart::frame_bits;
use crate::time::Time;
use core::time::Duration;
use ts3100_proto::parameter::SerialSettings;

/// The time at which the characters counted so far have been transmitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clock {
    since: Time,
    /// In bit/s; 0 before the first character.
    speed: u32,
    bits: u64,
}

impl Clock {
    /// The line becomes busy at `now`.
    pub fn start(now: Time, speed: u32) -> Clock {
        Clock {
            since: now,
            speed,
            bits: 0,
        }
    }

    /// When the characters counted have been transmitted, rounded up to a whole microsecond.
    pub fn now(&self) -> Time {
        self.since + bit_time(self.bits, self.speed)
    }

    /// Counts characters of this sender. A change of speed starts a new count.
    pub fn pass(&mut self, sender: SerialSettings, count: usize) {
        if count == 0 {
            return;
        }
        if sender.speed != self.speed {
            *self = Clock::start(self.now(), sender.speed);
        }
        let count = u64::try_from(count).unwrap_or(u64::MAX);
        let bits = count.saturating_mul(u64::from(frame_bits(sender)));
        self.bits = self.bits.saturating_add(bits);
    }
}

/// Time a character takes on this line.
pub fn frame_time(line: SerialSettings) -> Duration {
    bit_time(u64::from(frame_bits(line)), line.speed)
}

fn bit_time(bits: u64, speed: u32) -> Duration {
    let micros = (u128::from(bits) * 1_000_000).div_ceil(u128::from(speed.max(1)));
    Duration::from_micros(u64::try_from(micros).unwrap_or(u64::MAX))
}
