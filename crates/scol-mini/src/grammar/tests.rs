//! The TextMate grammar of SCOL, for editors and for the page of the control interface.
//!
//! `editors/scol.tmLanguage.json` and the module `grammar.js` of the page are written from the tables of words and signs. A
//! test compares them, and another one colours all programs of the repository by the grammar and asks the lexer whether it
//! agrees. To write both files anew, and then review the difference:
//!
//! ```text
//! cargo test -p scol-mini -- --ignored bless_grammar
//! git diff editors crates/control/assets/ui/grammar.js
//! ```
//!
//! Editors differ in their regular expressions, so a pattern has only what Oniguruma and JavaScript both have: no
//! look-behind, no named group, and the flag `(?i)` at its beginning, which the page takes off.

#![expect(
    clippy::disallowed_methods,
    reason = "a test that cannot read its fixtures fails"
)]

use crate::builtin::{WordKind, word_kind, words};
use crate::lexer::{SIGNS, Sign, Token, lines, tokens};
use crate::{Arm, MAX_LINE};
use fancy_regex::{Captures, Regex};
use serde::Serialize;
use std::borrow::ToOwned;
use std::collections::BTreeMap;
use std::format;
use std::path::{Path, PathBuf};
use std::string::String;
use std::vec::Vec;

const EDITORS: &str = "editors/scol.tmLanguage.json";
const PAGE: &str = "crates/control/assets/ui/grammar.js";
const NAME: &str = "[A-Z][A-Z0-9_]*";
/// Kinds of `DIM ... AS`, and of the rows of DATA.
const KINDS: &str = "INTEGER|REAL|POINT|TRANS|PAYLOAD";
const ROWS: &str = "POINT|TRANS|PAYLOAD|WORK";
/// Scopes of names, and of what no program may contain.
const VARIABLE: &str = "variable.other.scol";
const LABEL: &str = "entity.name.label.scol";
const PROGRAM: &str = "entity.name.function.scol";
const ILLEGAL: &str = "invalid.illegal.scol";

#[derive(Serialize)]
struct Grammar {
    information_for_contributors: [&'static str; 1],
    name: &'static str,
    #[serde(rename = "scopeName")]
    scope_name: &'static str,
    #[serde(rename = "fileTypes")]
    file_types: [&'static str; 1],
    patterns: Vec<Rule>,
}

/// A pattern, its scope, and the scopes of its groups.
#[derive(Serialize)]
struct Rule {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'static str>,
    #[serde(rename = "match")]
    pattern: String,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    captures: BTreeMap<usize, Scope>,
}

#[derive(Serialize)]
struct Scope {
    name: &'static str,
}

fn rule(name: &'static str, pattern: &str) -> Rule {
    let letters = pattern.contains(|letter: char| letter.is_ascii_alphabetic());
    Rule {
        name: Some(name),
        pattern: format!("{}{pattern}", if letters { "(?i)" } else { "" }),
        captures: BTreeMap::new(),
    }
}

/// A rule whose groups have these scopes, from the first one on.
fn groups<const COUNT: usize>(pattern: &str, scopes: [&'static str; COUNT]) -> Rule {
    Rule {
        name: None,
        captures: (1..).zip(scopes.map(|name| Scope { name })).collect(),
        ..rule("", pattern)
    }
}

fn scope_of(kind: WordKind) -> &'static str {
    match kind {
        WordKind::Declaration => "storage.type.scol",
        WordKind::Flow => "keyword.control.scol",
        WordKind::Statement => "keyword.other.statement.scol",
        WordKind::Operator => "keyword.operator.word.scol",
        WordKind::Remark => "comment.line.scol",
        WordKind::Channel => "constant.language.channel.scol",
        WordKind::Function => "support.function.scol",
        WordKind::Variable => "variable.language.scol",
        WordKind::Condition => "support.variable.scol",
        WordKind::Constant => "constant.language.scol",
    }
}

fn scope_of_sign(sign: Sign) -> &'static str {
    match sign {
        Sign::Open | Sign::Close => "punctuation.section.parens.scol",
        Sign::OpenBrace | Sign::CloseBrace => "punctuation.section.braces.scol",
        Sign::Comma => "punctuation.separator.scol",
        Sign::Dot => "punctuation.accessor.scol",
        Sign::Colon => "punctuation.separator.label.scol",
        Sign::Plus | Sign::Minus | Sign::Star | Sign::Slash | Sign::Caret => {
            "keyword.operator.arithmetic.scol"
        }
        Sign::Assign => "keyword.operator.assignment.scol",
        Sign::Relation(_) => "keyword.operator.comparison.scol",
    }
}

/// The words of the language, sorted; `CRE` is none that a program can use.
fn sorted() -> Vec<&'static str> {
    let mut list: Vec<&str> = words().collect();
    list.sort_unstable();
    list.dedup();
    list
}

