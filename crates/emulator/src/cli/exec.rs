//! `ts3100 exec [serve options] -- COMMAND...`: runs a command with an emulator that lives as long as the command.
//!
//! It takes the flags of `serve` and shares its reports ([`super::serve`]). Here the command is started with the
//! addresses in its environment, signals are forwarded to it, and its exit code is combined with the result of the
//! reports. [`super::guard`] ends the command when exec itself is killed.

use super::ending::{Ending, run_to_end};
use super::exit::{BY_SIGNAL, EMULATOR_FAILED, NOT_EXECUTABLE, NOT_FOUND, REPORTS_FAILED};
use super::guard::Guard;
use super::serve::{configured, reporting};
use super::trace::{self, TraceFile};
use crate::config::args::PortSource;
use crate::config::fleet::FleetConfig;
use crate::config::{Seed, ServeArgs, Settings, exported};
use crate::embed::single_threaded;
use crate::instances::Instance;
use crate::launch::{Launched, ONLY};
use crate::log;
use anyhow::Context as _;
use clap::Args;
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::process::{ExitCode, ExitStatus};
use tokio::process::{Child, Command};
use ts3100_control::robots::RobotInfo;
use ts3100_controller::port::Port;
use ts3100_driver::driver::self_check::connectable;

/// Run a command with an emulator that lives as long as the command.
///
/// The command starts when the emulator answers. It finds the emulator through its environment: TS3100_IP0 to TS3100_IP3
/// (ADDRESS:PORT), TS3100_HOST, TS3100_IP0_PORT to TS3100_IP3_PORT, and TS3100_CONTROL_URL. Signals are passed on. Every
/// flag of `serve` is accepted; the robot takes free ports unless you give --ports or --port-offset, and the log shows
/// warnings only.
///
/// Exit codes: that of the command, or 128 + N when signal N ended it; plus 64 if the scenario failed, a finding was
/// denied or the coverage is too low; 125 wrong usage, or the emulator cannot start; 126 or 127 the command cannot be
/// executed.
#[derive(Debug, Clone, Args)]
pub(super) struct ExecArgs {
    #[command(flatten)]
    serve: ServeArgs,
    /// Keep the run here if it fails: .html for a browser, .txt or .jsonl for `ts3100 view` (repeatable)
    #[arg(long, value_name = "FILE", help_heading = "Reports")]
    trace_on_failure: Vec<TraceFile>,
    /// Command to run, with its arguments
    #[arg(
        last = true,
        required_unless_present = "set",
        value_name = "COMMAND",
        help_heading = "Arguments"
    )]
    command: Vec<OsString>,
}

/// The command cannot be executed.
#[derive(Debug, thiserror::Error)]
#[error("cannot run {}: {reason}", command.to_string_lossy())]
struct CommandError {
    command: OsString,
    reason: io::Error,
}

/// Why nothing is run.
const NO_COMMAND: &str = "the command is missing: ts3100 exec [OPTIONS] -- COMMAND";
/// Why several robots are refused.
const SEVERAL_ROBOTS: &str =
    "exec runs one robot; start several with `ts3100 serve --ready-json` and read their ports from its line";

/// Why a trace is refused.
const NO_RECORD: &str =
    "--trace-on-failure: the run is kept for the control interface alone; leave out --control off";

/// Runs to the end of the command.
pub(super) fn run(args: ExecArgs) -> ExitCode {
    let junit = args.serve.scenario.junit.clone();
    let code_of = |error: &anyhow::Error| {
        let command = error.downcast_ref::<CommandError>();
        match command.map(|error| error.reason.kind()) {
            None => EMULATOR_FAILED,
            Some(io::ErrorKind::NotFound) => NOT_FOUND,
            Some(_) => NOT_EXECUTABLE,
        }
    };
    reporting(junit, |junit| exec(args, junit), code_of)
}

