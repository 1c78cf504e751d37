//! Help: `-h` shows the arguments of every day and an example, on one screen; `--help` everything, with the environment
//! variable of each flag.
//!
//! The texts are the doc comments of the arguments. This module adds to the definition what only help needs, and is used
//! only when somebody asks for help: an ordinary start pays nothing for it.

use super::docs;
use crate::config::schema::variable;
use clap::{Arg, Command};
use std::ffi::OsString;

/// Extent of the help.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    /// `-h`
    Everyday,
    /// `--help` or `help`
    Everything,
}

impl Extent {
    /// Extent that this command line asks for.
    pub(super) fn of(words: &[OsString]) -> Extent {
        let mut own = words.iter().take_while(|word| *word != "--");
        match own.any(|word| word == "--help" || word == "help") {
            true => Extent::Everything,
            false => Extent::Everyday,
        }
    }
}

/// A subcommand with what `-h` shows of it.
struct Everyday {
    name: &'static str,
    /// Flags and subcommands with a shorter text, or an empty one for the text of `--help`; an empty list shows all.
    shown: &'static [(&'static str, &'static str)],
    /// Command lines to begin with; `-h` shows the first.
    example: &'static str,
}

/// A subcommand of which `-h` shows all.
const fn whole(name: &'static str, example: &'static str) -> Everyday {
    Everyday {
        name,
        shown: &[],
        example,
    }
}

