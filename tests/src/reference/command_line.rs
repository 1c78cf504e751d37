//! The command line: every subcommand with its flags, from their definition.

use super::{code, table};
use clap::{Arg, Command};
use std::fmt::Write as _;
use ts3100_emulator::cli;
use ts3100_emulator::config::schema::{split_default, variable};

/// A section for each subcommand.
pub fn commands() -> String {
    let mut program = cli::definition();
    program.build();
    let serve = program.find_subcommand("serve").expect("a subcommand serve");
    let mut text = String::new();
    for command in shown(&program) {
        let flags = match command.get_name() {
            "serve" => Flags::Configured,
            "exec" => Flags::OfServe(serve),
            _ => Flags::Own,
        };
        section(&mut text, "ts3100", command, flags);
    }
    text.trim().to_owned()
}

/// Which flags of a subcommand are shown, and how.
#[derive(Clone, Copy)]
enum Flags<'a> {
    /// All, with the variable of each.
    Configured,
    /// All but those that `serve` has.
    OfServe(&'a Command),
    /// All.
    Own,
}

fn shown(command: &Command) -> impl Iterator<Item = &Command> {
    command
        .get_subcommands()
        .filter(|command| !command.is_hide_set() && command.get_name() != "help")
}

fn section(text: &mut String, parent: &str, command: &Command, flags: Flags<'_>) {
    let path = format!("{parent} {}", command.get_name());
    let level = "#".repeat(path.split(' ').count());
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    write!(text, "\n\n{level} {path}\n\n{}", sentence(&about)).unwrap();
    if let Flags::OfServe(_) = flags {
        text.push_str(" It takes every flag of [`ts3100 serve`](#ts3100-serve), and a command after `--`.");
    }
    for (heading, arguments) in groups(command, flags) {
        if heading != "Options" && heading != "Arguments" {
            write!(text, "\n\n**{heading}**").unwrap();
        }
        let first = if heading == "Arguments" { "Operand" } else { "Flag" };
        let rows = arguments.iter().map(|argument| row(&path, "", argument));
        let rows = match flags {
            Flags::Configured => table(
                [first, "Meaning", "Default", "Variable"],
                rows.zip(&arguments).map(|([flag, meaning, default], argument)| {
                    let name = argument.get_long().unwrap_or_default();
                    [flag, meaning, default, code(&variable(name))]
                }),
            ),
            Flags::OfServe(_) | Flags::Own => table([first, "Meaning", "Default"], rows),
        };
        write!(text, "\n\n{rows}").unwrap();
    }
    let (leaves, inner): (Vec<&Command>, Vec<&Command>) =
        shown(command).partition(|command| shown(command).next().is_none());
    leaf_commands(text, &path, &leaves);
    for command in inner {
        section(text, &path, command, Flags::Own);
    }
}

/// The subcommands that have none of their own: what they do, then what they take.
fn leaf_commands(text: &mut String, path: &str, leaves: &[&Command]) {
    if leaves.is_empty() {
        return;
    }
    let rows = leaves.iter().map(|leaf| {
        let name = leaf.get_name();
        let operands: Vec<String> = leaf.get_positionals().map(shown_flag).collect();
        let usage = format!("{name} {}", operands.join(" "));
        let about = leaf.get_about().map(ToString::to_string).unwrap_or_default();
        let anchor = anchor(path, name);
        [
            format!("<a id=\"{anchor}\"></a>{}", code(usage.trim())),
            sentence(&about),
        ]
    });
    write!(text, "\n\n{}", table(["Command", "Meaning"], rows)).unwrap();
    let mut rows = Vec::new();
    for leaf in leaves {
        for (_, arguments) in groups(leaf, Flags::Own) {
            // The flags of its parent are shown there.
            let own = arguments.iter().filter(|argument| !argument.is_global_set());
            rows.extend(own.map(|argument| row(path, leaf.get_name(), argument)));
        }
    }
    if !rows.is_empty() {
        let rows = table(["Operand or flag", "Meaning", "Default"], rows);
        write!(text, "\n\n{rows}").unwrap();
    }
}

