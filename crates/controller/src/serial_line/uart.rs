//! A UART that receives while the settings of both ends differ: it samples each character bit by bit, at its own speed.
//!
//! With equal settings every character arrives as sent. `direction` adds the time.

use crate::prelude::*;
use ts3100_proto::parameter::{Parity, SerialSettings};

ts3100_proto::codes! {
    /// Errors of a received character.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum CharacterError {
        /// The number of ones is not what the parity asks for.
        Parity = "parity error",
        /// The line was low where the stop bit was expected.
        Framing = "framing error",
    }
    /// In words, for the log.
    fn description -> &'static str;
}

/// A character as its receiver read it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Character {
    /// The data bits; those beyond the character length are 0.
    pub byte: u8,
    pub fault: Option<CharacterError>,
}

/// Bits one character takes on the line: start, data, parity, stop.
pub fn frame_bits(line: SerialSettings) -> u32 {
    1 + u32::from(line.length) + u32::from(has_parity(line)) + u32::from(line.stop)
}

/// The bits of a byte that a line with this character length carries.
pub fn mask(line: SerialSettings) -> u8 {
    u8::MAX
        .checked_shr(8_u32.saturating_sub(u32::from(line.length)))
        .unwrap_or(0)
}

fn has_parity(line: SerialSettings) -> bool {
    line.parity != Parity::None
}

fn parity_bit(parity: Parity, data: u8) -> bool {
    let odd_ones = data.count_ones() % 2 == 1;
    match parity {
        Parity::Odd => !odd_ones,
        Parity::Even | Parity::None => odd_ones,
    }
}

/// The levels of a character, one a bit, in the order of the line.
fn levels(line: SerialSettings, byte: u8) -> impl Iterator<Item = bool> {
    let data = byte & mask(line);
    let parity = has_parity(line).then(|| parity_bit(line.parity, data));
    core::iter::once(false)
        .chain((0..line.length).map(move |bit| data.checked_shr(u32::from(bit)).unwrap_or(0) & 1 == 1))
        .chain(parity)
        .chain(core::iter::repeat_n(true, usize::from(line.stop)))
}

/// State of a receiver. Lengths of time are in units of 1/(2 x sender's speed x receiver's speed) seconds,
/// in which the bits of both, and half a bit, are whole numbers.
///
/// ```text
///   Idle --line falls--> Frame --first sample high: no start bit---------> Idle
///                          | \--stop bit high: character read------------> Idle
///                          \---stop bit low: framing error--> Low --high--> Idle
/// ```
/// Low is a state of its own because a break is one bad character, not one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
enum ReceiverState {
    /// It waits for the line to fall.
    #[default]
    Idle,
    /// It is inside a character.
    Frame {
        /// Units to the next sample.
        left: u64,
        /// Number of samples taken.
        taken: u8,
        /// The samples, the start bit lowest.
        bits: u16,
    },
    /// There was no stop bit: it waits for the line to rise.
    Low,
}

/// A receiver and the line it listens to: the sender's settings, and its own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Receiver {
    sender: SerialSettings,
    own: SerialSettings,
    state: ReceiverState,
}

impl Receiver {
    /// On an idle line.
    pub fn new(sender: SerialSettings, own: SerialSettings) -> Receiver {
        Receiver {
            sender,
            own,
            state: ReceiverState::Idle,
        }
    }

    /// Changes the settings. A character that began with other settings is given up.
    pub fn set(&mut self, sender: SerialSettings, own: SerialSettings) {
        if (self.sender, self.own) != (sender, own) {
            *self = Receiver::new(sender, own);
        }
    }

    /// Settings of the receiver's end.
    pub fn own(&self) -> SerialSettings {
        self.own
    }

    /// Whether no more bits have been taken than a character has.
    pub fn is_valid(&self) -> bool {
        let samples = 2 + self.own.length + u8::from(has_parity(self.own));
        match self.state {
            ReceiverState::Idle | ReceiverState::Low => true,
            ReceiverState::Frame { taken, .. } => taken < samples,
        }
    }

    /// Whether it is inside a character.
    pub fn is_busy(&self) -> bool {
        matches!(self.state, ReceiverState::Frame { .. })
    }

    /// The next byte of the sender, without a pause; what the receiver has read by its end is added to `read`.
    pub fn receive(&mut self, byte: u8, read: &mut Vec<Character>) {
        // Between equal settings every byte arrives as it was sent, but for the bits the length takes away.
        if self.sender == self.own && self.state == ReceiverState::Idle {
            read.push(Character {
                byte: byte & mask(self.own),
                fault: None,
            });
            return;
        }
        // In units: a bit of the sender is 1/speed seconds, so the speeds change places.
        let bit = 2 * u64::from(self.own.speed);
        for level in levels(self.sender, byte) {
            self.advance(level, bit, read);
        }
    }

    /// The line is idle for this many microseconds.
    pub fn idle_for(&mut self, micros: u64, read: &mut Vec<Character>) {
        let units =
            2 * u128::from(self.sender.speed) * u128::from(self.own.speed) * u128::from(micros) / 1_000_000;
        self.advance(true, u64::try_from(units).unwrap_or(u64::MAX), read);
    }

    /// The line is idle for longer than a character takes.
    pub fn flush(&mut self, read: &mut Vec<Character>) {
        self.advance(true, u64::MAX, read);
    }

    /// The line has this level for this many units.
    fn advance(&mut self, level: bool, units: u64, read: &mut Vec<Character>) {
        let mut rest = units;
        loop {
            self.state = match self.state {
                ReceiverState::Idle if !level => ReceiverState::Frame {
                    // Half a bit of the receiver: it samples in the middle of each bit.
                    left: u64::from(self.sender.speed),
                    taken: 0,
                    bits: 0,
                },
                ReceiverState::Low if level => ReceiverState::Idle,
                ReceiverState::Idle | ReceiverState::Low => return,
                ReceiverState::Frame { left, taken, bits } if left >= rest => {
                    let left = left - rest;
                    self.state = ReceiverState::Frame { left, taken, bits };
                    return;
                }
                ReceiverState::Frame { left, taken, bits } => {
                    rest -= left;
                    let bits = bits | u16::from(level).checked_shl(u32::from(taken)).unwrap_or(0);
                    self.sample(level, taken + 1, bits, read)
                }
            };
        }
    }

    /// Takes a sample. The last sample of a character is its first stop bit, as in every UART.
    fn sample(&self, level: bool, taken: u8, bits: u16, read: &mut Vec<Character>) -> ReceiverState {
        let samples = 2 + self.own.length + u8::from(has_parity(self.own));
        if taken == 1 && level {
            // The line fell for less than half a bit: no start bit.
            return ReceiverState::Idle;
        }
        if taken < samples {
            let left = 2 * u64::from(self.sender.speed);
            return ReceiverState::Frame { left, taken, bits };
        }
        let [low, high] = (bits >> 1).to_le_bytes();
        let byte = low & mask(self.own);
        let above = u16::from_le_bytes([low, high]).checked_shr(u32::from(self.own.length));
        let parity = above.unwrap_or(0) & 1 == 1;
        let fault = if !level {
            Some(CharacterError::Framing)
        } else if has_parity(self.own) && parity != parity_bit(self.own.parity, byte) {
            Some(CharacterError::Parity)
        } else {
            None
        };
        read.push(Character { byte, fault });
        if level {
            ReceiverState::Idle
        } else {
            ReceiverState::Low
        }
    }
}

#[cfg(test)]
mod tests;
