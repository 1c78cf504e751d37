//! The commands of the host: the 23 of Table 5.1, and those that real hosts send beyond it (hosts 2).
//!
//! `table.rs` has one row for each command; everything that enumerates commands is derived from it. One small file for
//! each group of operands has its grammar, its encoder and its tests. Whether a command is served or permitted, and what
//! it does, is the controller's.

mod files;
mod guide;
mod lines;
mod macros;
mod number;
mod operand;
mod operate;
mod row;
mod table;
mod variable;

pub use guide::{JogDirection, PositionQuery, ZsFrame};
pub use lines::{LineWrite, MAX_LINES, MAX_WORD_LINES};
pub use number::Number;
pub use operate::{InternalCommand, MAX_WATCHDOG_MS, Reset, RunMode};
pub use row::{Answer, CommandPermission, CommandRow, Sender, Source};
pub use table::{COMMANDS, Command};
pub use variable::{MAX_VALUES, VariableKind, VariableRead, VariableWrite};

pub(crate) use row::{count_permissions, permission_names};

use crate::prelude::*;
use crate::text::CR;
use operand::Operands;

/// The reason why a message is not a command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// It does not begin with the letters of a command (FRM-06, CMD-LST-04).
    #[error("unknown command \"{letters}\"")]
    Unknown {
        /// The first two bytes of the message, printable.
        letters: String,
    },
    /// The command is known and what follows it is wrong (FRM-07, FRM-18).
    #[error("{letters}: expected {expected}, found {found} at byte {at}")]
    Malformed {
        /// The letters of the command.
        letters: &'static str,
        /// The grammar's expectation.
        expected: String,
        /// The message from there on, printable and cut.
        found: String,
        /// The position in bytes from the start of the message.
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
        let row = CommandRow::of_letters(letters);
        let row = row.ok_or_else(|| CommandError::Unknown {
            letters: excerpt(letters),
        })?;
        (row.parse)(Operands::new(row.letters, message))
    }

    /// The data section that says the command, CR included (not so for FL), in the form that the vendor's
    /// client library sends.
    pub fn encode(&self) -> Vec<u8> {
        let letters = self.letters().as_bytes();
        match self.operands() {
            Encoding::None => [letters, &[CR]].concat(),
            Encoding::Text(operands) => [letters, b",", operands.as_bytes(), &[CR]].concat(),
            Encoding::Content(content) => [letters, b",", content].concat(),
        }
    }

    /// The two letters.
    pub fn letters(&self) -> &'static str {
        self.row().letters
    }

    /// Its row in the permission tables: the letters, and `RS,ERR` for the reset of alarms (decision D4).
    pub fn permission_row(&self) -> &'static str {
        self.row().name
    }

    /// Whether the manual does not have it, `RS,ERR` included (decision D0).
    pub fn is_extension(&self) -> bool {
        self.row().is_extension()
    }
}

/// The operands of a command on the wire.
enum Encoding<'a> {
    /// No operands and no comma.
    None,
    /// Operands after a comma, CR at the end.
    Text(String),
    /// The content of a file after a comma. No CR: it would be part of the file (FL-01).
    Content(&'a [u8]),
}

/// Operands as text.
fn text<'a>(operands: impl Into<String>) -> Encoding<'a> {
    Encoding::Text(operands.into())
}

/// One number as operand.
fn decimal<'a>(number: u8) -> Encoding<'a> {
    Encoding::Text(number.to_string())
}

/// Bytes of a peer, shortened and made printable for a message.
pub(crate) fn excerpt(bytes: &[u8]) -> String {
    /// Bytes worth showing.
    const SHOWN: usize = 24;
    let shown = bytes.get(..SHOWN).unwrap_or(bytes);
    let more = if shown.len() < bytes.len() { "..." } else { "" };
    format!("{}{more}", shown.escape_ascii())
}

#[cfg(test)]
mod tests;