const EVERYDAY: &[Everyday] = &[
    Everyday {
        name: "serve",
        shown: &[
            ("port-offset", "Add N to the port numbers 1000-1003"),
            ("ports", "`auto` lets the system choose free ports"),
            ("ready-json", "Print the ports as JSON once they are open"),
            ("servo-on", ""),
            ("set", "Override a named option, for example text.stx=required"),
            ("drive", "Keep the files of the RAM drive in this directory"),
            ("load", ""),
            ("select", ""),
            ("time", "How time passes: real, x10, stepped, auto"),
            ("verbose", ""),
        ],
        example: "ts3100 serve --port-offset 10000 --load pick.scol --select PICK\n\
                  ts3100 serve --ports auto --ready-json --time stepped\n\
                  ts3100 serve --drive files --transcript day.txt --fault late-reply:command=SU",
    },
    Everyday {
        name: "exec",
        shown: &[
            ("servo-on", ""),
            ("set", "Override a named option, for example text.stx=required"),
            ("drive", "Keep the files of the RAM drive in this directory"),
            ("load", ""),
            ("select", ""),
            ("time", "How time passes: real, x10, stepped, auto"),
            ("scenario", "Play this scenario; it can fail the run"),
            ("findings", "Write the protocol mistakes of your host to a file"),
            ("deny", "Fail on these findings: all, warning, error, a rule"),
            ("verbose", "Log what happens; each further -v logs more"),
        ],
        example: "ts3100 exec --load pick.scol --select PICK -- pytest tests\n\
                  ts3100 exec --time auto --scenario robot.toml --junit robot.xml -- dotnet test\n\
                  ts3100 exec --deny warning --findings findings.sarif --trace-on-failure trace.html -- ./host",
    },
    Everyday {
        name: "host",
        shown: &[
            ("su", ""),
            ("sf", ""),
            ("ul", ""),
            ("dl", ""),
            ("sl", ""),
            ("rn", ""),
            ("so", ""),
            ("mr", "Read a global variable, for example COUNT or TABLE(2)"),
            ("mw", ""),
            ("do", "Execute one statement"),
        ],
        example: "ts3100 host 127.0.0.1:11000 dl pick.scol\n\
                  ts3100 host 127.0.0.1:11000 rn --wait\n\
                  ts3100 host 127.0.0.1:11000 do \"MOVE POINT(400,0,250)\"",
    },
    Everyday {
        name: "check",
        shown: &[
            ("format", ""),
            ("model", "Arm, by name or .toml file"),
            ("deny-warnings", ""),
            ("watch", "Check again whenever a file changes"),
        ],
        example: "ts3100 check *.scol\n\
                  ts3100 check --watch programs",
    },
    whole("fmt", "ts3100 fmt *.scol\nts3100 fmt --diff programs"),
    whole("lsp", "ts3100 lsp"),
    whole("dap", "ts3100 dap"),
    Everyday {
        name: "run",
        shown: &[
            ("input", "Records for INPUT of a channel, one per line"),
            ("din", "Input lines that are on from the start"),
            ("max-time", "Longest run in virtual seconds"),
            ("trace", "Print every statement and what it does to stderr"),
            ("profile", "Print where the cycle goes to stderr"),
            ("json", "Print one JSON document"),
            ("model", ""),
            ("watch", "Run again whenever a file changes"),
        ],
        example: "ts3100 run pick.scol --input ip1=records.txt --din 1,5\n\
                  ts3100 run pick.scol --at \"1.5 s: input 8 on\" --trace",
    },
    Everyday {
        name: "test",
        shown: &[
            ("filter", ""),
            ("json", "Print one JSON document"),
            ("junit", ""),
            ("watch", "Run again whenever a file changes"),
        ],
        example: "ts3100 test\n\
                  ts3100 test pick.scol --junit results.xml",
    },
    whole("faults", "ts3100 faults list"),
    Everyday {
        name: "tap",
        shown: &[
            ("transcript", "Write the recording (.txt, .jsonl, .pcapng)"),
            ("listen", ""),
            ("port-offset", "Add N to the ports of the tap"),
            ("channels", "Channels to record"),
            ("verbose", ""),
        ],
        example: "ts3100 tap 192.168.0.124 --transcript day.jsonl",
    },
    Everyday {
        name: "diff",
        shown: &[
            ("time-tolerance", "Accept answers this much earlier or later"),
            ("value-tolerance", "Accept coordinates that differ by this much"),
            ("ignore", "Do not compare these, for example clock,versions"),
            ("suggest", "Try other values of the named options"),
            ("json", "Print one JSON document"),
            ("set", "Override a named option"),
        ],
        example: "ts3100 diff day.jsonl --ignore clock,versions",
    },
    Everyday {
        name: "view",
        shown: &[
            ("control", "Serve the page here"),
            ("set", "Override a named option"),
        ],
        example: "ts3100 view run.jsonl",
    },
    Everyday {
        name: "survey",
        shown: &[
            ("show", "Explain a file of a survey"),
            ("diff", "Compare two files"),
            ("infer", "Take the answers from a recording"),
            ("ask", "Classes of questions: look, files, program, motion"),
            ("dry-run", ""),
            ("serial", "Ask at this serial port of the computer"),
            ("out", ""),
        ],
        example: "ts3100 survey 192.168.0.124 --out robot.toml",
    },
    Everyday {
        name: "conform",
        shown: &[
            ("ask", "Classes of questions: look, files, program, motion"),
            ("dry-run", ""),
            ("strict", ""),
            ("junit", ""),
        ],
        example: "ts3100 conform 127.0.0.1:1000 --junit conform.xml",
    },
    whole("mcp", "ts3100 mcp --url http://127.0.0.1:3100"),
    whole("fidelity", "ts3100 fidelity --list"),
    whole(
        "simulate",
        "ts3100 simulate --seed 17\nts3100 simulate --steps 1000000",
    ),
    Everyday {
        name: "ctl",
        shown: &[
            ("state", ""),
            ("emergency-stop", ""),
            ("key-switch", ""),
            ("alarms", ""),
            ("inputs", ""),
            ("outputs", ""),
            ("files", ""),
            ("clock", ""),
            ("wait", ""),
            ("reset", ""),
            ("url", "URL of the control interface"),
        ],
        example: "ts3100 ctl wait output 5 on --within 10s\n\
                  ts3100 ctl emergency-stop press\n\
                  ts3100 ctl --json variables COUNT",
    },
    whole("ready", "ts3100 ready --wait 10s"),
    whole(
        "completions",
        "ts3100 completions bash --install\nsource <(ts3100 completions bash)",
    ),
    whole("man", "ts3100 man --install\nts3100 man ~/.local/share/man/man1"),
    whole(
        "coverage",
        "ts3100 coverage merge run1.json run2.json --out coverage.html",
    ),
    whole("config", "ts3100 config schema > ts3100.schema.json"),
    whole("docs", "ts3100 docs --search snapshot"),
    whole("explain", "ts3100 explain 2-046"),
];

