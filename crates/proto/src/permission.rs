//! Which command is valid on which port in which mode: tables 5.3 and 5.4 of the manual, and the extensions in the
//! same form.
//!
//! The cells are in the rows of the commands; users may replace them by a file (`data/permissions.txt` has the form).
//! The controller decides when the robot counts as stopped and how it refuses; the row of a command is
//! [`Command::permission_row`](crate::command::Command::permission_row). What a cell says is in `cell`, which the rows of
//! the commands use.

pub(crate) mod cell;

pub use cell::{CELLS, Edition, Permission};

use crate::command::{COMMANDS, count_permissions, permission_names};
use crate::prelude::*;
use crate::status::MasterMode;
use alloc::collections::BTreeSet;
use core::iter::Peekable;

/// A port that speaks the simple protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ProtocolPort {
    /// The serial HOST port, table 5.3.
    Host,
    /// The Ethernet channel IP0, table 5.4.
    Ip0,
}

impl ProtocolPort {
    /// Both, in the order of the tables.
    pub const ALL: [ProtocolPort; 2] = [ProtocolPort::Host, ProtocolPort::Ip0];
}

/// The rows of tables 5.3 and 5.4, in the order of the manual.
pub const ROWS: [&str; count_permissions(COMMANDS, false)] = permission_names(COMMANDS, false);

/// The rows of the extensions (decision D4); `RS,ERR` is the reset of alarms. Snapshots store the cells in this order,
/// so a new row goes to the end.
pub const EXTENSION_ROWS: [&str; count_permissions(COMMANDS, true)] = permission_names(COMMANDS, true);

/// The columns by their names in the file, in the order of [`MasterMode::ALL`].
const COLUMNS: [&str; CELLS] = ["TEACHING", "INTERNAL", "SIG", "RS-232C", "ETHER"];

type Row = [Permission; CELLS];
type Rows<const N: usize> = [Row; N];

/// The tables of either port, the manual's and that of the extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PermissionTable {
    host: Rows<{ ROWS.len() }>,
    ip0: Rows<{ ROWS.len() }>,
    #[serde(with = "extension_rows::host")]
    host_extensions: Rows<{ EXTENSION_ROWS.len() }>,
    #[serde(with = "extension_rows::ip0")]
    ip0_extensions: Rows<{ EXTENSION_ROWS.len() }>,
}

/// Rows of extensions that every table has. A table of before may lack later ones, which are then as printed.
const REQUIRED_EXTENSIONS: usize = 15;

static SIX_AXIS_PRINT: PermissionTable = PermissionTable::build(Edition::SixAxisPrint);
static SIX_AXIS: PermissionTable = PermissionTable::build(Edition::SixAxis);
static SCARA: PermissionTable = PermissionTable::build(Edition::Scara);

/// The rows of the extensions in a snapshot. Later rows at the end are omitted while they are as printed, so that a new
/// command does not change the snapshot of a controller that was not configured for it.
mod extension_rows {
    use super::{EXTENSION_ROWS, REQUIRED_EXTENSIONS, Row, Rows, SIX_AXIS_PRINT};
    use alloc::vec::Vec;
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::{Serialize, Serializer};

    const COUNT: usize = EXTENSION_ROWS.len();
    /// Rows that are always written: those of the first version of the snapshot format.
    const WRITTEN: usize = REQUIRED_EXTENSIONS + 1;

    fn write<S: Serializer>(rows: &Rows<COUNT>, printed: &Rows<COUNT>, to: S) -> Result<S::Ok, S::Error> {
        let mut both = rows.iter().zip(printed);
        let last = both.rposition(|(row, printed)| row != printed);
        let count = last.map_or(0, |last| last + 1).max(WRITTEN);
        rows.get(..count).unwrap_or(rows).serialize(to)
    }

    fn read<'de, D: Deserializer<'de>>(printed: &Rows<COUNT>, from: D) -> Result<Rows<COUNT>, D::Error> {
        let mut rows = Vec::<Row>::deserialize(from)?;
        if let Some(later) = printed
            .get(rows.len()..)
            .filter(|_| rows.len() >= REQUIRED_EXTENSIONS)
        {
            rows.extend_from_slice(later);
        }
        let found = rows.len();
        rows.try_into()
            .map_err(|_| D::Error::custom(format_args!("expected {COUNT} rows of extensions, found {found}")))
    }

