//! The files that a host asks for with SU, SF, EU, VR, CA and MR, and with the extensions SM, AC, AH, PR, VL, IO
//! and MN: one module each, with value, encoder and decoder.
//!
//! All of them are contents, the bytes between `FL,` and EOF. [`crate::file`] cuts them into texts; the controller fills
//! them. This file has the types that several of them share.

pub mod ac;
pub mod ca;
pub mod eu;
pub(crate) mod fields;
pub mod io;
pub mod mn;
pub mod mr;
pub mod position;
pub mod pr;
pub mod sf;
pub mod sm;
pub mod su;
pub mod vr;

use crate::codes::codes;
use crate::prelude::*;
use crate::words::Word;

codes! {
    /// The five columns of tables 5.3 and 5.4, in their order: key switch, and in EXT who has the control right.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
    pub enum MasterMode {
        /// TEACHING.
        Teaching = "TEACHING",
        /// INTERNAL.
        Internal = "INTERNAL",
        /// EXT, control right SIG.
        ExtSig = "EXT (SIG)",
        /// EXT, control right RS-232C.
        ExtRs232c = "EXT (RS-232C)",
        /// EXT, control right ETHER.
        ExtEther = "EXT (ETHER)",
    }
    /// The name of the tables' column, for example `EXT (SIG)`.
    fn as_str -> &'static str;
    impl Word;
}

impl MasterMode {
    /// The value in SF (SF-17): 0 TEACHING, 1 INTERNAL, 2 EXT (SIG), 3 EXT (RS-232C or ETHER).
    pub const fn sf_code(self) -> u16 {
        match self {
            MasterMode::Teaching => 0,
            MasterMode::Internal => 1,
            MasterMode::ExtSig => 2,
            MasterMode::ExtRs232c | MasterMode::ExtEther => 3,
        }
    }
}

codes! {
    /// Execution status: SF offset 2 (SF-06), and `STATUS:` of SU (SU-08).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
    pub enum ExecutionStatus {
        /// Stop (reset): the next start begins at the first step.
        #[default]
        Reset = 0,
        /// Running.
        Running = 1,
        /// Stop (retry): the next start resumes the interrupted movement.
        Retry = 2,
        /// Stop (continue): the next start continues with the present step.
        Continue = 3,
    }
    /// The value in SF, 0 to 3.
    fn code -> u8;
    /// The status of a value in SF.
    fn from_code;
}

impl ExecutionStatus {
    /// The words of the manual, as the six records of SU have them: `stop (retry)`.
    pub const fn as_str(self) -> &'static str {
        match self {
            ExecutionStatus::Reset => "stop (reset)",
            ExecutionStatus::Running => "running",
            ExecutionStatus::Retry => "stop (retry)",
            ExecutionStatus::Continue => "stop (continue)",
        }
    }
}

/// The words for people and programs outside the protocol, everywhere: `stop (retry)`.
impl Word for ExecutionStatus {
    const ALL: &'static [ExecutionStatus] = &ExecutionStatus::ALL;

    fn word(self) -> &'static str {
        self.as_str()
    }
}

impl core::fmt::Display for ExecutionStatus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

codes! {
    /// Level of an alarm (decision D6), the worst first: 8 is the worst, 1 a warning.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    pub enum AlarmLevel {
        /// Motion stops at once, servo power goes off.
        L8 = 8,
        /// Motion stops at once.
        L4 = 4,
        /// The current step ends, then the program stops.
        L2 = 2,
        /// A warning.
        L1 = 1,
    }
    /// 8, 4, 2 or 1.
    fn number -> u8;
    /// The level of 8, 4, 2 or 1.
    fn from_number;
}

/// Why a status file could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file} file, byte {at}: expected {expected}, found {found}")]
pub struct BodyError {
    /// The command that asks for such a file, for example `SU`.
    pub file: &'static str,
    pub expected: &'static str,
    /// The bytes as found; long content is cut.
    pub found: String,
    /// Where, in bytes from the start of the content.
    pub at: usize,
}
