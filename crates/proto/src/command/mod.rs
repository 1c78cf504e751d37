//! The 23 commands of Table 5.1: what a message asks for. One small file per group of operands holds its
//! grammar, its encoder and its tests; the table here wires them. Whether a command is permitted, and what it
//! does, is the controller's.

mod number;
mod variable;

pub use number::Number;
pub use variable::{VariableKind, VariableRead, VariableWrite};

use crate::name::FileName;
use alloc::string::String;
use alloc::vec::Vec;
use thiserror::Error;

/// Values an MW may carry.
pub const MAX_VALUES: usize = 16;
/// Lines an IW may force (CMD-IW-02).
pub const MAX_LINES: usize = 32;

/// A command of the host.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Start automatic operation (CMD-RN-01).
    Rn,
    /// Stop automatic operation (CMD-SP-01).
    Sp,
    /// Servo power off (CMD-BR-01).
    Br,
    /// Servo power on (CMD-SO-01).
    So,
    /// Reset (CMD-RS-01).
    Rs(Reset),
    /// Select the execution file (CMD-SL-01).
    Sl(FileName),
    /// Upload a file from the RAM drive (CMD-UL-01).
    Ul(FileName),
    /// Download a file to the RAM drive (CMD-DL-01).
    Dl(FileName),
    /// Directory of the RAM drive (CMD-CA-01).
    Ca,
    /// Status (CMD-SU-01).
    Su,
    /// Error history (CMD-EU-01).
    Eu,
    /// Erase a file (CMD-ER-01).
    Er(FileName),
    /// A file or a part of one: everything after `FL,` (FL-01).
    Fl(Vec<u8>),
    /// Affirmative answer (CMD-OK-01).
    Ok,
    /// Negative answer (CMD-NG-01).
    Ng,
    /// Internal command (CMD-EC-01).
    Ec(Internal),
    /// Write a global variable (CMD-MW-01).
    Mw(VariableWrite),
    /// Feed hold (CMD-FD-01).
    Fd,
    /// System total status (CMD-SU-01).
    Sf,
    /// Read a global variable (CMD-MR-01).
    Mr(VariableRead),
    /// Force I/O lines (CMD-IW-01).
    Iw(Vec<LineWrite>),
    /// Version (CMD-VR-01).
    Vr,
    /// Execute a statement (CMD-DO-01), kept as it came.
    Do(String),
}

/// What RS resets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reset {
    /// `PRG`: back to step 1, program data initialised (CMD-RS-03).
    Program,
    /// `STP`: back to step 1, program data kept (CMD-RS-04).
    Step,
    /// `CYC`: to the label RCYCLE (CMD-RS-05).
    Cycle,
    /// `SIG`: output signals (CMD-RS-07).
    Signal,
    /// `SEL`: the selection of the execution file (CMD-RS-09).
    Select,
}

/// An internal command of EC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Internal {
    /// `MODE`: the operation mode (CMD-EC-03).
    Mode(RunMode),
    /// `OVRD`: the speed override in percent, 1 to 100 (CMD-EC-02).
    Override(u8),
    /// `BREAK`: stop at once (CMD-EC-04).
    Break,
}

/// Operation mode (CMD-RN-06).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunMode {
    /// Begins again at the end.
    Continuous,
    /// Once to the end.
    Cycle,
    /// One statement.
    Step,
    /// Through the next motion.
    Segment,
}

impl RunMode {
    /// All modes.
    pub const ALL: [RunMode; 4] = [RunMode::Continuous, RunMode::Cycle, RunMode::Step, RunMode::Segment];

    /// The word in lower case, as the status file has it (SU-04).
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            RunMode::Continuous => "continuous",
            RunMode::Cycle => "cycle",
            RunMode::Step => "step",
            RunMode::Segment => "segment",
        }
    }
}

/// One line that IW forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineWrite {
    /// Number of the line.
    pub line: u16,
    /// ON or OFF.
    pub on: bool,
}

/// Why a message is no command.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CommandError {
    /// It does not begin with the letters of a command (FRM-06, CMD-LST-04).
    #[error("command letters of Table 5.1 expected, {letters:?} found")]
    Unknown {
        /// What stands in their place.
        letters: String,
    },
    /// The command is known and what follows it is wrong (FRM-07, FRM-18).
    #[error("{letters}: {expected} expected, {found} found at byte {at}")]
    Malformed {
        /// The command.
        letters: &'static str,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
        /// Where, in bytes from the start of the message.
        at: usize,
    },
}

/// Who sends a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The host alone.
    Host,
    /// Host and controller.
    Both,
}

/// A row of Table 5.1.
#[derive(Debug, Clone, Copy)]
pub struct CommandRow {
    /// The two letters.
    pub letters: &'static str,
    /// What it is for.
    pub description: &'static str,
    /// How it is written.
    pub form: &'static str,
    /// Who sends it.
    pub sender: Sender,
}

/// Table 5.1 in the order of the manual.
pub const COMMANDS: &[CommandRow] = &[];

impl Command {
    /// Reads a message (without its CR).
    ///
    /// # Errors
    /// Unknown letters, or operands that do not fit them.
    pub fn parse(message: &[u8]) -> Result<Command, CommandError> {
        Err(CommandError::Unknown { letters: excerpt(message) })
    }

    /// The data section that says the command, CR included (not so for FL), in the form that the vendor's
    /// client library sends.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        self.letters().as_bytes().to_vec()
    }

    /// The two letters.
    #[must_use]
    pub fn letters(&self) -> &'static str {
        match self {
            Command::Rn => "RN",
            Command::Sp => "SP",
            Command::Br => "BR",
            Command::So => "SO",
            Command::Rs(_) => "RS",
            Command::Sl(_) => "SL",
            Command::Ul(_) => "UL",
            Command::Dl(_) => "DL",
            Command::Ca => "CA",
            Command::Su => "SU",
            Command::Eu => "EU",
            Command::Er(_) => "ER",
            Command::Fl(_) => "FL",
            Command::Ok => "OK",
            Command::Ng => "NG",
            Command::Ec(_) => "EC",
            Command::Mw(_) => "MW",
            Command::Fd => "FD",
            Command::Sf => "SF",
            Command::Mr(_) => "MR",
            Command::Iw(_) => "IW",
            Command::Vr => "VR",
            Command::Do(_) => "DO",
        }
    }
}

/// Bytes of a peer as they may stand in a message: not too many, and printable.
pub(crate) fn excerpt(bytes: &[u8]) -> String {
    /// Bytes worth showing.
    const SHOWN: usize = 24;
    let shown = bytes.get(..SHOWN).unwrap_or(bytes);
    alloc::format!("{}{}", shown.escape_ascii(), if shown.len() < bytes.len() { "..." } else { "" })
}