    macro_rules! port {
        ($port:ident, $field:ident) => {
            pub(super) mod $port {
                use super::*;

                pub(in super::super) fn serialize<S: Serializer>(
                    rows: &Rows<COUNT>,
                    to: S,
                ) -> Result<S::Ok, S::Error> {
                    write(rows, &SIX_AXIS_PRINT.$field, to)
                }

                pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
                    from: D,
                ) -> Result<Rows<COUNT>, D::Error> {
                    read(&SIX_AXIS_PRINT.$field, from)
                }
            }
        };
    }

    port!(host, host_extensions);
    port!(ip0, ip0_extensions);
}

/// Why a permission file cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: expected {expected}, found {found}")]
pub struct PermissionError {
    /// Line of the file, from 1.
    pub line: usize,
    pub expected: String,
    /// The line as found; a long one is cut.
    pub found: String,
}

impl PermissionTable {
    /// The tables of an edition. The extensions are those of the SCARA edition in each.
    pub fn of(edition: Edition) -> &'static PermissionTable {
        match edition {
            Edition::SixAxisPrint => &SIX_AXIS_PRINT,
            Edition::SixAxis => &SIX_AXIS,
            Edition::Scara => &SCARA,
        }
    }

    const fn build(edition: Edition) -> PermissionTable {
        let mut table = PermissionTable {
            host: [[Permission::Valid; CELLS]; _],
            ip0: [[Permission::Valid; CELLS]; _],
            host_extensions: [[Permission::Valid; CELLS]; _],
            ip0_extensions: [[Permission::Valid; CELLS]; _],
        };
        let mut index = 0;
        while index < COMMANDS.len() {
            let row = &COMMANDS[index];
            index += 1;
            let Some(permission) = row.permission else {
                continue;
            };
            let (host, ip0) = permission.cells(edition);
            if row.is_extension() {
                table.host_extensions[permission.number] = host;
                table.ip0_extensions[permission.number] = ip0;
            } else {
                table.host[permission.number] = host;
                table.ip0[permission.number] = ip0;
            }
        }
        table
    }

    /// Reads tables in the form of `data/permissions.txt`, in any order. Rows of extensions that a table of before lacks are
    /// as printed.
    ///
    /// # Errors
    /// A line that is neither a heading nor a row, a cell that is not O, S or X, a row or a table twice or missing.
    pub fn parse(text: &str) -> Result<PermissionTable, PermissionError> {
        let mut table = *PermissionTable::of(Edition::SixAxisPrint);
        let mut missing = Vec::from(HEADINGS);
        let end = text.lines().count().max(1);
        let mut lines = lines(text).peekable();
        while let Some((number, line)) = lines.next() {
            let tables = HEADINGS.into_iter().zip(table.tables_mut());
            let Some((_, (names, rows))) = tables.into_iter().find(|(heading, _)| *heading == line) else {
                let expected = "[HOST], [IP0], [HOST extensions] or [IP0 extensions]";
                return Err(error(number, expected, line));
            };
            let place = missing.iter().position(|heading| *heading == line);
            missing.remove(place.ok_or_else(|| error(number, "each table once", line))?);
            parse_table(&mut lines, end, names, rows)?;
        }
        match missing.first() {
            Some(heading) => Err(error(end, heading, END)),
            None => Ok(table),
        }
    }

    /// Names and cells of the rows of each table, in the order of [`HEADINGS`].
    fn tables_mut(&mut self) -> [(&'static [&'static str], &mut [Row]); 4] {
        [
            (&ROWS, &mut self.host),
            (&ROWS, &mut self.ip0),
            (&EXTENSION_ROWS, &mut self.host_extensions),
            (&EXTENSION_ROWS, &mut self.ip0_extensions),
        ]
    }

    /// The cell of a row, in upper or lower case: the letters of a command, `RS,ERR` for the reset of alarms
    /// ([`Command::permission_row`](crate::command::Command::permission_row)). `None` if the tables have no
    /// such row (FL, OK, NG: PRM-LEG-05).
    pub fn get(&self, port: ProtocolPort, row: &str, mode: MasterMode) -> Option<Permission> {
        let (rows, extensions) = match port {
            ProtocolPort::Host => (&self.host, &self.host_extensions),
            ProtocolPort::Ip0 => (&self.ip0, &self.ip0_extensions),
        };
        let of_manual = ROWS.iter().zip(rows);
        let mut all = of_manual.chain(EXTENSION_ROWS.iter().zip(extensions));
        let (_, cells) = all.find(|(name, _)| name.eq_ignore_ascii_case(row))?;
        let column = MasterMode::ALL.iter().position(|known| *known == mode)?;
        cells.get(column).copied()
    }
}

