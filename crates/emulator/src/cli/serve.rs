//! `ts3100 serve`: reads the configuration, opens the ports, prints the ready line, serves until a signal, and
//! writes the reports.
//!
//! The order matters: report files are created before the ports open, so that a path that cannot be written is an
//! error at the start. The loop that serves hosts is [`ts3100_driver::driver`]; the ready line is [`crate::ready`].

use super::exit::UNUSABLE;
use super::fleet::Fleet;
use super::{junit_stub, output};
use crate::config::args::LogFormat;
use crate::config::fleet::{self, FleetConfig};
use crate::config::{self, OPTIONS, ServeArgs};
use crate::embed::single_threaded;
use crate::instances::Instance;
use crate::launch::bind_control;
use crate::log;
use crate::ready::{self, Ready};
use anyhow::Context as _;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use tracing::{info, warn};
use ts3100_control::printable::printable;
use ts3100_control::robots::{RobotInfo, Robots};

/// Runs until a signal.
pub(super) fn run(args: ServeArgs) -> ExitCode {
    let junit = args.scenario.junit.clone();
    reporting(junit, |junit| serve(args, junit), |_| UNUSABLE)
}

/// Runs, and says why if it fails, in the JUnit report too if one was asked for. `code_of` is the exit code then.
pub(super) fn reporting(
    junit: Option<PathBuf>,
    run: impl FnOnce(&mut BTreeSet<PathBuf>) -> anyhow::Result<u8>,
    code_of: impl FnOnce(&anyhow::Error) -> u8,
) -> ExitCode {
    let junit = junit.or_else(junit_stub::path_from_environment);
    let mut junit = junit.into_iter().collect();
    ExitCode::from(run(&mut junit).unwrap_or_else(|error| {
        let words = printable(format_args!("{error:#}"));
        log::print_error(&words);
        junit_stub::write(&junit, &words);
        code_of(&error)
    }))
}

/// `junit` becomes the reports that the whole configuration asks for, as soon as that is known, and none as soon as the
/// run has results of its own.
fn serve(flags: ServeArgs, junit: &mut BTreeSet<PathBuf>) -> anyhow::Result<u8> {
    let Some(args) = configured(flags, junit, log::start)? else {
        return Ok(0);
    };
    let config = FleetConfig::from_args(&args)?;
    if let Some(seed) = config.only().and_then(|settings| settings.controller.vary) {
        info!(
            event = "vary",
            seed, "legal variation with seed {seed}; repeat it with --vary {seed}"
        );
    }
    single_threaded()?.block_on(serve_robots(&args, config, junit))
}

/// The whole configuration, after the log has started. None for `--set help`, which lists the options.
///
/// # Errors
/// The configuration is not valid.
pub(super) fn configured(
    flags: ServeArgs,
    junit: &mut BTreeSet<PathBuf>,
    start_log: fn(u8, LogFormat),
) -> anyhow::Result<Option<ServeArgs>> {
    if flags.robot.set.iter().any(|pair| pair == "help") {
        return list_options().map(|()| None);
    }
    let (args, unknown) = config::read(flags, &config::environment())?;
    *junit = fleet::junit_files(&args);
    start_log(args.log.verbose, args.log.log_format.unwrap_or_default());
    for warning in unknown {
        warn!("{warning}");
    }
    Ok(Some(args))
}

/// Serves the robots until a signal.
async fn serve_robots(
    args: &ServeArgs,
    config: FleetConfig,
    junit: &mut BTreeSet<PathBuf>,
) -> anyhow::Result<u8> {
    // Before the ready line: a signal that follows it must not find the default action.
    let stop = stop_signal().context("cannot listen for signals")?;
    let settings = config.control.clone();
    let fleet = Fleet::open(config)?;
    let control = match &settings {
        Some(settings) => {
            let server = bind_control(settings)?;
            let address = server.address();
            server.serve(Arc::clone(&fleet) as Arc<dyn Robots>);
            Some(address)
        }
        None => None,
    };
    let robots: Vec<RobotInfo> = fleet.infos().collect();
    let _announced = Instance::current(&robots, control).announce();
    let ready = Ready {
        robots: &robots,
        only: fleet.only_one(),
        control,
        has_token: settings.is_some_and(|control| control.token.is_some()),
        vary: fleet.vary(),
        in_container: ready::in_container(),
    };
    say_ready(args, &ready)?;
    junit.clear();
    stop.await;
    let code = fleet.end().await?;
    info!("ended");
    Ok(code)
}

/// Says that the ports are open: by the ready line, the banner, or a line of the log.
fn say_ready(args: &ServeArgs, ready: &Ready<'_>) -> anyhow::Result<()> {
    if args.network.ready_json.unwrap_or(false) {
        return ready::print_line(&ready.line()).context("cannot write to stdout");
    }
    match args.log.log_format.unwrap_or_default() {
        LogFormat::Text => output::tell(ready),
        LogFormat::Json => info!(event = "ready", "ready: {}", ready.summary()),
    }
    Ok(())
}

/// `--set help`.
pub(super) fn list_options() -> anyhow::Result<()> {
    let lines = OPTIONS
        .iter()
        .map(|row| format!("{:<20} {}\n", row.key, row.values()));
    output::print(lines.collect::<String>())
}

#[cfg(unix)]
pub(super) fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut quit = signal(SignalKind::quit())?;
    // Its terminal is gone: reports and snapshots are written as at any other end.
    let mut hang_up = signal(SignalKind::hangup())?;
    // The loop looks in each of its turns: a task costs less to look at than four signals.
    let signal = tokio::spawn(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = quit.recv() => {}
            _ = hang_up.recv() => {}
        }
    });
    Ok(async move { drop(signal.await) })
}

#[cfg(not(unix))]
pub(super) fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    })
}
