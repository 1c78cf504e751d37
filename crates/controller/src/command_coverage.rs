//! Command coverage: the cells of the permission tables that a host has reached, by command, master mode and verdict.
//!
//! [`reachable`] derives the reachable cells from the tables. The emulator writes the reports.

use crate::options::Config;
use crate::output::{Event, Verdict};
use crate::port::Port;
use crate::prelude::*;
use alloc::collections::{BTreeMap, BTreeSet};
use ts3100_proto::permission::{EXTENSION_ROWS, Permission, ROWS};
use ts3100_proto::status::MasterMode;

/// A command in a master mode on a port, and its outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PermissionCell {
    /// HOST or IP0.
    pub port: Port,
    /// Row of the tables, in the order of [`ROWS`], then of [`EXTENSION_ROWS`].
    row: usize,
    /// The master mode, which is the column of the tables.
    pub mode: MasterMode,
    pub verdict: Verdict,
}

impl PermissionCell {
    fn new(port: Port, row: &str, mode: MasterMode, verdict: Verdict) -> Option<PermissionCell> {
        let mut rows = ROWS.iter().chain(&EXTENSION_ROWS);
        Some(PermissionCell {
            port,
            row: rows.position(|known| *known == row)?,
            mode,
            verdict,
        })
    }

    /// The command's row.
    pub fn row(&self) -> &'static str {
        let mut rows = ROWS.iter().chain(&EXTENSION_ROWS);
        rows.nth(self.row).copied().unwrap_or_default()
    }
}

/// How often each cell was reached.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CommandCoverage {
    reached: BTreeMap<PermissionCell, u64>,
    /// Ports on which a text has come.
    ports: BTreeSet<Port>,
}

impl CommandCoverage {
    /// Takes note of an event if it is a text or the answer to a command.
    pub fn record(&mut self, event: &Event) {
        if let Event::TextIn { port, .. } = event {
            self.ports.insert(*port);
        }
        let Event::Answered {
            port,
            row,
            mode,
            verdict,
        } = event
        else {
            return;
        };
        if let Some(cell) = PermissionCell::new(*port, row, *mode, *verdict) {
            self.reach(cell, 1);
        }
    }

    fn reach(&mut self, cell: PermissionCell, times: u64) {
        let count = self.reached.entry(cell).or_default();
        *count = count.saturating_add(times);
    }

    /// How often a cell was reached.
    pub fn count(&self, cell: &PermissionCell) -> u64 {
        self.reached.get(cell).copied().unwrap_or_default()
    }

    /// The cells reached, in the order of the tables, each with how often.
    pub fn reached(&self) -> impl Iterator<Item = (&PermissionCell, u64)> {
        self.reached.iter().map(|(cell, count)| (cell, *count))
    }

    /// The ports on which a host has sent a text; IP0 as long as there is none.
    pub fn ports(&self) -> Vec<Port> {
        if self.ports.is_empty() {
            return Vec::from([Port::Ip0]);
        }
        self.ports.iter().copied().collect()
    }

    /// Adds the cells of another run.
    pub fn add(&mut self, other: CommandCoverage) {
        for (cell, count) in other.reached {
            self.reach(cell, count);
        }
        self.ports.extend(other.ports);
    }

    /// Forgets everything, for between two tests.
    pub fn clear(&mut self) {
        self.reached.clear();
        self.ports.clear();
    }
}

/// The cells a host on this port can reach: a valid command is served; one that is valid when the robot is stopped
/// is served then and NG while it runs; one that is not valid is NG. An NG for another reason is possible nearly
/// everywhere and required nowhere. Without the option `extensions` there are no rows of extensions, and only
/// a TS3100 has the mode INTERNAL.
pub fn reachable(config: &Config, port: Port) -> Vec<PermissionCell> {
    let Some(table) = port.protocol() else {
        return Vec::new();
    };
    let extensions = EXTENSION_ROWS.iter().filter(|row| config.serves_row(row));
    let internal = config.controller.has_internal();
    let exists = |mode: &MasterMode| internal || *mode != MasterMode::Internal;
    let modes = || MasterMode::ALL.into_iter().filter(exists);
    let rows = ROWS.iter().chain(extensions);
    let places = rows.flat_map(|row| modes().map(move |mode| (*row, mode)));
    let verdicts = |(row, mode)| {
        let verdicts: &[Verdict] = match config.permission_table().get(table, row, mode) {
            Some(Permission::Valid) => &[Verdict::Served],
            Some(Permission::WhenStopped) => &[Verdict::Served, Verdict::NotValid],
            Some(Permission::Invalid) => &[Verdict::NotValid],
            None => &[],
        };
        let cells = verdicts.iter();
        cells.filter_map(move |verdict| PermissionCell::new(port, row, mode, *verdict))
    };
    places.flat_map(verdicts).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ControllerType, Dialect};

    #[test]
    fn what_can_be_reached_is_what_the_tables_say() {
        let config = Config::new(Dialect::Manual);
        let cells = reachable(&config, Port::Ip0);
        // 20 rows in 5 modes; RN in one, and UL, DL and ER in all, are valid when stopped and so have two outcomes.
        assert_eq!(cells.len(), 20 * 5 + 1 + 3 * 5);
        let with_extensions = reachable(&Config::new(Dialect::Field), Port::Ip0);
        assert!(
            with_extensions.len() >= cells.len() + (EXTENSION_ROWS.len() - 1) * 5,
            "all but ZC"
        );
        let tsl = Config {
            controller: ControllerType::Tsl3100,
            ..config
        };
        assert_eq!(reachable(&tsl, Port::Ip0).len(), 20 * 4 + 1 + 3 * 4);
        assert_eq!(reachable(&tsl, Port::Ip1), []);
    }

    #[test]
    fn an_answer_reaches_its_cell() {
        let mut coverage = CommandCoverage::default();
        let answered = Event::Answered {
            port: Port::Ip0,
            row: "RS,ERR",
            mode: MasterMode::ExtEther,
            verdict: Verdict::Served,
        };
        coverage.record(&answered);
        coverage.record(&answered);
        coverage.record(&Event::AlarmsReset);
        let (cell, count) = coverage.reached().next().unwrap();
        assert_eq!(
            (cell.row(), cell.mode, count),
            ("RS,ERR", MasterMode::ExtEther, 2)
        );
        assert!(reachable(&Config::new(Dialect::Field), Port::Ip0).contains(cell));
        let mut sum = coverage.clone();
        sum.add(coverage.clone());
        assert_eq!(sum.reached().map(|(_, count)| count).collect::<Vec<_>>(), [4]);
        coverage.clear();
        assert_eq!(coverage.reached().count(), 0);
    }
}
