//! What a run leaves behind for the author of a host program: findings, coverage of the permission tables, lines
//! of the user files executed. It is recorded from what the controller puts out, so the daemon, an embedded
//! emulator and a run without sockets give the same. The formats are one file each.

pub mod coverage;
pub mod findings;
mod html;
mod junit;
pub mod lcov;
mod sarif;
mod settings;

pub use coverage::CoverageReport;
pub use findings::FindingsView;
pub(crate) use junit::escape;
pub use settings::{
    BELOW_COVERAGE, DENIED, Deny, FindingsFormat, ReportError, ReportOutcome, Reports, coverage_text,
};

use crate::faults::FaultLog;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use ts3100_controller::options::Config;
use ts3100_controller::output::Output;
use ts3100_controller::{CommandCoverage, Controller, Findings, StatementCoverage, Time};

#[derive(Debug, Default)]
struct RunData {
    findings: Findings,
    coverage: CommandCoverage,
    executed: StatementCoverage,
    fault_log: FaultLog,
}

/// The record of one emulator; clones are the same record.
#[derive(Debug, Clone, Default)]
pub struct RunRecord(Arc<Mutex<RunData>>);

impl RunRecord {
    /// The record is whole between any two statements, so a panic elsewhere does not matter.
    fn data(&self) -> MutexGuard<'_, RunData> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The files that are on the RAM drive from the beginning.
    pub fn add_files(&self, controller: &Controller) {
        let mut record = self.data();
        for (name, content) in controller.files() {
            record.executed.note_stored(name, content);
        }
    }

    /// Takes note of what a controller has put out, and when.
    pub fn observe(&self, at: Time, output: &Output) {
        let mut record = self.data();
        if let Output::Event(event) = output {
            record.fault_log.observe(at, event);
            record.findings.record(event);
            record.coverage.record(event);
        }
        record.executed.record(output);
    }

    /// What the hosts did that they had better not, so far.
    #[must_use]
    pub fn findings(&self) -> Findings {
        self.data().findings.clone()
    }

    /// Which cells of the permission tables the hosts have reached so far.
    #[must_use]
    pub fn coverage(&self, config: &Config) -> CoverageReport {
        CoverageReport::new(&self.data().coverage, config)
    }

    /// Which lines of the user files were executed so far.
    #[must_use]
    pub fn executed(&self) -> StatementCoverage {
        self.data().executed.clone()
    }

    /// What the faults have done so far, in words.
    #[must_use]
    pub fn fault_log(&self) -> FaultLog {
        self.data().fault_log.clone()
    }

    /// Forgets everything, for between two tests.
    pub fn clear(&self) {
        let mut record = self.data();
        record.findings.clear();
        record.coverage.clear();
        record.executed.clear();
    }
}
