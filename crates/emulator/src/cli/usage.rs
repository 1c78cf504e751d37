//! Messages about a command line that clap does not take. Three of clap's own do not help: a word that is not a command
//! where other arguments are possible too, the command of `exec` without `--`, and a flag of another command.

use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::ffi::OsString;
use ts3100_proto::words::did_you_mean;

/// The error with a better message, where there is one. `words` is the command line without the program.
pub(super) fn explain(error: Error, root: &Command, words: &[OsString]) -> Error {
    let word = error
        .get(ContextKind::InvalidArg)
        .or_else(|| error.get(ContextKind::InvalidSubcommand));
    let unknown = matches!(
        error.kind(),
        ErrorKind::UnknownArgument | ErrorKind::InvalidSubcommand
    );
    let found = match word {
        Some(ContextValue::String(found)) if unknown && !found.starts_with('-') => found,
        _ => return error,
    };
    let (command, path) = deepest(root, words);
    let message = if command.get_name() == "exec" {
        format!("put `--` before the command: {path} [OPTIONS] -- {found}\n")
    } else if command.has_subcommands() {
        unknown_command(command, &path, found)
    } else {
        return error;
    };
    Error::raw(ErrorKind::UnknownArgument, message)
}

/// The subcommand that the words lead to, and how it is called.
fn deepest<'a>(root: &'a Command, words: &[OsString]) -> (&'a Command, String) {
    let mut found = (root, root.get_name().to_owned());
    for word in words.iter().take_while(|word| *word != "--") {
        if let Some(command) = found.0.find_subcommand(word) {
            found = (command, format!("{} {}", found.1, command.get_name()));
        }
    }
    found
}

fn unknown_command(command: &Command, path: &str, found: &str) -> String {
    let names: Vec<&str> = command
        .get_subcommands()
        .filter(|command| !command.is_hide_set())
        .map(Command::get_name)
        .collect();
    let hint = did_you_mean(found, names.iter().copied());
    format!(
        "unknown command `{found}`{hint}\n\nCommands of `{path}`: {}\n\nFor more information, try '{path} --help'.\n",
        names.join(" ")
    )
}
