//! Completion of the command line in a shell.
//!
//! At each TAB the shell runs this program with the words typed so far, so that it offers what this program accepts. `ts3100
//! completions SHELL` prints the script that tells the shell to do so. Values come from the tables of the code: the options with
//! their words, the kinds of faults with their parameters, the arms; files by their kind. Names of files, variables, positions and
//! snapshots come from the robot that runs.

use super::ctl::target::TargetArgs;
use super::run::CHANNELS;
use super::{Cli, output};
use crate::config::OPTIONS;
use crate::config::model::SHIPPED;
use crate::loading::EXAMPLES;
use anyhow::{Context as _, bail};
use clap::{Arg, Args, Command, CommandFactory as _};
use clap_complete::Shell;
use clap_complete::engine::{
    ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter, complete,
};
use clap_complete::env::{CompleteEnv, Elvish, EnvCompleter, Fish, Powershell, Shells, Zsh};
use serde_json::Value;
use std::ffi::{OsStr, OsString};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use ts3100_book::{Page, book};
use ts3100_controller::faults::{COMMON_KEYS, KINDS, Parameter, ParameterType};
use ts3100_controller::findings::RULES;
use ts3100_controller::{Port, action_forms};
use ts3100_driver::pc_file::drive_name;
use ts3100_proto::command::COMMANDS;
use ts3100_recording::reports::Deny;
use ts3100_recording::scenario::CHANNEL_ACTIONS;

/// The variable by which a shell asks for completions.
const VARIABLE: &str = "TS3100_COMPLETE";
/// The variable with the part of the word that Bash replaces.
const BASH_WORD: &str = "TS3100_COMPLETE_WORD";
/// Between two completions for Bash: not in a name of a file.
const BASH_SEPARATOR: &str = "\u{b}";

/// Longest wait for the names of a running robot: a TAB has to feel immediate.
const ROBOT_TIMEOUT: Duration = Duration::from_millis(200);
/// Arguments that name something of a running robot, by the command, and where its control interface lists that.
const NAMES: [(&[&str], &str, &str); 4] = [
    (&["get", "put", "erase", "select", "check"], "name", "/files"),
    (&["take", "restore", "delete", "show"], "name", "/snapshots"),
    (&["variables"], "name", "/variables"),
    (&["positions"], "name", "/positions"),
];

/// Endings of the names of files, by flag or argument and subcommand; the first row that fits counts.
const FILES: [(&str, &str, &[&str]); 19] = [
    ("", "load", &["scol", "par", "txt"]),
    ("", "scenario", &["toml"]),
    ("", "config", &["toml"]),
    ("", "like", &["toml"]),
    ("", "permissions", &["toml"]),
    ("", "model", &["toml"]),
    ("", "points", &["csv"]),
    ("", "restore", &["json", "snapshot"]),
    ("", "transcript", &["txt", "jsonl", "pcapng"]),
    ("", "trace_on_failure", &["html", "txt", "jsonl"]),
    ("", "junit", &["xml"]),
    ("", "lcov", &["info", "lcov"]),
    ("check", "files", &["scol"]),
    ("fmt", "files", &["scol"]),
    ("run", "file", &["scol"]),
    ("test", "files", &["scol", "toml"]),
    ("diff", "recording", &["txt", "jsonl", "pcapng"]),
    ("view", "recording", &["txt", "jsonl", "pcapng"]),
    ("merge", "reports", &["json"]),
];

/// Print the completion script of a shell, or install it.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell
    shell: Shell,
    /// Write it to where this shell looks for it (bash, zsh, fish)
    #[arg(long)]
    install: bool,
}

/// Prints or installs the script.
pub(super) fn run(args: &CompletionsArgs) -> anyhow::Result<u8> {
    let mut script = Vec::new();
    completer(args.shell)?.write_registration(VARIABLE, "ts3100", "ts3100", "ts3100", &mut script)?;
    if !args.install {
        return output::print(script).map(|()| 0);
    }
    let (file, note) = place(args.shell)?;
    let cannot_write = || format!("cannot write {}", file.display());
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).with_context(cannot_write)?;
    }
    std::fs::write(&file, script).with_context(cannot_write)?;
    output::print(format!("{}: {note}\n", file.display())).map(|()| 0)
}

