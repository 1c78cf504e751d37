//! Why a text is answered NG. It stays a value until it is shown: findings compare variants, events and logs show the
//! words.

use super::OperateError;
use super::variables::VariableError;
use crate::drive::DriveError;
use crate::executor::selection::SelectError;
use crate::port::Port;
use crate::prelude::*;
use ts3100_proto::command::CommandError;
use ts3100_proto::file::FileError;
use ts3100_proto::status::MasterMode;

/// Why a text is refused, in words for the author of the host program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Refusal {
    // The text.
    #[error("over-long text")]
    OverLong,
    #[error("wrong checksum: expected {expected:02X}, found {found:02X}")]
    Checksum { expected: u8, found: u8 },
    #[error("there is no ETX where the length says")]
    NoEtx,
    #[error("no CR before ETX")]
    NoCr,
    #[error("a message of more than 1024 bytes")]
    TooLong,
    #[error(transparent)]
    Command(#[from] CommandError),
    /// A fault answers instead of the robot.
    #[error("{0}")]
    OnPurpose(String),

    // The permission tables.
    #[error("no manual for this arm lists this command (option `extensions`)")]
    NotServed,
    #[error("{letters} is valid on {port} only while the robot is stopped (5.3.2)")]
    OnlyWhenStopped { letters: &'static str, port: Port },
    #[error("{letters} is not valid on {port} in {} (5.3.2)", .mode.as_str())]
    NotInMode {
        letters: &'static str,
        port: Port,
        mode: MasterMode,
    },
    #[error("FL came, but no DL is open")]
    NoDownload,
    #[error("an answer is no command")]
    Answer,

    // The robot's state.
    #[error(transparent)]
    Operate(#[from] OperateError),
    #[error(transparent)]
    Select(#[from] SelectError),
    #[error(transparent)]
    Variable(#[from] VariableError),
    #[error(transparent)]
    Drive(#[from] DriveError),
    #[error("RS is accepted only in stop mode")]
    NotStopped,
    #[error("a control right is 0 to 2")]
    NoSuchRight,
    #[error("the robot is not stopped")]
    Running,
    #[error("a program is running")]
    ProgramRuns,
    #[error("another DO statement is under way")]
    DirectRuns,
    /// The statement of DO, as a diagnostic shows it.
    #[error("{0}")]
    Statement(String),
    #[error("line {0} cannot be used here")]
    NoSuchLine(u16),
    /// An output that hosts do not write.
    #[error("{0}")]
    NoOutput(String),
    #[error("expected a coordinate of numbers in the range of a real, found another")]
    NotReal,
    #[error("expected a coordinate, found {0} values")]
    NoCoordinate(usize),

    // Files.
    #[error("file {0} is not on the RAM drive")]
    NoFile(String),
    #[error("file {0} is being downloaded on another port")]
    Downloading(String),
    #[error("a parameter file cannot be erased")]
    Permanent,
    #[error("the selected file cannot be erased; RS,SEL ends the selection")]
    Selected,
    #[error("the robot was started during the download")]
    Started,
    #[error("a text of a file that was refused before")]
    FileRefused,
    #[error(transparent)]
    File(#[from] FileError),
}

impl Refusal {
    /// Whether the manual does not have the command, or not now: it was not carried out.
    pub(crate) fn is_not_valid(&self) -> bool {
        matches!(
            self,
            Refusal::NotServed | Refusal::OnlyWhenStopped { .. } | Refusal::NotInMode { .. }
        )
    }
}