/// The arguments by the heading under which help shows them, in its order.
fn groups<'a>(command: &'a Command, flags: Flags<'_>) -> Vec<(&'a str, Vec<&'a Arg>)> {
    let is_hidden = |argument: &Arg| match flags {
        Flags::OfServe(serve) => serve
            .get_arguments()
            .any(|other| other.get_long().is_some() && other.get_long() == argument.get_long()),
        Flags::Configured | Flags::Own => false,
    };
    let mut groups: Vec<(&str, Vec<&Arg>)> = Vec::new();
    for argument in command.get_arguments() {
        let id = argument.get_id().as_str();
        if argument.is_hide_set() || is_hidden(argument) || id == "help" || id == "version" {
            continue;
        }
        let heading = match (argument.is_positional(), argument.get_help_heading()) {
            (true, _) => "Arguments",
            (false, Some(heading)) => heading,
            (false, None) => "Options",
        };
        match groups.iter_mut().find(|(known, _)| *known == heading) {
            Some((_, arguments)) => arguments.push(argument),
            None => groups.push((heading, vec![argument])),
        }
    }
    groups
}

/// An argument of a subcommand, or of a leaf below it.
fn row(path: &str, leaf: &str, argument: &Arg) -> [String; 3] {
    let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
    let (help, written) = split_default(&help);
    let help = without(&without(&help, "[env: "), "[possible values: ");
    let mut meaning = sentence(&help);
    let takes_values = argument.get_action().takes_values();
    let words: Vec<String> = argument
        .get_possible_values()
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(|value| code(value.get_name()))
        .collect();
    if takes_values && !words.is_empty() && words != ["`true`", "`false`"] {
        write!(meaning, " One of {}.", words.join(", ")).unwrap();
    }
    let values = argument.get_default_values().iter().filter(|_| takes_values);
    let values: Vec<String> = values.map(|value| value.to_string_lossy().into_owned()).collect();
    let default = written.unwrap_or_else(|| values.join(" "));
    let default = match default.as_str() {
        "" => "-".to_owned(),
        default => code(default),
    };
    let shown = code(format!("{leaf} {}", shown_flag(argument)).trim());
    let Some(flag) = argument.get_long() else {
        return [shown, meaning, default];
    };
    let anchor = anchor(path, format!("{leaf} {flag}").trim());
    let short = argument.get_short().map(|short| format!("`-{short}`, "));
    let short = short.unwrap_or_default();
    [format!("<a id=\"{anchor}\"></a>{short}{shown}"), meaning, default]
}

fn anchor(path: &str, name: &str) -> String {
    format!("{} {name}", path.trim_start_matches("ts3100 ")).replace(' ', "-")
}

/// `--listen ADDR`.
fn shown_flag(argument: &Arg) -> String {
    let shown = argument.to_string().replace(['<', '>'], "");
    match argument.get_action().takes_values() {
        true => shown,
        false => shown.trim_end_matches("...").to_owned(),
    }
}

/// A help text without a bracket that says what the table says elsewhere.
fn without(help: &str, bracket: &str) -> String {
    let Some((before, rest)) = help.split_once(bracket) else {
        return help.to_owned();
    };
    let after = rest.split_once(']').map_or("", |(_, after)| after);
    format!("{}{after}", before.trim_end()).trim().to_owned()
}

/// Ends with a full stop, and is no markup: `<` and `*` as they are.
fn sentence(text: &str) -> String {
    let text = text
        .trim()
        .replace('<', "\\<")
        .replace('*', "\\*")
        .replace('\n', " ");
    match text.ends_with(['.', '!', '?']) || text.is_empty() {
        true => text,
        false => format!("{text}."),
    }
}
