//! Reports for the author of a host program: findings, coverage of the permission tables, and executed lines of user files.
//! They are recorded from the outputs of the controller, so the daemon, an embedded emulator and a run without sockets
//! give the same. Each format has its own file; `settings` says which reports are written.

pub mod coverage;
pub mod faults;
pub mod findings;
mod html;
pub mod junit;
pub mod lcov;
mod markdown;
mod sarif;
mod settings;
#[cfg(test)]
mod tests;

pub use coverage::CoverageReport;
pub use findings::FindingsView;
pub use settings::{BELOW_COVERAGE, DENIED, Deny, FindingsFormat, ReportOutcome, Reports, coverage_text};

use faults::FaultLog;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use ts3100_controller::{
    CommandCoverage, Config, Controller, Event, Findings, Output, StatementCoverage, Time,
};
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_driver::seat::{Notice, Subscriber};

/// Writes a whole file.
///
/// # Errors
/// It cannot be written.
pub fn write_report(path: &Path, text: &str) -> Result<(), PathError> {
    files::replace(path, text.as_bytes()).map_err(cannot("write", path))
}

#[derive(Debug, Default)]
struct RunData {
    findings: Findings,
    /// Since the start or the last reset.
    coverage: CommandCoverage,
    /// Before the last reset.
    coverage_before: CommandCoverage,
    executed: StatementCoverage,
    fault_log: FaultLog,
    record_lines: bool,
}

/// Data for the reports of one emulator; clones share it.
#[derive(Debug, Clone, Default)]
pub struct RunRecord(Arc<Mutex<RunData>>);

impl RunRecord {
    /// A panic in another thread cannot leave the data inconsistent, so a poisoned lock is usable.
    fn data(&self) -> MutexGuard<'_, RunData> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A record of a run that starts with this controller. Executed lines are recorded if `record_lines` is set.
    pub fn new(controller: &Controller, record_lines: bool) -> RunRecord {
        let record = RunRecord::default();
        record.data().record_lines = record_lines;
        record.add_files(controller);
        record
    }

    fn add_files(&self, controller: &Controller) {
        let mut record = self.data();
        for (name, content) in controller.files() {
            record.executed.note_stored(name, content);
        }
    }

    /// Findings so far.
    pub fn findings(&self) -> Findings {
        self.data().findings.clone()
    }

    /// Coverage of the permission tables so far, resets or not.
    pub fn coverage(&self, config: &Config) -> CoverageReport {
        CoverageReport::new(&self.command_coverage(), config)
    }

    fn command_coverage(&self) -> CommandCoverage {
        let record = self.data();
        let mut whole = record.coverage_before.clone();
        whole.add(record.coverage.clone());
        whole
    }

    /// Coverage of the permission tables since the start or the last reset.
    pub fn coverage_since_reset(&self, config: &Config) -> CoverageReport {
        CoverageReport::new(&self.data().coverage, config)
    }

    /// Executed lines of the user files so far.
    pub fn executed(&self) -> StatementCoverage {
        self.data().executed.clone()
    }

    /// Applications of faults so far.
    pub fn fault_log(&self) -> FaultLog {
        self.data().fault_log.clone()
    }

    /// Clears the data, for use between two tests.
    pub fn clear(&self) {
        let mut record = self.data();
        record.findings.clear();
        record.coverage.clear();
        record.coverage_before.clear();
        record.executed.clear();
    }
}

impl Subscriber for RunRecord {
    fn output(&mut self, at: Time, output: &Output) {
        // In no report, and frequent: the data is not locked for it.
        if let Output::Send { .. } | Output::Event(Event::TextOut { .. }) = output {
            return;
        }
        let mut record = self.data();
        if let Output::Event(event) = output {
            record.fault_log.observe(at, event);
            record.findings.record(event);
            record.coverage.record(event);
        }
        record.executed.record(output);
    }

    fn notice(&mut self, _at: Time, notice: Notice<'_>) {
        match notice {
            Notice::Restored(controller) => self.add_files(controller),
            Notice::Reset { .. } => {
                let record = &mut *self.data();
                let coverage = std::mem::take(&mut record.coverage);
                record.coverage_before.add(coverage);
            }
            Notice::Dropped(_) | Notice::NotPersisted { .. } | Notice::TimedFindings(_) => {}
        }
    }

    fn wants_statements(&self) -> bool {
        self.data().record_lines
    }
}
