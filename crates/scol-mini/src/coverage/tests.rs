//! The programs of `fixtures/scol/run` together use the whole language: every word, sign and WITH condition the front
//! end knows, so that a new one is asked for the day it appears, and every row of `fixtures/scol/rows.tsv`, which lists
//! what is known of the language. What the programs bring about is proved by the suites that run them.

#![expect(
    clippy::disallowed_methods,
    reason = "a test that cannot read its fixtures fails"
)]

use crate::lexer::{Lexeme, SIGNS, Token, lines, tokens};
use crate::parser::parse_direct;
use crate::{Arm, LanguageOptions, MAX_LINE, builtin, compile};
use std::borrow::ToOwned;
use std::collections::{BTreeMap, BTreeSet};
use std::format;
use std::path::{Path, PathBuf};
use std::string::String;
use std::vec::Vec;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scol")
}

/// A word, a sign, a text or a number as a pattern names it: upper case, `"` for any text, `0` for any number.
fn spelling(source: &str, lexeme: &Lexeme) -> String {
    match &lexeme.token {
        Token::Word(word) => word.clone(),
        Token::Text(_) => "\"".to_owned(),
        Token::Integer(_) => "0".to_owned(),
        Token::Real(_) => "0.0".to_owned(),
        Token::Sign(_) => source[lexeme.span.start..lexeme.span.end].to_owned(),
    }
}

type Rows = Vec<Vec<String>>;

fn words_of(source: &str) -> Rows {
    lines(source)
        .into_iter()
        .filter_map(|line| tokens(source, line.span, MAX_LINE).ok())
        .filter(|list| !list.is_empty())
        .map(|list| list.iter().map(|lexeme| spelling(source, lexeme)).collect())
        .collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The programs of `run` that compile, by name; a file that does not is no proof of anything.
fn programs() -> BTreeMap<String, Rows> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(fixtures().join("run")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "scol") {
            continue;
        }
        let source = read(&path);
        let arm = if source.contains("\n' arm: scara") {
            Arm::Scara
        } else {
            Arm::SixAxis
        };
        let options = LanguageOptions {
            arm,
            ..LanguageOptions::default()
        };
        assert!(compile(&source, &options).program.is_some(), "{}", path.display());
        found.insert(
            path.file_stem().unwrap().to_str().unwrap().to_owned(),
            words_of(&source),
        );
    }
    found
}

#[test]
fn every_word_and_every_sign_occurs_in_a_program_that_runs() {
    let programs = programs();
    let used: BTreeSet<&str> = programs
        .values()
        .flatten()
        .flatten()
        .map(String::as_str)
        .collect();
    let words = builtin::words().filter(|word| *word != "REMARK");
    let signs = SIGNS.iter().map(|(sign, _)| *sign);
    let missing: Vec<&str> = words.chain(signs).filter(|word| !used.contains(word)).collect();
    assert!(
        missing.is_empty(),
        "no program of fixtures/scol/run uses {missing:?}"
    );
    assert!(
        builtin::words().count() > 120,
        "the tables of words were not found"
    );
    // Comments leave no words behind.
    let remark = read(&fixtures().join("run/comments.scol"));
    assert!(remark.contains("REMARK ") && remark.contains(" ' "));
}

/// Whether a pattern occurs in a line: words and signs in a row, `..` for anything between, `$` for the end.
fn occurs(pattern: &[&str], line: &[String]) -> bool {
    let Some((first, rest)) = pattern.split_first() else {
        return true;
    };
    match *first {
        ".." => (0..=line.len()).any(|from| line.get(from..).is_some_and(|tail| occurs(rest, tail))),
        "$" => line.is_empty(),
        word => line
            .split_first()
            .is_some_and(|(found, tail)| found == word && occurs(rest, tail)),
    }
}

fn holds(pattern: &str, rows: &Rows) -> bool {
    let mut pattern: Vec<&str> = pattern.split(' ').collect();
    if pattern.first() == Some(&"^") {
        pattern.remove(0);
    } else {
        pattern.insert(0, "..");
    }
    rows.iter().any(|line| occurs(&pattern, line))
}

#[test]
fn every_condition_of_with_is_used_there() {
    let programs = programs();
    let options = LanguageOptions::default();
    let mut conditions = 0;
    for word in builtin::words() {
        for value in ["1", "{1}"] {
            if parse_direct(&format!("READY WITH {word}={value}"), &options).is_err() {
                continue;
            }
            conditions += 1;
            let pattern = format!("WITH .. {word} =");
            assert!(
                programs.values().any(|rows| holds(&pattern, rows)),
                "no program of fixtures/scol/run moves WITH {word}"
            );
        }
    }
    assert!(conditions >= 7, "{conditions}");
}

struct Row {
    id: String,
    pattern: String,
    proofs: Vec<String>,
}

fn rows() -> Vec<Row> {
    let table = read(&fixtures().join("rows.tsv"));
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    assert_eq!(lines.next(), Some("id\tsection\titem\tpattern\tproof"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('\t').collect();
        let [id, section, item, pattern, proof] = cells[..] else {
            panic!("five columns expected: {line}")
        };
        assert!(!section.is_empty() && !item.is_empty(), "{line}");
        Row {
            id: id.to_owned(),
            pattern: pattern.to_owned(),
            proofs: proof.split(' ').map(ToOwned::to_owned).collect(),
        }
    };
    lines.map(row).collect()
}

/// The text of every test of the workspace.
fn tests() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut folders = Vec::from([root.join("crates"), root.join("tests")]);
    let mut text = String::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                text += &read(&path);
            }
        }
    }
    text
}

#[test]
fn every_row_of_the_language_has_its_programs() {
    let (programs, tests, rows) = (programs(), tests(), rows());
    let mut ids = BTreeSet::new();
    let mut wrong = Vec::new();
    for row in &rows {
        assert!(ids.insert(&row.id), "{} stands twice", row.id);
        assert!(
            !row.proofs.iter().all(String::is_empty),
            "{} has no proof",
            row.id
        );
        for proof in &row.proofs {
            let held = if let Some(name) = proof.strip_prefix("fn:") {
                tests.contains(&format!("    #[test]\n    fn {name}("))
                    || tests.contains(&format!("#[test]\nfn {name}("))
            } else if let Some(name) = proof.strip_prefix("talk:") {
                fixtures().join(format!("../transcripts/{name}.txt")).exists()
            } else if proof.contains('/') {
                let path = fixtures().join(format!("{proof}.scol"));
                path.exists() && (row.pattern.is_empty() || holds(&row.pattern, &words_of(&read(&path))))
            } else {
                let rows = programs.get(proof);
                rows.is_some_and(|rows| row.pattern.is_empty() || holds(&row.pattern, rows))
            };
            if !held {
                wrong.push(format!("{}: {proof} does not show `{}`", row.id, row.pattern));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(rows.len() >= 150, "{} rows", rows.len());
    let named: BTreeSet<&String> = rows.iter().flat_map(|row| &row.proofs).collect();
    let idle: Vec<&String> = programs.keys().filter(|name| !named.contains(name)).collect();
    assert!(idle.is_empty(), "no row names {idle:?}");
}
