//! The system total status of SF: a binary file of fixed offsets, big-endian, in the two lengths that real hosts
//! read (hosts SF).
//!
//! [`SystemStatus`] is the whole file as a value; the controller fills it. [`table`] has the fields in the order of their
//! bytes, and with them encoder and decoder.

pub mod table;

use super::{AlarmLevel, ExecutionStatus};
use crate::codes::codes;
use crate::prelude::*;
use core::ops::RangeInclusive;

/// Slots for current alarms.
pub const ALARM_SLOTS: usize = 10;
/// An empty alarm slot (decision D6).
pub const NO_ALARM: u16 = 0xFFFF;
/// Bytes of a coordinate system's name, filled with NUL (SF-45).
pub const NAME_LENGTH: usize = 20;

/// The content of SF. Coordinates in mm and degrees; in the six-axis layout only the first six count.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SystemStatus {
    /// Servo power is on.
    pub servo: bool,
    /// The emergency stop switch is on.
    pub emergency_stop: bool,
    /// Motion status.
    pub execution: ExecutionStatus,
    /// The host should ask for SU (SF-21).
    pub su_request: bool,
    /// Words of current alarms as of [`alarm_word`], oldest first; the first ten are sent.
    pub alarms: Vec<u16>,
    /// Line in execution, 0 = none.
    pub execution_line: u16,
    /// Line in analysis, 0 = none.
    pub analysis_line: u16,
    /// Task in execution, 0 = none.
    pub execution_task: u16,
    /// Task in analysis, 0 = none.
    pub analysis_task: u16,
    /// Feed hold is on.
    pub feed_hold: bool,
    /// Coordinate system of jogging: 0 joint, 1 tool, 2 work, 3 world.
    pub guide_coordinate: u16,
    /// Guide rate: 0 slow, 1 mid, 2 fast.
    pub guide_rate: u16,
    /// Guide mode: 0 jog, 1 inching, 2 free.
    pub guide_mode: u16,
    /// Master mode as of [`super::MasterMode::sf_code`], 0 to 3.
    pub master_mode: u16,
    /// Power ON time in minutes.
    pub power_on_minutes: u32,
    /// Program run time in minutes.
    pub run_minutes: u32,
    /// Input words 1 to 16 (SF-26 to SF-32; words 13 to 16: ste80722 S27); bit 0 is the lowest line.
    pub inputs: [u16; 16],
    /// Output words 17 to 32 (SF-33 to SF-40); bit 0 is the lowest line.
    pub outputs: [u16; 16],
    /// Joint coordinates.
    pub joint: [f32; 8],
    /// World coordinates.
    pub world: [f32; 8],
    /// Work coordinates.
    pub work: [f32; 8],
    /// Name of the work coordinate system; 20 ASCII characters at most.
    pub work_name: String,
    /// Name of the tool coordinate system; 20 ASCII characters at most.
    pub tool_name: String,
    /// Name of the base coordinate system; 20 ASCII characters at most.
    pub base_name: String,
}

codes! {
    /// Floats in a group of coordinates, and with them the length (hosts SF).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum SfLayout {
        /// Eight axes and four reserved bytes: 276 bytes, as the manual prints it.
        Eight = 276,
        /// Six floats a group and two reserved bytes: 250 bytes, which fill a text without EOF (ste80722 S23).
        Six = 250,
    }
    /// Length of the file in bytes.
    #[expect(clippy::len_without_is_empty, reason = "the length of a layout is never 0")]
    fn len -> usize;
}

impl SfLayout {
    /// Floats in a group of coordinates.
    pub const fn axes(self) -> usize {
        match self {
            SfLayout::Eight => 8,
            SfLayout::Six => 6,
        }
    }

    /// Which layout a first text of 250 bytes has: [`SfLayout::Six`] fills it, and the manual's first text of several
    /// of [`SfLayout::Eight`] does too (SF-02). A SCARA leaves the sixth value of each group 0, and its X and Y are
    /// never both 0; where they are, the other arm has its seventh and eighth axis.
    pub fn from_first_text(content: &[u8]) -> SfLayout {
        let zero = |at: usize, length: usize| {
            let bytes = content.get(at..at + length);
            bytes.is_some_and(|bytes| bytes.iter().all(|byte| *byte == 0))
        };
        if zero(136, 4) && zero(160, 4) && zero(184, 4) && !zero(140, 8) {
            SfLayout::Six
        } else {
            SfLayout::Eight
        }
    }
}

/// Runs of alarm words: the level, the code of the first word, the words (decision D6, SF-22, ste80722 S25). That the
/// codes of the second runs continue where the first end is inferred. The six-axis manual prints 895 as the end of
/// level 1; the SCARA edition prints 959.
static ALARM_RANGES: [(AlarmLevel, u16, RangeInclusive<u16>); 8] = [
    (AlarmLevel::L8, 1, 0..=367),
    (AlarmLevel::L4, 1, 368..=511),
    (AlarmLevel::L2, 1, 512..=735),
    (AlarmLevel::L1, 1, 736..=959),
    (AlarmLevel::L8, 369, 960..=1471),
    (AlarmLevel::L4, 145, 1472..=1727),
    (AlarmLevel::L2, 225, 1728..=1983),
    (AlarmLevel::L1, 225, 1984..=2239),
];

/// The word of an alarm; `None` if its level has no such code. Codes count from 1.
pub fn alarm_word(level: AlarmLevel, code: u16) -> Option<u16> {
    let mut runs = ALARM_RANGES.iter().filter(|(of, ..)| *of == level);
    runs.find_map(|(_, first, words)| {
        let word = words.start().checked_add(code.checked_sub(*first)?)?;
        words.contains(&word).then_some(word)
    })
}

/// Level and code of a word; `None` if the word is not an alarm.
pub fn alarm_from_word(word: u16) -> Option<(AlarmLevel, u16)> {
    let mut runs = ALARM_RANGES.iter();
    let (level, first, words) = runs.find(|(_, _, words)| words.contains(&word))?;
    Some((*level, first + word - words.start()))
}

#[cfg(test)]
mod tests;
