//! The 23 commands of Table 5.1, and those that real hosts send beyond it (hosts 2): what a message asks for.
//! One small file per group of operands holds its grammar, its encoder and its tests; two tables wire them.
//! Whether a command is served or permitted, and what it does, is the controller's.

mod extensions;
mod files;
mod frame;
mod internal;
mod jog;
mod line_value;
mod lines;
mod number;
mod operand;
mod request;
mod reset;
mod statement;
mod table;
mod variable;
mod watchdog;

pub use extensions::{EXTENSIONS, SCARA_MANUAL};
pub use frame::ZsFrame;
pub use internal::{InternalCommand, RunMode};
pub use jog::JogDirection;
pub use line_value::{MAX_LINES_READ, MAX_LINES_WRITTEN};
pub use lines::{LineWrite, MAX_LINES};
pub use number::Number;
pub use request::PositionQuery;
pub use reset::Reset;
pub use table::{COMMANDS, CommandRow, Sender};
pub use variable::{MAX_VALUES, VariableKind, VariableRead, VariableWrite};
pub use watchdog::MAX_WATCHDOG_MS;

use crate::name::{FileName, VariableName};
use crate::status::AlarmLevel;
use crate::text::CR;
use alloc::string::String;
use alloc::vec::Vec;
use operand::Operands;
use thiserror::Error;

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
    Ec(InternalCommand),
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
    /// Extension: quick status; 1 is the only number known and read (hosts SM).
    Sm(u8),
    /// Extension: the host's watchdog. It is not running after a time of 0 (hosts 2).
    Wd {
        /// Longest silence of the host in milliseconds; 0 stops the watchdog.
        timeout_ms: u32,
        /// Level of the alarm that follows; `None` is written 0.
        level: Option<AlarmLevel>,
    },
    /// Extension: current alarms (hosts 7.2).
    Ac,
    /// Extension: alarm history (hosts 7.2).
    Ah,
    /// Extension: input and output words; 1 is the only number known and read (hosts 2).
    Io(u8),
    /// Extension: read successive input lines as one number, the first line in bit 0 (hosts 2).
    Hi {
        /// Number of the first line; the last is at most 65535.
        first: u16,
        /// How many, 1 to [`MAX_LINES_READ`].
        count: u8,
    },
    /// Extension: write successive output lines as one number, the first line in bit 0 (hosts 2).
    Ho {
        /// Number of the first line; the last is at most 65535.
        first: u16,
        /// How many, 1 to [`MAX_LINES_WRITTEN`].
        count: u8,
        /// Below two to the power of `count`.
        value: u32,
    },
    /// Extension: a present position (hosts 2).
    Pr(PositionQuery),
    /// Extension: present speed, 0 of the joints, 1 in world coordinates (hosts 2).
    Vl(u8),
    /// Extension: set a coordinate system (hosts 2).
    Zs {
        /// Which of them.
        frame: ZsFrame,
        /// Name of the global coordinate variable.
        name: VariableName,
        /// X Y Z C, or X Y Z A B C, in mm and degrees; finite. The arm decides which.
        values: Vec<f64>,
    },
    /// Extension: maintenance information (S29).
    Mn,
    /// Extension: guide mode, 0 jog, 1 inching, 2 free (hosts 2).
    Md(u8),
    /// Extension: guide rate, 0 slow, 1 mid, 2 fast (hosts 2, SF).
    Rt(u8),
    /// Extension: guide coordinate system, 0 joint, 1 tool, 2 work, 3 world (hosts 2).
    Sc(u8),
    /// Extension: guide an axis (hosts 2).
    Jg {
        /// Axis, 1 to 8.
        axis: u8,
        /// Where to.
        motion: JogDirection,
    },
}

/// Why a message is no command.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CommandError {
    /// It does not begin with the letters of a command (FRM-06, CMD-LST-04).
    #[error("command letters of Table 5.1 or of an extension expected, \"{letters}\" found")]
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

impl Command {
    /// Reads a message (without its CR).
    ///
    /// # Errors
    /// Unknown letters, or operands that do not fit them.
    pub fn parse(message: &[u8]) -> Result<Command, CommandError> {
        let letters = message.get(..2).unwrap_or(message);
        let row = COMMANDS
            .iter()
            .chain(EXTENSIONS)
            .find(|row| row.letters.as_bytes().eq_ignore_ascii_case(letters));
        let row = row.ok_or_else(|| CommandError::Unknown {
            letters: excerpt(letters),
        })?;
        (row.read)(Operands::new(row.letters, message))
    }