/// A sign as a pattern.
fn escaped(sign: &str) -> String {
    sign.chars()
        .map(|letter| format!("[{}{letter}]", if letter == '^' { "\\" } else { "" }))
        .collect()
}

/// The rules, in the order in which an engine tries them at one place.
fn rules() -> Vec<Rule> {
    let reserved = sorted().join("|");
    // Three levels: SUB(A(MAX(1,2))). Without an `=` after it, this is a call and no element of an array.
    let list = r"\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)";
    let call = format!(
        r"(?:(?:^|(:))\s*(?={NAME}\s*\()|(THEN|ELSE|DO)\s+)(?!(?:{reserved})\b)({NAME})(?=\s*(?:{list})?\s*(?:$|'|(?:ELSE|REMARK)\b))"
    );
    let declaration = scope_of(WordKind::Declaration);
    let flow = scope_of(WordKind::Flow);
    let mut rules = Vec::from([
        rule(scope_of(WordKind::Remark), r"'.*|REMARK\b.*"),
        groups(&format!(r"^\s*(PROGRAM)\s+({NAME})"), [declaration, PROGRAM]),
        groups(&format!(r"^\s*({NAME})(?=\s*:)"), [LABEL]),
        groups(&format!(r"^\s*({ROWS})(?=\s+[A-Z])"), [declaration]),
        groups(&format!(r"(AS)\s+({KINDS})\b"), [declaration, declaration]),
        groups(&format!(r"(GOTO)\s+({NAME})"), [flow, LABEL]),
        groups(
            r"(?:(?:^|(:))\s*|(THEN|ELSE)\s+)(ON)\b(?!\s*[:=])",
            [scope_of_sign(Sign::Colon), flow, flow],
        ),
        groups(&call, [scope_of_sign(Sign::Colon), flow, PROGRAM]),
        rule("string.quoted.double.scol", r#""[^"]*"?"#),
        rule(
            "constant.numeric.float.scol",
            r"(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:E[+-]?[0-9]+)?|[0-9]+E[+-]?[0-9]+",
        ),
        rule("constant.numeric.integer.scol", "[0-9]+"),
        groups(
            r"(\.)\s*([A-Z])(?![A-Z0-9_])",
            [scope_of_sign(Sign::Dot), "variable.other.member.scol"],
        ),
        rule(ILLEGAL, &format!(r"{NAME}[$]")),
        rule(scope_of(WordKind::Operator), r"MOD\b(?!\s*\()"),
    ]);
    let mut kinds: Vec<(&str, Vec<&str>)> = Vec::new();
    for word in sorted().into_iter().filter(|word| *word != "REMARK") {
        let kind = word_kind(word, Arm::SixAxis).unwrap();
        let scope = scope_of(kind);
        match kinds.iter_mut().find(|(known, _)| *known == scope) {
            Some((_, list)) => list.push(word),
            None => kinds.push((scope, Vec::from([word]))),
        }
    }
    for (scope, mut list) in kinds {
        // A configuration of a six-axis arm is five letters.
        list.extend((scope == scope_of(WordKind::Constant)).then_some("[LR][AB][NF][SD][SD]"));
        rules.push(rule(scope, &format!(r"(?:{})\b", list.join("|"))));
    }
    rules.push(rule(VARIABLE, NAME));
    let mut signs: Vec<(&str, Vec<String>)> = Vec::new();
    for (sign, meaning) in SIGNS {
        let scope = scope_of_sign(*meaning);
        match signs.iter_mut().find(|(known, _)| *known == scope) {
            Some((_, list)) => list.push(escaped(sign)),
            None => signs.push((scope, Vec::from([escaped(sign)]))),
        }
    }
    rules.extend(
        signs
            .into_iter()
            .map(|(scope, list)| rule(scope, &list.join("|"))),
    );
    rules.push(rule(ILLEGAL, r"\S"));
    rules
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The generated files, each with its text.
fn generated() -> [(&'static str, String); 2] {
    let grammar = Grammar {
        information_for_contributors: [
            "Generated from the tables of words and signs in crates/scol-mini: cargo test -p scol-mini -- --ignored bless_grammar",
        ],
        name: "SCOL",
        scope_name: "source.scol",
        file_types: ["scol"],
        patterns: rules(),
    };
    let module = format!(
        "// Generated by cargo test -p scol-mini -- --ignored bless_grammar. The rules of editors/scol.tmLanguage.json, and the words.\n\n\
         export const RULES = {};\nexport const WORDS = {};\n",
        serde_json::to_string(&grammar.patterns).unwrap(),
        serde_json::to_string(&sorted()).unwrap(),
    );
    [
        (EDITORS, serde_json::to_string_pretty(&grammar).unwrap() + "\n"),
        (PAGE, module),
    ]
}

#[test]
fn the_generated_files_are_up_to_date() {
    for (path, text) in generated() {
        assert!(
            read(&root().join(path)) == text,
            "{path} is stale; cargo test -p scol-mini -- --ignored bless_grammar writes it"
        );
    }
}

#[test]
fn patterns_have_only_what_every_editor_reads() {
    for rule in rules() {
        let pattern = rule.pattern.strip_prefix("(?i)").unwrap_or(&rule.pattern);
        for foreign in ["(?<", "(?i", "(?P", "(?>", "\\G", "\\h", "\\K", "\\p"] {
            assert!(!pattern.contains(foreign), "{pattern} has {foreign}");
        }
    }
}

#[test]
#[ignore = "writes the grammar anew; review the difference"]
fn bless_grammar() {
    for (path, text) in generated() {
        std::fs::write(root().join(path), text).unwrap();
    }
}

/// The rules as an engine of an editor applies them to a line.
struct Engine(Vec<(Regex, Rule)>);

impl Engine {
    fn new() -> Self {
        let compiled = |rule: Rule| (Regex::new(&rule.pattern).unwrap(), rule);
        Self(rules().into_iter().map(compiled).collect())
    }

    /// The scope of each byte; empty where a byte has none.
    fn scopes(&self, line: &str) -> Vec<&'static str> {
        let mut scopes = std::vec![""; line.len()];
        let mut at = 0;
        // The leftmost match wins, and among those the first rule.
        while let Some((found, rule)) = self.next(line, at) {
            let whole = found.get(0).unwrap();
            assert!(
                !whole.range().is_empty(),
                "{line}: {} takes nothing",
                rule.pattern
            );
            scopes[whole.range()].fill(rule.name.unwrap_or_default());
            for (number, scope) in &rule.captures {
                if let Some(group) = found.get(*number) {
                    scopes[group.range()].fill(scope.name);
                }
            }
            at = whole.end();
        }
        scopes
    }

    fn next<'a>(&self, line: &'a str, at: usize) -> Option<(Captures<'a, str>, &Rule)> {
        let found = self.0.iter().filter_map(|(regex, rule)| {
            let found = regex.captures_from_pos(line, at).unwrap()?;
            Some((found, rule))
        });
        found.min_by_key(|(found, _)| found.get(0).unwrap().start())
    }
}

/// Sources of the repository, each with its name: programs of the fixtures, and blocks of the book.
fn sources() -> Vec<(String, String)> {
    let (mut folders, mut found) = (
        Vec::from([root().join("fixtures/scol"), root().join("docs")]),
        Vec::new(),
    );
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = format!("{}", path.display());
            match path.extension().and_then(|extension| extension.to_str()) {
                _ if path.is_dir() => folders.push(path),
                Some("scol") => found.push((
                    name,
                    String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned(),
                )),
                Some("md") => found.extend(blocks(&read(&path)).map(|text| (name.clone(), text))),
                _ => {}
            }
        }
    }
    found
}

