//! A cell of the permission tables, and whose print of them there is.
//!
//! Which cells a command has is in its row; the tables are put together in the module above.

use crate::prelude::*;
use crate::status::MasterMode;

/// Cells of a row: one for each [`MasterMode`].
pub const CELLS: usize = MasterMode::ALL.len();

/// One cell of the tables: a command in a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Permission {
    /// Circle: valid.
    Valid,
    /// Triangle: valid when the robot is stopped.
    WhenStopped,
    /// X: invalid.
    Invalid,
}

impl Permission {
    /// The cell of a letter: O, S or X.
    pub(crate) const fn from_letter(letter: u8) -> Option<Permission> {
        match letter {
            b'O' => Some(Permission::Valid),
            b'S' => Some(Permission::WhenStopped),
            b'X' => Some(Permission::Invalid),
            _ => None,
        }
    }
}

/// Whose print of tables 5.3 and 5.4 holds (T2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edition {
    /// The six-axis manual to the letter.
    SixAxisPrint,
    /// The six-axis manual without its misprint: RN on HOST as the SCARA edition has it.
    SixAxis,
    /// The SCARA edition.
    Scara,
}