    /// The data section that says the command, CR included (not so for FL), in the form that the vendor's
    /// client library sends.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut data = self.letters().as_bytes().to_vec();
        match self {
            Command::Rn | Command::Sp | Command::Br | Command::So | Command::Ca | Command::Su => {}
            Command::Eu | Command::Ok | Command::Ng | Command::Fd | Command::Sf | Command::Vr => {}
            Command::Rs(reset) => operand(&mut data, reset.as_str()),
            Command::Sl(name) | Command::Ul(name) | Command::Dl(name) | Command::Er(name) => {
                operand(&mut data, name.as_str());
            }
            Command::Ec(internal) => operand(&mut data, &internal::encode(*internal)),
            Command::Mw(write) => operand(&mut data, &variable::encode_write(write)),
            Command::Mr(read) => operand(&mut data, &variable::encode_read(read)),
            Command::Iw(lines) => operand(&mut data, &lines::encode(lines)),
            Command::Do(statement) => operand(&mut data, statement),
            Command::Ac | Command::Ah | Command::Mn => {}
            Command::Sm(number) | Command::Io(number) | Command::Vl(number) => digits(&mut data, *number),
            Command::Md(number) | Command::Rt(number) | Command::Sc(number) => digits(&mut data, *number),
            Command::Pr(query) => digits(&mut data, query.code()),
            Command::Wd { timeout_ms, level } => operand(&mut data, &watchdog::encode(*timeout_ms, *level)),
            Command::Hi { first, count } => operand(&mut data, &line_value::encode_read(*first, *count)),
            Command::Ho { first, count, value } => {
                operand(&mut data, &line_value::encode_write(*first, *count, *value));
            }
            Command::Zs { frame, name, values } => operand(&mut data, &frame::encode(*frame, name, values)),
            Command::Jg { axis, motion } => operand(&mut data, &jog::encode(*axis, *motion)),
            Command::Fl(content) => {
                data.push(b',');
                data.extend_from_slice(content);
                return data;
            }
        }
        data.push(CR);
        data
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
            Command::Sm(_) => "SM",
            Command::Wd { .. } => "WD",
            Command::Ac => "AC",
            Command::Ah => "AH",
            Command::Io(_) => "IO",
            Command::Hi { .. } => "HI",
            Command::Ho { .. } => "HO",
            Command::Pr(_) => "PR",
            Command::Vl(_) => "VL",
            Command::Zs { .. } => "ZS",
            Command::Md(_) => "MD",
            Command::Rt(_) => "RT",
            Command::Sc(_) => "SC",
            Command::Jg { .. } => "JG",
            Command::Mn => "MN",
        }
    }

    /// Its row in the permission tables: the letters, and `RS,ERR` for the reset of alarms (decision D4).
    #[must_use]
    pub fn permission_row(&self) -> &'static str {
        match self {
            Command::Rs(Reset::Alarm) => "RS,ERR",
            other => other.letters(),
        }
    }

    /// Whether the manual does not have it, `RS,ERR` included (decision D0).
    #[must_use]
    pub fn is_extension(&self) -> bool {
        let row = self.permission_row();
        !COMMANDS.iter().any(|command| command.letters == row)
    }
}

/// Adds a comma and a number.
fn digits(data: &mut Vec<u8>, number: u8) {
    operand(data, &alloc::format!("{number}"));
}

/// Adds a comma and the operands.
fn operand(data: &mut Vec<u8>, text: &str) {
    data.push(b',');
    data.extend_from_slice(text.as_bytes());
}

/// Bytes of a peer as they may stand in a message: not too many, and printable.
pub(crate) fn excerpt(bytes: &[u8]) -> String {
    /// Bytes worth showing.
    const SHOWN: usize = 24;
    let shown = bytes.get(..SHOWN).unwrap_or(bytes);
    alloc::format!(
        "{}{}",
        shown.escape_ascii(),
        if shown.len() < bytes.len() { "..." } else { "" }
    )
}

#[cfg(test)]
mod tests;
