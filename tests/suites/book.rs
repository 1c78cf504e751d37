//! The documentation in the program answers for every code that an output names, by the tables of the code; and what an output
//! says of the documentation exists there.

use super::pieces::{Pieces, RUST};
use clap::Command;
use scol_mini::DIAGNOSTICS;
use std::collections::BTreeSet;
use ts3100_book::{Passage, book};
use ts3100_controller::CONDITION_FORMS;
use ts3100_controller::alarm::{ALARMS, AlarmCode};
use ts3100_controller::controls::{BUTTONS, SWITCHES};
use ts3100_controller::faults::KINDS;
use ts3100_controller::findings::RULES;
use ts3100_controller::variation::VARIATIONS;
use ts3100_emulator::cli;
use ts3100_emulator::config::OPTIONS;
use ts3100_proto::command::COMMANDS;
use ts3100_survey::{catalogue, ledger};

/// Each code with the beginning of the pages of which one has to explain it.
fn codes() -> BTreeSet<(String, &'static str)> {
    let mut codes = BTreeSet::new();
    let mut add = |code: &str, page| {
        codes.insert((code.to_owned(), page));
    };
    for kind in DIAGNOSTICS {
        add(kind.code, "reference/diagnostics");
        add(kind.name, "reference/diagnostics");
    }
    for alarm in ALARMS {
        add(&alarm.number(), "reference/alarms");
        // As AC, AH and the maker's tool show it.
        add(&format!("00{}", alarm.number()), "reference/alarms");
    }
    for rule in RULES {
        add(rule.id, "reference/findings");
        for clause in rule.clauses() {
            add(clause, "explanation/fidelity");
        }
    }
    for row in ledger::rows() {
        add(row.id, "explanation/fidelity");
    }
    for code in cli::EXIT_CODES {
        add(&code.to_string(), "reference/exit-codes");
    }
    for probe in catalogue::probes() {
        add(probe.id, "reference/survey");
    }
    for kind in KINDS {
        add(kind.name, "reference/faults");
    }
    for rule in VARIATIONS {
        add(rule.name, "explanation/variation");
    }
    for option in OPTIONS.iter() {
        add(option.key, "reference/options");
    }
    for command in COMMANDS {
        add(command.letters, "reference/protocol/");
    }
    for word in scol_mini::words() {
        add(word, "reference/scol/");
    }
    for form in CONDITION_FORMS {
        add(form.form.split(' ').next().unwrap(), "reference/conditions");
    }
    for switch in SWITCHES {
        add(switch.name(), "reference/controls");
    }
    for button in BUTTONS {
        add(button.form, "reference/controls");
    }
    for (word, before) in [("event", "event = \""), ("metric", "\"ts3100_")] {
        let names = names_in_the_code(before);
        assert!(names.len() > 15, "{word}: {names:?}");
        for name in names {
            add(&name, "reference/monitoring");
        }
    }
    let program = cli::definition();
    for subcommand in program.get_subcommands() {
        add(subcommand.get_name(), "reference/command-line");
    }
    flags(&program, &mut add);
    codes
}

/// The names of log events, or of metrics: what follows these letters in the product, to the end of the string.
fn names_in_the_code(before: &str) -> BTreeSet<String> {
    let sources = super::house::files(&super::house::root().join("crates"), "rs");
    let sources = sources.into_iter().filter(|path| {
        let is_metrics = path.ends_with("control/src/metrics.rs") || path.ends_with("control/src/service.rs");
        !super::house::is_test(path) && (is_metrics || !before.contains("ts3100_"))
    });
    let mut names = BTreeSet::new();
    for path in sources {
        let source = std::fs::read_to_string(path).unwrap();
        let parts = super::house::product(&source).split(before).skip(1);
        let start = before.rsplit('"').next().unwrap_or_default();
        names.extend(parts.filter_map(|part| Some(format!("{start}{}", part.split('"').next()?))));
    }
    names
}

/// The flags of the subcommands.
fn flags(command: &Command, add: &mut impl FnMut(&str, &'static str)) {
    for subcommand in command.get_subcommands() {
        for argument in subcommand.get_arguments() {
            if let Some(long) = argument.get_long().filter(|long| *long != "help") {
                add(&format!("--{long}"), "reference/");
            }
        }
        flags(subcommand, add);
    }
}

#[test]
fn every_code_of_the_tables_is_explained() {
    let codes = codes();
    assert!(codes.len() > 600, "{}", codes.len());
    let mut missing = Vec::new();
    for (code, page) in &codes {
        let passages = book().explain(code);
        if !passages.iter().any(|passage| passage.page.path.starts_with(page)) {
            let found: Vec<String> = passages.iter().map(Passage::topic).collect();
            missing.push(format!("{code}: no passage of {page}, found {found:?}"));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// A diagnostic, an alarm, a rule, an option or a fault has a section, not only a row of a table.
#[test]
fn a_code_of_a_message_has_a_section() {
    let codes = DIAGNOSTICS.iter().map(|kind| kind.code.to_owned());
    let codes = codes
        .chain(ALARMS.iter().map(AlarmCode::number))
        .chain(RULES.iter().map(|rule| rule.id.to_owned()))
        .chain(OPTIONS.iter().map(|option| option.key.to_owned()))
        .chain(KINDS.iter().map(|kind| kind.name.to_owned()));
    for code in codes {
        let first = book().explain(&code).into_iter().next();
        let first = first.unwrap_or_else(|| panic!("{code}"));
        assert!(first.text.starts_with('#'), "{code}: {}", first.text);
    }
}

/// The strings and doc comments of the product that name a file of `docs` or a topic.
#[test]
fn what_the_product_says_of_the_documentation_is_in_it() {
    let mut topics = 0;
    let sources = super::house::files(&super::house::root().join("crates"), "rs");
    for path in sources.iter().filter(|path| !super::house::is_test(path)) {
        let source = std::fs::read_to_string(path).unwrap();
        let Pieces { strings, .. } = RUST.pieces(super::house::product(&source));
        for (line, text) in strings {
            let place = format!("{}:{line}", path.display());
            let is_path = text.contains("docs/") && text.contains(".md") && !text.contains("../");
            assert!(
                !is_path,
                "{place}: {text}: users have no such file; name `ts3100 explain CODE`"
            );
            for (begin, end) in [("`ts3100 docs ", '`'), ("`/book/", '`')] {
                for rest in text.split(begin).skip(1) {
                    let topic = rest.split(end).next().unwrap_or(rest);
                    if topic.is_empty() || topic.starts_with("--") || topic.starts_with('{') {
                        continue;
                    }
                    topics += 1;
                    let found = book().find(topic);
                    assert!(found.is_ok(), "{place}: {topic}: {}", found.unwrap_err());
                }
            }
        }
    }
    assert!(topics >= 5, "{topics}");
}