/// `junit` becomes the reports that the whole configuration asks for, as soon as that is known, and none as soon as the
/// run has results of its own.
fn exec(args: ExecArgs, junit: &mut BTreeSet<PathBuf>) -> anyhow::Result<u8> {
    let ExecArgs {
        serve: flags,
        trace_on_failure: traces,
        command,
    } = args;
    let Some(mut args) = configured(flags, junit, log::start_quiet)? else {
        return Ok(0);
    };
    let (program, rest) = command.split_first().context(NO_COMMAND)?;
    if args.network.ports.is_none() && args.network.port_offset.is_none() {
        args.network.ports = Some(PortSource::Auto);
    }
    let config = FleetConfig::from_args(&args)?;
    let settings = config.only().context(SEVERAL_ROBOTS)?;
    if let Some(Seed::Drawn(seed)) = args.variation.vary {
        // The log is quiet here, and without the seed a failure could not be repeated.
        log::print_note(format_args!(
            "legal variation with seed {seed}; repeat it with --vary {seed}"
        ));
    }
    Ending::check(settings)?;
    if !traces.is_empty() {
        settings.control.as_ref().context(NO_RECORD)?;
        trace::check(&traces)?;
    }
    let runtime = single_threaded()?;
    runtime.block_on(async {
        let (mut driver, launched) = Launched::alone(settings)?;
        driver.self_check(settings.listen).await?;
        let control = launched.open_control(&driver, settings)?;
        let robot = launched.info(&driver, ONLY.to_owned(), settings);
        let instance = Instance::current(std::slice::from_ref(&robot), control);
        let _announced = instance.announce();
        let wait = forward_signals().context("cannot listen for signals")?;
        let mut guard = Guard::start().context("cannot start the guard of the command")?;
        let mut child = build_command(program, rest, settings, &robot, &instance)
            .spawn()
            .map_err(|reason| CommandError {
                command: program.clone(),
                reason,
            })?;
        let watched = child.id().map_or(Ok(()), |id| guard.watch(id));
        watched.context("the guard of the command has ended")?;
        let mut status = None;
        let stop = async {
            status = Some(wait(&mut child).await);
            drop(guard);
        };
        junit.clear();
        let (ended, now) = run_to_end(stop, driver, &launched, settings).await?;
        let status = status.context("the command was not waited for")?;
        let status = status.context("cannot wait for the command")?;
        let code = exit_code(status) | if ended == 0 { 0 } else { REPORTS_FAILED };
        if let Some(journal) = launched.journal().filter(|_| code != 0) {
            trace::keep(&traces, journal, now);
        }
        Ok(code)
    })
}

fn build_command(
    program: &OsStr,
    rest: &[OsString],
    settings: &Settings,
    robot: &RobotInfo,
    instance: &Instance,
) -> Command {
    let mut command = Command::new(program);
    command.args(rest).kill_on_drop(true);
    let mut export = |name: String, value: Option<String>| {
        match value {
            Some(value) => command.env(name, value),
            // One of an emulator around this one would mislead.
            None => command.env_remove(name),
        };
    };
    export(
        exported::HOST.to_owned(),
        Some(connectable(settings.listen).to_string()),
    );
    for port in Port::ETHERNET {
        let place = instance.ports.get(port.name());
        export(exported::channel(port), place.map(ToString::to_string));
        let number = place.map(|place| place.port().to_string());
        export(exported::channel_port(port), number);
    }
    export(exported::CONTROL_URL.to_owned(), instance.control.clone());
    export(exported::ROBOT.to_owned(), None);
    for port in Port::SERIAL {
        let place = robot.serial.get(&port.name().to_ascii_lowercase());
        export(exported::serial_line(port), place.cloned());
    }
    command
}

#[cfg(unix)]
fn exit_code(status: ExitStatus) -> u8 {
    use std::os::unix::process::ExitStatusExt as _;
    let code = status
        .code()
        .or_else(|| status.signal().map(|signal| BY_SIGNAL + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(1)
}

#[cfg(not(unix))]
fn exit_code(status: ExitStatus) -> u8 {
    let code = status.code().unwrap_or(BY_SIGNAL);
    u8::try_from(code).unwrap_or(1)
}

/// Listens for signals from now on. The result waits for the end of the command; what is sent to us is sent to it.
#[cfg(unix)]
fn forward_signals() -> io::Result<impl AsyncFnOnce(&mut Child) -> io::Result<ExitStatus>> {
    use rustix::process::Signal;
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    let mut quit = signal(SignalKind::quit())?;
    Ok(async move |child: &mut Child| {
        loop {
            let (signal, by_terminal) = tokio::select! {
                status = child.wait() => return status,
                _ = interrupt.recv() => (Signal::INT, true),
                _ = quit.recv() => (Signal::QUIT, true),
                _ = terminate.recv() => (Signal::TERM, false),
                _ = hang_up.recv() => (Signal::HUP, false),
            };
            // The terminal has told the command itself.
            if by_terminal && is_in_foreground() {
                continue;
            }
            let id = child.id().and_then(|id| i32::try_from(id).ok());
            if let Some(id) = id.and_then(rustix::process::Pid::from_raw) {
                // It may have ended just now.
                let _ = rustix::process::kill_process(id, signal);
            }
        }
    })
}

#[cfg(unix)]
fn is_in_foreground() -> bool {
    rustix::termios::tcgetpgrp(io::stdin()).is_ok_and(|group| group == rustix::process::getpgrp())
}

/// The result waits for the end of the command; Ctrl-C has reached it too.
#[cfg(not(unix))]
fn forward_signals() -> io::Result<impl AsyncFnOnce(&mut Child) -> io::Result<ExitStatus>> {
    Ok(async |child: &mut Child| {
        loop {
            tokio::select! {
                status = child.wait() => return status,
                _ = tokio::signal::ctrl_c() => {}
            }
        }
    })
}