/// Where the script of a shell goes, and what to do then.
fn place(shell: Shell) -> anyhow::Result<(PathBuf, &'static str)> {
    let folder = |variable, home| {
        let set = std::env::var_os(variable).filter(|folder| !folder.is_empty());
        let in_home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(home));
        let folder = set.map(PathBuf::from).or_else(in_home);
        folder.with_context(|| format!("cannot find your home directory: set HOME or {variable}"))
    };
    Ok(match shell {
        Shell::Bash => (
            folder("XDG_DATA_HOME", ".local/share")?.join("bash-completion/completions/ts3100"),
            "new shells complete ts3100 (package bash-completion)",
        ),
        Shell::Zsh => (
            folder("XDG_DATA_HOME", ".local/share")?.join("zsh/site-functions/_ts3100"),
            "add `fpath+=(\"${XDG_DATA_HOME:-$HOME/.local/share}/zsh/site-functions\")` before `compinit` in ~/.zshrc",
        ),
        Shell::Fish => (
            folder("XDG_CONFIG_HOME", ".config")?.join("fish/completions/ts3100.fish"),
            "new shells complete ts3100",
        ),
        other @ (Shell::PowerShell | Shell::Elvish | _) => bail!(
            "{other} has no place for completions: add the output of `ts3100 completions {other}` to your profile"
        ),
    })
}

fn completer(shell: Shell) -> anyhow::Result<&'static dyn EnvCompleter> {
    let name = shell.to_string();
    SHELLS
        .completer(&name)
        .with_context(|| format!("no completions for {name}"))
}

const SHELLS: Shells<'static> = Shells(&[&Bash, &Elvish, &Fish, &Powershell, &Zsh]);

/// Answers a shell that asks for completions, and ends the process.
pub(super) fn answer_shell() {
    if std::env::var_os(VARIABLE).is_some() {
        CompleteEnv::with_factory(|| with_values(Cli::command()))
            .var(VARIABLE)
            .shells(SHELLS)
            .complete();
    }
}

/// The command with what completes the values of its arguments, and of those of its subcommands.
fn with_values(command: Command) -> Command {
    let name = command.get_name().to_owned();
    command
        .mut_args(|argument| with_value(&name, argument))
        .mut_subcommands(with_values)
}

fn with_value(command: &str, argument: Arg) -> Arg {
    let name = argument.get_id().as_str().to_owned();
    let words: fn(&OsStr) -> Vec<CompletionCandidate> = match argument.get_long() {
        Some("time") => times,
        Some("set") => settings,
        Some("fault") => faults,
        Some("select") => selections,
        Some("model") => models,
        Some("deny") => rules,
        Some("drive" | "serial-dir") => directories,
        None if command == "mode" && name == "mode" => times,
        None if command == "arm" && name == "spec" => faults,
        Some("input") if command == "run" => inputs,
        Some("at") => moments,
        None if command == "docs" && name == "topic" => topics,
        None if command == "explain" && name == "code" => codes,
        Some(_) | None => {
            let named = NAMES.iter().find(|row| row.0.contains(&command) && row.1 == name);
            if let Some((_, _, path)) = named {
                return argument.add(ArgValueCompleter::new(|word: &OsStr| names(word, path)));
            }
            let fits = |row: &&(&str, &str, &[&str])| (row.0.is_empty() || row.0 == command) && row.1 == name;
            return match FILES.iter().find(fits) {
                Some((_, _, endings)) => {
                    argument.add(ArgValueCompleter::new(|word: &OsStr| files(word, endings)))
                }
                None => argument,
            };
        }
    };
    argument.add(ArgValueCompleter::new(words))
}

/// Files with one of these endings.
fn files(word: &OsStr, endings: &'static [&'static str]) -> Vec<CompletionCandidate> {
    let is_one = |path: &Path| {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        path.is_file() && endings.iter().any(|known| known.eq_ignore_ascii_case(ending))
    };
    ValueCompleter::complete(&PathCompleter::any().filter(is_one), word)
}

/// Names that a running robot lists there; none if no robot answers.
fn names(word: &OsStr, path: &str) -> Vec<CompletionCandidate> {
    let mut words: Vec<OsString> = std::env::args_os().collect();
    if let Some(part) = std::env::var_os(BASH_WORD) {
        words = rejoined(words, &part);
    }
    let answer = TargetArgs::of_words(&words).ask(path, ROBOT_TIMEOUT);
    beginning(
        word,
        names_in(&answer.unwrap_or_default())
            .into_iter()
            .map(|name| (name, "")),
    )
}

/// The names in a list of the control interface, which may be the field of an object.
fn names_in(answer: &Value) -> Vec<String> {
    let in_field = || answer.as_object()?.values().find_map(Value::as_array);
    let list = answer.as_array().or_else(in_field);
    let names = list.into_iter().flatten();
    let names = names.filter_map(|one| one.get("name")?.as_str());
    names.map(str::to_owned).collect()
}

