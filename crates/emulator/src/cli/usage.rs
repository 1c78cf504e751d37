//! Messages about a command line that clap does not take. Some of clap's own do not help: a word that is not a command
//! where other arguments are possible too, the command of `exec` without `--`, and a word of another program.

use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::ffi::OsString;
use ts3100_proto::words::did_you_mean;

/// Words that people type for others: the command, the word, and the end of the message.
const HINTS: [(&str, &str, &str); 25] = [
    ("ts3100", "start", "; did you mean `serve`?"),
    ("ts3100", "version", "; did you mean `--version`?"),
    ("serve", "--port", "; did you mean `--port-offset`?"),
    ("exec", "--port", "; did you mean `--port-offset`?"),
    ("serve", "--offset", "; did you mean `--port-offset`?"),
    ("exec", "--offset", "; did you mean `--port-offset`?"),
    ("serve", "--bind", "; did you mean `--listen`?"),
    ("exec", "--bind", "; did you mean `--listen`?"),
    (
        "serve",
        "--run-mode",
        "; `ts3100 ctl run-mode` sets the operation mode of a running robot",
    ),
    (
        "exec",
        "--run-mode",
        "; `ts3100 ctl run-mode` sets the operation mode of a running robot",
    ),
    ("ctl", "estop", "; did you mean `emergency-stop`?"),
    ("ctl", "e-stop", "; did you mean `emergency-stop`?"),
    ("ctl", "time", "; did you mean `clock`?"),
    ("ctl", "advance", "; did you mean `clock advance`?"),
    ("ctl", "pose", "; did you mean `arm pose`?"),
    ("ctl", "speed", "; did you mean `override`?"),
    ("snapshots", "save", "; did you mean `take`?"),
    (
        "wires",
        "on",
        "; name the line and its state: `ts3100 ctl wires NAME on`",
    ),
    (
        "wires",
        "off",
        "; name the line and its state: `ts3100 ctl wires NAME off`",
    ),
    ("breakpoints", "none", "; did you mean `--none`?"),
    ("breakpoints", "clear", "; did you mean `--none`?"),
    ("inputs", "1", "; did you mean `on`?"),
    ("inputs", "0", "; did you mean `off`?"),
    ("outputs", "1", "; did you mean `on`?"),
    ("outputs", "0", "; did you mean `off`?"),
];

/// Words that people type for the states of a switch.
const STATES: [(&str, &str); 4] = [("1", "on"), ("true", "on"), ("0", "off"), ("false", "off")];
/// Units of durations, which some people write as a word of their own.
const UNITS: [&str; 4] = ["us", "ms", "s", "min"];

/// The commands of `ctl` whose own commands follow an argument that may be left out.
const BELOW_ARGUMENT: [&str; 3] = ["inputs", "outputs", "channels"];

/// The definition, in which a number below zero is the value of the flag before it and no flag: its own message says what fits.
pub(super) fn with_negative_numbers(command: Command) -> Command {
    command
        .mut_args(|argument| {
            let takes_number = argument.get_long().is_some() && argument.get_action().takes_values();
            match takes_number {
                true => argument.allow_negative_numbers(true),
                false => argument,
            }
        })
        .mut_subcommands(with_negative_numbers)
}

/// The definition, with the argument in the usage of the commands after it: `ts3100 ctl outputs <LINE> force <STATE>`.
/// clap leaves it out, because `ctl outputs` alone is a command too.
pub(super) fn with_positionals(root: Command) -> Command {
    root.mut_subcommands(|command| match command.get_name() {
        "ctl" => command.mut_subcommands(|command| match BELOW_ARGUMENT.contains(&command.get_name()) {
            true => with_argument(command),
            false => command,
        }),
        _ => command,
    })
}

fn with_argument(command: Command) -> Command {
    let arguments = command.get_positionals();
    let arguments: String = arguments
        .map(|argument| format!(" <{}>", argument.get_id().as_str().to_uppercase()))
        .collect();
    let path = format!("ts3100 ctl {}{arguments}", command.get_name());
    command.mut_subcommands(|inner| {
        let usage = inner.clone().render_usage().to_string();
        let usage = usage.trim_start_matches("Usage: ");
        inner.override_usage(format!("{path} {usage}"))
    })
}

