//! The documents are complete: each command, alarm, option and rule of the code has its row in `docs`.
//!
//! Whether what a row says is true is tested in the suite of its subject.

use std::fs;
use std::path::PathBuf;
use ts3100_controller::alarm::ALARMS;
use ts3100_controller::findings::RULES;
use ts3100_proto::command::COMMANDS;

fn document(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../docs")
        .join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn every_alarm_has_its_row() {
    let page = document("reference/alarms.md");
    for alarm in ALARMS {
        let whose = if alarm.is_assumed { "ours" } else { "known" };
        let row = format!(
            "| {} | {whose} | {} | {} | {} |",
            alarm.number(),
            alarm.text,
            alarm.cause,
            alarm.remedy
        );
        assert!(page.contains(&row), "docs/reference/alarms.md misses\n{row}");
        let section = format!("### Alarm {}\n", alarm.number());
        assert!(
            page.contains(&section),
            "docs/reference/alarms.md misses {section}"
        );
    }
}

#[test]
fn every_command_has_its_row() {
    let page = document("reference/protocol/commands.md");
    for command in COMMANDS {
        let form = command.form.replace('|', "\\|");
        let row = format!("| `{form}` | `{}` |", command.example);
        assert!(
            page.contains(&row),
            "docs/reference/protocol/commands.md misses\n{row}"
        );
    }
}

#[test]
fn every_rule_of_findings_has_its_row() {
    let findings = document("FINDINGS.md");
    for rule in RULES {
        let severity = rule.severity.as_str();
        let row = format!(
            "| `{}` | {severity} | {} | {} | {} |",
            rule.id, rule.source, rule.title, rule.remedy
        );
        assert!(findings.contains(&row), "docs/FINDINGS.md misses\n{row}");
    }
    let rows = findings
        .lines()
        .filter(|line| line.starts_with("| `") && line.matches('|').count() == 6);
    assert_eq!(rows.count(), RULES.len(), "a row of a rule that is gone");
}

#[test]
fn every_rule_names_clauses_that_exist() {
    let table = document("clauses.tsv");
    let clauses: Vec<&str> = table.lines().filter_map(|line| line.split('\t').next()).collect();
    for rule in RULES {
        let (_, named) = rule.source.split_once('[').unwrap();
        for name in named.trim_end_matches(']').split(", ") {
            let decision = name
                .strip_prefix('D')
                .is_some_and(|number| number.parse::<u8>().is_ok());
            assert!(
                decision || clauses.contains(&name),
                "{}: no clause {name}",
                rule.id
            );
        }
    }
}

#[test]
fn every_option_has_its_row() {
    let (page, fidelity) = (document("reference/options.md"), document("FIDELITY.md"));
    for (key, values) in ts3100_emulator::config::option_keys() {
        let row = format!("| [`{key}`](#{key}) | {values} |");
        assert!(page.contains(&row), "docs/reference/options.md misses\n{row}");
        let section = format!("\n### {key}\n");
        assert!(
            page.contains(&section),
            "docs/reference/options.md misses the section of {key}"
        );
        assert!(
            fidelity.contains(&format!("`{key}")),
            "docs/FIDELITY.md misses the option {key}"
        );
    }
}