/// `CHANNEL=`, then `CHANNEL=FILE`.
fn inputs(word: &OsStr) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    let Some((channel, path)) = typed.split_once('=') else {
        let channels = CHANNELS.iter().map(|channel| channel.to_ascii_lowercase());
        return beginning(word, channels.map(|channel| (format!("{channel}="), "")));
    };
    let found = ValueCompleter::complete(&PathCompleter::any(), OsStr::new(path));
    let prefix = format!("{channel}=");
    found.into_iter().map(|file| file.add_prefix(&prefix)).collect()
}

/// After `TIME: `, the words that an action begins with.
fn moments(word: &OsStr) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    let Some((time, _)) = typed.split_once(": ") else {
        return Vec::new();
    };
    let is_word = |word: &&str| word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-');
    let begins = |form: &'static str| form.split(' ').take_while(is_word).collect::<Vec<_>>().join(" ");
    let forms = action_forms().chain(CHANNEL_ACTIONS).map(begins);
    beginning(word, forms.map(|form| (format!("{time}: {form}"), "")))
}

/// The candidates that begin with the word.
fn beginning(
    word: &OsStr,
    candidates: impl Iterator<Item = (String, &'static str)>,
) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    let fitting = candidates.filter(|(candidate, _)| candidate.starts_with(&*typed));
    fitting
        .map(|(candidate, about)| {
            let about = Some(about).filter(|about| !about.is_empty());
            CompletionCandidate::new(candidate).help(about.map(Into::into))
        })
        .collect()
}

fn times(word: &OsStr) -> Vec<CompletionCandidate> {
    let modes = [
        ("real", "as the wall clock"),
        ("auto", "jumps to the next event while hosts are silent"),
        ("stepped", "only when a test moves it"),
        ("x10", "ten times as fast"),
    ];
    beginning(
        word,
        modes.into_iter().map(|(mode, about)| (mode.to_owned(), about)),
    )
}

fn models(word: &OsStr) -> Vec<CompletionCandidate> {
    let shipped = SHIPPED.iter().map(|(name, _)| ((*name).to_owned(), ""));
    let mut found = beginning(word, shipped);
    found.extend(files(word, &["toml"]));
    found
}

/// `PAGE`, then `PAGE#SECTION`.
fn topics(word: &OsStr) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    let Some((path, _)) = typed.split_once('#') else {
        let pages = book().pages().iter();
        return beginning(word, pages.map(|page| (page.path.clone(), page.title.as_str())));
    };
    let page = book().find(path).ok().map(|passage| passage.page);
    let anchors = page.into_iter().flat_map(Page::anchors);
    beginning(word, anchors.map(|anchor| (format!("{path}#{anchor}"), "")))
}

fn codes(word: &OsStr) -> Vec<CompletionCandidate> {
    beginning(word, book().codes().into_iter().map(|code| (code, "")))
}

/// `KEY=`, then `KEY=VALUE`.
fn settings(word: &OsStr) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    if let Some((key, _)) = typed.split_once('=') {
        let rows = OPTIONS.iter().filter(|row| row.key == key);
        let values = rows.flat_map(|row| row.values().words());
        return beginning(word, values.map(|value| (format!("{key}={value}"), "")));
    }
    let help = [("help".to_owned(), "list all options")];
    let keys = OPTIONS.iter().map(|row| (format!("{}=", row.key), row.about()));
    beginning(word, keys.chain(help))
}

/// `KIND`, then `KIND:PARAMETER=`.
fn faults(word: &OsStr) -> Vec<CompletionCandidate> {
    let typed = word.to_string_lossy();
    let Some((kind, rest)) = typed.split_once(':') else {
        return beginning(
            word,
            KINDS.iter().map(|kind| (kind.name.to_owned(), kind.summary)),
        );
    };
    let (before, last) = rest.rsplit_once(',').unwrap_or(("", rest));
    let comma = if before.is_empty() { "" } else { "," };
    let own = KINDS
        .iter()
        .filter(|row| row.name == kind)
        .flat_map(|row| row.parameters);
    if let Some((key, _)) = last.split_once('=') {
        let of_parameter = own.filter(|parameter| parameter.name == key);
        let mut values: Vec<&str> = of_parameter.flat_map(words_of).copied().collect();
        match key {
            "command" => values.extend(COMMANDS.iter().map(|command| command.letters)),
            "channel" => values.extend(Port::ETHERNET.iter().chain(&Port::SERIAL).map(|port| port.name())),
            _ => {}
        }
        let values = values.into_iter();
        let candidates = values.map(|value| (format!("{kind}:{before}{comma}{key}={value}"), ""));
        return beginning(word, candidates);
    }
    let own = own.map(|parameter| (parameter.name, parameter.description));
    let keys = own.chain(COMMON_KEYS.map(|key| (key, "")));
    beginning(
        word,
        keys.map(|(key, about)| (format!("{kind}:{before}{comma}{key}="), about)),
    )
}

