//! `ts3100 completions`: the completion script of a shell.
//!
//! The grammar of the command line has no list of words where a value may be a path or a number too. The script offers
//! the words of such a value; the parser still accepts the others.

use super::{Cli, output};
use crate::config::OPTIONS;
use crate::config::model::SHIPPED;
use clap::builder::PossibleValuesParser;
use clap::{Arg, CommandFactory as _};
use clap_complete::Shell;
use ts3100_controller::faults::KINDS;

/// Prints the script.
pub(super) fn run(shell: Shell) -> anyhow::Result<u8> {
    let mut program = Cli::command().mut_subcommands(|command| command.mut_args(with_words));
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut program, "ts3100", &mut script);
    output::print(script).map(|()| 0)
}

/// The argument with the words that its value may begin with.
fn with_words(argument: Arg) -> Arg {
    let words: Vec<&'static str> = match argument.get_long() {
        Some("time") => vec!["real", "stepped", "auto", "x10"],
        Some("model") => SHIPPED.iter().map(|(name, _)| *name).collect(),
        Some("set") => OPTIONS.iter().map(|option| option.key).collect(),
        Some("fault") => KINDS.iter().map(|kind| kind.name).collect(),
        _ => return argument,
    };
    argument.value_parser(PossibleValuesParser::new(words))
}