/// Shown as found where a line is missing.
const END: &str = "the end of the file";

/// Lines above the tables.
const HEADINGS: [&str; 4] = ["[HOST]", "[IP0]", "[HOST extensions]", "[IP0 extensions]"];

/// Whether a table may lack this row.
fn is_optional(row: &str) -> bool {
    let mut later = EXTENSION_ROWS.iter().skip(REQUIRED_EXTENSIONS);
    later.any(|later| *later == row)
}

/// Lines with content and their numbers, from 1; blanks around them and comments removed.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..)
        .zip(text.lines())
        .map(|(number, line)| (number, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty())
}

/// The head row and the rows of one table. The last line of the file has the number `end`.
fn parse_table<'a>(
    lines: &mut Peekable<impl Iterator<Item = (usize, &'a str)>>,
    end: usize,
    names: &[&'static str],
    rows: &mut [Row],
) -> Result<(), PermissionError> {
    let (number, line) = lines.next().unwrap_or((end, END));
    if !line.split_whitespace().eq(["COMMAND"].into_iter().chain(COLUMNS)) {
        let head = format!("COMMAND {}", COLUMNS.join(" "));
        return Err(error(number, &head, line));
    }
    let mut seen = BTreeSet::new();
    while seen.len() < names.len() {
        let ends = lines.peek().is_none_or(|(_, line)| line.starts_with('['));
        if ends && names.iter().all(|row| is_optional(row) || seen.contains(row)) {
            break;
        }
        let expected = || {
            let missing = names.iter().copied().filter(|row| !seen.contains(row));
            format!("a row of {}", missing.collect::<Vec<_>>().join(" "))
        };
        let (number, line) = lines.next().ok_or_else(|| error(end, &expected(), END))?;
        let mut words = line.split_whitespace();
        let letters = words.next().unwrap_or_default();
        let mut named = names.iter().zip(rows.iter_mut());
        let (name, cells) = named
            .find(|(row, _)| **row == letters && !seen.contains(*row))
            .ok_or_else(|| error(number, &expected(), line))?;
        *cells = parse_row(words).ok_or_else(|| error(number, "five cells O, S or X", line))?;
        seen.insert(*name);
    }
    Ok(())
}

fn parse_row<'a>(words: impl Iterator<Item = &'a str>) -> Option<Row> {
    let cell = |word: &str| match *word.as_bytes() {
        [letter] => Permission::from_letter(letter),
        _ => None,
    };
    words.map(cell).collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// Longest piece of a file that an error quotes, in characters.
const MAX_QUOTE: usize = 40;

fn error(line: usize, expected: &str, found: &str) -> PermissionError {
    PermissionError {
        line,
        expected: expected.to_string(),
        found: found.chars().take(MAX_QUOTE).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;
    use alloc::vec::Vec;

    fn cells(port: ProtocolPort, letters: &str) -> [Permission; 5] {
        let table = PermissionTable::of(Edition::SixAxisPrint);
        MasterMode::ALL.map(|mode| table.get(port, letters, mode).unwrap())
    }

    fn cells_of(word: &str) -> [Permission; 5] {
        parse_row(word.split("").filter(|cell| !cell.is_empty())).unwrap()
    }

    // clause: PRM-LEG-01 PRM-LEG-02 PRM-HOST-RN PRM-HOST-SP PRM-HOST-BR PRM-HOST-SO PRM-HOST-RS PRM-HOST-SL PRM-HOST-UL
    // clause: PRM-HOST-DL PRM-HOST-CA PRM-HOST-SU PRM-HOST-ER PRM-HOST-EU PRM-HOST-EC PRM-HOST-MW PRM-HOST-FD
    // clause: PRM-HOST-SF PRM-HOST-MR PRM-HOST-IW PRM-HOST-VR PRM-HOST-DO
    // clause: PRM-IP0-RN PRM-IP0-SP PRM-IP0-BR PRM-IP0-SO PRM-IP0-RS PRM-IP0-SL PRM-IP0-UL PRM-IP0-DL PRM-IP0-CA
    // clause: PRM-IP0-SU PRM-IP0-ER PRM-IP0-EU PRM-IP0-EC PRM-IP0-MW PRM-IP0-FD PRM-IP0-SF PRM-IP0-MR PRM-IP0-IW
    // clause: PRM-IP0-VR PRM-IP0-DO
    #[test]
    fn the_printed_tables() {
        for letters in ["SP", "BR", "CA", "SU", "EU", "MW", "FD", "SF", "MR", "VR"] {
            assert_eq!(cells(ProtocolPort::Host, letters), cells_of("OOOOO"), "{letters}");
            assert_eq!(cells(ProtocolPort::Ip0, letters), cells_of("OOOOO"), "{letters}");
        }
        for letters in ["UL", "DL", "ER"] {
            assert_eq!(cells(ProtocolPort::Host, letters), cells_of("SSSSS"), "{letters}");
            assert_eq!(cells(ProtocolPort::Ip0, letters), cells_of("SSSSS"), "{letters}");
        }
        for letters in ["SO", "RS", "SL", "EC", "IW", "DO"] {
            assert_eq!(cells(ProtocolPort::Host, letters), cells_of("XXXOX"), "{letters}");
            assert_eq!(cells(ProtocolPort::Ip0, letters), cells_of("XXXXO"), "{letters}");
        }
        assert_eq!(cells(ProtocolPort::Host, "RN"), cells_of("XXXSO"));
        assert_eq!(cells(ProtocolPort::Ip0, "RN"), cells_of("XXXXS"));
    }

    #[test]
    fn the_extensions() {
        let like = [
            ("SF", "SM AC AH IO PR VL MN WD PS RM ZC"),
            ("DO", "HI HO ZS MD RT SC JG MP EM"),
            ("RS", "RS,ERR"),
        ];
        for port in ProtocolPort::ALL {
            for (model, rows) in like {
                for row in rows.split(' ') {
                    assert_eq!(cells(port, row), cells(port, model), "{row}");
                }
            }
            assert_eq!(cells(port, "rs,err"), cells(port, "RS,ERR"));
        }
    }

    // clause: T2
    #[test]
    fn the_editions_differ_in_rn_on_host_and_in_sl() {
        let all = ROWS.iter().chain(&EXTENSION_ROWS);
        for row in all {
            for port in ProtocolPort::ALL {
                let of = |edition| {
                    let table = PermissionTable::of(edition);
                    MasterMode::ALL.map(|mode| table.get(port, row, mode).unwrap())
                };
                let printed = of(Edition::SixAxisPrint);
                let corrected = match (*row, port) {
                    ("RN", ProtocolPort::Host) => cells_of("XXXSX"),
                    _ => printed,
                };
                let scara = if *row == "SL" {
                    cells_of("SSSSS")
                } else {
                    corrected
                };
                assert_eq!(of(Edition::SixAxis), corrected, "{port:?} {row}");
                assert_eq!(of(Edition::Scara), scara, "{port:?} {row}");
            }
        }
    }

    #[test]
    fn the_file_prints_the_same_tables() {
        let text = include_str!("../data/permissions.txt");
        let file = PermissionTable::parse(text).unwrap();
        for line in text.lines().filter(|line| !line.starts_with(['#', '[', 'C'])) {
            let Some(row) = line.split_whitespace().next() else {
                continue;
            };
            for port in ProtocolPort::ALL {
                assert_eq!(
                    cells(port, row),
                    MasterMode::ALL.map(|mode| file.get(port, row, mode).unwrap()),
                    "{row}"
                );
            }
        }
    }

    #[test]
    fn the_rows_keep_their_order() {
        // Snapshots and user files depend on it.
        let manual = "RN SP BR SO RS SL UL DL CA SU ER EU EC MW FD SF MR IW VR DO";
        assert_eq!(ROWS.join(" "), manual);
        let extensions = "SM AC AH IO PR VL HI HO WD ZS MD RT SC JG RS,ERR MN";
        assert!(EXTENSION_ROWS.join(" ").starts_with(extensions));
        let without: Vec<&str> = COMMANDS
            .iter()
            .filter(|row| row.permission.is_none())
            .map(|row| row.name)
            .collect();
        assert_eq!(without, ["FL", "OK", "NG"]);
    }

    // clause: PRM-LEG-05
    #[test]
    fn parts_of_an_exchange_have_no_row() {
        let table = PermissionTable::of(Edition::SixAxisPrint);
        for letters in ["FL", "OK", "NG", "XX", ""] {
            assert_eq!(table.get(ProtocolPort::Ip0, letters, MasterMode::ExtEther), None);
        }
        assert!(table.get(ProtocolPort::Ip0, "su", MasterMode::ExtEther).is_some());
    }

    #[test]
    fn a_changed_cell_takes_effect_alone() {
        let text = include_str!("../data/permissions.txt");
        let from = "RN       X         X         X    S        O";
        let changed = text.replace(
            from,
            "RN       X         X         X    S        X # as the other rows",
        );
        let table = PermissionTable::parse(&changed).unwrap();
        assert_eq!(
            table.get(ProtocolPort::Host, "RN", MasterMode::ExtEther),
            Some(Permission::Invalid)
        );
        let printed = *PermissionTable::of(Edition::SixAxisPrint);
        assert_ne!(table.host, printed.host);
        assert_eq!(
            PermissionTable {
                host: printed.host,
                ..table
            },
            printed
        );
        assert_eq!(
            PermissionTable::parse(&text.replace('\n', "\r\n")),
            Ok(*PermissionTable::of(Edition::SixAxisPrint))
        );
    }

    // clause: T2 T27
    #[test]
    fn rows_that_came_later_may_be_left_out_and_are_then_as_printed() {
        let text = include_str!("../data/permissions.txt");
        let later = ["MN ", "MP ", "PS ", "RM ", "ZC ", "EM "];
        let is_later = |line: &&str| later.iter().any(|name| line.starts_with(name));
        let older: Vec<&str> = text.lines().filter(|line| !is_later(line)).collect();
        assert_eq!(older.len() + 2 * later.len(), text.lines().count());
        assert_eq!(
            PermissionTable::parse(&older.join("\n")),
            Ok(*PermissionTable::of(Edition::SixAxisPrint))
        );
        let closed = text.replace("MN       O         O         O    O        O", "MN X X X X X");
        let table = PermissionTable::parse(&closed).unwrap();
        assert_eq!(
            table.get(ProtocolPort::Ip0, "MN", MasterMode::ExtEther),
            Some(Permission::Invalid)
        );
    }

    #[test]
    fn errors_name_the_line() {
        let text = include_str!("../data/permissions.txt");
        let lines: Vec<&str> = text.lines().collect();
        let first = lines.iter().position(|line| line.starts_with("RN ")).unwrap() + 1;
        let break_first = |to: &str| {
            let changed: Vec<&str> = lines
                .iter()
                .enumerate()
                .map(|(index, line)| if index + 1 == first { to } else { line })
                .collect();
            PermissionTable::parse(&changed.join("\n")).unwrap_err()
        };
        for bad in [
            "RN X X X S",
            "RN X X X S O O",
            "RN X X X S Q",
            "rn X X X S O",
            "QQ X X X S O",
        ] {
            assert_eq!(break_first(bad).line, first, "{bad}");
        }
        assert_eq!(break_first("SP O O O O O").line, first + 1, "a row twice");
        let error = break_first("RN X X X S Q").to_string();
        assert_eq!(
            error,
            format!("line {first}: expected five cells O, S or X, found RN X X X S Q")
        );
        assert!(
            PermissionTable::parse("")
                .unwrap_err()
                .expected
                .contains("[HOST]")
        );
        assert!(PermissionTable::parse("[COM1]").is_err());
        let surplus = text.replace("[IP0]", "QQ X X X S O\n[IP0]");
        let error = PermissionTable::parse(&surplus).unwrap_err();
        assert_eq!(
            (error.expected.as_str(), error.found.as_str()),
            (
                "[HOST], [IP0], [HOST extensions] or [IP0 extensions]",
                "QQ X X X S O"
            )
        );
        let manual = text.split("[HOST extensions]").next().unwrap_or_default();
        let error = PermissionTable::parse(manual).unwrap_err();
        assert_eq!(error.expected, "[HOST extensions]");
        // The rows after it may be left out.
        let required = text.rfind("RS,ERR").unwrap();
        for end in 0..required {
            assert!(PermissionTable::parse(&text[..end]).is_err(), "{end}");
        }
        assert_eq!(
            PermissionTable::parse(&format!("{text}\n[IP0]"))
                .unwrap_err()
                .found,
            "[IP0]"
        );
        let swapped = text.replace("[HOST extensions]", "[HOST]");
        assert_eq!(
            PermissionTable::parse(&swapped).unwrap_err().expected,
            "each table once"
        );
    }
}