/// The words that a parameter takes; none of a number or a string.
fn words_of(parameter: &Parameter) -> &'static [&'static str] {
    match parameter.value_type {
        ParameterType::Word(words) => words,
        ParameterType::Number { .. } | ParameterType::Text { .. } | ParameterType::Alarm => &[],
    }
}

/// Findings to deny: all of a severity, or those of a rule.
fn rules(word: &OsStr) -> Vec<CompletionCandidate> {
    let words = Deny::WORDS.map(|word| (word.to_owned(), ""));
    let rules = RULES.iter().map(|rule| (rule.id.to_owned(), rule.title));
    beginning(word, words.into_iter().chain(rules))
}

fn directories(word: &OsStr) -> Vec<CompletionCandidate> {
    ValueCompleter::complete(&PathCompleter::dir(), word)
}

/// The names that the files on this command line get on the RAM drive, and the example programs.
fn selections(word: &OsStr) -> Vec<CompletionCandidate> {
    let is_program = |path: &Path| {
        path.extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("scol"))
    };
    let words = std::env::args_os()
        .map(PathBuf::from)
        .filter(|word| is_program(word));
    let loaded = words.filter_map(|path| drive_name(&path).ok());
    let examples = EXAMPLES.iter().map(|(name, _)| (*name).to_owned());
    beginning(word, loaded.chain(examples).map(|name| (name, "")))
}

/// Bash, which divides a word at `=` and `:` and replaces its last part only.
struct Bash;

impl EnvCompleter for Bash {
    fn name(&self) -> &'static str {
        "bash"
    }

    fn is(&self, name: &str) -> bool {
        name == "bash"
    }

    fn write_registration(
        &self,
        variable: &str,
        name: &str,
        program: &str,
        completer: &str,
        to: &mut dyn Write,
    ) -> io::Result<()> {
        write!(
            to,
            "_{name}() {{\n\
             \x20   local IFS=$'\\013'\n\
             \x20   COMPREPLY=($({BASH_WORD}=\"${{2-${{COMP_WORDS[COMP_CWORD]}}}}\" {variable}=bash {completer} -- \"${{COMP_WORDS[@]:0:COMP_CWORD+1}}\"))\n\
             \x20   [[ ${{COMPREPLY-}} =~ [=:/]$ ]] && compopt -o nospace 2>/dev/null\n\
             \x20   return 0\n\
             }}\n\
             complete -o bashdefault -F _{name} {program}\n"
        )
    }

    fn write_complete(
        &self,
        command: &mut Command,
        words: Vec<OsString>,
        folder: Option<&Path>,
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let part = std::env::var_os(BASH_WORD).unwrap_or_default();
        let words = rejoined(words, &part);
        let word = words.last().map_or(0, |word| word.len());
        let kept = word.saturating_sub(part.len());
        let last = words.len().saturating_sub(1);
        let found = complete(command, words, last, folder)?;
        let values = found.iter().map(|candidate| {
            let value = candidate.get_value().to_string_lossy();
            value.get(kept..).map_or_else(|| value.to_string(), str::to_owned)
        });
        to.write_all(values.collect::<Vec<_>>().join(BASH_SEPARATOR).as_bytes())
    }
}

