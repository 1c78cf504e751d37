//! The system total status of SF: a binary file of fixed offsets, big-endian, in the two lengths that real hosts
//! read (hosts SF).
//!
//! [`SystemStatus`] is the whole file as a value; the controller fills it. [`table`] describes the same bytes field by
//! field, and a test holds the two together.

pub mod table;

use super::fields::Field;
use super::{AlarmLevel, BodyError, ExecutionStatus};
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

impl SystemStatus {
    /// The content of the file, [`SfLayout::len`] bytes.
    pub fn encode(&self, layout: SfLayout) -> Vec<u8> {
        let execution = self.execution.code();
        let [servo, stop, request] = [self.servo, self.emergency_stop, self.su_request].map(u8::from);
        let mut out = Vec::from([servo, stop, execution, request]);
        let alarms = self.alarms.iter().copied().chain(core::iter::repeat(NO_ALARM));
        let words = [
            self.execution_line,
            self.analysis_line,
            self.execution_task,
            self.analysis_task,
            u16::from(self.feed_hold),
            self.guide_coordinate,
            self.guide_rate,
            self.guide_mode,
            self.master_mode,
            DUMMY,
        ];
        out.extend(alarms.take(ALARM_SLOTS).chain(words).flat_map(u16::to_be_bytes));
        let minutes = [self.power_on_minutes, self.run_minutes];
        out.extend(minutes.into_iter().flat_map(u32::to_be_bytes));
        let lines = self.inputs.into_iter().chain(self.outputs);
        out.extend(lines.flat_map(u16::to_be_bytes));
        for group in [self.joint, self.world, self.work] {
            let values = group.into_iter().take(layout.axes());
            out.extend(values.flat_map(f32::to_be_bytes));
        }
        for name in [&self.work_name, &self.tool_name, &self.base_name] {
            put_name(&mut out, name);
        }
        // The reserved tail.
        out.resize(layout.len(), 0);
        out
    }

    /// Reads a content. Axes beyond the layout read 0, empty alarm slots are left out.
    ///
    /// # Errors
    /// A content of another length, a flag that is neither 0 nor 1, an unknown motion status, a name that
    /// is not ASCII.
    pub fn decode(content: &[u8], layout: SfLayout) -> Result<SystemStatus, BodyError> {
        let whole = Field::whole("SF", content);
        if content.len() != layout.len() {
            return Err(whole.error(match layout {
                SfLayout::Eight => "276 bytes",
                SfLayout::Six => "250 bytes",
            }));
        }
        let mut rest = Cursor(whole);
        let axes = layout.axes();
        Ok(SystemStatus {
            servo: rest.flag(1)?,
            emergency_stop: rest.flag(1)?,
            execution: rest.execution()?,
            su_request: rest.flag(1)?,
            alarms: rest.alarms()?,
            execution_line: rest.word()?,
            analysis_line: rest.word()?,
            execution_task: rest.word()?,
            analysis_task: rest.word()?,
            feed_hold: rest.flag(2)?,
            guide_coordinate: rest.word()?,
            guide_rate: rest.word()?,
            guide_mode: rest.word()?,
            master_mode: rest.word()?,
            power_on_minutes: rest.word().and_then(|_dummy| rest.minutes())?,
            run_minutes: rest.minutes()?,
            inputs: rest.words()?,
            outputs: rest.words()?,
            joint: rest.floats(axes)?,
            world: rest.floats(axes)?,
            work: rest.floats(axes)?,
            work_name: rest.name()?,
            tool_name: rest.name()?,
            base_name: rest.name()?,
        })
    }
}

/// Offset 42, reserved (SF-18).
const DUMMY: u16 = 0;

/// Characters beyond ASCII 20-7E go as `?`, so that the fixed width counts characters.
fn put_name(out: &mut Vec<u8>, name: &str) {
    let bytes = name.chars().map(|char| match char {
        ' '..='~' => char as u8,
        _ => b'?',
    });
    out.extend(bytes.chain(core::iter::repeat(0)).take(NAME_LENGTH));
}

/// Reads the content from front to back.
struct Cursor<'a>(Field<'a>);

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize) -> Result<Field<'a>, BodyError> {
        let (head, rest) = self.0.cut(length).ok_or_else(|| self.0.error("more bytes"))?;
        self.0 = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], BodyError> {
        let field = self.take(N)?;
        field.bytes().try_into().map_err(|_| field.error("more bytes"))
    }

    fn word(&mut self) -> Result<u16, BodyError> {
        self.array().map(u16::from_be_bytes)
    }

    fn minutes(&mut self) -> Result<u32, BodyError> {
        self.array().map(u32::from_be_bytes)
    }

    fn alarms(&mut self) -> Result<Vec<u16>, BodyError> {
        let words = self.words::<ALARM_SLOTS>()?.into_iter();
        Ok(words.filter(|word| *word != NO_ALARM).collect())
    }

    fn words<const N: usize>(&mut self) -> Result<[u16; N], BodyError> {
        let mut words = [0; N];
        for word in &mut words {
            *word = self.word()?;
        }
        Ok(words)
    }

    /// Coordinates of the first `count` axes; the others stay 0.
    fn floats(&mut self, count: usize) -> Result<[f32; 8], BodyError> {
        let mut floats = [0.0; 8];
        for float in floats.iter_mut().take(count) {
            *float = f32::from_be_bytes(self.array()?);
        }
        Ok(floats)
    }

    /// A flag in one byte or in two.
    fn flag(&mut self, length: usize) -> Result<bool, BodyError> {
        let field = self.take(length)?;
        match field.bytes() {
            [0] | [0, 0] => Ok(false),
            [1] | [0, 1] => Ok(true),
            _ => Err(field.error("0 or 1")),
        }
    }

    fn execution(&mut self) -> Result<ExecutionStatus, BodyError> {
        let field = self.take(1)?;
        let code = field.bytes().first().copied();
        let known = code.and_then(ExecutionStatus::from_code);
        known.ok_or_else(|| field.error("motion status 0 to 3"))
    }

    fn name(&mut self) -> Result<String, BodyError> {
        let field = self.take(NAME_LENGTH)?;
        let name = field.split(0).next().unwrap_or(field);
        let name = name.text("a name in ASCII, filled with NUL")?;
        Ok(name.trim_end().to_string())
    }
}

/// Runs of alarm words: the level, the code of the first word, the words (decision D6, SF-22, ste80722 S25). That the
/// codes of the second runs go on where the first end is inferred. The six-axis manual prints 895 as the end of level 1;
/// the SCARA edition prints 959.
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

/// Level and code of a word; `None` if the word is no alarm.
pub fn alarm_from_word(word: u16) -> Option<(AlarmLevel, u16)> {
    let mut runs = ALARM_RANGES.iter();
    let (level, first, words) = runs.find(|(_, _, words)| words.contains(&word))?;
    Some((*level, first + word - words.start()))
}

#[cfg(test)]
mod tests;