/// The blocks of SCOL in a page.
fn blocks(page: &str) -> impl Iterator<Item = String> {
    let parts = page.split("\n```scol\n").skip(1);
    parts.map(|part| part.split("\n```").next().unwrap_or_default().to_owned())
}

/// Whether the scope of a word is right for what the tables say it is.
fn agrees(word: &str, scope: &str) -> bool {
    let is_place = [LABEL, PROGRAM].contains(&scope);
    let is_row = scope == scope_of(WordKind::Declaration)
        && format!("{KINDS}|{ROWS}").split('|').any(|row| row == word);
    match word_kind(word, Arm::SixAxis) {
        _ if is_place || is_row => true,
        Some(_) if word == "MOD" && scope == scope_of(WordKind::Operator) => true,
        // A monitor begins with it.
        Some(_) if word == "ON" && scope == scope_of(WordKind::Flow) => true,
        // CRE is reserved, and of no use.
        Some(_) if word == "CRE" => scope == VARIABLE,
        Some(kind) => scope == scope_of(kind),
        None => scope == VARIABLE || scope == "variable.other.member.scol",
    }
}

#[test]
fn the_grammar_sees_the_words_that_the_lexer_sees() {
    let engine = Engine::new();
    let mut words = 0;
    for (name, source) in sources() {
        for line in lines(&source) {
            let text = line.span.text(&source);
            let scopes = engine.scopes(text);
            let Ok(list) = tokens(&source, line.span, MAX_LINE) else {
                continue;
            };
            let mut at = 0;
            for lexeme in &list {
                let (start, end) = (
                    lexeme.span.start - line.span.start,
                    lexeme.span.end - line.span.start,
                );
                assert!(
                    scopes[at..start].iter().all(|scope| scope.is_empty()),
                    "{name}: {text}: {scopes:?}"
                );
                at = end;
                for scope in &scopes[start..end] {
                    let right = match &lexeme.token {
                        Token::Word(word) => agrees(word, scope),
                        Token::Integer(_) => *scope == "constant.numeric.integer.scol",
                        Token::Real(_) => *scope == "constant.numeric.float.scol",
                        Token::Text(_) => *scope == "string.quoted.double.scol",
                        Token::Sign(sign) => *scope == scope_of_sign(*sign),
                    };
                    assert!(right, "{name}: {text}: {} is {scope:?}", &text[start..end]);
                }
                words += 1;
            }
            let rest = text[at..].trim();
            let is_comment = scopes[at..]
                .iter()
                .all(|scope| [scope_of(WordKind::Remark), ""].contains(scope));
            assert!(
                is_comment && (rest.is_empty() || !scopes[text.len() - 1].is_empty()),
                "{name}: {text}: {scopes:?}"
            );
        }
    }
    assert!(words > 10_000, "only {words} words were seen");
}

