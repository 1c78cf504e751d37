//! The command line `ts3100 serve | exec | host | check | fmt | run | faults | tap | diff | coverage | ctl |
//! completions`: reads it, runs one of them, says the exit code.

mod check;
mod coverage;
mod ctl;
mod diff;
mod exec;
mod faults;
mod format;
mod host;
mod report;
mod run;
mod serve;
mod tap;

use crate::config::ServeArgs;
use clap::{CommandFactory as _, Parser, Subcommand};
use clap_complete::Shell;
use std::io::Write as _;
use std::process::ExitCode;

/// A stand-in for the Toshiba Machine TS3100 / TSL3100 robot controller.
#[derive(Debug, Parser)]
#[command(name = "ts3100", version, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// An error and its causes on one line. A cause whose words an error has taken into its own is not said twice.
fn words(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if line.is_empty() {
            line = cause;
        } else if !line.ends_with(&cause) {
            line = format!("{line}: {cause}");
        }
    }
    line
}

#[derive(Debug, Subcommand)]
enum Command {
    Serve(Box<ServeArgs>),
    Exec(Box<exec::ExecArgs>),
    Host(host::HostArgs),
    Check(check::CheckArgs),
    Fmt(format::FormatArgs),
    Run(run::RunArgs),
    Faults(faults::FaultsArgs),
    Tap(tap::TapArgs),
    Diff(Box<diff::DiffArgs>),
    Ctl(Box<ctl::CtlArgs>),
    /// Prints what the shell needs to complete the words of this command line
    Completions {
        /// bash: `source <(ts3100 completions bash)`; zsh and fish likewise
        shell: Shell,
    },
    Coverage(coverage::CoverageArgs),
}

/// Reads the command line of the process and does what it says. Wrong usage is exit code 2.
#[must_use]
pub fn main() -> ExitCode {
    match Cli::parse().command {
        Command::Serve(args) => serve::run(*args),
        Command::Exec(args) => exec::run(*args),
        Command::Host(args) => host::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Fmt(args) => format::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Faults(args) => faults::run(&args),
        Command::Tap(args) => tap::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Ctl(args) => ctl::run(&args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "ts3100", &mut script);
            // A reader that has seen enough is no mistake.
            let _ = std::io::stdout().write_all(&script);
            ExitCode::SUCCESS
        }
        Command::Coverage(args) => coverage::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use super::words;
    use anyhow::Context as _;

    #[derive(Debug, thiserror::Error)]
    #[error("cannot read it: {source}")]
    struct Whole {
        source: std::io::Error,
    }

    #[test]
    fn a_cause_is_said_once() {
        let source = std::io::Error::other("not there");
        let error = Err::<(), _>(Whole { source }).context("--load").unwrap_err();
        assert_eq!(words(&error), "--load: cannot read it: not there");
    }
}
