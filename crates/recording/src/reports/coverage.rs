//! Coverage of the permission tables as one JSON document, and merging several of them. The document uses the words of the
//! tables, so that documents of other versions and configurations can be merged.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use ts3100_controller::command_coverage::{PermissionCell, reachable};
use ts3100_controller::{CommandCoverage, Config, Port, Verdict};
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_proto::permission::{EXTENSION_ROWS, ROWS};
use ts3100_proto::status::MasterMode;
use ts3100_proto::words::plain_message;

/// Version of the document; raised when a key changes its meaning.
const VERSION: u32 = 1;
/// Largest document that is read, in bytes.
const MAX_DOCUMENT: u64 = 16 * 1024 * 1024;

/// Commands and modes that the hosts of one run or of several have reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoverageReport {
    /// Version of this document.
    pub version: u32,
    /// Reachable cells that were reached.
    pub reached: usize,
    /// Cells that the permission tables make reachable on the ports that were used.
    pub reachable: usize,
    /// The one of the other, in percent with one decimal, rounded down.
    pub percent: f64,
    /// Every reachable cell, and every other that was reached, in the order of the tables.
    pub cells: Vec<CellReport>,
}

/// A command in a master mode on a port, and its outcome.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellReport {
    /// `HOST` or `IP0`.
    pub port: String,
    /// Row of the tables.
    pub command: String,
    /// Column of the tables.
    pub mode: String,
    /// `served`, `not-valid` (NG by the tables) or `refused` (NG for another reason).
    pub outcome: String,
    /// Number of times.
    pub count: u64,
    /// It counts for the percentage.
    pub reachable: bool,
}

impl CoverageReport {
    /// The document of a run.
    pub fn new(coverage: &CommandCoverage, config: &Config) -> CoverageReport {
        let mut cells: BTreeMap<PermissionCell, (u64, bool)> = BTreeMap::new();
        for port in coverage.ports() {
            cells.extend(reachable(config, port).into_iter().map(|cell| (cell, (0, true))));
        }
        for (cell, count) in coverage.reached() {
            cells.entry(*cell).or_default().0 = count;
        }
        let cells = cells.into_iter().map(|(cell, (count, reachable))| CellReport {
            port: cell.port.name().to_owned(),
            command: cell.row().to_owned(),
            mode: cell.mode.as_str().to_owned(),
            outcome: cell.verdict.as_str().to_owned(),
            count,
            reachable,
        });
        CoverageReport::from_cells(cells.collect())
    }

    /// One document of several: a cell counts what all count, and is reachable if it is in any of them.
    pub fn merged(reports: impl IntoIterator<Item = CoverageReport>) -> CoverageReport {
        let mut cells: BTreeMap<_, CellReport> = BTreeMap::new();
        for cell in reports.into_iter().flat_map(|report| report.cells) {
            let entry = cells.entry(table_position(&cell)).and_modify(|known| {
                known.count = known.count.saturating_add(cell.count);
                known.reachable |= cell.reachable;
            });
            entry.or_insert(cell);
        }
        CoverageReport::from_cells(cells.into_values().collect())
    }

    /// Reads a document.
    ///
    /// # Errors
    /// The file cannot be read, is another document, or has another version.
    pub fn read(path: &Path) -> Result<CoverageReport, PathError> {
        let read = files::read_text(path, MAX_DOCUMENT).and_then(|text| {
            let report: CoverageReport = serde_json::from_str(&text)
                .map_err(|error| plain_message(&error.to_string()))
                .map_err(|reason| format!("expected a coverage report of ts3100: {reason}"))
                .map_err(io::Error::other)?;
            if report.version == VERSION {
                return Ok(report);
            }
            let found = report.version;
            Err(io::Error::other(format!(
                "expected version {VERSION}, found {found}"
            )))
        });
        read.map_err(cannot("read", path))
    }

