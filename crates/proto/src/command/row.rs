//! The facts of one command that are data: how it is written, who sends it, how it is answered, where it is valid.
//!
//! `table.rs` has one row for each command, built from these types; `macros.rs` derives the code from the rows. The
//! permission tables in [`crate::permission`] take their cells from here.

use super::operand::Operands;
use super::{Command, CommandError};
use crate::permission::cell::{CELLS, Edition, Permission};

/// Ends the names of operands that come again and again.
const REPEATED: &str = " ...";

/// Who sends a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The host alone.
    Host,
    /// Host and controller (Table 5.2; SP by CMD-SP-06).
    Both,
}

/// Where a command is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Table 5.1 of the manual.
    Manual,
    /// The SCARA edition of the manual alone (ste80722); an extension on other arms.
    ScaraManual,
}

/// How the controller answers a command that it serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// OK; or nothing, for a part of an exchange.
    Acknowledge,
    File,
    /// A file that hosts ask for again and again, and that asking for does not change.
    Status,
}

/// Where a command is valid: its cells in tables 5.3 and 5.4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandPermission {
    /// Number of its row in the table of its source, from 0. Snapshots store the cells in this order.
    pub number: usize,
    /// On HOST: TEACHING, INTERNAL, SIG, RS-232C, ETHER.
    pub host: [Permission; CELLS],
    /// On IP0, in the same order.
    pub ip0: [Permission; CELLS],
    /// Where the SCARA edition prints other cells.
    pub scara: Option<ScaraPermission>,
}

/// Cells of the SCARA edition that differ from those of the six-axis manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScaraPermission {
    /// On HOST, in the order of the tables.
    pub host: [Permission; CELLS],
    /// On IP0.
    pub ip0: [Permission; CELLS],
    /// The six-axis manual has a misprint here, which these cells correct (T2).
    pub corrects: bool,
}

impl CommandPermission {
    /// The cells that an edition has, on HOST and on IP0.
    pub(crate) const fn cells(&self, edition: Edition) -> ([Permission; CELLS], [Permission; CELLS]) {
        match (self.scara, edition) {
            (Some(scara), Edition::Scara) => (scara.host, scara.ip0),
            (Some(scara), Edition::SixAxis) if scara.corrects => (scara.host, scara.ip0),
            _ => (self.host, self.ip0),
        }
    }
}

/// One command: a row of Table 5.1, or an extension.
#[derive(Debug, Clone, Copy)]
pub struct CommandRow {
    /// The two letters.
    pub letters: &'static str,
    /// The name in the permission tables: the letters, or `RS,ERR`, which shares its letters with RS.
    pub name: &'static str,
    /// How it is written, with operands as `<name>`.
    pub form: &'static str,
    /// A message of it in canonical form, without CR.
    pub example: &'static str,
    /// Names of its operands in order; those that end in ` ...` come again and again. Empty without operands.
    pub operands: &'static [&'static str],
    /// Its effect in one sentence, as `ts3100 host` shows it.
    pub help: &'static str,
    /// Where it is described.
    pub source: Source,
    /// Who sends it.
    pub sender: Sender,
    /// How it is answered.
    pub answer: Answer,
    /// Where it is valid. A part of an exchange that another command opens has no row (PRM-LEG-05).
    pub permission: Option<CommandPermission>,
    /// Reads its operands.
    pub(super) parse: fn(Operands<'_>) -> Result<Command, CommandError>,
}

impl CommandRow {
    /// The first row of these two letters, in upper or lower case.
    pub(crate) fn of_letters(letters: &[u8]) -> Option<&'static CommandRow> {
        let mut rows = super::COMMANDS.iter();
        rows.find(|row| row.letters.as_bytes().eq_ignore_ascii_case(letters))
    }

    /// Whether the manual of the six-axis robots does not have it (decision D0).
    pub const fn is_extension(&self) -> bool {
        !matches!(self.source, Source::Manual)
    }

    /// The name of the operand at this index, from 0, without ` ...`, and its number among those of the same name, from
    /// 1, if the name comes again and again; `None` beyond the last.
    pub fn operand_name(&self, index: usize) -> Option<(&'static str, Option<usize>)> {
        let first = self.operands.iter().position(|name| name.ends_with(REPEATED));
        let first = first.unwrap_or(self.operands.len());
        if index < first {
            return self.operands.get(index).map(|name| (*name, None));
        }
        let repeated = self.operands.get(first..).unwrap_or_default();
        let round = (index - first).checked_div(repeated.len())?;
        let name = repeated.get((index - first) % repeated.len())?;
        Some((name.trim_end_matches(REPEATED), Some(round + 1)))
    }

    /// Whether blanks separate its operands (5.3.3).
    pub fn separates_by_blanks(&self) -> bool {
        self.operands.len() > 1
    }
}

/// A row of tables 5.3 and 5.4: one letter for each mode, `O` valid, `S` valid when stopped, `X` invalid.
pub(super) const fn valid(number: usize, host: &str, ip0: &str) -> Option<CommandPermission> {
    Some(CommandPermission {
        number,
        host: cells(host),
        ip0: cells(ip0),
        scara: None,
    })
}

/// The same, with the cells of the SCARA edition where they differ; `corrects` if those of the six-axis manual are a misprint.
pub(super) const fn valid_unless_scara(
    number: usize,
    [host, ip0]: [&str; 2],
    [scara_host, scara_ip0]: [&str; 2],
    corrects: bool,
) -> Option<CommandPermission> {
    Some(CommandPermission {
        number,
        host: cells(host),
        ip0: cells(ip0),
        scara: Some(ScaraPermission {
            host: cells(scara_host),
            ip0: cells(scara_ip0),
            corrects,
        }),
    })
}

/// Runs while the crate is compiled, so that a wrong letter in the table does not build.
const fn cells(letters: &str) -> [Permission; CELLS] {
    let letters = letters.as_bytes();
    assert!(letters.len() == CELLS, "one letter for each mode");
    let mut cells = [Permission::Invalid; CELLS];
    let mut column = 0;
    while column < CELLS {
        let cell = Permission::from_letter(letters[column]);
        assert!(cell.is_some(), "O, S or X");
        if let Some(cell) = cell {
            cells[column] = cell;
        }
        column += 1;
    }
    cells
}

/// How many rows the permission table of the manual, or that of the extensions, has.
pub(crate) const fn count_permissions(rows: &[CommandRow], extensions: bool) -> usize {
    let (mut count, mut index) = (0, 0);
    while index < rows.len() {
        if rows[index].permission.is_some() && rows[index].is_extension() == extensions {
            count += 1;
        }
        index += 1;
    }
    count
}

/// The rows of that table in their order, each with its name.
pub(crate) const fn permission_names<const N: usize>(
    rows: &[CommandRow],
    extensions: bool,
) -> [&'static str; N] {
    let mut names = [""; N];
    let mut index = 0;
    while index < rows.len() {
        let row = rows[index];
        index += 1;
        let Some(permission) = row.permission else {
            continue;
        };
        if row.is_extension() == extensions {
            assert!(names[permission.number].is_empty(), "each number once");
            names[permission.number] = row.name;
        }
    }
    names
}
