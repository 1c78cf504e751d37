//! The 23 commands of Table 5.1: what a message asks for. One small file per group of operands holds its
//! grammar, its encoder and its tests; the table here wires them. Whether a command is permitted, and what it
//! does, is the controller's.

mod files;
mod internal;
mod lines;
mod number;
mod operand;
mod reset;
mod statement;
mod table;
mod variable;

pub use internal::{Internal, RunMode};
pub use lines::{LineWrite, MAX_LINES};
pub use number::Number;
pub use reset::Reset;
pub use table::{COMMANDS, CommandRow, Sender};
pub use variable::{MAX_VALUES, VariableKind, VariableRead, VariableWrite};

use crate::name::FileName;
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

/// Why a message is no command.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CommandError {
    /// It does not begin with the letters of a command (FRM-06, CMD-LST-04).
    #[error("command letters of Table 5.1 expected, \"{letters}\" found")]
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
            Command::Rs(reset) => operand(&mut data, reset.word()),
            Command::Sl(name) | Command::Ul(name) | Command::Dl(name) | Command::Er(name) => {
                operand(&mut data, name.as_str());
            }
            Command::Ec(internal) => operand(&mut data, &internal::encode(*internal)),
            Command::Mw(write) => operand(&mut data, &variable::encode_write(write)),
            Command::Mr(read) => operand(&mut data, &variable::encode_read(read)),
            Command::Iw(lines) => operand(&mut data, &lines::encode(lines)),
            Command::Do(statement) => operand(&mut data, statement),
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
        }
    }
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
