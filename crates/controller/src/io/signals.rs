//! The digital lines: inputs (Din), driven from outside, and outputs (Dout), driven by the controller.
//!
//! Lines have the numbers of the manual's SF tables. A line can be forced to a state, outputs can be pulsed, and inputs
//! can be scheduled to change. What a line means to the controller (RUN, STOP, ACK ...) is in `system_signals`.

use crate::options::FieldBus;
use crate::prelude::*;
use crate::time::Time;
use alloc::collections::{BTreeMap, BTreeSet};
use core::ops::RangeInclusive;
use ts3100_proto::status::io::{LineWords, WORDS};

/// Ranges of line numbers, four words of IO each (SF-25 to SF-38, ste80722 S27).
///
/// The six-axis manual does not list the last two ranges. The library's manual has them as the field bus (L43, L51), so
/// every arm has them.
const RANGES: [RangeInclusive<u16>; 5] = [1..=64, 101..=164, 201..=264, 301..=364, 401..=464];
/// The same ranges in words.
pub const LINE_NUMBERS: &str = "1-64, 101-164, 201-264, 301-364, 401-464";
/// Outputs that a program or IW may set: general, extension, hand (CMD-IW-04).
const USER_OUTPUTS: [RangeInclusive<u16>; 3] = [1..=64, 101..=164, 201..=208];
/// Lines of the field bus. A program or IW may set its outputs if the controller has one (ste85409 L51, T14).
const FIELD_BUS: [RangeInclusive<u16>; 2] = [301..=364, 401..=464];
/// Outputs that RS,SIG turns off (CMD-RS-07, CMD-RS-08).
const RESET_OUTPUTS: RangeInclusive<u16> = 1..=24;

ts3100_proto::codes! {
    /// Which way a line leads, seen from the controller.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    pub enum IoKind {
        /// Din.
        Input = "input",
        /// Dout.
        Output = "output",
    }
    /// Its word.
    fn as_str -> &'static str;
    impl Word;
}

/// State of all digital lines.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signals {
    inputs: BTreeSet<u16>,
    outputs: BTreeSet<u16>,
    /// Outputs that turn off by themselves, and when.
    pulses: BTreeMap<u16, Time>,
    /// Inputs that change by themselves: when, and to which state.
    scheduled_inputs: BTreeMap<u16, (Time, bool)>,
    /// Lines that read as this state, whatever drives them.
    #[serde(with = "crate::serde_form::pairs")]
    forced: BTreeMap<(IoKind, u16), bool>,
}

/// Switches a line and cancels the change that it would make by itself; false if it does not exist.
fn switch<T>(lines: &mut BTreeSet<u16>, changes: &mut BTreeMap<u16, T>, line: u16, on: bool) -> bool {
    if !Signals::exists(line) {
        return false;
    }
    changes.remove(&line);
    if on {
        lines.insert(line);
    } else {
        lines.remove(&line);
    }
    true
}

/// Removes and returns the changes that are due.
fn take_due<T: Copy>(changes: &mut BTreeMap<u16, T>, is_due: impl Fn(&T) -> bool) -> Vec<(u16, T)> {
    // In the order of the lines: inputs that change at one moment act one after the other, in each run the same way.
    let due = changes.iter().filter(|(_, change)| is_due(change));
    let due: Vec<(u16, T)> = due.map(|(line, change)| (*line, *change)).collect();
    changes.retain(|_, change| !is_due(change));
    due
}

fn pack_words(is_on: impl Fn(u16) -> bool) -> [u16; WORDS] {
    let mut words = [0u16; WORDS];
    let on = Signals::numbers().enumerate().filter(|(_, line)| is_on(*line));
    for (place, _) in on {
        if let Some(word) = words.get_mut(place / 16) {
            *word |= 1 << (place % 16);
        }
    }
    words
}

impl Signals {
    /// Whether an input and an output of this number exist.
    pub fn exists(line: u16) -> bool {
        RANGES.iter().any(|range| range.contains(&line))
    }

    /// Whether a program or IW may set this output.
    pub fn is_user_output(line: u16, bus: FieldBus) -> bool {
        let is_on_bus = bus == FieldBus::Present && Signals::is_on_field_bus(line);
        is_on_bus || USER_OUTPUTS.iter().any(|range| range.contains(&line))
    }

