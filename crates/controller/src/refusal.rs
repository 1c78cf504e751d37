//! Reasons of refusals: of a text, a button, a variable, a selection. A reason stays a value until it is shown:
//! findings compare variants, events and logs show the words.

use crate::drive::DriveError;
use crate::motion::MotionError;
use crate::port::Port;
use crate::prelude::*;
use scol_mini::{AccessError, ValueKind};
use ts3100_proto::command::CommandError;
use ts3100_proto::file::FileError;
use ts3100_proto::name::NameError;
use ts3100_proto::status::MasterMode;

/// The reason for which a text is refused, in words for the author of the host program.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Refusal {
    // The text.
    #[error("over-long text")]
    OverLong,
    #[error("wrong checksum: expected {expected:02X}, found {found:02X}")]
    Checksum { expected: u8, found: u8 },
    #[error("expected ETX at the place that the length gives")]
    NoEtx,
    #[error("expected CR before ETX")]
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
    #[error("FL without an open download; send DL first")]
    NoDownload,
    #[error("OK and NG are answers, not commands")]
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
    #[error("RS is accepted only while the program is stopped; send SP first")]
    NotStopped,
    #[error("expected a control right from 0 to 2")]
    NoSuchRight,
    #[error("the robot is running; send SP first")]
    Running,
    #[error("a program is running; stop it first")]
    ProgramRuns,
    #[error("another DO statement is still running")]
    DirectRuns,
    /// The statement of DO, as a diagnostic shows it.
    #[error("{0}")]
    Statement(String),
    #[error("line {0} cannot be used here")]
    NoSuchLine(u16),
    /// An output that hosts do not write.
    #[error("{0}")]
    NoOutput(String),
    #[error("expected coordinates in the range of a real, found a larger number")]
    NotReal,
    #[error("expected a coordinate, found {0} values")]
    NoCoordinate(usize),

    // Files.
    #[error("file {0} is not on the RAM drive")]
    NoFile(String),
    #[error("file {0} is being downloaded on another port; wait until that ends")]
    Downloading(String),
    #[error("a parameter file cannot be erased; download another one to replace it")]
    Permanent,
    #[error("the selected file cannot be erased; deselect it with RS,SEL first")]
    Selected,
    #[error("the robot was started during the download")]
    Started,
    #[error("this file was refused; begin again with DL")]
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

/// The reason for which an operation at the panel had no effect, or the command or signal that does the same.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum OperateError {
    #[error("the {0} has no INTERNAL position (5.3.2)")]
    NoInternal(&'static str),
    #[error("the emergency stop is pressed")]
    EmergencyStop,
    #[error("the safety switch is open")]
    SafetyOpen,
    #[error("an alarm of level 8 is active; reset it first")]
    ServoAlarm,
    #[error("an alarm of level 4 or 8 is active; reset it first")]
    StartAlarm,
    #[error("servo power is off")]
    ServoOff,
    #[error("feed hold is on; release it first")]
    FeedHold,
    #[error("a DO statement is under way")]
    Direct,
    #[error("the arm is being jogged; stop the jog first")]
    Jogging,
    #[error("no file is selected")]
    NoFile,
    #[error("the program has no label RCYCLE")]
    NoRcycle,
    #[error("servo power is already on (SV_RDY)")]
    ServoOn,
    #[error("a reset is accepted only while the program is stopped")]
    NotStopped,
    #[error("the program is running; stop it first")]
    ProgramRuns,
    #[error("the operation mode can be set only while the robot is stopped; stop it first")]
    Running,
    #[error("several inputs changed at the same moment, and only the first is processed")]
    NotFirst,
    #[error("the key switch is not in TEACHING; turn it first")]
    NotTeaching,
    #[error("a program or a DO statement is under way")]
    Busy,
    #[error("the guide mode is FREE; choose another first")]
    Free,
    #[error("the arm is being guided by JG; stop that first")]
    Guided,
    #[error(transparent)]
    Select(#[from] SelectError),
    #[error(transparent)]
    Jog(#[from] MotionError),
}

/// The reason for which a variable was not read or written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum VariableError {
    #[error("no file is selected")]
    NoFile,
    #[error("no variable of GLOBAL or DATA has the name {0}")]
    Unknown(String),
    #[error("the type of {0} is unknown")]
    UnknownKind(String),
    #[error("{name} is {}, not {}", found.description(), asked.description())]
    Kind {
        name: String,
        found: ValueKind,
        asked: ValueKind,
    },
    #[error("type {code} does not match the subscripts of {name}")]
    Subscripts { code: i32, name: String },
    #[error("expected {expected}, found {found}{hint}")]
    Value {
        expected: String,
        found: String,
        hint: &'static str,
    },
    #[error("the file has been downloaded again; select it first")]
    Stale,
    #[error("the file does not compile with that value")]
    Compile,
    #[error(transparent)]
    Access(#[from] AccessError),
    #[error(transparent)]
    Drive(#[from] DriveError),
}

/// The reason for which a file was not selected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SelectError {
    /// Not a file name.
    #[error("file name: {0}")]
    Name(NameError),
    /// Not on the RAM drive.
    #[error("file {0} is not on the RAM drive")]
    Missing(String),
    /// A parameter file.
    #[error("file {0} is a parameter file, not a program")]
    Parameter(String),
    /// A program runs.
    #[error("a program is running; stop it first")]
    Running,
    /// It does not compile; the diagnostics rendered.
    #[error("file {name} has errors\n{rendered}")]
    Errors {
        /// Name of the file.
        name: String,
        /// Its diagnostics with carets.
        rendered: String,
    },
}

impl From<NameError> for SelectError {
    fn from(error: NameError) -> SelectError {
        SelectError::Name(error)
    }
}