    fn from_cells(cells: Vec<CellReport>) -> CoverageReport {
        let reachable = cells.iter().filter(|cell| cell.reachable).count();
        let reached = cells
            .iter()
            .filter(|cell| cell.reachable && cell.count > 0)
            .count();
        let tenths = (reached * 1_000).checked_div(reachable).unwrap_or(0);
        CoverageReport {
            version: VERSION,
            reached,
            reachable,
            percent: tenths as f64 / 10.0,
            cells,
        }
    }
}

/// Sort key: table order, then unknown cells by name.
fn table_position(cell: &CellReport) -> (usize, usize, usize, usize, [String; 4]) {
    let known = |found: Option<usize>| found.unwrap_or(usize::MAX);
    let mut rows = ROWS.iter().chain(&EXTENSION_ROWS);
    let row = rows.position(|row| *row == cell.command);
    let port = Port::ALL.iter().position(|port| port.name() == cell.port);
    let mode = MasterMode::ALL.iter().position(|mode| mode.as_str() == cell.mode);
    let mut verdicts = Verdict::ALL.iter();
    let verdict = verdicts.position(|verdict| verdict.as_str() == cell.outcome);
    let names = [&cell.port, &cell.command, &cell.mode, &cell.outcome].map(Clone::clone);
    (known(port), known(row), known(mode), known(verdict), names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;
    use ts3100_controller::Dialect;
    use ts3100_controller::output::Event;

    fn run(rows: &[&'static str]) -> CoverageReport {
        let mut coverage = CommandCoverage::default();
        for row in rows {
            coverage.record(&Event::Answered {
                port: Port::Ip0,
                row,
                mode: MasterMode::ExtEther,
                verdict: Verdict::Served,
            });
        }
        CoverageReport::new(&coverage, &Config::new(Dialect::Manual))
    }

    #[test]
    fn a_cell_reached_twice_counts_once_for_the_percentage() {
        let report = run(&["SU", "SU", "SF"]);
        assert_eq!((report.reached, report.reachable, report.percent), (2, 116, 1.7));
        let cell = report.cells.iter().find(|cell| cell.count == 2).unwrap();
        assert_eq!((cell.command.as_str(), cell.outcome.as_str()), ("SU", "served"));
    }

    #[test]
    fn runs_add_up_and_keep_the_order_of_the_tables() {
        let all = run(&["SU", "SF", "SO"]);
        let merged = CoverageReport::merged([run(&["SF", "SU"]), run(&["SO"])]);
        assert_eq!(merged, all);
        assert_eq!(
            CoverageReport::merged([all.clone(), all.clone()]).percent,
            all.percent
        );
    }

    #[test]
    fn what_one_run_makes_reachable_is_reachable_in_all() {
        let all = run(&["SU"]);
        let mut without = all.clone();
        without.cells.iter_mut().for_each(|cell| cell.reachable = false);
        let merged = CoverageReport::merged([without, all.clone()]);
        assert_eq!((merged.reached, merged.reachable), (1, all.reachable));
    }

    #[test]
    fn a_document_is_read_back_and_others_are_refused() {
        let directory = TempDir::new("coverage");
        let path = directory.path().join("c.json");
        let report = run(&["SU"]);
        std::fs::write(&path, serde_json::to_string(&report).unwrap()).unwrap();
        assert_eq!(CoverageReport::read(&path).unwrap(), report);
        for (text, expected) in [
            (
                "{}",
                "expected a coverage report of ts3100: the field `version` is missing",
            ),
            ("[1]", "expected a coverage report"),
            (
                "{\"version\":2,\"reached\":0,\"reachable\":0,\"percent\":0,\"cells\":[]}",
                "expected version 1, found 2",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = CoverageReport::read(&path).unwrap_err().to_string();
            assert!(error.starts_with("cannot read "), "{error}");
            assert!(error.contains("c.json") && error.contains(expected), "{error}");
        }
    }
}
