//! The digital lines: what is driven from outside (Din) and what the controller drives (Dout), by the
//! numbers of the manual's SF tables. Their meaning (RUN, STOP, ACK) belongs to others.

use crate::action::IoKind;
use crate::time::Time;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;
use ts3100_proto::status::io::{LineWords, WORDS};

/// Number ranges of the lines, each with the word of IO at which it begins (SF-25 to SF-38, ste80722 S27). The six-axis
/// manual leaves out the last two; what hosts of its sister may ask for is there on every arm.
const RANGES: [(u16, u16, usize); 5] = [
    (1, 64, 0),
    (101, 164, 4),
    (201, 264, 8),
    (301, 364, 12),
    (401, 464, 16),
];
/// Outputs a program or IW may set: general, extension, hand (CMD-IW-04).
const USER_OUTPUTS: [(u16, u16); 3] = [(1, 64), (101, 164), (201, 208)];
/// Outputs that RS,SIG turns off (CMD-RS-07, CMD-RS-08).
const RESET_OUTPUTS: (u16, u16) = (1, 24);

/// State of all lines.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Signals {
    inputs: BTreeSet<u16>,
    outputs: BTreeSet<u16>,
    /// Outputs that drop by themselves, and when.
    pulses: BTreeMap<u16, Time>,
    /// Inputs that the outside drives the other way by itself: when, and to what.
    drives: BTreeMap<u16, (Time, bool)>,
    /// Lines that show this state whatever drives them.
    #[cfg_attr(feature = "serde", serde(with = "crate::snapshot::field::pairs"))]
    forced: BTreeMap<(IoKind, u16), bool>,
}

fn within(ranges: &[(u16, u16)], line: u16) -> bool {
    ranges.iter().any(|&(first, last)| (first..=last).contains(&line))
}

fn set(lines: &mut BTreeSet<u16>, line: u16, on: bool) {
    if on {
        lines.insert(line);
    } else {
        lines.remove(&line);
    }
}

fn words(is_on: impl Fn(u16) -> bool) -> [u16; WORDS] {
    let mut words = [0u16; WORDS];
    for (first, last, word) in RANGES {
        for line in (first..=last).filter(|line| is_on(*line)) {
            let index = usize::from(line - first);
            if let Some(word) = words.get_mut(word + index / 16) {
                *word |= 1 << (index % 16);
            }
        }
    }
    words
}

impl Signals {
    /// Whether a line of this number exists.
    #[must_use]
    pub fn exists(line: u16) -> bool {
        RANGES
            .iter()
            .any(|&(first, last, _)| (first..=last).contains(&line))
    }

    /// Whether a program or IW may set this output.
    #[must_use]
    pub fn is_user_output(line: u16) -> bool {
        within(&USER_OUTPUTS, line)
    }

    /// Drives an input from outside; false if there is no such line.
    pub fn drive(&mut self, line: u16, on: bool) -> bool {
        let exists = Signals::exists(line);
        if exists {
            set(&mut self.inputs, line, on);
            self.drives.remove(&line);
        }
        exists
    }

    /// The outside drives an input to `on` by itself at that time, unless it is driven before.
    pub fn end_drive_at(&mut self, line: u16, at: Time, on: bool) {
        if Signals::exists(line) {
            self.drives.insert(line, (at, on));
        }
    }

    /// Inputs that are to be driven by now, and to what; each is told once.
    pub fn ended_drives(&mut self, now: Time) -> Vec<(u16, bool)> {
        let mut ended = Vec::new();
        self.drives.retain(|line, (at, on)| {
            let lasts = *at > now;
            if !lasts {
                ended.push((*line, *on));
            }
            lasts
        });
        ended
    }

    /// A line shows this state whatever drives it, or again what drives it; false if there is no such line.
    pub fn force(&mut self, side: IoKind, line: u16, state: Option<bool>) -> bool {
        let exists = Signals::exists(line);
        match state.filter(|_| exists) {
            Some(on) => self.forced.insert((side, line), on),
            None => self.forced.remove(&(side, line)),
        };
        exists
    }

    /// The state a line is forced to.
    #[must_use]
    pub fn forced(&self, side: IoKind, line: u16) -> Option<bool> {
        self.forced.get(&(side, line)).copied()
    }

    /// Numbers of all lines of one direction.
    pub fn numbers() -> impl Iterator<Item = u16> {
        RANGES.into_iter().flat_map(|(first, last, _)| first..=last)
    }

    /// State of an input.
    #[must_use]
    pub fn input(&self, line: u16) -> bool {
        let forced = self.forced(IoKind::Input, line);
        forced.unwrap_or_else(|| self.inputs.contains(&line))
    }