/// The words as they were typed, up to the one to complete, which ends with `part`: what follows its last `=` or `:` before the
/// cursor.
fn rejoined(mut words: Vec<OsString>, part: &OsStr) -> Vec<OsString> {
    let divides = |word: &OsStr| word == "=" || word == ":";
    if let Some(last) = words.last_mut()
        && !(divides(last) && part.is_empty())
    {
        *last = part.to_owned();
    }
    let mut joined: Vec<OsString> = Vec::new();
    let mut glued = false;
    for word in words {
        let divider = divides(&word);
        match joined.last_mut() {
            Some(last) if divider || glued => last.push(&word),
            _ => joined.push(word),
        }
        glued = divider;
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(command_line: &[&str]) -> Vec<String> {
        let mut command = with_values(Cli::command());
        let words: Vec<OsString> = command_line.iter().map(OsString::from).collect();
        let last = words.len() - 1;
        let found = complete(&mut command, words, last, None).unwrap();
        let values = found
            .iter()
            .map(|one| one.get_value().to_string_lossy().into_owned());
        values.collect()
    }

    #[test]
    fn values_come_from_the_tables() {
        for (words, expected) in [
            (&["ts3100", "serve", "--time", "st"][..], &["stepped"][..]),
            (
                &["ts3100", "exec", "--model", "tsl3000-thl3"],
                &["tsl3000-thl300"],
            ),
            (&["ts3100", "serve", "--set", "text.st"], &["text.stx="]),
            (&["ts3100", "run", "--set", "text.stx=re"], &["text.stx=required"]),
            (&["ts3100", "serve", "--fault", "late"], &["late-reply"]),
            (
                &["ts3100", "serve", "--fault", "late-reply:command=SU,del"],
                &["late-reply:command=SU,delay="],
            ),
            (&["ts3100", "serve", "--select", "DI"], &["DIALOG"]),
            (
                &["ts3100", "serve", "--fault", "no-reply:times=2,command=RN"],
                &["no-reply:times=2,command=RN"],
            ),
            (
                &["ts3100", "serve", "--fault", "no-reply:lost=rep"],
                &["no-reply:lost=reply"],
            ),
            (&["ts3100", "exec", "--deny", "left-in"], &["left-in-exchange"]),
            (&["ts3100", "ctl", "clock", "mode", "au"], &["auto"]),
            (&["ts3100", "ctl", "faults", "arm", "half"], &["half-open"]),
            (&["ts3100", "docs", "reference/al"], &["reference/alarms"]),
            (&["ts3100", "docs", "alarms#alarm-2-04"], &["alarms#alarm-2-046"]),
            (&["ts3100", "explain", "left-in"], &["left-in-exchange"]),
            (&["ts3100", "run", "--input", "ip1"], &["ip1="]),
            (&["ts3100", "serve", "--drive", "sr"], &["src/"]),
            (&["ts3100", "serve", "--drive", "Car"], &[]),
            (&["ts3100", "run", "--at", "1 s: serv"], &["1 s: servo"]),
        ] {
            assert_eq!(values(words), expected, "{words:?}");
        }
        assert!(values(&["ts3100", "serve", "--set", ""]).len() > OPTIONS.len());
    }

    #[test]
    fn names_are_those_of_a_list_of_the_robot() {
        for answer in [
            r#"{"files":[{"name":"DEMO","size":1}],"selected":"","capacity":5}"#,
            r#"[{"name":"DEMO","type":"integer"}]"#,
        ] {
            assert_eq!(
                names_in(&serde_json::from_str(answer).unwrap()),
                ["DEMO"],
                "{answer}"
            );
        }
        assert!(names_in(&Value::Null).is_empty());
    }

    #[test]
    fn every_row_of_files_names_an_argument() {
        let program = Cli::command();
        let all = program.get_subcommands();
        let all = all.flat_map(|command| command.get_subcommands().chain([command]));
        let names: Vec<(&str, &str)> = all
            .flat_map(|command| {
                command
                    .get_arguments()
                    .map(|one| (command.get_name(), one.get_id().as_str()))
            })
            .collect();
        for (command, name, _) in FILES {
            let known = names
                .iter()
                .any(|one| (command.is_empty() || one.0 == command) && one.1 == name);
            assert!(known, "{command} {name}");
        }
    }

    #[test]
    fn words_that_bash_divides_are_one_again() {
        for (words, part, expected) in [
            (&["t", "--set", "a", "="][..], "", &["t", "--set", "a="][..]),
            (&["t", "--set", "a", "=", "re"], "re", &["t", "--set", "a=re"]),
            (&["t", "--set", "=", "a"], "a", &["t", "--set=a"]),
            (&["t", "--set", "a", ""], "", &["t", "--set", "a", ""]),
            (
                &["t", "--set", "a", "=", "required"],
                "re",
                &["t", "--set", "a=re"],
            ),
            (&["t", "--at", "1", ":", "x"], "x", &["t", "--at", "1:x"]),
            (
                &["t", "--url", "=", "http", ":", "//a", ":", "1", ""],
                "",
                &["t", "--url=http://a:1", ""],
            ),
        ] {
            let words = words.iter().map(OsString::from).collect();
            assert_eq!(rejoined(words, OsStr::new(part)), expected, "{part}");
        }
    }
}