/// Flags of `exec` that do not mean quite what they mean for `serve`.
const OF_EXEC: [(&str, &str); 3] = [
    (
        "ports",
        "Take the port numbers from ETHERNET.PAR, or let the system choose free ones [default: auto]",
    ),
    (
        "control",
        "Serve the HTTP control interface at ADDRESS:PORT or at this port of 127.0.0.1, or `off` [default: a free port]",
    ),
    (
        "verbose",
        "Log connections and refusals; twice: every text; three times: every byte",
    ),
];

/// Command lines to begin with, for all of `ts3100`; `-h` shows the first.
const EXAMPLES: &str =
    "ts3100 serve --port-offset 10000 --servo-on\nts3100 host 127.0.0.1:11000 su\nts3100 exec -- pytest";
/// The commands that `ts3100 -h` shows.
const FIRST: [&str; 6] = ["serve", "exec", "host", "ctl", "check", "run"];

/// Examples of commands with commands of their own.
const NESTED: [(&str, &str); 11] = [
    (
        "ctl-alarms",
        "ts3100 ctl alarms raise 2-046\nts3100 ctl alarms reset\nts3100 ctl alarms table 2-046",
    ),
    (
        "ctl-clock",
        "ts3100 ctl clock mode stepped\nts3100 ctl clock advance 5s\nts3100 ctl clock advance-until idle",
    ),
    (
        "ctl-channels",
        "ts3100 ctl channels ip1 inject \"5<CR>\"\nts3100 ctl channels ip0 drop",
    ),
    (
        "ctl-faults",
        "ts3100 ctl faults arm late-reply:command=SU\nts3100 ctl faults disarm 1",
    ),
    (
        "ctl-files",
        "ts3100 ctl files get DEMO\nts3100 ctl files put PICK pick.scol\nts3100 ctl files select PICK\n\
         ts3100 ctl files check PICK\nts3100 ctl files erase PICK",
    ),
    (
        "ctl-inputs",
        "ts3100 ctl inputs 8 on\nts3100 ctl inputs 8 off\nts3100 ctl inputs 8 pulse on 200ms\n\
         ts3100 ctl inputs 8 force off\nts3100 ctl inputs 8 release\nts3100 ctl inputs 8 wait on --within 10s",
    ),
    (
        "ctl-jog",
        "ts3100 ctl jog plus 1 --inching\nts3100 ctl jog minus 3 --coordinates world\nts3100 ctl jog stop",
    ),
    (
        "ctl-outputs",
        "ts3100 ctl outputs 5 wait on --within 10s\nts3100 ctl outputs 5 force on\nts3100 ctl outputs 5 release",
    ),
    (
        "ctl-program",
        "ts3100 ctl program start\nts3100 ctl program stop\nts3100 ctl program run-to 12",
    ),
    (
        "ctl-snapshots",
        "ts3100 ctl snapshots take ready\nts3100 ctl snapshots restore ready\n\
         ts3100 ctl snapshots show ready > ready.json\nts3100 ctl snapshots load ready.json",
    ),
    (
        "faults-check",
        "ts3100 faults check late-reply:command=SU,delay=500ms",
    ),
];

/// Command lines to begin with; none for a command without any.
pub(super) fn examples(command: &Command) -> Vec<&'static str> {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name());
    match name.strip_prefix("ts3100-") {
        Some(name) => examples_of(name),
        None => EXAMPLES.lines().collect(),
    }
}

