//! The command line of `ts3100`: one file or folder for each subcommand.
//!
//! Each subcommand parses its flags, calls the library and maps the result to an exit code. Logic that does not
//! depend on the command line belongs in the library modules, not here. `serve` is the best place to start.

mod check;
mod completions;
mod config;
mod controls;
mod coverage;
mod ctl;
mod dap;
mod diff;
mod docs;
mod editor;
mod ending;
mod exec;
mod exit;
mod faults;
mod fleet;
mod format;
mod guard;
mod help;
mod host;
mod input;
mod junit_stub;
mod lsp;
mod man;
mod mcp;
mod output;
mod programs;
mod ready;
mod run;
mod serve;
mod simulate;
pub(crate) mod survey;
mod tap;
mod test;
mod trace;
mod usage;
mod view;
mod watch;

pub use exit::ALL as EXIT_CODES;

use crate::config::ServeArgs;
use crate::log;
use crate::log::print_error;
use clap::error::ErrorKind;
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use help::Extent;
use std::ffi::OsString;
use std::process::ExitCode;

/// Emulator of the Toshiba Machine TS3100 / TSL3100 robot controller.
#[derive(Debug, Parser)]
#[command(name = "ts3100", version, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Serve(Box<ServeArgs>),
    Exec(Box<exec::ExecArgs>),
    Host(host::HostArgs),
    Check(check::CheckArgs),
    Fmt(format::FormatArgs),
    Lsp(lsp::LspArgs),
    Dap(dap::DapArgs),
    Run(run::RunArgs),
    Test(test::TestArgs),
    Faults(faults::FaultsArgs),
    Tap(tap::TapArgs),
    Diff(Box<diff::DiffArgs>),
    View(Box<view::ViewArgs>),
    Survey(survey::SurveyArgs),
    Conform(survey::ConformArgs),
    Fidelity(survey::FidelityArgs),
    Simulate(simulate::SimulateArgs),
    Ctl(Box<ctl::CtlArgs>),
    Mcp(mcp::McpArgs),
    Ready(ready::ReadyArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
    Coverage(coverage::CoverageArgs),
    Config(config::ConfigArgs),
    Docs(docs::DocsArgs),
    Explain(docs::ExplainArgs),
}

/// The definition of the command line with its whole help, for manuals.
pub fn definition() -> clap::Command {
    help::with_help(grammar(), Extent::Everything)
}

/// The definition by which a command line is read.
fn grammar() -> clap::Command {
    usage::with_negative_numbers(usage::with_positionals(Cli::command()))
}

/// Reads the command line of the process and does what it says. Wrong usage is exit code 2, of `exec` 125.
pub fn main() -> ExitCode {
    // No word for people: `exec` starts its guard so.
    if std::env::args_os()
        .nth(1)
        .is_some_and(|word| word == guard::SUBCOMMAND)
    {
        return guard::run();
    }
    completions::answer_shell();
    let command = parse_serve().unwrap_or_else(|| {
        let cli = grammar()
            .try_get_matches()
            .and_then(|found| Cli::from_arg_matches(&found));
        cli.unwrap_or_else(|error| exit_with_usage_error(error)).command
    });
    let code = run(command);
    log::flush();
    code
}

/// The command line of `serve`, read by the definitions of the flags that it has: that of all subcommands takes longer
/// to build than a robot to start. `None` for every other command line, and for one that is wrong or asks for help.
fn parse_serve() -> Option<Command> {
    let mut words = std::env::args_os().skip(1);
    words.next().filter(|word| word == "serve")?;
    let words: Vec<OsString> = words.collect();
    ServeArgs::from_words(&words)
        .ok()
        .map(|args| Command::Serve(Box::new(args)))
}

/// Runs a subcommand. The result of most is their exit code; an error is printed.
fn run(command: Command) -> ExitCode {
    let done = match command {
        Command::Serve(args) => return serve::run(*args),
        Command::Exec(args) => return exec::run(*args),
        Command::Host(args) => host::run(&args),
        Command::Check(args) => check::run(args),
        Command::Fmt(args) => format::run(&args),
        Command::Lsp(args) => lsp::run(&args),
        Command::Dap(args) => dap::run(&args),
        Command::Run(args) => run::run(args),
        Command::Test(args) => test::run(args),
        Command::Faults(args) => faults::run(&args),
        Command::Tap(args) => tap::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::View(args) => view::run(&args),
        Command::Survey(args) => survey::run(&args),
        Command::Conform(args) => survey::conform(&args),
        Command::Fidelity(args) => survey::fidelity(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Ctl(args) => ctl::run(&args),
        Command::Mcp(args) => mcp::run(&args),
        Command::Ready(args) => ready::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
        Command::Coverage(args) => coverage::run(&args),
        Command::Config(args) => config::run(&args),
        Command::Docs(args) => docs::run(&args),
        Command::Explain(args) => docs::explain(&args),
    };
    ExitCode::from(done.unwrap_or_else(|error| {
        print_error(format_args!("{error:#}"));
        exit::UNUSABLE
    }))
}

fn is_help(error: &clap::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::DisplayHelp | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    )
}

/// Says what is wrong with the command line, in the JUnit report too if one was asked for, and ends the process.
fn exit_with_usage_error(error: clap::Error) -> ! {
    let words: Vec<OsString> = std::env::args_os().skip(1).collect();
    if is_help(&error) {
        let program = help::with_help(grammar(), Extent::of(&words));
        let help = program.try_get_matches_from(std::env::args_os()).err();
        exit_with_help(&help.filter(is_help).unwrap_or(error));
    }
    if error.kind() == ErrorKind::DisplayVersion {
        exit_with_help(&error);
    }
    let error = usage::explain(error, &grammar(), &words);
    let mut words = words.into_iter();
    let command = words.next().unwrap_or_default();
    // The version is no error.
    if (command == "exec" || command == "serve") && error.use_stderr() {
        let path = junit_stub::path_from_arguments(words);
        junit_stub::write(&path, &error.render().to_string());
    }
    if command == "exec" && error.use_stderr() {
        // A closed stderr takes no message.
        let _ = error.print();
        std::process::exit(i32::from(exit::EMULATOR_FAILED));
    }
    error.exit()
}

/// Prints a help or the version, and ends the process.
fn exit_with_help(help: &clap::Error) -> ! {
    if help.use_stderr() {
        help.exit();
    }
    if let Err(error) = output::written(help.print()) {
        print_error(format_args!("{error:#}"));
        std::process::exit(i32::from(exit::UNUSABLE));
    }
    std::process::exit(0)
}

#[cfg(test)]
mod tests {
    #[test]
    fn each_argument_has_a_help() {
        fn bare(command: &clap::Command, path: &str) -> Vec<String> {
            let path = format!("{path} {}", command.get_name());
            let arguments = command
                .get_arguments()
                .filter(|argument| argument.get_help().is_none());
            let own = arguments.map(|argument| format!("{path} {argument}"));
            let below = command.get_subcommands().flat_map(|below| bare(below, &path));
            own.chain(below).collect()
        }
        assert_eq!(bare(&super::definition(), ""), [""; 0]);
    }
}
