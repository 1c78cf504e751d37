//! `ts3100 serve`: from the configuration to a running hub, its ready line and its end by a signal.

use crate::config::{self, ServeArgs, Settings, option_keys};
use crate::embed::single_threaded;
use crate::hub::Hub;
use crate::log;
use crate::ready::{Ready, banner};
use crate::snapshot;
use anyhow::Context as _;
use std::io::Write as _;
use std::process::ExitCode;
use tracing::{info, warn};

/// Exit code when the emulator could not start.
const COULD_NOT_START: u8 = 2;

/// Runs until a signal.
pub(super) fn run(args: ServeArgs) -> ExitCode {
    match serve(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ts3100: {error:#}");
            ExitCode::from(COULD_NOT_START)
        }
    }
}

fn serve(flags: ServeArgs) -> anyhow::Result<()> {
    if flags.set.iter().any(|pair| pair == "help") {
        return list_options();
    }
    let (args, unknown) = config::read(flags, &std::env::vars_os().collect())?;
    log::start(args.verbose, args.log_format.unwrap_or_default());
    for name in unknown {
        warn!("the environment variable {name} means nothing to ts3100 serve");
    }
    let settings = Settings::from_args(&args)?;
    let runtime = single_threaded()?;
    runtime.block_on(async {
        // Before the ready line: a signal that follows it must not find the default action.
        let stop = stop_signal().context("cannot listen for signals")?;
        let (hub, _panel) = Hub::open(&settings).await?;
        if args.ready_json.unwrap_or(false) {
            let line = Ready::new(hub.ports(), &hub.serial()).line()?;
            let mut stdout = std::io::stdout().lock();
            writeln!(stdout, "{line}")
                .and_then(|()| stdout.flush())
                .context("cannot write to stdout")?;
        } else {
            eprint!(
                "{}",
                banner(&settings, hub.ports(), &hub.serial(), hub.has_demo())
            );
        }
        let controller = hub.run(stop).await;
        if let Some(path) = &args.snapshot_on_exit {
            snapshot::write(path, &controller)?;
        }
        info!("ended");
        Ok(())
    })
}

/// `--set help`.
fn list_options() -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    for (key, values) in option_keys() {
        writeln!(stdout, "{key:<20} {values}")?;
    }
    Ok(())
}

#[cfg(unix)]
pub(super) fn stop_signal() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
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
