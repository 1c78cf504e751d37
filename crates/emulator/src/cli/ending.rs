//! The end of a robot: reports, snapshot, the results of the scenario, and the exit code that follows from them.

use super::exit::SCENARIO_FAILED;
use super::junit_stub;
use crate::config::{FileArgs, ReportArgs, Settings};
use crate::launch::Launched;
use anyhow::Context as _;
use std::path::PathBuf;
use tracing::error;
use ts3100_controller::{Controller, Time};
use ts3100_driver::driver::Driver;
use ts3100_driver::snapshot;
use ts3100_recording::reports::faults;
use ts3100_recording::reports::{ReportOutcome, RunRecord, write_report};
use ts3100_recording::scenario::{Play, ScenarioOutcome};

/// Files and results to produce at the end of a robot.
pub struct Ending {
    files: FileArgs,
    junit: Option<PathBuf>,
    reports: ReportArgs,
    play: Option<Play>,
    record: RunRecord,
    /// Name of the run in a report that names a file.
    run_file: PathBuf,
}

/// The file for a run without a transcript, a program and a scenario.
const UNNAMED_RUN: &str = "ts3100-run";

/// The transcript of a run, or else what it ran.
fn run_file(settings: &Settings) -> PathBuf {
    let transcript = settings.reports.transcript.first().map(|file| &file.path);
    let scenario = settings.scenario.as_ref().map(|scenario| &scenario.file);
    let file = transcript.or(settings.files.load.first()).or(scenario);
    file.cloned().unwrap_or_else(|| PathBuf::from(UNNAMED_RUN))
}

impl Ending {
    /// Makes the files of the reports, so that one that cannot be written is known before the run; and asks whether the
    /// snapshot could be.
    ///
    /// # Errors
    /// A file that cannot be written.
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

    /// Prepares the reports of these settings. Starts the scenario, if there is one.
    pub fn begin(driver: &mut Driver, launched: &Launched, settings: &Settings) -> Ending {
        Ending {
            files: settings.files.clone(),
            junit: settings.junit.clone(),
            reports: settings.reports.clone(),
            play: launched.start_scenario(driver),
            record: launched.run_record.clone(),
            run_file: run_file(settings),
        }
    }

    /// Writes all that was asked for; returns the exit code.
    ///
    /// # Errors
    /// The first that cannot be written; the others are written.
    pub fn finish(&self, controller: &Controller) -> anyhow::Result<u8> {
        faults::log_summary(controller.faults());
        let snapshot = match &self.files.snapshot_on_exit {
            Some(path) => snapshot::write(path, snapshot::States::One(controller)),
            None => Ok(()),
        };
        let reports = self.reports.reports();
        let outcome = reports.write_all(&self.record, controller, &self.files.load, &self.run_file);
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

/// Runs a robot that is alone until `stop` completes, then writes all that was asked for; the exit code that follows, and the
/// virtual time of the end.
pub async fn run_to_end(
    stop: impl Future<Output = ()>,
    mut driver: Box<Driver>,
    launched: &Launched,
    settings: &Settings,
) -> anyhow::Result<(u8, Time)> {
    let ending = Ending::begin(&mut driver, launched, settings);
    let controllers = driver.run(stop).await;
    let controller = controllers.first().context("the driver has no robot")?;
    Ok((ending.finish(controller)?, controller.now()))
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
