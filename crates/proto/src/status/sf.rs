//! The system total status of SF: a binary file of fixed offsets, big-endian, in the two lengths that
//! real hosts read (hosts SF). What the values are is the controller's business.

use super::{AlarmLevel, BodyError, ExecutionStatus};
use super::fields::Field;
use alloc::string::String;
use alloc::vec::Vec;

/// Slots for current alarms.
pub const ALARM_SLOTS: usize = 10;
/// An empty alarm slot (decision D6).
pub const NO_ALARM: u16 = 0xFFFF;
/// Bytes of a coordinate system's name, filled with NUL (SF-45).
pub const NAME_LENGTH: usize = 20;

/// What SF tells. Coordinates in mm and degrees; in the six-axis layout only the first six count.
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
    /// Guidance coordinate system: 0 joint, 1 tool, 2 work, 3 world.
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
    /// Input words 1 to 16 (SF-26 to SF-32); bit 0 is the lowest line.
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

/// Floats in a group of coordinates, and with them the length (hosts SF).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SfLayout {
    /// Eight axes and four reserved bytes: 276 bytes, as the manual prints it.
    Eight,
    /// Six axes: 248 bytes, as hosts of the SCARA arms read it.
    Six,
}

impl SfLayout {
    /// Floats in a group of coordinates.
    #[must_use]
    pub const fn axes(self) -> usize {
        match self {
            SfLayout::Eight => 8,
            SfLayout::Six => 6,
        }
    }

    /// Length of the file in bytes.
    #[expect(clippy::len_without_is_empty, reason = "the length of a layout is never 0")]
    #[must_use]
    pub const fn len(self) -> usize {
        match self {
            SfLayout::Eight => 276,
            SfLayout::Six => 248,
        }
    }
}

impl SystemStatus {
    /// The content of the file, [`SfLayout::len`] bytes.
    #[must_use]
    pub fn encode(&self, layout: SfLayout) -> Vec<u8> {
        alloc::vec![0; layout.len()]
    }

    /// Reads a content. Axes beyond the layout read 0.
    ///
    /// # Errors
    /// A content of another length, a flag that is neither 0 nor 1, an unknown motion status, a name that
    /// is not ASCII.
    pub fn decode(content: &[u8], layout: SfLayout) -> Result<SystemStatus, BodyError> {
        let _ = layout;
        Err(Field::whole("SF", content).error("248 or 276 bytes"))
    }
}

/// Level, word of code 1, and number of codes (decision D6, SF-22).
const ALARM_RANGES: [(AlarmLevel, u16, u16); 4] =
    [(AlarmLevel::L8, 0, 368), (AlarmLevel::L4, 368, 144), (AlarmLevel::L2, 512, 224), (AlarmLevel::L1, 736, 160)];

/// The word of an alarm; `None` if its level has no such code. Codes count from 1.
#[must_use]
pub fn alarm_word(level: AlarmLevel, code: u16) -> Option<u16> {
    let (_, base, count) = ALARM_RANGES.into_iter().find(|row| row.0 == level)?;
    (1..=count).contains(&code).then(|| base + code - 1)
}

/// Level and code of a word; `None` where the word means no alarm.
#[must_use]
pub fn alarm_of_word(word: u16) -> Option<(AlarmLevel, u16)> {
    let (level, base, _) = ALARM_RANGES.into_iter().find(|row| (row.1..row.1 + row.2).contains(&word))?;
    Some((level, word - base + 1))
}