    /// Whether this is a line of the field bus.
    pub(crate) fn is_on_field_bus(line: u16) -> bool {
        FIELD_BUS.iter().any(|range| range.contains(&line))
    }

    /// Why an output is not switched.
    pub(crate) fn no_output(found: u16, bus: FieldBus) -> String {
        let numbers = Signals::user_output_numbers(found, bus);
        format!("there is no output {found}; outputs are {numbers}")
    }

    /// The numbers of the user outputs in words, for the message that refuses `line`.
    pub(crate) fn user_output_numbers(line: u16, bus: FieldBus) -> &'static str {
        match bus {
            FieldBus::Present => "1-64, 101-164, 201-208, 301-364 and 401-464",
            FieldBus::Absent if Signals::is_on_field_bus(line) => {
                "1-64, 101-164 and 201-208; `io.field_bus = present` adds those of the field bus"
            }
            FieldBus::Absent => "1-64, 101-164 and 201-208",
        }
    }

    /// Switches all of these user outputs, or none. `Err` gives one that a program or IW may not set.
    pub(crate) fn set_user_outputs(
        &mut self,
        states: impl Iterator<Item = (u16, bool)> + Clone,
        bus: FieldBus,
    ) -> Result<(), u16> {
        // All are checked before the first is switched: IW is all or nothing (CMD-IW-05), and so is DOUT.
        let mut lines = states.clone().map(|(line, _)| line);
        if let Some(other) = lines.find(|line| !Signals::is_user_output(*line, bus)) {
            return Err(other);
        }
        for (line, on) in states {
            self.set_output(line, on);
        }
        Ok(())
    }

    /// Drives an input from outside and cancels its scheduled change; false if the line does not exist.
    pub fn drive_input(&mut self, line: u16, on: bool) -> bool {
        switch(&mut self.inputs, &mut self.scheduled_inputs, line, on)
    }

    /// Schedules an input to change to `on` at `at`. Driving the input before then cancels the change.
    pub fn schedule_input(&mut self, line: u16, at: Time, on: bool) {
        if Signals::exists(line) {
            self.scheduled_inputs.insert(line, (at, on));
        }
    }

    /// Removes and returns the scheduled changes that are due: line and state.
    pub fn take_due_inputs(&mut self, now: Time) -> Vec<(u16, bool)> {
        let due = take_due(&mut self.scheduled_inputs, |(at, _)| *at <= now);
        due.into_iter().map(|(line, (_, on))| (line, on)).collect()
    }

    /// Forces a line to a state, or releases it (`None`); false if the line does not exist.
    pub fn force(&mut self, kind: IoKind, line: u16, state: Option<bool>) -> bool {
        let exists = Signals::exists(line);
        match state.filter(|_| exists) {
            Some(on) => self.forced.insert((kind, line), on),
            None => self.forced.remove(&(kind, line)),
        };
        exists
    }

    /// The state a line is forced to; `None` if it is not forced.
    pub fn forced(&self, kind: IoKind, line: u16) -> Option<bool> {
        self.forced.get(&(kind, line)).copied()
    }

    /// Numbers of all lines; inputs and outputs have the same.
    pub fn numbers() -> impl Iterator<Item = u16> {
        RANGES.into_iter().flatten()
    }

    /// State of an input as the controller reads it.
    pub fn input(&self, line: u16) -> bool {
        let forced = self.forced(IoKind::Input, line);
        forced.unwrap_or_else(|| self.driven_input(line))
    }

    /// The state to which an input is driven from outside, forced or not.
    pub fn driven_input(&self, line: u16) -> bool {
        self.inputs.contains(&line)
    }

    /// State of an output as it is seen from outside.
    pub fn output(&self, line: u16) -> bool {
        let forced = self.forced(IoKind::Output, line);
        forced.unwrap_or_else(|| self.outputs.contains(&line))
    }

    /// Switches an output and cancels its pulse; false if the line does not exist.
    pub fn set_output(&mut self, line: u16, on: bool) -> bool {
        switch(&mut self.outputs, &mut self.pulses, line, on)
    }

    /// Switches an output on until `until`, if the line exists.
    pub fn pulse_output(&mut self, line: u16, until: Time) {
        if self.set_output(line, true) {
            self.pulses.insert(line, until);
        }
    }

    /// When the pulse of an output ends; `None` if it is not pulsed.
    pub fn pulse_end(&self, line: u16) -> Option<Time> {
        self.pulses.get(&line).copied()
    }

    /// When the next pulse ends or the next scheduled input changes.
    pub fn deadline(&self) -> Option<Time> {
        let drives = self.scheduled_inputs.values().map(|(at, _)| *at);
        self.pulses.values().copied().chain(drives).min()
    }

    /// Turns off the outputs whose pulse has ended.
    pub fn end_due_pulses(&mut self, now: Time) {
        for (line, _) in take_due(&mut self.pulses, |until| *until <= now) {
            self.outputs.remove(&line);
        }
    }

    /// Every line that a snapshot holds, with the name of its field. A pulse of an output that is off is
    /// inconsistent and is reported as line 0, which does not exist.
    pub(crate) fn snapshot_lines(&self) -> impl Iterator<Item = (&'static str, u16)> {
        let inputs = self.inputs.iter().map(|line| ("inputs", *line));
        let outputs = self.outputs.iter().map(|line| ("outputs", *line));
        let pulses = self.pulses.keys().map(|line| {
            let line = if self.outputs.contains(line) { *line } else { 0 };
            ("pulses", line)
        });
        let drives = self.scheduled_inputs.keys().map(|line| ("drives", *line));
        let forced = self.forced.keys().map(|(_, line)| ("forced", *line));
        inputs.chain(outputs).chain(pulses).chain(drives).chain(forced)
    }

    /// RS,SIG: turns off Dout1 to Dout24 (CMD-RS-07).
    pub fn reset_outputs(&mut self) {
        self.outputs.retain(|line| !RESET_OUTPUTS.contains(line));
        self.pulses.retain(|line, _| !RESET_OUTPUTS.contains(line));
    }

    /// Power off: turns off every output, forced ones too. Inputs keep their state: they are driven from outside.
    pub fn clear_outputs(&mut self) {
        self.outputs.clear();
        self.pulses.clear();
        // An output without power is off, forced or not. The force on an input comes from outside, like its state.
        self.forced.retain(|(kind, _), _| *kind == IoKind::Input);
    }

    /// The words of IO; SF sends the first sixteen of each direction.
    pub fn line_words(&self) -> LineWords {
        LineWords {
            inputs: pack_words(|line| self.input(line)),
            outputs: pack_words(|line| self.output(line)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // clause: SF-25 SF-26 SF-27 SF-33 SF-34 SF-41 S27
    #[test]
    fn each_line_has_its_bit() {
        let mut signals = Signals::default();
        for line in [1, 32, 64, 101, 164, 201, 301, 364, 401, 464] {
            assert!(signals.drive_input(line, true));
        }
        let inputs = signals.line_words().inputs;
        assert_eq!(inputs[0], 1);
        assert_eq!(inputs[1], 1 << 15);
        assert_eq!(inputs[3], 1 << 15);
        assert_eq!(inputs[4], 1);
        assert_eq!(inputs[7], 1 << 15);
        assert_eq!(inputs[8], 1);
        assert_eq!((inputs[12], inputs[15]), (1, 1 << 15));
        assert_eq!((inputs[16], inputs[19]), (1, 1 << 15));
        signals.set_output(109, true);
        assert_eq!(signals.line_words().outputs[4], 1 << 8);
    }

    // clause: CMD-RS-07 CMD-RS-08
    #[test]
    fn signal_reset_touches_24_outputs() {
        let mut signals = Signals::default();
        for line in [1, 24, 25, 101] {
            signals.set_output(line, true);
        }
        signals.reset_outputs();
        assert!(!signals.output(1) && !signals.output(24));
        assert!(signals.output(25) && signals.output(101));
    }

    #[test]
    fn lines_that_do_not_exist_are_refused() {
        let mut signals = Signals::default();
        for line in [0, 65, 100, 165, 200, 265, 300, 365, 400, 465] {
            assert!(!signals.drive_input(line, true));
            assert!(!signals.set_output(line, true));
        }
        assert_eq!(signals, Signals::default());
    }
}