/// Those of a command by its name in manuals, `ctl-files-get`: of the rows for it and what it is part of, the lines that have its
/// words, or all of its own row.
fn examples_of(name: &str) -> Vec<&'static str> {
    let rows = EVERYDAY.iter().map(|everyday| (everyday.name, everyday.example));
    let rows = NESTED.into_iter().chain(rows);
    let is_part = |row: &str| name.strip_prefix(row).is_some_and(|rest| rest.starts_with('-'));
    let mut found = Vec::new();
    for (row, example) in rows {
        let has_its_words = |line: &&str| {
            let mut words = line.split([' ', '-']);
            name.split('-').all(|part| words.any(|word| word == part))
        };
        match row == name {
            true => return example.lines().collect(),
            false if is_part(row) => found.extend(example.lines().filter(has_its_words)),
            false => {}
        }
    }
    found
}

/// The commands of a command with their examples at the end of their help.
fn with_nested_examples(command: Command, path: &str) -> Command {
    command.mut_subcommands(|inner| {
        let path = format!("{path}-{}", inner.get_name());
        let examples = examples_of(&path).join("\n  ");
        let inner = with_nested_examples(inner, &path);
        match examples.is_empty() {
            true => inner,
            false => inner.after_help(format!("Examples:\n  {examples}")),
        }
    })
}

/// Where the documentation explains a command, as a command line.
pub(super) fn documentation(command: &Command) -> String {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name());
    let subcommand = name
        .strip_prefix("ts3100-")
        .and_then(|words| words.split('-').next());
    match subcommand {
        Some(subcommand) => format!("ts3100 docs {}", docs::topic_of(subcommand)),
        None => "ts3100 docs\nts3100 explain CODE".to_owned(),
    }
}

/// The definition with what help shows besides.
pub(super) fn with_help(program: Command, extent: Extent) -> Command {
    let program = EVERYDAY.iter().fold(program, |program, everyday| {
        program.mut_subcommand(everyday.name, |command| {
            with_nested_examples(explain(command, everyday, extent), everyday.name)
        })
    });
    let documentation = "Documentation: ts3100 docs. A code, for example E0101 or 2-046: ts3100 explain CODE";
    match extent {
        Extent::Everyday => {
            let first = EXAMPLES.lines().next().unwrap_or_default();
            program
                .disable_help_subcommand(true)
                .mut_subcommands(|command| {
                    let is_first = FIRST.contains(&command.get_name());
                    command.hide(!is_first)
                })
                .after_help(format!(
                    "Example: {first}\nMore commands: ts3100 --help\n{documentation}"
                ))
        }
        Extent::Everything => {
            let examples = EXAMPLES.replace('\n', "\n  ");
            program.after_help(format!("Examples:\n  {examples}\n\n{documentation}"))
        }
    }
}

fn explain(command: Command, everyday: &Everyday, extent: Extent) -> Command {
    let first = everyday.example.lines().next().unwrap_or_default();
    let mut example = format!("Example: {first}");
    if extent == Extent::Everyday && command.has_subcommands() && !everyday.shown.is_empty() {
        example = format!("{example}\nMore commands: ts3100 {} --help", everyday.name);
    }
    match extent {
        Extent::Everyday => shorten(command, everyday).after_help(example),
        Extent::Everything => command
            .mut_args(|argument| complete(argument, everyday.name))
            .after_help(format!(
                "{example}\nDocumentation: ts3100 docs {}",
                docs::topic_of(everyday.name)
            )),
    }
}

/// Shows what is used every day and hides the rest.
fn shorten(command: Command, everyday: &Everyday) -> Command {
    let text = |name: &str| {
        everyday
            .shown
            .iter()
            .find(|(shown, _)| *shown == name)
            .map(|(_, text)| *text)
    };
    let names = command.get_subcommands().map(|inner| inner.get_name().to_owned());
    let commands: Vec<String> = names.collect();
    let is_whole = everyday.shown.is_empty();
    let command = commands.iter().fold(command, |command, name| {
        command.mut_subcommand(name, |inner| match text(name) {
            Some("") => inner,
            Some(text) => inner.about(text),
            None => inner.hide(!is_whole),
        })
    });
    command.disable_help_subcommand(true).mut_args(|argument| {
        let Some(long) = argument.get_long().map(str::to_owned) else {
            return argument;
        };
        let takes_words = argument.get_action().takes_values() && !argument.get_possible_values().is_empty();
        let argument = argument
            .help_heading(None)
            .hide_possible_values(takes_words && !is_whole);
        match text(&long) {
            Some("") => argument,
            Some(text) => argument.help(text),
            None => argument.hide_short_help(!is_whole),
        }
    })
}

