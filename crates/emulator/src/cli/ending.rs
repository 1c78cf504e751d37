//! What is left to do when a robot has ended: reports, snapshot, the results of the scenario, and the exit code that
//! follows from them.

use super::exit::SCENARIO_FAILED;
use super::junit_stub;
use crate::config::{FileArgs, ReportArgs, Settings};
use crate::launch::Launched;
use std::path::PathBuf;
use tracing::error;
use ts3100_controller::Controller;
use ts3100_driver::snapshot;
use ts3100_recording::faults;
use ts3100_recording::reports::{ReportOutcome, RunRecord, write_report};
use ts3100_recording::scenario::{Play, ScenarioOutcome};

/// What is asked for at the end of a robot.
pub struct Ending {
    files: FileArgs,
    junit: Option<PathBuf>,
    reports: ReportArgs,
    play: Option<Play>,
    record: RunRecord,
}

impl Ending {
    /// Makes the files of the reports, so that one that cannot be written is known before the run; and asks whether the
    /// snapshot could be.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn check(settings: &Settings) -> anyhow::Result<()> {
        settings.reports.reports().prepare()?;
        faults::prepare(&settings.reports.report)?;
        if let Some(path) = &settings.junit {
            write_report(path, &junit_stub::document(junit_stub::NOT_FINISHED))?;
        }
        if let Some(path) = &settings.files.snapshot_on_exit {
            snapshot::check_target(path)?;
        }
        Ok(())
    }

    /// What these settings ask for. Starts the scenario, if there is one.
    pub fn begin(launched: &mut Launched, settings: &Settings) -> Ending {
        Ending {
            files: settings.files.clone(),
            junit: settings.junit.clone(),
            reports: settings.reports.clone(),
            play: launched.start_scenario(),
            record: launched.run_record.clone(),
        }
    }

    /// Writes all that was asked for; returns the exit code.
    ///
    /// # Errors
    /// The first that cannot be written; the others are written.
    pub fn finish(&self, controller: &Controller) -> anyhow::Result<u8> {
        faults::log_summary(controller.faults());
        let snapshot = match &self.files.snapshot_on_exit {
            Some(path) => snapshot::write(path, controller),
            None => Ok(()),
        };
        let reports = self.reports.reports();
        let outcome = reports.write_all(&self.record, controller, &self.files.load);
        let faults = faults::write(
            &self.reports.report,
            controller.faults(),
            &self.record.fault_log(),
        );
        if let Ok(outcome) = &outcome {
            log_failures(outcome);
        }
        let failed = match &self.play {
            Some(play) => self.report_scenario(&play.outcome(controller.now())),
            None => Ok(false),
        };
        snapshot?;
        let outcome = outcome?;
        faults?;
        Ok(match (outcome.exit_code(), failed?) {
            (0, true) => SCENARIO_FAILED,
            (code, _) => code,
        })
    }

    /// The results of a scenario; whether it has failed.
    fn report_scenario(&self, outcome: &ScenarioOutcome) -> anyhow::Result<bool> {
        for failure in outcome.failures() {
            error!(event = "scenario-failed", "scenario: {failure}");
        }
        if let Some(path) = &self.junit {
            write_report(path, &outcome.junit())?;
        }
        Ok(outcome.has_failed())
    }
}

/// Why the exit code is not 0.
fn log_failures(ending: &ReportOutcome) {
    for (rule, count) in &ending.denied {
        let (id, title) = (rule.id, rule.title);
        let times = if *count == 1 {
            "once".to_owned()
        } else {
            format!("{count} times")
        };
        error!(
            event = "denied",
            rule = id,
            count,
            "denied finding {id}, {times}: {title}"
        );
    }
    for id in &ending.never_fired {
        error!(event = "denied", id, "denied: fault {id} never fired");
    }
    if let Some((reached, least)) = ending.below_coverage {
        error!(
            event = "below-coverage",
            reached, least, "the coverage is {reached:.1} %, below the {least} % of --min-coverage"
        );
    }
}