    /// State of an output.
    #[must_use]
    pub fn output(&self, line: u16) -> bool {
        let forced = self.forced(IoKind::Output, line);
        forced.unwrap_or_else(|| self.outputs.contains(&line))
    }

    /// Switches an output; false if there is no such line.
    pub fn switch(&mut self, line: u16, on: bool) -> bool {
        let exists = Signals::exists(line);
        if exists {
            set(&mut self.outputs, line, on);
            self.pulses.remove(&line);
        }
        exists
    }

    /// Switches an output on until then; false if there is no such line.
    pub fn pulse(&mut self, line: u16, until: Time) -> bool {
        let exists = self.switch(line, true);
        if exists {
            self.pulses.insert(line, until);
        }
        exists
    }

    /// When the pulse of an output ends; `None` while there is none.
    #[must_use]
    pub fn pulse_end(&self, line: u16) -> Option<Time> {
        self.pulses.get(&line).copied()
    }

    /// When the next pulse ends.
    #[must_use]
    pub fn deadline(&self) -> Option<Time> {
        let drives = self.drives.values().map(|(at, _)| *at);
        self.pulses.values().copied().chain(drives).min()
    }

    /// Ends the pulses whose time has come.
    pub fn expire(&mut self, now: Time) {
        let outputs = &mut self.outputs;
        self.pulses.retain(|line, until| {
            let lasts = *until > now;
            if !lasts {
                outputs.remove(line);
            }
            lasts
        });
    }

    /// The lines that are on or end a pulse, for a snapshot: each with its field. A pulse of an output that is off
    /// counts as line 0.
    #[cfg(feature = "serde")]
    pub(crate) fn lines_held(&self) -> impl Iterator<Item = (&'static str, u16)> {
        let inputs = self.inputs.iter().map(|line| ("inputs", *line));
        let outputs = self.outputs.iter().map(|line| ("outputs", *line));
        let pulses = self.pulses.keys().map(|line| {
            let line = if self.outputs.contains(line) { *line } else { 0 };
            ("pulses", line)
        });
        let drives = self.drives.keys().map(|line| ("drives", *line));
        let forced = self.forced.keys().map(|(_, line)| ("forced", *line));
        inputs.chain(outputs).chain(pulses).chain(drives).chain(forced)
    }

    /// RS,SIG: Dout1 to Dout24 off.
    pub fn reset_outputs(&mut self) {
        self.outputs
            .retain(|line| !(RESET_OUTPUTS.0..=RESET_OUTPUTS.1).contains(line));
    }

    /// Power off: every output drops, a forced one too; the inputs are the outside's.
    pub fn drop_outputs(&mut self) {
        self.outputs.clear();
        self.pulses.clear();
        self.forced.retain(|(side, _), _| *side == IoKind::Input);
    }

    /// The words of IO; SF has the first sixteen of each direction.
    #[must_use]
    pub fn words(&self) -> LineWords {
        LineWords {
            inputs: words(|line| self.input(line)),
            outputs: words(|line| self.output(line)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: SF-25 SF-26 SF-27 SF-33 SF-34 SF-41 S27
    #[test]
    fn lines_stand_in_their_words() {
        let mut signals = Signals::default();
        for line in [1, 32, 64, 101, 164, 201, 301, 364, 401, 464] {
            assert!(signals.drive(line, true));
        }
        let inputs = signals.words().inputs;
        assert_eq!(inputs[0], 1);
        assert_eq!(inputs[1], 1 << 15);
        assert_eq!(inputs[3], 1 << 15);
        assert_eq!(inputs[4], 1);
        assert_eq!(inputs[7], 1 << 15);
        assert_eq!(inputs[8], 1);
        assert_eq!((inputs[12], inputs[15]), (1, 1 << 15));
        assert_eq!((inputs[16], inputs[19]), (1, 1 << 15));
        signals.switch(109, true);
        assert_eq!(signals.words().outputs[4], 1 << 8);
    }

    // clause: CMD-RS-07 CMD-RS-08
    #[test]
    fn signal_reset_touches_24_outputs() {
        let mut signals = Signals::default();
        for line in [1, 24, 25, 101] {
            signals.switch(line, true);
        }
        signals.reset_outputs();
        assert!(!signals.output(1) && !signals.output(24));
        assert!(signals.output(25) && signals.output(101));
    }

    #[test]
    fn lines_that_do_not_exist_are_refused() {
        let mut signals = Signals::default();
        for line in [0, 65, 100, 165, 200, 265, 300, 365, 400, 465] {
            assert!(!signals.drive(line, true));
            assert!(!signals.switch(line, true));
        }
        assert_eq!(signals, Signals::default());
    }
}