/// Shows the environment variable of a flag, and what is the default of `exec`.
fn complete(argument: Arg, command: &str) -> Arg {
    let words = argument.get_possible_values();
    let is_switch = words.iter().any(|word| word.get_name() == "true");
    let takes_values = argument.get_action().takes_values();
    let argument = argument.hide_possible_values(is_switch && takes_values);
    let (Some(long), Some(help)) = (argument.get_long(), argument.get_help()) else {
        return argument;
    };
    let own = OF_EXEC
        .iter()
        .find(|(name, _)| command == "exec" && *name == long);
    let help = own.map_or_else(|| help.to_string(), |(_, help)| (*help).to_owned());
    match command {
        "serve" | "exec" => {
            let variable = variable(long);
            argument.help(format!("{help} [env: {variable}]"))
        }
        _ => argument,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::CommandFactory as _;

    /// Lines and columns of the smallest terminal.
    const SCREEN: (usize, usize) = (24, 80);

    fn helps(extent: Extent) -> Vec<(String, String)> {
        let mut program = with_help(Cli::command(), extent).term_width(SCREEN.1);
        program.build();
        let commands = program
            .get_subcommands_mut()
            .filter(|command| command.get_name() != "help");
        let texts = commands.map(|command| {
            let text = match extent {
                Extent::Everyday => command.render_help(),
                Extent::Everything => command.render_long_help(),
            };
            (command.get_name().to_owned(), text.to_string())
        });
        texts.collect()
    }

    #[test]
    fn short_help_fits_one_screen_and_has_an_example() {
        for (name, text) in helps(Extent::Everyday) {
            let lines: Vec<&str> = text.trim_end().lines().collect();
            assert!(lines.len() <= SCREEN.0, "{name}: {} lines\n{text}", lines.len());
            assert!(
                lines.iter().all(|line| line.chars().count() <= SCREEN.1),
                "{name}\n{text}"
            );
            assert!(text.contains("Example: "), "{name}\n{text}");
        }
    }

    #[test]
    fn every_name_that_short_help_shows_exists() {
        let program = Cli::command();
        for everyday in EVERYDAY {
            let command = program.find_subcommand(everyday.name).expect(everyday.name);
            for (name, _) in everyday.shown {
                let is_flag = command
                    .get_arguments()
                    .any(|argument| argument.get_long() == Some(name));
                assert!(
                    is_flag || command.find_subcommand(name).is_some(),
                    "{} {name}",
                    everyday.name
                );
            }
        }
        assert_eq!(EVERYDAY.len(), program.get_subcommands().count());
    }

    #[test]
    fn long_help_groups_the_flags_of_serve_and_names_their_variables() {
        let helps = helps(Extent::Everything);
        for name in ["serve", "exec"] {
            let (_, text) = helps.iter().find(|(found, _)| found == name).unwrap();
            let headings: Vec<&str> = text
                .lines()
                .filter(|line| !line.starts_with(' ') && line.ends_with(':') && *line != "Options:")
                .filter(|line| *line != "Arguments:")
                .collect();
            assert_eq!(
                headings,
                [
                    "Network:",
                    "Control interface:",
                    "Serial:",
                    "Robot:",
                    "Programs and files:",
                    "Time:",
                    "Faults and variation:",
                    "Scenario:",
                    "Reports:",
                    "Logging:"
                ]
            );
            assert!(
                text.contains("TS3100_PORT_OFFSET]") && text.contains("TS3100_MIN_COVERAGE]"),
                "{text}"
            );
            let default = if name == "exec" {
                "[default: auto]"
            } else {
                "[default: parameter]"
            };
            let unwrapped = text.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(unwrapped.contains(default), "{text}");
        }
    }
}