/// The error with a better message, where there is one. `words` is the command line without the program.
pub(super) fn explain(mut error: Error, root: &Command, words: &[OsString]) -> Error {
    if error.kind() == ErrorKind::InvalidValue
        && let Some(ContextValue::String(found)) = error.get(ContextKind::InvalidValue)
        && let Some((_, meant)) = STATES.iter().find(|(word, _)| word == found)
        && let Some(ContextValue::Strings(known)) = error.get(ContextKind::ValidValue)
        && known.iter().any(|word| word == meant)
    {
        error.insert(
            ContextKind::SuggestedValue,
            ContextValue::String((*meant).to_owned()),
        );
        return error;
    }
    if error.kind() == ErrorKind::ValueValidation
        && let Some(ContextValue::String(found)) = error.get(ContextKind::InvalidValue)
        && let Some(hint) = hint(deepest(root, words, found).0.get_name(), found)
    {
        let message = format!("unknown word `{found}`{hint}\n");
        return Error::raw(ErrorKind::ValueValidation, message).with_cmd(root);
    }
    let word = error
        .get(ContextKind::InvalidArg)
        .or_else(|| error.get(ContextKind::InvalidSubcommand));
    if error.kind() == ErrorKind::MissingSubcommand {
        // clap lists aliases like commands.
        let (command, path) = deepest(root, words, "");
        let list = list(command, &path);
        let message = format!("the command is missing{list}\n\nFor more information, try '{path} --help'.\n");
        return Error::raw(ErrorKind::MissingSubcommand, message).with_cmd(root);
    }
    let unknown = matches!(
        error.kind(),
        ErrorKind::UnknownArgument | ErrorKind::InvalidSubcommand
    );
    let found = match word {
        Some(ContextValue::String(found)) if unknown => found,
        _ => return error,
    };
    if let Some(number) = number_before(found, words) {
        let message = format!(
            "unexpected `{found}` after `{number}`; write a duration as one word: `{number}{found}`\n"
        );
        return Error::raw(ErrorKind::UnknownArgument, message).with_cmd(root);
    }
    let (command, path) = deepest(root, words, found);
    let hint = hint(command.get_name(), found);
    let message = if found.starts_with('-') {
        match hint {
            Some(hint) => format!("unknown flag `{found}`{hint}\n"),
            None => return error,
        }
    } else if command.get_name() == "exec" {
        format!("put `--` before the command: {path} [OPTIONS] -- {found}\n")
    } else if command.has_subcommands() {
        unknown_command(command, &path, found, hint)
    } else {
        return error;
    };
    Error::raw(ErrorKind::UnknownArgument, message).with_cmd(root)
}

/// Suggestion for an unknown word.
fn hint(command: &str, found: &str) -> Option<String> {
    let is_number = found.starts_with(|first: char| first.is_ascii_digit());
    if command == "alarms" && is_number {
        return Some(format!("; `ts3100 ctl alarms table {found}` explains the alarm"));
    }
    let axis = found.trim_start_matches(['J', 'j']);
    if command == "jog" && axis.parse::<u8>().is_ok() {
        return Some(format!(
            "; the direction comes first: `ts3100 ctl jog plus {axis}` or `ts3100 ctl jog minus {axis}`"
        ));
    }
    let mut hints = HINTS.into_iter();
    let (_, _, hint) = hints.find(|(of, word, _)| *of == command && *word == found)?;
    Some(hint.to_owned())
}

/// The number before a word that is a unit.
fn number_before(word: &str, words: &[OsString]) -> Option<String> {
    let at = words.iter().position(|known| known == word)?;
    let before = words.get(at.checked_sub(1)?)?.to_str()?;
    (UNITS.contains(&word) && before.parse::<f64>().is_ok()).then(|| before.to_owned())
}

/// The subcommand that the words before the wrong one lead to, and how it is called.
fn deepest<'a>(root: &'a Command, words: &[OsString], wrong: &str) -> (&'a Command, String) {
    let mut found = (root, root.get_name().to_owned());
    for word in words.iter().take_while(|word| *word != "--" && *word != wrong) {
        if let Some(command) = found.0.find_subcommand(word) {
            found = (command, format!("{} {}", found.1, command.get_name()));
        }
    }
    found
}

fn names(command: &Command) -> impl Iterator<Item = &str> {
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    shown.map(Command::get_name)
}

/// All commands, as the end of a message.
fn list(command: &Command, path: &str) -> String {
    let names: Vec<&str> = names(command).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("\n\nCommands of `{path}`: {}", names.join(" "))
}

/// The message names what was probably meant, or else all commands.
fn unknown_command(command: &Command, path: &str, found: &str, hint: Option<String>) -> String {
    let hint = hint.unwrap_or_else(|| did_you_mean(found, names(command)));
    let list = match hint.as_str() {
        "" => list(command, path),
        _ => String::new(),
    };
    format!("unknown command `{found}`{hint}{list}\n\nFor more information, try '{path} --help'.\n")
}
