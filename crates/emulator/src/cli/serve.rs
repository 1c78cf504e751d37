//! `ts3100 serve`: reads the configuration, opens the ports, prints the ready line, serves until a signal, and
//! writes the reports.
//!
//! The order matters: report files are created before the ports open, so that a path that cannot be written is an
//! error at the start. The loop that serves hosts is [`ts3100_driver::driver`]; the ready line is [`crate::ready`].

use super::exit::{SCENARIO_FAILED, UNUSABLE};
use super::junit_stub;
use crate::config::args::LogFormat;
use crate::config::{self, OPTIONS, ServeArgs, Settings};
use crate::embed::single_threaded;
use crate::instances::Instance;
use crate::launch::Launched;
use crate::log;
use crate::ready;
use anyhow::Context as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tracing::{error, info, warn};
use ts3100_control::printable::printable;
use ts3100_driver::files;
use ts3100_driver::snapshot;
use ts3100_recording::faults;
use ts3100_recording::reports::ReportOutcome;
use ts3100_recording::scenario::ScenarioOutcome;

/// Runs until a signal.
pub(super) fn run(args: ServeArgs) -> ExitCode {
    let mut junit = args.junit.clone().or_else(junit_stub::path_from_environment);
    match serve(args, &mut junit) {
        Ok(code) => ExitCode::from(code),
        Err(error) => fail(&error, junit.as_deref(), UNUSABLE),
    }
}

/// Ends with this exit code after saying why, in the JUnit report too if one was asked for.
pub(super) fn fail(error: &anyhow::Error, junit: Option<&Path>, code: u8) -> ExitCode {
    let words = printable(format_args!("{error:#}"));
    log::print_error(&words);
    junit_stub::write(junit, &words);
    ExitCode::from(code)
}

/// `junit` becomes the report that the whole configuration asks for, as soon as that is known.
fn serve(flags: ServeArgs, junit: &mut Option<PathBuf>) -> anyhow::Result<u8> {
    if flags.set.iter().any(|pair| pair == "help") {
        list_options()?;
        return Ok(0);
    }
    let (args, unknown) = config::read(flags, &std::env::vars_os().collect())?;
    junit.clone_from(&args.junit);
    log::start(args.verbose, args.log_format.unwrap_or_default());
    for warning in unknown {
        warn!("{warning}");
    }
    let settings = Settings::from_args(&args)?;
    if let Some(seed) = settings.controller.vary {
        info!(
            event = "vary",
            seed, "legal variation with seed {seed}; repeat it with --vary {seed}"
        );
    }
    check_outputs(&args, &settings)?;
    let runtime = single_threaded()?;
    runtime.block_on(async {
        // Before the ready line: a signal that follows it must not find the default action.
        let stop = stop_signal().context("cannot listen for signals")?;
        let mut launched = Launched::open(&settings)?;
        let control = launched.open_control(&settings)?;
        let (ports, serial) = (launched.driver.ports(), launched.driver.serial_endpoints());
        let _announced = Instance::current(settings.listen, ports, control).announce();
        if args.ready_json.unwrap_or(false) {
            let printed = ready::print_line(ports, &serial, control, settings.controller.vary);
            printed.context("cannot write to stdout")?;
        } else {
            let banner = ready::Banner {
                settings: &settings,
                ports,
                serial: &serial,
                control,
                has_examples: launched.has_examples,
            };
            match args.log_format.unwrap_or_default() {
                LogFormat::Text => eprint!("{banner}"),
                LogFormat::Json => info!(event = "ready", "ready: {}", banner.places()),
            }
        }
        let code = serve_until(stop, launched, &args, &settings).await?;
        info!("ended");
        Ok(code)
    })
}

/// Makes the files of the reports, so that one that cannot be written is known before the run; and asks whether the
/// snapshot could be.
pub(super) fn check_outputs(args: &ServeArgs, settings: &Settings) -> anyhow::Result<()> {
    settings.reports.prepare()?;
    faults::prepare(&settings.report)?;
    write_junit(args, &junit_stub::document(junit_stub::NOT_FINISHED))?;
    if let Some(path) = &args.snapshot_on_exit {
        snapshot::check_target(path)?;
    }
    Ok(())
}

/// Writes the JUnit report, where one was asked for.
fn write_junit(args: &ServeArgs, document: &str) -> anyhow::Result<()> {
    args.junit.as_ref().map_or(Ok(()), |path| {
        let written = files::replace(path, document.as_bytes());
        written.with_context(|| format!("cannot write {}", path.display()))
    })
}

/// Serves until `stop` completes, then writes all that was asked for; the exit code that follows from it. `exec` does
/// the same.
pub(super) async fn serve_until(
    stop: impl Future<Output = ()>,
    mut launched: Launched,
    args: &ServeArgs,
    settings: &Settings,
) -> anyhow::Result<u8> {
    let play = launched.start_scenario(settings);
    let record = launched.run_record.clone();
    let controller = launched.run(stop).await;
    if let Some(path) = &args.snapshot_on_exit {
        snapshot::write(path, &controller)?;
    }
    let reports = &settings.reports;
    let ending = reports.write_all(&record, &controller, &settings.load)?;
    faults::write(&settings.report, controller.faults(), &record.fault_log())?;
    log_failures(&ending);
    let failed = match play {
        Some(play) => report_scenario(&play.outcome(controller.now()), args)?,
        None => false,
    };
    Ok(match ending.exit_code() {
        0 if failed => SCENARIO_FAILED,
        code => code,
    })
}

/// The results of a scenario; whether it has failed.
fn report_scenario(outcome: &ScenarioOutcome, args: &ServeArgs) -> anyhow::Result<bool> {
    write_junit(args, &outcome.junit())?;
    for failure in outcome.failures() {
        error!(event = "scenario-failed", "scenario: {failure}");
    }
    Ok(outcome.has_failed())
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

/// `--set help`.
fn list_options() -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    for row in OPTIONS {
        writeln!(stdout, "{:<20} {}", row.key, row.values)?;
    }
    Ok(())
}

#[cfg(unix)]
pub(super) fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    // Its terminal is gone: reports and snapshots are written as at any other end.
    let mut hang_up = signal(SignalKind::hangup())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = hang_up.recv() => {}
        }
    })
}

#[cfg(not(unix))]
pub(super) fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    })
}