#[test]
fn places_and_monitors_are_told_from_names_and_constants() {
    let engine = Engine::new();
    let (mut labels, mut calls, mut monitors) = (0, 0, 0);
    let is_right = |name: &str| !name.contains("/err/") && !name.ends_with(".md");
    for (name, source) in sources().into_iter().filter(|(name, _)| is_right(name)) {
        let outline = crate::outline::Outline::new(&source);
        let programs: Vec<&str> = outline.parts.iter().map(crate::outline::Part::name).collect();
        let rows = outline.parts.iter().flat_map(|part| &part.rows);
        let known: Vec<&str> = rows
            .filter_map(|row| Some(row.label.as_ref()?.text.as_str()))
            .collect();
        for line in lines(&source) {
            let Ok(list) = tokens(&source, line.span, MAX_LINE) else {
                continue;
            };
            let scopes = engine.scopes(line.span.text(&source));
            for (at, lexeme) in list.iter().enumerate() {
                let word = lexeme.word();
                let follows = |sign| list.get(at + 1).is_some_and(|next| next.is(sign));
                match scopes[lexeme.span.start - line.span.start] {
                    LABEL => {
                        assert!(known.contains(&word), "{name}: {word} is no label");
                        labels += 1;
                    }
                    PROGRAM => {
                        assert!(programs.contains(&word), "{name}: {word} is no program");
                        calls += 1;
                    }
                    scope if word == "ON" => {
                        let first = at == 0
                            || ["THEN", "ELSE"].contains(&list[at - 1].word())
                            || list[at - 1].is(Sign::Colon);
                        assert_eq!(first, scope == scope_of(WordKind::Flow), "{name}: ON is {scope}");
                        monitors += usize::from(first);
                    }
                    scope => {
                        let begins =
                            at == 0 && (follows(Sign::Colon) || list.len() > 1 && programs.contains(&word));
                        assert!(!begins || follows(Sign::Assign), "{name}: {word} is {scope}");
                    }
                }
            }
        }
    }
    assert!(
        labels > 60 && calls > 100 && monitors > 20,
        "{labels} labels, {calls} calls and {monitors} monitors were seen"
    );
}
